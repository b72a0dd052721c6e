//! Small meshes on integer positions.

use super::random::Random;

/// The shapes that the random MTs are made from.
#[derive(Clone, Copy, Debug)]
pub enum Domain {
    /// One tetrahedron: nothing to collapse.
    SingleTet,
    /// A cube of `n³` cells.
    Cube(usize),
    /// An L of three blocks of `n³` cells: not convex.
    Ell(usize),
    /// Two cubes of `n³` cells that do not touch.
    TwoComponents(usize),
    /// A ring of eight blocks of one cell: a hole through the domain.
    Ring,
}

/// Bits of the lattice that the domains lie on.
pub const POSITION_BITS: u32 = 10;

/// Vertices on the lattice and positive tetrahedra.
#[derive(Clone, Debug)]
pub struct PlainMesh {
    pub positions: Vec<[i32; 3]>,
    pub tets: Vec<[u32; 4]>,
}

impl Domain {
    /// One of each shape, and a second cube; small ones.
    pub const SMALL: [Self; 6] =
        [Self::SingleTet, Self::Cube(2), Self::Cube(3), Self::Ell(1), Self::TwoComponents(2), Self::Ring];

    /// The mesh of the domain; inner vertices are moved a little.
    pub fn mesh(self, random: &mut Random) -> PlainMesh {
        let everywhere = |_: [usize; 3]| true;
        match self {
            Self::SingleTet => PlainMesh {
                positions: vec![[0, 0, 0], [512, 3, 0], [0, 700, 1], [5, 0, 900]],
                tets: vec![[0, 1, 2, 3]],
            },
            Self::Cube(n) => cells([n; 3], random, everywhere),
            Self::Ell(n) => cells([2 * n, 2 * n, n], random, |c| c[0] < n || c[1] < n),
            Self::TwoComponents(n) => cells([2 * n + 1, n, n], random, |c| c[0] != n),
            Self::Ring => cells([3, 3, 1], random, |c| c[0] != 1 || c[1] != 1),
        }
    }
}

/// The grid cells that `inside` wants, each split into six Kuhn tetrahedra.
fn cells(dims: [usize; 3], random: &mut Random, inside: impl Fn([usize; 3]) -> bool) -> PlainMesh {
    let point = |c: [usize; 3]| c[0] + (dims[0] + 1) * (c[1] + (dims[1] + 1) * c[2]);
    let mut corners: Vec<[usize; 4]> = Vec::new();
    for z in 0..dims[2] {
        for y in 0..dims[1] {
            for x in (0..dims[0]).filter(|&x| inside([x, y, z])) {
                for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [1, 0, 2], [2, 1, 0]] {
                    let mut at = [x, y, z];
                    let mut tet = [point(at); 4];
                    for (i, axis) in order.into_iter().enumerate() {
                        at[axis] += 1;
                        tet[i + 1] = point(at);
                    }
                    corners.push(tet);
                }
            }
        }
    }
    let mut used: Vec<usize> = corners.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let step = (1 << POSITION_BITS) / *dims.iter().max().unwrap_or(&1) as i32;
    let position = |point: usize, random: &mut Random| {
        let c = [
            point % (dims[0] + 1),
            point / (dims[0] + 1) % (dims[1] + 1),
            point / ((dims[0] + 1) * (dims[1] + 1)),
        ];
        let inner = (0..3).all(|i| c[i] > 0 && c[i] < dims[i])
            && (0..8).all(|k| inside([0, 1, 2].map(|i| c[i] - (k >> i & 1))));
        let wobble = if inner { step / 16 } else { 0 };
        [0, 1, 2].map(|i| c[i] as i32 * step + random.between(-wobble, wobble))
    };
    let positions: Vec<[i32; 3]> = used.iter().map(|&p| position(p, random)).collect();
    let number = |p: usize| used.binary_search(&p).expect("every corner is used") as u32;
    let mut tets: Vec<[u32; 4]> = corners.iter().map(|tet| tet.map(number)).collect();
    for tet in &mut tets {
        if volume6(tet.map(|v| positions[v as usize])) < 0 {
            tet.swap(2, 3);
        }
    }
    PlainMesh { positions, tets }
}

/// Six times the signed volume.
pub fn volume6([a, b, c, d]: [[i32; 3]; 4]) -> i128 {
    let [u, v, w] = [b, c, d].map(|p| [0, 1, 2].map(|i| i128::from(p[i]) - i128::from(a[i])));
    u[0] * (v[1] * w[2] - v[2] * w[1])
        + u[1] * (v[2] * w[0] - v[0] * w[2])
        + u[2] * (v[0] * w[1] - v[1] * w[0])
}

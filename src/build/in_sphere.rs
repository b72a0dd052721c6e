//! Inside or outside of a sphere, exactly, and never on it.

use crate::geom::orient3d;

/// Differences of at most this many bits have their determinants computed in `i64`.
const NARROW_BITS: u32 = 11;
/// Lattices finer than this overflow `i128`.
const WIDEST_BITS: u32 = 23;

/// Tells inside from outside of circumspheres for the points of one lattice.
pub(super) struct InSphere {
    /// Bits that are zero in every coordinate.
    shift: u32,
    narrow: bool,
}

impl InSphere {
    /// None if the lattice is too fine for the arithmetic.
    pub fn new(positions: &[[i32; 3]]) -> Option<Self> {
        let used = positions.iter().flatten().fold(0, |bits, &x| bits | x);
        let shift = if used == 0 { 0 } else { used.trailing_zeros() };
        let bits = i32::BITS - (used >> shift).leading_zeros();
        (bits <= WIDEST_BITS + 1).then_some(Self { shift, narrow: bits <= NARROW_BITS })
    }

    /// Whether `e` is inside the sphere through the corners of the positive tetrahedron `abcd`.
    ///
    /// On the sphere the answer is that of points whose lifted heights are lowered by infinitesimal amounts, the more
    /// the smaller the point in lexicographic order: consistent for all points at once, and such that a cube is cut as
    /// Kuhn does it. (Devillers, Teillaud: *Perturbations for Delaunay and weighted Delaunay 3D triangulations*, 2011.)
    pub fn contains(&self, [a, b, c, d]: [[i32; 3]; 4], e: [i32; 3]) -> bool {
        let [a, b, c, d] = [a, b, c, d];
        let sign = if self.narrow {
            self.determinant_i64([a, b, c, d], e).signum()
        } else {
            self.determinant_i128([a, b, c, d], e).signum() as i64
        };
        if sign != 0 { sign > 0 } else { perturbed([a, b, c, d], e) }
    }

    /// Differences below 2^11: squares sum to less than 2^24, minors stay below 2^35, so that the sum of four products
    /// stays below 2^61.
    fn determinant_i64(&self, corners: [[i32; 3]; 4], e: [i32; 3]) -> i64 {
        let rows = corners.map(|p| [0, 1, 2].map(|i| i64::from((p[i] - e[i]) >> self.shift)));
        let [a, b, c, d] = rows;
        let lift = |p: [i64; 3]| p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
        let minor = |p: [i64; 3], q: [i64; 3], r: [i64; 3]| {
            p[0] * (q[1] * r[2] - q[2] * r[1])
                + p[1] * (q[2] * r[0] - q[0] * r[2])
                + p[2] * (q[0] * r[1] - q[1] * r[0])
        };
        lift(a) * minor(b, c, d) - lift(b) * minor(a, c, d) + lift(c) * minor(a, b, d)
            - lift(d) * minor(a, b, c)
    }

    /// Differences below 2^24: squares sum to less than 2^50, minors stay below 2^75, four products below 2^127.
    fn determinant_i128(&self, corners: [[i32; 3]; 4], e: [i32; 3]) -> i128 {
        let rows = corners.map(|p| [0, 1, 2].map(|i| i64::from((p[i] - e[i]) >> self.shift)));
        let [a, b, c, d] = rows;
        let lift = |p: [i64; 3]| i128::from(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
        let minor = |p: [i64; 3], q: [i64; 3], r: [i64; 3]| {
            i128::from(p[0]) * i128::from(q[1] * r[2] - q[2] * r[1])
                + i128::from(p[1]) * i128::from(q[2] * r[0] - q[0] * r[2])
                + i128::from(p[2]) * i128::from(q[0] * r[1] - q[1] * r[0])
        };
        lift(a) * minor(b, c, d) - lift(b) * minor(a, c, d) + lift(c) * minor(a, b, d)
            - lift(d) * minor(a, b, c)
    }
}

/// The answer for five points on a sphere: that of the first of them, in lexicographic order, whose lift counts.
fn perturbed(corners: [[i32; 3]; 4], e: [i32; 3]) -> bool {
    let mut order = [0, 1, 2, 3, 4];
    let point = |i: usize| if i == 4 { e } else { corners[i] };
    order.sort_unstable_by_key(|&i| point(i));
    for i in order {
        if i == 4 {
            return true;
        }
        let mut others = corners;
        others[i] = e;
        let [a, b, c, d] = others;
        let share = orient3d(a, b, c, d);
        if share != 0 {
            return share < 0;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both sides of every face of a cube's perturbed Delaunay triangulation agree, and there are Kuhn's six.
    #[test]
    fn a_cube_is_cut_into_six() {
        for bits in [0, 3, 10, 22] {
            let corner = |i: usize| [i & 1, i >> 1 & 1, i >> 2].map(|b| (b as i32) << bits);
            let cube: Vec<[i32; 3]> = (0..8).map(corner).collect();
            let near = [cube.clone(), vec![[1, 1, 1], [(1 << bits) + 1; 3]]].concat();
            for spheres in [InSphere::new(&cube), InSphere::new(&near)] {
                let spheres = spheres.expect("few bits");
                let mut found = Vec::new();
                for code in 0..4096_usize {
                    let t = [0, 3, 6, 9].map(|shift| code >> shift & 7);
                    let [a, b, c, d] = t.map(|i| cube[i]);
                    if !t.is_sorted() || orient3d(a, b, c, d) == 0 {
                        continue;
                    }
                    let positive = if orient3d(a, b, c, d) > 0 { [a, b, c, d] } else { [b, a, c, d] };
                    let others = (0..8).filter(|i| !t.contains(i));
                    if others.into_iter().all(|i| !spheres.contains(positive, cube[i])) {
                        found.push(t);
                    }
                }
                assert_eq!(found.len(), 6, "{found:?}");
                assert!(found.iter().all(|t| t[0] == 0 && t[3] == 7), "{found:?}");
            }
        }
    }

    #[test]
    fn near_and_far_points_on_every_lattice() {
        for bits in [3, 10, 16, 23] {
            let m = 1 << bits;
            let tet = [[0, 0, 0], [m, 0, 0], [0, m, 0], [0, 0, m]];
            let all = [&tet[..], &[[1, 1, 1], [m, m, m]]].concat();
            let spheres = InSphere::new(&all).expect("few bits");
            assert!(spheres.contains(tet, [1, 1, 1]));
            assert!(spheres.contains(tet, [m - 1, m - 1, m]));
            if m < 1 << 23 {
                assert!(!spheres.contains(tet, [m, m, m + 1]));
            }
        }
    }
}

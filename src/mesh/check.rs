//! Is this a valid conforming mesh? And the exact side tests on `f64` that the answer needs.

use robust::{Coord, Coord3D};

use crate::mesh::adjacency::{FaceTable, HalfFace, check_indices, crowded, face_of, match_faces};
use crate::mesh::adjacency::{Topology, topology_of};
use crate::mesh::{MeshError, TetMesh};
use crate::threads;

/// Checks that `mesh` is valid: fields and indices fit, every tetrahedron is positive (decided exactly), and
/// every face has at most two tetrahedra, which lie on opposite sides of it.
///
/// Vertices and edges where the boundary touches itself are allowed; [`crate::mesh::topology`] marks them.
///
/// # Errors
/// The first thing that is wrong.
pub fn check(mesh: &TetMesh) -> Result<(), MeshError> {
    check_neighbors(mesh).map(drop)
}

/// Checks as [`check`] does that a mesh is valid, and works out its [`Topology`].
#[doc(hidden)]
pub fn check_topology(mesh: &TetMesh) -> Result<Topology, MeshError> {
    Ok(topology_of(mesh.positions.len(), &mesh.tets, check_neighbors(mesh)?))
}

/// Tetrahedra whose sides are checked together.
const SHARE: usize = 1 << 14;

/// [`check`], and the neighbours of each tetrahedron.
fn check_neighbors(mesh: &TetMesh) -> Result<Vec<[u32; 4]>, MeshError> {
    check_tets(mesh).map_err(|error| error.in_input(|tet| mesh.input.cells.cell_of(tet)))
}

/// The neighbours of each tetrahedron of a mesh that is valid, with the numbers of tetrahedra in errors.
fn check_tets(mesh: &TetMesh) -> Result<Vec<[u32; 4]>, MeshError> {
    check_arrays(mesh)?;
    let sides = Sides::new(&mesh.positions);
    let wrong = |t: usize| match sides.of(mesh.tets[t]) {
        1 => None,
        0 => Some(MeshError::Flat { tet: (t as u32).into() }),
        _ => Some(MeshError::Inverted { tet: (t as u32).into() }),
    };
    let wrong = threads::map(mesh.tets.len(), SHARE, |mut tets| tets.find_map(wrong));
    wrong.into_iter().flatten().next().map_or(Ok(()), Err)?;
    let fits = |group: &[HalfFace], folded: bool| match group {
        [a, b] if folded => Err(MeshError::Folded { tets: [a, b].map(|face| face.tet().into()) }),
        [_, _] => Ok(()),
        _ => Err(crowded(group)),
    };
    match_faces(&FaceTable::new(&mesh.tets)?, fits)
}

/// Checks what holds before geometry is looked at: lengths, finite coordinates, indices in range.
#[doc(hidden)]
pub fn check_arrays(mesh: &TetMesh) -> Result<(), MeshError> {
    if mesh.tets.is_empty() {
        return Err(MeshError::Empty);
    }
    let points = mesh.positions.len();
    if let Some(field) = mesh.fields.iter().find(|f| f.values.len() != points) {
        let (field, values) = (field.name.clone(), field.values.len());
        return Err(MeshError::FieldLength { field, values, points });
    }
    let cells = mesh.tets.len();
    if let Some(field) = mesh.cell_fields.iter().find(|f| ![0, cells].contains(&f.values.len())) {
        let (field, values) = (field.name.clone(), field.values.len());
        return Err(MeshError::CellFieldLength { field, values, cells });
    }
    if let Some(point) = mesh.positions.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        return Err(MeshError::NotFinite { point });
    }
    check_indices(points, &mesh.tets)
}

/// Exact side tests over a set of positions.
///
/// Exact as long as no product of coordinate differences underflows; coordinates are scaled by a power of two
/// (which is exact) so that neither the largest overflows nor, short of a detail 10^-90 of the model's size, the
/// smallest underflows.
pub(crate) struct Sides<'a> {
    positions: &'a [[f64; 3]],
    scale: f64,
}

impl<'a> Sides<'a> {
    /// Side tests over `positions`, all finite.
    pub fn new(positions: &'a [[f64; 3]]) -> Self {
        Self { positions, scale: scale_of(positions) }
    }

    fn point(&self, v: u32) -> [f64; 3] {
        self.positions[v as usize].map(|x| x * self.scale)
    }

    /// 1 for a positive tetrahedron, -1 for an inverted one, 0 for a flat one.
    pub fn of(&self, tet: [u32; 4]) -> i32 {
        side_of(tet.map(|v| self.positions[v as usize]), self.scale)
    }

    /// For a flat tetrahedron, which side of its plane each face looks to (1 or -1); 0 for faces without area.
    pub fn flat_faces(&self, tet: [u32; 4]) -> [i32; 4] {
        // Four points of one plane: a projection along an axis either flattens all faces or none of those
        // that have an area.
        let project = |u: usize, v: usize| {
            [0, 1, 2, 3].map(|face| {
                let [a, b, c] = face_of(tet, face).map(|p| {
                    let p = self.point(p);
                    Coord { x: p[u], y: p[v] }
                });
                sign(robust::orient2d(a, b, c))
            })
        };
        [(0, 1), (1, 2), (2, 0)]
            .map(|(u, v)| project(u, v))
            .into_iter()
            .find(|s| *s != [0; 4])
            .unwrap_or([0; 4])
    }
}

/// What coordinates are multiplied by for exact side tests.
pub(super) fn scale_of(positions: &[[f64; 3]]) -> f64 {
    let largest = positions.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
    // Ordinary coordinates need no scaling; the bounds leave room for products of three differences.
    let ordinary = largest == 0.0 || (1e-60..1e90).contains(&largest);
    if ordinary { 1.0 } else { power_of_two_near(largest.recip()) }
}

/// 1 for a tetrahedron that is positive with its vertices in these places, -1 for an inverted one, 0 for a flat one.
pub(super) fn side_of(places: [[f64; 3]; 4], scale: f64) -> i32 {
    let [a, b, c, d] = places.map(|place| {
        let [x, y, z] = place.map(|x| x * scale);
        Coord3D { x, y, z }
    });
    // Shewchuk's sign is positive when `d` lies below `abc`, ours when it lies above.
    sign(-robust::orient3d(a, b, c, d))
}

fn sign(x: f64) -> i32 {
    if x > 0.0 {
        1
    } else if x < 0.0 {
        -1
    } else {
        0
    }
}

/// A power of two within a factor of two of `x`, or the closest one to it that is a normal number.
fn power_of_two_near(x: f64) -> f64 {
    const EXPONENT: u64 = 0x7ff << 52;
    f64::from_bits(x.clamp(f64::MIN_POSITIVE, f64::MAX).to_bits() & EXPONENT)
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    #[test]
    fn the_sign_follows_the_convention() {
        let sides = Sides::new(&UNIT);
        assert_eq!(sides.of([0, 1, 2, 3]), 1);
        assert_eq!(sides.of([1, 0, 2, 3]), -1);
        assert_eq!(sides.of([0, 1, 2, 2]), 0);
    }

    #[test]
    fn signs_are_exact_at_every_scale() {
        for scale in [1e-300, 1e-120, 1e-30, 1.0, 1e30, 1e120, 1e300] {
            let at = |z: f64| {
                let p = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.1], [0.0, 0.1, 0.1], [0.3, 0.3, z]];
                p.map(|p| p.map(|x| x * scale))
            };
            let flat = 0.3 * 2.0 * scale;
            let up = at(0.6).map(|p| if p[0] == 0.3 * scale { [p[0], p[1], flat.next_up()] } else { p });
            assert_eq!(Sides::new(&up).of([0, 1, 2, 3]), 1, "scale {scale}");
            let down = at(0.6).map(|p| if p[0] == 0.3 * scale { [p[0], p[1], 0.5 * scale] } else { p });
            assert_eq!(Sides::new(&down).of([0, 1, 2, 3]), -1, "scale {scale}");
        }
    }

    #[test]
    fn a_flat_quad_looks_up_with_two_faces_and_down_with_two() {
        let square = [[0.0, 0.0, 2.0], [1.0, 0.0, 2.0], [1.0, 1.0, 2.0], [0.0, 1.0, 2.0]];
        let mut faces = Sides::new(&square).flat_faces([0, 1, 2, 3]);
        faces.sort_unstable();
        assert_eq!(faces, [-1, -1, 1, 1]);
        let line = [[0.0; 3], [1.0; 3], [2.0; 3], [3.0; 3]];
        assert_eq!(Sides::new(&line).flat_faces([0, 1, 2, 3]), [0; 4]);
    }

    #[test]
    fn each_defect_is_found() {
        let good = TetMesh { positions: UNIT.to_vec(), tets: vec![[0, 1, 2, 3]], ..TetMesh::default() };
        assert_eq!(check(&good), Ok(()));
        let with = |tets: Vec<[u32; 4]>| check(&TetMesh { tets, ..good.clone() }).unwrap_err();
        assert_eq!(with(vec![]), MeshError::Empty);
        assert_eq!(with(vec![[0, 1, 2, 4]]), MeshError::MissingPoint { tet: 0.into(), point: 4, points: 4 });
        assert_eq!(with(vec![[0, 1, 2, 3], [0, 2, 1, 3]]), MeshError::Inverted { tet: 1.into() });
        assert_eq!(with(vec![[0, 1, 2, 2]]), MeshError::Flat { tet: 0.into() });
        assert_eq!(with(vec![[0, 1, 2, 3], [1, 2, 0, 3]]), MeshError::Folded { tets: [0.into(), 1.into()] });
    }
}

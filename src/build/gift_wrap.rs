//! Filling a hole by the Delaunay criterion, tetrahedron by tetrahedron from its faces.

use super::hole::Filling;
use super::hole::Hole;
use super::hole::sorted;
use super::in_sphere::InSphere;
use crate::geom::orient3d;
use crate::mesh::FACES;
use crate::mesh::NONE;

/// The most tetrahedra that fill a hole.
const MAX_FILLING: usize = 128;

/// Fills holes; holds scratch space.
pub(super) struct GiftWrap {
    spheres: InSphere,
    /// Faces that still need a tetrahedron on the side to which they are positive.
    open: Vec<OpenFace>,
}

/// A face with its vertices in increasing order, too, and the tetrahedron behind it: [`NONE`] outside of the hole.
struct OpenFace {
    face: [u32; 3],
    key: [u32; 3],
    behind: u32,
}

impl GiftWrap {
    /// None if the lattice is too fine for it.
    pub fn new(positions: &[[i32; 3]]) -> Option<Self> {
        Some(Self { spheres: InSphere::new(positions)?, open: Vec::new() })
    }

    /// Fills a hole: false if the Delaunay tetrahedra of its vertices do not fit it, or its boundary is curved.
    pub fn fill(&mut self, hole: &Hole, positions: &[[i32; 3]], filling: &mut Filling) -> bool {
        filling.clear();
        if !hole.is_flat() {
            return false;
        }
        let Self { spheres, open } = self;
        let at = |v: u32| positions[v as usize];
        open.clear();
        let faces = hole.faces.iter();
        open.extend(faces.map(|&(face, _)| OpenFace { face, key: sorted(face), behind: NONE }));
        while let Some(OpenFace { face, behind, .. }) = open.pop() {
            let [x, y, z] = face.map(at);
            if hole.on_boundary() && behind != NONE && hole.in_plane([x, y, z]) {
                filling.border.push((behind, face));
                continue;
            }
            let mut apex = None;
            for &v in &hole.link {
                let p = at(v);
                let nearer = match apex {
                    None => true,
                    Some(best) => spheres.contains([x, y, z, at(best)], p),
                };
                if orient3d(x, y, z, p) > 0 && nearer {
                    apex = Some(v);
                }
            }
            let Some(apex) = apex else { return false };
            let t = filling.tets.len();
            if t == MAX_FILLING {
                return false;
            }
            let tet = [face[0], face[1], face[2], apex];
            filling.tets.push(tet);
            for face in &FACES[..3] {
                let outward = face.map(|k| tet[k]);
                let key = sorted(outward);
                match open.iter().position(|other| other.key == key) {
                    Some(i) if faces_back(open[i].face, outward) => _ = open.swap_remove(i),
                    Some(_) => return false,
                    None => open.push(OpenFace { face: outward, key, behind: t as u32 }),
                }
            }
        }
        filling.moved = filling.border.len();
        fits(hole, positions, &filling.tets) && lay_border(hole, filling)
    }
}

/// Whether two orders of a triangle's corners are those seen from its two sides.
fn faces_back([x, y, z]: [u32; 3], other: [u32; 3]) -> bool {
    [[x, z, y], [z, y, x], [y, x, z]].contains(&other)
}

/// Whether the tetrahedra are as large as the hole.
fn fits(hole: &Hole, positions: &[[i32; 3]], tets: &[[u32; 4]]) -> bool {
    let six = |tet: [u32; 4]| {
        let [a, b, c, d] = tet.map(|v| positions[v as usize]);
        orient3d(a, b, c, d)
    };
    let whole: i128 = hole.faces.iter().map(|&([x, y, z], _)| six([x, y, z, hole.a])).sum();
    whole == tets.iter().copied().map(six).sum()
}

/// The triangles of the filling that were on the boundary before.
fn lay_border(hole: &Hole, filling: &mut Filling) -> bool {
    for &([x, y, z], _) in hole.faces.iter().filter(|(_, outer)| *outer == NONE) {
        let owner = filling.tets.iter().position(|tet| [x, y, z].iter().all(|v| tet.contains(v)));
        let Some(cell) = owner else { return false };
        filling.border.push((cell as u32, [x, z, y]));
    }
    true
}

//! Filling a hole by contracting an edge: all that was at its one end moves to the other, which stays where it is.

use super::collapse_check::VertexMarks;
use super::hole::{Filling, Hole};
use super::work_mesh::{StarTet, TetSet, WorkMesh};
use crate::mesh::NONE;

const NEAR_A: u32 = 1;
const ON_FAN: u32 = 2;
const BORDER_A: u32 = 4;
const FAN_END: u32 = 8;

/// Around larger stars than this no edge along the boundary is contracted.
const LARGEST_STAR: usize = 512;

/// Fills the hole with tetrahedra at its link vertex `b`: false if one of them were not positive, or the boundary does
/// not allow it.
///
/// Inside, positive tetrahedra are all it takes: the hole is then star-shaped around `b`, too. Next to the boundary,
/// which may have come to overlap itself, [`keeps_topology`] must hold, too.
pub(super) fn contract(hole: &Hole, positions: &[[i32; 3]], b: u32, filling: &mut Filling) -> bool {
    filling.clear();
    if hole.on_boundary() && hole.border.iter().flatten().filter(|&&v| v == b).count() != 2 {
        // An edge through the inside between two boundary vertices, or from the boundary into the inside.
        return false;
    }
    let p = positions[b as usize];
    for (i, &(face, _)) in hole.faces.iter().enumerate() {
        if !face.contains(&b) {
            if !hole.is_seen(i, p) {
                return false;
            }
            filling.tets.push([face[0], face[1], face[2], b]);
        }
    }
    !filling.tets.is_empty()
        && (!hole.on_boundary() || hangs_together(&filling.tets, b))
        && lay_border(hole, b, filling)
}

/// Whether these tetrahedra, which all have `b`, are connected through faces. At the boundary the fan between the two
/// ends may part the hole; an insertion finds what it removes by going through faces.
fn hangs_together(tets: &[[u32; 4]], b: u32) -> bool {
    let mut reached = vec![false; tets.len()];
    let mut stack = vec![0];
    let mut count = 0;
    while let Some(i) = stack.pop() {
        if std::mem::replace(&mut reached[i], true) {
            continue;
        }
        count += 1;
        let shared = |other: &[u32; 4]| other.iter().filter(|&&v| v != b && tets[i].contains(&v)).count();
        stack.extend((0..tets.len()).filter(|&j| !reached[j] && shared(&tets[j]) == 2));
    }
    count == tets.len()
}

/// The boundary triangles of a filling. False if one of them would belong to a tetrahedron outside of the hole.
fn lay_border(hole: &Hole, b: u32, filling: &mut Filling) -> bool {
    let Filling { tets, border, moved } = filling;
    for &[x, y] in hole.border.iter().filter(|edge| !edge.contains(&b)) {
        let Some(cell) = tets.iter().position(|tet| tet.contains(&x) && tet.contains(&y)) else {
            return false;
        };
        border.push((cell as u32, [b, x, y]));
    }
    *moved = border.len();
    for &([x, y, z], _) in hole.faces.iter().filter(|(_, outer)| *outer == NONE) {
        let owner = tets.iter().position(|tet| [x, y, z].iter().all(|v| tet.contains(v)));
        let Some(cell) = owner else { return false };
        border.push((cell as u32, [x, z, y]));
    }
    true
}

/// Scratch space of [`keeps_topology`].
pub(super) struct Nearby {
    marks: VertexMarks,
    seen: TetSet,
    star: Vec<StarTet>,
}

impl Nearby {
    /// Of a mesh of so many vertices.
    pub fn new(vertices: usize) -> Self {
        Self { marks: VertexMarks::new(vertices), seen: TetSet::default(), star: Vec::new() }
    }
}

/// The link condition, with the boundary closed by a cone from a vertex ω outside.
/// (Dey, Edelsbrunner, Guha, Nekhayev: *Topology preserving edge contraction*, 1999.)
pub(super) fn keeps_topology(hole: &Hole, mesh: &WorkMesh, scratch: &mut Nearby, b: u32) -> bool {
    let Nearby { marks, seen, star } = scratch;
    if !mesh.star(b, LARGEST_STAR, seen, star) {
        return false;
    }
    mark(hole, marks, b);
    let has_edge = |x: u32, y: u32| hole.faces.iter().any(|(face, _)| face.contains(&x) && face.contains(&y));
    let in_fan =
        |x: u32, y: u32| hole.faces.iter().any(|(face, _)| [b, x, y].iter().all(|v| face.contains(v)));
    let has_border = |x: u32, y: u32| hole.border.iter().any(|&edge| edge == [x, y] || edge == [y, x]);
    for &StarTet { tet, corner } in star.iter() {
        let (corners, around) = (mesh.tets[tet as usize], mesh.neighbors[tet as usize]);
        for k in (0..4).filter(|&k| k != corner as usize) {
            let mut rest = (0..4)
                .filter(|&l| l != k && l != corner as usize)
                .map(|l| corners[l])
                .filter(|&v| v != hole.a);
            let (Some(x), Some(y)) = (rest.next(), rest.next()) else { continue };
            let [m, n] = [x, y].map(|v| marks.get(v));
            if [m, n].iter().any(|m| m & (NEAR_A | ON_FAN) == NEAR_A) {
                // Next to both ends, but a b x is no triangle.
                return false;
            }
            if m & n & NEAR_A != 0 && has_edge(x, y) && !in_fan(x, y) {
                return false;
            }
            let pinches = |m: u32| m & (BORDER_A | FAN_END) == BORDER_A;
            if around[k] == NONE && (pinches(m) || pinches(n) || has_border(x, y)) {
                return false;
            }
        }
    }
    true
}

fn mark(hole: &Hole, marks: &mut VertexMarks, b: u32) {
    marks.start();
    for (face, _) in &hole.faces {
        let flags = if face.contains(&b) { NEAR_A | ON_FAN } else { NEAR_A };
        face.iter().for_each(|&v| _ = marks.add(v, flags));
    }
    for edge in &hole.border {
        let flags = if edge.contains(&b) { BORDER_A | FAN_END } else { BORDER_A };
        edge.iter().for_each(|&v| _ = marks.add(v, flags));
    }
}

//! Filling a hole by contracting an edge: all that was at its one end moves to the other, which stays where it is.

use crate::change::hole::{Filling, Hole};
use crate::change::sides::{FaceSet, bits};
use crate::change::work_mesh::{LARGEST_STAR, StarTet, TetSet, WorkMesh};
use tetralod::mesh::NONE;

const NEAR_A: u8 = 1;
const ON_FAN: u8 = 2;
const BORDER_A: u8 = 4;
const FAN_END: u8 = 8;

/// Whether the hole may be filled with tetrahedra at its `i`-th link vertex, once [`Hole::find_sides`] was called: all of them are
/// positive, and the edge is not one that the boundary forbids to contract.
///
/// Inside, positive tetrahedra are all it takes: the hole is then star-shaped around `b`, too. Next to the boundary,
/// which may have come to overlap itself, [`keeps_topology`] must hold, too.
pub(crate) fn may_contract(hole: &Hole, i: usize) -> bool {
    let b = hole.link[i];
    if hole.on_boundary() && hole.border.iter().flatten().filter(|&&v| v == b).count() != 2 {
        // An edge through the inside between two boundary vertices, or from the boundary into the inside.
        return false;
    }
    let cells = hole.others(i);
    cells != 0 && hole.is_seen_from(i) && (!hole.on_boundary() || hangs_together(hole, cells))
}

/// Fills the hole with tetrahedra at its `i`-th link vertex, where [`may_contract`] holds: false if the boundary does not allow it.
pub(crate) fn contract(hole: &Hole, i: usize, filling: &mut Filling) -> bool {
    filling.clear();
    let (b, cells) = (hole.link[i], hole.others(i));
    filling.tets.extend(bits(cells).map(|face| {
        let [x, y, z] = hole.faces[face].0;
        [x, y, z, b]
    }));
    lay_border(hole, b, cells, filling)
}

/// Whether the tetrahedra between these faces and a further vertex are connected through faces. At the boundary the fan between the
/// two ends may part the hole; an insertion finds what it removes by going through faces.
fn hangs_together(hole: &Hole, cells: FaceSet) -> bool {
    let mut left = cells & (cells - 1);
    let mut stack = cells ^ left;
    while stack != 0 {
        let face = stack.trailing_zeros() as usize;
        stack &= stack - 1;
        let beside = hole.faces_beside(face) & left;
        left ^= beside;
        stack |= beside;
    }
    left == 0
}

/// The boundary triangles of the filling that has tetrahedra between `b` and these faces. False if one of them would belong to a
/// tetrahedron outside of the hole.
fn lay_border(hole: &Hole, b: u32, cells: FaceSet, filling: &mut Filling) -> bool {
    // Tetrahedra come in the order of their faces.
    let cell_with = |vertices: &[u32]| {
        // All of them have `b`.
        let faces = hole.faces_with(vertices.iter().filter(|&&v| v != b)) & cells;
        let before = (faces & faces.wrapping_neg()).wrapping_sub(1) & cells;
        (faces != 0).then(|| before.count_ones())
    };
    let Filling { border, moved, .. } = filling;
    for &[x, y] in hole.border.iter().filter(|edge| !edge.contains(&b)) {
        let Some(cell) = cell_with(&[x, y]) else { return false };
        border.push((cell, [b, x, y]));
    }
    *moved = border.len();
    for &([x, y, z], _) in hole.faces.iter().filter(|(_, outer)| *outer == NONE) {
        let Some(cell) = cell_with(&[x, y, z]) else { return false };
        border.push((cell, [x, z, y]));
    }
    true
}

/// Scratch space of [`keeps_topology`].
#[derive(Default)]
pub(crate) struct Nearby {
    /// For each link vertex what it is next to.
    flags: Vec<u8>,
    seen: TetSet,
    star: Vec<StarTet>,
    /// The star of a vertex of the link.
    other: Vec<StarTet>,
}

/// The link condition for the edge to the link vertex `i`, with the boundary closed by a cone from a vertex ω outside.
/// (Dey, Edelsbrunner, Guha, Nekhayev: *Topology preserving edge contraction*, 1999.)
///
/// `degrees` are how many tetrahedra there are around each vertex.
pub(crate) fn keeps_topology(
    hole: &Hole,
    mesh: &WorkMesh,
    degrees: &[u32],
    scratch: &mut Nearby,
    i: usize,
) -> bool {
    let b = hole.link[i];
    if !find_star(hole, mesh, degrees, scratch, b) {
        return false;
    }
    let Nearby { flags, star, .. } = scratch;
    flag(hole, flags, i);
    let has_border = |x: u32, y: u32| hole.border.iter().any(|&edge| edge == [x, y] || edge == [y, x]);
    for &StarTet { tet, corner } in star.iter() {
        let (corners, around) = (mesh.tets[tet as usize], mesh.neighbors[tet as usize]);
        // Of the corners, where they are in the link.
        let places = corners.map(|v| hole.place(v));
        for k in (0..4).filter(|&k| k != corner as usize) {
            let mut rest = (0..4).filter(|&l| l != k && l != corner as usize && corners[l] != hole.a);
            let (Some(x), Some(y)) = (rest.next(), rest.next()) else { continue };
            let [m, n] = [x, y].map(|l| places[l].map_or(0, |place| flags[place]));
            if [m, n].iter().any(|m| m & (NEAR_A | ON_FAN) == NEAR_A) {
                // Next to both ends, but a b x is no triangle.
                return false;
            }
            if let (Some(x), Some(y)) = (places[x], places[y])
                && hole.has_edge(x, y)
                && !hole.has_face(x, y, i)
            {
                return false;
            }
            let pinches = |m: u8| m & (BORDER_A | FAN_END) == BORDER_A;
            if around[k] == NONE && (pinches(m) || pinches(n) || has_border(corners[x], corners[y])) {
                return false;
            }
        }
    }
    true
}

/// Finds the tetrahedra around `b`, or where the boundary touches itself there at least all of them that have another vertex of the
/// link: only these decide. False if they cannot be found by going through faces.
fn find_star(hole: &Hole, mesh: &WorkMesh, degrees: &[u32], scratch: &mut Nearby, b: u32) -> bool {
    let Nearby { seen, star, other, .. } = scratch;
    if !mesh.star(b, LARGEST_STAR, seen, star) {
        return false;
    }
    if star.len() == degrees[b as usize] as usize {
        return true;
    }
    for &v in hole.link.iter().filter(|&&v| v != b) {
        if !mesh.star(v, LARGEST_STAR, seen, other) || other.len() < degrees[v as usize] as usize {
            return false;
        }
        for &StarTet { tet, .. } in other.iter() {
            let corner = mesh.tets[tet as usize].iter().position(|&corner| corner == b);
            if let Some(corner) = corner
                && star.iter().all(|known| known.tet != tet)
            {
                star.push(StarTet { tet, corner: corner as u8 });
            }
        }
    }
    true
}

/// Flags the vertices of the link for the edge to the `i`-th.
fn flag(hole: &Hole, flags: &mut Vec<u8>, i: usize) {
    flags.clear();
    flags.extend((0..hole.link.len()).map(|v| if hole.has_edge(v, i) { NEAR_A | ON_FAN } else { NEAR_A }));
    for edge in &hole.border {
        let new = if edge.contains(&hole.link[i]) { BORDER_A | FAN_END } else { BORDER_A };
        edge.iter().filter_map(|&v| hole.place(v)).for_each(|place| flags[place] |= new);
    }
}

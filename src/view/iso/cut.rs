//! How a surface cuts one tetrahedron, and which tetrahedra it cuts at all.

use super::crossings::Crossings;
use crate::mesh::EDGES;
use crate::mesh::NONE;
use crate::view::cases::CASES;

/// The corners that the crossed edges of each case run between, the one inside first; padded with the first edge.
const CORNERS: [[[u8; 2]; 4]; 16] = {
    let mut corners = [[[0; 2]; 4]; 16];
    let mut case = 0;
    while case < 16 {
        let mut i = 0;
        while i < 4 && !CASES[case].is_empty() {
            let [a, b] = EDGES[CASES[case][i % CASES[case].len()]];
            corners[case][i] = if case >> a & 1 == 1 { [a as u8, b as u8] } else { [b as u8, a as u8] };
            i += 1;
        }
        case += 1;
    }
    corners
};

/// In a byte per point: its value is smaller than the isovalue.
pub(super) const INSIDE: u8 = 1;
/// In a byte per point: its gradient is asked for.
pub(super) const WANTED: u8 = 2;

/// Entries that are looked at together; the unit in which a mesh tells its changes.
pub(super) const BLOCK: usize = 64;

/// The triangles of one tetrahedron at one isovalue, at most two.
///
/// A touched point can make a triangle an edge, which is left out; a tetrahedron with no triangle left adds no
/// vertex, so that every vertex of a surface belongs to a triangle.
pub(super) fn triangles(
    crossings: &mut Crossings,
    tet: [u32; 4],
    field: &[f32],
    (which, value): (u32, f32),
) -> [[u32; 3]; 2] {
    let values = tet.map(|p| field[p as usize]);
    let case = (0..4).fold(0, |case, i| case | usize::from(values[i] < value) << i);
    let count = CASES[case & 15].len();
    if count == 0 {
        return NO_TRIANGLES;
    }
    let mut ties = false;
    let keys = CORNERS[case & 15].map(|corners| {
        let [inside, outside] = corners.map(|corner| usize::from(corner & 3));
        let touched = values[outside] == value;
        ties |= touched;
        [tet[if touched { outside } else { inside }], tet[outside]]
    });
    if ties {
        return touching_triangles(crossings, keys, count, which);
    }
    let [a, b, c, d] = keys.map(|key| crossings.vertex(key, which));
    [[a, b, c], if count == 4 { [a, c, d] } else { NO_TRIANGLES[1] }]
}

/// The triangles where the surface goes through points.
#[cold]
fn touching_triangles(
    crossings: &mut Crossings,
    [a, b, c, d]: [[u32; 2]; 4],
    count: usize,
    which: u32,
) -> [[u32; 3]; 2] {
    let mut triangle = |t: [[u32; 2]; 3], there: bool| {
        let whole = there && t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
        if whole { t.map(|key| crossings.vertex(key, which)) } else { NO_TRIANGLES[0] }
    };
    [triangle([a, b, c], true), triangle([a, c, d], count == 4)]
}

/// In place of triangles that are not there.
pub(super) const NO_TRIANGLES: [[u32; 3]; 2] = [[NONE; 3]; 2];

/// Sets, for every point, whether it is inside.
pub(super) fn set_sides(sides: &mut Vec<u8>, field: &[f32], value: f32) {
    sides.clear();
    sides.extend(field.iter().map(|v| u8::from(*v < value)));
}

/// Appends the numbers of the tetrahedra of one block for which `has` holds, without a branch for each.
#[inline(always)]
fn select(tets: &[[u32; 4]], first: u32, found: &mut Vec<u32>, has: impl Fn(&[u32; 4]) -> bool) {
    let mut hits = [0; BLOCK];
    let mut count = 0;
    for (t, tet) in (first..).zip(tets) {
        hits[count % BLOCK] = t;
        count += usize::from(has(tet));
    }
    found.extend_from_slice(&hits[..count]);
}

/// Appends all tetrahedra that have points on both sides.
pub(super) fn find_cut(tets: &[[u32; 4]], sides: &[u8], found: &mut Vec<u32>) {
    for (first, block) in (0..).step_by(BLOCK).zip(tets.chunks(BLOCK)) {
        select(block, first, found, |tet| {
            let inside: u8 = tet.iter().map(|p| sides[*p as usize]).sum();
            inside.wrapping_sub(INSIDE) < 3 * INSIDE
        });
    }
}

/// Appends all tetrahedra with a point whose gradient is wanted.
pub(super) fn find_wanted(tets: &[[u32; 4]], sides: &[u8], found: &mut Vec<u32>) {
    for (first, block) in (0..).step_by(BLOCK).zip(tets.chunks(BLOCK)) {
        select(block, first, found, |tet| {
            tet.iter().fold(0, |all, p| all | sides[*p as usize]) & WANTED != 0
        });
    }
}

/// Appends the tetrahedra of one block that have points on both sides.
pub(super) fn find_cut_in_block(
    block: &[[u32; 4]],
    first: u32,
    (field, value): (&[f32], f32),
    found: &mut Vec<u32>,
) {
    select(block, first, found, |tet| {
        let inside: u8 = tet.iter().map(|p| u8::from(field[*p as usize] < value)).sum();
        inside.wrapping_sub(1) < 3
    });
}

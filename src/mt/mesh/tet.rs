//! Corners, faces and neighbours of tetrahedra.

use super::base::BaseMeshError;
use crate::mesh::{FACES, NONE};

/// `TURN[4 * i + j]`: corners `i` and `j` of a tetrahedron and the other two, such that the last three see the first
/// as the vertices of its opposite face in [`FACES`] do: an even permutation.
pub(in crate::mt) const TURN: [[u8; 4]; 16] = turns();

const fn turns() -> [[u8; 4]; 16] {
    let mut turns = [[0; 4]; 16];
    let mut at = 0;
    while at < 12 {
        let (i, k) = (at / 3, at % 3);
        let face = FACES[i];
        turns[4 * i + face[k]] = [i as u8, face[k] as u8, face[(k + 1) % 3] as u8, face[(k + 2) % 3] as u8];
        at += 1;
    }
    turns
}

/// Where a value is in an array that holds it once, without a branch.
#[inline(always)]
pub(crate) fn corner_of(array: &[u32; 4], value: u32) -> usize {
    usize::from(array[1] == value)
        | usize::from(array[2] == value) << 1
        | (usize::from(array[3] == value) * 3)
}

/// Finds the neighbour across every face. Each face may be shared by two tetrahedra that lie on its two sides.
pub(crate) fn face_neighbors(tets: &[[u32; 4]]) -> Result<Vec<[u32; 4]>, BaseMeshError> {
    let mut faces: Vec<([u32; 3], bool, u32)> = Vec::with_capacity(tets.len() * 4);
    for (t, tet) in tets.iter().enumerate() {
        for (i, face) in FACES.iter().enumerate() {
            let (sorted, even) = sort3(face.map(|j| tet[j]));
            faces.push((sorted, even, (t * 4 + i) as u32));
        }
    }
    faces.sort_unstable();
    let mut neighbors = vec![[NONE; 4]; tets.len()];
    let mut rest = faces.as_slice();
    while let [(face, even, at), tail @ ..] = rest {
        rest = tail;
        let Some((_, other_even, other)) = tail.first().filter(|(f, ..)| f == face) else { continue };
        let crowded = tail.get(1).is_some_and(|(f, ..)| f == face);
        if crowded || even == other_even {
            return Err(BaseMeshError::Face(at / 4));
        }
        neighbors[*at as usize / 4][*at as usize % 4] = other / 4;
        neighbors[*other as usize / 4][*other as usize % 4] = at / 4;
        rest = &tail[1..];
    }
    Ok(neighbors)
}

/// Sorts three numbers and tells whether the permutation was even.
#[inline]
fn sort3(mut v: [u32; 3]) -> ([u32; 3], bool) {
    let mut even = true;
    for (i, j) in [(0, 1), (1, 2), (0, 1)] {
        if v[i] > v[j] {
            v.swap(i, j);
            even = !even;
        }
    }
    (v, even)
}

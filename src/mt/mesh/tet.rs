//! Corners, faces and neighbours of tetrahedra.

use super::base::BaseMeshError;
use crate::mesh::{FACES, FaceTable, match_faces};

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
    let faces = FaceTable::new(tets).map_err(|_| BaseMeshError::Info("it has too many tetrahedra"))?;
    match_faces(&faces, |group, folded| {
        let first = group.iter().find(|face| face.is_odd(tets)).unwrap_or(&group[0]);
        if folded || group.len() > 2 { Err(BaseMeshError::Face(first.tet())) } else { Ok(()) }
    })
}

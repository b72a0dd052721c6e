//! A piece of a mesh that comes in several.

use crate::mesh::TetMesh;

/// A piece of a mesh: what one of several files has of it, or a range of cells of one. Pieces come one after the other, so that the whole is
/// never in memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshPiece {
    /// The number in the whole of each of its points, all different. Points that no earlier piece has are numbered on from the points of
    /// those, in their order here.
    pub points: Vec<u32>,
    /// Points of the piece, fields there, and tetrahedra, by their numbers in the piece. Points of an earlier piece have the values that
    /// they have there. A piece may have points alone, which tetrahedra of later ones use.
    pub mesh: TetMesh,
}

//! What the builders of vertex-based MTs hand over: vertex insertions, coarse to fine.

use std::ops::Range;

/// Vertex insertions from a base mesh to a reference mesh, in an order in which they can be carried out.
/// Vertices are numbers of reference points; tetrahedra are positive on the lattice.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Sequence {
    /// The base mesh.
    pub base: Vec<[u32; 4]>,
    /// What the insertions remove and insert, one after the other.
    pub tets: Vec<[u32; 4]>,
    /// The insertions.
    pub steps: Vec<Insertion>,
}

/// One vertex insertion.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Insertion {
    /// The reference point that is inserted.
    pub vertex: u32,
    /// Which entries of [`Sequence::tets`] it removes (the paper's T_u).
    pub removed: Range<usize>,
    /// Which it inserts: all tetrahedra at the vertex.
    pub inserted: Range<usize>,
    /// The largest error of a tetrahedron that it removes, as a fraction of a field's range; it need not be monotone.
    pub error: f64,
    /// What has to be added to the errors of the insertions that depend on this one before they bound its own from
    /// below: how far the boundary moves, as an error. 0 where the boundary stays.
    pub step: f64,
}

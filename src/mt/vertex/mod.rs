//! Vertex-based Multi-Tessellations [§2.2, §5]: updates are vertex insertions, their inverses vertex removals.
//!
//! Files code insertions relative to the mesh of all updates before them, so they are read from front to back. What a node keeps in memory is not
//! in the file. `docs/paper.md` has the bits of these nodes beside those of the paper ([`VertexTreeMt`](crate::mt::VertexTreeMt)).

pub(super) mod apply;
pub(super) mod bit_string;
pub(super) mod cavity;
pub(super) mod cavity_fill;
pub(super) mod from_explicit;
pub(super) mod growing;
pub(super) mod limits;
pub(super) mod shape_code;
pub(super) mod sphere_order;
pub(super) mod store;
pub(super) mod streaming;
pub(super) mod tet_errors;

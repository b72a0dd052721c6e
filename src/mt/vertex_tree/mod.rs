//! Vertex-based Multi-Tessellations with the paper's node code [§5]: T_u as a spanning tree of its tetrahedra.

pub(super) mod apply;
pub(super) mod from_explicit;
pub(super) mod rebuild;
pub(super) mod store;
pub(super) mod tree_code;

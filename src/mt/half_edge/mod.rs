//! Half-edge Multi-Tessellations: vertex insertions that half-edge collapses undo, with the removers of tetrahedra coded, so that any page can be used without the others.

pub(super) mod apply;
mod batch;
pub(super) mod builder;
pub(super) mod forest;
pub(super) mod from_explicit;
mod refusal;
pub(super) mod removers;
pub(super) mod scratch;
pub(super) mod star_code;
pub(super) mod store;

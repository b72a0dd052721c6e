//! Explicit Multi-Tessellations [§3]: updates of any kind, with all of their tetrahedra.

pub(super) mod apply;
pub(super) mod check;
pub(super) mod face_occupancy;
pub(super) mod store;

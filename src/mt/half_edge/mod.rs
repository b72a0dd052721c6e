//! Half-edge Multi-Tessellations: vertex insertions that half-edge collapses undo, with the removers of tetrahedra
//! coded, so that any page can be used without the others.
//!
//! Each tetrahedron has from its creation its remover, and which of its faces are removed with it. So all tetrahedra that an update removes are
//! reached from any one of them, and what else is behind such a face has to be refined first. Files have this as residuals against predictions
//! from the star (`star_code`), and the mesh keeps it after the first time. Levels are residuals against a weighted mean over the link (`places`).

pub(super) mod apply;
mod batch;
pub(super) mod builder;
pub(super) mod forest;
pub(super) mod from_explicit;
mod new_star;
mod places;
mod refusal;
pub(super) mod removers;
pub(super) mod scratch;
pub(super) mod star_code;
pub(super) mod store;

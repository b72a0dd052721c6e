//! The current mesh and what it is made of. Knows no kind of MT.

pub(super) mod base;
pub(super) mod current;
pub(super) mod limits;
pub(super) mod paged_array;
mod side_slots;
mod sides;
pub(super) mod stars;
mod tags;
pub(super) mod tet;

pub(super) use current::FIRST_ANONYMOUS_TAG;
pub(super) use current::{CurrentMesh, KindState};
pub(super) use stars::Gather;

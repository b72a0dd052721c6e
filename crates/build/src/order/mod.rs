//! How the updates of an MT are numbered, and its base mesh.

pub(crate) mod base;
pub(crate) mod block_order;
pub(crate) mod order;
pub(crate) mod reach;

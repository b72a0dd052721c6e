//! How the updates of an MT are numbered, and its base mesh.
//!
//! Updates are numbered in blocks, which files are cut into: by decreasing error, in large models place by place within bands of error (`order`).
//! Those of half-edge MTs are split recursively by what they reach, so that a box is in few blocks (`block_order`).

pub(crate) mod base;
pub(crate) mod block_order;
pub(crate) mod reach;
pub(crate) mod update_order;

//! Edge-based Multi-Tessellations [§2.1, §4]: updates are vertex splits, their inverses edge collapses.

pub(super) mod apply;
pub(super) mod builder;
pub(super) mod predict;
pub(super) mod star;
pub(super) mod store;

//! Promises of the structure: updates applied in every order, and kinds that agree.

mod changes;
mod conformance;
mod explicit;
mod explicit_updates;
mod half_edge_pages;
mod hand_made;
mod hostile;
mod imports;
mod layers;
mod rounding;
#[path = "../support/mod.rs"]
mod support;
mod vertex_tree;

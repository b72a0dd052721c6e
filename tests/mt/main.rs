//! Promises of the structure: updates applied in every order, and kinds that agree.

mod built;
mod conformance;
mod explicit;
mod half_edge_pages;
mod hand_made;
mod hostile;
mod kinds;
mod layers;
mod orders;
#[path = "../support/mod.rs"]
mod support;

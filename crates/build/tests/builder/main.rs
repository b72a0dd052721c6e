//! Promises of what is built from meshes, and of what checks and measures it.

mod delaunay;
mod exact_values;
mod fields;
mod flat_boundaries;
mod jumps;
mod measure;
mod parts;
mod pieces;
mod regions;
mod repair;
mod restrictions;
#[path = "../../../../tests/support/mod.rs"]
mod support;
mod theory;
mod touching;
mod verify_boundary;
mod verify_real;
mod verify_samples;
mod verify_shown;
mod verify_tampered;

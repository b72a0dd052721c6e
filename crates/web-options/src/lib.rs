//! How the wasm modules of the npm package read options of JavaScript one by one, and tell errors. What is exported from here is in every
//! module, so no class is here: those are in `tetralod-web`, which the builder does without.

pub mod error;
pub mod given;
pub mod read_error;
pub mod reader;

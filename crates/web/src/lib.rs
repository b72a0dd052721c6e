//! What the wasm modules of the npm package have in common: options that are read, results that are handed out, files that arrive. It is a thin
//! façade over [`tetralod::session`] for wasm-bindgen. The package's JavaScript (`pkg-template/`) wraps it with streams, workers and
//! promises; nothing here waits or does I/O.
//!
//! The `serde` structs here are the options and results of the JavaScript API (`options`, `results`), large arrays aside; their types stand beside
//! them (`options.d.ts`, `results.d.ts`, `tools.d.ts`).

pub mod arrays;
pub mod callback;
pub mod file;
pub mod loader;
pub mod mesh_changes;
pub mod mesh_tools;
pub mod options;
pub mod results;
pub mod stored;
pub mod tools;

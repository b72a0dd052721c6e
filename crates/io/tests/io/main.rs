//! Promises of the exchange formats.

mod cells;
mod curved;
mod damaged;
#[path = "../../../../tests/support/data.rs"]
mod data;
mod encodings;
#[cfg(feature = "hdf5")]
#[path = "../../../../tests/support/exodus.rs"]
mod exodus;
#[cfg(all(feature = "hdf5", not(target_arch = "wasm32")))]
mod exodus_pieces;
mod fields;
mod files;
#[cfg(not(target_arch = "wasm32"))]
mod grid_boxes;
#[cfg(feature = "hdf5")]
mod hdf5;
#[cfg(not(target_arch = "wasm32"))]
mod in_memory;
mod memory;
#[cfg(not(target_arch = "wasm32"))]
mod meshers;
mod odd;
#[cfg(not(target_arch = "wasm32"))]
mod pieces;
mod polyhedra;
#[cfg(not(target_arch = "wasm32"))]
mod ranges;
mod real;
mod surfaces;
mod survey;
#[cfg(feature = "zarr")]
mod zarr;

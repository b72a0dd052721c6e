//! Promises of the exchange formats.

mod cells;
mod curved;
mod damaged;
#[path = "../support/data.rs"]
mod data;
mod encodings;
mod fields;
mod files;
#[cfg(feature = "hdf5")]
mod hdf5;
mod memory;
#[cfg(feature = "formats")]
mod meshers;
mod odd;
#[cfg(feature = "formats")]
mod pieces;
mod real;
mod surfaces;
mod survey;

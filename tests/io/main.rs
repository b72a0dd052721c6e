//! Promises of the exchange formats.

mod cells;
mod curved;
mod damaged;
mod encodings;
mod fields;
#[allow(dead_code, reason = "each test uses a part of it")]
mod files;
#[cfg(feature = "hdf5")]
mod hdf5;
#[cfg(feature = "formats")]
mod meshers;
mod odd;
#[cfg(feature = "formats")]
mod pieces;
mod real;
mod surfaces;
mod survey;

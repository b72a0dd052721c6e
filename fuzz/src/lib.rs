//! What the fuzz targets share.
#![forbid(unsafe_code)]

pub mod exercise;
pub mod hdf5_structure;

/// More than the limit of reading by a path, and what is small beside that.
pub const MOST_BYTES: usize = 256 << 20;

//! The checksum of files: CRC-32 as in gzip and PNG.

pub use crc32fast::{Hasher, hash};

//! The MT file: an MT to bytes, and bytes of any split back to a growing MT. No I/O, no JS.
//!
//! [`encode`] and [`encode_to`] write, [`Decoder`] reads. The specification follows.
//!
//! ---
#![doc = include_str!("../../docs/format.md")]

mod block_scan;
mod checksum;
mod coder;
mod decode;
mod encode;
mod error;
mod header;
mod limits;
mod payload;
mod read;
mod section;
mod write;

pub use decode::{DecodeOptions, Decoder, ErrorBytes, ExactStatus, Progress};
pub use encode::{EncodeError, EncodeOptions, breakdown, encode, encode_to};
pub use error::FormatError;
pub use limits::Limits;
pub use payload::exact::Corrections;
pub use payload::index::{BlockInfo, Index};

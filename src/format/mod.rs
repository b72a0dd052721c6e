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
mod encode_blocks;
mod encode_error;
mod encode_options;
mod error;
mod header;
mod limits;
mod payload;
mod read;
mod section;
mod write;

pub use decode::DecodeOptions;
#[doc(hidden)]
pub use decode::{Decoder, ErrorBytes, ExactStatus, Progress};
#[doc(hidden)]
pub use encode::breakdown;
pub use encode::{encode, encode_to};
#[doc(hidden)]
pub use encode_blocks::{BlockEncoder, BlockShelf};
pub use encode_error::EncodeError;
pub use encode_options::EncodeOptions;
pub use error::FormatError;
pub(crate) use header::{HEADER_BYTES, stated_bytes};
pub use limits::Limits;
#[doc(hidden)]
pub use payload::exact::Corrections;
#[doc(hidden)]
pub use payload::index::{BlockInfo, Index, IndexPage};

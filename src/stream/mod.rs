//! Byte ranges of a file that is somewhere else: what is wanted now, how much, and how to come by it.
//!
//! [`Loader`] decides and a driver does. [`RangeSource`] is what native programs see of both: [`FileSource`] over a file,
//! `HttpSource` (feature `http`) over a server. In pages `ranges.js` of the package drives the same loader. Nothing
//! here knows what the bytes mean, but for the header of MT files: it states how long they are, and so whether they go on in other shards.

mod error;
#[cfg(feature = "http")]
mod http;
mod loader;
mod objects;
mod range_set;
mod reassembly;
mod response;
mod shards;
mod source;

pub use error::StreamError;
#[cfg(feature = "http")]
pub use http::{CacheFolder, HttpOptions, HttpSource};
#[doc(hidden)]
pub use loader::{Action, Failure, Loader, LoaderOptions, Traffic, WantedRange};
pub(crate) use range_set::RangeSet;
#[doc(hidden)]
pub use response::ResponseHead;
#[doc(hidden)]
pub use shards::{ShardedFile, shard_suffix};
#[doc(hidden)]
pub use source::Arrived;
pub use source::{FileSource, RangeSource};

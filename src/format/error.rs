//! What can be wrong with an MT file, each with where and what to do.

use crate::mt::{BaseMeshError, PageError, UpdateError};
use std::fmt;

/// Why a stream of bytes is not, or not all of, a usable MT file.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FormatError {
    /// The stream does not start like an MT file.
    NotMt,
    /// The file has a version that this reader does not know.
    UnsupportedVersion {
        /// Major and minor version of the file.
        found: [u16; 2],
        /// Major and minor version that this reader was made for.
        supported: [u16; 2],
    },
    /// The file relies on a section or a flag that this reader does not know.
    UnsupportedFeature {
        /// Where in the file, in bytes.
        offset: u64,
        /// What the reader does not know.
        what: &'static str,
    },
    /// The bytes contradict the specification or their checksum.
    Corrupt {
        /// Where in the file, in bytes.
        offset: u64,
        /// What is wrong there.
        what: &'static str,
    },
    /// The stream ended before the file did; what has arrived is usable.
    Truncated {
        /// Bytes that arrived.
        offset: u64,
    },
    /// The file needs more than [`Limits`](super::Limits) allow.
    Limit {
        /// What there is too much of.
        what: &'static str,
        /// How much the file needs.
        needed: u64,
        /// How much is allowed.
        limit: u64,
    },
    /// The file has no field of a name that was asked for.
    Field {
        /// The name.
        name: String,
        /// The names of those that there are.
        known: Vec<String>,
    },
    /// A block does not belong where it was put.
    Page(PageError),
    /// An update cannot be part of an MT.
    Update(UpdateError),
    /// The base mesh or the description cannot be used.
    Base(BaseMeshError),
}

/// What to do about a file that is broken as such.
const AGAIN: &str = "fetch the file again, or build it again if its source is the same";

impl fmt::Display for FormatError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotMt => f.write_str(
                "this is not an MT file; give a file made by `tetralod build` (for a URL, check that the server \
                 sends the file and not an error page)",
            ),
            Self::UnsupportedVersion { found: [a, b], supported: [c, d] } => write!(
                f,
                "the MT file has version {a}.{b}, this reader knows {c}.{d}; update tetralod, or build the file \
                 again with this version"
            ),
            Self::UnsupportedFeature { offset, what } => {
                write!(f, "the MT file needs {what} (at byte {offset}); update tetralod")
            }
            Self::Corrupt { offset, what } => {
                write!(f, "the MT file is damaged at byte {offset}: {what}; {AGAIN}")
            }
            Self::Truncated { offset: 0 } => write!(f, "the file is empty; {AGAIN}"),
            Self::Truncated { offset } => write!(
                f,
                "the MT file ends too early, after {offset} bytes; what has arrived can be used, for the rest {AGAIN}"
            ),
            Self::Limit { what, needed, limit } => write!(
                f,
                "the MT file needs {needed} bytes for {what}, {limit} are allowed; raise the limit or build a \
                 smaller file"
            ),
            Self::Field { name, known } => {
                write!(f, "the MT file has no field '{name}'; it has: {}", known.join(", "))
            }
            Self::Page(error) => write!(f, "the MT file is damaged: {error}; {AGAIN}"),
            Self::Update(error) => write!(f, "the MT file is damaged: {error}; {AGAIN}"),
            Self::Base(error) => write!(f, "the MT file is damaged: {error}; {AGAIN}"),
        }
    }
}

// The Display texts contain those of the inner errors, so that one line tells all; hence no `source`.
impl std::error::Error for FormatError {}

impl From<UpdateError> for FormatError {
    fn from(error: UpdateError) -> Self {
        Self::Update(error)
    }
}

impl From<PageError> for FormatError {
    fn from(error: PageError) -> Self {
        match error {
            PageError::Update(error) => Self::Update(error),
            error => Self::Page(error),
        }
    }
}

impl From<BaseMeshError> for FormatError {
    fn from(error: BaseMeshError) -> Self {
        Self::Base(error)
    }
}

//! What can be wrong with an MT file, each with where and what to do.

use crate::mt::{BaseMeshError, PageError, UpdateError};
use thiserror::Error;

/// What to do about a file that is broken as such.
const AGAIN: &str = "fetch the file again, or build it again if its source is the same";

/// Why a stream of bytes is not, or not all of, a usable MT file. The texts contain those of inner errors, which are therefore no
/// [sources](std::error::Error::source).
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FormatError {
    /// The stream does not start like an MT file.
    #[error(
        "this is not an MT file; give a file made by `tetralod build` (for a URL, check that the server sends the \
         file and not an error page)"
    )]
    NotMt,
    /// The file has a version that this reader does not know.
    #[error(
        "the MT file has version {found}, this reader knows {supported}; update tetralod, or build the file again with \
         this version"
    )]
    UnsupportedVersion {
        /// The version of the file.
        found: u16,
        /// The version that this reader was made for.
        supported: u16,
    },
    /// The file relies on a section or a flag that this reader does not know.
    #[error("the MT file needs {what} (at byte {offset}); update tetralod")]
    UnsupportedFeature {
        /// Where in the file, in bytes.
        offset: u64,
        /// What the reader does not know.
        what: &'static str,
    },
    /// The bytes contradict the specification or their checksum.
    #[error("the MT file is damaged at byte {offset}: {what}; {AGAIN}")]
    Corrupt {
        /// Where in the file, in bytes.
        offset: u64,
        /// What is wrong there.
        what: &'static str,
    },
    /// The stream ended before the file did; what has arrived is usable.
    #[error("{} {AGAIN}", truncated(*.offset))]
    Truncated {
        /// Bytes that arrived; where a range of the file was asked for that is beyond its end, the beginning of that.
        offset: u64,
    },
    /// The file needs more than [`Limits`](super::Limits) allow.
    #[error(
        "the MT file needs {needed} bytes for {what}, {limit} are allowed; raise the limit or build a smaller file"
    )]
    Limit {
        /// What there is too much of.
        what: &'static str,
        /// How much the file needs.
        needed: u64,
        /// How much is allowed.
        limit: u64,
    },
    /// The file has no field of a name that was asked for.
    #[error("the MT file has no field '{name}'; it has: {}", .known.join(", "))]
    Field {
        /// The name.
        name: String,
        /// The names of those that there are.
        known: Vec<String>,
    },
    /// A block does not belong where it was put.
    #[error("the MT file is damaged: {0}; {AGAIN}")]
    Page(PageError),
    /// An update cannot be part of an MT.
    #[error("the MT file is damaged: {0}; {AGAIN}")]
    Update(UpdateError),
    /// The base mesh or the description cannot be used.
    #[error("the MT file is damaged: {0}; {AGAIN}")]
    Base(BaseMeshError),
}

/// How much of a file there is that ends at byte `offset`.
fn truncated(offset: u64) -> String {
    match offset {
        0 => "the file is empty;".to_owned(),
        _ => format!(
            "the MT file ends too early, after {offset} bytes; what has arrived can be used, for the rest"
        ),
    }
}

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

impl crate::Coded for FormatError {
    fn code(&self) -> &'static str {
        match self {
            Self::NotMt => "not-mt",
            Self::UnsupportedVersion { .. } | Self::UnsupportedFeature { .. } => "unsupported-version",
            Self::Corrupt { .. } | Self::Update(_) | Self::Base(_) | Self::Page(_) => "corrupt",
            Self::Field { .. } => "bad-option",
            Self::Truncated { .. } => "truncated",
            Self::Limit { .. } => "limit",
        }
    }
}

/// What is read of a file.
pub type Result<T, E = FormatError> = std::result::Result<T, E>;

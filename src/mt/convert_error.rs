//! Why an MT cannot be one of another kind.

use super::info::MtKind;
use super::replay::ReplayError;
use std::fmt;

/// Why an MT cannot be one of another kind.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ConvertError {
    /// The two kinds are made of different updates.
    Kinds {
        /// The kind that it is.
        from: MtKind,
        /// The kind that it should become.
        to: MtKind,
    },
    /// An update is not one that the other kind can hold.
    Update {
        /// The update.
        update: u32,
        /// What is in the way.
        why: &'static str,
    },
    /// The MT is damaged.
    Damaged(ReplayError),
}

impl fmt::Display for ConvertError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Kinds { from, to } => write!(
                f,
                "an MT of kind {} has other updates than one of kind {}: build it again from the mesh",
                from.name(),
                to.name()
            ),
            Self::Update { update, why } => write!(f, "update {update} does not fit the other kind: {why}"),
            Self::Damaged(error) => write!(f, "the MT is damaged: {error}"),
        }
    }
}

impl std::error::Error for ConvertError {}

impl From<ReplayError> for ConvertError {
    fn from(error: ReplayError) -> Self {
        Self::Damaged(error)
    }
}

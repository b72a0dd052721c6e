//! Why an MT cannot be one of another kind.

use super::info::MtKind;
use super::replay::ReplayError;
use thiserror::Error;

/// Why an MT cannot be one of another kind.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ConvertError {
    /// The two kinds are made of different updates.
    #[error(
        "an MT of kind {} has other updates than one of kind {}: build it again from the mesh",
        .from.name(),
        .to.name()
    )]
    Kinds {
        /// The kind that it is.
        from: MtKind,
        /// The kind that it should become.
        to: MtKind,
    },
    /// An update is not one that the other kind can hold.
    #[error("update {update} does not fit the other kind: {why}")]
    Update {
        /// The update.
        update: u32,
        /// What is in the way.
        why: &'static str,
    },
    /// Vertices have values for each region, which no other kind keeps.
    #[error("fields have values for each region, which an MT of kind {} does not keep: build it again from the mesh", .to.name())]
    Sides {
        /// The kind that it should become.
        to: MtKind,
    },
    /// The MT is damaged.
    #[error("the MT is damaged: {0}")]
    Damaged(ReplayError),
}

impl From<ReplayError> for ConvertError {
    fn from(error: ReplayError) -> Self {
        Self::Damaged(error)
    }
}

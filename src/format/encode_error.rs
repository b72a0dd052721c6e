//! Why an MT cannot be written to a file.

use super::FormatError;
use crate::mt::{BaseMeshError, ConvertError, UpdateError};
use std::io;
use thiserror::Error;

/// Why an MT cannot be written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// Not all updates of the MT are there.
    #[error(
        "the MT has {updates} of the {expected} updates that its description contains; write it when it is complete"
    )]
    Incomplete {
        /// Updates that are there.
        updates: u32,
        /// Updates by the description.
        expected: u32,
    },
    /// No block can have as many updates as the pages of the MT.
    #[error("a block cannot hold 2^{bits} updates; put the MT into pages of 2^4 to 2^16")]
    Blocks {
        /// log2 of the updates of a page.
        bits: u32,
    },
    /// An update of the MT cannot be applied.
    #[error("the MT is damaged: {0}")]
    Update(UpdateError),
    /// The error of an update is not as far below that of one it depends on as selection relies on: what a request gives would
    /// depend on what was asked for before.
    #[error(
        "the errors of the MT do not fall along its partial order: in field {field} that of update {update} is too \
         large for update {parent}, which it depends on; build the MT again"
    )]
    Order {
        /// The update.
        update: u32,
        /// The one that it depends on.
        parent: u32,
        /// The field.
        field: usize,
    },
    /// Exact values are given for a field or a vertex that the reference mesh does not have.
    #[error("the exact values of field {field} are not those of the reference mesh")]
    Exact {
        /// The field.
        field: usize,
    },
    /// Something is longer than the file can say.
    #[error("{what} is too long for an MT file; shorten it")]
    TooLong {
        /// What it is.
        what: &'static str,
    },
    /// The description or the base mesh could not be read back.
    #[error("the MT cannot be written")]
    Base(#[source] BaseMeshError),
    /// The MT that is written while it is made cannot be completed.
    #[error("the MT could not be completed")]
    #[doc(hidden)]
    Unmade(#[source] ConvertError),
    /// Blocks that were put aside have not come back as they were.
    #[error("what was put aside while the MT file was made is damaged")]
    Kept(#[source] FormatError),
    /// The writer failed.
    #[error("the MT file could not be written")]
    Write(#[source] io::Error),
}

impl crate::Coded for EncodeError {
    fn code(&self) -> &'static str {
        if matches!(self, Self::TooLong { .. }) { "bad-option" } else { "internal" }
    }
}

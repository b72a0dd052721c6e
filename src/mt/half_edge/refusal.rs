//! Why a half-edge MT cannot be made.

use crate::mt::{ConvertError, ReplayError, UpdateError};

const NOT_HALF_EDGE: &str = "it is not the inverse of a half-edge collapse";

/// The update is no inverse half-edge collapse.
pub(super) fn refused(update: u32) -> ConvertError {
    ConvertError::Update { update, why: NOT_HALF_EDGE }
}

/// The MT itself is damaged.
pub(super) fn damaged(error: UpdateError) -> ConvertError {
    ConvertError::Damaged(ReplayError::Update(error))
}

//! The progress of a build, for callers that show it or stop the work.

use crate::BuildError;
use std::ops::ControlFlow;

/// The progress of the work; sent now and then, so that a caller can show it and stop the work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildProgress {
    /// The current stage of the work.
    pub stage: &'static str,
    /// How much of it is done.
    pub done: u64,
    /// The whole work, as far as it is known.
    pub total: u64,
    /// Tetrahedra of the mesh as it is now; none in stages that do not change it.
    pub tetrahedra: Option<u32>,
}

/// Receives progress; [`ControlFlow::Break`] stops the work.
pub type OnProgress<'a> = &'a mut dyn FnMut(BuildProgress) -> ControlFlow<()>;

impl BuildProgress {
    /// Passes it on; an error if that stops the work.
    pub(crate) fn tell(self, progress: OnProgress<'_>) -> Result<(), BuildError> {
        if progress(self).is_break() { Err(BuildError::Stopped) } else { Ok(()) }
    }

    /// Tells now and then how many of all updates have got their place in the order.
    pub(crate) fn tell_ordered(
        done: usize,
        total: usize,
        progress: OnProgress<'_>,
    ) -> Result<(), BuildError> {
        let at = Self { stage: "order", done: done as u64, total: total as u64, tetrahedra: None };
        if done.is_multiple_of(4096) { at.tell(progress) } else { Ok(()) }
    }
}

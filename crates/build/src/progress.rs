//! The progress of a build, for callers that show it or stop the work.

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

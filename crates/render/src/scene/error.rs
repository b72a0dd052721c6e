//! Why a scene cannot be shown.

use tetralod::Coded;
use tetralod::session::SessionError;
use tetralod::view::ScaleError;
use thiserror::Error;

/// Why a scene cannot be shown.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The session cannot give what it shows.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The colours have no range.
    #[error("option `colours`: {0}")]
    Scale(#[from] ScaleError),
    /// Something that the state names is not possible.
    #[error("option `{what}`: {problem}")]
    State {
        /// Which part of the state.
        what: String,
        /// What is wrong, and what to do.
        problem: String,
    },
}

impl SceneError {
    pub(super) fn state(what: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::State { what: what.into(), problem: problem.into() }
    }
}

impl Coded for SceneError {
    fn code(&self) -> &'static str {
        match self {
            Self::Session(error) => error.code(),
            Self::State { .. } | Self::Scale(_) => "bad-option",
        }
    }
}

/// What is found for a scene.
pub(super) type Result<T, E = SceneError> = std::result::Result<T, E>;

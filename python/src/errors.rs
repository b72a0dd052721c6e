//! Errors as Python has them: `tetralod.TetralodError` with its code.

use pyo3::prelude::*;
use tetralod::Coded;
use tetralod::session::ClientError;
use tetralod::stream::StreamError;
use tetralod_build::{BuildError, Remedy};
use tetralod_io::TimeStepsError;

/// An error with a code; it becomes Python's at the edge.
pub struct Failure {
    pub code: &'static str,
    pub message: String,
}

impl Failure {
    pub fn new(code: &'static str, message: impl Into<String>) -> Self {
        Self { code, message: message.into() }
    }

    /// With the name of what it is about in front.
    pub fn of(self, name: &str) -> Self {
        Self { message: format!("{name}: {}", self.message), ..self }
    }
}

impl<E: Coded> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::new(error.code(), error.to_string())
    }
}

/// The code of what went wrong while a file was read.
pub fn client(error: &ClientError) -> Failure {
    let code = match error {
        ClientError::Stream(error) => error.code(),
        ClientError::Format(error) => error.code(),
        ClientError::Session(error) => error.code(),
        _ => "internal",
    };
    Failure::new(code, error.to_string())
}

/// The code of why bytes do not come.
pub fn stream(error: &StreamError) -> Failure {
    Failure::new(error.code(), error.to_string())
}

/// The code of what is wrong with time steps.
pub fn time_steps(error: &TimeStepsError) -> Failure {
    match error {
        TimeStepsError::Read(error) => Failure::new(error.code(), error.to_string()),
        TimeStepsError::None => Failure::new("bad-source", error.to_string()),
        _ => Failure::new("bad-mesh", error.to_string()),
    }
}

/// An error of the builder, with the name of the input where it is about that, and the option that helps.
pub fn build(name: &str, error: &BuildError) -> Failure {
    let option = error.remedy().map(|remedy| format!(" (option {})", options_of(remedy)));
    let failure = Failure::new(error.code(), format!("{error}{}", option.unwrap_or_default()));
    if failure.code == "bad-mesh" { failure.of(name) } else { failure }
}

/// The options that do what a remedy says.
fn options_of(remedy: Remedy) -> &'static str {
    match remedy {
        Remedy::Insert => "method=\"insert\"",
        Remedy::Decimate => "method=\"decimate\"",
        Remedy::Field => "fields",
        Remedy::CellsToPoints => {
            "cell_to_point=True; or fields=[\"distance\"], \"x\", \"y\", \"z\" or \"none\" for the shape alone"
        }
        Remedy::FieldTolerance => "field_tolerance or lossless",
        Remedy::PositionTolerance => "position_tolerance",
        Remedy::PositionBits => "position_bits",
    }
}

impl From<Failure> for PyErr {
    fn from(Failure { code, message }: Failure) -> Self {
        Python::attach(|py| {
            let error = py.import("tetralod._errors").and_then(|module| module.getattr("TetralodError"));
            match error.and_then(|class| class.call1((code, message))) {
                Ok(error) => Self::from_value(error),
                Err(error) => error,
            }
        })
    }
}

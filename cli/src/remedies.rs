//! Errors of building, with the options of the command that help.

use anyhow::anyhow;
use tetralod_build::{BuildError, Remedy};

/// Why building failed, with the option that helps.
pub fn failed(error: BuildError) -> anyhow::Error {
    match error.remedy().map(options_of) {
        Some(option) => anyhow!("{error} ({option})"),
        None => error.into(),
    }
}

/// The options that do what a remedy says.
fn options_of(remedy: Remedy) -> &'static str {
    match remedy {
        Remedy::Insert => "--method insert",
        Remedy::Decimate => "--method decimate",
        Remedy::Field => "--field",
        Remedy::CellsToPoints => "--cell-to-point; or --field distance, x, y, z or none for the shape alone",
        Remedy::FieldTolerance => "--field-tolerance, --lossless",
        Remedy::PositionTolerance => "--position-tolerance",
        Remedy::PositionBits => "--position-bits",
    }
}

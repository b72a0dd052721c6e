//! Documents that list files with the pieces of a grid.

#[cfg(target_arch = "wasm32")]
use crate::error::At;
use crate::error::{ReadError, ReadReason};
use crate::memory::MemoryLimit;
use crate::options::Beside;
#[cfg(not(target_arch = "wasm32"))]
use crate::pvtu;
use crate::xml::{Document, IN_FILES, ReadFile};

/// Has `read` read the document, or the files that it lists, whose bytes count in the limit; returns the time of the first one that has one.
pub(super) fn for_each_file(
    document: &Document<'_>,
    beside: Beside<'_>,
    memory: &MemoryLimit,
    read: ReadFile<'_>,
) -> Result<Option<f64>, ReadError> {
    if !document.kind.starts_with(IN_FILES) {
        read(document)?;
        return Ok(document.time());
    }
    read_listed(document, beside, memory, read)
}

#[cfg(not(target_arch = "wasm32"))]
fn read_listed(
    document: &Document<'_>,
    beside: Beside<'_>,
    memory: &MemoryLimit,
    read: ReadFile<'_>,
) -> Result<Option<f64>, ReadError> {
    pvtu::for_each_file(document, beside, memory, read)
}

#[cfg(target_arch = "wasm32")]
fn read_listed(
    document: &Document<'_>,
    _: Beside<'_>,
    _: &MemoryLimit,
    _: ReadFile<'_>,
) -> Result<Option<f64>, ReadError> {
    Err(not_read(&document.kind)).at(String::new)
}

/// Why an XML file of this type is refused.
pub(super) fn not_read(kind: &str) -> ReadReason {
    let (what, remedy) = match kind {
        "PolyData" | "PPolyData" => {
            return ReadReason::NoVolume("a data set of type PolyData".into());
        }
        "Collection" => ("a list of time steps as one mesh".into(), "give one of the files that it lists"),
        "PUnstructuredGrid" | "PImageData" | "PRectilinearGrid" | "PStructuredGrid" => {
            ("a list of pieces".into(), "give one of the files that it lists")
        }
        other => (
            format!("a data set of type {other}"),
            "give an UnstructuredGrid, a StructuredGrid, a RectilinearGrid or ImageData",
        ),
    };
    ReadReason::Unsupported { what, remedy: remedy.into() }
}

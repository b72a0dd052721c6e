//! Documents that list files with the pieces of a grid.

use std::path::{Component, Path};

use crate::error::{At, ReadError, ReadReason, in_file};
use crate::file_kind::without_mark;
use crate::memory::MemoryLimit;
use crate::options::Beside;
use crate::packed;
use crate::xml::{Document, IN_FILES, Piece, ReadFile};

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
    let mut time = None;
    for (number, piece) in document.pieces.iter().enumerate() {
        let source = source(piece).at(|| format!("piece {number}"))?;
        let bytes = beside(source).at(|| format!("piece {number}"))?;
        let bytes = packed::unpacked(&bytes, memory).at(|| format!("piece {number}"))?;
        let mut read_file = || {
            let mut file = Document::parse(without_mark(&bytes))?;
            source.clone_into(&mut file.name);
            if document.kind.strip_prefix(IN_FILES) != Some(&file.kind) {
                let what = format!("a piece of type {}", file.kind);
                let remedy = format!("list files of type {}", document.kind.trim_start_matches(IN_FILES));
                return Err(ReadReason::unsupported(what, remedy)).at(String::new);
            }
            read(&file)?;
            Ok(file.time())
        };
        let of_file = read_file().map_err(|error| in_file(error, source))?;
        time = time.or(of_file);
    }
    Ok(time)
}

/// The name of the file with a piece.
fn source<'a>(piece: &'a Piece<'_>) -> Result<&'a str, ReadReason> {
    piece.attributes.get("Source").ok_or_else(|| ReadReason::Missing("attribute Source".into()))
}

/// The names of the files that a document lists.
pub(super) fn names(document: &Document<'_>) -> Vec<String> {
    let is_list = document.kind.starts_with(IN_FILES);
    let pieces = document.pieces.iter().filter(|_| is_list);
    pieces.filter_map(|piece| source(piece).ok().map(str::to_owned)).collect()
}

/// Why an XML file of this type is refused.
pub(super) fn not_read(kind: &str) -> ReadReason {
    let (what, remedy) = match kind {
        "PolyData" | "PPolyData" => {
            return ReadReason::NoVolume("a data set of type PolyData".into());
        }
        "Collection" => ("a list of time steps as one mesh".into(), "give one of the files that it lists"),
        other => (
            format!("a data set of type {other}"),
            "give an UnstructuredGrid, a StructuredGrid, a RectilinearGrid or ImageData",
        ),
    };
    ReadReason::unsupported(what, remedy)
}

/// Why a file in another folder is refused.
pub(super) fn elsewhere(what: String) -> ReadReason {
    ReadReason::unsupported(what, "put the files beside the one that refers to them, or below it")
}

/// Refuses the name of a file that is not beside the one that names it, or below.
pub(super) fn expect_below(name: &str) -> Result<(), ReadReason> {
    let below = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
    if name.is_empty() || !Path::new(name).components().all(below) {
        return Err(elsewhere(format!("a file in another folder (\"{name}\")")));
    }
    Ok(())
}

//! What a file contains, without its values: for questions before it is read, and for the memory that reading needs.

use crate::contents::Survey;
use crate::error::{At, ReadError, in_file};
use crate::file_kind::without_mark;
use crate::listed::not_read;
use crate::{
    CellData, MemoryLimit, ReadOptions, foreign, formats, image, legacy, packed, raw, structured, vtu, xml,
};
use tetralod::mesh::Field;

/// Says what is in the bytes of a file; `name` is used in errors alone. No array is decoded, so this takes little memory
/// beside the bytes.
///
/// # Errors
/// As [`read_bytes`](super::read_bytes), as far as that follows from the structure of the file.
pub fn survey(name: &str, bytes: &[u8]) -> Result<Survey, ReadError> {
    let unpacked = packed::unpacked(bytes, &MemoryLimit::default()).in_file(name)?;
    let bytes = &*unpacked;
    let start = without_mark(bytes);
    let result = if bytes.starts_with(legacy::MAGIC) {
        legacy::survey(bytes)
    } else if start.starts_with(b"<") && !foreign::is_foreign_xml(start) {
        survey_xml(start)
    } else {
        survey_other(name, bytes)
    };
    result.map_err(|e| in_file(e, name))
}

/// Says what a file of a format contains that is not VTK's: these are read for it.
fn survey_other(name: &str, bytes: &[u8]) -> Result<Survey, ReadError> {
    let Some(format) = formats::name(bytes) else {
        return Err(foreign::refused(name, bytes)).at(String::new);
    };
    let options = ReadOptions { cells: CellData::Names, ..ReadOptions::default() };
    let mesh = super::read_bytes_with(name, bytes, &options)?;
    let described =
        |fields: Vec<Field>| fields.into_iter().map(|field| Field { values: Vec::new(), ..field });
    Ok(Survey {
        format,
        points: mesh.positions.len() as u64,
        cells: mesh.tets.len() as u64,
        grid: mesh.grid,
        fields: described(mesh.fields).collect(),
        cell_fields: described(mesh.cell_fields).collect(),
    })
}

/// Says what the JSON sidecar of raw samples describes.
///
/// # Errors
/// If the sidecar does not say what is needed.
pub fn survey_raw(name: &str, sidecar: &[u8]) -> Result<Survey, ReadError> {
    let sidecar = raw::Sidecar::parse(sidecar).in_file(name)?;
    Ok(sidecar.survey())
}

/// How many bytes of memory a file takes while it is read, beside what is read of it: itself, and what it becomes when it is in gzip.
pub fn held_bytes(bytes: &[u8]) -> u64 {
    packed::stated_size(bytes)
}

/// What the format of a file with these bytes is called, as [`Survey::format`] has it; none if it is not known. The rest of the
/// content is not looked at.
pub fn format_of(bytes: &[u8]) -> Option<&'static str> {
    let head = packed::head(bytes);
    let bytes = head.as_ref();
    let start = without_mark(bytes);
    if bytes.starts_with(legacy::MAGIC) {
        return Some("vtk");
    }
    if !start.starts_with(b"<") {
        return formats::name(bytes);
    }
    // The root element names the type within its first words.
    let head =
        String::from_utf8_lossy(start.get(..start.len().min(1 << 12)).unwrap_or_default()).into_owned();
    let (_, kind) = head.split_once("<VTKFile")?.1.split_once("type=")?;
    let kind = kind.get(1..)?.split(['"', '\'']).next()?;
    let formats = [
        ("UnstructuredGrid", "vtu"),
        ("ImageData", "vti"),
        (structured::RECTILINEAR, "vtr"),
        (structured::CURVILINEAR, "vts"),
        ("PUnstructuredGrid", "pvtu"),
        ("PImageData", "pvti"),
        ("PRectilinearGrid", "pvtr"),
        ("PStructuredGrid", "pvts"),
    ];
    formats.iter().find(|(name, _)| *name == kind).map(|(_, format)| *format)
}

fn survey_xml(bytes: &[u8]) -> Result<Survey, ReadError> {
    let document = xml::Document::parse(bytes)?;
    match document.kind.as_str() {
        "UnstructuredGrid" => vtu::survey(&document),
        "ImageData" => image::survey(&document),
        structured::RECTILINEAR | structured::CURVILINEAR => structured::survey(&document),
        other => Err(not_read(other)).at(String::new),
    }
}

//! What a file contains, without its values: for questions before it is read, and for the memory that reading needs.

use std::path::Path;

use crate::beside::{FilesOf, Source};
use crate::contents::Survey;
use crate::error::{At, ReadError, in_file};
use crate::file_kind::{lower_extension, without_mark};
use crate::formats::tetgen;
use crate::listed::{for_each_file, not_read};
use crate::options::Beside;
use crate::reading::{read_files, sidecar};
use crate::xml::{Document, IN_FILES};
use crate::{CellData, MemoryLimit, ReadOptions, foreign, formats, image, legacy, packed, structured, vtu};
use tetralod::geom::Bounds;
use tetralod::mesh::{Field, TetMesh};

/// Says what is in the bytes of a file; `name` is used in errors alone. No array is decoded, so this takes little memory
/// beside the bytes; but files of formats that are not VTK's are read without their fields.
///
/// # Errors
/// As [`read_bytes`](super::read_bytes), as far as that follows from the structure of the file.
pub fn survey(name: &str, bytes: &[u8]) -> Result<Survey, ReadError> {
    let memory = MemoryLimit::default();
    survey_files(&FilesOf::new(Path::new(name), Source::Bytes(bytes), &memory), &memory)
        .map(|(survey, _)| survey)
}

/// Says what is in the given file and those that it needs, and between what its points lie where they had to be read for that.
pub(super) fn survey_files(
    files: &FilesOf<'_>,
    memory: &MemoryLimit,
) -> Result<(Survey, Option<Bounds>), ReadError> {
    let name = files.name();
    match lower_extension(files.given).as_str() {
        "json" | "raw" => return Ok((sidecar(files)?.survey(), None)),
        "node" | "ele" => return survey_by_reading(files, tetgen::NAME, memory),
        _ => {}
    }
    let given = files.load_given()?;
    let unpacked = packed::unpacked(&given, memory).in_file(&name)?;
    let bytes = &*unpacked;
    let start = without_mark(bytes);
    let survey = if bytes.starts_with(legacy::MAGIC) {
        legacy::survey(bytes)
    } else if start.starts_with(b"<") && !foreign::is_foreign_xml(start) {
        survey_xml(start, &|file| files.load(file), memory)
    } else {
        let format = formats::name(bytes).ok_or_else(|| foreign::refused(&name, bytes)).in_file(&name)?;
        drop(unpacked);
        return survey_by_reading(files, format, memory);
    };
    Ok((survey.map_err(|error| in_file(error, &name))?, None))
}

/// Says what files contain of a format that does not say it in one place: they are read without their fields.
fn survey_by_reading(
    files: &FilesOf<'_>,
    format: &'static str,
    memory: &MemoryLimit,
) -> Result<(Survey, Option<Bounds>), ReadError> {
    let options = ReadOptions {
        fields: Some(Vec::new()),
        cells: CellData::Names,
        memory: memory.clone(),
        ..ReadOptions::default()
    };
    // Readers that keep names apart have them among the fields.
    let TetMesh { positions, tets, grid, mut fields, mut cell_fields, input, .. } =
        read_files(files, &options)?;
    fields.extend(input.other_fields);
    cell_fields.extend(input.other_cell_fields);
    let bounds = Some(Bounds::of(&positions)).filter(|_| !positions.is_empty());
    let (points, cells) = (positions.len() as u64, tets.len() as u64);
    Ok((Survey { format, points, cells, grid, fields, cell_fields }, bounds))
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
    format_of_kind(kind)
}

/// What VTK's XML of a type is called; none if it is not read.
fn format_of_kind(kind: &str) -> Option<&'static str> {
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

fn survey_xml(bytes: &[u8], beside: Beside<'_>, memory: &MemoryLimit) -> Result<Survey, ReadError> {
    let document = Document::parse(bytes)?;
    let Some(format) = format_of_kind(&document.kind) else {
        return Err(not_read(&document.kind)).at(String::new);
    };
    let is_unstructured = document.kind.ends_with("UnstructuredGrid");
    let (mut points, mut cells, mut names) = (0_u64, 0_u64, None);
    for_each_file(&document, beside, memory, &mut |file| {
        if is_unstructured {
            let of_file = vtu::counts(file)?;
            points = points.saturating_add(of_file[0]);
            cells = cells.saturating_add(of_file[1]);
        }
        if names
            .as_ref()
            .is_none_or(|[fields, cell_fields]: &[Vec<Field>; 2]| fields.is_empty() && cell_fields.is_empty())
        {
            names = Some(vtu::names(file)?);
        }
        Ok(())
    })?;
    let names = names.unwrap_or_default();
    match document.kind.strip_prefix(IN_FILES).unwrap_or(&document.kind) {
        "ImageData" => image::survey(format, &document, names),
        structured::RECTILINEAR | structured::CURVILINEAR => structured::survey(format, &document, names),
        _ => {
            let [fields, cell_fields] = names;
            Ok(Survey { format, points, cells, grid: None, fields, cell_fields })
        }
    }
}

//! Reading a file of any kind, and those that it needs.

use std::path::PathBuf;

use crate::beside::{FilesOf, Source};
use crate::error::{At, ReadError, ReadReason, in_file};
use crate::file_kind::{lower_extension, without_gz, without_mark};
use crate::listed::not_read;
use crate::memory::MemoryLimit;
use crate::options::{Beside, ReadOptions};
use crate::xml::IN_FILES;
use crate::{fields, foreign, formats, grid, image, legacy, packed, pvtu, raw, structured, vtu, xml};
use tetralod::mesh::{TetMesh, straighten};

/// The mesh of a file and those that it needs.
pub(super) fn read_files(files: &FilesOf<'_>, options: &ReadOptions) -> Result<TetMesh, ReadError> {
    let read = read_unsettled(files, options).map(settled)?;
    expanded(read, options).in_file(&files.name())
}

/// The mesh as callers get it: finite numbers at points that no cell uses, no cells that fold because they were cut into straight
/// tetrahedra, and with all notes in words.
pub(super) fn settled(mut mesh: TetMesh) -> TetMesh {
    fields::settle_unused(&mut mesh);
    straighten(&mut mesh);
    mesh.notes.extend(mesh.input.lines());
    mesh
}

/// A mesh with the points and tetrahedra of its grid.
pub(super) fn expanded(mut mesh: TetMesh, options: &ReadOptions) -> Result<TetMesh, ReadReason> {
    if let Some(grid) = mesh.grid.filter(|_| mesh.is_grid_alone()) {
        options.memory.take(grid::bytes(grid.dims)?)?;
    }
    mesh.expand_grid();
    Ok(mesh)
}

pub(super) fn read_unsettled(files: &FilesOf<'_>, options: &ReadOptions) -> Result<TetMesh, ReadError> {
    #[cfg(feature = "zarr")]
    if let Some(read) = crate::zarr::read_given(files, options) {
        return read.map(|mut mesh| {
            mesh.input.files.0 = files.all_read();
            mesh
        });
    }
    if matches!(files.source, Source::Disk) && files.given.is_dir() {
        return Err(foreign::refused_folder(files.given)).in_file(&files.name());
    }
    let mut mesh = match lower_extension(files.given).as_str() {
        "json" | "raw" => read_raw_by_sidecar(files, &options.memory)?,
        "node" | "ele" => formats::tetgen::read(files, options)?,
        _ => match read_ranges(files, options) {
            Some(read) => read?,
            None => read_in(&files.name(), &files.load_given()?, options, &|file| files.load(file))?,
        },
    };
    mesh.input.files.0 = files.all_read();
    Ok(mesh)
}

/// Reads what is wanted of a file of a format that need not be read as a whole; none if it is another one.
#[cfg(feature = "hdf5")]
fn read_ranges(files: &FilesOf<'_>, options: &ReadOptions) -> Option<Result<TetMesh, ReadError>> {
    formats::hdf5_files::read_given(files, options)
}

#[cfg(not(feature = "hdf5"))]
fn read_ranges(_: &FilesOf<'_>, _: &ReadOptions) -> Option<Result<TetMesh, ReadError>> {
    None
}

/// Reads a file that may refer to others.
fn read_in(
    name: &str,
    bytes: &[u8],
    options: &ReadOptions,
    beside: Beside<'_>,
) -> Result<TetMesh, ReadError> {
    let unpacked = packed::unpacked(bytes, &options.memory).in_file(name)?;
    let (bytes, name) = (&*unpacked, without_gz(name));
    let start = without_mark(bytes);
    let result = if bytes.starts_with(legacy::MAGIC) {
        legacy::read(bytes, options)
    } else if start.starts_with(b"<") && !foreign::is_foreign_xml(start) {
        read_xml(start, options, beside)
    } else {
        formats::read(name, bytes, options, beside)
            .unwrap_or_else(|| Err(foreign::refused(name, bytes)).at(String::new))
    };
    result.map_err(|e| in_file(e, name))
}

fn read_raw_by_sidecar(files: &FilesOf<'_>, memory: &MemoryLimit) -> Result<TetMesh, ReadError> {
    let sidecar = sidecar(files)?;
    let samples_path = samples_path(files, &sidecar);
    let samples = files.load_one(&samples_path)?;
    sidecar.mesh(&samples, memory).in_file(&samples_path.display().to_string())
}

/// Where the samples are of which a sidecar tells.
pub(super) fn samples_path(files: &FilesOf<'_>, sidecar: &raw::Sidecar) -> PathBuf {
    match &sidecar.file {
        _ if lower_extension(files.given) == "raw" => files.given.to_owned(),
        Some(file) => files.given.with_file_name(file),
        None => files.given.with_extension("raw"),
    }
}

/// The sidecar of raw samples, of which either is given.
pub(super) fn sidecar(files: &FilesOf<'_>) -> Result<raw::Sidecar, ReadError> {
    let is_samples = lower_extension(files.given) == "raw";
    let path = if is_samples { &files.given.with_extension("json") } else { files.given };
    raw::Sidecar::parse(&files.load_one(path)?).in_file(&path.display().to_string())
}

fn read_xml(bytes: &[u8], options: &ReadOptions, beside: Beside<'_>) -> Result<TetMesh, ReadError> {
    let document = xml::Document::parse(bytes)?;
    let (mut mesh, of_pieces) = match document.kind.as_str() {
        "UnstructuredGrid" => (vtu::read(&document, options)?, None),
        "PUnstructuredGrid" => pvtu::read(&document, options, beside)?,
        kind => match kind.strip_prefix(IN_FILES).unwrap_or(kind) {
            "ImageData" => image::read(&document, options, beside)?,
            structured::RECTILINEAR | structured::CURVILINEAR => {
                structured::read(&document, options, beside)?
            }
            _ => return Err(not_read(kind)).at(String::new),
        },
    };
    fields::set_time(&mut mesh, document.time().or(of_pieces));
    Ok(mesh)
}

//! Formats of meshers, of imaging and in HDF5.
//!
//! Each is recognised by its first words, but for TetGen's, whose files are lists of numbers.

mod draft;
#[cfg(feature = "hdf5")]
mod exodus;
#[cfg(feature = "hdf5")]
mod exodus_cells;
#[cfg(feature = "hdf5")]
pub(super) mod exodus_pieces;
mod gmsh;
mod gmsh_cells;
mod gmsh_layout;
mod gmsh_mesh;
mod gmsh_sections;
mod gmsh_views;
#[cfg(feature = "hdf5")]
mod hdf5;
#[cfg(feature = "hdf5")]
pub(super) mod hdf5_files;
#[cfg(feature = "hdf5")]
mod hdf5_values;
mod medit;
mod medit_binary;
mod medit_cells;
mod metaimage;
mod netgen;
mod nrrd;
pub(super) mod tetgen;
pub(super) mod volume;
#[cfg(feature = "hdf5")]
mod vtkhdf;
#[cfg(feature = "hdf5")]
pub(super) mod vtkhdf_ranges;

use std::path::Path;

use crate::beside::FilesOf;
use crate::error::ReadError;
use crate::formats::volume::{Start, Volume};
use crate::options::{Beside, ReadOptions};
use crate::scanner::Scanner;
use tetralod::mesh::TetMesh;

/// A format that is recognised by its content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Gmsh,
    Medit,
    MeditBinary,
    Netgen,
    Nrrd,
    MetaImage,
}

impl Format {
    /// The format of a file that begins with these bytes, if it is one of these.
    fn of(bytes: &[u8]) -> Option<Self> {
        let start = bytes.trim_ascii_start();
        if start.starts_with(nrrd::MAGIC) {
            return Some(Self::Nrrd);
        }
        if gmsh::is_first(start) {
            return Some(Self::Gmsh);
        }
        if medit_binary::is_first(bytes) {
            return Some(Self::MeditBinary);
        }
        if metaimage::is_header(start) {
            return Some(Self::MetaImage);
        }
        match Scanner::with_comments(bytes).next_word().ok()?? {
            medit::FIRST => Some(Self::Medit),
            netgen::FIRST => Some(Self::Netgen),
            _ => None,
        }
    }

    /// As [`Survey::format`](crate::Survey::format) calls it.
    fn name(self) -> &'static str {
        match self {
            Self::Gmsh => "gmsh",
            Self::Medit | Self::MeditBinary => "medit",
            Self::Netgen => "netgen",
            Self::Nrrd => "nrrd",
            Self::MetaImage => "metaimage",
        }
    }
}

/// What the format of these bytes is called, if it is one of these.
pub(super) fn name(bytes: &[u8]) -> Option<&'static str> {
    #[cfg(feature = "hdf5")]
    if let Some(name) = hdf5::name(bytes) {
        return Some(name);
    }
    Format::of(bytes).map(Format::name)
}

/// Reads the bytes of a file called `name`; none if they are of no format that is known here.
pub(super) fn read(
    name: &str,
    bytes: &[u8],
    options: &ReadOptions,
    beside: Beside<'_>,
) -> Option<Result<TetMesh, ReadError>> {
    #[cfg(feature = "hdf5")]
    if hdf5::is_known(bytes) {
        return Some(hdf5::read(bytes, options));
    }
    Some(match Format::of(bytes)? {
        Format::Gmsh => gmsh::read(bytes, options),
        Format::Medit => medit::read(bytes, &sibling(name, "sol"), options, beside),
        Format::MeditBinary => medit_binary::read(bytes, &sibling(name, "solb"), options, beside),
        Format::Netgen => netgen::read(bytes, options),
        Format::Nrrd => nrrd::read(bytes, options, beside),
        Format::MetaImage => metaimage::read(bytes, options, beside),
    })
}

/// The samples that stand in a file as they are, which begins with these bytes: the name of another file that has them, and where there; none if
/// they do not.
pub(super) fn samples_in_file(head: &[u8]) -> Option<(Volume, Option<String>, Start)> {
    match Format::of(head)? {
        Format::Nrrd => nrrd::in_file(head),
        Format::MetaImage => metaimage::in_file(head),
        _ => None,
    }
}

/// The times of the steps in the given file; fewer than two if it is of no format that is known to have some.
pub(super) fn times(files: &FilesOf<'_>) -> Result<Vec<f64>, ReadError> {
    #[cfg(feature = "zarr")]
    {
        let times = crate::zarr::times(files)?;
        if !times.is_empty() {
            return Ok(times);
        }
    }
    #[cfg(feature = "hdf5")]
    {
        let times = hdf5_files::times(files)?;
        if !times.is_empty() {
            return Ok(times);
        }
    }
    Ok(gmsh::times(files))
}

/// The names of the files that one called `name` needs, or may have beside it. What is wrong with it is for its reader to say.
pub(super) fn named_by(name: &str, bytes: &[u8]) -> Vec<String> {
    match Format::of(bytes) {
        Some(Format::Medit) => vec![sibling(name, "sol")],
        Some(Format::MeditBinary) => vec![sibling(name, "solb")],
        Some(Format::Nrrd) => nrrd::named_by(bytes),
        Some(Format::MetaImage) => metaimage::named_by(bytes),
        Some(Format::Gmsh | Format::Netgen) | None => Vec::new(),
    }
}

/// The names of the other pieces, if this is the first one of a mesh in several files.
pub(super) fn pieces_beside(name: &str, bytes: &[u8]) -> Option<Vec<String>> {
    #[cfg(feature = "hdf5")]
    if hdf5::name(bytes) == Some("exodus") {
        return exodus_pieces::beside_first(name);
    }
    let _ = (name, bytes);
    None
}

/// The name of the file beside the one called `name` that has another ending.
pub(super) fn sibling(name: &str, ending: &str) -> String {
    let path = Path::new(name).with_extension(ending);
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

//! Reads and writes exchange formats for [`tetralod`]: meshes and grids from files, and back to VTK; and makes volumes by formula.
//!
//! Formats with "`hdf5`" or "`zarr`" need that feature. All but Zarr are read from files on a disk and [in memory](FilesInMemory) alike, also in WebAssembly.
//!
//! | format | ending | read | written |
//! |---|---|---|---|
//! | VTK XML unstructured grid | `.vtu` | all encodings, several pieces | appended raw, zlib |
//! | VTK XML image data | `.vti` | all encodings, several pieces | appended raw, zlib |
//! | legacy VTK, versions 1.0 to 5.1 | `.vtk` | ASCII and binary; unstructured, structured and rectilinear grids, structured points | |
//! | VTK XML structured and rectilinear grids | `.vts`, `.vtr` | all encodings, several pieces | |
//! | VTK XML, each of these in several files | `.pvtu`, `.pvti`, `.pvtr`, `.pvts` | with the files that they list | |
//! | raw samples | `.raw` + `.json` | any numeric type and byte order | |
//! | Gmsh, versions 2 to 4.1 | `.msh` | text and binary | |
//! | Medit | `.mesh`, `.sol`, `.meshb`, `.solb` | text and binary | |
//! | TetGen | `.node` + `.ele` | text | |
//! | Netgen | `.vol` | text | |
//! | NRRD | `.nrrd`, `.nhdr` | raw, gzip, text, hexadecimal | |
//! | `MetaImage` | `.mha`, `.mhd` | raw, zlib, text | |
//! | VTKHDF | `.vtkhdf`, `.hdf` | unstructured grids and image data; `hdf5` | |
//! | Exodus II | `.exo`, `.ex2`, `.e` | in one file, or in pieces (`.e.4.0`); `hdf5` | |
//! | Zarr, OME-Zarr | folder `.zarr` | versions 2 and 3; `zarr`, on servers `http` | |
//! | VTK XML poly data | `.vtp` | | appended raw, zlib |
//! | STL | `.stl` | | binary, triangles alone |
//! | PLY | `.ply` | | binary, little-endian |
//! | Wavefront | `.obj` | | without fields |
//! | table | `.csv` | | |
//!
//! Regular grids are split into tetrahedra, six a cube, and carry their [`Grid`](tetralod::mesh::Grid).
//! Point arrays become scalar fields: an array of several components gives one field a component (`name_x`, ...) and
//! `name_magnitude`, of a symmetric tensor also `name_von_mises` and `name_principal_1` to 3. Units and times are kept
//! where the file contains them. Arrays at cells are read where that is asked for ([`ReadOptions::cells`]), arrays that
//! are not numbers are left out.
//! Time steps come in several files, which a `.pvd` may list, or in one that has several: see [`steps`] and [`FilesInMemory::steps`].
//! Cells of other types are split into tetrahedra that fit those of their neighbours, linear and quadratic ones and polyhedra; cells without a
//! volume are left out beside them. How cells are split is in `cell_shapes` and `polyhedra`. Readers check the file, not the mesh: see
//! [`tetralod::mesh::repair`]. Meshes in several files, and ranges of cells of large ones, can be read one piece at a time: `Pieces`.

#![warn(missing_docs)]
#![deny(rustdoc::broken_intra_doc_links)]

/// The code of README.md, as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod beside;
mod cell_shapes;
mod cell_types;
mod cells;
mod contents;
mod error;
mod fields;
mod file_kind;
mod foreign;
mod formats;
pub mod generate;
mod ghosts;
mod grid;
mod grid_boxes;
mod grid_parts;
mod image;
mod image_boxes;
mod in_memory;
mod legacy;
mod listed;
mod memory;
mod number;
mod numbering;
mod options;
mod packed;
mod payload;
mod pieces;
mod polyhedra;
mod pvd;
mod pvtu;
mod ranges;
mod raw;
mod reading;
mod sample_file;
mod scanner;
mod shared_points;
mod shares;
mod skeleton;
mod steps_in_memory;
mod stored;
mod structured;
mod surface;
mod survey;
mod tensors;
mod time_steps;
mod vtu;
mod vtu_ranges;
mod write;
mod write_layers;
mod xml;
mod xml_on_disk;
mod xz;
#[cfg(feature = "zarr")]
mod zarr;

#[doc(hidden)]
pub use contents::{PieceCounts, Survey};
pub use error::{ReadError, ReadReason};
#[doc(hidden)]
pub use grid_boxes::GridInParts;
pub use in_memory::FilesInMemory;
pub use memory::MemoryLimit;
pub use options::{CellData, ReadOptions};
#[doc(hidden)]
pub use pieces::Pieces;
#[doc(hidden)]
pub use pvd::write_pvd;
pub use pvd::{Step, steps};
pub use steps_in_memory::StepInMemory;
#[doc(hidden)]
pub use surface::{PointValues, write_csv, write_obj};
pub use surface::{PolyData, write_ply, write_stl, write_vtp};
#[doc(hidden)]
pub use survey::{format_of, survey};
#[doc(hidden)]
pub use time_steps::{FieldSelection, TimeStepsError, read_time_steps};
#[doc(hidden)]
pub use write::{MeshArray, cell_arrays, point_arrays};
pub use write::{write_vti, write_vtu};
#[doc(hidden)]
pub use write_layers::write_vti_layers;

use std::path::Path;

use crate::beside::{FilesOf, Source};
use crate::error::At;
use crate::reading::{expanded, read_files, read_unsettled, settled};
use tetralod::mesh::TetMesh;

/// Reads the mesh or grid in the file at `path`; of raw samples either the samples or the sidecar may be given.
///
/// The kind of a file follows from its content; only `.raw`, `.json`, `.node` and `.ele` are recognised by their names.
///
/// # Errors
/// If the file cannot be read, is damaged, or holds what is not read here: see [`ReadReason`].
pub fn read(path: &Path) -> Result<TetMesh, ReadError> {
    read_with(path, &ReadOptions::default())
}

/// Reads what is wanted of the mesh or grid in the file at `path`, otherwise as [`read`].
///
/// # Errors
/// As [`read`]; a field that is wanted and not there is no error.
pub fn read_with(path: &Path, options: &ReadOptions) -> Result<TetMesh, ReadError> {
    read_files(&FilesOf::on_disk(path, &options.memory), options)
}

/// As [`read_with`], but a regular grid without values at its cells comes without points and tetrahedra, which follow from it: see
/// [`TetMesh::of_grid_alone`].
///
/// # Errors
/// As [`read_with`].
#[doc(hidden)]
pub fn read_unexpanded(path: &Path, options: &ReadOptions) -> Result<TetMesh, ReadError> {
    read_unsettled(&FilesOf::on_disk(path, &options.memory), options).map(settled)
}

/// Reads a mesh or grid from the bytes of a file; `name` is used in errors alone.
///
/// What comes in several files is read from [`FilesInMemory`].
///
/// # Errors
/// As [`read`], and if the file needs others.
pub fn read_bytes(name: &str, bytes: &[u8]) -> Result<TetMesh, ReadError> {
    read_bytes_with(name, bytes, &ReadOptions::default())
}

/// Reads what is wanted from the bytes of a file, otherwise as [`read_bytes`].
///
/// # Errors
/// As [`read_with`], and if the file needs others.
pub fn read_bytes_with(name: &str, bytes: &[u8], options: &ReadOptions) -> Result<TetMesh, ReadError> {
    let mut mesh =
        read_files(&FilesOf::new(Path::new(name), Source::Bytes(bytes), &options.memory), options)?;
    // The name is no path.
    mesh.input.files.0.clear();
    Ok(mesh)
}

/// Reads raw samples, given their JSON sidecar:
/// `{"dims": [2, 2, 2], "type": "uint8", "endian": "little", "spacing": [1, 1, 1], "origin": [0, 0, 0], "field": "density"}`,
/// of which only `dims` and `type` are needed. Samples run x fastest, then y, then z. `name` is used in errors alone.
///
/// # Errors
/// If the sidecar does not say what is needed, or the samples are not as many as it says.
#[doc(hidden)]
pub fn read_raw(name: &str, sidecar: &[u8], samples: &[u8]) -> Result<TetMesh, ReadError> {
    let options = ReadOptions::default();
    let mesh =
        raw::Sidecar::parse(sidecar).and_then(|s| expanded(s.mesh(samples, &options.memory)?, &options));
    mesh.in_file(name)
}

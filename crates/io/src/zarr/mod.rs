//! Zarr, versions 2 and 3, and OME-Zarr: volumes as arrays in chunks, in a folder or on a server.
//!
//! What is given is an array, or a group: with an image of OME-Zarr, of which the finest level is read, or with arrays on one grid, each a field.
//! Of an array in a group, that is looked at, too: an image says where the samples of each of its levels lie. Codecs and chunks are zarrs';
//! times are steps, and each channel is a field.

mod array;
mod axes;
mod lz4;
mod node;
mod ome;
#[cfg(feature = "http")]
mod server;
mod store;
mod volume;

use std::path::Path;

use crate::ReadOptions;
use crate::beside::{FilesOf, Source};
use crate::error::{ReadError, Stop, in_file};
use crate::grid_boxes::GridInParts;
use crate::memory::MemoryLimit;
use tetralod::mesh::TetMesh;
use volume::Volume;

/// What one of the objects in a folder with an array or a group is called.
const OBJECTS: [&str; 4] = ["zarr.json", ".zarray", ".zgroup", ".zattrs"];

/// Whether a path is that of a folder with an array or a group, or an address on a server.
pub(super) fn is_zarr(path: &Path) -> bool {
    store::is_address(path)
        || path.is_dir() && (store::is_root(path) || OBJECTS.iter().any(|object| path.join(object).is_file()))
}

/// Opens the given array or group; none if it is a file.
fn open(files: &FilesOf<'_>, memory: &MemoryLimit) -> Option<Result<Volume, ReadError>> {
    let is_one = matches!(files.source, Source::Disk) && is_zarr(files.given);
    is_one.then(|| Volume::open(files.given, memory))
}

/// Reads the given array or group; none if it is a file.
pub(super) fn read_given(files: &FilesOf<'_>, options: &ReadOptions) -> Option<Result<TetMesh, ReadError>> {
    let mesh = open(files, &options.memory)?.and_then(|volume| volume.mesh(options));
    Some(mesh.map_err(|error| in_file(error, &files.name())))
}

/// The times of the steps in the given array or group; none if it is a file.
pub(super) fn times(files: &FilesOf<'_>) -> Result<Vec<f64>, ReadError> {
    let Some(volume) = open(files, &MemoryLimit::default()) else { return Ok(Vec::new()) };
    volume.map(|volume| volume.times().to_vec()).map_err(|error| in_file(error, &files.name()))
}

/// The array or group at a path or an address, to be read in parts; the reason if it has to be read as a whole. None if it is a file.
pub(super) fn open_in_parts(path: &Path, options: &ReadOptions) -> Result<Option<GridInParts>, Stop> {
    if !is_zarr(path) {
        return Ok(None);
    }
    Volume::open(path, &options.memory)?.in_parts(path, options)?.map(Some).map_err(Stop::Whole)
}

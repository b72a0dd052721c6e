//! Files in HDF5 and netCDF: which format is in them.
//!
//! Files on disk are read by ranges, never as a whole. What a read may allocate follows from the size of the file.

use std::path::Path;
use std::sync::Arc;

use hdf5_reader::error::Error;
use hdf5_reader::storage::DynStorage;
use hdf5_reader::{BlockCacheStorage, BytesStorage, FileStorage, Hdf5File, OpenOptions};
use netcdf_reader::{NcFile, NcOpenOptions};

use crate::beside::{FilesOf, Source};
use crate::error::{At, ReadError, ReadReason};
use crate::formats::hdf5_values::{netcdf_reason, reason};
use crate::formats::{exodus, vtkhdf};
use crate::{MemoryLimit, ReadOptions, foreign};
use tetralod::mesh::TetMesh;

/// The first bytes of HDF5 files.
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";
/// And of netCDF files in the formats of their own, before the number of the format.
const CLASSIC: &[u8] = b"CDF";
/// The numbers of these formats: classic, with 64-bit offsets, with 64-bit data.
const CLASSIC_FORMATS: [u8; 3] = [1, 2, 5];

/// The most that a byte in a file becomes when it is unpacked (deflate), and what small files may take.
const MOST_UNPACKED: u64 = 1032;
const FEW_BYTES: usize = 1 << 20;

/// What is in a file of either kind.
enum Content {
    Vtkhdf(Hdf5File),
    Exodus(NcFile),
}

/// What a file is called that begins like these, by its content.
pub(super) fn name(bytes: &[u8]) -> Option<&'static str> {
    if !is_known(bytes) {
        return None;
    }
    let mark = vtkhdf::ROOT.as_bytes();
    let is_vtk = bytes.starts_with(HDF5) && bytes.windows(mark.len()).any(|window| window == mark);
    Some(if is_vtk { "vtkhdf" } else { "exodus" })
}

/// Whether a file that begins with these bytes is of one of these formats.
pub(super) fn is_known(bytes: &[u8]) -> bool {
    let format = bytes.strip_prefix(CLASSIC).and_then(|rest| rest.first());
    bytes.starts_with(HDF5) || format.is_some_and(|format| CLASSIC_FORMATS.contains(format))
}

/// Reads a mesh or grid from the bytes of a file of one of these formats.
pub(super) fn read(bytes: &[u8], options: &ReadOptions) -> Result<TetMesh, ReadError> {
    read_from(Arc::new(BytesStorage::new(bytes.to_vec())), options)
}

/// The given file if it is one of these.
pub(super) fn open(files: &FilesOf<'_>) -> Option<DynStorage> {
    if !is_known(&files.head(HDF5.len())) {
        return None;
    }
    Some(match files.source {
        Source::Disk => open_on_disk(files.given).ok()?,
        Source::Memory(in_memory, given) => Arc::new(BytesStorage::from_owner(in_memory.shared(given))),
        Source::Bytes(bytes) => Arc::new(BytesStorage::new(bytes.to_vec())),
    })
}

/// The file at a path, whatever it is.
pub(super) fn open_on_disk(path: &Path) -> Result<DynStorage, Error> {
    Ok(Arc::new(BlockCacheStorage::with_defaults(Arc::new(FileStorage::open(path)?))))
}

/// Whether the file at a path begins as one of these.
pub(super) fn is_known_file(path: &Path) -> bool {
    is_known(&FilesOf::on_disk(path, &MemoryLimit::default()).head(HDF5.len()))
}

/// Whether the given file is one of these, and not VTKHDF. What is wrong with it is for its reader to say.
pub(super) fn is_exodus(files: &FilesOf<'_>) -> bool {
    open(files).is_some_and(|storage| !matches!(content(storage, u64::MAX), Ok(Content::Vtkhdf(_))))
}

/// Opens a piece of a mesh.
pub(super) fn exodus_in(storage: DynStorage, options: &ReadOptions) -> Result<NcFile, ReadError> {
    match content(storage, options.memory.most())? {
        Content::Exodus(file) => Ok(file),
        Content::Vtkhdf(_) => {
            let what = "a piece in VTKHDF among those of Exodus";
            Err(ReadReason::unsupported(what, "give each its own name")).at(String::new)
        }
    }
}

/// The times of the steps of a file; none if it has no steps.
pub(super) fn times_in(storage: DynStorage) -> Result<Vec<f64>, ReadError> {
    match content(storage, u64::MAX)? {
        Content::Vtkhdf(file) => vtkhdf::times(&file),
        Content::Exodus(file) => exodus::times(&file),
    }
}

/// Opens the file at a path if it is VTKHDF.
pub(super) fn open_vtkhdf(path: &Path, options: &ReadOptions) -> Result<Option<Hdf5File>, ReadError> {
    let Some(storage) = open(&FilesOf::on_disk(path, &options.memory)) else { return Ok(None) };
    Ok(match content(storage, options.memory.most())? {
        Content::Vtkhdf(file) => Some(file),
        Content::Exodus(_) => None,
    })
}

/// Reads a mesh or grid.
pub(super) fn read_from(storage: DynStorage, options: &ReadOptions) -> Result<TetMesh, ReadError> {
    match content(storage, options.memory.most())? {
        Content::Vtkhdf(file) => vtkhdf::read(&file, options),
        Content::Exodus(file) => exodus::read(&file, options),
    }
}

/// Opens a file, of which at most so many bytes are read at once.
fn content(storage: DynStorage, most: u64) -> Result<Content, ReadError> {
    let limit = usize::try_from(storage.len().saturating_mul(MOST_UNPACKED).min(most)).unwrap_or(usize::MAX);
    let limit = limit.max(FEW_BYTES);
    let chunk = limit.min(hdf5_reader::DEFAULT_MAX_CHUNK_BYTES);
    let start = storage.read_range(0, storage.len().min(HDF5.len() as u64) as usize);
    let start = start.map_err(reason).at(String::new)?;
    if start.starts_with(HDF5) {
        let options = OpenOptions::default().with_max_read_bytes(limit).with_max_chunk_bytes(chunk);
        let file = Hdf5File::from_storage_with_options(storage.clone(), options);
        let file = file.map_err(reason).at(String::new)?;
        let root = file.root_group().and_then(|root| root.member_names()).map_err(reason).at(String::new)?;
        if root.0.iter().any(|name| name == vtkhdf::ROOT) {
            return Ok(Content::Vtkhdf(file));
        }
        foreign::refuse_hdf5(&root.0, &root.1).at(String::new)?;
    }
    let options = NcOpenOptions { max_read_bytes: limit, max_chunk_bytes: chunk, ..NcOpenOptions::default() };
    let file = NcFile::from_storage_with_options(storage, options);
    Ok(Content::Exodus(file.map_err(netcdf_reason).at(String::new)?))
}

//! Files in HDF5 and netCDF: what is in them, and numbers from their arrays.
//!
//! Files on disk are read by ranges, never as a whole. What a read may allocate follows from the size of the file.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use hdf5_reader::error::Error;
use hdf5_reader::storage::DynStorage;
use hdf5_reader::{
    Attribute, BlockCacheStorage, BytesStorage, Dataset, Datatype, FileStorage, H5Type, Hdf5File,
    OpenOptions, SliceInfo, SliceInfoElem,
};
use netcdf_reader::{NcFile, NcOpenOptions};

use crate::error::{At, ReadError, ReadReason};
use crate::formats::{exodus, vtkhdf};
use crate::{ReadOptions, foreign, in_file};
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

/// The file at `path` if it is one of these.
fn open(path: &Path) -> Result<Option<DynStorage>, ReadReason> {
    let Ok(file) = FileStorage::open(path) else { return Ok(None) };
    let file: DynStorage = Arc::new(file);
    let length = file.len().min(HDF5.len() as u64) as usize;
    let start = file.read_range(0, length).map_err(reason)?;
    if !is_known(&start) {
        return Ok(None);
    }
    Ok(Some(Arc::new(BlockCacheStorage::with_defaults(file))))
}

/// Reads the file at `path` if it is one of these; others are for other readers, and so is one that cannot be opened.
pub(crate) fn read_at(path: &Path, options: &ReadOptions) -> Option<Result<TetMesh, ReadError>> {
    let result = match open(path) {
        Ok(None) => return None,
        Ok(Some(storage)) => read_from(storage, options),
        Err(reason) => Err(reason).at(String::new),
    };
    Some(result.map_err(|error| in_file(error, &path.display().to_string())))
}

/// The times of the steps in the file at `path`; none if it is not one of these, or has no steps.
pub(crate) fn times_at(path: &Path) -> Result<Vec<f64>, ReadError> {
    let times = open(path).at(String::new).and_then(|storage| {
        match storage.map(|storage| content(storage, u64::MAX)).transpose()? {
            Some(Content::Vtkhdf(file)) => vtkhdf::times(&file),
            Some(Content::Exodus(file)) => exodus::times(&file),
            None => Ok(Vec::new()),
        }
    });
    times.map_err(|error| in_file(error, &path.display().to_string()))
}

fn read_from(storage: DynStorage, options: &ReadOptions) -> Result<TetMesh, ReadError> {
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

/// Why a file is refused that the library for HDF5 does not read.
pub(super) fn reason(error: Error) -> ReadReason {
    let what = error.to_string();
    match error {
        Error::Context { source, .. } => match reason(*source) {
            ReadReason::Damaged(_) => ReadReason::Damaged(what),
            other => other,
        },
        Error::Io(error) => ReadReason::Io(error.to_string()),
        Error::UnexpectedEof { needed, available, .. } => ReadReason::Truncated { needed, found: available },
        Error::UnsupportedFilter(_) | Error::UnsupportedEncoding(_) => ReadReason::Unsupported {
            what: format!("a file with {what}"),
            remedy: "write it again without compression, or with zlib (deflate)".into(),
        },
        Error::GroupNotFound(_) | Error::DatasetNotFound(_) | Error::AttributeNotFound(_) => {
            ReadReason::Missing(what)
        }
        _ => ReadReason::Damaged(what),
    }
}

/// The same of the library for netCDF.
pub(super) fn netcdf_reason(error: netcdf_reader::Error) -> ReadReason {
    use netcdf_reader::Error;
    let what = error.to_string();
    match error {
        Error::Hdf5(error) => reason(error),
        Error::Io(error) => ReadReason::Io(error.to_string()),
        Error::UnexpectedEof { needed, available, .. } => ReadReason::Truncated { needed, found: available },
        _ => ReadReason::Damaged(what),
    }
}

/// Whether the values of a dataset are numbers, and if so whether integers.
pub(super) fn number_kind(dataset: &Dataset) -> Option<bool> {
    match dataset.dtype() {
        Datatype::FixedPoint { size: 1 | 2 | 4 | 8, .. } => Some(true),
        Datatype::FloatingPoint { size: 4 | 8, .. } => Some(false),
        _ => None,
    }
}

/// Reads a part of a dataset as numbers of type `$into`; `$otherwise` is for those that are no integers.
macro_rules! numbers {
    ($dataset:expr, $selection:expr, $into:ty) => {
        match *$dataset.dtype() {
            Datatype::FixedPoint { size: 1, signed: true, .. } => {
                Some(part($dataset, $selection, |x: i8| x as $into))
            }
            Datatype::FixedPoint { size: 1, .. } => Some(part($dataset, $selection, |x: u8| x as $into)),
            Datatype::FixedPoint { size: 2, signed: true, .. } => {
                Some(part($dataset, $selection, |x: i16| x as $into))
            }
            Datatype::FixedPoint { size: 2, .. } => Some(part($dataset, $selection, |x: u16| x as $into)),
            Datatype::FixedPoint { size: 4, signed: true, .. } => {
                Some(part($dataset, $selection, |x: i32| x as $into))
            }
            Datatype::FixedPoint { size: 4, .. } => Some(part($dataset, $selection, |x: u32| x as $into)),
            Datatype::FixedPoint { size: 8, signed: true, .. } => {
                Some(part($dataset, $selection, |x: i64| x as $into))
            }
            Datatype::FixedPoint { size: 8, .. } => Some(part($dataset, $selection, |x: u64| x as $into)),
            _ => None,
        }
    };
}

fn part<T: H5Type, U>(
    dataset: &Dataset,
    selection: &SliceInfo,
    into: impl Fn(T) -> U,
) -> Result<Vec<U>, ReadReason> {
    let values = dataset.read_slice::<T>(selection).map_err(reason)?;
    Ok(values.into_iter().map(into).collect())
}

/// The values in these rows (along the first axis), one row behind the other.
pub(super) fn floats(dataset: &Dataset, rows: Range<u64>) -> Result<Vec<f64>, ReadReason> {
    let selection = &selected(dataset, rows)?;
    match *dataset.dtype() {
        Datatype::FloatingPoint { size: 4, .. } => part(dataset, selection, |x: f32| f64::from(x)),
        Datatype::FloatingPoint { size: 8, .. } => part(dataset, selection, |x: f64| x),
        _ => numbers!(dataset, selection, f64).unwrap_or_else(|| Err(not_numbers(dataset, "numbers"))),
    }
}

/// The same as indices. Unsigned numbers beyond `i64` wrap to negative ones, which no index is.
pub(super) fn integers(dataset: &Dataset, rows: Range<u64>) -> Result<Vec<i64>, ReadReason> {
    let selection = &selected(dataset, rows)?;
    numbers!(dataset, selection, i64).unwrap_or_else(|| Err(not_numbers(dataset, "integers")))
}

fn not_numbers(dataset: &Dataset, expected: &str) -> ReadReason {
    ReadReason::Syntax(format!("\"{}\" does not hold {expected}", dataset.name()))
}

/// The numbers of an attribute.
pub(super) fn attribute_values(attribute: &Attribute) -> Result<Vec<f64>, ReadReason> {
    fn list<T: H5Type>(attribute: &Attribute, into: impl Fn(T) -> f64) -> Result<Vec<f64>, ReadReason> {
        let values = attribute.read_1d::<T>().map_err(reason)?;
        Ok(values.into_iter().map(into).collect())
    }
    match attribute.datatype {
        Datatype::FixedPoint { size: 4, signed: true, .. } => list(attribute, |x: i32| f64::from(x)),
        Datatype::FixedPoint { size: 8, signed: true, .. } => list(attribute, |x: i64| x as f64),
        Datatype::FixedPoint { size: 4, .. } => list(attribute, |x: u32| f64::from(x)),
        Datatype::FixedPoint { size: 8, .. } => list(attribute, |x: u64| x as f64),
        Datatype::FloatingPoint { size: 4, .. } => list(attribute, |x: f32| f64::from(x)),
        Datatype::FloatingPoint { size: 8, .. } => list(attribute, |x: f64| x),
        _ => Err(ReadReason::Syntax(format!("attribute \"{}\" does not hold numbers", attribute.name))),
    }
}

/// The times of steps, which must be finite.
pub(super) fn checked_times(times: Vec<f64>) -> Result<Vec<f64>, ReadReason> {
    if times.iter().any(|time| !time.is_finite()) {
        return Err(ReadReason::Syntax("a time is not a number".into()));
    }
    // Zero has two signs.
    Ok(times.into_iter().map(|time| time + 0.0).collect())
}

/// All values of a dataset as indices.
pub(super) fn all_integers(dataset: &Dataset) -> Result<Vec<i64>, ReadReason> {
    integers(dataset, 0..rows(dataset))
}

/// How many rows a dataset has.
pub(super) fn rows(dataset: &Dataset) -> u64 {
    dataset.shape().first().copied().unwrap_or(0)
}

/// How many values a row has, if that is a number.
pub(super) fn row_length(dataset: &Dataset) -> Result<usize, ReadReason> {
    let length = dataset.shape().iter().skip(1).try_fold(1_u64, |length, size| length.checked_mul(*size));
    let length = length.and_then(|length| usize::try_from(length).ok());
    length.ok_or_else(|| ReadReason::TooLarge { what: "values in a row".into(), limit: u64::MAX })
}

fn selected(dataset: &Dataset, rows: Range<u64>) -> Result<SliceInfo, ReadReason> {
    let found = self::rows(dataset);
    if rows.start > rows.end || rows.end > found {
        let what = format!("values of \"{}\"", dataset.name());
        return Err(ReadReason::Count { what, expected: rows.end, found });
    }
    let mut selection = SliceInfo::all(dataset.ndim());
    if let Some(first) = selection.selections.first_mut() {
        *first = SliceInfoElem::Slice { start: rows.start, end: rows.end, step: 1 };
    }
    Ok(selection)
}

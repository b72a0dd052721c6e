//! Numbers from the arrays of files in HDF5 and netCDF, and why these cannot be read.

use std::ops::Range;

use hdf5_reader::error::Error;
use hdf5_reader::{Attribute, Dataset, Datatype, H5Type, SliceInfo, SliceInfoElem};

use crate::error::ReadReason;

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
        Error::UnsupportedFilter(_) | Error::UnsupportedEncoding(_) => ReadReason::unsupported(
            format!("a file with {what}"),
            "write it again without compression, or with zlib (deflate)",
        ),
        Error::GroupNotFound(_) | Error::DatasetNotFound(_) | Error::AttributeNotFound(_) => {
            ReadReason::Missing(what)
        }
        _ => ReadReason::Damaged(what),
    }
}

/// Why a file is refused that the library for netCDF does not read.
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

/// Reads a part of a dataset as numbers of type `$into`; none if they are no integers.
macro_rules! numbers {
    ($dataset:expr, $selection:expr, $into:ty) => {
        numbers!($dataset, $selection, $into,
            1 true i8, 1 false u8, 2 true i16, 2 false u16, 4 true i32, 4 false u32, 8 true i64, 8 false u64)
    };
    ($dataset:expr, $selection:expr, $into:ty, $($size:literal $signed:literal $number:ty),*) => {
        match *$dataset.dtype() {
            $(Datatype::FixedPoint { size: $size, signed: $signed, .. } => {
                Some(part($dataset, $selection, |x: $number| x as $into))
            })*
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

/// The values in these rows as indices. Unsigned numbers beyond `i64` wrap to negative ones, which no index is.
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

//! Samples on a grid, as files of images have them: their places, and which of the axes of the file are values of one sample.

use std::io::Read;

use crate::error::{At, ReadError, ReadReason, expect_count};
use crate::fields::{Collector, component_name, in_order};
use crate::grid::{GridValues, Placement, checked_dims};
use crate::number::NumberType;
use crate::options::{Beside, ReadOptions};
use tetralod::mesh::TetMesh;

/// Most values of a sample.
pub(super) const MAX_COMPONENTS: u64 = 1 << 10;
/// Most files that the samples may lie in.
const MAX_FILES: u64 = 1 << 16;

/// What a header says of the samples that follow.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Volume {
    pub dims: [u64; 3],
    /// All axes of the file, fastest first.
    pub axes: Vec<Axis>,
    pub number: NumberType,
    /// Whether numbers have their most significant byte first.
    pub big: bool,
    pub origin: [f64; 3],
    /// The step from one sample to the next along each axis of the grid.
    pub steps: [[f64; 3]; 3],
    pub field: String,
    pub unit: String,
    /// What the values of a sample are.
    pub arrays: Vec<SampleArray>,
    pub notes: Vec<String>,
}

/// Where the samples begin in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Start {
    At(u64),
    /// So many bytes stand behind them.
    BeforeEnd(u64),
}

impl Start {
    /// In a file of so many bytes, of which so many are samples.
    pub fn of(self, all: u64, samples: u64) -> u64 {
        match self {
            Self::At(start) => start,
            Self::BeforeEnd(behind) => all.saturating_sub(samples.saturating_add(behind)),
        }
    }
}

/// An axis of the samples in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Axis {
    pub size: u64,
    /// Whether a step along it leads to another sample, and not to another value of the same.
    pub is_space: bool,
}

/// Some of the values of each sample as one array.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SampleArray {
    /// What its name ends with, behind that of the field.
    pub ending: &'static str,
    /// Which of the values of a sample each component is.
    pub components: Vec<usize>,
    pub names: Vec<String>,
    pub has_length: bool,
}

impl SampleArray {
    /// All values of a sample, as [`component_name`] names those of vectors and tensors in this order.
    pub fn vector(components: usize) -> Vec<Self> {
        let names = (0..components).map(|c| component_name(components, c)).collect();
        let components = (0..components).collect();
        vec![Self { components, names, has_length: true, ..Self::default() }]
    }

    /// All values of a sample, of which no more is known than their order.
    pub fn numbered(components: usize) -> Vec<Self> {
        let names = (0..components).map(|c| c.to_string()).collect();
        vec![Self { components: (0..components).collect(), names, ..Self::default() }]
    }

    /// All values of a sample with names of their own.
    pub fn named(names: &[&str]) -> Vec<Self> {
        let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
        vec![Self { components: (0..names.len()).collect(), names, ..Self::default() }]
    }
}

impl Volume {
    /// How many values a sample has.
    pub fn components(&self) -> u64 {
        let values = self.axes.iter().filter(|axis| !axis.is_space);
        values.fold(1, |product: u64, axis| product.saturating_mul(axis.size))
    }

    /// How many bytes the samples have.
    pub fn bytes(&self) -> Result<usize, ReadReason> {
        checked_dims(self.dims)?;
        let components = usize::try_from(self.components()).unwrap_or(usize::MAX);
        let sizes = [components, self.number.size()].into_iter();
        let points = self.dims.iter().map(|d| *d as usize);
        let bytes = points.chain(sizes).try_fold(1_usize, usize::checked_mul);
        bytes.ok_or_else(|| ReadReason::TooLarge { what: "bytes of samples".into(), limit: u64::MAX })
    }

    /// The mesh of these samples; a grid along the axes comes without points and tetrahedra.
    pub fn mesh(&self, samples: &[u8], options: &ReadOptions) -> Result<TetMesh, ReadReason> {
        expect_count("bytes of samples", self.bytes()?, samples.len())?;
        let numbers = (samples.len() / self.number.size()) as u64;
        let _held = options.memory.hold(8 * numbers)?;
        let mesh = self.placement().mesh(self.values(samples, options)?, &options.memory)?;
        Ok(TetMesh { notes: self.notes.clone(), ..mesh })
    }

    pub fn placement(&self) -> Placement {
        Placement { dims: self.dims, origin: self.origin, steps: self.steps }
    }

    /// Whether the samples of points that follow one another do so in the file.
    pub fn is_by_points(&self) -> bool {
        self.axes.iter().rev().take(3).all(|axis| axis.is_space)
    }

    /// So many points in a row, where samples are [by points](Self::is_by_points).
    pub fn row(&self, points: u64) -> Self {
        let mut row = self.clone();
        row.dims = [points, 1, 1];
        row.axes
            .iter_mut()
            .filter(|axis| axis.is_space)
            .zip(row.dims)
            .for_each(|(axis, size)| axis.size = size);
        row
    }

    /// What these samples are.
    pub fn values(&self, samples: &[u8], options: &ReadOptions) -> Result<GridValues, ReadReason> {
        let mut fields = Collector::new(options);
        let mut values = Vec::new();
        for array in &self.arrays {
            let name = format!("{}{}", self.field, array.ending);
            let Some(claim) = fields.claim_named(&name, &array.names, array.has_length)? else { continue };
            if values.is_empty() {
                values = values_first(self.number.floats(samples, self.big), &self.axes);
            }
            let of_array = in_order(&values, self.components() as usize, &array.components);
            fields.fill(claim, of_array, self.number.is_integer(), &self.unit)?;
        }
        fields.others.iter_mut().for_each(|field| field.unit.clone_from(&self.unit));
        let others = [fields.others, Vec::new()];
        Ok(GridValues { fields: fields.fields, others, ..GridValues::default() })
    }
}

/// The values of each sample one behind the other.
fn values_first(values: Vec<f64>, axes: &[Axis]) -> Vec<f64> {
    let mut stride = 1;
    let mut strided: Vec<(Axis, usize)> = Vec::new();
    for axis in axes {
        strided.push((*axis, stride));
        stride *= axis.size as usize;
    }
    let is_sorted = strided.is_sorted_by_key(|(axis, _)| axis.is_space);
    if is_sorted || stride != values.len() {
        return values;
    }
    strided.sort_by_key(|(axis, _)| axis.is_space);
    let mut steps = vec![0; axes.len()];
    let (mut sorted, mut at) = (Vec::with_capacity(values.len()), 0);
    for _ in 0..values.len() {
        sorted.push(values[at]);
        for (step, (axis, stride)) in steps.iter_mut().zip(&strided) {
            *step += 1;
            at += stride;
            if *step < axis.size as usize {
                break;
            }
            at -= stride * *step;
            *step = 0;
        }
    }
    sorted
}

/// What `reader` unpacks, which has to be `expected` bytes.
pub(super) fn unpacked(reader: impl Read, expected: usize) -> Result<Vec<u8>, ReadReason> {
    let mut bytes = Vec::new();
    let mut limited = reader.take(expected as u64 + 1);
    limited.read_to_end(&mut bytes).map_err(|error| ReadReason::Damaged(error.to_string()))?;
    Ok(bytes)
}

/// The last `count` bytes of what `reader` unpacks.
pub(super) fn last_unpacked(mut reader: impl Read, count: usize) -> Result<Vec<u8>, ReadReason> {
    let (mut bytes, mut part) = (Vec::new(), vec![0; 1 << 16]);
    loop {
        let read = reader.read(&mut part).map_err(|error| ReadReason::Damaged(error.to_string()))?;
        bytes.extend_from_slice(&part[..read]);
        if read == 0 || bytes.len() > count.saturating_mul(2).max(1 << 20) {
            bytes.drain(..bytes.len().saturating_sub(count));
        }
        if read == 0 {
            return Ok(bytes);
        }
    }
}

/// The bytes of samples that are written as text.
pub(super) fn from_text(data: &[u8], number: NumberType, big: bool) -> Result<Vec<u8>, ReadReason> {
    let text = std::str::from_utf8(data);
    let text = text.map_err(|_| ReadReason::Syntax("the samples are not text".into()))?;
    let mut bytes = Vec::new();
    let words = text.split(|c: char| c.is_ascii_whitespace() || c == ',').filter(|word| !word.is_empty());
    for word in words {
        number.put(number.parse_float(word)?, big, &mut bytes);
    }
    Ok(bytes)
}

/// The samples in files that the header names as `key`, each of which has as many; `read` makes them of the bytes of a file.
pub(super) fn from_files(
    (key, names): (&str, &[String]),
    expected: usize,
    beside: Beside<'_>,
    read: impl Fn(&[u8], usize) -> Result<Vec<u8>, ReadReason>,
) -> Result<Vec<u8>, ReadError> {
    let part = expected.checked_div(names.len()).filter(|part| part * names.len() == expected);
    let uneven = || ReadReason::Syntax(format!("{expected} bytes of samples in {} files", names.len()));
    let part = part.filter(|part| *part > 0).ok_or_else(uneven).at(|| "header".into())?;
    let mut samples = Vec::new();
    for name in names {
        let place = || format!("\"{name}\"");
        let mut of_one = read(&beside(name).at(|| key.to_owned())?, part).at(place)?;
        expect_count("bytes of samples", part, of_one.len()).at(place)?;
        samples.append(&mut of_one);
    }
    Ok(samples)
}

/// The names of numbered files: a pattern of C's `printf` with one number, from `first` to `last` by `step`.
pub(super) fn numbered_files(
    pattern: &str,
    [first, last, step]: [i64; 3],
) -> Result<Vec<String>, ReadReason> {
    let wrong = || ReadReason::Syntax(format!("\"{pattern} {first} {last} {step}\" does not name files"));
    let (before, rest) = pattern.split_once('%').ok_or_else(wrong)?;
    let end = rest.find(['d', 'i', 'u']).ok_or_else(wrong)?;
    let (width, after) = (&rest[..end], &rest[end + 1..]);
    let digits: usize = if width.is_empty() { 0 } else { width.parse().map_err(|_| wrong())? };
    let count = last.checked_sub(first).and_then(|range| range.checked_div(step));
    let count = count.filter(|count| (0..MAX_FILES as i64).contains(count)).ok_or_else(wrong)?;
    if digits > 32 || after.contains('%') {
        return Err(wrong());
    }
    let name = |i: i64| {
        let number = first + i * step;
        let shown =
            if width.starts_with('0') { format!("{number:0digits$}") } else { format!("{number:digits$}") };
        format!("{before}{shown}{after}")
    };
    Ok((0..=count).map(name).collect())
}

/// Why an image that has not three dimensions is refused.
pub(super) fn wrong_dimensions(dimensions: usize) -> ReadReason {
    let what = match dimensions {
        1 => "a one-dimensional image".into(),
        2 => "a two-dimensional image".into(),
        4 => "a four-dimensional image".into(),
        other => format!("an image in {other} dimensions"),
    };
    let remedy = if dimensions < 3 { "stack its slices to a volume" } else { "give one in three dimensions" };
    ReadReason::unsupported(what, remedy)
}

/// Numbers that stand in one line of a header.
pub(super) fn numbers<T: std::str::FromStr>(text: &str, key: &str) -> Result<Vec<T>, ReadReason> {
    let parsed: Result<Vec<T>, _> = text.split_ascii_whitespace().map(str::parse).collect();
    parsed.map_err(|_| ReadReason::Syntax(format!("{key} \"{text}\" is not a list of numbers")))
}

/// The first number of a line of a header.
pub(super) fn first<T: std::str::FromStr + Copy>(text: &str, key: &str) -> Result<Option<T>, ReadReason> {
    Ok(numbers(text, key)?.first().copied())
}

/// Three numbers that stand in one line of a header.
pub(super) fn three<T: std::str::FromStr>(text: &str, key: &str) -> Result<[T; 3], ReadReason> {
    let list = numbers(text, key)?;
    list.try_into().map_err(|_| ReadReason::Syntax(format!("{key} \"{text}\" is not three numbers")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_numbered_files() {
        let names = |pattern, range| numbered_files(pattern, range).unwrap();
        assert_eq!(names("a%03d.raw", [8, 12, 2]), ["a008.raw", "a010.raw", "a012.raw"]);
        assert_eq!(names("%d", [1, 0, -1]), ["1", "0"]);
        for (pattern, range) in [
            ("a.raw", [0, 1, 1]),
            ("%s", [0, 1, 1]),
            ("%d", [0, 1, 0]),
            ("%d", [0, 1 << 40, 1]),
            ("%d%d", [0, 1, 1]),
        ] {
            assert!(numbered_files(pattern, range).is_err(), "{pattern} {range:?}");
        }
    }

    #[test]
    fn values_of_a_sample_come_together() {
        let axis = |size, is_space| Axis { size, is_space };
        let axes = [axis(2, true), axis(3, false), axis(2, true)];
        let values = (0..12).map(f64::from).collect();
        assert_eq!(values_first(values, &axes), [0., 2., 4., 1., 3., 5., 6., 8., 10., 7., 9., 11.]);
    }

    #[test]
    fn the_end_of_what_is_packed() {
        let bytes: Vec<u8> = (0..3_000_000_u32).map(|i| (i % 251) as u8).collect();
        assert_eq!(last_unpacked(bytes.as_slice(), 7).unwrap(), bytes[bytes.len() - 7..]);
        assert_eq!(last_unpacked(&bytes[..5], 7).unwrap(), bytes[..5]);
    }
}

//! The samples of an array, of any box of it: chunks that are not needed are not read.

use std::ops::Range;
use std::sync::Arc;

use half::{bf16, f16};
use zarrs::array::{
    Array, ArrayBytes, ArrayCreateError, ArrayError, ArrayShardedExt, ArraySubset, CodecError,
};
use zarrs::plugin::{ExtensionName, PluginCreateError, ZarrVersion};
use zarrs::storage::StorageError;

use crate::error::{At, ReadError, ReadReason, expect_count};
use crate::memory::MemoryLimit;
use crate::number::NumberType;
use crate::zarr::axes::Axes;
use crate::zarr::store::Store;

/// Most bytes of a chunk.
const MOST_CHUNK: u64 = 1 << 31;
/// So many times the bytes of a box are read to have whole chunks, and so many bytes in any case.
const MUCH_MORE: u64 = 4;
const FEW_BYTES: u64 = 1 << 26;

/// An array of numbers in a store.
#[derive(Debug)]
pub(super) struct Samples {
    array: Array<Store>,
    path: String,
    number: Number,
}

/// The type of the numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Number {
    Known(NumberType),
    F16,
    Bf16,
}

impl Number {
    /// By the names of version 3.
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "bool" => Self::Known(NumberType::U8),
            "float16" => Self::F16,
            "bfloat16" => Self::Bf16,
            other => Self::Known(NumberType::named(other)?),
        })
    }

    fn floats(self, bytes: &[u8]) -> Vec<f64> {
        // Numbers come as this machine has them.
        let halves = || bytes.as_chunks::<2>().0.iter().copied();
        match self {
            Self::Known(number) => number.floats(bytes, cfg!(target_endian = "big")),
            Self::F16 => halves().map(|half| f16::from_ne_bytes(half).to_f64()).collect(),
            Self::Bf16 => halves().map(|half| bf16::from_ne_bytes(half).to_f64()).collect(),
        }
    }

    fn size(self) -> u64 {
        match self {
            Self::Known(number) => number.size() as u64,
            Self::F16 | Self::Bf16 => 2,
        }
    }
}

impl Samples {
    /// Opens the array at a path of the store.
    pub fn open(store: &Arc<Store>, path: &str, memory: &MemoryLimit) -> Result<Self, ReadError> {
        let place = || shown(path);
        let array = Array::open(Arc::clone(store), &format!("/{path}")).map_err(not_opened).at(place)?;
        let name = array.data_type().name(ZarrVersion::V3);
        let name = name.map_or_else(|| "unknown".to_owned(), |name| name.into_owned());
        let number = Number::named(&name).ok_or_else(|| not_numbers(&name)).at(place)?;
        let samples = Self { array, path: path.to_owned(), number };
        let chunk = samples.chunk().at(place)?;
        let bytes = chunk.iter().fold(number.size(), |product, count| product.saturating_mul(*count));
        if bytes > MOST_CHUNK {
            return Err(ReadReason::TooLarge { what: "bytes in a chunk".into(), limit: MOST_CHUNK })
                .at(place);
        }
        memory.expect(bytes).at(place)?;
        Ok(samples)
    }

    pub fn shape(&self) -> &[u64] {
        self.array.shape()
    }

    pub fn is_integer(&self) -> bool {
        matches!(self.number, Number::Known(number) if number.is_integer())
    }

    /// Bytes of a sample.
    pub fn size(&self) -> u64 {
        self.number.size()
    }

    /// How many samples are read together along each axis: those of a chunk, or of one in a shard.
    pub fn chunk(&self) -> Result<Vec<u64>, ReadReason> {
        let chunk = self.array.subchunk_shape();
        let chunk = chunk.map_or_else(|| self.array.chunk_shape(&vec![0; self.shape().len()]), Ok);
        Ok(chunk.map_err(|error| damaged(&error))?.iter().map(|count| count.get()).collect())
    }

    /// All values of an array of one axis.
    pub fn list(&self) -> Result<Vec<f64>, ReadError> {
        let all = 0..self.shape()[0];
        self.ordered(std::slice::from_ref(&all), &[0])
    }

    /// The values in a box, x fastest, of one time and channel.
    pub fn values(
        &self,
        axes: &Axes,
        [time, channel]: [u64; 2],
        range: [Range<u64>; 3],
    ) -> Result<Vec<f64>, ReadError> {
        let mut ranges = vec![0..1; self.shape().len()];
        for (axis, at) in [(axes.time, time), (axes.channel, channel)] {
            if let Some(axis) = axis {
                ranges[axis] = at..at + 1;
            }
        }
        for (axis, range) in axes.space.into_iter().zip(range) {
            ranges[axis] = range;
        }
        self.ordered(&ranges, &axes.space)
    }

    /// The values in a box of the array, along these axes, the first one fastest; along others there is one.
    fn ordered(&self, ranges: &[Range<u64>], order: &[usize]) -> Result<Vec<f64>, ReadError> {
        let place = || shown(&self.path);
        // Of whole chunks, length and checksum are looked at.
        let read = self.in_whole_chunks(ranges).at(place)?;
        let bytes = self
            .bytes(&read)
            .map_err(|reason| self.in_chunk(&read).unwrap_or_else(|| at_place(place(), reason)))?;
        let count = |range: &Range<u64>| (range.end - range.start) as usize;
        let size = self.number.size() as usize;
        expect_count("bytes of samples", size * read.iter().map(count).product::<usize>(), bytes.len())
            .at(place)?;
        // The last axis of the array is the fastest.
        let stride = |axis: usize| read[axis + 1..].iter().map(count).product::<usize>();
        let first: usize = (0..ranges.len())
            .map(|axis| (ranges[axis].start - read[axis].start) as usize * stride(axis))
            .sum();
        let along: Vec<[usize; 2]> = order.iter().map(|&axis| [count(&ranges[axis]), stride(axis)]).collect();
        let [[nx, by_x], [ny, by_y], [nz, by_z]] = [0, 1, 2].map(|k| along.get(k).copied().unwrap_or([1, 0]));
        let is_as_read = along.iter().rev().map(|[_, by]| by).is_sorted_by(|a, b| a >= b);
        if is_as_read && read == ranges {
            return Ok(self.number.floats(&bytes));
        }
        let mut found = Vec::with_capacity(size * nx * ny * nz);
        for k in 0..nz {
            for j in 0..ny {
                let row = first + k * by_z + j * by_y;
                for i in 0..nx {
                    found.extend_from_slice(&bytes[(row + i * by_x) * size..][..size]);
                }
            }
        }
        Ok(self.number.floats(&found))
    }

    /// The chunks that a box is in, or the box itself where these have much more.
    fn in_whole_chunks(&self, ranges: &[Range<u64>]) -> Result<Vec<Range<u64>>, ReadReason> {
        let chunk = self.chunk()?;
        let whole = |(range, chunk): (&Range<u64>, &u64)| {
            range.start / chunk * chunk..range.end.div_ceil(*chunk).saturating_mul(*chunk)
        };
        let whole: Vec<Range<u64>> = ranges.iter().zip(&chunk).map(whole).collect();
        let bytes = |ranges: &[Range<u64>]| {
            let counts = ranges.iter().map(|range| range.end - range.start);
            counts.fold(self.number.size(), u64::saturating_mul)
        };
        let most = bytes(ranges).saturating_mul(MUCH_MORE).max(FEW_BYTES);
        Ok(if bytes(&whole) <= most { whole } else { ranges.to_vec() })
    }

    /// The samples in a box of the array, in its order.
    fn bytes(&self, ranges: &[Range<u64>]) -> Result<Vec<u8>, ReadReason> {
        let bytes: ArrayBytes<'static> =
            self.array.retrieve_array_subset(&ArraySubset::new_with_ranges(ranges)).map_err(not_read)?;
        Ok(bytes.into_fixed().map_err(|error| damaged(&error))?.into_owned())
    }

    /// The first chunk in a box that cannot be read, and why.
    fn in_chunk(&self, ranges: &[Range<u64>]) -> Option<ReadError> {
        let chunks = self.array.chunks_in_array_subset(&ArraySubset::new_with_ranges(ranges)).ok()??;
        for chunk in &chunks.indices() {
            let of_chunk = self.array.chunk_subset(&chunk).ok()?.to_ranges();
            let both = of_chunk.iter().zip(ranges).map(|(a, b)| a.start.max(b.start)..a.end.min(b.end));
            if let Err(reason) = self.bytes(&both.collect::<Vec<_>>()) {
                let place = format!("chunk \"{}\"", self.array.chunk_key(&chunk).as_str());
                return Some(at_place(place, reason));
            }
        }
        None
    }
}

fn at_place(place: String, reason: ReadReason) -> ReadError {
    ReadError { file: String::new(), place, reason }
}

/// An array in messages.
pub(super) fn shown(path: &str) -> String {
    if path.is_empty() { "the array".to_owned() } else { format!("array \"{path}\"") }
}

fn damaged(error: &dyn std::fmt::Display) -> ReadReason {
    ReadReason::Damaged(error.to_string())
}

fn not_numbers(name: &str) -> ReadReason {
    let remedy = "write it as integers or floating-point numbers; of complex ones the real part, the imaginary part or the magnitude";
    ReadReason::unsupported(format!("an array of data type \"{name}\""), remedy)
}

/// Why an array is not opened.
fn not_opened(error: ArrayCreateError) -> ReadReason {
    let unsupported = |what: &str, error: &PluginCreateError| {
        let remedy =
            "write the array again with a common codec, such as zstd or blosc, and a numeric data type";
        ReadReason::unsupported(format!("an array with {what} ({error})"), remedy)
    };
    match error {
        ArrayCreateError::DataTypeCreateError(error) => {
            unsupported("a data type that is not known here", &error)
        }
        ArrayCreateError::CodecsCreateError(error) => unsupported("a codec that is not known here", &error),
        ArrayCreateError::StorageTransformersCreateError(error) => {
            unsupported("a storage transformer", &error)
        }
        ArrayCreateError::ChunkGridCreateError(error) => {
            unsupported("a grid of chunks that is not known here", &error)
        }
        ArrayCreateError::ChunkKeyEncodingCreateError(error) => {
            unsupported("names of chunks that are not known here", &error)
        }
        ArrayCreateError::UnsupportedZarrV2Array(what) => ReadReason::unsupported(
            format!("an array of version 2 ({what})"),
            "write it again with a common codec, such as zstd or blosc",
        ),
        ArrayCreateError::StorageError(StorageError::Other(what)) => ReadReason::Io(what),
        other => ReadReason::Syntax(other.to_string()),
    }
}

/// Why a part of an array is not read.
fn not_read(error: ArrayError) -> ReadReason {
    match error {
        ArrayError::StorageError(StorageError::Other(what))
        | ArrayError::CodecError(CodecError::StorageError(StorageError::Other(what))) => ReadReason::Io(what),
        other => damaged(&other),
    }
}

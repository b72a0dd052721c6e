//! The samples of an array, of any box of it: chunks that are not needed are not read.

use std::ops::Range;
use std::sync::Arc;

use half::{bf16, f16};
use zarrs::array::{
    Array, ArrayBytes, ArrayCreateError, ArrayError, ArrayShardedExt, ArraySubset, CodecError,
};
use zarrs::plugin::{ExtensionName, PluginCreateError, ZarrVersion};
use zarrs::storage::StorageError;

use crate::error::{At, ReadError, ReadReason};
use crate::memory::MemoryLimit;
use crate::number::NumberType;
use crate::zarr::axes::Axes;
use crate::zarr::store::Store;

/// Most bytes of a chunk.
const MOST_CHUNK: u64 = 1 << 31;

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
        self.floats(&[0..self.shape()[0]])
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
        let values = self.floats(&ranges)?;
        let [x, y, z] = axes.space;
        if z < y && y < x {
            return Ok(values);
        }
        // The last axis of the array is the fastest.
        let count = |axis: usize| (ranges[axis].end - ranges[axis].start) as usize;
        let stride = |axis: usize| (axis + 1..ranges.len()).map(count).product::<usize>();
        let [by_x, by_y, by_z] = [x, y, z].map(stride);
        let mut ordered = Vec::with_capacity(values.len());
        for k in 0..count(z) {
            for j in 0..count(y) {
                let row = k * by_z + j * by_y;
                ordered.extend((0..count(x)).map(|i| values[row + i * by_x]));
            }
        }
        Ok(ordered)
    }

    /// The values in a box of the array, in its order.
    fn floats(&self, ranges: &[Range<u64>]) -> Result<Vec<f64>, ReadError> {
        let read = |ranges: &[Range<u64>]| {
            let bytes: ArrayBytes<'static> =
                self.array.retrieve_array_subset(&ArraySubset::new_with_ranges(ranges)).map_err(not_read)?;
            let bytes = bytes.into_fixed().map_err(|error| damaged(&error))?;
            Ok(self.number.floats(&bytes))
        };
        let values = read(ranges).map_err(|reason| {
            self.in_chunk(ranges, &read).unwrap_or_else(|| ReadError {
                file: String::new(),
                place: shown(&self.path),
                reason,
            })
        })?;
        let expected: u64 = ranges.iter().map(|range| range.end - range.start).product();
        crate::error::expect_count("samples", expected, values.len()).at(|| shown(&self.path))?;
        Ok(values)
    }

    /// The first chunk in a box that cannot be read, and why.
    fn in_chunk(
        &self,
        ranges: &[Range<u64>],
        read: &dyn Fn(&[Range<u64>]) -> Result<Vec<f64>, ReadReason>,
    ) -> Option<ReadError> {
        let chunks = self.array.chunks_in_array_subset(&ArraySubset::new_with_ranges(ranges)).ok()??;
        for chunk in &chunks.indices() {
            let of_chunk = self.array.chunk_subset_bounded(&chunk).ok()?.to_ranges();
            let both = of_chunk.iter().zip(ranges).map(|(a, b)| a.start.max(b.start)..a.end.min(b.end));
            if let Err(reason) = read(&both.collect::<Vec<_>>()) {
                let place = format!("chunk \"{}\"", self.array.chunk_key(&chunk).as_str());
                return Some(ReadError { file: String::new(), place, reason });
            }
        }
        None
    }
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
        ArrayCreateError::UnsupportedZarrV2Array(what) => {
            ReadReason::unsupported(format!("an array of version 2 ({what})"), "write it again as version 3")
        }
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

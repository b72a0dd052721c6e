//! Blocks of data in VTK XML files of which parts are read: see [`payload`](crate::payload) for how they are framed.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;

use crate::cells::Indices;
use crate::error::{ReadReason, Stop, expect_count};
use crate::number::NumberType;
use crate::payload::{self, BLOCKS, Compressor, Framing, decode_groups, to_usize};
use crate::shares;

/// Larger compressed blocks are not unpacked for a part of them.
const LARGEST_BLOCK: u64 = 1 << 24;
/// Bytes of base64 that are tried at first: longer lines are not written.
const TRIED: u64 = 1 << 12;

/// Bytes, wherever they are.
#[derive(Clone, Debug)]
pub(super) enum Bytes<'a> {
    File { file: &'a File, start: u64, end: u64 },
    Memory(&'a [u8]),
}

impl Bytes<'_> {
    fn len(&self) -> u64 {
        match self {
            Self::File { start, end, .. } => end.saturating_sub(*start),
            Self::Memory(bytes) => bytes.len() as u64,
        }
    }

    fn read(&self, range: Range<u64>) -> Result<Vec<u8>, ReadReason> {
        let Range { start, end } = range;
        let needed = end.saturating_sub(start);
        let truncated = || ReadReason::Truncated { needed, found: self.len().saturating_sub(start) };
        // What is not there sizes no buffer.
        if end > self.len() {
            return Err(truncated());
        }
        match self {
            Self::Memory(bytes) => Ok(bytes[start as usize..end as usize].to_vec()),
            Self::File { file, start: first, .. } => {
                let mut file = *file;
                let mut bytes = vec![0; to_usize(needed)?];
                let read =
                    file.seek(SeekFrom::Start(first + start)).and_then(|_| file.read_exact(&mut bytes));
                read.map_err(|error| ReadReason::Io(error.to_string()))?;
                Ok(bytes)
            }
        }
    }
}

/// Bytes that may be in base64.
#[derive(Clone, Debug)]
struct Encoded<'a> {
    bytes: Bytes<'a>,
    base64: bool,
}

impl<'a> Encoded<'a> {
    fn read(&self, range: Range<u64>) -> Result<Vec<u8>, ReadReason> {
        if !self.base64 {
            return self.bytes.read(range);
        }
        let first = range.start / 3;
        let end = range.end.div_ceil(3).saturating_mul(4).min(self.bytes.len());
        let text = self.bytes.read(first.saturating_mul(4).min(end)..end)?;
        let mut bytes = Vec::new();
        decode_groups(&text, &mut bytes)?;
        let skip = (range.start - 3 * first) as usize;
        let needed = to_usize(range.end - range.start)?;
        let found = bytes.len();
        let truncated =
            ReadReason::Truncated { needed: needed as u64, found: found.saturating_sub(skip) as u64 };
        if found < skip + needed {
            return Err(truncated);
        }
        bytes.truncate(skip + needed);
        bytes.drain(..skip);
        Ok(bytes)
    }

    /// What comes behind so many bytes, which may be encoded by themselves.
    fn behind(&self, count: u64) -> Result<(Self, u64), ReadReason> {
        let groups = count.div_ceil(3);
        let is_apart = self.base64
            && !count.is_multiple_of(3)
            && self.bytes.read(4 * groups - 1..4 * groups)?.first() == Some(&b'=');
        if !is_apart {
            return Ok((self.clone(), count));
        }
        let skip = 4 * groups;
        let bytes = match &self.bytes {
            Bytes::File { file, start, end } => Bytes::File { file, start: start + skip, end: *end },
            Bytes::Memory(bytes) => Bytes::Memory(bytes.get(skip as usize..).unwrap_or_default()),
        };
        Ok((Self { bytes, base64: true }, 0))
    }
}

/// A block of numbers, of which parts are read.
#[derive(Clone, Debug)]
pub(super) struct Stored<'a> {
    data: Encoded<'a>,
    /// Where in it the first number begins, or the first compressed block.
    first: u64,
    packed: Option<Packed>,
    number: NumberType,
    big: bool,
    count: u64,
}

/// The compressed blocks of a block.
#[derive(Clone, Debug)]
struct Packed {
    compressor: Compressor,
    /// Unpacked bytes of each but the last one, and of all.
    size: u64,
    all: u64,
    /// Where each ends, behind the first one's beginning.
    ends: Vec<u64>,
}

impl<'a> Stored<'a> {
    /// A block of exactly `count` numbers that begins with these bytes; `is_all` if nothing follows in them.
    pub fn open(
        (bytes, base64, is_all): (Bytes<'a>, bool, bool),
        framing: Framing,
        number: NumberType,
        count: u64,
    ) -> Result<Self, Stop> {
        let open = || {
            // So all numbers of it have a place that can be counted.
            let needed = count.checked_mul(number.size() as u64);
            let needed = needed.ok_or(ReadReason::TooLarge { what: "numbers".into(), limit: u64::MAX })?;
            let encoded = Encoded { bytes, base64 };
            let width = framing.width() as u64;
            let header = |first: u64, count: u64| -> Result<Vec<u64>, ReadReason> {
                let bytes = encoded.read(first * width..first.saturating_add(count).saturating_mul(width))?;
                Ok(bytes.chunks_exact(width as usize).map(|bytes| framing.number(bytes)).collect())
            };
            let Some(compressor) = framing.compressor else {
                expect_count("bytes of data", needed, header(0, 1)?[0])?;
                let (data, first) = encoded.behind(width)?;
                return Ok((data, first, None, needed));
            };
            let [blocks, size, last] = header(0, 3)?[..] else {
                return Err(ReadReason::Truncated { needed: 3, found: 0 });
            };
            let full = blocks.checked_sub(u64::from(last != 0));
            let all = full.and_then(|n| n.checked_mul(size)).and_then(|n| n.checked_add(last));
            expect_count("bytes of data", needed, all.unwrap_or(u64::MAX))?;
            let mut end = 0_u64;
            let ends = header(3, blocks)?.into_iter().map(|size| {
                end = end.saturating_add(size);
                end
            });
            let size = if blocks == 1 { needed } else { size }.max(1);
            if last > size {
                return Err(ReadReason::Damaged("a last block larger than the others".into()));
            }
            let packed = Packed { compressor, size, all: needed, ends: ends.collect() };
            let (data, first) = encoded.behind(width * (3 + blocks))?;
            Ok((data, first, Some(packed), end))
        };
        let found = open();
        let (data, first, packed, length) = match found {
            // White space in it, which only those who read all of it pass over.
            Err(ReadReason::Damaged(_)) => return Err(Stop::Whole(NOT_IN_ONE_PIECE)),
            other => other?,
        };
        if packed.as_ref().is_some_and(|packed| packed.size > LARGEST_BLOCK) {
            return Err(Stop::Whole("its compressed blocks are large"));
        }
        if base64 {
            data.expect_no_space(first.saturating_add(length), is_all)?;
        }
        Ok(Self { data, first, packed, number, big: framing.big, count })
    }

    /// The bytes of these numbers.
    pub fn bytes(&self, numbers: Range<u64>) -> Result<Vec<u8>, ReadReason> {
        let size = self.number.size() as u64;
        expect_count("numbers", numbers.end.max(self.count), self.count)?;
        let range = numbers.start * size..numbers.end * size;
        if range.is_empty() {
            return Ok(Vec::new());
        }
        let Some(packed) = &self.packed else {
            let place = |byte: u64| self.first.saturating_add(byte);
            return self.data.read(place(range.start)..place(range.end));
        };
        packed.read(&self.data, self.first, range)
    }

    pub fn floats(&self, numbers: Range<u64>) -> Result<Vec<f64>, ReadReason> {
        Ok(self.number.floats(&self.bytes(numbers)?, self.big))
    }

    /// Indices, decoded later if they are integers.
    pub fn indices(&self, numbers: Range<u64>) -> Result<Indices<'static>, ReadReason> {
        if !self.number.is_integer() {
            return self.integers(numbers).map(Indices::Listed);
        }
        let bytes = self.bytes(numbers)?.into();
        Ok(Indices::Stored { bytes, number: self.number, big: self.big })
    }

    pub fn integers(&self, numbers: Range<u64>) -> Result<Vec<i64>, ReadReason> {
        self.number.integers(&self.bytes(numbers)?, self.big)
    }
}

const NOT_IN_ONE_PIECE: &str = "its arrays are not in one piece";

impl Encoded<'_> {
    /// Checks that no white space is between the characters of so many bytes.
    fn expect_no_space(&self, count: u64, is_all: bool) -> Result<(), Stop> {
        let whole = Err(Stop::Whole(NOT_IN_ONE_PIECE));
        let length = count.div_ceil(3).saturating_mul(4);
        let Some(rest) = self.bytes.len().checked_sub(length) else {
            // It may lack padding.
            return if is_all { whole } else { Ok(()) };
        };
        let is_space = |bytes: &[u8]| bytes.trim_ascii().is_empty();
        if is_all && !(rest <= TRIED && is_space(&self.bytes.read(length..length + rest)?)) {
            return whole;
        }
        if self.bytes.read(0..length.min(TRIED))?.iter().any(u8::is_ascii_whitespace) {
            whole
        } else {
            Ok(())
        }
    }
}

impl Packed {
    /// The bytes of a range that is not empty.
    fn read(&self, data: &Encoded<'_>, first: u64, range: Range<u64>) -> Result<Vec<u8>, ReadReason> {
        let blocks = to_usize(range.start / self.size)?..to_usize(range.end.div_ceil(self.size))?;
        let end = |block: usize| block.checked_sub(1).map_or(0, |before| self.ends[before]);
        let begun = end(blocks.start);
        let compressed = data.read(first.saturating_add(begun)..first.saturating_add(end(blocks.end)))?;
        let mut bytes = Vec::new();
        shares::append(&mut bytes, blocks.len(), BLOCKS, |share| {
            let mut part = Vec::new();
            for i in share.start + blocks.start..share.end + blocks.start {
                let own = (end(i) - begun) as usize..(end(i + 1) - begun) as usize;
                let expected = self.size.min(self.all - i as u64 * self.size);
                payload::unpack(self.compressor, i, &compressed[own], to_usize(expected)?, &mut part)?;
            }
            Ok(part)
        })?;
        let skip = (range.start - blocks.start as u64 * self.size) as usize;
        bytes.truncate(skip + (range.end - range.start) as usize);
        bytes.drain(..skip);
        Ok(bytes)
    }
}

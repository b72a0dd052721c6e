//! A file in shards: its bytes are in several objects, cut at multiples of the length of the first one.
//!
//! Nothing but the lengths says so: the header of the file states how many bytes it has, and the first object has fewer. Hosts limit the
//! size of objects; `docs/format.md` has the names.

use super::error::StreamError;
use crate::format::{HEADER_BYTES, stated_bytes};
use std::fmt;
use std::io;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;

/// What stands behind the name of the file in that of a shard; the first one, number 0, has the name of the file.
pub fn shard_suffix(number: u64) -> String {
    if number == 0 { String::new() } else { format!(".{number:04}") }
}

/// Where the bytes of a file are that is in several shards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shards {
    /// Of each but the last one.
    size: u64,
    total: u64,
}

impl Shards {
    /// Those of a file of `total` bytes of which the first object has `size`, if that is not all of it.
    pub fn of(size: u64, total: u64) -> Option<Self> {
        (0 < size && size < total).then_some(Self { size, total })
    }

    /// The length of the whole file.
    pub fn total(self) -> u64 {
        self.total
    }

    /// The shard that has the byte at this place.
    pub fn number_at(self, at: u64) -> u64 {
        at / self.size
    }

    /// The bytes of the file that are in a shard.
    pub fn range(self, number: u64) -> Range<u64> {
        let start = number.saturating_mul(self.size).min(self.total);
        start..start.saturating_add(self.size).min(self.total)
    }

    /// Refuses a shard of another length than it must have.
    pub fn check(self, number: u64, found: u64) -> Result<(), StreamError> {
        let range = self.range(number);
        let expected = range.end - range.start;
        if found == expected {
            return Ok(());
        }
        Err(StreamError::WrongShard { suffix: shard_suffix(number), found, expected })
    }

    /// The error for a shard that is not there.
    pub fn missing(self, number: u64) -> StreamError {
        StreamError::MissingShard {
            suffix: shard_suffix(number),
            from: self.range(number).start,
            total: self.total,
        }
    }
}

/// A file that can be read and sought in, whether it is in shards or not: whoever makes it opens shards by their suffixes.
pub struct ShardedFile<R, F> {
    first: R,
    open: F,
    /// None of a file that is whole.
    shards: Option<Shards>,
    /// The one that was read last, if it was not the first.
    other: Option<(u64, R)>,
    at: u64,
}

impl<R, F> fmt::Debug for ShardedFile<R, F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ShardedFile")
            .field("shards", &self.shards)
            .field("at", &self.at)
            .finish_non_exhaustive()
    }
}

impl<R: Read + Seek, F: FnMut(&str) -> io::Result<R>> ShardedFile<R, F> {
    /// The file of which `first` is all, or the first shard. Others are opened when they are needed.
    ///
    /// # Errors
    /// If `first` cannot be read.
    pub fn new(mut first: R, open: F) -> io::Result<Self> {
        let size = first.seek(SeekFrom::End(0))?;
        first.rewind()?;
        let mut start = Vec::new();
        first.by_ref().take(HEADER_BYTES as u64).read_to_end(&mut start)?;
        first.rewind()?;
        let shards = stated_bytes(&start).and_then(|total| Shards::of(size, total));
        Ok(Self { first, open, shards, other: None, at: 0 })
    }

    /// In how many files it is; those behind the first may not be there.
    pub fn count(&self) -> u64 {
        self.shards.map_or(1, |shards| shards.number_at(shards.total - 1) + 1)
    }

    /// The shard of this number, which has the length that it must have.
    fn shard(&mut self, shards: Shards, number: u64) -> io::Result<&mut R> {
        if number == 0 {
            return Ok(&mut self.first);
        }
        let shard = match self.other.take() {
            Some((held, shard)) if held == number => shard,
            _ => {
                let mut shard = (self.open)(&shard_suffix(number)).map_err(|error| match error.kind() {
                    io::ErrorKind::NotFound => io::Error::other(shards.missing(number)),
                    _ => error,
                })?;
                shards.check(number, shard.seek(SeekFrom::End(0))?).map_err(io::Error::other)?;
                shard
            }
        };
        Ok(&mut self.other.insert((number, shard)).1)
    }
}

impl<R: Read + Seek, F: FnMut(&str) -> io::Result<R>> Read for ShardedFile<R, F> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let Some(shards) = self.shards else { return self.first.read(buffer) };
        if self.at >= shards.total || buffer.is_empty() {
            return Ok(0);
        }
        let number = shards.number_at(self.at);
        let range = shards.range(number);
        let at = self.at;
        let most = usize::try_from(range.end - at).map_or(buffer.len(), |left| left.min(buffer.len()));
        let shard = self.shard(shards, number)?;
        shard.seek(SeekFrom::Start(at - range.start))?;
        let read = shard.read(&mut buffer[..most])?;
        self.at += read as u64;
        Ok(read)
    }
}

impl<R: Read + Seek, F> Seek for ShardedFile<R, F> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let Some(shards) = self.shards else { return self.first.seek(to) };
        let at = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::End(by) => shards.total.checked_add_signed(by),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
        };
        self.at = at.ok_or_else(|| io::Error::from(io::ErrorKind::InvalidInput))?;
        Ok(self.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_byte_is_in_one_shard() {
        for (size, total) in [(1, 2), (3, 10), (5, 10), (9, 10)] {
            let shards = Shards::of(size, total).expect("it is less than the whole");
            for at in 0..total {
                let number = shards.number_at(at);
                assert!(shards.range(number).contains(&at));
                assert!(number == 0 || !shards.range(number - 1).contains(&at));
            }
            let last = shards.number_at(total - 1);
            assert_eq!((shards.range(last).end, shards.range(last + 1)), (total, total..total));
        }
        assert_eq!([Shards::of(10, 10), Shards::of(11, 10), Shards::of(0, 10)], [None; 3]);
        assert_eq!([0, 1, 42, 12345].map(shard_suffix), ["", ".0001", ".0042", ".12345"]);
    }
}

//! Where bytes come from, for native programs: one interface for files and servers.

use super::error::StreamError;
use super::loader::{Traffic, WantedRange};
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::time::Duration;

/// A range that was wanted, with its bytes: fewer where it reaches beyond the end of the file.
pub type Arrived = (Range<u64>, Vec<u8>);

/// Something that ranges of bytes can be had from.
pub trait RangeSource {
    /// Says which ranges are wanted from now on, all of them; each comes out once.
    fn want(&mut self, wanted: &[WantedRange]);

    /// The next range that is complete: waits up to `patience` for it. `None` if there is none by then, or none wanted.
    fn next(&mut self, patience: Duration) -> Result<Option<Arrived>, StreamError>;

    /// The size of the whole, once it is known.
    fn total(&self) -> Option<u64>;

    /// The bytes that it has, if those are a part of the whole: ascending, with something between any two.
    fn held(&self) -> Option<&[Range<u64>]> {
        None
    }

    /// The bytes of these ranges, one behind the other. What was wanted before no longer is.
    ///
    /// # Errors
    /// If one of them does not come whole.
    fn read(&mut self, ranges: &[Range<u64>]) -> Result<Vec<u8>, StreamError> {
        let mut bytes = Vec::new();
        for range in ranges {
            self.want(&[WantedRange { range: range.clone(), priority: 0.0 }]);
            let part = loop {
                if let Some((_, part)) = self.next(Duration::from_secs(1))? {
                    break part;
                }
            };
            if part.len() as u64 != range.end - range.start {
                return Err(StreamError::Changed);
            }
            bytes.extend(part);
        }
        Ok(bytes)
    }

    /// What has been asked and has come over a network, if that is where the bytes are.
    fn traffic(&self) -> Option<Traffic> {
        None
    }
}

/// Ranges of whatever can be read and sought: a file that is open, bytes in memory; or of a part of a file.
#[derive(Debug)]
pub struct FileSource<R> {
    reader: R,
    total: u64,
    /// Of a part of a file, where what `reader` has stands in it.
    held: Option<Vec<Range<u64>>>,
    /// The most important last.
    wanted: Vec<WantedRange>,
}

impl<R: Read + Seek> FileSource<R> {
    /// Takes over `reader`.
    pub fn new(mut reader: R) -> Result<Self, StreamError> {
        let total = reader.seek(SeekFrom::End(0)).map_err(unreadable)?;
        Ok(Self { reader, total, held: None, wanted: Vec::new() })
    }

    /// A part of a file of `total` bytes: `reader` has the bytes of these ranges, one behind the other, as [`RangeSource::read`] gives
    /// those of [`Session::needed_bytes`](crate::session::Session::needed_bytes).
    pub fn of_part(reader: R, held: Vec<Range<u64>>, total: u64) -> Self {
        Self { reader, total, held: Some(held), wanted: Vec::new() }
    }

    /// Where the reader has a range, or as much of its beginning as is there.
    fn place(&self, range: &Range<u64>) -> Range<u64> {
        let Some(held) = &self.held else { return range.start.min(self.total)..range.end.min(self.total) };
        let mut before = 0;
        for run in held {
            if run.contains(&range.start) {
                return before + range.start - run.start..before + range.end.min(run.end) - run.start;
            }
            before += run.end - run.start;
        }
        0..0
    }

    fn bytes_of(&mut self, range: &Range<u64>) -> Result<Vec<u8>, StreamError> {
        let range = self.place(range);
        let length = range.end.saturating_sub(range.start);
        let mut bytes = Vec::new();
        self.reader.seek(SeekFrom::Start(range.start)).map_err(unreadable)?;
        self.reader.by_ref().take(length).read_to_end(&mut bytes).map_err(unreadable)?;
        // What was there when it was opened is gone: the file is being written to.
        if (bytes.len() as u64) < length { Err(StreamError::Changed) } else { Ok(bytes) }
    }
}

fn unreadable(error: std::io::Error) -> StreamError {
    // Readers of several files say themselves what is wrong with them.
    error.downcast().unwrap_or_else(|error| StreamError::Unreadable(error.to_string()))
}

impl<R: Read + Seek> RangeSource for FileSource<R> {
    fn want(&mut self, wanted: &[WantedRange]) {
        self.wanted = wanted.to_vec();
        self.wanted.sort_by(|a, b| a.priority.total_cmp(&b.priority).then(b.range.start.cmp(&a.range.start)));
    }

    fn next(&mut self, _patience: Duration) -> Result<Option<Arrived>, StreamError> {
        let Some(wanted) = self.wanted.pop() else { return Ok(None) };
        let bytes = self.bytes_of(&wanted.range)?;
        self.wanted.retain(|other| other.range != wanted.range);
        Ok(Some((wanted.range, bytes)))
    }

    fn total(&self) -> Option<u64> {
        Some(self.total)
    }

    fn held(&self) -> Option<&[Range<u64>]> {
        self.held.as_deref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn ranges_of_a_file_come_in_the_order_of_their_importance() {
        let mut source = FileSource::new(Cursor::new(b"0123456789".to_vec())).expect("it can be read");
        let wanted = |range, priority| WantedRange { range, priority };
        source.want(&[
            wanted(7..99, 0.0),
            wanted(2..4, 1.0),
            wanted(0..1, 1.0),
            wanted(2..4, 0.5),
            wanted(50..60, 0.0),
        ]);
        let mut next = || source.next(Duration::ZERO).expect("no error");
        assert_eq!(next(), Some((0..1, b"0".to_vec())));
        assert_eq!(next(), Some((2..4, b"23".to_vec())));
        assert_eq!(next(), Some((7..99, b"789".to_vec())));
        assert_eq!(next(), Some((50..60, Vec::new())));
        assert_eq!(next(), None);
        assert_eq!(source.total(), Some(10));
    }

    #[test]
    fn a_part_of_a_file_gives_what_it_has() {
        let mut file = FileSource::new(Cursor::new(b"0123456789".to_vec())).expect("it can be read");
        let held = vec![0..3, 5..9];
        let bytes = file.read(&held).expect("it is there");
        assert_eq!(bytes, b"0125678");
        assert_eq!(file.read(std::slice::from_ref(&(8..11))), Err(StreamError::Changed));
        let mut part = FileSource::of_part(Cursor::new(bytes), held.clone(), 10);
        assert_eq!((part.held(), part.total()), (Some(&held[..]), Some(10)));
        assert_eq!(part.read(&[6..9, 0..1, 5..7]), Ok(b"678056".to_vec()));
        part.want(&[WantedRange { range: 1..6, priority: 0.0 }]);
        assert_eq!(part.next(Duration::ZERO), Ok(Some((1..6, b"12".to_vec()))));
        assert_eq!(part.read(std::slice::from_ref(&(3..4))), Err(StreamError::Changed));
    }
}

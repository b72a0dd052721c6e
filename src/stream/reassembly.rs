//! Bytes that have arrived and wait for the rest of their range.

use super::range_set::RangeSet;
use std::ops::Range;

/// Runs of bytes of a file, in order and apart. They grow with what arrives, never with what a header announces.
#[derive(Debug, Default)]
pub struct Reassembly {
    runs: Vec<Run>,
}

#[derive(Debug)]
struct Run {
    start: u64,
    bytes: Vec<u8>,
}

impl Run {
    fn range(&self) -> Range<u64> {
        self.start..self.start + self.bytes.len() as u64
    }

    /// The bytes in `range`, which need not lie inside.
    fn part(&self, range: &Range<u64>) -> &[u8] {
        let place = |at: u64| (at.clamp(self.start, self.range().end) - self.start) as usize;
        &self.bytes[place(range.start)..place(range.end).max(place(range.start))]
    }
}

impl Reassembly {
    /// Takes bytes that are not held yet.
    pub fn put(&mut self, start: u64, bytes: &[u8]) {
        let at = self.runs.partition_point(|run| run.start < start);
        if let Some(before) = at.checked_sub(1).map(|before| &mut self.runs[before]) {
            assert!(before.range().end <= start, "no byte is held twice");
            if before.range().end == start {
                before.bytes.extend_from_slice(bytes);
                return;
            }
        }
        self.runs.insert(at, Run { start, bytes: bytes.to_vec() });
    }

    /// A copy of the bytes in `range`, as far as they are there.
    pub fn get(&self, range: &Range<u64>) -> Vec<u8> {
        let mut bytes = Vec::new();
        for run in &self.runs {
            bytes.extend_from_slice(run.part(range));
        }
        bytes
    }

    /// What is held.
    pub fn ranges(&self) -> impl Iterator<Item = Range<u64>> {
        self.runs.iter().map(Run::range)
    }

    /// Drops what is not in `keep`.
    pub fn keep(&mut self, keep: &RangeSet) {
        let mut kept = Vec::new();
        for run in std::mem::take(&mut self.runs) {
            let all = run.range();
            if keep.first_in(&all).is_some_and(|part| part == all) {
                kept.push(run);
                continue;
            }
            let mut rest = all;
            while let Some(part) = keep.first_in(&rest) {
                kept.push(Run { start: part.start, bytes: run.part(&part).to_vec() });
                rest.start = part.end;
            }
        }
        self.runs = kept;
    }

    /// How many bytes are held.
    pub fn len(&self) -> u64 {
        self.runs.iter().map(|run| run.bytes.len() as u64).sum()
    }
}

//! What a session has of the blocks of a file elsewhere, and what it plans to have.

use crate::mt::ErrorCode;
use crate::refine::{Budget, Criterion};
use crate::stream::RangeSet;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// What a request can need by what the index says that it reaches, with the largest errors.
#[derive(Debug, Default)]
pub(super) struct Reached {
    pub blocks: Vec<(ErrorCode, u32)>,
    /// Pages of the index that are not here, some of whose blocks it may be.
    pub pages: Vec<(ErrorCode, u32)>,
    /// Pages that are here, whose blocks are among those above if they can be needed.
    pub pages_here: Vec<u32>,
}

/// The blocks of a session; nothing of one that is fed from front to back.
#[derive(Debug, Default)]
pub(super) struct Blocks {
    /// Whether the file comes in parts.
    pub in_parts: bool,
    /// Bytes that blocks may take in memory.
    pub memory: u64,
    /// How far the file has been read in order.
    pub fed: u64,
    /// Bytes that have come, those that came again counted again.
    pub fetched: u64,
    /// What has come.
    pub arrived: RangeSet,
    /// What has come of blocks that are not complete, by where it begins.
    pub pieces: BTreeMap<u64, Vec<u8>>,
    /// The beginning of a range of a block, and where that begins: it came with what stands in front of the blocks.
    pub beginning: Option<(u64, Vec<u8>)>,
    /// Complete blocks that wait for others, by number.
    pub waiting: BTreeMap<u32, Vec<u8>>,
    /// What is to be here, most important first, as far as there is memory for it.
    pub plan: Vec<(f64, u32)>,
    /// Pages of the index that are to be here.
    pub pages: Vec<(f64, u32)>,
    /// Bytes in memory of those that are here.
    pub index_bytes: u64,
    /// Those that have come for this request: they stay, or they would be asked for again.
    pub pages_come: Vec<u32>,
    pub needed: u32,
    pub left_out: u32,
    /// Blocks that are needed and that the source does not have.
    pub absent: u32,
    /// The bytes that the source has, where those are a part of the file.
    pub held: Option<RangeSet>,
    /// The number of the plan in which each block was needed last, if it ever was.
    pub last_needed: BTreeMap<u32, u32>,
    pub plans: u32,
    /// The criterion of the request, and its budget.
    pub criterion: Option<Arc<dyn Criterion>>,
    pub budget: Budget,
    /// What the request can need; none if its criterion cannot tell.
    pub reached: Option<Reached>,
    /// Blocks that a mesh needed all the same.
    pub missed: u32,
}

impl Blocks {
    /// No blocks yet, which may take so many bytes in memory.
    pub fn new(memory: u64) -> Self {
        Self { in_parts: true, memory, ..Self::default() }
    }

    /// Whether the source has these bytes.
    pub fn can_come(&self, ranges: &[Range<u64>]) -> bool {
        self.held.as_ref().is_none_or(|held| ranges.iter().all(|range| held.contains(range)))
    }

    /// As much of the beginning of a range as the source has.
    pub fn within_held(&self, range: Range<u64>) -> Option<Range<u64>> {
        let Some(held) = &self.held else { return Some(range) };
        held.first_in(&range).filter(|part| part.start == range.start)
    }

    /// Notes that so many bytes have come from `start` on.
    pub fn arrive(&mut self, start: u64, bytes: usize) {
        self.fetched += bytes as u64;
        self.arrived.insert(&(start..start.saturating_add(bytes as u64)));
    }

    /// Bytes that have come, each counted once.
    pub fn arrived_bytes(&self) -> u64 {
        self.arrived.len()
    }

    /// Bytes of what waits to be put together.
    pub fn bytes_beside(&self) -> u64 {
        let beginning = self.beginning.as_ref().map(|(_, bytes)| bytes);
        let all = self.pieces.values().chain(self.waiting.values()).chain(beginning);
        all.map(|bytes| bytes.len() as u64).sum()
    }

    /// What is missing of a range of a block.
    pub fn rest_of(&self, range: Range<u64>) -> Range<u64> {
        match &self.beginning {
            Some((start, bytes)) if *start == range.start => start + bytes.len() as u64..range.end,
            _ => range,
        }
    }

    /// Bytes that have come, with the beginning that they continue.
    pub fn with_beginning<'a>(&self, start: u64, bytes: &'a [u8]) -> (u64, Cow<'a, [u8]>) {
        match &self.beginning {
            Some((first, begun)) if first + begun.len() as u64 == start => {
                (*first, Cow::Owned([begun, bytes].concat()))
            }
            _ => (start, Cow::Borrowed(bytes)),
        }
    }

    /// Keeps what has come of the `ranges` of a block that goes on behind `bytes`, which begin at `start`.
    pub fn keep_beginning(&mut self, ranges: &[Range<u64>], start: u64, bytes: &[u8]) {
        let end = start + bytes.len() as u64;
        for range in ranges.iter().filter(|range| (start..end).contains(&range.start)) {
            let come = bytes[(range.start - start) as usize..(range.end.min(end) - start) as usize].to_vec();
            if range.end <= end {
                self.pieces.insert(range.start, come);
            } else {
                self.beginning = Some((range.start, come));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_that_come_again_are_counted_once() {
        let mut blocks = Blocks::new(0);
        for (start, bytes, arrived) in
            [(10, 5, 5), (0, 2, 7), (12, 8, 12), (2, 8, 20), (0, 20, 20), (30, 0, 20), (29, 3, 23)]
        {
            blocks.arrive(start, bytes);
            assert_eq!(blocks.arrived_bytes(), arrived, "{start} {bytes}");
        }
        assert_eq!(blocks.fetched, 46);
    }
}

//! What a session has of the blocks of a file elsewhere, and what it plans to have.

use super::pieces::Pieces;
use crate::refine::Criterion;
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

/// The blocks of a session.
#[derive(Debug)]
pub(super) struct Blocks {
    /// Bytes that blocks may take in memory.
    pub memory: u64,
    /// How far the file has been read in order.
    pub fed: u64,
    /// What has come of blocks that are not complete, by where it begins.
    pub pieces: Pieces,
    /// The beginning of a range of a block, and where that begins: it came with what stands in front of the blocks.
    pub beginning: Option<(u64, Vec<u8>)>,
    /// Complete blocks that wait for others, by number.
    pub waiting: Pieces,
    /// What is to be here, most important first, as far as there is memory for it.
    pub plan: Vec<(f64, u32)>,
    pub needed: u32,
    pub left_out: u32,
    /// The number of the plan in which each block was needed last.
    pub last_needed: Vec<u32>,
    pub plans: u32,
    /// The criterion of the request.
    pub criterion: Option<Arc<dyn Criterion>>,
}

impl Blocks {
    /// No blocks yet, which may take so many bytes in memory.
    pub fn new(memory: u64) -> Self {
        Self {
            memory,
            fed: 0,
            pieces: Pieces::default(),
            beginning: None,
            waiting: Pieces::default(),
            plan: Vec::new(),
            needed: 0,
            left_out: 0,
            last_needed: Vec::new(),
            plans: 0,
            criterion: None,
        }
    }

    /// Bytes of what waits to be put together.
    pub fn bytes_beside(&self) -> u64 {
        let beginning = self.beginning.as_ref().map_or(0, |(_, bytes)| bytes.len() as u64);
        self.pieces.bytes() + self.waiting.bytes() + beginning
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

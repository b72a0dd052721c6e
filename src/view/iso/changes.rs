//! Which entries of an array were written since somebody last asked, by blocks.

use super::cut::BLOCK;
use std::ops::Range;

/// Written entries, by blocks.
#[derive(Clone, Debug, Default)]
pub(super) struct Marks(Vec<u64>);

impl Marks {
    pub fn mark(&mut self, entry: u32) {
        let block = entry as usize / BLOCK;
        if block / 64 >= self.0.len() {
            self.0.resize(block / 64 + 1, 0);
        }
        self.0[block / 64] |= 1 << (block % 64);
    }

    pub fn mark_all(&mut self, len: usize) {
        self.0.clear();
        self.0.resize(len.div_ceil(64 * BLOCK), u64::MAX);
    }

    /// The ranges of blocks that were written, as far as there are `len` entries, and forgets them.
    pub fn take(&mut self, len: usize) -> Vec<Range<u32>> {
        let mut ranges: Vec<Range<u32>> = Vec::new();
        let marked = |block: &usize| self.0[block / 64] >> (block % 64) & 1 == 1;
        for block in (0..(self.0.len() * 64).min(len.div_ceil(BLOCK))).filter(marked) {
            let (start, end) = ((block * BLOCK) as u32, ((block + 1) * BLOCK).min(len) as u32);
            match ranges.last_mut() {
                Some(last) if last.end == start => last.end = end,
                _ => ranges.push(start..end),
            }
        }
        self.0.clear();
        ranges
    }
}

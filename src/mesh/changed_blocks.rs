//! Which entries of an array have changed since the last call.

use std::ops::Range;

/// Changed entries of an array, by blocks.
#[derive(Clone, Debug, Default)]
pub(crate) struct ChangedBlocks {
    words: Vec<u64>,
}

/// log2 of [`BLOCK`]: 1 KiB of tetrahedra.
const BLOCK_BITS: u32 = 6;
/// Entries of a block.
pub(crate) const BLOCK: usize = 1 << BLOCK_BITS;

impl ChangedBlocks {
    /// All entries of an array of this length, and no others.
    pub fn all(len: usize) -> Self {
        let mut changed = Self::default();
        (0..len).step_by(BLOCK).for_each(|entry| changed.mark(entry as u32));
        changed
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.words[..])
    }

    #[inline]
    pub fn mark(&mut self, entry: u32) {
        let block = entry >> BLOCK_BITS;
        let (word, bit) = ((block / 64) as usize, 1 << (block % 64));
        match self.words.get_mut(word) {
            Some(word) => *word |= bit,
            None => self.grow(word, bit),
        }
    }

    #[cold]
    fn grow(&mut self, word: usize, bit: u64) {
        self.words.resize(word + 1, 0);
        self.words[word] = bit;
    }

    /// The array has become shorter.
    pub fn truncate(&mut self, len: usize) {
        self.words.truncate(len.div_ceil(64 * BLOCK));
    }

    /// The ranges of blocks that have changed, as far as there are `len` entries, and forgets them.
    pub fn take(&mut self, len: usize) -> Vec<Range<u32>> {
        let ranges = self.ranges(len);
        self.words.fill(0);
        ranges
    }

    /// The ranges of blocks that have changed, as far as there are `len` entries.
    pub fn ranges(&self, len: usize) -> Vec<Range<u32>> {
        let mut ranges: Vec<Range<u32>> = Vec::new();
        for (i, &word) in self.words.iter().enumerate() {
            let mut bits = word;
            while bits != 0 {
                let block = i as u32 * 64 + bits.trailing_zeros();
                bits &= bits - 1;
                let (start, end) = (block << BLOCK_BITS, ((block + 1) << BLOCK_BITS).min(len as u32));
                match ranges.last_mut() {
                    _ if start >= end => {}
                    Some(last) if last.end == start => last.end = end,
                    _ => ranges.push(start..end),
                }
            }
        }
        ranges
    }
}

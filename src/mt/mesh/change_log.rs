//! Which entries of an array have changed, by blocks, so that copies elsewhere can be kept up to date at the cost of the
//! change.

use std::ops::Range;

/// What [`CurrentMesh::take_changes`](crate::mt::CurrentMesh::take_changes) tells.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MeshChanges {
    /// Changed ranges of vertex slots.
    pub vertices: Vec<Range<u32>>,
    /// Changed ranges of tetrahedron slots.
    pub tets: Vec<Range<u32>>,
}

/// Changed entries of an array, by blocks.
#[derive(Clone, Debug, Default)]
pub(super) struct Changes {
    blocks: Vec<u64>,
}

/// log2 of the entries in a block: 1 KiB of tetrahedra.
const BLOCK_BITS: u32 = 6;

impl Changes {
    pub fn all(len: usize) -> Self {
        let mut changes = Self::default();
        (0..len.next_multiple_of(1 << BLOCK_BITS))
            .step_by(1 << BLOCK_BITS)
            .for_each(|i| changes.mark(i as u32));
        changes
    }

    #[inline]
    pub fn mark(&mut self, entry: u32) {
        let block = entry >> BLOCK_BITS;
        let (word, bit) = ((block / 64) as usize, 1 << (block % 64));
        match self.blocks.get_mut(word) {
            Some(word) => *word |= bit,
            None => self.grow(word, bit),
        }
    }

    #[cold]
    fn grow(&mut self, word: usize, bit: u64) {
        self.blocks.resize(word + 1, 0);
        self.blocks[word] = bit;
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.blocks[..])
    }

    pub fn truncate(&mut self, len: usize) {
        self.blocks.truncate(len.div_ceil(64 << BLOCK_BITS));
    }

    pub fn take(&mut self, len: usize) -> Vec<Range<u32>> {
        let mut ranges: Vec<Range<u32>> = Vec::new();
        for (i, word) in self.blocks.iter_mut().enumerate() {
            let mut bits = std::mem::take(word);
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

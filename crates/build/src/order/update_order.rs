//! In which order the updates of an MT are numbered: coarse to fine in blocks, so that files can be cut into them.
//!
//! Any order that extends the partial order will do. This one takes updates by falling error, a block at a time; in
//! large models by bands of falling error, each several times as large as the one before, and in these place by place.
//! Within a block come first the updates that depend on none of the block, then those that depend on these alone, and
//! so on, the vertices that they split ascending: that takes few bits.

use std::collections::BTreeMap;
use tetralod::geom::{Groups, morton};

/// What the order depends on. Updates are numbered by falling error, which extends the partial order.
pub(crate) struct Updates<'a> {
    /// Vertices of the base mesh.
    pub base: u32,
    /// The vertex that each update splits, in the numbers of that order: see [`EdgeMt`](tetralod::mt::EdgeMt).
    pub vertices: &'a [u32],
    /// Where the parents of each update begin; one more than there are updates.
    pub starts: &'a [u32],
    pub parents: &'a [u32],
    /// Where each takes place, on a lattice of `bits` bits.
    pub sites: &'a [[i32; 3]],
    pub bits: u32,
}

/// Vertices that a split creates.
const CREATED: u32 = 2;

/// Models of at most so many updates are always fetched as a whole, so sorting them by place gains nothing.
const SMALL: usize = 1 << 17;

/// A band ends where this many times as many updates have come as before it.
const BAND_GROWTH: usize = 4;

/// Updates in a cell of a band.
const CELL: usize = 512;

impl Updates<'_> {
    fn parents(&self, u: u32) -> &[u32] {
        &self.parents[self.starts[u as usize] as usize..self.starts[u as usize + 1] as usize]
    }

    /// The updates in the new order, in blocks of `2^block_bits`.
    pub fn order(&self, block_bits: u32) -> Vec<u32> {
        let count = self.vertices.len();
        let mut order: Vec<u32> = (0..count as u32).collect();
        if count > SMALL {
            order = self.by_place(&self.error_bands());
        }
        self.sort_blocks(&mut order, block_bits);
        order
    }

    /// Sorts the updates of each block.
    fn sort_blocks(&self, order: &mut [u32], block_bits: u32) {
        let count = self.vertices.len();
        let mut new_numbers = vec![u32::MAX; count];
        let mut depths = vec![0_u32; count];
        let mut first = 0;
        for block in order.chunks_mut(1 << block_bits) {
            block.iter().for_each(|&u| new_numbers[u as usize] = first);
            for &u in block.iter() {
                // A number that is not smaller is in the block, or has none yet but is not a parent.
                let inside = self.parents(u).iter().filter(|&&p| new_numbers[p as usize] == first);
                depths[u as usize] = inside.map(|&p| depths[p as usize] + 1).max().unwrap_or(0);
            }
            self.sort(block, first, &depths, &mut new_numbers);
            first += block.len() as u32;
        }
    }

    /// Sorts a block by depth and new vertex number, and numbers its updates from `first` on.
    fn sort(&self, block: &mut [u32], first: u32, depths: &[u32], new_numbers: &mut [u32]) {
        let mut runs: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for &u in block.iter() {
            runs.entry(depths[u as usize]).or_default().push(u);
        }
        let mut at = 0;
        for run in runs.values_mut() {
            // What creates their vertices is of an earlier run.
            run.sort_by_cached_key(|&u| self.vertex(u, new_numbers));
            for &u in run.iter() {
                block[at] = u;
                new_numbers[u as usize] = first + at as u32;
                at += 1;
            }
        }
    }

    /// The new number of the vertex that `u` splits.
    fn vertex(&self, u: u32, new_numbers: &[u32]) -> u32 {
        let vertex = self.vertices[u as usize];
        match vertex.checked_sub(self.base) {
            Some(created) => {
                let [creator, place] = [created / CREATED, created % CREATED];
                self.base + CREATED * new_numbers[creator as usize] + place
            }
            None => vertex,
        }
    }

    /// Where the bands of falling error end.
    fn error_bands(&self) -> Vec<usize> {
        let mut ends = vec![self.vertices.len()];
        while let Some(&end) = ends.last().filter(|&&end| end > SMALL / BAND_GROWTH) {
            ends.push(end / BAND_GROWTH);
        }
        ends.reverse();
        ends
    }

    /// Bands that end there, in each cell by cell what can come, again and again until all has.
    fn by_place(&self, ends: &[usize]) -> Vec<u32> {
        let count = self.vertices.len();
        let mut left: Vec<u32> = (0..count as u32).map(|u| self.parents(u).len() as u32).collect();
        let children = Groups::new(count, |add| {
            (0..count as u32).for_each(|u| self.parents(u).iter().for_each(|&p| add(p as usize, u)));
        });
        let mut order = Vec::with_capacity(count);
        let mut start = 0;
        for &end in ends {
            let mut band: Vec<u32> = (start as u32..end as u32).collect();
            band.sort_by_cached_key(|&u| (curve(self.sites[u as usize], self.bits), u));
            let cells = band.len().div_ceil(CELL).max(1);
            let mut cell_of = vec![0_u32; end - start];
            for (at, &u) in band.iter().enumerate() {
                cell_of[u as usize - start] = (at * cells / band.len()) as u32;
            }
            let mut ready: Vec<std::collections::BTreeSet<u32>> = vec![Default::default(); cells];
            let cell = |u: u32| cell_of[u as usize - start] as usize;
            band.iter().filter(|&&u| left[u as usize] == 0).for_each(|&u| {
                ready[cell(u)].insert(u);
            });
            while order.len() < end {
                let before = order.len();
                for c in 0..cells {
                    while let Some(u) = ready[c].pop_first() {
                        order.push(u);
                        for &child in children.of(u as usize) {
                            left[child as usize] -= 1;
                            if left[child as usize] == 0 && (child as usize) < end {
                                ready[cell(child)].insert(child);
                            }
                        }
                    }
                }
                assert!(order.len() > before, "the order extends the partial order");
            }
            start = end;
        }
        order
    }
}

/// Where a position lies on a curve through the lattice that seldom leaps far.
fn curve(position: [i32; 3], bits: u32) -> u64 {
    morton(position.map(|x| (x >> bits.saturating_sub(20)) as u32))
}

//! What updates reach: what they and all that depend on them touch.
//!
//! ```text
//!    u ──▶ v ──▶ x         ┌───────────────────┐ reach of u: what its own star touches,
//!    └───▶ w               │  ┌─────┐     u    │ and the reaches of v and w
//!                          │  │  w  │ ┌──────┐ │
//!   an arrow leads to what │  └─────┘ │ v  x │ │
//!   depends on an update   │          └──────┘ │
//!                          └───────────────────┘
//! ```
//!
//! A request needs an update only if it asks for a tetrahedron that this one, or one that depends on it, removes. So what a block of
//! updates reaches tells whether the block can be needed, without any other block.

use super::UpdateId;
use super::regions::RegionSets;

/// Where something is and which levels it has: a box on the lattice, and field by field the least and the largest level; and in which
/// regions, ascending, where the MT has some.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Extent {
    pub bounds: [[i32; 3]; 2],
    pub ranges: Vec<[i32; 2]>,
    pub regions: Vec<u16>,
}

impl Extent {
    /// Of nothing.
    pub fn empty(fields: usize) -> Self {
        Self { bounds: NOWHERE, ranges: vec![NO_LEVEL; fields], regions: Vec::new() }
    }

    /// Takes a vertex in.
    pub fn add(&mut self, position: [i32; 3], levels: &[i32]) {
        widen(&mut self.bounds, &[position; 2]);
        self.ranges.iter_mut().zip(levels).for_each(|(all, &level)| join(all, [level; 2]));
    }
}

const NOWHERE: [[i32; 3]; 2] = [[i32::MAX; 3], [i32::MIN; 3]];
const NO_LEVEL: [i32; 2] = [i32::MAX, i32::MIN];

fn join(all: &mut [i32; 2], [low, high]: [i32; 2]) {
    *all = [all[0].min(low), all[1].max(high)];
}

fn widen([low, high]: &mut [[i32; 3]; 2], other: &[[i32; 3]; 2]) {
    for k in 0..3 {
        low[k] = low[k].min(other[0][k]);
        high[k] = high[k].max(other[1][k]);
    }
}

/// The extents of updates, and which depend on which, taken down in their order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reaches {
    bounds: Vec<[[i32; 3]; 2]>,
    /// Update by update and field by field.
    ranges: Vec<[i32; 2]>,
    parents: Vec<u32>,
    /// Where the parents of each update end.
    ends: Vec<u32>,
    /// The set of regions that each update touches; empty if the MT has none.
    regions: Vec<u32>,
    sets: RegionSets,
}

impl Reaches {
    /// Adds the next update: what it removes and inserts, and what it depends on.
    pub fn push(&mut self, bounds: [[i32; 3]; 2], ranges: &[[i32; 2]], parents: &[UpdateId]) {
        self.bounds.push(bounds);
        self.ranges.extend_from_slice(ranges);
        self.parents.extend(parents.iter().map(|u| u.0));
        self.ends.push(self.parents.len() as u32);
    }

    /// States the regions of what the last update removes, in any order; to be called for all updates or for none.
    pub fn push_regions(&mut self, regions: Vec<u16>) {
        self.regions.push(self.sets.number(regions));
    }

    /// What each page of `2^bits` updates reaches, of an MT with so many fields.
    pub fn of_pages(self, bits: u32, fields: usize) -> Vec<Extent> {
        let Self { mut bounds, mut ranges, parents, ends, mut regions, mut sets } = self;
        // Parents have smaller numbers: from the last update on, each is whole when its own parents take it in.
        for u in (0..bounds.len()).rev() {
            let first = u.checked_sub(1).map_or(0, |before| ends[before] as usize);
            for &parent in &parents[first..ends[u] as usize] {
                let parent = parent as usize;
                let own = bounds[u];
                widen(&mut bounds[parent], &own);
                for f in 0..fields {
                    let own = ranges[u * fields + f];
                    join(&mut ranges[parent * fields + f], own);
                }
                if let Some(&own) = regions.get(u) {
                    regions[parent] = sets.join(regions[parent], own);
                }
            }
        }
        let mut pages = vec![Extent::empty(fields); bounds.len().div_ceil(1 << bits)];
        for (u, own) in bounds.iter().enumerate() {
            let page = &mut pages[u >> bits];
            widen(&mut page.bounds, own);
            let own = &ranges[u * fields..][..fields];
            page.ranges.iter_mut().zip(own).for_each(|(all, &range)| join(all, range));
        }
        for (page, regions) in pages.iter_mut().zip(regions.chunks(1 << bits)) {
            let all = regions.iter().fold(0, |all, &own| sets.join(all, own));
            page.regions = sets.get(all).to_vec();
        }
        pages
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Update 3 depends on 1, and 1 on 0; 2 depends on none.
    #[test]
    fn reaches_hold_those_of_all_that_depend_on_an_update() {
        let mut reaches = Reaches::default();
        let parents: [&[u32]; 4] = [&[], &[0], &[], &[1]];
        for (u, parents) in (0..).zip(parents) {
            let parents: Vec<UpdateId> = parents.iter().map(|&p| UpdateId(p)).collect();
            reaches.push([[10 * u; 3], [10 * u + 1; 3]], &[[u, u + 5]], &parents);
        }
        let extent = |low: i32, high: i32, levels| Extent {
            bounds: [[low; 3], [high; 3]],
            ranges: vec![levels],
            regions: Vec::new(),
        };
        let each = reaches.clone().of_pages(0, 1);
        let expected =
            [extent(0, 31, [0, 8]), extent(10, 31, [1, 8]), extent(20, 21, [2, 7]), extent(30, 31, [3, 8])];
        assert_eq!(each, expected);
        assert_eq!(reaches.of_pages(1, 1), [extent(0, 31, [0, 8]), extent(20, 31, [2, 8])]);
    }

    #[test]
    fn regions_are_those_of_all_that_depend_on_an_update() {
        let mut reaches = Reaches::default();
        let updates: [(&[u32], &[u16]); 4] = [(&[], &[2, 0]), (&[0], &[0]), (&[], &[1]), (&[1, 2], &[3, 1])];
        for (parents, regions) in updates {
            let parents: Vec<UpdateId> = parents.iter().map(|&p| UpdateId(p)).collect();
            reaches.push([[0; 3]; 2], &[], &parents);
            reaches.push_regions(regions.to_vec());
        }
        let of = |bits: u32| {
            let pages = reaches.clone().of_pages(bits, 0);
            pages.into_iter().map(|page| page.regions).collect::<Vec<_>>()
        };
        assert_eq!(of(0), [vec![0, 1, 2, 3], vec![0, 1, 3], vec![1, 3], vec![1, 3]]);
        assert_eq!(of(1), [vec![0, 1, 2, 3], vec![1, 3]]);
    }
}

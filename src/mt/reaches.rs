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

use super::pages::Rows;
use super::regions::RegionSets;
use super::{MtInfo, UpdateId};
use std::ops::Range;

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

/// log2 of the steps of the lattice on which files state places, of a finer one with so many bits: they have eight bits.
pub(crate) fn coarser_by(bits: u32) -> u32 {
    bits.saturating_sub(u8::BITS)
}

/// From where to where, in steps of that lattice, and one less at the end.
type Coarse = [u8; 2];

/// The least such range around one on the lattice. That of what holds two is that of both of theirs.
fn coarse([low, high]: [i32; 2], shift: u32) -> Coarse {
    [low >> shift, (high - 1).max(0) >> shift].map(|x| x.clamp(0, u8::MAX.into()) as u8)
}

/// The range of nothing.
const NOTHING: Coarse = [u8::MAX, 0];

fn exact([low, last]: Coarse, shift: u32) -> [i32; 2] {
    [i32::from(low) << shift, (i32::from(last) + 1) << shift]
}

fn widen_coarse(all: &mut Coarse, [low, last]: Coarse) {
    *all = [all[0].min(low), all[1].max(last)];
}

/// The extents of updates, as files state them, and which depend on which, taken down node by node; a node is what is built by itself, all
/// if nothing is. No update depends on one of another node that comes later.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reaches {
    /// log2 of the updates of a page.
    bits: u32,
    /// What each number of an update is stated [coarser by](coarser_by): three of its box, then field by field.
    shifts: Vec<u32>,
    /// Page by page, and there update by update; nothing once the page is closed.
    ranges: Vec<Vec<Coarse>>,
    /// The same for the set of regions that each update touches, where the MT has regions.
    regions: Vec<Vec<u32>>,
    sets: RegionSets,
    /// What pages reach that are closed.
    closed: Vec<Option<Extent>>,
    /// What the updates of the node depend on, and those of nodes before.
    open: Vec<Parents>,
    before: Vec<Vec<Parents>>,
}

/// What consecutive updates depend on.
#[derive(Clone, Debug)]
struct Parents {
    first: u32,
    count: u32,
    /// For each update how many parents it has, and how far each lies before it: numbers of seven bits a byte, low ones first, all but the last
    /// with the top bit set.
    coded: Vec<u8>,
}

/// Updates whose parents are kept together, at most.
const TOGETHER: u32 = 1024;

impl Parents {
    fn put(&mut self, mut number: u32) {
        while number > 0x7F {
            self.coded.push(number as u8 | 0x80);
            number >>= 7;
        }
        self.coded.push(number as u8);
    }

    fn push(&mut self, parents: &[UpdateId]) {
        let update = self.first + self.count;
        self.put(parents.len() as u32);
        parents.iter().for_each(|parent| self.put(update - parent.0));
        self.count += 1;
    }

    /// Those of each update.
    fn rows(&self) -> Rows<u32> {
        let mut bytes = self.coded.iter();
        let mut next = || {
            let (mut number, mut shift) = (0, 0);
            for &byte in bytes.by_ref() {
                number |= u32::from(byte & 0x7F) << shift;
                shift += 7;
                if byte < 0x80 {
                    break;
                }
            }
            number
        };
        let mut rows = Rows::new();
        for update in self.first..self.first + self.count {
            let parents: Vec<u32> = (0..next()).map(|_| update - next()).collect();
            rows.push(&parents);
        }
        rows
    }
}

impl Reaches {
    /// Without updates yet, of pages of `2^bits`.
    pub fn new(info: &MtInfo, bits: u32) -> Self {
        let fields = info.fields.iter().map(|field| coarser_by(field.bits));
        let shifts = [coarser_by(info.lattice.bits); 3].into_iter().chain(fields).collect();
        Self { bits, shifts, ..Self::default() }
    }

    /// The page of an update, and its place there.
    fn place(&self, update: u32) -> (usize, usize) {
        ((update >> self.bits) as usize, (update & ((1 << self.bits) - 1)) as usize)
    }

    /// Adds an update of the node, behind those on which it depends: what it removes and inserts, and these.
    pub fn push(
        &mut self,
        update: UpdateId,
        [low, high]: [[i32; 3]; 2],
        ranges: &[[i32; 2]],
        parents: &[UpdateId],
    ) {
        let (page, place) = self.place(update.0);
        if self.ranges.len() <= page {
            self.ranges.resize(page + 1, Vec::new());
        }
        let (stride, own) = (self.shifts.len(), &mut self.ranges[page]);
        own.resize(own.len().max((place + 1) * stride), NOTHING);
        let sides = (0..3).map(|axis| [low[axis], high[axis]]);
        let all = sides.chain(ranges.iter().copied()).zip(&self.shifts);
        own[place * stride..]
            .iter_mut()
            .zip(all)
            .for_each(|(own, (range, &shift))| *own = coarse(range, shift));
        match self.open.last_mut() {
            Some(last) if last.first + last.count == update.0 && last.count < TOGETHER => last.push(parents),
            _ => {
                let mut own = Parents { first: update.0, count: 0, coded: Vec::new() };
                own.push(parents);
                self.open.push(own);
            }
        }
    }

    /// States the regions of what an update removes, in any order; to be called for all updates or for none.
    pub fn push_regions(&mut self, update: UpdateId, regions: Vec<u16>) {
        let (page, place) = self.place(update.0);
        if self.regions.len() <= page {
            self.regions.resize(page + 1, Vec::new());
        }
        let own = &mut self.regions[page];
        own.resize(own.len().max(place + 1), 0);
        own[place] = self.sets.number(regions);
    }

    /// Ends a node.
    pub fn end_node(&mut self) {
        let node = std::mem::take(&mut self.open);
        self.before.push(node);
    }

    /// Ends a node on which no later one depends. It has all updates in these ranges: their pages are closed.
    pub fn close_node(&mut self, updates: &[Range<u32>]) {
        let node = std::mem::take(&mut self.open);
        self.pass_on(node);
        for updates in updates {
            let (first, end) = (updates.start.div_ceil(1 << self.bits), updates.end >> self.bits);
            (first..end).for_each(|page| self.close(page as usize));
        }
    }

    /// Makes the reaches of parents hold those of the updates of a node.
    fn pass_on(&mut self, node: Vec<Parents>) {
        let stride = self.shifts.len();
        // Parents come before: from the last update on, each is whole when its own parents take it in.
        for parents in node.iter().rev() {
            let rows = parents.rows();
            for k in (0..parents.count).rev() {
                let (page, place) = self.place(parents.first + k);
                let own = self.ranges[page][place * stride..][..stride].to_vec();
                let regions = self.regions.get(page).map(|page| page[place]);
                for &parent in rows.row(k as usize) {
                    let (page, place) = self.place(parent);
                    let above = self.ranges.get_mut(page).and_then(|page| page.get_mut(place * stride..));
                    let above = above.unwrap_or_default().iter_mut();
                    above.zip(&own).for_each(|(all, &own)| widen_coarse(all, own));
                    if let Some(regions) = regions {
                        let above = &mut self.regions[page][place];
                        *above = self.sets.join(*above, regions);
                    }
                }
            }
        }
    }

    /// Notes what a page reaches, and forgets what its updates do.
    fn close(&mut self, page: usize) {
        let Some(own) = self.ranges.get_mut(page).map(std::mem::take).filter(|own| !own.is_empty()) else {
            return;
        };
        let mut all = vec![NOTHING; self.shifts.len()];
        for own in own.chunks(self.shifts.len()) {
            all.iter_mut().zip(own).for_each(|(all, &own)| widen_coarse(all, own));
        }
        let ranges: Vec<[i32; 2]> =
            all.into_iter().zip(&self.shifts).map(|(range, &shift)| exact(range, shift)).collect();
        let corner = |end: usize| [0, 1, 2].map(|axis| ranges[axis][end]);
        let regions = self.regions.get_mut(page).map(std::mem::take).unwrap_or_default();
        let regions = regions.into_iter().reduce(|all, own| self.sets.join(all, own));
        if self.closed.len() <= page {
            self.closed.resize(page + 1, None);
        }
        self.closed[page] = Some(Extent {
            bounds: [corner(0), corner(1)],
            ranges: ranges[3..].to_vec(),
            regions: regions.map_or_else(Vec::new, |set| self.sets.get(set).to_vec()),
        });
    }

    /// What each page reaches.
    pub fn finish(mut self) -> Vec<Extent> {
        self.end_node();
        while let Some(node) = self.before.pop() {
            self.pass_on(node);
        }
        (0..self.ranges.len()).for_each(|page| self.close(page));
        self.closed.into_iter().flatten().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reaches of an MT with so many fields, whose lattices are those of files.
    fn reaches(fields: usize, bits: u32) -> Reaches {
        Reaches { bits, shifts: vec![0; 3 + fields], ..Reaches::default() }
    }

    fn ids(parents: &[u32]) -> Vec<UpdateId> {
        parents.iter().map(|&p| UpdateId(p)).collect()
    }

    /// Update 3 depends on 1, and 1 on 0; 2 depends on none.
    const PARENTS: [&[u32]; 4] = [&[], &[0], &[], &[1]];

    fn push(reaches: &mut Reaches, u: u32) {
        let x = 10 * u as i32;
        let range = [u as i32, u as i32 + 5];
        reaches.push(UpdateId(u), [[x; 3], [x + 1; 3]], &[range], &ids(PARENTS[u as usize]));
    }

    fn extent(low: i32, high: i32, levels: [i32; 2]) -> Extent {
        Extent { bounds: [[low; 3], [high; 3]], ranges: vec![levels], regions: Vec::new() }
    }

    #[test]
    fn reaches_hold_those_of_all_that_depend_on_an_update() {
        let of = |bits: u32| {
            let mut reaches = reaches(1, bits);
            (0..4).for_each(|u| push(&mut reaches, u));
            reaches.finish()
        };
        let expected =
            [extent(0, 31, [0, 8]), extent(10, 31, [1, 8]), extent(20, 21, [2, 7]), extent(30, 31, [3, 8])];
        assert_eq!(of(0), expected);
        assert_eq!(of(1), [extent(0, 31, [0, 8]), extent(20, 31, [2, 8])]);
    }

    #[test]
    fn nodes_that_are_closed_count_too() {
        let mut reaches = reaches(1, 0);
        (0..2).for_each(|u| push(&mut reaches, u));
        reaches.end_node();
        // The last number comes before others.
        push(&mut reaches, 3);
        reaches.close_node(std::slice::from_ref(&(3..4)));
        assert!(reaches.ranges[3].is_empty() && !reaches.ranges[1].is_empty());
        push(&mut reaches, 2);
        reaches.close_node(std::slice::from_ref(&(2..3)));
        let expected =
            [extent(0, 31, [0, 8]), extent(10, 31, [1, 8]), extent(20, 21, [2, 7]), extent(30, 31, [3, 8])];
        assert_eq!(reaches.finish(), expected);
    }

    #[test]
    fn far_parents_come_back() {
        let rows: [&[u32]; 3] = [&[0, 127, 70_000, 69_999], &[], &[70_001, 1]];
        let mut parents = Parents { first: 70_001, count: 0, coded: Vec::new() };
        rows.iter().for_each(|row| parents.push(&ids(row)));
        let found = parents.rows();
        assert!((0..3).all(|k| found.row(k) == rows[k]));
    }

    #[test]
    fn regions_are_those_of_all_that_depend_on_an_update() {
        let updates: [(&[u32], &[u16]); 4] = [(&[], &[2, 0]), (&[0], &[0]), (&[], &[1]), (&[1, 2], &[3, 1])];
        let of = |bits: u32| {
            let mut reaches = reaches(0, bits);
            for (u, (parents, regions)) in (0..).zip(updates) {
                reaches.push(UpdateId(u), [[0; 3]; 2], &[], &ids(parents));
                reaches.push_regions(UpdateId(u), regions.to_vec());
            }
            reaches.finish().into_iter().map(|page| page.regions).collect::<Vec<_>>()
        };
        assert_eq!(of(0), [vec![0, 1, 2, 3], vec![0, 1, 3], vec![1, 3], vec![1, 3]]);
        assert_eq!(of(1), [vec![0, 1, 2, 3], vec![1, 3]]);
    }
}

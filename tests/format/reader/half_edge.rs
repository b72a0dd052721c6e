//! Blocks of half-edge insertions, read by themselves: lists of children and codes of stars.

use super::change::{Point, Tet};
use super::coded::{
    BASE_INNER, CHILD_GAP, CHILD_OFFSET, Coded, FOREST_CHILDREN, HALF_EDGE_ERROR, HALF_EDGE_LEVEL,
    HALF_EDGE_SIDE, HALF_EDGE_SIDES, NAMED, NEW_BLOCK, REMOVER, STAR_BIT, STAR_BITS, STAR_SYMBOL,
    STAR_SYMBOLS, len,
};
use super::growth::Growth;
use super::wire::{Bytes, Info};
use super::{File, splits};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// A forest child of a vertex: an update, and where it inserts its vertex as seen from this one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Child {
    pub update: u32,
    pub offset: Point,
}

/// What is told of a tetrahedron when it is created: the update that removes it, and by corner opposite whether a face is inner.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mark {
    pub remover: Option<u32>,
    pub inner: [bool; 4],
}

/// What `BASE` tells besides the base mesh.
#[derive(Clone, Debug)]
pub struct Forest {
    /// By base tetrahedron.
    pub marks: Vec<Mark>,
    /// By base vertex.
    pub children: Vec<Vec<Child>>,
}

/// What a block tells of an update.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Record {
    pub update: u32,
    /// Of the vertex that it inserts.
    pub children: Vec<Child>,
    pub symbols: Vec<u32>,
    pub bits: Vec<bool>,
    /// By field.
    pub errors: Vec<u16>,
    pub residuals: Vec<i32>,
    /// By field the residuals in further regions.
    pub sides: Vec<Vec<i32>>,
}

/// What has been named so far in a section.
struct Names {
    block_bits: u32,
    updates: u32,
    /// With the last child of each; the one named last first.
    blocks: Vec<(u32, u32)>,
    newest_block: i64,
    offset: Point,
}

pub fn forest(coded: &mut Coded<'_>, info: &Info, block_bits: u32, base: &Growth) -> Forest {
    let marks = base.tets.iter().map(|_| {
        let Some(remover) = coded.number(REMOVER, 0).checked_sub(1) else { return Mark::default() };
        assert!(remover < info.updates);
        let inner = coded.symbol(BASE_INNER, 0);
        Mark { remover: Some(remover), inner: [0, 1, 2, 3].map(|corner| inner >> corner & 1 == 1) }
    });
    let marks = marks.collect();
    let mut names = Names::new(info, block_bits, 0);
    let children = base.positions.iter().map(|_| names.children(coded, None)).collect();
    Forest { marks, children }
}

/// Reads a block, given nothing of any other.
pub fn block(file: &File, block: u32, parts: &[Bytes<'_>]) -> Vec<Record> {
    let updates: Range<u32> = file.updates(block);
    let mut names = Names::new(&file.info, file.block_bits, block);
    let mut coded = Coded::new(parts[0], &file.tables);
    let records = updates.clone().map(|update| {
        let children = names.children(&mut coded, Some(update));
        let count = coded.symbol(STAR_SYMBOLS, 0);
        let symbols = (0..count).map(|i| coded.symbol(STAR_SYMBOL, which(i, count))).collect();
        let count = coded.number(STAR_BITS, 0);
        let bits = (0..count).map(|i| i + 1 == count || coded.symbol(STAR_BIT, which(i, count)) == 1);
        let bits = bits.collect();
        Record { update, children, symbols, bits, ..Record::default() }
    });
    let mut records: Vec<Record> = records.collect();
    coded.end();
    for (f, part) in parts[1..].iter().enumerate() {
        let mut coded = Coded::new(*part, &file.tables);
        let field = splits::field(&mut coded, updates.len(), [HALF_EDGE_ERROR, HALF_EDGE_LEVEL]);
        let mut before = 0;
        for record in &mut records {
            let count = if file.jumps(f) { coded.number(HALF_EDGE_SIDES, before) } else { 0 };
            assert!(count <= 127);
            record.sides.push((0..count).map(|_| coded.signed(HALF_EDGE_SIDE, 0)).collect());
            before = count.min(1);
        }
        coded.end();
        for (record, (error, residual)) in records.iter_mut().zip(field) {
            record.errors.push(error);
            record.residuals.push(residual);
        }
    }
    records
}

/// Each base vertex with its regions but the first, vertices and then regions ascending.
pub fn further_regions(tets: &[Tet], of_tets: &[u16]) -> Vec<(u32, u16)> {
    let mut regions: BTreeMap<u32, BTreeSet<u16>> = BTreeMap::new();
    for (tet, region) in tets.iter().zip(of_tets) {
        tet.iter().for_each(|&v| _ = regions.entry(v).or_default().insert(*region));
    }
    let further = |(v, own): (u32, BTreeSet<u16>)| own.into_iter().skip(1).map(move |region| (v, region));
    regions.into_iter().flat_map(further).collect()
}

/// The levels of base vertices in these regions, in one field.
pub fn base_sides(coded: &mut Coded<'_>, sides: &[(u32, u16)]) -> BTreeMap<(u32, u16), i32> {
    assert_eq!(coded.number(HALF_EDGE_SIDES, 0) as usize, sides.len());
    let mut level = 0;
    let next = |&side: &(u32, u16)| {
        level += coded.signed(HALF_EDGE_SIDE, 1);
        (side, level)
    };
    sides.iter().map(next).collect()
}

/// The context of the `i`-th of `n` symbols or bits of a star.
fn which(i: u32, n: u32) -> u32 {
    let row = match n {
        0 | 1 => 0,
        2 => 1,
        3 | 4 => 2,
        5 | 6 => 3,
        7..=9 => 4,
        10..=13 => 5,
        14..=19 => 6,
        _ => 7,
    };
    let column = match i {
        0..=2 => i,
        3 | 4 => 3,
        5..=7 => 4,
        8..=11 => 5,
        12..=16 => 6,
        _ => 7,
    };
    8 * row + column
}

/// A signed number that the number of a symbol stands for.
fn unfolded(n: u32) -> i64 {
    let n = i64::from(n);
    if n % 2 == 0 { n / 2 } else { -(n / 2) - 1 }
}

impl Names {
    fn new(info: &Info, block_bits: u32, block: u32) -> Self {
        Self {
            block_bits,
            updates: info.updates,
            blocks: Vec::new(),
            newest_block: i64::from(block),
            offset: [0; 3],
        }
    }

    /// The children of the vertex that an update inserts, or of a base vertex.
    fn children(&mut self, coded: &mut Coded<'_>, of: Option<u32>) -> Vec<Child> {
        let mut children: Vec<Child> = Vec::new();
        for _ in 0..coded.number(FOREST_CHILDREN, 0) {
            let update = self.update(coded);
            let before = children.last().map(|child| child.update).or(of);
            assert!(before.is_none_or(|before| before < update) && update < self.updates);
            children.push(Child { update, offset: self.offset(coded) });
        }
        children
    }

    fn update(&mut self, coded: &mut Coded<'_>) -> u32 {
        let (block, update) = if let Some(place) = (coded.number(NAMED, 0) as usize).checked_sub(1) {
            let (block, last) = self.blocks.remove(place);
            (block, i64::from(last) + 1 + unfolded(coded.number(CHILD_GAP, 0)))
        } else {
            self.newest_block += unfolded(coded.number(NEW_BLOCK, 0));
            let block = u32::try_from(self.newest_block).expect("a block");
            assert!(self.blocks.iter().all(|named| named.0 != block), "not new");
            let place = coded.bits(self.block_bits);
            (block, i64::from(block) << self.block_bits | i64::from(place))
        };
        let update = u32::try_from(update).expect("an update");
        assert_eq!(update >> self.block_bits, block);
        self.blocks.insert(0, (block, update));
        update
    }

    fn offset(&mut self, coded: &mut Coded<'_>) -> Point {
        let length = |n: i32| len(n.unsigned_abs()).min(21);
        let largest = self.offset.map(length).into_iter().max().unwrap_or(0);
        let x = coded.signed(CHILD_OFFSET, largest);
        let y = coded.signed(CHILD_OFFSET, 22 + length(x));
        let z = coded.signed(CHILD_OFFSET, 44 + length(x).max(length(y)));
        self.offset = [x, y, z];
        self.offset
    }
}

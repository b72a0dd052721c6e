//! The points in buckets of a mesh, as records that need not be in memory.
//!
//! A part of the domain has far more reference points than vertices once it is simplified. All that errors need of such a point is in its
//! record, and records are read and written bucket by bucket, so they may lie in a [`Scratch`].
//!
//! ```text
//!   tetrahedron ──▶ extents of its bucket          blocks of RECORDS records
//!        0          (at 7, 2 records)              ┌─────────────┬───────┬────────┐
//!        1          (at 9, 3)                      │ of others   │ of 0  │  of 1  │  in memory, or in a slot of the scratch
//!        2          (at 900, 124), (at 1024, …)   └─────────────┴───────┴────────┘
//! ```
//!
//! A bucket that changes is written anew behind all others. A block without records that count is free; where most of what is in blocks
//! does not count, the rest is [moved together](StoredPoints::tidy).

use crate::change::work_mesh::keep;
use crate::error::points::{PointId, as_vec};
use crate::error::reference::{Reference, ReferencePoint};
use crate::lattice::quantize::Quantized;
use crate::scratch::Scratch;
use foldhash::HashMap;
use glam::DVec3;
use std::borrow::Borrow;
use std::collections::VecDeque;
use std::io;
use std::mem::take;
use std::sync::{Arc, Mutex, PoisonError};

/// Records in a block.
const RECORDS: u16 = 1 << 10;

/// No more records than these are parted to fill a block.
const FEW: usize = RECORDS as usize / 16;

/// About what a tetrahedron frees that is gone, in bytes.
const FREED: usize = 32;

/// Where records say whether the point is outside of the tetrahedron in whose bucket it is.
const FLAG: usize = 4;

/// How the records of a plan are laid out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RecordLayout {
    pub fields: usize,
    /// Whether fields jump: points are of a region then.
    pub jumps: bool,
    /// Whether the lattice has moved points.
    pub moved: bool,
}

impl RecordLayout {
    /// What every record has: name, flag, position on the lattice, shortest edge.
    const FIXED: usize = 4 + 1 + 12 + 8;

    /// Bytes of a record.
    pub fn len(self) -> usize {
        Self::FIXED + self.moved_at_end() + self.fields * 8
    }

    /// Bytes between what every record has and the values.
    fn moved_at_end(self) -> usize {
        usize::from(self.jumps) * 4 + usize::from(self.moved) * 24
    }
}

/// A point as it lies in a record.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StoredPoint<'a> {
    bytes: &'a [u8],
    layout: RecordLayout,
}

/// The bytes from a place on, as an array.
fn array<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    let mut array = [0; N];
    array.copy_from_slice(&bytes[at..at + N]);
    array
}

impl<'a> StoredPoint<'a> {
    pub fn new(bytes: &'a [u8], layout: RecordLayout) -> Self {
        Self { bytes, layout }
    }

    pub fn name(self) -> u32 {
        u32::from_le_bytes(array(self.bytes, 0))
    }

    pub fn id(self) -> PointId {
        u64::from(self.own_region()) << 32 | u64::from(self.name())
    }

    /// Whether it is outside of the tetrahedron in whose bucket it is.
    pub fn is_outside(self) -> bool {
        self.bytes[FLAG] != 0
    }

    pub fn position(self) -> [i32; 3] {
        [5, 9, 13].map(|at| i32::from_le_bytes(array(self.bytes, at)))
    }

    fn number(self, at: usize) -> f64 {
        f64::from_le_bytes(array(self.bytes, at))
    }

    pub fn shortest_edge(self) -> f64 {
        self.number(17)
    }

    pub fn own_region(self) -> u32 {
        if self.layout.jumps { u32::from_le_bytes(array(self.bytes, RecordLayout::FIXED)) } else { 0 }
    }

    pub fn own_place(self) -> DVec3 {
        if !self.layout.moved {
            return as_vec(self.position());
        }
        let first = RecordLayout::FIXED + usize::from(self.layout.jumps) * 4;
        DVec3::from_array([0, 8, 16].map(|at| self.number(first + at)))
    }

    pub fn own_values(self) -> impl Iterator<Item = f64> + use<'a> {
        let first = RecordLayout::FIXED + self.layout.moved_at_end();
        (0..self.layout.fields).map(move |f| self.number(first + 8 * f))
    }
}

impl ReferencePoint for StoredPoint<'_> {
    fn place(self, _: &Reference<'_>) -> DVec3 {
        self.own_place()
    }

    fn rounded(self, _: &Reference<'_>) -> [i32; 3] {
        self.position()
    }

    fn shortest(self, _: &Reference<'_>) -> f64 {
        self.shortest_edge()
    }

    fn region(self, _: &Reference<'_>) -> Option<u32> {
        self.layout.jumps.then(|| self.own_region())
    }

    fn values(self, _: &Quantized) -> impl Iterator<Item = f64> {
        self.own_values()
    }
}

/// Some records of a bucket that lie behind each other in one block: the first one's place there, and how many.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Extent {
    block: u32,
    at: u16,
    count: u16,
}

#[derive(Default)]
struct Block {
    /// Nothing if it is in the scratch.
    bytes: Vec<u8>,
    /// Where it is there: the file and the place among its blocks.
    slot: Option<(u32, u32)>,
    /// Records that count.
    live: u32,
}

/// Why a scratch has failed first. What is read from then on is zero, and of no use.
#[derive(Clone, Default)]
pub(crate) struct Failure(Arc<Mutex<Option<io::Error>>>);

impl Failure {
    fn set(&self, error: io::Error) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    }

    pub fn is_set(&self) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }

    pub fn take(&self) -> Result<(), io::Error> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take().map_or(Ok(()), Err)
    }
}

/// The records of all buckets.
pub(crate) struct StoredPoints<'s> {
    pub layout: RecordLayout,
    /// The names of the points that have numbers: the vertices of the mesh, and those of the boundary of the reference mesh.
    pub names: Vec<u32>,
    pub failure: Failure,
    scratch: &'s dyn Scratch,
    /// Names in the scratch; blocks are written to the first.
    files: Vec<String>,
    /// For each tetrahedron the first extent of its bucket.
    first: Vec<Extent>,
    /// All others, of the few buckets that have several, and how many records are in front of each: a large bucket has many, and is read
    /// piece by piece.
    further: HashMap<u32, Vec<(u64, Extent)>>,
    blocks: Vec<Block>,
    free_blocks: Vec<u32>,
    /// The block that is being filled.
    open: Option<u32>,
    /// Blocks that were full in memory, in that order, among them some that are free now but for this; and how many are full there now.
    in_memory: VecDeque<u32>,
    full: usize,
    memory: usize,
    /// How many tetrahedra there have been.
    most_tets: usize,
    /// How many slots the first file has, and which of them are free.
    slots: u32,
    free_slots: Vec<u32>,
}

impl<'s> StoredPoints<'s> {
    /// Those of a mesh of so many tetrahedra, which have none yet. What is not in memory has this name in the scratch.
    pub fn new(layout: RecordLayout, tets: usize, scratch: &'s dyn Scratch, name: String) -> Self {
        Self {
            layout,
            names: Vec::new(),
            failure: Failure::default(),
            scratch,
            files: vec![name],
            first: vec![Extent::default(); tets],
            further: HashMap::default(),
            blocks: Vec::new(),
            free_blocks: Vec::new(),
            open: None,
            in_memory: VecDeque::new(),
            full: 0,
            memory: scratch.kept_in_memory(),
            most_tets: tets,
            slots: 0,
            free_slots: Vec::new(),
        }
    }

    /// For one of so many that will be one: each keeps its share in memory.
    pub fn one_of(mut self, count: usize) -> Self {
        self.memory /= count;
        self
    }

    /// Adds those of the tetrahedra that follow, which others have of them.
    pub fn append(&mut self, mut other: Self) {
        let (blocks, files) = (self.blocks.len() as u32, self.files.len() as u32);
        let shifted = |extent: Extent| Extent { block: extent.block + blocks, ..extent };
        let tets = self.first.len() as u32;
        self.first.extend(take(&mut other.first).into_iter().map(shifted));
        let further = take(&mut other.further).into_iter();
        let all_shifted = |all: Vec<(u64, Extent)>| {
            all.into_iter().map(|(before, extent)| (before, shifted(extent))).collect()
        };
        self.further.extend(further.map(|(t, all)| (t + tets, all_shifted(all))));
        self.in_memory.extend(take(&mut other.in_memory).into_iter().map(|block| blocks + block));
        self.in_memory.extend(other.open.map(|block| blocks + block));
        self.full += other.full + usize::from(other.open.is_some());
        self.free_blocks.extend(other.free_blocks.iter().map(|block| blocks + block));
        let moved =
            |block: Block| Block { slot: block.slot.map(|(file, slot)| (files + file, slot)), ..block };
        self.blocks.extend(take(&mut other.blocks).into_iter().map(moved));
        if let Some(open) = other.open
            && self.blocks[(blocks + open) as usize].live == 0
        {
            self.free(blocks + open);
        }
        self.files.extend(take(&mut other.files));
        self.spill();
    }

    fn record_len(&self) -> usize {
        self.layout.len()
    }

    /// The extents of a bucket, in the order in which they were put.
    fn extents(&self, t: u32) -> impl Iterator<Item = Extent> {
        let (first, further) = self.bucket(t);
        let further = further.iter().map(|(_, extent)| *extent);
        std::iter::once(first).chain(further).filter(|extent| extent.count > 0)
    }

    /// The first extent of a bucket, and those behind it with what is in front of each.
    fn bucket(&self, t: u32) -> (Extent, &[(u64, Extent)]) {
        let further = if self.further.is_empty() { None } else { self.further.get(&t) };
        (self.first[t as usize], further.map_or(&[], |all| all))
    }

    /// How many points are in a bucket.
    pub fn count(&self, t: u32) -> u64 {
        let (first, further) = self.bucket(t);
        let (before, last) = further.last().copied().unwrap_or((0, first));
        before + u64::from(last.count)
    }

    /// Writes some of the records of a bucket behind `out`, in the order in which they were put.
    pub fn copy(&self, t: u32, range: std::ops::Range<u64>, out: &mut Vec<u8>) {
        let (first, further) = self.bucket(t);
        let is_before = |(before, extent): &(u64, Extent)| before + u64::from(extent.count) <= range.start;
        let behind = &further[further.partition_point(is_before)..];
        for &(start, extent) in std::iter::once(&(0, first)).chain(behind) {
            if start >= range.end {
                return;
            }
            let end = start + u64::from(extent.count);
            let [from, to] = [range.start, range.end].map(|at| at.clamp(start, end) - start);
            if from < to {
                let part = Extent { at: extent.at + from as u16, count: (to - from) as u16, ..extent };
                self.copy_extent(part, out);
            }
        }
    }

    fn copy_extent(&self, Extent { block, at, count }: Extent, out: &mut Vec<u8>) {
        let record = self.record_len();
        let block = &self.blocks[block as usize];
        let [from, len] = [at, count].map(|records| usize::from(records) * record);
        match block.slot {
            None => out.extend_from_slice(&block.bytes[from..from + len]),
            Some((file, slot)) => {
                let at = u64::from(slot) * self.block_len() + from as u64;
                let behind = out.len();
                out.resize(behind + len, 0);
                if let Err(error) = self.scratch.read_at(&self.files[file as usize], at, &mut out[behind..]) {
                    self.failure.set(error);
                }
            }
        }
    }

    fn block_len(&self) -> u64 {
        u64::from(RECORDS) * self.record_len() as u64
    }

    /// The point with a number as it is recorded.
    pub fn record(&self, point: u32, reference: &Reference<'_>, is_outside: bool, out: &mut Vec<u8>) {
        let RecordLayout { jumps, moved, .. } = self.layout;
        let quantized = reference.quantized;
        let vertex = quantized.vertex(point);
        out.extend(self.names[vertex as usize].to_le_bytes());
        out.push(is_outside.into());
        out.extend(quantized.positions[vertex as usize].iter().flat_map(|x| x.to_le_bytes()));
        out.extend(reference.shortest[vertex as usize].to_le_bytes());
        if jumps {
            out.extend(quantized.region(point).unwrap_or(0).to_le_bytes());
        }
        if moved {
            out.extend(quantized.places.at(point).to_array().iter().flat_map(|x| x.to_le_bytes()));
        }
        out.extend(quantized.values(point).flat_map(f64::to_le_bytes));
    }

    /// Stores records behind all others; they count from then on. Adds where they are.
    pub fn store(&mut self, mut records: &[u8], extents: &mut Vec<Extent>) {
        let record = self.record_len();
        while !records.is_empty() {
            let count = records.len() / record;
            let block = match self.open {
                // Few stay together, so that most buckets have one extent.
                Some(open) if self.room(open) >= count.min(FEW) => open,
                _ => self.open_block(),
            };
            let room = self.room(block);
            let at = RECORDS - room as u16;
            let (own, others) = records.split_at(count.min(room) * record);
            let count = (own.len() / record) as u16;
            extents.push(Extent { block, at, count });
            let Block { bytes, live, .. } = &mut self.blocks[block as usize];
            bytes.extend_from_slice(own);
            *live += u32::from(count);
            records = others;
        }
    }

    /// How many more records a block in memory takes.
    fn room(&self, block: u32) -> usize {
        usize::from(RECORDS) - self.blocks[block as usize].bytes.len() / self.record_len()
    }

    /// Begins a block.
    fn open_block(&mut self) -> u32 {
        if let Some(full) = self.open.take() {
            self.in_memory.push_back(full);
            self.full += 1;
            if self.blocks[full as usize].live == 0 {
                self.free(full);
            }
            self.spill();
        }
        let block = self.free_blocks.pop().unwrap_or_else(|| {
            self.blocks.push(Block::default());
            self.blocks.len() as u32 - 1
        });
        let len = self.block_len() as usize;
        self.blocks[block as usize].bytes.reserve_exact(len);
        self.open = Some(block);
        block
    }

    /// Writes the oldest blocks in memory to the scratch, until the others are few enough.
    fn spill(&mut self) {
        let most = self.memory / self.block_len() as usize;
        if self.in_memory.len() > 2 * self.full + FEW {
            let (blocks, free_blocks) = (&self.blocks, &mut self.free_blocks);
            self.in_memory.retain(|&block| {
                let is_free = blocks[block as usize].bytes.is_empty();
                free_blocks.extend(is_free.then_some(block));
                !is_free
            });
        }
        while self.full > most {
            let Some(block) = self.in_memory.pop_front() else { return };
            let bytes = take(&mut self.blocks[block as usize].bytes);
            if bytes.is_empty() {
                self.free_blocks.push(block);
                continue;
            }
            self.full -= 1;
            let slot = self.free_slots.pop().unwrap_or_else(|| {
                self.slots += 1;
                self.slots - 1
            });
            let at = u64::from(slot) * self.block_len();
            if let Err(error) = self.scratch.write_at(&self.files[0], at, &bytes) {
                self.failure.set(error);
            }
            self.blocks[block as usize].slot = Some((0, slot));
        }
    }

    /// Frees a block without records that count, which is not open.
    fn free(&mut self, block: u32) {
        match take(&mut self.blocks[block as usize]).slot {
            Some((file, slot)) => {
                if file == 0 {
                    self.free_slots.push(slot);
                }
                self.free_blocks.push(block);
            }
            // It still has its place among those in memory.
            None => self.full -= 1,
        }
    }

    /// Empties the bucket of a tetrahedron, which may be a new one.
    pub fn clear(&mut self, t: u32) {
        if self.first.len() <= t as usize {
            self.first.resize(t as usize + 1, Extent::default());
        }
        let first = take(&mut self.first[t as usize]);
        let further = if self.further.is_empty() { None } else { self.further.remove(&t) };
        let further = further.into_iter().flatten().map(|(_, extent)| extent);
        std::iter::once(first).chain(further).for_each(|extent| self.forget(extent));
    }

    /// These records do not count any more.
    fn forget(&mut self, Extent { block, count, .. }: Extent) {
        if count > 0 {
            let live = &mut self.blocks[block as usize].live;
            *live -= u32::from(count);
            if *live == 0 && self.open != Some(block) {
                self.free(block);
            }
        }
    }

    /// Makes what has been stored the bucket of a tetrahedron.
    pub fn put(&mut self, t: u32, extents: Vec<Extent>) {
        let mut extents = extents.into_iter();
        let first = extents.next().unwrap_or_default();
        self.first[t as usize] = first;
        let mut before = u64::from(first.count);
        let further: Vec<(u64, Extent)> = extents
            .map(|extent| {
                let own = (before, extent);
                before += u64::from(extent.count);
                own
            })
            .collect();
        if further.is_empty() {
            // Most have never had any.
            if !self.further.is_empty() {
                self.further.remove(&t);
            }
        } else {
            self.further.insert(t, further);
        }
    }

    /// Keeps the buckets of these tetrahedra, which ascend, under their places as numbers. All others are empty.
    pub fn renumber(&mut self, live: &[u32]) {
        keep(&mut self.first, live);
        let place = |t: u32| live.binary_search(&t).ok().map(|place| place as u32);
        let further = take(&mut self.further).into_iter();
        self.further = further.filter_map(|(t, all)| Some((place(t)?, all))).collect();
    }

    /// Makes use of the memory that tetrahedra have freed, and moves records together where less than half of those in blocks count.
    pub fn tidy(&mut self) {
        let usual = self.scratch.kept_in_memory();
        self.most_tets = self.most_tets.max(self.first.len());
        let freed = FREED * (self.most_tets - self.first.len());
        self.memory = if usual > 0 { usual + freed } else { 0 };
        let used = (self.blocks.len() - self.free_blocks.len()) as u64 * u64::from(RECORDS);
        let live: u64 = self.blocks.iter().map(|block| u64::from(block.live)).sum();
        if used < 2 * live + 8 * u64::from(RECORDS) {
            return;
        }
        let is_sparse =
            |(at, block): (u32, &Block)| Some(at) != self.open && 2 * block.live < u32::from(RECORDS);
        let is_sparse: Vec<bool> = (0..).zip(&self.blocks).map(is_sparse).collect();
        let mut records = Vec::new();
        for t in 0..self.first.len() as u32 {
            // Where a block that has become free is used again, no bucket that is still to come has records.
            let moves = |extent: Extent| is_sparse[extent.block as usize];
            if !self.extents(t).any(moves) {
                continue;
            }
            let old: Vec<Extent> = self.extents(t).collect();
            let mut new = Vec::new();
            for extent in old {
                if moves(extent) {
                    records.clear();
                    self.copy_extent(extent, &mut records);
                    self.store(&records, &mut new);
                    self.forget(extent);
                } else {
                    new.push(extent);
                }
            }
            self.put(t, new);
        }
    }

    /// The tetrahedra whose buckets there are.
    pub fn tets(&self) -> usize {
        self.first.len()
    }
}

/// Points that are stored anew, cell by cell.
pub(crate) struct SortedPoints<'s> {
    pub stored: StoredPoints<'s>,
    /// For each cell the records that wait, and where the others are.
    cells: Vec<(Vec<u8>, Vec<Extent>)>,
}

impl<'s> Borrow<StoredPoints<'s>> for SortedPoints<'s> {
    fn borrow(&self) -> &StoredPoints<'s> {
        &self.stored
    }
}

impl<'s> SortedPoints<'s> {
    /// Stores points of so many cells there.
    pub fn new(stored: StoredPoints<'s>, cells: usize) -> Self {
        Self { stored, cells: (0..cells).map(|_| Default::default()).collect() }
    }

    /// Puts a record behind those of a cell; whether it is outside is noted there.
    pub fn put(&mut self, record: &[u8], cell: usize, is_outside: bool) {
        let (records, extents) = &mut self.cells[cell];
        let at = records.len();
        records.extend_from_slice(record);
        records[at + FLAG] = is_outside.into();
        if records.len() as u64 >= self.stored.block_len() {
            self.stored.store(records, extents);
            records.clear();
        }
    }

    /// Where the records of each cell are.
    pub fn finish(mut self) -> (StoredPoints<'s>, Vec<Vec<Extent>>) {
        let of_cell = |(records, mut extents): (Vec<u8>, Vec<Extent>)| {
            self.stored.store(&records, &mut extents);
            extents
        };
        let extents = self.cells.into_iter().map(of_cell).collect();
        (self.stored, extents)
    }
}

impl Drop for StoredPoints<'_> {
    fn drop(&mut self) {
        for (at, name) in self.files.iter().enumerate() {
            if at > 0 || self.slots > 0 {
                // What is left there does no harm.
                _ = self.scratch.remove(name);
            }
        }
    }
}

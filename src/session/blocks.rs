//! A file elsewhere, of which a session keeps only the blocks that its request needs.
//!
//! [`Session::in_parts`] starts such a session. It opens nothing: [`Session::wanted`] says which bytes of the file it wants
//! next, most important first, and [`Session::take`] takes them, in whatever order they come. Blocks that the request does
//! not need any more go when the memory that they may take is short.

use super::Session;
use super::block_state::Blocks;
use crate::format::{BlockInfo, DecodeOptions, Decoder, ErrorBytes, FormatError, Index};
use crate::geom::Bounds;
use crate::mt::{ErrorCode, Mt, MtInfo, MultiTessellation, UpdateId, UpdatePages};
use crate::refine::{BlockData, Budget, Criterion, Front};
use crate::stream::{Loader, RangeSet, WantedRange};
use std::ops::Range;
use std::sync::Arc;

/// How a session that keeps blocks stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BlockProgress {
    /// Blocks of the file.
    pub blocks: u32,
    /// Blocks that are here.
    pub here: u32,
    /// Blocks that the request needs, as far as the index shows.
    pub needed: u32,
    /// Blocks of those that are not to be fetched because there is no memory for them.
    pub left_out: u32,
    /// Blocks of those that cannot come, since the source has a part of the file without them.
    pub absent: u32,
    /// Bytes in memory of the blocks that are here, and of what waits to be put together.
    pub bytes: u64,
    /// Blocks that meshes needed although the index says that they cannot: always 0, unless the file or the planner is wrong.
    pub missed: u32,
}

/// A block of the file, in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MappedBlock {
    /// A box, in units of the model, that holds all tetrahedra that its updates, and all that depend on them, remove or insert.
    pub bounds: Bounds,
    /// Whether it is here.
    pub state: BlockState,
}

/// What a session has of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum BlockState {
    /// The block is not here.
    Missing,
    /// The block is here.
    Here,
    /// The block is here, and the mesh has some of its updates.
    InUse,
}

/// How many bytes are asked for at first: as a rule more than stands in front of the blocks of a small file. Multiples of it are, until the
/// index says where the blocks begin.
const FIRST_BYTES: u64 = 1 << 16;

/// How many bytes in front of the blocks are asked for at a time at most: a multiple of [`FIRST_BYTES`]. A file may claim any length.
const MAX_HEAD_BYTES: u64 = 16 << 20;

/// How many bytes are asked for at a time where the file has to be read from end to end.
const LATER_BYTES: u64 = 1 << 20;

impl Session {
    /// A session for a file that comes in parts, whose blocks may take so many bytes in memory. Files of kinds that do not come
    /// in blocks (see [`MtKind::is_paged`](crate::mt::MtKind::is_paged)) are wanted as a whole.
    pub fn in_parts(options: DecodeOptions, memory: u64) -> Self {
        let decoder = Decoder::new(DecodeOptions { in_parts: true, ..options });
        Self { decoder, blocks: Blocks::new(memory), ..Self::default() }
    }

    /// Says that the source has these bytes of the file and no others: no other is wanted from now on. The mesh is as good as they allow;
    /// [`BlockProgress::absent`] counts the blocks that it lacks. Only for sessions [in parts](Session::in_parts).
    pub fn hold(&mut self, held: Vec<Range<u64>>) {
        self.blocks.held = Some(RangeSet::of(held));
    }

    /// The bytes of the file that give the mesh of the request again, or one that is as good as so many bytes of blocks allow: what stands in
    /// front of the blocks, and of the blocks that were needed those with the largest errors. Of a file without blocks, all that has come. Ascending,
    /// with something between any two.
    pub fn needed_bytes(&self, most: u64) -> Vec<Range<u64>> {
        let blocks = &self.blocks;
        let is_paged = self.decoder.mt().is_some_and(Mt::is_paged);
        let index = self.decoder.index().filter(|_| is_paged);
        let (Some(head), Some(index)) = (self.decoder.head_end(), index) else {
            return blocks.arrived.iter().cloned().collect();
        };
        let fields = self.decoder.wanted_fields();
        let was_needed = |&block: &u32| blocks.last_needed.get(block as usize).is_some_and(|&plan| plan > 0);
        let mut needed: Vec<u32> = (0..index.blocks.len() as u32).filter(was_needed).collect();
        // All with larger errors come first, so that what there is has one bound.
        needed.sort_by_key(|&block| std::cmp::Reverse(errors_of(index, fields, block).into_iter().max()));
        let mut room = most;
        let ranges = needed.into_iter().map(|block| self.decoder.block_ranges(block)).take_while(|ranges| {
            let bytes = ranges.iter().map(|range| range.end - range.start).sum();
            let fits = bytes <= room;
            room = room.saturating_sub(bytes);
            fits
        });
        let needed = RangeSet::of(ranges.flatten().chain(std::iter::once(0..head)).collect());
        needed.iter().cloned().collect()
    }

    /// Which bytes of the file are wanted next, most important first: the more a block lowers the excess of the error for each of
    /// its bytes. They may reach beyond the end of the file. None when all is here that the request needs. Only for sessions
    /// [in parts](Session::in_parts).
    pub fn wanted(&self) -> Vec<WantedRange> {
        let blocks = &self.blocks;
        if !blocks.in_parts {
            return Vec::new();
        }
        if let Some(end) = self.head_missing() {
            let held = blocks.within_held(blocks.fed..end);
            return held.map(|range| WantedRange { range, priority: f32::INFINITY }).into_iter().collect();
        }
        let Some(mt) = self.decoder.mt().filter(|mt| mt.is_paged()) else { return Vec::new() };
        let mut wanted = Vec::new();
        for &(priority, block) in &blocks.plan {
            let priority = priority as f32;
            if mt.has_page(block) || blocks.waiting.contains_key(&block) {
                continue;
            }
            let ranges = self.decoder.block_ranges(block).into_iter();
            let missing = ranges.filter(|range| !blocks.pieces.contains_key(&range.start));
            wanted.extend(missing.map(|range| WantedRange { range: blocks.rest_of(range), priority }));
        }
        wanted
    }

    /// How many bytes of the file a session [in parts](Session::in_parts) fetches for a mesh of some error, if it asks for nothing
    /// else: [`Decoder::bytes_by_error`] with what is always fetched at first.
    ///
    /// ```
    /// # use tetralod::session::Session;
    /// # fn print(session: &Session) {
    /// for point in session.bytes_by_error(0) {
    ///     println!("within {} % of the range: {} bytes", 100.0 * point.error, point.bytes);
    /// }
    /// # }
    /// ```
    pub fn bytes_by_error(&self, place: usize) -> Vec<ErrorBytes> {
        self.decoder.bytes_by_error(place, self.bytes_to_index())
    }

    /// How many bytes are asked for before the index says where the blocks begin.
    fn bytes_to_index(&self) -> u64 {
        self.decoder.bytes_to_index().next_multiple_of(FIRST_BYTES)
    }

    /// Up to where the file is still to be read in order; none when that is done.
    fn head_missing(&self) -> Option<u64> {
        let fed = self.blocks.fed;
        let is_paged = self.decoder.info().is_none_or(|info| info.kind.is_paged());
        if !is_paged {
            return (!self.decoder.progress().complete).then_some(fed + LATER_BYTES);
        }
        let end = self.decoder.stated_head_end().unwrap_or_else(|| self.bytes_to_index());
        (fed < end).then(|| end.min(fed + MAX_HEAD_BYTES))
    }

    /// Whether more is to come of the file, if all goes well: anything that the request needs, or the rest of a file that comes
    /// from front to back.
    pub fn is_waiting(&self) -> bool {
        if self.blocks.in_parts { !self.wanted().is_empty() } else { !self.progress().complete }
    }

    /// Bytes of the file that have come, those that came again counted again.
    pub fn fetched(&self) -> u64 {
        if self.blocks.in_parts { self.blocks.fetched } else { self.decoder.progress().bytes }
    }

    /// Bytes of the file that have come, each counted once: never more than it has.
    pub fn arrived(&self) -> u64 {
        if self.blocks.in_parts { self.blocks.arrived_bytes() } else { self.decoder.progress().bytes }
    }

    /// Takes in a range that was [wanted](Session::wanted), with its bytes: fewer where it reaches beyond the end of the file.
    /// Bytes that are not wanted any more are ignored.
    ///
    /// # Errors
    /// If the bytes are damaged, or end where more is needed. What was there before stays usable.
    pub fn take(&mut self, range: &Range<u64>, bytes: &[u8]) -> Result<(), FormatError> {
        if !self.blocks.in_parts {
            return Ok(());
        }
        self.blocks.arrive(range.start, bytes.len());
        self.take_from(range.start, bytes)?;
        let is_short = (bytes.len() as u64) < range.end - range.start;
        // At the end of a sound file nothing more is wanted.
        if is_short && self.wanted().iter().any(|wanted| wanted.range.start == range.start) {
            return Err(FormatError::Truncated { offset: range.start + bytes.len() as u64 });
        }
        Ok(())
    }

    /// Takes all complete ranges of `loader`, and gives it those that are wanted then; whether there was any.
    ///
    /// # Errors
    /// As [`Session::take`]; nothing is wanted then until the next call.
    pub fn supply(&mut self, loader: &mut Loader) -> Result<bool, FormatError> {
        let mut any = false;
        loop {
            while let Some((range, bytes)) = loader.take() {
                any = true;
                // What else has come may be as damaged.
                self.take(&range, &bytes).inspect_err(|_| loader.drop_all())?;
            }
            loader.want(&self.wanted());
            // What is held for other ranges may make new ones complete.
            if !loader.has_complete() {
                return Ok(any);
            }
        }
    }

    fn take_from(&mut self, start: u64, bytes: &[u8]) -> Result<(), FormatError> {
        if self.head_missing().is_some() {
            if start == self.blocks.fed {
                let end = start + bytes.len() as u64;
                self.feed(bytes)?;
                let head = self.decoder.head_end().filter(|_| self.decoder.takes_blocks());
                self.blocks.fed = head.map_or(end, |head| head.max(start));
                self.plan(true);
                self.take_surplus(start, bytes)?;
            }
            return Ok(());
        }
        let (start, bytes) = self.blocks.with_beginning(start, bytes);
        let Some(block) = self.decoder.block_at(start) else { return Ok(()) };
        let ranges = self.decoder.block_ranges(block);
        let fits = ranges.iter().any(|range| range.start == start && range.end - start == bytes.len() as u64);
        let is_here = self.decoder.mt().is_some_and(|mt| mt.has_page(block));
        if !fits || is_here {
            return Ok(());
        }
        let blocks = &mut self.blocks;
        blocks.pieces.insert(start, bytes.to_vec());
        blocks.beginning.take_if(|(at, _)| *at == start);
        if ranges.iter().all(|range| blocks.pieces.contains_key(&range.start)) {
            let parts: Vec<Vec<u8>> =
                ranges.iter().filter_map(|range| blocks.pieces.remove(&range.start)).collect();
            blocks.waiting.insert(block, parts.concat());
            self.insert_waiting()?;
        }
        Ok(())
    }

    /// Whole blocks may have come with what stands in front of them.
    fn take_surplus(&mut self, start: u64, bytes: &[u8]) -> Result<(), FormatError> {
        let (Some(head), true) = (self.decoder.head_end(), self.decoder.takes_blocks()) else {
            return Ok(());
        };
        let end = start + bytes.len() as u64;
        let mut block = 0;
        loop {
            let ranges = self.decoder.block_ranges(block);
            if !ranges.last().is_some_and(|last| last.end <= end && ranges[0].start >= head.max(start)) {
                if ranges.first().is_some_and(|first| first.start >= head.max(start)) {
                    self.blocks.keep_beginning(&ranges, start, bytes);
                }
                return Ok(());
            }
            let part =
                |range: &Range<u64>| &bytes[(range.start - start) as usize..(range.end - start) as usize];
            let whole: Vec<u8> = ranges.iter().flat_map(part).copied().collect();
            self.blocks.waiting.insert(block, whole);
            self.insert_waiting()?;
            // A block that no request needs does not wait for memory.
            if self.blocks.criterion.is_none() && self.blocks.waiting.remove(&block).is_some() {
                return Ok(());
            }
            block += 1;
        }
    }

    /// Puts complete blocks into the MT, as far as there is memory for them.
    fn insert_waiting(&mut self) -> Result<(), FormatError> {
        while let Some(&block) = self.blocks.waiting.keys().next() {
            if !self.has_memory_for(block) {
                self.free_memory();
            }
            if !self.has_memory_for(block) {
                // When the mesh has followed the request, more can go.
                break;
            }
            let bytes = self.blocks.waiting.remove(&block);
            self.decoder.take_block(block, &bytes.unwrap_or_default())?;
            if let (Some(front), Some(mt)) = (&mut self.front, self.decoder.mt()) {
                front.page_inserted(mt, block);
            }
        }
        Ok(())
    }

    /// Whether a block can come without anything going.
    fn has_memory_for(&self, block: u32) -> bool {
        let fits = |mt: &Mt| mt.page_bytes() + mt.bytes_of_page(block) <= self.blocks.memory;
        self.decoder.mt().is_some_and(fits)
    }

    /// How the blocks stand.
    pub fn block_progress(&self) -> BlockProgress {
        let (blocks, paged) = (&self.blocks, self.decoder.mt().filter(|mt| mt.is_paged()));
        let Some(mt) = paged.filter(|_| blocks.in_parts) else { return BlockProgress::default() };
        let count = self.decoder.index().map_or(0, |index| index.blocks.len() as u32);
        let without_memory = blocks.waiting.len() as u32;
        BlockProgress {
            blocks: count,
            here: (0..count).filter(|&block| mt.has_page(block)).count() as u32,
            needed: blocks.needed,
            left_out: blocks.left_out + without_memory,
            absent: blocks.absent,
            bytes: blocks.bytes_beside() + mt.page_bytes(),
            missed: blocks.missed,
        }
    }

    /// Where the blocks are, in the order of the file, and which of them are here; none where the file has no index.
    pub fn block_map(&self) -> Vec<MappedBlock> {
        let paged = self.decoder.mt().filter(|mt| mt.is_paged());
        let (Some(mt), Some(index)) = (paged, self.decoder.index()) else { return Vec::new() };
        let lattice = &mt.info().lattice;
        let state = |block: u32| match &self.front {
            _ if !mt.has_page(block) => BlockState::Missing,
            Some(front) if is_in_use(front, index, mt, block) => BlockState::InUse,
            _ => BlockState::Here,
        };
        // The index rounds them outwards.
        let [low, high] = mt.info().bounds.unwrap_or([[0; 3], [i32::MAX; 3]]);
        let bounds = |[min, max]: [[i32; 3]; 2]| Bounds {
            min: lattice.point([0, 1, 2].map(|k| min[k].clamp(low[k], high[k]))),
            max: lattice.point([0, 1, 2].map(|k| max[k].clamp(low[k], high[k]))),
        };
        let blocks = (0..).zip(&index.blocks);
        blocks.map(|(block, info)| MappedBlock { bounds: bounds(info.bounds), state: state(block) }).collect()
    }

    /// Notes the criterion and the budget of a new request, and works out which blocks it needs as far as the index tells.
    pub(super) fn new_request(&mut self, criterion: Arc<dyn Criterion>, budget: Budget) {
        let blocks = &mut self.blocks;
        if blocks.in_parts {
            let fields = self.decoder.wanted_fields();
            let described = self.decoder.index().zip(self.decoder.info());
            blocks.reached = described.and_then(|(index, info)| reached(&*criterion, index, info, fields));
            (blocks.criterion, blocks.budget) = (Some(criterion), budget);
            self.plan(false);
        }
    }

    /// The blocks that the request can need by what the index says that they reach, with their priorities: of a request with a budget, as
    /// many as that has room for. None if the criterion cannot tell, or if all of them do not fit the memory; then what there is of it is for
    /// what the mesh asks for.
    fn plan_by_index(&self) -> Option<Vec<(f64, u32)>> {
        let (index, mt, blocks) = (self.decoder.index()?, self.decoder.mt()?, &self.blocks);
        let reached = blocks.reached.as_ref()?;
        let least = match updates_within(&blocks.budget, mt) {
            Some(updates) => least_affordable(reached, updates, index, mt.info().updates),
            None => ErrorCode::ZERO,
        };
        let weighed = |&(error, block): &(ErrorCode, u32)| {
            (priority(f64::INFINITY, &[error], index.blocks[block as usize].len()), block)
        };
        let plan: Vec<(f64, u32)> =
            reached.iter().filter(|&&(error, _)| error >= least).map(weighed).collect();
        let bytes: u64 = plan.iter().map(|&(_, block)| mt.bytes_of_page(block)).sum();
        (bytes <= blocks.memory).then_some(plan)
    }

    /// Works out which blocks the request needs; by the mesh, too, if that was made for the request. Where the index does not tell, the plan
    /// stays as it is until then.
    fn plan(&mut self, mesh_has_moved: bool) {
        let by_index = self.plan_by_index();
        if by_index.is_none() && !mesh_has_moved {
            return;
        }
        let (blocks, Some(index), Some(mt)) = (&mut self.blocks, self.decoder.index(), self.decoder.mt())
        else {
            return;
        };
        let (Some(criterion), Some(front)) = (&blocks.criterion, &self.front) else { return };
        blocks.plans += 1;
        blocks.last_needed.resize(index.blocks.len(), 0);
        let fields = self.decoder.wanted_fields();
        let is_exhaustive = by_index.is_some() && blocks.budget.is_unlimited();
        let mut plan = by_index.unwrap_or_default();
        let decoder = &self.decoder;
        let can_come =
            |held: &Blocks, block| mt.has_page(block) || held.can_come(&decoder.block_ranges(block));
        if mesh_has_moved && plan.iter().all(|&(_, block)| mt.has_page(block) || !can_come(blocks, block)) {
            let mut is_planned = vec![false; index.blocks.len()];
            plan.iter().for_each(|&(_, block)| is_planned[block as usize] = true);
            let asked = plan_by_mesh(front, mt, &**criterion, &blocks.budget, index, fields);
            let more = asked.into_iter().filter(|&(_, block)| !is_planned[block as usize]);
            let known = plan.len();
            plan.extend(more);
            // The index has promised that there are none.
            blocks.missed += if is_exhaustive { (plan.len() - known) as u32 } else { 0 };
        }
        plan.iter().for_each(|&(_, block)| blocks.last_needed[block as usize] = blocks.plans);
        // The most important ones first; those as important as they are in the file.
        plan.sort_unstable_by(|(priority, block), (other, after)| {
            other.total_cmp(priority).then(block.cmp(after))
        });
        blocks.needed = plan.len() as u32;
        plan.retain(|&(_, block)| can_come(blocks, block));
        let possible = plan.len() as u32;
        blocks.absent = blocks.needed - possible;
        // Pages with applied updates do not go: what comes has to fit beside them.
        let mut taken: u64 = (0..index.blocks.len() as u32)
            .filter(|&block| mt.has_page(block) && is_in_use(front, index, mt, block))
            .map(|block| mt.bytes_of_page(block))
            .sum();
        let memory = blocks.memory;
        plan.retain(|&(_, block)| {
            taken += mt.bytes_of_page(block);
            taken <= memory
        });
        blocks.left_out = possible - plan.len() as u32;
        blocks.plan = plan;
        let mut planned = vec![false; index.blocks.len()];
        blocks.plan.iter().for_each(|&(_, block)| planned[block as usize] = true);
        let is_planned = |block: u32| planned[block as usize];
        blocks.waiting.retain(|&block, _| is_planned(block));
        blocks.pieces.retain(|&start, _| decoder.block_at(start).is_some_and(is_planned));
    }

    /// The mesh has moved: what it does not need any more may go, and what waited for that may come.
    pub(super) fn after_step(&mut self) -> Result<(), FormatError> {
        if self.blocks.in_parts {
            // The mesh shows now what else it needs.
            self.plan(true);
            self.free_memory();
            self.insert_waiting()?;
        }
        Ok(())
    }

    /// Drops blocks that the request does not need, until what is here and what is to come fit the memory.
    fn free_memory(&mut self) {
        for block in self.blocks_to_drop() {
            let may_go = match (&mut self.front, self.decoder.mt()) {
                (Some(front), Some(mt)) => front.prepare_eviction(mt, block),
                _ => false,
            };
            // Both have been checked, so neither refuses.
            if !may_go || self.decoder.drop_block(block).is_err() {
                return;
            }
        }
    }

    /// As many blocks as have to go, those first that have not been needed for longest. Those of which an update is applied stay.
    fn blocks_to_drop(&self) -> Vec<u32> {
        let mut leaving = Vec::new();
        let (Some(mt), Some(index)) = (self.decoder.mt(), self.decoder.index()) else { return leaving };
        let blocks = &self.blocks;
        let coming = blocks.plan.iter().filter(|(_, block)| !mt.has_page(*block));
        let coming: u64 = coming.map(|&(_, block)| mt.bytes_of_page(block)).sum();
        let mut excess = (mt.page_bytes() + coming).saturating_sub(blocks.memory);
        if excess == 0 {
            return leaving;
        }
        for block in self.unneeded(mt, index) {
            if excess == 0 {
                break;
            }
            if self.front.as_ref().is_some_and(|front| is_in_use(front, index, mt, block)) {
                continue;
            }
            excess = excess.saturating_sub(mt.bytes_of_page(block));
            leaving.push(block);
        }
        leaving
    }

    /// The blocks here that the request does not need, those first that have not been needed for longest.
    fn unneeded(&self, mt: &Mt, index: &Index) -> Vec<u32> {
        let blocks = &self.blocks;
        let mut is_needed = vec![false; index.blocks.len()];
        blocks.plan.iter().for_each(|&(_, block)| is_needed[block as usize] = true);
        // Blocks are asked for one by one; what they have shown must not be forgotten.
        if let (Some(front), Some(criterion)) = (&self.front, &blocks.criterion) {
            let fields = self.decoder.wanted_fields();
            let bounds = |page: u32| errors_of(index, fields, page);
            let telling = front.decisive_pages(mt, &**criterion, |u| u.0 >> index.block_bits, bounds);
            telling.into_iter().for_each(|block| is_needed[block as usize] = true);
        }
        let here = (0..index.blocks.len() as u32).filter(|&block| mt.has_page(block));
        // Of the same age, the last ones of the file first.
        let age = |block: u32| blocks.last_needed.get(block as usize).copied().unwrap_or(0);
        let unneeded = here.filter(|&block| !is_needed[block as usize]);
        let mut keys: Vec<u64> =
            unneeded.map(|block| u64::from(age(block)) << 32 | u64::from(!block)).collect();
        keys.sort_unstable();
        keys.into_iter().map(|key| !(key as u32)).collect()
    }
}

/// Whether an update of a block is applied.
fn is_in_use(front: &Front, index: &Index, mt: &Mt, block: u32) -> bool {
    index.updates(block, mt.info().updates).any(|u| front.contains(UpdateId(u)))
}

/// The largest errors of the updates of a block, in these fields.
fn errors_of(index: &Index, fields: &[usize], block: u32) -> Vec<ErrorCode> {
    let errors = &index.blocks[block as usize].errors;
    fields.iter().map(|&f| errors[f]).collect()
}

/// What a block promises for each of its bytes, given how often the error that it lowers exceeds what is wanted.
fn priority(excess: f64, errors: &[ErrorCode], bytes: u64) -> f64 {
    // Infinite where any error is too much: then the largest errors come first.
    let largest = errors.iter().copied().max().unwrap_or(ErrorCode::ZERO).error();
    let gain = if excess.is_finite() { excess } else { largest.max(f64::MIN_POSITIVE) };
    gain / bytes as f64
}

/// Of a file with this index, the blocks that a criterion can need by what they reach, with their largest errors; none if it cannot tell.
fn reached(
    criterion: &dyn Criterion,
    index: &Index,
    info: &MtInfo,
    fields: &[usize],
) -> Option<Vec<(ErrorCode, u32)>> {
    let mut needed = Vec::new();
    for block in 0..index.blocks.len() as u32 {
        let errors = errors_of(index, fields, block);
        let BlockInfo { bounds, ranges, regions, .. } = &index.blocks[block as usize];
        let ranges: Vec<[i32; 2]> = fields.iter().map(|&f| ranges[f]).collect();
        let first = UpdateId(index.updates(block, info.updates).start);
        if criterion.may_need(&BlockData {
            bounds: *bounds,
            ranges: &ranges,
            errors: &errors,
            first,
            regions,
        })? {
            needed.push((errors.into_iter().max().unwrap_or(ErrorCode::ZERO), block));
        }
    }
    Some(needed)
}

/// The least error above which blocks have no more than so many of the updates of an MT.
fn least_affordable(reached: &[(ErrorCode, u32)], most: u64, index: &Index, updates: u32) -> ErrorCode {
    // In the index, errors have eight bits.
    let mut updates_of = [0_u64; 256];
    for &(error, block) in reached {
        updates_of[usize::from(error.0 >> 8)] += index.updates(block, updates).len() as u64;
    }
    let mut sum = 0;
    let affordable = (0..256).rev().take_while(|&byte| {
        sum += updates_of[byte];
        sum <= most
    });
    affordable.last().map_or(ErrorCode::MAX, |byte| ErrorCode((byte as u16) << 8))
}

/// About twice as many updates as a budget has room for: of the blocks with the largest errors, not all are applied.
fn updates_within(budget: &Budget, mt: &Mt) -> Option<u64> {
    let (info, base) = (mt.info(), mt.base());
    let new = |all: u32, base: usize| f64::from(all) - base as f64;
    let growth = new(info.tetrahedra, base.tets.len()) / f64::from(info.updates.max(1));
    let of_tets = budget.tets.map(|tets| new(tets, base.tets.len()) / growth);
    let of_vertices = budget.vertices.map(|vertices| new(vertices, base.positions.len()));
    let of_bytes = budget.bytes.map(|bytes| bytes as f64 / (32.0 * growth + 16.0));
    let limits = [of_tets, of_vertices, of_bytes].into_iter().flatten();
    limits.reduce(f64::min).map(|updates| (2.0 * updates).max(0.0) as u64)
}

/// The blocks that hold what tetrahedra of the mesh ask for; of a criterion that is the same everywhere, without a budget, those with larger
/// errors.
fn plan_by_mesh(
    front: &Front,
    mt: &Mt,
    criterion: &dyn Criterion,
    budget: &Budget,
    index: &Index,
    fields: &[usize],
) -> Vec<(f64, u32)> {
    if let Some(tolerances) = criterion.uniform().filter(|_| budget.is_unlimited()) {
        let asks = |errors: &[ErrorCode]| {
            tolerances.iter().any(|tolerance| match tolerance.field {
                Some(field) => errors.get(field).is_some_and(|&error| error > tolerance.error),
                None => errors.iter().any(|&error| error > tolerance.error),
            })
        };
        let blocks = (0..index.blocks.len() as u32).map(|block| (block, errors_of(index, fields, block)));
        let needed = blocks.filter(|(_, errors)| asks(errors));
        return needed
            .map(|(block, errors)| {
                (priority(f64::INFINITY, &errors, index.blocks[block as usize].len()), block)
            })
            .collect();
    }
    let demanded = front.demanded_pages(mt, criterion, |u| u.0 >> index.block_bits);
    // Under a budget, what is here comes first if it exceeds its error by more.
    let least = if budget.is_unlimited() { 1.0 } else { front.largest_present_excess(mt, criterion) };
    let known = demanded
        .into_iter()
        .filter(|&(block, excess)| (block as usize) < index.blocks.len() && excess >= least);
    known
        .map(|(block, excess)| {
            (priority(excess, &errors_of(index, fields, block), index.blocks[block as usize].len()), block)
        })
        .collect()
}

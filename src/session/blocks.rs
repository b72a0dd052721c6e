//! A file elsewhere, of which a session keeps only the blocks that its request needs.
//!
//! [`Session::in_parts`] starts such a session. It opens nothing: [`Session::wanted`] says which bytes of the file it wants
//! next, most important first, and [`Session::take`] takes them, in whatever order they come. Blocks that the request does
//! not need any more go when the memory that they may take is short.

use super::Session;
use super::block_state::{Blocks, Reached};
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
    /// Pages of the index; 0 where it has none.
    pub index_pages: u32,
    /// Those of them that are here.
    pub index_pages_here: u32,
    /// Bytes in memory of the blocks and of the pages of the index that are here, and of what waits to be put together.
    pub bytes: u64,
    /// Blocks that meshes needed although the index says that they cannot: always 0, unless the file or the planner is wrong.
    pub missed: u32,
}

/// A block of the file, in space, or all blocks of a page of the index that is not here.
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

/// Pages of the index go where they take more than this part of the memory that is there for blocks, beside that: where blocks are not tiny, their
/// entries are less than a hundredth of them.
const INDEX_PART: u64 = 16;

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
    /// front of the blocks, the pages of the index that are here, and of the blocks that were needed those with the largest errors. Of a file without blocks, all that has come. Ascending,
    /// with something between any two.
    pub fn needed_bytes(&self, most: u64) -> Vec<Range<u64>> {
        let blocks = &self.blocks;
        let is_paged = self.decoder.mt().is_some_and(Mt::is_paged);
        let index = self.decoder.index().filter(|_| is_paged);
        let (Some(head), Some(index)) = (self.decoder.head_end(), index) else {
            return blocks.arrived.iter().cloned().collect();
        };
        let fields = self.decoder.wanted_fields();
        let mut needed: Vec<u32> = blocks.last_needed.keys().copied().collect();
        // All with larger errors come first, so that what there is has one bound.
        needed.sort_by_key(|&block| std::cmp::Reverse(errors_of(index, fields, block).into_iter().max()));
        let mut room = most;
        let ranges = needed.into_iter().map(|block| self.decoder.block_ranges(block)).take_while(|ranges| {
            let bytes = ranges.iter().map(|range| range.end - range.start).sum();
            let fits = bytes <= room;
            room = room.saturating_sub(bytes);
            fits
        });
        let pages = (0..).zip(index.pages()).filter(|(_, page)| page.is_here());
        let pages = pages.filter_map(|(page, _)| self.decoder.index_page_range(page));
        let needed = RangeSet::of(ranges.flatten().chain(pages).chain(std::iter::once(0..head)).collect());
        needed.iter().cloned().collect()
    }

    /// Which bytes of the file are wanted next, most important first: the more a block lowers the excess of the error for each of
    /// its bytes, a page of the index as much as a block that it may have. They may reach beyond the end of the file. None when all is here that the request needs. Only for sessions
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
        let (Some(mt), Some(index)) = (self.decoder.mt().filter(|mt| mt.is_paged()), self.decoder.index())
        else {
            return Vec::new();
        };
        let mut wanted = Vec::new();
        let pages = blocks.pages.iter().filter(|(_, page)| !index.pages()[*page as usize].is_here());
        let mut pages = pages.peekable();
        let mut page_before = |priority: f64| {
            let (priority, page) = *pages.next_if(|page| page.0 >= priority)?;
            let range = blocks.rest_of(self.decoder.index_page_range(page)?);
            Some(WantedRange { range, priority: priority as f32 })
        };
        for &(priority, block) in &blocks.plan {
            wanted.extend(std::iter::from_fn(|| page_before(priority)));
            let priority = priority as f32;
            if mt.has_page(block) || blocks.waiting.contains_key(&block) {
                continue;
            }
            let ranges = self.decoder.block_ranges(block).into_iter();
            let missing = ranges.filter(|range| !blocks.pieces.contains_key(&range.start));
            wanted.extend(missing.map(|range| WantedRange { range: blocks.rest_of(range), priority }));
        }
        wanted.extend(std::iter::from_fn(|| page_before(f64::NEG_INFINITY)));
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
        if let Some(page) = self.decoder.index_page_at(start) {
            let length = self.decoder.index_page_range(page).map(|range| range.end - range.start);
            if length != Some(bytes.len() as u64) {
                return Ok(());
            }
            let bytes = bytes.into_owned();
            self.blocks.beginning.take_if(|(at, _)| *at == start);
            self.take_index_page(page, &bytes)?;
            self.plan(false);
            return Ok(());
        }
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

    /// Takes a page of the index, unless it is here, and finds which of its blocks the request can need.
    fn take_index_page(&mut self, page: u32, bytes: &[u8]) -> Result<(), FormatError> {
        if self.decoder.index().is_none_or(|index| index.pages()[page as usize].is_here()) {
            return Ok(());
        }
        self.decoder.take_index_page(page, bytes)?;
        let (Some(index), Some(info)) = (self.decoder.index(), self.decoder.info()) else { return Ok(()) };
        self.blocks.index_bytes += index.page_bytes(page);
        self.blocks.pages_come.push(page);
        if let (Some(criterion), Some(mut reached)) = (&self.blocks.criterion, self.blocks.reached.take()) {
            let count = reached.pages.len();
            reached.pages.retain(|&(_, other)| other != page);
            let is_known = reached.pages.len() == count
                || reach_page(&**criterion, index, info, self.decoder.wanted_fields(), page, &mut reached)
                    .is_some();
            self.blocks.reached = is_known.then_some(reached);
        }
        Ok(())
    }

    /// Whole pages of the index and whole blocks may have come with what stands in front of them.
    fn take_surplus(&mut self, start: u64, bytes: &[u8]) -> Result<(), FormatError> {
        let (Some(head), true) = (self.decoder.head_end(), self.decoder.takes_blocks()) else {
            return Ok(());
        };
        let end = start + bytes.len() as u64;
        for page in 0.. {
            let Some(range) = self.decoder.index_page_range(page) else { break };
            if range.start < start {
                return Ok(());
            }
            if range.end > end {
                self.blocks.keep_beginning(&[range], start, bytes);
                return Ok(());
            }
            self.take_index_page(page, &bytes[(range.start - start) as usize..(range.end - start) as usize])?;
        }
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
        let Some(index) = self.decoder.index() else { return BlockProgress::default() };
        let without_memory = blocks.waiting.len() as u32;
        let pages = || index.pages().iter().filter(|_| index.is_paged());
        BlockProgress {
            blocks: index.count(),
            here: index.known().filter(|&(block, _)| mt.has_page(block)).count() as u32,
            index_pages: pages().count() as u32,
            index_pages_here: pages().filter(|page| page.is_here()).count() as u32,
            needed: blocks.needed,
            left_out: blocks.left_out + without_memory,
            absent: blocks.absent,
            bytes: blocks.bytes_beside() + blocks.index_bytes + mt.page_bytes(),
            missed: blocks.missed,
        }
    }

    /// Where the blocks are, in the order of the file, and which of them are here; none where the file has no index. Those of a page of
    /// the index that is not here are one entry.
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
        let mut map = Vec::new();
        for (number, page) in (0..).zip(index.pages()) {
            let block = |(block, info): (u32, &BlockInfo)| MappedBlock {
                bounds: bounds(info.bounds),
                state: state(block),
            };
            let all = || MappedBlock { bounds: bounds(page.all.bounds), state: BlockState::Missing };
            map.extend(index.known_of(number).map(block));
            map.extend((!page.is_here()).then(all));
        }
        map
    }

    /// Notes the criterion and the budget of a new request, and works out which blocks it needs as far as the index tells.
    pub(super) fn new_request(&mut self, criterion: Arc<dyn Criterion>, budget: Budget) {
        let blocks = &mut self.blocks;
        if blocks.in_parts {
            let fields = self.decoder.wanted_fields();
            let described = self.decoder.index().zip(self.decoder.info());
            blocks.reached = described.and_then(|(index, info)| reached(&*criterion, index, info, fields));
            (blocks.criterion, blocks.budget) = (Some(criterion), budget);
            blocks.pages_come.clear();
            self.plan(false);
        }
    }

    /// What the request can need by what the index says that it reaches, with priorities: of a request with a budget, as
    /// much as that has room for. None if the criterion cannot tell, or if all of it does not fit the memory; then what there is of it is for
    /// what the mesh asks for.
    fn plan_by_index(&self) -> Option<Plan> {
        let (index, mt, blocks) = (self.decoder.index()?, self.decoder.mt()?, &self.blocks);
        let reached = blocks.reached.as_ref()?;
        let [least_of_pages, least] = match updates_within(&blocks.budget, mt) {
            Some(updates) => least_affordable(reached, updates, index, mt.info().updates),
            None => [ErrorCode::ZERO; 2],
        };
        let mut plan = Plan::default();
        for &(error, block) in reached.blocks.iter().filter(|&&(error, _)| error >= least) {
            plan.add(index, (block, f64::INFINITY), &[error]);
        }
        for &(error, page) in reached.pages.iter().filter(|&&(error, _)| error >= least_of_pages) {
            plan.add(index, (index.blocks_of(page).start, f64::INFINITY), &[error]);
        }
        let bytes: u64 = plan.blocks.iter().map(|&(_, block)| mt.bytes_of_page(block)).sum();
        (bytes <= blocks.memory).then_some(plan)
    }

    /// Works out which blocks the request needs; by the mesh, too, if that was made for the request. Where the index does not tell, the plan
    /// stays as it is until then.
    fn plan(&mut self, mesh_has_moved: bool) {
        let by_index = self.plan_by_index();
        if by_index.is_none() && self.decoder.index().is_some_and(Index::is_paged) {
            // What does not fit the memory is asked for by the mesh from now on, so that no page stays for it.
            self.blocks.reached = None;
        }
        if by_index.is_none() && !mesh_has_moved {
            return;
        }
        let (blocks, Some(index), Some(mt)) = (&mut self.blocks, self.decoder.index(), self.decoder.mt())
        else {
            return;
        };
        let (Some(criterion), Some(front)) = (&blocks.criterion, &self.front) else { return };
        blocks.plans += 1;
        let fields = self.decoder.wanted_fields();
        let is_exhaustive = by_index.is_some() && blocks.budget.is_unlimited();
        let Plan { blocks: mut plan, mut pages } = by_index.unwrap_or_default();
        let decoder = &self.decoder;
        let can_come =
            |held: &Blocks, block| mt.has_page(block) || held.can_come(&decoder.block_ranges(block));
        let page_can_come = |held: &Blocks, page| {
            decoder.index_page_range(page).is_some_and(|range| held.can_come(std::slice::from_ref(&range)))
        };
        let is_here = plan.iter().all(|&(_, block)| mt.has_page(block) || !can_come(blocks, block));
        if mesh_has_moved && is_here && !pages.iter().any(|&(_, page)| page_can_come(blocks, page)) {
            let asked = plan_by_mesh(front, mt, &**criterion, &blocks.budget, index, fields);
            let known = plan.len() + pages.len();
            extend(&mut plan, asked.blocks);
            extend(&mut pages, asked.pages);
            // The index has promised that there are none.
            blocks.missed += if is_exhaustive { (plan.len() + pages.len() - known) as u32 } else { 0 };
        }
        blocks.last_needed.extend(plan.iter().map(|&(_, block)| (block, blocks.plans)));
        // The most important ones first; those as important as they are in the file.
        sort(&mut plan);
        sort(&mut pages);
        // Of a page that cannot come, any block may be needed.
        let beyond = pages.iter().filter(|&&(_, page)| !page_can_come(blocks, page));
        let beyond: u32 = beyond.map(|&(_, page)| index.blocks_of(page).len() as u32).sum();
        pages.retain(|&(_, page)| page_can_come(blocks, page));
        blocks.needed = plan.len() as u32 + beyond;
        plan.retain(|&(_, block)| can_come(blocks, block));
        let possible = plan.len() as u32;
        blocks.absent = blocks.needed - possible;
        // Pages with applied updates do not go: what comes has to fit beside them.
        let in_use =
            index.known().filter(|&(block, _)| mt.has_page(block) && is_in_use(front, index, mt, block));
        let mut taken: u64 = in_use.map(|(block, _)| mt.bytes_of_page(block)).sum();
        let (memory, mut most_left_out) = (blocks.memory, f64::NEG_INFINITY);
        plan.retain(|&(priority, block)| {
            taken += mt.bytes_of_page(block);
            most_left_out = if taken <= memory { most_left_out } else { most_left_out.max(priority) };
            taken <= memory
        });
        // There is no room for less important blocks, either.
        pages.retain(|&(priority, _)| priority > most_left_out);
        blocks.left_out = possible - plan.len() as u32;
        (blocks.plan, blocks.pages) = (plan, pages);
        let mut planned: Vec<u32> = blocks.plan.iter().map(|&(_, block)| block).collect();
        planned.sort_unstable();
        let is_planned = |block: u32| planned.binary_search(&block).is_ok();
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

    /// Drops blocks that the request does not need, until what is here and what is to come fit the memory, and pages of the index that
    /// nothing needs.
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
        self.drop_index_pages();
    }

    /// Drops as many pages of the index as have to go, those first whose blocks have not been needed for longest.
    fn drop_index_pages(&mut self) {
        let (Some(mt), Some(index), Some(front)) = (self.decoder.mt(), self.decoder.index(), &self.front)
        else {
            return;
        };
        let mut excess = self.blocks.index_bytes.saturating_sub(self.blocks.memory / INDEX_PART);
        if excess == 0 {
            return;
        }
        let blocks = &self.blocks;
        let mut leaving = leaving_pages(blocks, &blocks.plan, front, index, mt, |block| mt.has_page(block));
        let age = |page: u32| blocks.last_needed.range(index.blocks_of(page)).map(|(_, &plan)| plan).max();
        // Of the same age, the last ones of the file first.
        leaving.sort_by_key(|&page| (age(page), std::cmp::Reverse(page)));
        let gone = leaving.into_iter().map(|page| (page, index.page_bytes(page), index.blocks_of(page)));
        for (page, bytes, of_page) in gone.collect::<Vec<_>>() {
            if excess == 0 || !self.decoder.drop_index_page(page) {
                return;
            }
            excess = excess.saturating_sub(bytes);
            self.blocks.index_bytes -= bytes;
            self.blocks.last_needed.retain(|block, _| !of_page.contains(block));
        }
    }

    /// By how much what is here and what is to come exceed the memory.
    fn excess_bytes(&self, mt: &Mt) -> u64 {
        let coming = self.blocks.plan.iter().filter(|(_, block)| !mt.has_page(*block));
        let coming: u64 = coming.map(|&(_, block)| mt.bytes_of_page(block)).sum();
        (mt.page_bytes() + coming).saturating_sub(self.blocks.memory)
    }

    /// As many blocks as have to go, those first that have not been needed for longest. Those of which an update is applied stay.
    fn blocks_to_drop(&self) -> Vec<u32> {
        let mut leaving = Vec::new();
        let (Some(mt), Some(index)) = (self.decoder.mt(), self.decoder.index()) else { return leaving };
        let mut excess = self.excess_bytes(mt);
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
        let mut is_needed = vec![false; index.count() as usize];
        blocks.plan.iter().for_each(|&(_, block)| is_needed[block as usize] = true);
        // Blocks are asked for one by one; what they have shown must not be forgotten.
        if let (Some(front), Some(criterion)) = (&self.front, &blocks.criterion) {
            let fields = self.decoder.wanted_fields();
            let bounds = |page: u32| errors_of(index, fields, page);
            let telling = front.decisive_pages(mt, &**criterion, |u| u.0 >> index.block_bits, bounds);
            telling.into_iter().for_each(|block| is_needed[block as usize] = true);
        }
        let here = index.known().map(|(block, _)| block).filter(|&block| mt.has_page(block));
        // Of the same age, the last ones of the file first.
        let age = |block: u32| blocks.last_needed.get(&block).copied().unwrap_or(0);
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
    let errors = index.errors(block);
    fields.iter().map(|&f| errors[f]).collect()
}

/// What a request needs, each with its priority: blocks, and pages of the index that are not here.
#[derive(Default)]
struct Plan {
    blocks: Vec<(f64, u32)>,
    pages: Vec<(f64, u32)>,
}

impl Plan {
    /// Adds a block with the excess of its error, or its page if that is not here, once for all of its blocks.
    fn add(&mut self, index: &Index, (block, excess): (u32, f64), errors: &[ErrorCode]) {
        let page = index.page_of(block);
        match index.block(block) {
            Some(known) => self.blocks.push((priority(excess, errors, known.len()), block)),
            // Blocks of a page are about as long as each other.
            None => {
                let blocks = index.blocks_of(page).len().max(1) as u64;
                let bytes = (index.pages()[page as usize].block_bytes / blocks).max(1);
                let priority = priority(excess, errors, bytes);
                match self.pages.last_mut() {
                    Some((most, last)) if *last == page => *most = most.max(priority),
                    _ => self.pages.push((priority, page)),
                }
            }
        }
    }
}

/// Adds what is not there.
fn extend(plan: &mut Vec<(f64, u32)>, more: Vec<(f64, u32)>) {
    let mut known: Vec<u32> = plan.iter().map(|&(_, number)| number).collect();
    known.sort_unstable();
    plan.extend(more.into_iter().filter(|(_, number)| known.binary_search(number).is_err()));
}

fn sort(plan: &mut [(f64, u32)]) {
    plan.sort_unstable_by(|(priority, number), (other, after)| {
        other.total_cmp(priority).then(number.cmp(after))
    });
}

/// The pages of the index that nothing needs: the request does not reach them and has not asked for them, no block of them is to be here or `stays`, and no tetrahedron of the
/// mesh is removed by an update of them.
fn leaving_pages(
    blocks: &Blocks,
    plan: &[(f64, u32)],
    front: &Front,
    index: &Index,
    mt: &Mt,
    stays: impl Fn(u32) -> bool,
) -> Vec<u32> {
    if !index.is_paged() {
        return Vec::new();
    }
    let mut is_kept = vec![false; index.pages().len()];
    plan.iter().for_each(|&(_, block)| is_kept[index.page_of(block) as usize] = true);
    let reached = blocks.reached.iter().flat_map(|reached| &reached.pages_here);
    reached.chain(&blocks.pages_come).for_each(|&page| is_kept[page as usize] = true);
    let awaited = (0..front.mesh().tet_slots() as u32).filter_map(|t| mt.awaited(front.mesh(), t));
    awaited.for_each(|u| {
        // A damaged file may name any update.
        if let Some(is_kept) = is_kept.get_mut(index.page_of(u.0 >> index.block_bits) as usize) {
            *is_kept = true;
        }
    });
    index.known().filter(|&(block, _)| stays(block)).for_each(|(block, _)| {
        is_kept[index.page_of(block) as usize] = true;
    });
    (0..)
        .zip(index.pages())
        .filter(|(_, page)| page.is_here())
        .map(|(page, _)| page)
        .filter(|&page| !is_kept[page as usize])
        .collect()
}

/// What a block promises for each of its bytes, given how often the error that it lowers exceeds what is wanted.
fn priority(excess: f64, errors: &[ErrorCode], bytes: u64) -> f64 {
    // Infinite where any error is too much: then the largest errors come first.
    let largest = errors.iter().copied().max().unwrap_or(ErrorCode::ZERO).error();
    let gain = if excess.is_finite() { excess } else { largest.max(f64::MIN_POSITIVE) };
    gain / bytes as f64
}

/// Of a file with this index, what a criterion can need by what the index says that it reaches; none if it cannot tell.
fn reached(criterion: &dyn Criterion, index: &Index, info: &MtInfo, fields: &[usize]) -> Option<Reached> {
    let mut reached = Reached::default();
    for (number, page) in (0..).zip(index.pages()) {
        let first = index.blocks_of(number).start;
        // Where the index is not paged, the blocks are asked one by one.
        if index.is_paged() && !may_need(criterion, index, info, fields, (first, &page.all))? {
            continue;
        }
        if page.is_here() {
            reach_page(criterion, index, info, fields, number, &mut reached)?;
        } else {
            reached.pages.push((largest(&page.all, fields), number));
        }
    }
    Some(reached)
}

/// Adds the blocks of a page that is here.
fn reach_page(
    criterion: &dyn Criterion,
    index: &Index,
    info: &MtInfo,
    fields: &[usize],
    page: u32,
    reached: &mut Reached,
) -> Option<()> {
    for (block, of_block) in index.known_of(page) {
        if may_need(criterion, index, info, fields, (block, of_block))? {
            reached.blocks.push((largest(of_block, fields), block));
        }
    }
    reached.pages_here.push(page);
    Some(())
}

/// The largest error of a block in these fields.
fn largest(block: &BlockInfo, fields: &[usize]) -> ErrorCode {
    fields.iter().map(|&f| block.errors[f]).max().unwrap_or(ErrorCode::ZERO)
}

/// Whether a criterion can need a block, or any of the blocks from `block` on of which `BlockInfo` is true.
fn may_need(
    criterion: &dyn Criterion,
    index: &Index,
    info: &MtInfo,
    fields: &[usize],
    (block, BlockInfo { bounds, ranges, errors, regions, .. }): (u32, &BlockInfo),
) -> Option<bool> {
    let errors: Vec<ErrorCode> = fields.iter().map(|&f| errors[f]).collect();
    let ranges: Vec<[i32; 2]> = fields.iter().map(|&f| ranges[f]).collect();
    let first = UpdateId(index.updates(block, info.updates).start);
    criterion.may_need(&BlockData { bounds: *bounds, ranges: &ranges, errors: &errors, first, regions })
}

/// The least error above which there are no more than so many of the updates of an MT: for pages of the index that are not here, if each has
/// a single block with its largest error, and for blocks, if all of them have it. These are the same once the pages that matter are here.
fn least_affordable(reached: &Reached, most: u64, index: &Index, updates: u32) -> [ErrorCode; 2] {
    // In the index, errors have eight bits.
    let mut updates_of = [[0_u64; 256]; 2];
    let mut add = |error: ErrorCode, counts: [u64; 2]| {
        for (sums, count) in updates_of.iter_mut().zip(counts) {
            sums[usize::from(error.0 >> 8)] += count;
        }
    };
    for &(error, block) in &reached.blocks {
        add(error, [index.updates(block, updates).len() as u64; 2]);
    }
    for &(error, page) in &reached.pages {
        let all = index.blocks_of(page);
        add(error, [1, all.len() as u64].map(|blocks| blocks << index.block_bits));
    }
    updates_of.map(|updates_of| {
        let mut sum = 0;
        let affordable = (0..256).rev().take_while(|&byte| {
            sum += updates_of[byte];
            sum <= most
        });
        affordable.last().map_or(ErrorCode::MAX, |byte| ErrorCode((byte as u16) << 8))
    })
}

/// About twice as many updates as a budget has room for: of the blocks with the largest errors, not all are applied.
fn updates_within(budget: &Budget, mt: &Mt) -> Option<u64> {
    let (info, base) = (mt.info(), mt.base());
    let new = |all: u64, base: usize| all as f64 - base as f64;
    let growth = new(info.tetrahedra, base.tets.len()) / f64::from(info.updates.max(1));
    let of_tets = budget.tets.map(|tets| new(tets.into(), base.tets.len()) / growth);
    let of_vertices = budget.vertices.map(|vertices| new(vertices.into(), base.positions.len()));
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
) -> Plan {
    let mut plan = Plan::default();
    if let Some(tolerances) = criterion.uniform().filter(|_| budget.is_unlimited()) {
        let asks = |errors: &[ErrorCode]| {
            tolerances.iter().any(|tolerance| match tolerance.field {
                Some(field) => errors.get(field).is_some_and(|&error| error > tolerance.error),
                None => errors.iter().any(|&error| error > tolerance.error),
            })
        };
        let missing = (0..).zip(index.pages()).filter(|(_, page)| !page.is_here());
        let missing = missing.map(|(page, _)| index.blocks_of(page).start);
        for block in index.known().map(|(block, _)| block).chain(missing) {
            let errors = errors_of(index, fields, block);
            if asks(&errors) {
                plan.add(index, (block, f64::INFINITY), &errors);
            }
        }
        return plan;
    }
    let demanded = front.demanded_pages(mt, criterion, |u| u.0 >> index.block_bits);
    // Under a budget, what is here comes first if it exceeds its error by more.
    let least = if budget.is_unlimited() { 1.0 } else { front.largest_present_excess(mt, criterion) };
    for (block, excess) in
        demanded.into_iter().filter(|&(block, excess)| block < index.count() && excess >= least)
    {
        plan.add(index, (block, excess), &errors_of(index, fields, block));
    }
    plan
}

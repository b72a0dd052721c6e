//! `INDX`: what is in each block and where, so that a client can fetch just the blocks that it needs.

use super::changes::{bound_of, upper_byte};
use crate::format::header::HEAD_BYTES;
use crate::format::read::Reader;
use crate::format::{FormatError, write};
use crate::mt::{ErrorCode, MtInfo, coarser_by as shift, updates_of_page};
use std::ops::Range;

/// What the index of a file says of one block of updates.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BlockInfo {
    /// Bytes of its sections, heads included: what all fields share, then field by field.
    pub lengths: Vec<u32>,
    /// A box on the lattice that holds all tetrahedra that its updates, and all that depend on them, remove or insert: least and
    /// largest corner.
    pub bounds: [[i32; 3]; 2],
    /// For each field the largest error of its updates, or a little more: what depends on them has no larger one.
    pub errors: Vec<ErrorCode>,
    /// For each field the least and the largest level in these tetrahedra, or a little less and more.
    pub ranges: Vec<[i32; 2]>,
    /// The regions of these tetrahedra, ascending; empty if the MT has none.
    pub regions: Vec<u16>,
}

/// Far more than what stands between index and blocks can take, and far less than places in a file can be.
const MAX_SHARED: u64 = 1 << 48;

impl BlockInfo {
    /// What is true of all these blocks; without lengths.
    fn of_all(blocks: &[Self]) -> Self {
        let mut all = Self::default();
        for block in blocks {
            if all.errors.is_empty() {
                all = Self { lengths: Vec::new(), ..block.clone() };
                continue;
            }
            for axis in 0..3 {
                all.bounds[0][axis] = all.bounds[0][axis].min(block.bounds[0][axis]);
                all.bounds[1][axis] = all.bounds[1][axis].max(block.bounds[1][axis]);
            }
            for (error, other) in all.errors.iter_mut().zip(&block.errors) {
                *error = (*error).max(*other);
            }
            for (range, other) in all.ranges.iter_mut().zip(&block.ranges) {
                *range = [range[0].min(other[0]), range[1].max(other[1])];
            }
            all.regions.extend(&block.regions);
            all.regions.sort_unstable();
            all.regions.dedup();
        }
        all
    }

    /// Bytes of all its sections.
    pub fn len(&self) -> u64 {
        self.lengths.iter().map(|&length| u64::from(length)).sum()
    }

    /// Whether it has no sections, which no block of a file is like.
    pub fn is_empty(&self) -> bool {
        self.lengths.is_empty()
    }

    /// Bytes in memory, with its place in the file.
    fn bytes(&self) -> u64 {
        let Self { lengths, errors, ranges, regions, .. } = self;
        let lists = [
            size_of_val(&lengths[..]),
            size_of_val(&errors[..]),
            size_of_val(&ranges[..]),
            size_of_val(&regions[..]),
        ];
        (size_of::<(Self, u64)>() + lists.into_iter().sum::<usize>()) as u64
    }

    /// Widens its errors to those that the file can hold.
    pub fn round(&mut self) {
        for error in &mut self.errors {
            *error = bound_of(upper_byte(*error));
        }
    }

    /// Appends what the index says of it: of a page, what that is without lengths.
    fn write(&self, out: &mut Vec<u8>, info: &MtInfo) {
        let space = shift(info.lattice.bits);
        self.lengths.iter().for_each(|&length| write::varint(out, u64::from(length)));
        let [low, high] = self.bounds;
        for (low, high) in low.into_iter().zip(high) {
            write::varint(out, (low >> space) as u64);
            write::varint(out, ((high - low) >> space) as u64);
        }
        for ((field, error), [low, high]) in info.fields.iter().zip(&self.errors).zip(&self.ranges) {
            out.push(upper_byte(*error));
            let level = shift(field.bits);
            write::varint(out, (low >> level) as u64);
            write::varint(out, ((high - low) >> level) as u64);
        }
        write::varint(out, RESERVED);
    }
}

/// Blocks whose entries come together: those of one section, or all where the index is not paged.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct IndexPage {
    /// What is said of all its blocks together; lengths are not.
    pub all: BlockInfo,
    /// Bytes of its section, head included; 0 where the index is not paged.
    pub section_bytes: u32,
    /// Bytes of its blocks.
    pub block_bytes: u64,
    /// Where its section begins, from the end of the head of the file on.
    at: u64,
    /// Where its first block begins, from the first block of the file on.
    first: u64,
    /// Empty as long as it is not here.
    blocks: Vec<BlockInfo>,
    /// For each of them the bytes of those in front of it; at last the bytes of all.
    starts: Vec<u64>,
}

impl IndexPage {
    fn of(blocks: Vec<BlockInfo>) -> Self {
        let mut page = Self { all: BlockInfo::of_all(&blocks), ..Self::default() };
        page.put(blocks);
        page.block_bytes = page.starts.last().copied().unwrap_or(0);
        page
    }

    fn put(&mut self, blocks: Vec<BlockInfo>) {
        let mut end = 0_u64;
        let ends = blocks.iter().map(|block| {
            end = end.saturating_add(block.len());
            end
        });
        self.starts = std::iter::once(0).chain(ends).collect();
        self.blocks = blocks;
    }

    /// Whether the entries of its blocks are here.
    pub fn is_here(&self) -> bool {
        !self.blocks.is_empty()
    }
}

/// The index of a file: a list of all blocks, or of pages that have them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Index {
    /// log2 of the updates of a block; the last one may have fewer.
    pub block_bits: u32,
    /// Bytes of the sections between the index and its first page, or the first block where it has no pages.
    pub shared: u64,
    /// Blocks of the file.
    count: u32,
    /// log2 of the blocks of a page; none where the index is not paged.
    page_bits: Option<u32>,
    /// In the order of their blocks; one for all where the index is not paged.
    pages: Vec<IndexPage>,
}

/// log2 of more blocks than files have.
const ALL_BLOCKS: u32 = 31;

/// A page has at most 2 to this power of blocks.
const MAX_INDEX_PAGE_BITS: u32 = 20;

/// Bytes of an index that writers do not put in pages, at most.
const MAX_WHOLE: usize = 32 << 10;

/// Bytes of what is said of all pages, as far as pages can be so large.
const MAX_PAGE_LIST: usize = 24 << 10;

/// log2 of the blocks of a page, at least, where the writer chooses.
const LEAST_PAGE_BITS: u32 = 8;

impl Index {
    /// An index that is not paged.
    pub fn new(block_bits: u32, blocks: Vec<BlockInfo>) -> Self {
        let count = blocks.len() as u32;
        let pages = if blocks.is_empty() { Vec::new() } else { vec![IndexPage::of(blocks)] };
        Self { block_bits, shared: 0, count, page_bits: None, pages }
    }

    /// The same in pages of `2^page_bits` blocks, all of which are here.
    pub fn in_pages(self, page_bits: u32) -> Self {
        let blocks: Vec<BlockInfo> = self.pages.into_iter().flat_map(|page| page.blocks).collect();
        let pages = blocks.chunks(1 << page_bits).map(|blocks| IndexPage::of(blocks.to_vec()));
        let mut paged = Self { page_bits: Some(page_bits), pages: pages.collect(), ..self };
        paged.place_pages();
        paged
    }

    /// An index that is not paged as the writer has it: in pages of so many blocks, not in pages if that is more than they can have, or as its length
    /// wants it.
    pub fn as_written(self, info: &MtInfo, page_bits: Option<u32>) -> Self {
        match page_bits {
            Some(bits) if bits <= MAX_INDEX_PAGE_BITS => return self.in_pages(bits),
            None if self.length(info) > MAX_WHOLE => {}
            _ => return self,
        }
        let mut paged = self.in_pages(LEAST_PAGE_BITS);
        for bits in LEAST_PAGE_BITS + 1..=MAX_INDEX_PAGE_BITS {
            if paged.length(info) <= MAX_PAGE_LIST {
                break;
            }
            paged = paged.in_pages(bits);
        }
        paged
    }

    /// About how many bytes the section has with its lists of regions.
    fn length(&self, info: &MtInfo) -> usize {
        let mut bytes = Vec::new();
        self.write(&mut bytes, info);
        self.region_lists().for_each(|list| write_regions(&mut bytes, list));
        bytes.len()
    }

    /// How many blocks the file has.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Whether it is in pages, which come by themselves.
    pub fn is_paged(&self) -> bool {
        self.page_bits.is_some()
    }

    /// Its pages; one where it is not paged.
    pub fn pages(&self) -> &[IndexPage] {
        &self.pages
    }

    /// log2 of the blocks of a page.
    pub fn log2_page(&self) -> u32 {
        self.page_bits.unwrap_or(ALL_BLOCKS)
    }

    /// The page that has a block.
    pub fn page_of(&self, block: u32) -> u32 {
        block >> self.log2_page()
    }

    /// The blocks of a page.
    pub fn blocks_of(&self, page: u32) -> Range<u32> {
        updates_of_page(self.log2_page(), page, self.count)
    }

    /// What it says of a block; none if there is no such block, or its page is not here.
    pub fn block(&self, block: u32) -> Option<&BlockInfo> {
        let page = self.pages.get(self.page_of(block) as usize)?;
        page.blocks.get((block & ((1 << self.log2_page()) - 1)) as usize)
    }

    /// The blocks of the pages that are here, with their numbers, ascending.
    pub fn known(&self) -> impl Iterator<Item = (u32, &BlockInfo)> {
        (0..self.pages.len() as u32).flat_map(|page| self.known_of(page))
    }

    /// Those of one page; none as long as it is not here.
    pub fn known_of(&self, page: u32) -> impl Iterator<Item = (u32, &BlockInfo)> {
        (self.blocks_of(page).start..).zip(&self.pages[page as usize].blocks)
    }

    /// The largest errors of a block, or where its page is not here of all blocks of that.
    pub fn errors(&self, block: u32) -> &[ErrorCode] {
        let of_page =
            || self.pages.get(self.page_of(block) as usize).map_or(&[][..], |page| &page.all.errors);
        self.block(block).map_or_else(of_page, |block| &block.errors)
    }

    /// Whether all its pages are here.
    pub fn is_whole(&self) -> bool {
        self.pages.iter().all(IndexPage::is_here)
    }

    /// Bytes in memory of pages that are here, if it is paged.
    pub fn page_bytes(&self, page: u32) -> u64 {
        let page = &self.pages[page as usize];
        if self.page_bits.is_none() { 0 } else { page.blocks.iter().map(BlockInfo::bytes).sum() }
    }

    /// Where the section of a page is, from the end of the head of the file on; none if it has no such page, or is not paged.
    pub fn page_range(&self, page: u32) -> Option<Range<u64>> {
        let page = self.pages.get(page as usize).filter(|_| self.is_paged())?;
        Some(page.at..page.at.saturating_add(u64::from(page.section_bytes)))
    }

    /// The page whose section begins there.
    pub fn page_at(&self, start: u64) -> Option<u32> {
        let page = self.pages.partition_point(|page| page.at < start);
        self.page_range(page as u32).filter(|range| range.start == start).map(|_| page as u32)
    }

    /// Where the first block begins, from the end of the head of the file on.
    pub fn first_block(&self) -> u64 {
        self.pages.last().map_or(0, |page| page.at.saturating_add(u64::from(page.section_bytes)))
    }

    /// Where a block begins, from the end of the head of the file on; none where that is not known.
    pub fn block_start(&self, block: u32) -> Option<u64> {
        self.block(block)?;
        let page = &self.pages[self.page_of(block) as usize];
        let within = page.starts.get((block & ((1 << self.log2_page()) - 1)) as usize)?;
        self.first_block().checked_add(page.first)?.checked_add(*within)
    }

    /// The block that is known to have a byte, from the end of the head of the file on.
    pub fn block_with(&self, at: u64) -> Option<u32> {
        let behind = at.checked_sub(self.first_block())?;
        let number = self.pages.partition_point(|page| page.first <= behind).checked_sub(1)?;
        let page = &self.pages[number];
        let place = page.starts.partition_point(|start| *start <= behind - page.first).checked_sub(1)?;
        (place < page.blocks.len()).then(|| self.blocks_of(number as u32).start + place as u32)
    }

    /// Where the last block ends, from the end of the head of the file on.
    pub fn end(&self) -> u64 {
        let blocks = self.pages.last().map_or(0, |page| page.first.saturating_add(page.block_bytes));
        self.first_block().saturating_add(blocks)
    }

    /// Works out where pages and their blocks are.
    fn place_pages(&mut self) {
        let (mut at, mut first) = (0_u64, 0_u64);
        for page in &mut self.pages {
            (page.at, page.first) = (at, first);
            at = at.saturating_add(u64::from(page.section_bytes));
            first = first.saturating_add(page.block_bytes);
        }
    }

    /// The updates of a block of an MT of so many.
    pub fn updates(&self, block: u32, updates: u32) -> Range<u32> {
        updates_of_page(self.block_bits, block, updates)
    }

    /// The lists of regions that `regn` has: those of the pages, or of the blocks where it is not paged.
    pub fn region_lists(&self) -> impl Iterator<Item = &Vec<u16>> {
        let is_paged = self.is_paged();
        self.pages.iter().flat_map(move |page| {
            let blocks = if is_paged { std::slice::from_ref(&page.all) } else { &page.blocks[..] };
            blocks.iter().map(|block| &block.regions)
        })
    }

    /// As [`Index::region_lists`], to be changed.
    pub fn region_lists_mut(&mut self) -> impl Iterator<Item = &mut Vec<u16>> {
        let is_paged = self.is_paged();
        self.pages.iter_mut().flat_map(move |page| {
            let blocks = if is_paged { std::slice::from_mut(&mut page.all) } else { &mut page.blocks[..] };
            blocks.iter_mut().map(|block| &mut block.regions)
        })
    }

    /// Appends the section; what it says of blocks must have been [rounded](BlockInfo::round).
    pub fn write(&self, out: &mut Vec<u8>, info: &MtInfo) {
        out.push(self.block_bits as u8);
        write::varint(out, self.shared);
        write::varint(out, u64::from(self.count));
        if let Some(page_bits) = self.page_bits {
            out.push(page_bits as u8);
        }
        for page in &self.pages {
            if self.is_paged() {
                write::varint(out, u64::from(page.section_bytes));
                write::varint(out, page.block_bytes);
                page.all.write(out, info);
            } else {
                page.blocks.iter().for_each(|block| block.write(out, info));
            }
        }
    }

    /// Appends the content of the section of a page.
    pub fn write_page(&self, out: &mut Vec<u8>, page: u32, info: &MtInfo, has_regions: bool) {
        write::varint(out, u64::from(page));
        let blocks = &self.pages[page as usize].blocks;
        blocks.iter().for_each(|block| block.write(out, info));
        blocks.iter().filter(|_| has_regions).for_each(|block| write_regions(out, &block.regions));
    }

    /// Enters the sections of all pages, which have so many bytes with their heads.
    pub fn set_sections(&mut self, bytes: impl Iterator<Item = u32>) {
        self.pages.iter_mut().zip(bytes).for_each(|(page, bytes)| page.section_bytes = bytes);
        self.place_pages();
    }

    /// Bytes that [`Index::read_start`] reads at most.
    pub const START_BYTES: u64 = 11;

    /// Reads what comes in front of the number of blocks: `block_bits` and `shared`.
    pub fn read_start(reader: &mut Reader<'_>) -> Result<(u32, u64), FormatError> {
        let block_bits = read_block_bits(reader)?;
        let shared = reader.varint64()?;
        if shared > MAX_SHARED {
            return Err(reader.corrupt("what the blocks share is longer than sections can be"));
        }
        Ok((block_bits, shared))
    }

    /// Reads the index of an MT.
    pub fn read(mut reader: Reader<'_>, info: &MtInfo, is_paged: bool) -> Result<Self, FormatError> {
        let (block_bits, shared) = Self::read_start(&mut reader)?;
        let count = reader.varint()?;
        if u64::from(count) != u64::from(info.updates).div_ceil(1 << block_bits) {
            return Err(reader.corrupt("the index does not have as many blocks as there are updates for"));
        }
        if !is_paged {
            let mut blocks = Vec::new();
            for _ in 0..count {
                blocks.push(read_block(&mut reader, info)?);
            }
            reader.end()?;
            return Ok(Self { shared, ..Self::new(block_bits, blocks) });
        }
        let page_bits = u32::from(reader.u8()?);
        if page_bits > MAX_INDEX_PAGE_BITS {
            return Err(reader.corrupt("a page of the index must have 2^0 to 2^20 blocks"));
        }
        let mut index = Self { block_bits, shared, count, page_bits: Some(page_bits), pages: Vec::new() };
        for _ in 0..u64::from(count).div_ceil(1 << page_bits) {
            let section_bytes = read_length(&mut reader)?;
            let block_bytes = reader.varint64()?;
            let all = read_reach(&mut reader, info, Vec::new())?;
            index.pages.push(IndexPage { all, section_bytes, block_bytes, ..IndexPage::default() });
        }
        reader.end()?;
        index.place_pages();
        Ok(index)
    }

    /// Reads the section of a page, of an MT with so many regions, 0 if none are stated; nothing has changed after an error.
    pub fn read_page(
        &mut self,
        mut reader: Reader<'_>,
        page: u32,
        info: &MtInfo,
        regions: u32,
    ) -> Result<(), FormatError> {
        let count = self.blocks_of(page).len();
        let Some(known) = self.pages.get_mut(page as usize).filter(|page| !page.is_here()) else {
            return Err(reader.corrupt("a page of the index is repeated"));
        };
        if reader.len() + HEAD_BYTES != known.section_bytes as usize || reader.varint()? != page {
            return Err(reader.corrupt("a page of the index is missing, repeated, or of another length"));
        }
        let mut blocks = Vec::new();
        for _ in 0..count {
            blocks.push(read_block(&mut reader, info)?);
        }
        for block in blocks.iter_mut().filter(|_| regions > 0) {
            block.regions = read_regions(&mut reader, regions)?;
        }
        let all = BlockInfo::of_all(&blocks);
        let bytes = blocks.iter().fold(0, |sum: u64, block| sum.saturating_add(block.len()));
        if all != known.all || bytes != known.block_bytes {
            return Err(reader.corrupt("a page of the index is not what the index says of it"));
        }
        reader.end()?;
        known.put(blocks);
        Ok(())
    }

    /// Forgets the entries of a page.
    pub fn drop_page(&mut self, page: u32) {
        if let Some(page) = self.pages.get_mut(page as usize).filter(|_| self.page_bits.is_some()) {
            (page.blocks, page.starts) = (Vec::new(), Vec::new());
        }
    }
}

/// Behind what is said of a block.
const RESERVED: u64 = 0;

/// What block sizes may be.
pub const MIN_BLOCK_BITS: u32 = 4;
pub const MAX_BLOCK_BITS: u32 = 16;

/// log2 of the updates of a block.
pub fn read_block_bits(reader: &mut Reader<'_>) -> Result<u32, FormatError> {
    let bits = u32::from(reader.u8()?);
    if !(MIN_BLOCK_BITS..=MAX_BLOCK_BITS).contains(&bits) {
        return Err(reader.corrupt("a block must hold 2^4 to 2^16 updates"));
    }
    Ok(bits)
}

/// The bytes of a section, head included.
fn read_length(reader: &mut Reader<'_>) -> Result<u32, FormatError> {
    let length = reader.varint()?;
    // What had no length would be asked for, and never come.
    if (length as usize) < HEAD_BYTES {
        return Err(reader.corrupt("a part of a block or of the index is shorter than the head of a section"));
    }
    Ok(length)
}

fn read_block(reader: &mut Reader<'_>, info: &MtInfo) -> Result<BlockInfo, FormatError> {
    let mut lengths = Vec::new();
    for _ in 0..=info.fields.len() {
        lengths.push(read_length(reader)?);
    }
    read_reach(reader, info, lengths)
}

/// What comes behind the lengths of a block, or of a page.
fn read_reach(reader: &mut Reader<'_>, info: &MtInfo, lengths: Vec<u32>) -> Result<BlockInfo, FormatError> {
    let mut block = BlockInfo { lengths, ..BlockInfo::default() };
    let span = |reader: &mut Reader<'_>, bits: u32| -> Result<[i32; 2], FormatError> {
        let (low, size) = (reader.varint()?, reader.varint()?);
        let high = u64::from(low) + u64::from(size);
        if high > 1 << bits.min(8) {
            return Err(reader.corrupt("a block lies outside its lattice"));
        }
        Ok([low, high as u32].map(|x| (x << shift(bits)) as i32))
    };
    for axis in 0..3 {
        let [low, high] = span(reader, info.lattice.bits)?;
        (block.bounds[0][axis], block.bounds[1][axis]) = (low, high);
    }
    for field in &info.fields {
        block.errors.push(bound_of(reader.u8()?));
        block.ranges.push(span(reader, field.bits)?);
    }
    if reader.varint64()? != RESERVED {
        return Err(reader.corrupt("what is said of a block does not end with 0"));
    }
    Ok(block)
}

/// Appends a list of regions, which ascend.
pub fn write_regions(out: &mut Vec<u8>, regions: &[u16]) {
    write::varint(out, regions.len() as u64);
    let mut next = 0;
    for &region in regions {
        write::varint(out, u64::from(region) - next);
        next = u64::from(region) + 1;
    }
}

/// Reads a list of regions, of which there are `count`.
pub fn read_regions(reader: &mut Reader<'_>, count: u32) -> Result<Vec<u16>, FormatError> {
    let (mut list, mut next) = (Vec::new(), 0);
    for _ in 0..reader.varint()? {
        let region = read_region_number(reader, next, count)?;
        list.push(region);
        next = u32::from(region) + 1;
    }
    Ok(list)
}

/// The number of a region: what is read, from `next` on.
pub fn read_region_number(reader: &mut Reader<'_>, next: u32, count: u32) -> Result<u16, FormatError> {
    let region = next.checked_add(reader.varint()?).filter(|&region| region < count);
    let region = region.and_then(|region| u16::try_from(region).ok());
    region.ok_or_else(|| reader.corrupt("there are not so many regions"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Lattice;
    use crate::mt::{FieldInfo, MtKind};

    fn info() -> MtInfo {
        MtInfo {
            kind: MtKind::HalfEdge,
            lattice: Lattice { origin: [0.0; 3], step: [1.0; 3], bits: 10 },
            fields: vec![FieldInfo { bits: 12, ..FieldInfo::default() }],
            vertices: 0,
            tetrahedra: 0,
            updates: 40,
            displacement_per_error: 1.0,
            quantization: 0.0,
            bounds: None,
        }
    }

    /// The index of 40 updates in blocks of 16.
    fn index() -> Index {
        let block = BlockInfo {
            lengths: vec![100, 20],
            bounds: [[0, 4, 8], [1024, 8, 12]],
            errors: vec![ErrorCode(3 << 8)],
            ranges: vec![[16, 4096]],
            regions: Vec::new(),
        };
        Index { shared: 1 << 40, ..Index::new(4, vec![block; 3]) }
    }

    fn read(index: &Index) -> Result<Index, FormatError> {
        let mut bytes = Vec::new();
        index.write(&mut bytes, &info());
        Index::read(Reader::new(&bytes, 0), &info(), index.is_paged())
    }

    #[test]
    fn an_index_comes_back() {
        assert_eq!(read(&index()), Ok(index()));
    }

    #[test]
    fn what_no_writer_can_mean_is_refused() {
        type Fault = (&'static str, fn(&mut Index));
        let faults: [Fault; 7] = [
            ("blocks of 2^3 updates", |index| index.block_bits = 3),
            ("blocks of 2^17 updates", |index| index.block_bits = 17),
            ("too much between index and blocks", |index| index.shared = MAX_SHARED + 1),
            ("too few blocks", |index| index.count = 2),
            ("too many blocks", |index| index.count = 4),
            ("a box beyond the lattice", |index| index.pages[0].blocks[1].bounds[1][2] = 1028),
            ("levels beyond the lattice", |index| index.pages[0].blocks[2].ranges[0][1] = 4112),
        ];
        for (what, fault) in faults {
            let mut index = index();
            fault(&mut index);
            assert!(matches!(read(&index), Err(FormatError::Corrupt { .. })), "{what}");
        }
        let mut bytes = Vec::new();
        index().write(&mut bytes, &info());
        *bytes.last_mut().expect("some bytes") = 1;
        let read = Index::read(Reader::new(&bytes, 0), &info(), false);
        assert!(matches!(read, Err(FormatError::Corrupt { .. })), "another reserved number");
    }

    /// The same in pages of two blocks, which differ.
    fn paged() -> Index {
        let mut index = index();
        let last = &mut index.pages[0].blocks[2];
        (last.bounds[0], last.errors[0], last.regions) = ([512, 4, 8], ErrorCode(7 << 8), vec![0, 2]);
        let mut index = index.in_pages(1);
        let bytes = [0, 1].map(|number| (HEAD_BYTES + page(&index, number).len()) as u32);
        index.set_sections(bytes.into_iter());
        index
    }

    fn page(index: &Index, page: u32) -> Vec<u8> {
        let mut bytes = Vec::new();
        index.write_page(&mut bytes, page, &info(), true);
        bytes
    }

    #[test]
    fn pages_come_and_go() {
        let index = paged();
        let mut read = read(&index).expect("an index");
        assert_eq!((read.count(), read.pages().len(), read.block(0), read.is_whole()), (3, 2, None, false));
        // `regn` has those.
        read.region_lists_mut().zip(index.region_lists()).for_each(|(list, known)| list.clone_from(known));
        let empty = read.clone();
        let take = |read: &mut Index, number: u32| {
            read.read_page(Reader::new(&page(&index, number), 0), number, &info(), 3)
        };
        assert_eq!(take(&mut read, 1), Ok(()));
        assert_eq!((read.block(1), read.block(2)), (None, index.block(2)));
        let third = index.first_block() + 240;
        assert_eq!((read.block_start(2), read.block_with(third)), (Some(third), Some(2)));
        assert_eq!(read.errors(0), index.pages()[0].all.errors);
        assert!(take(&mut read, 1).is_err(), "it is there");
        assert_eq!(take(&mut read, 0), Ok(()));
        assert_eq!(read, index);
        let second = u64::from(index.pages()[0].section_bytes);
        assert_eq!(read.page_range(1), Some(second..index.first_block()));
        assert_eq!((read.page_at(second), read.page_at(second - 1)), (Some(1), None));
        assert!(read.page_bytes(0) > 200);
        (0..2).for_each(|page| read.drop_page(page));
        assert_eq!(read, empty);
    }

    #[test]
    fn pages_are_what_the_index_says_of_them() {
        type Fault = (&'static str, fn(&mut Index));
        let faults: [Fault; 6] = [
            ("another box", |index| {
                index.pages[0].blocks.iter_mut().for_each(|block| block.bounds[1][0] = 512)
            }),
            ("a larger error", |index| index.pages[0].blocks[0].errors[0] = ErrorCode(4 << 8)),
            ("other levels", |index| {
                index.pages[0].blocks.iter_mut().for_each(|block| block.ranges[0][0] = 0)
            }),
            ("other lengths", |index| index.pages[0].blocks[1].lengths[0] = 101),
            ("another region", |index| index.pages[0].blocks[1].regions.push(1)),
            ("a block too few", |index| drop(index.pages[0].blocks.pop())),
        ];
        for (what, fault) in faults {
            let (mut stated, mut faulty) = (read(&paged()).expect("an index"), paged());
            fault(&mut faulty);
            let bytes = page(&faulty, 0);
            let found = stated.read_page(Reader::new(&bytes, 0), 0, &info(), 3);
            assert!(found.is_err() && !stated.pages()[0].is_here(), "{what}");
        }
        let bytes = page(&paged(), 0);
        for length in 0..bytes.len() {
            let mut stated = read(&paged()).expect("an index");
            assert!(
                stated.read_page(Reader::new(&bytes[..length], 0), 0, &info(), 3).is_err(),
                "{length} bytes"
            );
        }
        let mut pages = paged();
        pages.page_bits = Some(MAX_INDEX_PAGE_BITS + 1);
        assert!(read(&pages).is_err(), "pages of too many blocks");
    }
}

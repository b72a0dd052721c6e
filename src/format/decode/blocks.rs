//! Blocks and exact values that come by themselves: where they are in the file, and how their bytes are taken.

use super::{Decoder, ExactStatus, Stage};
use crate::format::header::{END_BYTES, HEAD_BYTES, Kind};
use crate::format::read::Reader;
use crate::format::section::{FoundSection, find_section};
use crate::format::{FormatError, Index};
use crate::mt::{PageError, UpdatePages};
use std::ops::Range;

impl Decoder {
    /// The bytes of the file that hold a block of a half-edge MT with the wanted fields, in ranges that do not touch; empty if there is
    /// no such block, or the page of the index that has it is not here.
    pub fn block_ranges(&self, block: u32) -> Vec<Range<u64>> {
        let mut ranges: Vec<Range<u64>> = Vec::new();
        let Some(index) = &self.head.index else { return ranges };
        let (Some(info), Some(before)) = (index.block(block), index.block_start(block)) else {
            return ranges;
        };
        let Some(mut at) = self.head_end().and_then(|end| end.checked_add(before)) else { return ranges };
        for (part, &length) in info.lengths.iter().enumerate() {
            let Some(end) = at.checked_add(u64::from(length)) else { return Vec::new() };
            if part == 0 || self.head.place(part - 1).is_some() {
                match ranges.last_mut() {
                    Some(last) if last.end == at => last.end = end,
                    _ => ranges.push(at..end),
                }
            }
            at = end;
        }
        ranges
    }

    /// Where the blocks begin in the file, or the pages of the index in front of these, or a byte behind where less is known; none before the
    /// index is there.
    pub fn head_end(&self) -> Option<u64> {
        let index = self.head.index.as_ref()?;
        self.head.index_at.end.checked_add(index.shared)
    }

    /// As [`Decoder::head_end`], but as soon as the index begins, as that states it: nothing has verified it then.
    pub(crate) fn stated_head_end(&self) -> Option<u64> {
        match &self.stage {
            Stage::Payload { head, start, left, .. } if head.kind == Kind::INDX => {
                // What is wrong with it shows when all of it is there.
                let stated = Index::read_start(&mut Reader::new(&self.buffer, *start));
                (self.bytes + u64::from(*left)).checked_add(stated.map_or(0, |(_, shared)| shared))
            }
            _ => self.head_end(),
        }
    }

    /// How many bytes of the file show where its blocks begin; where the index is not there, if it is the next section.
    pub(crate) fn bytes_to_index(&self) -> u64 {
        let next = match &self.stage {
            _ if self.head.index.is_some() => self.head.index_at.start,
            Stage::Payload { left, .. } => self.bytes + u64::from(*left),
            _ => self.bytes - self.buffer.len() as u64,
        };
        next + HEAD_BYTES as u64 + Index::START_BYTES
    }

    /// The bytes of the file behind the blocks of a half-edge MT, where exact values are; none if there are none, or that is not known yet.
    pub fn exact_range(&self) -> Option<Range<u64>> {
        let start = self.head_end()?.checked_add(self.head.index.as_ref()?.end())?;
        let end = self.total?.checked_sub(END_BYTES as u64)?;
        (start < end).then_some(start..end)
    }

    /// Whether the file keeps exact values, and whether they are here. Files of half-edge MTs whose header does not state their length keep
    /// none until these have arrived.
    pub fn exact_status(&self) -> ExactStatus {
        // In files that come from front to back the end shows whether there were more.
        let all_here = self.has_all_exact || matches!(self.stage, Stage::End);
        let has_some = self.head.start.exact || self.exact_range().is_some();
        match has_some {
            true if !all_here => ExactStatus::Missing,
            _ if !self.exact.is_empty() => ExactStatus::Here,
            _ => ExactStatus::None,
        }
    }

    /// Takes in the bytes of [`Decoder::exact_range`] where blocks come by themselves; once is enough.
    ///
    /// # Errors
    /// When the bytes are not all of them, or damaged, or all that comes in front of the blocks is not there yet; nothing has changed
    /// then.
    pub fn take_exact(&mut self, bytes: &[u8]) -> Result<(), FormatError> {
        let Some(range) = self.exact_range().filter(|_| self.takes_blocks()) else {
            return Err(self.corrupt("there are no exact values, or not yet"));
        };
        let end = range.start.saturating_add(bytes.len() as u64);
        if end < range.end {
            return Err(FormatError::Truncated { offset: end });
        }
        let before = std::mem::take(&mut self.exact);
        let taken = self.read_exact_sections(bytes, range.start);
        if taken.is_err() {
            self.exact = before;
        }
        self.has_all_exact |= taken.is_ok();
        taken
    }

    fn read_exact_sections(&mut self, bytes: &[u8], start: u64) -> Result<(), FormatError> {
        let mut rest = bytes;
        while !rest.is_empty() {
            let offset = start + (bytes.len() - rest.len()) as u64;
            let corrupt = |what| FormatError::Corrupt { offset, what };
            let short = || corrupt("the bytes behind the blocks do not end with a section");
            let FoundSection { kind, content, behind } = find_section(rest, offset, short)?;
            match kind {
                Kind::EXACT => self.open_exact(content)?,
                kind if kind.is_skippable() && !kind.is_known() => {}
                _ => return Err(corrupt("a section is out of place")),
            }
            rest = behind;
        }
        Ok(())
    }

    /// The block of which a range of [`Decoder::block_ranges`] begins at this byte of the file.
    pub fn block_at(&self, start: u64) -> Option<u32> {
        let behind = start.checked_sub(self.head_end()?)?;
        let block = self.head.index.as_ref()?.block_with(behind)?;
        self.block_ranges(block).iter().any(|range| range.start == start).then_some(block)
    }

    /// The bytes of the file that hold a page of the index; none if there is no such page, or all of the index is in one section.
    pub fn index_page_range(&self, page: u32) -> Option<Range<u64>> {
        let (head, range) = (self.head_end()?, self.head.index.as_ref()?.page_range(page)?);
        Some(head.checked_add(range.start)?..head.checked_add(range.end)?)
    }

    /// The page of the index whose bytes begin there.
    pub fn index_page_at(&self, start: u64) -> Option<u32> {
        self.head.index.as_ref()?.page_at(start.checked_sub(self.head_end()?)?)
    }

    /// Takes in a page of the index: the bytes of [`Decoder::index_page_range`]. Its blocks can be taken from then on.
    ///
    /// # Errors
    /// When the bytes are damaged, or the page cannot be taken now; nothing has changed then.
    pub fn take_index_page(&mut self, page: u32, bytes: &[u8]) -> Result<(), FormatError> {
        let Some(range) = self.index_page_range(page).filter(|_| self.takes_blocks()) else {
            return Err(self.corrupt("there is no such page of the index, or not yet"));
        };
        let corrupt = |what| FormatError::Corrupt { offset: range.start, what };
        let short = || corrupt("a page of the index is shorter than the index says");
        let FoundSection { kind, content, behind } = find_section(bytes, range.start, short)?;
        if kind != Kind::IPAG {
            return Err(corrupt("a section is out of place"));
        }
        if !behind.is_empty() || bytes.len() as u64 != range.end - range.start {
            return Err(corrupt("a page of the index is not as long as the index says"));
        }
        self.read_index_page(content, page)
    }

    /// Forgets a page of the index, of whose blocks none is here; false if one is, or there is no such page.
    pub fn drop_index_page(&mut self, page: u32) -> bool {
        let (Some(mt), Some(index)) = (&self.mt, &mut self.head.index) else { return false };
        let is_there = index.is_paged() && (page as usize) < index.pages().len();
        if !is_there || index.blocks_of(page).any(|block| mt.has_page(block)) {
            return false;
        }
        index.drop_page(page);
        self.tell_bounds(page);
        true
    }

    /// Takes in a whole block of a half-edge MT: the bytes of [`Decoder::block_ranges`], one after the other. The blocks on which it
    /// depends need not be there. Afterwards no more bytes can be fed in the order of the file.
    ///
    /// # Errors
    /// When the bytes are damaged, or the block cannot be taken now; nothing has changed then.
    pub fn take_block(&mut self, block: u32, bytes: &[u8]) -> Result<(), FormatError> {
        let offset = self.block_ranges(block).first().map_or(0, |range| range.start);
        let corrupt = |what| FormatError::Corrupt { offset, what };
        let info = self.head.info.as_ref().filter(|info| info.kind.is_paged());
        let (Some(_), Some(info)) = (&self.mt, info) else {
            return Err(corrupt("there is no base mesh that blocks could be added to one by one"));
        };
        let short = || corrupt("a block is shorter than the index says");
        let (fields, kinds) = (info.fields.len(), [Kind::HALF, Kind::FLDU]);
        let mut open = None;
        let mut rest = bytes;
        for part in (0..=fields).filter(|&part| part == 0 || self.head.place(part - 1).is_some()) {
            let at = offset + (bytes.len() - rest.len()) as u64;
            let FoundSection { kind, content, behind } = find_section(rest, at, short)?;
            if kind != kinds[usize::from(part > 0)] {
                return Err(FormatError::Corrupt { offset: at, what: "a section is out of place" });
            }
            if part == 0 {
                open = Some(self.read_shared(content, Some(block))?);
            } else if let Some(open) = &mut open {
                self.head.read_field(open, content, Some(part - 1))?;
            }
            rest = behind;
        }
        if !rest.is_empty() {
            return Err(corrupt("a block is longer than the index says"));
        }
        match open {
            Some(open) => self.insert(open),
            None => Err(short()),
        }
    }

    /// Takes the updates of a block away, none of which may be applied to a mesh.
    ///
    /// # Errors
    /// If the block is not there.
    pub fn drop_block(&mut self, block: u32) -> Result<(), PageError> {
        let Some(mt) = &mut self.mt else { return Err(PageError::Absent { page: block }) };
        mt.remove_page(block)?;
        mt.set_to_come(&self.head.largest_of_others(mt));
        Ok(())
    }
}

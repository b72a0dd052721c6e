//! What the sections in front of the blocks have said so far.

use super::open_block::OpenBlock;
use crate::format::coder::{Models, Source};
use crate::format::header::Start;
use crate::format::payload::histogram::Histograms;
use crate::format::payload::kind_codec::{KindCodec, codec_of};
use crate::format::payload::regions::RegionsHead;
use crate::format::payload::{BaseParts, half_edge};
use crate::format::read::Reader;
use crate::format::{BlockInfo, FormatError, Index};
use crate::mt::{ErrorCode, Mt, MtInfo, UpdatePages};
use std::ops::Range;

/// What comes in front of the blocks.
#[derive(Debug, Default)]
pub(super) struct FileHead {
    /// With all fields of the file.
    pub(super) info: Option<MtInfo>,
    /// Which of them are wanted.
    pub(super) wanted: Vec<usize>,
    /// In files of half-edge MTs.
    pub(super) index: Option<Index>,
    /// Where the index is in the file.
    pub(super) index_at: Range<u64>,
    pub(super) histograms: Option<Histograms>,
    /// Until the base mesh is there; then they are in the MT.
    pub(super) regions: Option<RegionsHead>,
    /// How many there are, once these are known; 0 if the file has none.
    pub(super) region_count: u32,
    /// For each field of the file whether it jumps at interfaces; empty if none does.
    pub(super) jumps: Vec<bool>,
    pub(super) models: Option<Models>,
    /// Until all wanted fields are there; then it is in the MT.
    pub(super) base: Option<BaseParts>,
    /// log2 of the updates of a block; once the base mesh is there.
    pub(super) block_bits: u32,
    /// How many fields' levels of the base mesh have been seen.
    pub(super) base_fields: usize,
    pub(super) start: Start,
}

impl FileHead {
    /// The description of the MT with the fields that are wanted.
    pub(super) fn wanted_info(&self) -> Option<MtInfo> {
        let info = self.info.as_ref()?;
        let fields = self.wanted.iter().filter_map(|&f| info.fields.get(f).cloned()).collect();
        Some(MtInfo { fields, ..info.clone() })
    }

    /// The codec of the kind of MT, once the description is there.
    pub(super) fn codec(&self) -> Option<&'static KindCodec> {
        Some(codec_of(self.info.as_ref()?.kind))
    }

    /// Whether all is here that stands in front of histograms: the description, and the index where there is one.
    pub(super) fn is_described(&self) -> bool {
        self.info.as_ref().is_some_and(|info| self.index.is_some() || !info.kind.is_paged())
    }

    /// The place among the wanted fields of a field of the file.
    pub(super) fn place(&self, field: usize) -> Option<usize> {
        self.wanted.iter().position(|&wanted| wanted == field)
    }

    /// Whether a field of the file jumps at interfaces.
    pub(super) fn jumps(&self, field: usize) -> bool {
        self.jumps.get(field).is_some_and(|jumps| *jumps)
    }

    pub(super) fn fields(&self) -> usize {
        self.info.as_ref().map_or(0, |info| info.fields.len())
    }

    /// Reads the next field of a block.
    pub(super) fn read_field(
        &self,
        open: &mut OpenBlock,
        mut content: Reader<'_>,
        expected: Option<usize>,
    ) -> Result<(), FormatError> {
        let [block, field] = [content.varint()?, content.varint()?];
        let expected = expected.unwrap_or(open.seen);
        if block != open.block || field as usize != expected {
            return Err(content.corrupt("a field of a block is missing or repeated"));
        }
        open.seen = expected + 1;
        let (Some(place), Some(models)) = (self.place(expected), &self.models) else { return Ok(()) };
        let mut source = Source::new(content, models)?;
        open.fields[place] =
            Some(half_edge::read_field(&mut source, open.updates.len() as u32, self.jumps(expected))?);
        source.end()
    }

    /// The largest errors that an update can have which is not in the MT, by wanted field.
    pub(super) fn largest_of_others(&self, mt: &Mt) -> Vec<ErrorCode> {
        let mut largest = vec![ErrorCode::ZERO; self.wanted.len()];
        let Some(index) = &self.index else { return largest };
        let mut include = |of: &BlockInfo| {
            for (error, &field) in largest.iter_mut().zip(&self.wanted) {
                *error = (*error).max(of.errors[field]);
            }
        };
        // No block is here whose page is not.
        index.pages().iter().filter(|page| !page.is_here()).for_each(|page| include(&page.all));
        index.known().filter(|(block, _)| !mt.has_page(*block)).for_each(|(_, block)| include(block));
        largest
    }

    /// Of each block of a page of the index, what bounds its errors by wanted field; one bound for all as long as that is not here.
    pub(super) fn bounds_of_page(&self, index: &Index, page: u32) -> Vec<ErrorCode> {
        let all = &index.pages()[page as usize];
        let of = |block: &BlockInfo| self.wanted.iter().map(|&f| block.errors[f]).collect::<Vec<_>>();
        if all.is_here() {
            index.known_of(page).flat_map(|(_, block)| of(block)).collect()
        } else {
            of(&all.all)
        }
    }
}

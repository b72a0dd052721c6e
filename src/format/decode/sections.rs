//! Whole, verified sections of each kind, and what they add to the MT.

use super::file_head::FileHead;
use super::open_block::OpenBlock;
use super::{Decoder, Stage};
use crate::format::coder::{Models, Source};
use crate::format::header::{HEAD_BYTES, Kind, SectionHead};
use crate::format::payload::codec::read_bounds;
use crate::format::payload::exact::Corrections;
use crate::format::payload::half_edge;
use crate::format::payload::histogram::Histograms;
use crate::format::payload::kind_codec::codec_of;
use crate::format::payload::{FieldPart, bounds, extremes, regions};
use crate::format::read::Reader;
use crate::format::{FormatError, Index, payload};
use crate::mt::{Mt, MtInfo, MultiTessellation, UpdatePages, updates_of_page};
use std::ops::Range;

impl Decoder {
    /// Uses a whole, verified section.
    pub(super) fn open(&mut self, head: SectionHead, content: Reader<'_>) -> Result<(), FormatError> {
        match head.kind {
            Kind::INFO => self.open_info(content)?,
            Kind::INDX => self.open_index(content)?,
            Kind::HIST => self.open_histograms(content)?,
            Kind::BOUNDS => self.open_bounds(content)?,
            Kind::EXTREMES => self.open_extremes(content)?,
            Kind::REGIONS => self.open_regions(content)?,
            Kind::MODL => self.open_models(content)?,
            Kind::BASE => self.open_base(content)?,
            Kind::FLDB => self.open_base_field(content)?,
            Kind::IPAG => self.open_index_page(content)?,
            Kind::HALF if self.block.is_none() && self.takes_blocks() && self.has_whole_index() => {
                let open = self.read_shared(content, None)?;
                self.next_block += 1;
                self.block = Some(open);
            }
            Kind::FLDU => self.open_field(content)?,
            Kind::UPDT | Kind::INSV => self.open_in_order(head.kind, content)?,
            Kind::EXACT if self.mt.is_some() && self.block.is_none() => self.open_exact(content)?,
            Kind::ENDF if self.mt.is_some() && self.block.is_none() => return self.end(content),
            kind if kind.is_known() => return Err(content.out_of_place()),
            kind if kind.is_skippable() => {}
            _ => {
                let offset = self.bytes - u64::from(head.length) - HEAD_BYTES as u64;
                let what = "a kind of section that this reader does not know";
                return Err(FormatError::UnsupportedFeature { offset, what });
            }
        }
        self.chain.update(&head.crc.to_le_bytes());
        self.sections = self.sections.wrapping_add(1);
        Ok(())
    }

    pub(super) fn open_info(&mut self, content: Reader<'_>) -> Result<(), FormatError> {
        if self.head.info.is_some() {
            return Err(content.out_of_place());
        }
        let offset = self.bytes;
        let (info, metadata) = payload::read_info(content, self.head.start.many_tets)?;
        let codec = codec_of(info.kind);
        if self.head.start.tet_errors && !codec.has_tet_errors {
            let what = "errors of tetrahedra in an MT of a kind that has none";
            return Err(FormatError::UnsupportedFeature { offset, what });
        }
        if self.head.start.index_pages && !info.kind.is_paged() {
            let what = "an index in pages in an MT of a kind that has none";
            return Err(FormatError::UnsupportedFeature { offset, what });
        }
        let names = &self.options.fields;
        if let Some(name) = names.iter().find(|name| !info.fields.iter().any(|field| field.name == **name)) {
            let known = info.fields.iter().map(|field| field.name.clone()).collect();
            return Err(FormatError::Field { name: name.clone(), known });
        }
        let all = names.is_empty() || !info.kind.is_paged();
        let is_wanted = |f: &usize| all || names.contains(&info.fields[*f].name);
        self.head.wanted = (0..info.fields.len()).filter(is_wanted).collect();
        // Refuse at once what cannot fit, not after half of it has been fetched.
        payload::check_memory((&info, codec), [0; 2], self.most_at_once(&info), &self.options.limits)?;
        self.head.info = Some(info);
        self.metadata = metadata;
        Ok(())
    }

    /// Updates that are going to be in memory at once.
    fn most_at_once(&self, info: &MtInfo) -> u32 {
        if self.options.in_parts && info.kind.is_paged() { 0 } else { info.updates }
    }

    pub(super) fn open_index(&mut self, content: Reader<'_>) -> Result<(), FormatError> {
        let FileHead { info: Some(info), index: index @ None, start: of_file, .. } = &mut self.head else {
            return Err(content.out_of_place());
        };
        if !info.kind.is_paged() {
            return Err(content.out_of_place());
        }
        let start = self.bytes - (HEAD_BYTES + content.len()) as u64;
        *index = Some(Index::read(content, info, of_file.index_pages)?);
        self.head.index_at = start..self.bytes;
        Ok(())
    }

    /// The next page of the index, where the file comes in order.
    fn open_index_page(&mut self, content: Reader<'_>) -> Result<(), FormatError> {
        let pages = self.head.index.as_ref().filter(|index| index.is_paged()).map(Index::pages);
        let next = pages.and_then(|pages| pages.iter().position(|page| !page.is_here()));
        match next.filter(|_| self.takes_blocks()) {
            Some(page) => self.read_index_page(content, page as u32),
            None => Err(content.out_of_place()),
        }
    }

    /// Reads a page of the index, behind the base mesh.
    pub(super) fn read_index_page(&mut self, content: Reader<'_>, page: u32) -> Result<(), FormatError> {
        let FileHead { info: Some(info), index: Some(index), region_count, .. } = &mut self.head else {
            return Err(content.out_of_place());
        };
        index.read_page(content, page, info, *region_count)?;
        self.tell_bounds(page);
        Ok(())
    }

    /// Tells the MT what bounds the errors of the blocks of a page of the index.
    pub(super) fn tell_bounds(&mut self, page: u32) {
        if let (Some(Mt::HalfEdge(mt)), Some(index)) = (&mut self.mt, &self.head.index) {
            mt.set_page_bounds(page, self.head.bounds_of_page(index, page));
        }
    }

    fn has_whole_index(&self) -> bool {
        self.head.index.as_ref().is_some_and(Index::is_whole)
    }

    pub(super) fn open_histograms(&mut self, content: Reader<'_>) -> Result<(), FormatError> {
        let fields = self.head.fields();
        let is_behind = |info: &MtInfo| info.bounds.is_some() || extremes::are_known(&info.fields);
        let in_place = self.head.is_described() && !self.head.info.as_ref().is_some_and(is_behind);
        let FileHead { histograms: histograms @ None, models: None, .. } = &mut self.head else {
            return Err(content.out_of_place());
        };
        if !in_place {
            return Err(content.out_of_place());
        }
        *histograms = Some(Histograms::read(content, fields)?);
        Ok(())
    }

    pub(super) fn open_bounds(&mut self, content: Reader<'_>) -> Result<(), FormatError> {
        let is_described = self.head.is_described();
        let FileHead { info: Some(info), models: None, .. } = &mut self.head else {
            return Err(content.out_of_place());
        };
        if info.bounds.is_some() || extremes::are_known(&info.fields) || !is_described {
            return Err(content.out_of_place());
        }
        info.bounds = Some(bounds::read(content, info.lattice.bits)?);
        Ok(())
    }

    pub(super) fn open_extremes(&mut self, content: Reader<'_>) -> Result<(), FormatError> {
        let is_described = self.head.is_described();
        let FileHead { info: Some(info), models: None, .. } = &mut self.head else {
            return Err(content.out_of_place());
        };
        if extremes::are_known(&info.fields) || !is_described {
            return Err(content.out_of_place());
        }
        extremes::read(content, &mut info.fields)?;
        Ok(info.check()?)
    }

    pub(super) fn open_regions(&mut self, content: Reader<'_>) -> Result<(), FormatError> {
        let has_sides = self.head.start.sides;
        let FileHead {
            info: Some(info),
            index: Some(index),
            regions: regions @ None,
            region_count,
            models: None,
            jumps,
            ..
        } = &mut self.head
        else {
            return Err(content.out_of_place());
        };
        let mut found = regions::read(content, info, index, has_sides)?;
        *jumps = std::mem::take(&mut found.jumps);
        *region_count = found.count();
        *regions = Some(found);
        Ok(())
    }

    pub(super) fn open_models(&mut self, content: Reader<'_>) -> Result<(), FormatError> {
        let codec = self.head.codec().filter(|_| self.head.is_described());
        let (Some(codec), FileHead { models: models @ None, .. }) = (codec, &mut self.head) else {
            return Err(content.out_of_place());
        };
        let families: Vec<_> = codec.parts().into_iter().map(|(_, family)| family).collect();
        *models = Some(Models::read(content, &families)?);
        Ok(())
    }

    pub(super) fn open_base(&mut self, content: Reader<'_>) -> Result<(), FormatError> {
        let lacks_regions = self.head.start.sides && self.head.regions.is_none();
        let in_place = self.head.base_fields == 0 && self.mt.is_none() && !lacks_regions;
        let bits = self.head.index.as_ref().map(|index| index.block_bits);
        let (FileHead { info: Some(info), models: Some(models), base: None, .. }, Some(codec), true) =
            (&self.head, self.head.codec(), in_place)
        else {
            return Err(content.out_of_place());
        };
        let updates = self.most_at_once(info);
        let base = payload::read_base(content, (info, codec), models, updates, bits, &self.options.limits)?;
        self.head.block_bits = base.block_bits;
        self.head.base = Some(base);
        Ok(())
    }

    pub(super) fn open_base_field(&mut self, mut content: Reader<'_>) -> Result<(), FormatError> {
        let field = self.head.base_fields;
        let had_base = self.head.base.is_some() || self.mt.is_some();
        if !had_base || field >= self.head.fields() || content.varint()? as usize != field {
            return Err(content.out_of_place());
        }
        self.head.base_fields += 1;
        let (is_wanted, jumps) = (self.head.place(field).is_some(), self.head.jumps(field));
        if let (true, FileHead { base: Some(base), models: Some(models), .. }) = (is_wanted, &mut self.head) {
            base.read_field(content, models, jumps)?;
        }
        if self.head.base.as_ref().is_some_and(|base| base.fields() == self.head.wanted.len())
            && let (Some(mut base), Some(info)) = (self.head.base.take(), self.head.wanted_info())
        {
            let sides = base.take_sides();
            let (mut mt, in_order) = base.start(info, self.head.start.tet_errors)?;
            if let (Mt::HalfEdge(mt), Some(regions)) = (&mut mt, self.head.regions.take()) {
                let mut regions = regions.of_base(mt.base().tets.len()).ok_or_else(|| {
                    self.corrupt("the base mesh does not have as many tetrahedra as regions are stated for")
                })?;
                let sides = half_edge::base_sides(mt.base(), &regions.of_base, &sides);
                regions.sides = sides.ok_or_else(|| {
                    self.corrupt("base vertices do not have values for each of their regions")
                })?;
                mt.set_regions(regions)?;
            }
            if let (Mt::HalfEdge(mt), Some(index)) = (&mut mt, &self.head.index) {
                mt.group_pages(index.log2_page());
                for page in 0..index.pages().len() as u32 {
                    mt.set_page_bounds(page, self.head.bounds_of_page(index, page));
                }
            }
            (self.mt, self.in_order) = (Some(mt), in_order);
        }
        Ok(())
    }

    /// The updates of a block that comes next, or of the one that is expected.
    pub(super) fn next_updates(
        &self,
        content: &mut Reader<'_>,
        expected: Option<u32>,
    ) -> Result<(u32, Range<u32>), FormatError> {
        let Some(info) = &self.head.info else {
            return Err(content.out_of_place());
        };
        let in_place = self.mt.is_some() && self.head.base_fields == info.fields.len();
        let block = content.varint()?;
        if !in_place && expected.is_none() || block != expected.unwrap_or(self.next_block) {
            return Err(content.corrupt("a block of updates is missing or repeated"));
        }
        let updates = updates_of_page(self.head.block_bits, block, info.updates);
        if updates.is_empty() {
            return Err(content.corrupt("there are more updates than the description says"));
        }
        Ok((block, updates))
    }

    pub(super) fn read_shared(
        &self,
        mut content: Reader<'_>,
        expected: Option<u32>,
    ) -> Result<OpenBlock, FormatError> {
        let (block, updates) = self.next_updates(&mut content, expected)?;
        let (Some(info), Some(models)) = (&self.head.info, &self.head.models) else {
            return Err(content.out_of_place());
        };
        let (bits, limits) = (self.head.block_bits, &self.options.limits);
        let mut source = Source::new(content, models)?;
        let shared = half_edge::read(&mut source, info, bits, updates.clone(), limits)?;
        source.end()?;
        let fields = self.head.wanted.iter().map(|_| None).collect();
        Ok(OpenBlock { block, updates, shared, seen: 0, fields })
    }

    pub(super) fn open_field(&mut self, content: Reader<'_>) -> Result<(), FormatError> {
        let Some(mut open) = self.block.take() else {
            return Err(content.out_of_place());
        };
        self.head.read_field(&mut open, content, None)?;
        if open.seen < self.head.fields() {
            self.block = Some(open);
            return Ok(());
        }
        self.insert(open)
    }

    /// Adds a block that is complete.
    pub(super) fn insert(&mut self, open: OpenBlock) -> Result<(), FormatError> {
        let OpenBlock { block, shared, fields, .. } = open;
        let fields: Vec<FieldPart> = fields.into_iter().flatten().collect();
        let Some(mt) = &mut self.mt else { return Ok(()) };
        if let Mt::HalfEdge(mt) = mt {
            shared.insert(mt, block, &fields, &self.options.limits)?;
        }
        mt.set_to_come(&self.head.largest_of_others(mt));
        Ok(())
    }

    pub(super) fn open_exact(&mut self, mut content: Reader<'_>) -> Result<(), FormatError> {
        let (field, precision, count) = (content.varint()? as usize, content.varint()?, content.varint()?);
        let (FileHead { info: Some(info), models: Some(models), .. }, 0 | 1) = (&self.head, precision) else {
            return Err(content.out_of_place());
        };
        let wrong = content.corrupt("exact values are not those of a field");
        let (before, is_ascending) = match self.exact.last() {
            Some((known, before)) if *known == field => (before.count(), true),
            last => (0, last.is_none_or(|(known, _)| *known < field)),
        };
        let is_in_all = count.checked_add(before).is_some_and(|all| all <= info.vertices);
        if field >= info.fields.len() || !is_ascending || !is_in_all {
            return Err(wrong);
        }
        if self.head.place(field).is_some() {
            let mut source = Source::new(content, models)?;
            let corrections = Corrections::read(&mut source, precision == 0, count)?;
            source.end()?;
            match self.exact.last_mut().filter(|(known, _)| *known == field) {
                Some((_, before)) => {
                    if !before.extend(corrections) {
                        return Err(wrong);
                    }
                }
                None => self.exact.push((field, corrections)),
            }
        }
        Ok(())
    }

    /// A block of updates that come in order.
    pub(super) fn open_in_order(&mut self, kind: Kind, mut content: Reader<'_>) -> Result<(), FormatError> {
        let (_, updates) = self.next_updates(&mut content, None)?;
        let is_expected = self.head.codec().is_some_and(|codec| codec.section == kind);
        match (&mut self.mt, &mut self.in_order, &self.head.models) {
            (Some(mt), Some(in_order), Some(models)) if is_expected => {
                self.next_block += 1;
                let mut source = Source::new(content, models)?;
                let behind = read_bounds(&mut source, mt.info().fields.len())?;
                in_order.read(&mut source, mt, updates.len() as u32, &self.options.limits)?;
                mt.set_to_come(&behind);
                source.end()
            }
            _ => Err(content.out_of_place()),
        }
    }

    pub(super) fn end(&mut self, content: Reader<'_>) -> Result<(), FormatError> {
        let totals = payload::read_end(content)?;
        let updates = self.mt.as_ref().map_or(0, Mt::present);
        let expected = self.info().map_or(0, |info| info.updates);
        if totals.updates != updates || updates != expected {
            return Err(self.corrupt("updates are missing"));
        }
        if totals.sections != self.sections || totals.crc != self.chain.clone().finalize() {
            return Err(self.corrupt("sections are missing or repeated"));
        }
        if self.total.is_some_and(|total| total != self.bytes) {
            return Err(self.corrupt("the file is shorter than its header says"));
        }
        self.stage = Stage::End;
        self.in_order = None;
        Ok(())
    }
}

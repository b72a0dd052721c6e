//! Bytes of any split to a growing MT.

use super::coder::{Models, Source};
use super::header::{
    END_BYTES, HEAD_BYTES, HEADER_BYTES, Head, Kind, Start, VERSION_AT, may_be_mt, parse_header, version_for,
};
use super::payload::edge::FieldPart;
use super::payload::exact::Corrections;
use super::payload::{BaseParts, Metadata, Shared, State};
use super::read::Reader;
use super::{BlockInfo, FormatError, Index, Limits, payload};
use crate::mt::{ErrorCode, Mt, MtInfo, MultiTessellation, PageError, UpdatePages};
use std::ops::Range;

/// Most bytes that are kept allocated between sections.
const KEPT_BYTES: usize = 1 << 20;

/// How far a stream has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// The base mesh is there: the MT can be used.
    pub ready: bool,
    /// The whole file is there.
    pub complete: bool,
    /// Bytes taken in.
    pub bytes: u64,
    /// Bytes of the whole file, if it tells.
    pub total: Option<u64>,
    /// Updates that are there.
    pub updates: u32,
}

/// What the next bytes belong to.
#[derive(Debug)]
enum Stage {
    Header,
    Head,
    /// A section's content: `start` is its place in the file, `left` the bytes that are missing.
    Payload {
        head: Head,
        hasher: crc32fast::Hasher,
        start: u64,
        left: u32,
    },
    End,
}

/// How a file is to be read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DecodeOptions {
    /// What it may take.
    pub limits: Limits,
    /// The fields that are wanted, by name; all if none is named. Files of half-edge and edge-based MTs have every field in
    /// sections of its own, and those of others need not be fetched; the other kinds come with all fields.
    pub fields: Vec<String>,
    /// Whether blocks are going to come by [`Decoder::take_block`], so that not all of them need to fit the limits at
    /// once.
    pub in_parts: bool,
}

/// Turns the bytes of an MT file, pushed in pieces of any size, into an MT that grows section by section.
///
/// Only the section in flight is kept as bytes. Every section's checksum is verified before its content is used.
/// After an error the MT stays usable as far as it came, and all further bytes give the same error.
///
/// The blocks of a half-edge or edge-based MT may also come in another order, each as a whole: see [`Decoder::take_block`].
#[derive(Debug)]
pub struct Decoder {
    options: DecodeOptions,
    stage: Stage,
    /// What has arrived of the header, of a head, or of a section.
    buffer: Vec<u8>,
    bytes: u64,
    total: Option<u64>,
    sections: u32,
    /// Over the checksums of all sections.
    chain: crc32fast::Hasher,
    metadata: Metadata,
    head: FileHead,
    mt: Option<Mt>,
    /// For a vertex-based MT, what its updates are read with.
    state: Option<State>,
    /// The number of the block that comes next.
    next_block: u32,
    block: Option<OpenBlock>,
    /// Exact values, by the field's number in the file.
    exact: Vec<(usize, Corrections)>,
    failed: Option<FormatError>,
}

/// What comes in front of the blocks.
#[derive(Debug, Default)]
struct FileHead {
    /// With all fields of the file.
    info: Option<MtInfo>,
    /// Which of them are wanted.
    wanted: Vec<usize>,
    index: Option<Index>,
    /// Where the index ends in the file.
    index_end: u64,
    models: Option<Models>,
    /// Until all wanted fields are there; then it is in the MT.
    base: Option<BaseParts>,
    /// How many fields' levels of the base mesh have been seen.
    base_fields: usize,
    start: Start,
}

impl FileHead {
    /// The description of the MT with the fields that are wanted.
    fn wanted_info(&self) -> Option<MtInfo> {
        let info = self.info.as_ref()?;
        let fields = self.wanted.iter().filter_map(|&f| info.fields.get(f).cloned()).collect();
        Some(MtInfo { fields, ..info.clone() })
    }

    /// The place among the wanted fields of a field of the file.
    fn place(&self, field: usize) -> Option<usize> {
        self.wanted.iter().position(|&wanted| wanted == field)
    }

    fn fields(&self) -> usize {
        self.info.as_ref().map_or(0, |info| info.fields.len())
    }
}

impl FileHead {
    /// Reads the next field of a block.
    fn read_field(
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
        open.fields[place] = Some(open.shared.read_field(&mut source, open.updates.len() as u32)?);
        source.end()
    }

    /// The largest error that an update can have which is not in the MT.
    fn largest_of_others(&self, mt: &Mt) -> ErrorCode {
        let Some(index) = &self.index else { return ErrorCode::MAX };
        let absent = (0..).zip(&index.blocks).filter(|(page, _)| !mt.has_page(*page));
        let errors = absent.flat_map(|(_, block)| self.wanted.iter().map(|&field| block.errors[field]));
        errors.max().unwrap_or(ErrorCode::ZERO)
    }
}

/// A block of which not all has arrived.
#[derive(Debug)]
struct OpenBlock {
    block: u32,
    updates: Range<u32>,
    shared: Shared,
    /// How many fields have been seen.
    seen: usize,
    /// The wanted ones of them.
    fields: Vec<Option<FieldPart>>,
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new(DecodeOptions::default())
    }
}

impl Decoder {
    /// A decoder at the start of a file.
    pub fn new(options: DecodeOptions) -> Self {
        Self {
            options,
            stage: Stage::Header,
            buffer: Vec::new(),
            bytes: 0,
            total: None,
            sections: 0,
            chain: crc32fast::Hasher::new(),
            metadata: Metadata::new(),
            head: FileHead::default(),
            mt: None,
            state: None,
            next_block: 0,
            block: None,
            exact: Vec::new(),
            failed: None,
        }
    }

    /// Takes in the next bytes of the file.
    ///
    /// # Errors
    /// When the bytes are not those of an MT file, are damaged, or exceed the limits.
    pub fn feed(&mut self, bytes: &[u8]) -> Result<Progress, FormatError> {
        if let Some(error) = &self.failed {
            return Err(error.clone());
        }
        if let Err(error) = self.take_in(bytes) {
            self.failed = Some(error.clone());
            self.buffer = Vec::new();
            return Err(error);
        }
        Ok(self.progress())
    }

    /// Tells the decoder that no more bytes come.
    ///
    /// # Errors
    /// [`FormatError::Truncated`] when the file should go on, or the error that an earlier `feed` gave.
    pub fn finish(&self) -> Result<(), FormatError> {
        match (&self.failed, &self.stage) {
            (Some(error), _) => Err(error.clone()),
            (None, Stage::End) => Ok(()),
            (None, _) => Err(FormatError::Truncated { offset: self.bytes }),
        }
    }

    /// The MT as far as it has arrived; none before the base mesh is there.
    pub fn mt(&self) -> Option<&Mt> {
        self.mt.as_ref()
    }

    /// The MT, without the decoder.
    pub fn into_mt(self) -> Option<Mt> {
        self.mt
    }

    /// What the file tells of itself, with all of its fields; none before that section is there.
    pub fn info(&self) -> Option<&MtInfo> {
        self.head.info.as_ref()
    }

    /// What is in which block; none before that section is there. Errors and ranges are those of all fields of the file.
    pub fn index(&self) -> Option<&Index> {
        self.head.index.as_ref()
    }

    /// The numbers of the fields of the file that the MT has, in its order.
    pub fn wanted_fields(&self) -> &[usize] {
        &self.head.wanted
    }

    /// The bytes of the file that hold a block with the wanted fields, in ranges that do not touch; empty if there is no such
    /// block.
    pub fn block_ranges(&self, block: u32) -> Vec<Range<u64>> {
        let mut ranges: Vec<Range<u64>> = Vec::new();
        let Some(index) = &self.head.index else { return ranges };
        let Some(info) = index.blocks.get(block as usize) else { return ranges };
        let before: u64 = index.blocks[..block as usize].iter().map(BlockInfo::len).sum();
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

    /// Where the blocks begin in the file, or a byte behind where less is known; none before the index is there.
    pub fn head_end(&self) -> Option<u64> {
        let index = self.head.index.as_ref()?;
        self.head.index_end.checked_add(index.shared)
    }

    /// The bytes of the file behind the blocks, where exact values are; none if there are none, or that is not known yet.
    pub fn exact_range(&self) -> Option<Range<u64>> {
        let index = self.head.index.as_ref()?;
        let blocks = index.blocks.iter().try_fold(0_u64, |sum, block| sum.checked_add(block.len()))?;
        let start = self.head_end()?.checked_add(blocks)?;
        let end = self.total?.checked_sub(END_BYTES as u64)?;
        (start < end).then_some(start..end)
    }

    /// Takes in the bytes of [`Decoder::exact_range`] where blocks come by themselves; once is enough.
    ///
    /// # Errors
    /// When the bytes are damaged, or all that comes in front of the blocks is not there yet; nothing has changed then.
    pub fn take_exact(&mut self, bytes: &[u8]) -> Result<(), FormatError> {
        let Some(range) = self.exact_range().filter(|_| self.takes_blocks()) else {
            return Err(self.corrupt("there are no exact values, or not yet"));
        };
        let before = std::mem::take(&mut self.exact);
        let taken = self.read_exact_sections(bytes, range.start);
        if taken.is_err() {
            self.exact = before;
        }
        taken
    }

    fn read_exact_sections(&mut self, bytes: &[u8], start: u64) -> Result<(), FormatError> {
        let mut rest = bytes;
        while !rest.is_empty() {
            let offset = start + (bytes.len() - rest.len()) as u64;
            let corrupt = |what| FormatError::Corrupt { offset, what };
            let short = || corrupt("the bytes behind the blocks do not end with a section");
            let (head, behind) = rest.split_first_chunk::<HEAD_BYTES>().ok_or_else(short)?;
            let head = Head::parse(head);
            let (payload, behind) = behind.split_at_checked(head.length as usize).ok_or_else(short)?;
            if Head::new(head.kind, payload).crc != head.crc {
                return Err(corrupt("the checksum of a section does not match"));
            }
            match head.kind {
                Kind::EXACT => self.open_exact(Reader::new(payload, offset + HEAD_BYTES as u64))?,
                kind if kind.is_skippable() && !kind.is_known() => {}
                _ => return Err(corrupt("a section is out of place")),
            }
            rest = behind;
        }
        Ok(())
    }

    /// Whether all is there that comes in front of the blocks, and these may come in any order.
    pub fn takes_blocks(&self) -> bool {
        self.mt.as_ref().is_some_and(Mt::is_paged) && self.head.base_fields == self.head.fields()
    }

    /// The block of which a range of [`Decoder::block_ranges`] begins at this byte of the file.
    pub fn block_at(&self, start: u64) -> Option<u32> {
        let index = self.head.index.as_ref()?;
        let behind = start.checked_sub(self.head_end()?)?;
        let mut end = 0_u64;
        let block = index.blocks.iter().position(|block| {
            end = end.saturating_add(block.len());
            behind < end
        })?;
        let block = block as u32;
        self.block_ranges(block).iter().any(|range| range.start == start).then_some(block)
    }

    /// Takes in a whole block of a half-edge or edge-based MT: the bytes of [`Decoder::block_ranges`], one after the other. In
    /// edge-based MTs the blocks on which it depends must be there. Afterwards no more bytes can be fed in the order of the file.
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
        let (fields, kinds) = (info.fields.len(), [payload::section_of(info.kind), Kind::FLDU]);
        let mut open = None;
        let mut rest = bytes;
        for part in (0..=fields).filter(|&part| part == 0 || self.head.place(part - 1).is_some()) {
            let at = offset + (bytes.len() - rest.len()) as u64;
            let Some((head, behind)) = rest.split_first_chunk::<HEAD_BYTES>() else {
                return Err(corrupt("a block is shorter than the index tells"));
            };
            let head = Head::parse(head);
            let Some((payload, behind)) = behind.split_at_checked(head.length as usize) else {
                return Err(corrupt("a block is shorter than the index tells"));
            };
            if head.kind != kinds[usize::from(part > 0)] || Head::new(head.kind, payload).crc != head.crc {
                return Err(FormatError::Corrupt {
                    offset: at,
                    what: "the checksum of a section does not match",
                });
            }
            let content = Reader::new(payload, at + HEAD_BYTES as u64);
            if part == 0 {
                open = Some(self.read_shared(content, Some(block))?);
            } else if let Some(open) = &mut open {
                self.head.read_field(open, content, Some(part - 1))?;
            }
            rest = behind;
        }
        if !rest.is_empty() {
            return Err(corrupt("a block is longer than the index tells"));
        }
        match open {
            Some(open) => self.insert(open),
            None => Err(corrupt("a block is shorter than the index tells")),
        }
    }

    /// Takes the updates of a block away, none of which may be applied to a mesh.
    ///
    /// # Errors
    /// If the block is not there, or another one depends on it.
    pub fn drop_block(&mut self, block: u32) -> Result<(), PageError> {
        let Some(mt) = &mut self.mt else { return Err(PageError::Absent { page: block }) };
        mt.remove_page(block)?;
        mt.set_to_come(self.head.largest_of_others(mt));
        Ok(())
    }

    /// The file's free keys and values, in ascending order of the keys; empty before that section is there.
    pub fn metadata(&self) -> &[(String, String)] {
        &self.metadata
    }

    /// How far the stream has come.
    pub fn progress(&self) -> Progress {
        Progress {
            ready: self.mt.is_some(),
            complete: matches!(self.stage, Stage::End) && self.failed.is_none(),
            bytes: self.bytes,
            total: self.total,
            updates: self.mt.as_ref().map_or(0, Mt::present),
        }
    }

    fn take_in(&mut self, mut bytes: &[u8]) -> Result<(), FormatError> {
        while !bytes.is_empty() {
            if self.options.in_parts && self.takes_blocks() {
                // The blocks come by themselves.
                return Ok(());
            }
            match &self.stage {
                Stage::Header => self.take_header(&mut bytes)?,
                Stage::Head => self.take_head(&mut bytes)?,
                Stage::Payload { .. } => self.take_payload(&mut bytes)?,
                Stage::End => return Err(self.corrupt("bytes follow the end of the file")),
            }
        }
        Ok(())
    }

    /// An error at the byte that comes next.
    fn corrupt(&self, what: &'static str) -> FormatError {
        FormatError::Corrupt { offset: self.bytes, what }
    }

    /// Moves bytes into the buffer until it holds `N`; gives them then.
    fn fill<const N: usize>(&mut self, bytes: &mut &[u8]) -> Option<[u8; N]> {
        let count = bytes.len().min(N - self.buffer.len());
        let (head, tail) = bytes.split_at(count);
        self.buffer.extend_from_slice(head);
        self.bytes += count as u64;
        *bytes = tail;
        let whole = <[u8; N]>::try_from(self.buffer.as_slice()).ok()?;
        self.buffer.clear();
        Some(whole)
    }

    fn take_header(&mut self, bytes: &mut &[u8]) -> Result<(), FormatError> {
        let whole = self.fill::<HEADER_BYTES>(bytes);
        if !may_be_mt(&self.buffer) {
            return Err(FormatError::NotMt);
        }
        if let Some(header) = whole {
            let start = parse_header(&header)?;
            self.total = start.total;
            self.head.start = start;
            self.stage = Stage::Head;
        }
        Ok(())
    }

    fn take_head(&mut self, bytes: &mut &[u8]) -> Result<(), FormatError> {
        let Some(head) = self.fill::<HEAD_BYTES>(bytes) else {
            return Ok(());
        };
        let head = Head::parse(&head);
        let end = self.bytes + u64::from(head.length);
        // Every section but the last leaves room for the last.
        let rest = if head.kind == Kind::ENDF { 0 } else { END_BYTES as u64 };
        if self.total.is_some_and(|total| end + rest > total) {
            return Err(self.corrupt("a section runs past the end of the file"));
        }
        let (needed, limit) = (u64::from(head.length), self.options.limits.section_bytes);
        if head.kind.is_known() && needed > limit {
            return Err(FormatError::Limit { what: "one section", needed, limit });
        }
        self.stage = Stage::Payload { head, hasher: head.hasher(), start: self.bytes, left: head.length };
        if head.length == 0 { self.take_payload(bytes) } else { Ok(()) }
    }

    fn take_payload(&mut self, bytes: &mut &[u8]) -> Result<(), FormatError> {
        let Stage::Payload { head, hasher, start, left } = &mut self.stage else {
            return Ok(());
        };
        let count = bytes.len().min(*left as usize);
        let (now, tail) = bytes.split_at(count);
        hasher.update(now);
        if head.kind.is_known() {
            self.buffer.extend_from_slice(now);
        }
        *left -= count as u32;
        self.bytes += count as u64;
        *bytes = tail;
        if *left > 0 {
            return Ok(());
        }
        let (head, start, crc) = (*head, *start, hasher.clone().finalize());
        if crc != head.crc {
            let offset = start - HEAD_BYTES as u64;
            return Err(FormatError::Corrupt { offset, what: "the checksum of a section does not match" });
        }
        self.stage = Stage::Head;
        let payload = std::mem::take(&mut self.buffer);
        self.open(head, Reader::new(&payload, start))?;
        // Keep the allocation for the next section, unless this was an unusually large one.
        if payload.capacity() <= KEPT_BYTES {
            self.buffer = payload;
            self.buffer.clear();
        }
        Ok(())
    }

    /// Uses a whole, verified section.
    fn open(&mut self, head: Head, content: Reader<'_>) -> Result<(), FormatError> {
        let out_of_place = || content.corrupt("a section is out of place");
        match head.kind {
            Kind::INFO => self.open_info(content)?,
            Kind::INDX => self.open_index(content)?,
            Kind::MODL => self.open_models(content)?,
            Kind::BASE => self.open_base(content)?,
            Kind::FLDB => self.open_base_field(content)?,
            Kind::UPDT | Kind::HALF if self.block.is_none() => {
                let expected = self.head.info.as_ref().map(|info| payload::section_of(info.kind));
                if expected != Some(head.kind) {
                    return Err(out_of_place());
                }
                let open = self.read_shared(content, None)?;
                self.next_block += 1;
                self.block = Some(open);
            }
            Kind::FLDU => self.open_field(content)?,
            Kind::INSV | Kind::EXPL => self.open_columns(head.kind, content)?,
            Kind::EXACT if self.mt.is_some() && self.block.is_none() => self.open_exact(content)?,
            Kind::ENDF if self.mt.is_some() && self.block.is_none() => return self.end(content),
            kind if kind.is_known() => return Err(out_of_place()),
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

    fn open_info(&mut self, content: Reader<'_>) -> Result<(), FormatError> {
        if self.head.info.is_some() {
            return Err(content.corrupt("a section is out of place"));
        }
        let offset = self.bytes;
        let (info, metadata) = payload::read_info(content)?;
        if self.head.start.version[0] < version_for(info.kind)[0] {
            let what = "the version of the file does not go with the kind of MT in it";
            return Err(FormatError::Corrupt { offset: VERSION_AT, what });
        }
        if self.head.start.tet_errors && info.kind.is_paged() {
            let what = "errors of tetrahedra in an MT that comes in pages";
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
        if !self.options.in_parts {
            // Refuse at once what cannot fit, not after half of it has been fetched.
            payload::check_memory(&info, [0; 2], info.updates, &self.options.limits)?;
        }
        self.head.info = Some(info);
        self.metadata = metadata;
        Ok(())
    }

    fn open_index(&mut self, content: Reader<'_>) -> Result<(), FormatError> {
        let FileHead { info: Some(info), index: index @ None, .. } = &mut self.head else {
            return Err(content.corrupt("a section is out of place"));
        };
        let parts = if info.kind.is_paged() { 1 + info.fields.len() } else { 1 };
        *index = Some(Index::read(content, info, parts)?);
        self.head.index_end = self.bytes;
        Ok(())
    }

    fn open_models(&mut self, content: Reader<'_>) -> Result<(), FormatError> {
        let FileHead { info: Some(info), index: Some(_), models: models @ None, .. } = &mut self.head else {
            return Err(content.corrupt("a section is out of place"));
        };
        *models = Some(Models::read(content, &payload::families(info.kind))?);
        Ok(())
    }

    fn open_base(&mut self, content: Reader<'_>) -> Result<(), FormatError> {
        let in_place = self.head.base.is_none() && self.head.base_fields == 0 && self.mt.is_none();
        let bits = self.head.index.as_ref().map_or(0, |index| index.block_bits);
        let FileHead { info: Some(info), models: Some(models), base, .. } = &mut self.head else {
            return Err(content.corrupt("a section is out of place"));
        };
        if !in_place {
            return Err(content.corrupt("a section is out of place"));
        }
        let updates = if self.options.in_parts { 0 } else { info.updates };
        *base = Some(payload::read_base(content, info, models, updates, bits, &self.options.limits)?);
        Ok(())
    }

    fn open_base_field(&mut self, mut content: Reader<'_>) -> Result<(), FormatError> {
        let field = self.head.base_fields;
        let had_base = self.head.base.is_some() || self.mt.is_some();
        if !had_base || field >= self.head.fields() || content.varint()? as usize != field {
            return Err(content.corrupt("a section is out of place"));
        }
        self.head.base_fields += 1;
        let is_wanted = self.head.place(field).is_some();
        if let (true, FileHead { base: Some(base), models: Some(models), .. }) = (is_wanted, &mut self.head) {
            base.read_field(content, models)?;
        }
        if self.head.base.as_ref().is_some_and(|base| base.fields() == self.head.wanted.len()) {
            let bits = self.head.index.as_ref().map_or(0, |index| index.block_bits);
            if let (Some(base), Some(info)) = (self.head.base.take(), self.head.wanted_info()) {
                let (mut mt, state) = base.start(info, bits, self.head.start.tet_errors)?;
                if let (Mt::HalfEdge(mt), Some(index)) = (&mut mt, &self.head.index) {
                    let wanted = &self.head.wanted;
                    let of_block =
                        |block: &BlockInfo| wanted.iter().map(|&f| block.errors[f]).collect::<Vec<_>>();
                    mt.set_page_bounds(index.blocks.iter().flat_map(of_block).collect());
                }
                (self.mt, self.state) = (Some(mt), state);
            }
        }
        Ok(())
    }

    /// The updates of a block that comes next, or of the one that is expected.
    fn next_updates(
        &self,
        content: &mut Reader<'_>,
        expected: Option<u32>,
    ) -> Result<(u32, Range<u32>), FormatError> {
        let (Some(index), Some(info)) = (&self.head.index, &self.head.info) else {
            return Err(content.corrupt("a section is out of place"));
        };
        let in_place = self.mt.is_some() && self.head.base_fields == info.fields.len();
        let block = content.varint()?;
        if !in_place && expected.is_none() || block != expected.unwrap_or(self.next_block) {
            return Err(content.corrupt("a block of updates is missing or repeated"));
        }
        let updates = index.updates(block, info.updates);
        if updates.is_empty() {
            return Err(content.corrupt("there are more updates than the description tells"));
        }
        Ok((block, updates))
    }

    fn read_shared(&self, mut content: Reader<'_>, expected: Option<u32>) -> Result<OpenBlock, FormatError> {
        let (block, updates) = self.next_updates(&mut content, expected)?;
        let (Some(mt), Some(models)) = (&self.mt, &self.head.models) else {
            return Err(content.corrupt("a section is out of place"));
        };
        let mut source = Source::new(content, models)?;
        let shared = Shared::read(&mut source, mt, updates.clone(), &self.options.limits)?;
        source.end()?;
        let fields = self.head.wanted.iter().map(|_| None).collect();
        Ok(OpenBlock { block, updates, shared, seen: 0, fields })
    }

    fn open_field(&mut self, content: Reader<'_>) -> Result<(), FormatError> {
        let Some(mut open) = self.block.take() else {
            return Err(content.corrupt("a section is out of place"));
        };
        self.head.read_field(&mut open, content, None)?;
        if open.seen < self.head.fields() {
            self.block = Some(open);
            return Ok(());
        }
        self.insert(open)
    }

    /// Adds a block that is complete.
    fn insert(&mut self, open: OpenBlock) -> Result<(), FormatError> {
        let OpenBlock { block, shared, fields, .. } = open;
        let fields: Vec<FieldPart> = fields.into_iter().flatten().collect();
        let Some(mt) = &mut self.mt else { return Ok(()) };
        shared.check_memory(mt, &self.options.limits)?;
        shared.insert(mt, block, &fields)?;
        mt.set_to_come(self.head.largest_of_others(mt));
        Ok(())
    }

    fn open_exact(&mut self, mut content: Reader<'_>) -> Result<(), FormatError> {
        let (field, precision, count) = (content.varint()? as usize, content.varint()?, content.varint()?);
        let (FileHead { info: Some(info), models: Some(models), .. }, 0 | 1) = (&self.head, precision) else {
            return Err(content.corrupt("a section is out of place"));
        };
        let is_new = self.exact.iter().all(|(known, _)| *known < field);
        if field >= info.fields.len() || !is_new || count > info.vertices {
            return Err(content.corrupt("exact values are not those of a field"));
        }
        if self.head.place(field).is_some() {
            let mut source = Source::new(content, models)?;
            let corrections = Corrections::read(&mut source, precision == 0, count)?;
            source.end()?;
            self.exact.push((field, corrections));
        }
        Ok(())
    }

    /// The exact values of a wanted field, by its place among these, if they have arrived.
    pub fn exact(&self, place: usize) -> Option<&Corrections> {
        let field = self.head.wanted.get(place)?;
        self.exact.iter().find(|(known, _)| known == field).map(|(_, corrections)| corrections)
    }

    fn open_columns(&mut self, kind: Kind, mut content: Reader<'_>) -> Result<(), FormatError> {
        let (_, updates) = self.next_updates(&mut content, None)?;
        match &mut self.mt {
            Some(mt) if kind == payload::section_of(mt.info().kind) => {
                self.next_block += 1;
                let Some(models) = &self.head.models else { return Ok(()) };
                let mut source = Source::new(content, models)?;
                let count = updates.len() as u32;
                payload::read_updates(&mut source, mt, count, self.state.as_mut(), &self.options.limits)?;
                source.end()
            }
            _ => Err(content.corrupt("a section is out of place")),
        }
    }

    fn end(&mut self, content: Reader<'_>) -> Result<(), FormatError> {
        let totals = payload::read_end(content)?;
        let updates = self.mt.as_ref().map_or(0, Mt::present);
        let expected = self.info().map_or(0, |info| info.updates);
        if totals.updates != updates || updates != expected {
            return Err(self.corrupt("updates are missing"));
        }
        if let Some(mt) = &self.mt {
            payload::check_reference(mt)?;
        }
        if totals.sections != self.sections || totals.crc != self.chain.clone().finalize() {
            return Err(self.corrupt("sections are missing or repeated"));
        }
        if self.total.is_some_and(|total| total != self.bytes) {
            return Err(self.corrupt("the file is shorter than its header tells"));
        }
        self.stage = Stage::End;
        self.state = None;
        Ok(())
    }
}

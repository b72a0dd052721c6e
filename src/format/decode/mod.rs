//! Bytes of any split to a growing MT.

mod blocks;
mod curve;
mod file_head;
mod open_block;
mod sections;

use super::header::{END_BYTES, HEAD_BYTES, HEADER_BYTES, Kind, SectionHead, may_be_mt, parse_header};
use super::payload::Metadata;
use super::payload::codec::InOrder;
use super::payload::exact::Corrections;
use super::read::Reader;
use super::{FormatError, Index, Limits, checksum};
use crate::geom::{Bounds, lattice_box};
use crate::mt::{Mt, MtInfo, MultiTessellation, UpdatePages};
pub use curve::ErrorBytes;
use file_head::FileHead;
use open_block::OpenBlock;

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
    /// Bytes of the whole file, if it is known.
    pub total: Option<u64>,
    /// Updates that are there.
    pub updates: u32,
}

/// Whether a file keeps exact values, and whether they are here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExactStatus {
    /// The file keeps none.
    None,
    /// It keeps some behind its blocks, and not all of that is here: it is still to come, or cut off.
    Missing,
    /// All are here.
    Here,
}

impl ExactStatus {
    /// The status in one word: `none`, `missing` or `here`.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Missing => "missing",
            Self::Here => "here",
        }
    }
}

/// What the next bytes belong to.
#[derive(Debug, Default)]
enum Stage {
    #[default]
    Header,
    Head,
    /// A section's content: `start` is its place in the file, `left` the bytes that are missing.
    Payload {
        head: SectionHead,
        hasher: checksum::Hasher,
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
    /// The fields that are wanted, by name; all if none is named. Files of half-edge MTs have every field in
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
/// The blocks of a half-edge MT may also come in another order, each as a whole: see [`Decoder::take_block`].
#[derive(Debug, Default)]
pub struct Decoder {
    options: DecodeOptions,
    stage: Stage,
    /// What has arrived of the header, of a head, or of a section.
    buffer: Vec<u8>,
    bytes: u64,
    total: Option<u64>,
    sections: u32,
    /// Over the checksums of all sections.
    chain: checksum::Hasher,
    metadata: Metadata,
    head: FileHead,
    mt: Option<Mt>,
    /// What reads the updates of an MT whose blocks come in order.
    in_order: Option<Box<dyn InOrder>>,
    /// The number of the block that comes next.
    next_block: u32,
    block: Option<OpenBlock>,
    /// Exact values, by the field's number in the file.
    exact: Vec<(usize, Corrections)>,
    /// Whether all that is behind the blocks has come by itself.
    has_all_exact: bool,
    failed: Option<FormatError>,
}

impl Decoder {
    /// A decoder at the start of a file.
    pub fn new(options: DecodeOptions) -> Self {
        Self { options, ..Self::default() }
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

    /// Ends the file: no more bytes come.
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

    /// The description of the MT, with all fields of the file; none before that section is there.
    pub fn info(&self) -> Option<&MtInfo> {
        self.head.info.as_ref()
    }

    /// What is in which block of a half-edge MT; none before that section is there, and in files of other kinds. Errors and ranges are
    /// those of all fields of the file.
    pub fn index(&self) -> Option<&Index> {
        self.head.index.as_ref()
    }

    /// The numbers of the fields of the file that the MT has, in its order.
    pub fn wanted_fields(&self) -> &[usize] {
        &self.head.wanted
    }

    /// Whether all is there that comes in front of the blocks, and these may come in any order.
    pub fn takes_blocks(&self) -> bool {
        self.mt.as_ref().is_some_and(Mt::is_paged) && self.head.base_fields == self.head.fields()
    }

    /// The file's free keys and values, in ascending order of the keys; empty before that section is there.
    pub fn metadata(&self) -> &[(String, String)] {
        &self.metadata
    }

    /// The exact values of a wanted field, by its place among these, if they have arrived.
    pub fn exact(&self, place: usize) -> Option<&Corrections> {
        let field = self.head.wanted.get(place)?;
        self.exact.iter().find(|(known, _)| known == field).map(|(_, corrections)| corrections)
    }

    /// Which share of the volume of the reference mesh has values in each of equal bins of a wanted field's range (from its smallest
    /// to its largest value), by its place among the wanted fields. None if the file does not say, or not yet.
    pub fn histogram(&self, place: usize) -> Option<Vec<f64>> {
        let field = self.head.wanted.get(place)?;
        self.head.histograms.as_ref()?.shares(*field)
    }

    /// The box around the reference mesh, in model units: all meshes of the MT are in it. None before the base mesh is there. A file
    /// need not state it; then it is the box around the base mesh and all blocks as the index has them, which
    /// may be larger by a 256th of the lattice at each side; where there is no index, it is that of the whole lattice.
    pub fn bounds(&self) -> Option<Bounds> {
        let (info, mt) = (self.head.info.as_ref()?, self.mt.as_ref()?);
        if let Some(bounds) = info.model_bounds() {
            return Some(bounds);
        }
        let bounds = match &self.head.index {
            None => Some([[0; 3], [1 << info.lattice.bits; 3]]),
            Some(index) => {
                let blocks = index.pages().iter().flat_map(|page| page.all.bounds);
                lattice_box(mt.base().positions.iter().copied().chain(blocks))
            }
        };
        MtInfo { bounds, ..info.clone() }.model_bounds()
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
        let head = SectionHead::parse(&head);
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
}

//! Bytes of any split to a growing MT.

use super::FormatError;
use super::Limits;
use super::header::END_BYTES;
use super::header::HEAD_BYTES;
use super::header::HEADER_BYTES;
use super::header::Head;
use super::header::Kind;
use super::header::may_be_mt;
use super::header::parse_header;
use super::payload;
use super::payload::Metadata;
use super::read::Reader;
use crate::mt::Mt;
use crate::mt::MtInfo;
use crate::mt::MtRef;
use crate::mt::MultiTessellation;

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

/// Turns the bytes of an MT file, pushed in pieces of any size, into an MT that grows section by section.
///
/// Only the section in flight is kept as bytes. Every section's checksum is verified before its content is used.
/// After an error the MT stays usable as far as it came, and all further bytes give the same error.
#[derive(Debug)]
pub struct Decoder {
    limits: Limits,
    stage: Stage,
    /// What has arrived of the header, of a head, or of a section.
    buffer: Vec<u8>,
    bytes: u64,
    total: Option<u64>,
    sections: u32,
    /// Over the checksums of all sections.
    chain: crc32fast::Hasher,
    /// Until the base mesh comes; then it is in the MT.
    info: Option<MtInfo>,
    metadata: Metadata,
    mt: Option<Mt>,
    failed: Option<FormatError>,
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new(Limits::default())
    }
}

impl Decoder {
    /// A decoder at the start of a file.
    pub fn new(limits: Limits) -> Self {
        Self {
            limits,
            stage: Stage::Header,
            buffer: Vec::new(),
            bytes: 0,
            total: None,
            sections: 0,
            chain: crc32fast::Hasher::new(),
            info: None,
            metadata: Metadata::new(),
            mt: None,
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

    /// What the file tells of itself; none before that section is there.
    pub fn info(&self) -> Option<&MtInfo> {
        self.mt.as_ref().map(Mt::info).or(self.info.as_ref())
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
            updates: self.mt.as_ref().map_or(0, Mt::updates),
        }
    }

    fn take_in(&mut self, mut bytes: &[u8]) -> Result<(), FormatError> {
        while !bytes.is_empty() {
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
            self.total = parse_header(&header)?;
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
        let (needed, limit) = (u64::from(head.length), self.limits.section_bytes);
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
        match (head.kind, &mut self.info, &mut self.mt) {
            (Kind::INFO, info @ None, None) => {
                let (found, metadata) = payload::read_info(content)?;
                // Refuse at once what cannot fit, not after half of it has been fetched.
                payload::check_memory(&found, 0, 0, &self.limits)?;
                *info = Some(found);
                self.metadata = metadata;
            }
            (Kind::BASE, info @ Some(_), None) => {
                let Some(info) = info.take() else { return Ok(()) };
                self.mt = Some(payload::read_base(content, info, &self.limits)?);
            }
            (kind, _, Some(mt)) if kind == payload::section_of(mt.info().kind) => {
                payload::read_updates(content, mt, &self.limits)?;
            }
            (Kind::ENDF, _, Some(_)) => return self.end(content),
            (kind, ..) if kind.is_known() => return Err(content.corrupt("a section is out of place")),
            (kind, ..) if kind.is_skippable() => {}
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

    fn end(&mut self, content: Reader<'_>) -> Result<(), FormatError> {
        let totals = payload::read_end(content)?;
        let updates = self.mt.as_ref().map_or(0, Mt::updates);
        let expected = self.info().map_or(0, |info| info.updates);
        if totals.updates != updates || updates != expected {
            return Err(self.corrupt("updates are missing"));
        }
        if let Some(mt) = &self.mt {
            payload::check_reference(MtRef::from(mt))?;
        }
        if totals.sections != self.sections || totals.crc != self.chain.clone().finalize() {
            return Err(self.corrupt("sections are missing or repeated"));
        }
        if self.total.is_some_and(|total| total != self.bytes) {
            return Err(self.corrupt("the file is shorter than its header tells"));
        }
        self.stage = Stage::End;
        Ok(())
    }
}

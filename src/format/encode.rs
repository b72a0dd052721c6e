//! An MT to bytes: the same MT and options give the same bytes everywhere.

use super::block_scan::BlockScan;
use super::coder::{Counts, Measure, Models, Put, Writer};
use super::header::{END_BYTES, HEAD_BYTES, HEADER_BYTES, Kind, SectionHead, header, version_for};
use super::payload::Totals;
use super::payload::exact::Corrections;
use super::payload::histogram::Histograms;
use super::payload::index::{Index, MAX_BLOCK_BITS, MIN_BLOCK_BITS};
use super::{checksum, payload, write};
use crate::mt::{BaseMeshError, Exact, Mt, MultiTessellation, UpdateError, UpdatePages, VertexId};
use crate::threads;
use std::collections::BTreeMap;
use std::io;
use std::ops::Range;
use thiserror::Error;

/// What goes into a file besides the MT.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EncodeOptions {
    /// Refuse an MT whose errors do not fall along its partial order by as much as requests for values rely on, too; errors that
    /// grow are always refused. What the builders make passes.
    pub check_margins: bool,
    /// Exact values of fields at the vertices of the reference mesh.
    pub exact: Vec<Exact>,
    /// A histogram of each field over the reference mesh, some 160 bytes each, in front of the base mesh: see
    /// [`Decoder::histogram`](super::Decoder::histogram).
    pub histograms: bool,
    /// Free keys and values, kept as they are. What is here makes the bytes: leave out dates and paths.
    pub metadata: BTreeMap<String, String>,
}

/// Why an MT cannot be written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// Not all updates of the MT are there.
    #[error(
        "the MT has {updates} of the {expected} updates that its description contains; write it when it is complete"
    )]
    Incomplete {
        /// Updates that are there.
        updates: u32,
        /// Updates by the description.
        expected: u32,
    },
    /// No block can have as many updates as the pages of the MT.
    #[error("a block cannot hold 2^{bits} updates; put the MT into pages of 2^4 to 2^16")]
    Blocks {
        /// log2 of the updates of a page.
        bits: u32,
    },
    /// An update of the MT cannot be applied.
    #[error("the MT is damaged: {0}")]
    Update(UpdateError),
    /// The error of an update is not as far below that of one it depends on as selection relies on: what a request gives would
    /// depend on what was asked for before.
    #[error(
        "the errors of the MT do not fall along its partial order: in field {field} that of update {update} is too \
         large for update {parent}, which it depends on; build the MT again"
    )]
    Order {
        /// The update.
        update: u32,
        /// The one that it depends on.
        parent: u32,
        /// The field.
        field: usize,
    },
    /// Exact values are given for a field or a vertex that the reference mesh does not have.
    #[error("the exact values of field {field} are not those of the reference mesh")]
    Exact {
        /// The field.
        field: usize,
    },
    /// Something is longer than the file can say.
    #[error("{what} is too long for an MT file; shorten it")]
    TooLong {
        /// What it is.
        what: &'static str,
    },
    /// The description or the base mesh could not be read back.
    #[error("the MT cannot be written")]
    Base(#[source] BaseMeshError),
    /// The writer failed.
    #[error("the MT file could not be written")]
    Write(#[source] io::Error),
}

/// The bytes of an MT file. Its blocks, the least that a client can fetch by itself, are the pages of the MT: see [`Mt::in_pages`].
///
/// # Errors
/// If the MT is not complete, or could not be read back.
pub fn encode(mt: &Mt, options: &EncodeOptions) -> Result<Vec<u8>, EncodeError> {
    let mut bytes = Vec::new();
    encode_to(mt, options, &mut bytes)?;
    Ok(bytes)
}

/// Writes an MT file. Returns its size in bytes.
///
/// # Errors
/// As [`encode`], and when `writer` fails.
pub fn encode_to(mt: &Mt, options: &EncodeOptions, writer: &mut dyn io::Write) -> Result<u64, EncodeError> {
    check(mt)?;
    let BlockScan { blocks, reference, histograms } = BlockScan::of(mt, options)?;
    let mut index = Index { block_bits: mt.page_bits(), shared: 0, blocks };
    index.round(mt.info());
    let exact = corrections(mt, &options.exact, &reference)?;
    let sections = sections(mt, &options.metadata, &mut index, histograms.as_ref(), &exact)?;
    let mut total = HEADER_BYTES as u64 + END_BYTES as u64;
    let mut totals = Totals { updates: mt.updates(), sections: sections.len() as u32, crc: 0 };
    let mut chain = checksum::Hasher::new();
    for section in &sections {
        total += section.len();
        chain.update(&section.head.crc.to_le_bytes());
    }
    totals.crc = chain.finalize();
    let mut end = Vec::new();
    payload::write_end(&mut end, totals);
    let end = Section::new(Kind::ENDF, end)?;
    let mut put = |bytes: &[u8]| writer.write_all(bytes).map_err(EncodeError::Write);
    put(&header(
        total,
        version_for(mt.info().kind, options.histograms, mt.info().bounds.is_some()),
        mt.has_tet_errors(),
    ))?;
    for section in sections.iter().chain([&end]) {
        put(&section.head.to_bytes())?;
        put(&section.payload)?;
    }
    writer.flush().map_err(EncodeError::Write)?;
    Ok(total)
}

/// What a decoder would refuse must not be written.
fn check(mt: &Mt) -> Result<(), EncodeError> {
    if !(MIN_BLOCK_BITS..=MAX_BLOCK_BITS).contains(&mt.page_bits()) {
        return Err(EncodeError::Blocks { bits: mt.page_bits() });
    }
    let info = mt.info();
    if mt.present() != info.updates {
        return Err(EncodeError::Incomplete { updates: mt.present(), expected: info.updates });
    }
    mt.base().check(info).map_err(EncodeError::Base)?;
    payload::check_counts(info, mt.base().positions.len() as u64)
        .and_then(|()| payload::check_reference(mt))
        .map_err(EncodeError::Base)
}

/// A section that is ready to be written.
struct Section {
    head: SectionHead,
    payload: Vec<u8>,
}

impl Section {
    fn new(kind: Kind, payload: Vec<u8>) -> Result<Self, EncodeError> {
        if u32::try_from(payload.len() + HEAD_BYTES).is_err() {
            return Err(EncodeError::TooLong { what: "a section of more than 4 GiB" });
        }
        Ok(Self { head: SectionHead::new(kind, &payload), payload })
    }

    /// A section that begins with some bytes, the rest of which is coded.
    fn coded(
        kind: Kind,
        head: &[u32],
        models: &Models,
        put: impl FnOnce(&mut Writer<'_>),
    ) -> Result<Self, EncodeError> {
        let mut payload = Vec::new();
        head.iter().for_each(|&number| write::varint(&mut payload, u64::from(number)));
        let mut writer = Writer::new(models);
        put(&mut writer);
        writer.finish(&mut payload);
        Self::new(kind, payload)
    }

    /// Bytes with the head.
    fn len(&self) -> u64 {
        (HEAD_BYTES + self.payload.len()) as u64
    }
}

/// All sections but the last. Lengths are entered into the index.
fn sections(
    mt: &Mt,
    metadata: &BTreeMap<String, String>,
    index: &mut Index,
    histograms: Option<&Histograms>,
    exact: &[(u32, Corrections)],
) -> Result<Vec<Section>, EncodeError> {
    let fields = mt.info().fields.len();
    let mut counts = count_all(mt)?;
    exact.iter().for_each(|(_, corrections)| corrections.put(&mut counts));
    let models = Models::new(&counts);
    let mut shared = Vec::new();
    if let Some(histograms) = histograms {
        let mut payload = Vec::new();
        histograms.write(&mut payload);
        shared.push(Section::new(Kind::HIST, payload)?);
    }
    if let Some(bounds) = mt.info().bounds {
        let mut payload = Vec::new();
        payload::bounds::write(&mut payload, bounds);
        shared.push(Section::new(Kind::BOUNDS, payload)?);
    }
    let mut payload = Vec::new();
    models.write(&mut payload);
    shared.push(Section::new(Kind::MODL, payload)?);
    let mut payload = Vec::new();
    payload::write_base_head(&mut payload, mt);
    let head = payload.len();
    let mut writer = Writer::new(&models);
    payload::put_base(&mut writer, mt);
    writer.finish(&mut payload);
    let counts = [mt.base().positions.len() as u64, mt.base().tets.len() as u64];
    if !payload::is_backed(counts, payload.len() - head) {
        return Err(EncodeError::TooLong { what: "a base mesh that is coded in so few bytes" });
    }
    shared.push(Section::new(Kind::BASE, payload)?);
    for field in 0..fields {
        shared.push(Section::coded(Kind::FLDB, &[field as u32], &models, |out| {
            payload::put_base_field(out, mt, field);
        })?);
    }
    index.shared = shared.iter().map(Section::len).sum();
    let of_blocks = put_blocks(mt, index, &models)?;
    let mut blocks = Vec::with_capacity(of_blocks.iter().map(Vec::len).sum());
    for (block, sections) in index.blocks.iter_mut().zip(of_blocks) {
        block.lengths = sections.iter().map(|section| section.len() as u32).collect();
        blocks.extend(sections);
    }
    for (field, corrections) in exact {
        let head = [*field, u32::from(!corrections.is_single()), corrections.count()];
        blocks.push(Section::coded(Kind::EXACT, &head, &models, |out| corrections.put(out))?);
    }
    let mut payload = Vec::new();
    payload::write_info(&mut payload, mt.info(), metadata)?;
    let info = Section::new(Kind::INFO, payload)?;
    let mut payload = Vec::new();
    index.write(&mut payload, mt.info());
    let index = Section::new(Kind::INDX, payload)?;
    Ok([info, index].into_iter().chain(shared).chain(blocks).collect())
}

/// What is to be written of exact values: by field, ascending.
fn corrections(
    mt: &Mt,
    exact: &[Exact],
    reference: &[(u32, Vec<i32>)],
) -> Result<Vec<(u32, Corrections)>, EncodeError> {
    let mut all = Vec::new();
    for exact in exact {
        let of_level = |vertex: VertexId| {
            let place = reference.binary_search_by_key(&vertex.0, |(v, _)| *v).ok()?;
            let field = mt.info().fields.get(exact.field)?;
            Some(field.value(*reference[place].1.get(exact.field)?))
        };
        let corrections = Corrections::new(exact, of_level);
        all.push((exact.field as u32, corrections.ok_or(EncodeError::Exact { field: exact.field })?));
    }
    all.sort_by_key(|(field, _)| *field);
    Ok(all)
}

/// Puts what comes before the updates.
fn put_base(out: &mut impl Put, mt: &Mt) {
    payload::put_base(out, mt);
    (0..mt.info().fields.len()).for_each(|field| payload::put_base_field(out, mt, field));
}

/// Puts all that is coded of a file.
fn put_all(out: &mut impl Put, mt: &Mt) -> Result<(), EncodeError> {
    put_base(out, mt);
    let mut state = payload::start_state(mt).map_err(EncodeError::Base)?;
    let mut first = 0;
    while first < mt.updates() {
        let end = mt.updates().min(first + (1 << mt.page_bits()));
        if mt.info().kind.is_paged() {
            put_page(out, mt, &(first..end));
        } else {
            payload::put_updates(out, mt, first..end, state.as_mut()).map_err(EncodeError::Update)?;
        }
        first = end;
    }
    Ok(())
}

/// Puts a block of an MT whose blocks do not depend on each other.
fn put_page(out: &mut impl Put, mt: &Mt, updates: &Range<u32>) {
    payload::put_shared(out, mt, updates.clone());
    (0..mt.info().fields.len()).for_each(|field| payload::put_field(out, mt, updates.clone(), field));
}

/// So many blocks are counted together: each table of counts takes memory.
const COUNTED: usize = 16;

/// How often each symbol occurs in what [`put_all`] puts.
fn count_all(mt: &Mt) -> Result<Counts, EncodeError> {
    let block_bits = mt.page_bits();
    let mut all = Counts::default();
    if !mt.info().kind.is_paged() {
        put_all(&mut all, mt)?;
        return Ok(all);
    }
    put_base(&mut all, mt);
    let updates = mt.updates() as usize;
    let of_ranges = threads::map(updates.div_ceil(1 << block_bits), COUNTED, |blocks| {
        let mut counts = Counts::default();
        for block in blocks {
            let first = block << block_bits;
            put_page(&mut counts, mt, &(first as u32..updates.min(first + (1 << block_bits)) as u32));
        }
        counts
    });
    of_ranges.iter().for_each(|counts| all.add(counts));
    Ok(all)
}

/// How many bytes of the file of an MT code what: names and bytes. Only for MTs that came from a file; exact
/// values are not among them.
///
/// # Errors
/// If the MT is damaged.
pub fn breakdown(mt: &Mt) -> Result<Vec<(&'static str, f64)>, EncodeError> {
    let mut counts = Counts::default();
    put_all(&mut counts, mt)?;
    let models = Models::new(&counts);
    let mut measure = Measure::new(&models);
    put_all(&mut measure, mt)?;
    let mut parts: Vec<(&'static str, f64)> = Vec::new();
    for (name, family) in payload::parts(mt.info().kind) {
        let bytes = measure.bits_of(family) / 8.0;
        match parts.iter_mut().find(|(known, _)| *known == name) {
            Some((_, sum)) => *sum += bytes,
            None => parts.push((name, bytes)),
        }
    }
    let mut tables = Vec::new();
    models.write(&mut tables);
    parts.push(("tables", tables.len() as f64));
    Ok(parts)
}

/// The sections of each block.
fn put_blocks(mt: &Mt, index: &Index, models: &Models) -> Result<Vec<Vec<Section>>, EncodeError> {
    let kind = payload::section_of(mt.info().kind);
    if mt.info().kind.is_paged() {
        return threads::map(index.blocks.len(), 1, |block| {
            put_sections(mt, block.start as u32, index, models)
        })
        .into_iter()
        .collect();
    }
    let mut state = payload::start_state(mt).map_err(EncodeError::Base)?;
    let mut of_block = |block: u32| {
        let (updates, mut done) = (index.updates(block, mt.updates()), Ok(()));
        let section = Section::coded(kind, &[block], models, |out| {
            done = payload::put_updates(out, mt, updates, state.as_mut());
        });
        done.map_err(EncodeError::Update)?;
        Ok(vec![section?])
    };
    (0..index.blocks.len() as u32).map(&mut of_block).collect()
}

/// The sections of a block of an MT whose blocks do not depend on each other.
fn put_sections(mt: &Mt, block: u32, index: &Index, models: &Models) -> Result<Vec<Section>, EncodeError> {
    let updates = index.updates(block, mt.updates());
    let kind = payload::section_of(mt.info().kind);
    let shared = Section::coded(kind, &[block], models, |out| payload::put_shared(out, mt, updates.clone()));
    let of_field = |field: usize| {
        let put = |out: &mut Writer<'_>| payload::put_field(out, mt, updates.clone(), field);
        Section::coded(Kind::FLDU, &[block, field as u32], models, put)
    };
    std::iter::once(shared).chain((0..mt.info().fields.len()).map(of_field)).collect()
}

impl crate::Coded for EncodeError {
    fn code(&self) -> &'static str {
        if matches!(self, Self::TooLong { .. }) { "bad-option" } else { "internal" }
    }
}

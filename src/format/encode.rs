//! An MT to bytes: the same MT and options give the same bytes everywhere.
//!
//! Half-edge files have an index, and blocks that need no others: these are counted and written in parallel. Files of the other kinds are read
//! from front to back; each block says how large the errors behind it are. What the index says of a block comes from a run through the MT
//! (`block_scan`), or, of a half-edge MT that has just been made, from what its builder has noted (`mt::facts`): files are the same either way.

use super::block_scan::BlockScan;
use super::coder::{Counts, Measure, Models, Put, Writer};
use super::header::{END_BYTES, HEADER_BYTES, Kind, Start, header};
use super::payload::Totals;
use super::payload::codec::Codec;
use super::payload::exact::Corrections;
use super::payload::histogram::Histograms;
use super::payload::index::{BlockInfo, Index, MAX_BLOCK_BITS, MIN_BLOCK_BITS};
use super::section::{PutBytes, Section};
use super::{EncodeError, EncodeOptions, checksum, payload};
use crate::mt::{Exact, Mt, Regions, VertexId};
use std::io;

/// The bytes of an MT file, in blocks as large as [`Mt::in_pages`] has made them: those of a half-edge MT are its pages, and what a client
/// can fetch by itself.
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
    match mt {
        Mt::Edge(mt) => encode_kind(mt, options, writer),
        Mt::Vertex(mt) => encode_kind(mt, options, writer),
        Mt::HalfEdge(mt) => encode_kind(mt, options, writer),
    }
}

fn encode_kind<C: Codec>(
    mt: &C,
    options: &EncodeOptions,
    writer: &mut dyn io::Write,
) -> Result<u64, EncodeError> {
    if mt.present() != mt.info().updates {
        let (updates, expected) = (mt.present(), mt.info().updates);
        return Err(EncodeError::Incomplete { updates, expected });
    }
    check(mt)?;
    let scan = BlockScan::of(mt, options)?;
    let exact = corrections(mt, &options.exact, &scan.reference)?;
    let mut counts = mt.count_updates()?;
    exact.iter().for_each(|(_, corrections)| corrections.put(&mut counts));
    let models = models(counts, mt);
    let of_blocks = mt.sections(&models)?;
    let lengths = |sections: &Vec<Section>| sections.iter().map(|section| section.len() as u32).collect();
    let mut blocks = scan.blocks;
    blocks.iter_mut().zip(&of_blocks).for_each(|(block, sections)| block.lengths = lengths(sections));
    let mut file = File::begin(mt, &models, (options, scan.histograms.as_ref()), blocks)?;
    file.has_exact = !mt.info().kind.is_paged() && !exact.is_empty();
    let mut sections: Vec<Section> = of_blocks.into_iter().flatten().collect();
    for (field, corrections) in &exact {
        sections.push(exact_section(*field, corrections, &models)?);
    }
    file.behind = sections.iter().map(Section::sum).collect();
    file.write(mt, writer, &mut |put| sections.iter().try_for_each(|section| section.put(put)))
}

/// The section of some exact values of a field.
pub fn exact_section(field: u32, corrections: &Corrections, models: &Models) -> Result<Section, EncodeError> {
    let head = [field, u32::from(!corrections.is_single()), corrections.count()];
    Section::coded(Kind::EXACT, &head, models, |out| corrections.put(out))
}

/// All that a file has, but for its blocks and exact values themselves.
pub struct File {
    front: Vec<Section>,
    /// The bytes and the checksum of each section of these.
    pub behind: Vec<(u64, u32)>,
    index_pages: bool,
    has_exact: bool,
}

impl File {
    /// With what stands in front of the blocks, of which an index is made if the MT is to have one.
    pub fn begin<C: Codec>(
        mt: &C,
        models: &Models,
        (options, histograms): (&EncodeOptions, Option<&Histograms>),
        mut blocks: Vec<BlockInfo>,
    ) -> Result<Self, EncodeError> {
        let has_index = mt.info().kind.is_paged();
        blocks.iter_mut().filter(|_| has_index).for_each(|block| block.round());
        let mut index = Index::new(mt.page_bits(), blocks);
        if has_index {
            index = index.as_written(mt.info(), options.index_page_bits);
        }
        let shared = shared_sections(mt, models, histograms, &index)?;
        let mut payload = Vec::new();
        payload::write_info(&mut payload, mt.info(), &options.metadata)?;
        let mut front = vec![Section::new(Kind::INFO, payload)?];
        let mut pages = Vec::new();
        if index.is_paged() {
            let has_regions = mt.regions().is_some();
            for page in 0..index.pages().len() as u32 {
                let write = |out: &mut Vec<u8>| index.write_page(out, page, mt.info(), has_regions);
                pages.push(Section::written(Kind::IPAG, write)?);
            }
            index.set_sections(pages.iter().map(|page| page.len() as u32));
        }
        if has_index {
            index.shared = shared.iter().map(Section::len).sum();
            front.push(Section::written(Kind::INDX, |out| index.write(out, mt.info()))?);
        }
        front.extend(shared);
        front.extend(pages);
        let index_pages = index.is_paged();
        Ok(Self { front, behind: Vec::new(), index_pages, has_exact: false })
    }

    /// Writes it; `put_behind` puts all sections of the blocks and exact values. Returns the bytes of the file.
    pub fn write<C: Codec>(
        &self,
        mt: &C,
        writer: &mut dyn io::Write,
        put_behind: &mut dyn FnMut(PutBytes<'_>) -> Result<(), EncodeError>,
    ) -> Result<u64, EncodeError> {
        let mut total = HEADER_BYTES as u64 + END_BYTES as u64;
        let mut totals = Totals { updates: mt.updates(), sections: 0, crc: 0 };
        let mut chain = checksum::Hasher::new();
        for (len, crc) in self.front.iter().map(Section::sum).chain(self.behind.iter().copied()) {
            total += len;
            totals.sections += 1;
            chain.update(&crc.to_le_bytes());
        }
        totals.crc = chain.finalize();
        let end = Section::written(Kind::ENDF, |out| payload::write_end(out, totals))?;
        let put: PutBytes<'_> = &mut |bytes| writer.write_all(bytes).map_err(EncodeError::Write);
        put(&header(Start {
            total: Some(total),
            tet_errors: mt.has_tet_errors(),
            sides: mt.regions().is_some_and(Regions::has_sides),
            index_pages: self.index_pages,
            many_tets: payload::has_many_tets(mt.info()),
            exact: self.has_exact,
        }))?;
        self.front.iter().try_for_each(|section| section.put(put))?;
        put_behind(put)?;
        end.put(put)?;
        writer.flush().map_err(EncodeError::Write)?;
        Ok(total)
    }
}

/// The tables for an MT, given how often each symbol occurs in its updates.
pub fn models(mut counts: Counts, mt: &impl Codec) -> Models {
    put_base(&mut counts, mt);
    Models::new(&counts)
}

/// What a decoder would refuse must not be written.
pub fn check<C: Codec>(mt: &C) -> Result<(), EncodeError> {
    if !(MIN_BLOCK_BITS..=MAX_BLOCK_BITS).contains(&mt.page_bits()) {
        return Err(EncodeError::Blocks { bits: mt.page_bits() });
    }
    let info = mt.info();
    mt.base().check(info).map_err(EncodeError::Base)?;
    C::check_counts(info, mt.base().positions.len() as u64).map_err(EncodeError::Base)
}

/// What stands in front of the blocks, without the description and the index.
fn shared_sections<C: Codec>(
    mt: &C,
    models: &Models,
    histograms: Option<&Histograms>,
    index: &Index,
) -> Result<Vec<Section>, EncodeError> {
    let mut shared = Vec::new();
    if let Some(histograms) = histograms {
        shared.push(Section::written(Kind::HIST, |out| histograms.write(out))?);
    }
    if let Some(bounds) = mt.info().bounds {
        shared.push(Section::written(Kind::BOUNDS, |out| payload::bounds::write(out, bounds))?);
    }
    if payload::extremes::are_known(&mt.info().fields) {
        let mut payload = Vec::new();
        payload::extremes::write(&mut payload, &mt.info().fields)?;
        shared.push(Section::new(Kind::EXTREMES, payload)?);
    }
    if let Some(regions) = mt.regions() {
        let mut payload = Vec::new();
        payload::regions::write(&mut payload, regions, index)?;
        shared.push(Section::new(Kind::REGIONS, payload)?);
    }
    shared.push(Section::written(Kind::MODL, |out| models.write(out))?);
    let mut payload = Vec::new();
    payload::write_base_head(&mut payload, mt);
    let head = payload.len();
    let mut writer = Writer::new(models);
    payload::put_base(&mut writer, mt);
    writer.finish(&mut payload);
    let counts = [mt.base().positions.len() as u64, mt.base().tets.len() as u64];
    if !payload::is_backed(counts, payload.len() - head) {
        return Err(EncodeError::TooLong { what: "a base mesh that is coded in so few bytes" });
    }
    shared.push(Section::new(Kind::BASE, payload)?);
    for field in 0..mt.info().fields.len() {
        shared.push(Section::coded(Kind::FLDB, &[field as u32], models, |out| {
            payload::put_base_field(out, mt, field);
        })?);
    }
    Ok(shared)
}

/// What is to be written of exact values, for each section: by field, ascending.
fn corrections(
    mt: &impl Codec,
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
        let corrections =
            Corrections::new(exact, of_level).ok_or(EncodeError::Exact { field: exact.field })?;
        all.extend(corrections.in_sections().map(|some| (exact.field as u32, some)));
    }
    all.sort_by_key(|(field, _)| *field);
    Ok(all)
}

/// Puts what comes before the updates.
fn put_base(out: &mut impl Put, mt: &impl Codec) {
    payload::put_base(out, mt);
    (0..mt.info().fields.len()).for_each(|field| payload::put_base_field(out, mt, field));
}

/// How many bytes of the file of an MT code what: names and bytes. Only for MTs that came from a file; exact
/// values are not among them.
///
/// # Errors
/// If the MT is damaged.
pub fn breakdown(mt: &Mt) -> Result<Vec<(&'static str, f64)>, EncodeError> {
    match mt {
        Mt::Edge(mt) => breakdown_of(mt),
        Mt::Vertex(mt) => breakdown_of(mt),
        Mt::HalfEdge(mt) => breakdown_of(mt),
    }
}

fn breakdown_of<C: Codec>(mt: &C) -> Result<Vec<(&'static str, f64)>, EncodeError> {
    let mut counts = mt.count_updates()?;
    put_base(&mut counts, mt);
    let models = Models::new(&counts);
    let mut measure = Measure::new(&models);
    put_base(&mut measure, mt);
    mt.put_updates(&mut measure)?;
    let mut parts: Vec<(&'static str, f64)> = Vec::new();
    for (name, family) in payload::parts(C::PARTS) {
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

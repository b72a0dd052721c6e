//! The file of a half-edge MT that is written while it is made: the MT is never in memory as a whole.
//!
//! Symbols are coded by tables of how often they occur in the whole file, and the index in front of the blocks says how long each is. So
//! blocks are put aside when they are whole, coded by tables that know nothing; at the end each is coded again. Exact values, which are
//! behind the blocks, are not needed before that.
//!
//! ```text
//!     builder ──▶ block, whole ──▶ counts
//!                      │
//!                      ▼ even tables
//!                  put aside ─────┐ tables of the file
//!                                 ▼
//!                             put aside, its length ──▶ index, in front ──▶ the file
//! ```

use super::block_scan::{block_info, check_order, largest_errors};
use super::coder::{Counts, Models};
use super::encode::{File, check, exact_section, models};
use super::payload;
use super::payload::codec::Codec;
use super::payload::exact::Corrections;
use super::payload::half_edge::{recoded, sections_of};
use super::payload::histogram::Histograms;
use super::payload::index::BlockInfo;
use super::section::Section;
use super::{EncodeError, EncodeOptions};
use crate::mt::{ErrorCode, Exact, HalfEdgeBuilder, HalfEdgeMt, MultiTessellation, UpdatePages};
use crate::threads;
use std::io;

/// Where blocks are put aside, by their numbers.
#[doc(hidden)]
pub trait BlockShelf {
    /// Puts a block aside, in the place of what was put aside under its number.
    ///
    /// # Errors
    /// If that fails.
    fn put(&mut self, block: u32, bytes: &[u8]) -> io::Result<()>;

    /// What was put aside.
    ///
    /// # Errors
    /// If that fails.
    fn get(&self, block: u32) -> io::Result<Vec<u8>>;
}

/// Writes the file of an MT while it is made. The same bytes as [`encode_to`](super::encode_to) writes of the whole MT.
#[doc(hidden)]
pub struct BlockEncoder<'a> {
    shelf: &'a mut dyn BlockShelf,
    even: Models,
    counts: Counts,
    /// The largest errors of each block, field by field.
    errors: Vec<Vec<ErrorCode>>,
}

/// So many blocks are coded again at a time.
const AT_A_TIME: u32 = 64;

impl<'a> BlockEncoder<'a> {
    pub fn new(shelf: &'a mut dyn BlockShelf) -> Self {
        let even = Models::even(payload::parts(HalfEdgeMt::PARTS).into_iter().map(|(_, family)| family));
        Self { shelf, even, counts: Counts::default(), errors: Vec::new() }
    }

    /// Takes the blocks that are whole away from the MT, and puts them aside.
    ///
    /// # Errors
    /// If that fails.
    pub fn take_blocks(&mut self, builder: &mut HalfEdgeBuilder) -> Result<(), EncodeError> {
        builder.take_pages(false, &mut |mt, page| self.take(mt, page))
    }

    fn take(&mut self, mt: &HalfEdgeMt, block: u32) -> Result<(), EncodeError> {
        mt.put_block(&mut self.counts, mt.page_updates(block), &mut ()).map_err(EncodeError::Update)?;
        self.errors.push(largest_errors(mt, block));
        let bytes = joined(&sections_of(mt, block, &self.even)?);
        self.shelf.put(block, &bytes).map_err(EncodeError::Write)
    }

    /// Writes the file, once all updates have come. `exact` gives the exact values, and is called twice: tables of at most
    /// [`Exact::IN_A_SECTION`] vertices, fields and vertices ascending, instead of those of the options. Returns the MT without its updates, and the
    /// bytes of the file.
    ///
    /// # Errors
    /// As [`encode_to`](super::encode_to), if the builder has not all updates, and those of `exact`.
    pub fn finish<E: Iterator<Item = io::Result<Exact>>>(
        mut self,
        mut builder: HalfEdgeBuilder,
        exact: impl Fn() -> E,
        options: &EncodeOptions,
        writer: &mut dyn io::Write,
    ) -> Result<(HalfEdgeMt, u64), EncodeError> {
        builder.take_pages(true, &mut |mt, page| self.take(mt, page))?;
        let Self { shelf, even, mut counts, errors } = self;
        let (mt, facts, reaches) = builder.finish_without_reaches().map_err(EncodeError::Unmade)?;
        let (updates, expected) = (mt.updates(), mt.info().updates);
        if updates != expected {
            return Err(EncodeError::Incomplete { updates, expected });
        }
        check(&mt)?;
        check_order(&facts, options)?;
        for table in exact() {
            corrections(&mt, &table.map_err(EncodeError::Write)?)?.put(&mut counts);
        }
        let models = models(counts, &mt);
        let mut blocks: Vec<BlockInfo> = reaches
            .finish()
            .into_iter()
            .zip(errors)
            .map(|(extent, errors)| block_info(extent, errors))
            .collect();
        let all = blocks.len() as u32;
        let mut behind = Vec::new();
        for first in (0..all).step_by(AT_A_TIME as usize) {
            let some = first..all.min(first + AT_A_TIME);
            let aside: Vec<Vec<u8>> = some
                .clone()
                .map(|block| shelf.get(block))
                .collect::<Result<_, _>>()
                .map_err(EncodeError::Write)?;
            let sections = threads::map(aside.len(), 1, |range| {
                recoded(&aside[range.start], first + range.start as u32, &mt, [&even, &models])
            });
            for (block, sections) in some.zip(sections) {
                let sections = sections?;
                shelf.put(block, &joined(&sections)).map_err(EncodeError::Write)?;
                blocks[block as usize].lengths =
                    sections.iter().map(|section| section.len() as u32).collect();
                behind.extend(sections.iter().map(Section::sum));
            }
        }
        let mut aside = all;
        for table in exact() {
            let table = table.map_err(EncodeError::Write)?;
            let section = exact_section(table.field as u32, &corrections(&mt, &table)?, &models)?;
            shelf.put(aside, &joined(std::slice::from_ref(&section))).map_err(EncodeError::Write)?;
            behind.push(section.sum());
            aside += 1;
        }
        let histograms = options.histograms.then(|| Histograms::of(&facts.volumes));
        let mut file = File::begin(&mt, &models, (options, histograms.as_ref()), blocks)?;
        file.behind = behind;
        let bytes = file.write(&mt, writer, &mut |put| {
            (0..aside).try_for_each(|block| put(&shelf.get(block).map_err(EncodeError::Write)?))
        })?;
        Ok((mt, bytes))
    }
}

/// The corrections of exact values, whose levels are those that are nearest to them.
fn corrections(mt: &HalfEdgeMt, exact: &Exact) -> Result<Corrections, EncodeError> {
    let field = mt.info().fields.get(exact.field);
    let level = |vertex| {
        let (field, value) = (field?, exact.get(vertex)?);
        Some(field.value(field.nearest(value)))
    };
    Corrections::new(exact, level).ok_or(EncodeError::Exact { field: exact.field })
}

/// Sections as they are in a file.
fn joined(sections: &[Section]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for section in sections {
        bytes.extend_from_slice(&section.head.to_bytes());
        bytes.extend_from_slice(&section.payload);
    }
    bytes
}

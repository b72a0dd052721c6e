//! What the rest of the format knows of a kind of MT: each kind implements [`Codec`] in its own file.

use super::changes::{bound_of, upper_byte};
use crate::format::coder::{Counts, Family, Models, Put, Source};
use crate::format::error::Result;
use crate::format::header::Kind;
use crate::format::section::Section;
use crate::format::{EncodeError, Limits};
use crate::mt::{
    ApplyUpdates, BaseMesh, BaseMeshError, ErrorCode, Mt, MtFacts, MtInfo, MtKind, UpdateError, UpdateId,
};
use std::fmt::Debug;
use std::ops::Range;

/// Families of contexts, with names for what they code.
pub type Parts = &'static [(&'static str, Family)];

/// How files hold MTs of a kind.
pub trait Codec: ApplyUpdates + Sized {
    const KIND: MtKind;
    /// The number of the kind in `INFO`.
    const NUMBER: u8;
    /// The section that a block begins with.
    const SECTION: Kind;
    /// The families that this kind has besides those of all kinds.
    const PARTS: Parts;
    /// Whether updates may contain errors of the tetrahedra that they remove.
    const HAS_TET_ERRORS: bool = false;

    /// What a description and a base mesh of so many vertices must be like.
    fn check_counts(info: &MtInfo, base_vertices: u64) -> Result<(), BaseMeshError>;

    /// Bytes that an update takes in memory, at least.
    fn least_update_bytes(info: &MtInfo) -> u64;

    /// Puts what stands in `BASE` behind the base mesh.
    fn put_head(&self, out: &mut impl Put);

    /// Reads what [`Codec::put_head`] puts, of a base mesh with so many vertices and tetrahedra.
    fn read_head(
        source: &mut Source<'_>,
        info: &MtInfo,
        counts: [u32; 2],
        block_bits: u32,
        limits: &Limits,
    ) -> Result<Box<dyn Head>>;

    /// What a writer keeps from one block to the next.
    type Writing;

    /// What it keeps at the start.
    fn writing(&self) -> Result<Self::Writing, BaseMeshError>;

    /// Puts the updates of a block, which follow those that were put before.
    fn put_block(
        &self,
        out: &mut impl Put,
        updates: Range<u32>,
        writing: &mut Self::Writing,
    ) -> Result<(), UpdateError>;

    /// Puts all updates, block by block. Where blocks come in order, each says how large the errors behind it are.
    fn put_updates(&self, out: &mut impl Put) -> Result<(), EncodeError> {
        let mut writing = self.writing().map_err(EncodeError::Base)?;
        for (block, bounds) in (0..).zip(bounds_behind(self)) {
            bounds.into_iter().for_each(|bound| out.bits(u32::from(bound), 8));
            self.put_block(out, self.page_updates(block), &mut writing).map_err(EncodeError::Update)?;
        }
        Ok(())
    }

    /// How often each symbol occurs in what [`Codec::put_updates`] puts.
    fn count_updates(&self) -> Result<Counts, EncodeError> {
        let mut counts = Counts::default();
        self.put_updates(&mut counts)?;
        Ok(counts)
    }

    /// What is known from having applied all updates, if they were just made: it spares the encoder a run through them.
    fn known_facts(&self) -> Option<&MtFacts> {
        None
    }

    /// The sections of each block; one where blocks come in order.
    fn sections(&self, models: &Models) -> Result<Vec<Vec<Section>>, EncodeError> {
        let mut writing = self.writing().map_err(EncodeError::Base)?;
        let mut sections = Vec::new();
        for (block, bounds) in (0..).zip(bounds_behind(self)) {
            let mut done = Ok(());
            let section = Section::coded(Self::SECTION, &[block], models, |out| {
                bounds.into_iter().for_each(|bound| out.bits(u32::from(bound), 8));
                done = self.put_block(out, self.page_updates(block), &mut writing);
            });
            done.map_err(EncodeError::Update)?;
            sections.push(vec![section?]);
        }
        Ok(sections)
    }
}

/// What stands in `BASE` behind the base mesh, until the levels of that are here, too.
pub trait Head: Debug + Send + Sync {
    /// See [`Started`].
    fn start(
        self: Box<Self>,
        info: MtInfo,
        base: BaseMesh,
        block_bits: u32,
        tet_errors: bool,
    ) -> Result<Started>;
}

/// An MT without updates, and what reads these if they come in order.
pub type Started = (Mt, Option<Box<dyn InOrder>>);

/// What reads updates that come in order, block by block.
pub trait InOrder: Debug + Send + Sync {
    /// Reads the next `count` updates into the MT.
    fn read(&mut self, source: &mut Source<'_>, mt: &mut Mt, count: u32, limits: &Limits) -> Result<()>;
}

/// For each block and field what bounds the errors of the updates behind the block: see [`upper_byte`].
fn bounds_behind(mt: &impl Codec) -> Vec<Vec<u8>> {
    let mut bounds = Vec::new();
    let mut largest = vec![ErrorCode::ZERO; mt.info().fields.len()];
    for block in (0..mt.updates().div_ceil(1 << mt.page_bits())).rev() {
        bounds.push(largest.iter().copied().map(upper_byte).collect());
        for u in mt.page_updates(block).map(UpdateId) {
            largest.iter_mut().zip(mt.errors(u)).for_each(|(bound, &error)| *bound = (*bound).max(error));
        }
    }
    bounds.reverse();
    bounds
}

/// Reads what bounds the errors of the updates behind a block that is one of those in order.
pub fn read_bounds(source: &mut Source<'_>, fields: usize) -> Result<Vec<ErrorCode>> {
    (0..fields).map(|_| Ok(bound_of(source.bits(8)? as u8))).collect()
}

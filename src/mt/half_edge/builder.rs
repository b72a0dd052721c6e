//! Makes half-edge MTs: updates are appended coarse to fine to the mesh that those before make.
//!
//! They come in batches. While the updates of one are applied, the stars of the one before are coded, on the other threads where there
//! are some. Batches do not depend on how many there are.

use super::batch::Batch;
pub use super::batch::NextUpdate;
#[doc(hidden)]
pub use super::forest::Forest;
use super::refusal::{damaged, refused};
use super::removers::Remover;
use super::scratch::Scratch;
use super::store::{BaseMark, ForestChild, HalfEdgeMt};
use crate::mt::facts::{MtFacts, level_volumes};
use crate::mt::reaches::Reaches;
use crate::mt::{
    ApplyUpdates, BaseMesh, ConvertError, CurrentMesh, Margins, MtInfo, MultiTessellation, Regions,
    UpdateError,
};
use crate::threads;

/// Updates of a batch.
const BATCH: usize = 1024;

/// A half-edge MT that grows.
#[doc(hidden)]
pub struct HalfEdgeBuilder {
    mt: HalfEdgeMt,
    forest: Forest,
    names: Vec<u32>,
    margins: Margins,
    facts: MtFacts,
    reaches: Reaches,
    /// The mesh with all updates but those of the last batch.
    mesh: CurrentMesh,
    scratch: Box<Scratch>,
    /// How many updates have come.
    len: u32,
    /// The batch that grows, and the one before, whose stars are not coded yet.
    next: Batch,
    applied: Batch,
}

impl HalfEdgeBuilder {
    /// Without updates yet. `names` are numbers of the MT's vertices in another order, by which stars are sorted. Volumes, boxes
    /// and colours of `regions` are found at the end.
    ///
    /// # Errors
    /// If the base mesh is not usable.
    pub fn new(
        info: MtInfo,
        base: BaseMesh,
        marks: Vec<BaseMark>,
        (forest, names): (Forest, Vec<u32>),
        regions: Option<Regions>,
        page_bits: u32,
    ) -> Result<Self, ConvertError> {
        let vertices = 0..base.positions.len() as u32;
        let of_base: Vec<Vec<ForestChild>> = vertices.map(|v| forest.children(v).to_vec()).collect();
        let mut mt = HalfEdgeMt::new(info, base, marks, &of_base, page_bits).map_err(damaged)?;
        if let Some(regions) = regions {
            mt.set_regions(regions).map_err(damaged)?;
        }
        let mut mesh = mt.start().map_err(|error| ConvertError::Damaged(error.into()))?;
        mesh.make_room(mt.info());
        Ok(Self {
            margins: Margins::new(mt.info()),
            mt,
            forest,
            names,
            facts: MtFacts::default(),
            reaches: Reaches::default(),
            mesh,
            scratch: Box::default(),
            len: 0,
            next: Batch::default(),
            applied: Batch::default(),
        })
    }

    /// Adds an update. `star` has for each tetrahedron that it inserts, in the order of their faces opposite the new vertex by names, what
    /// removes it.
    ///
    /// # Errors
    /// If it, or one before, is no inverse half-edge collapse.
    pub fn push(
        &mut self,
        next: &NextUpdate<'_>,
        star: impl Iterator<Item = Remover>,
    ) -> Result<(), ConvertError> {
        let fields = self.mt.info().fields.len();
        let fits = |(_, levels): &(u16, &[i32])| levels.len() == fields;
        if next.levels.len() != fields || next.errors.len() != fields || !next.sides.iter().all(fits) {
            return Err(refused(self.len));
        }
        self.next.push(next, star);
        self.len += 1;
        if self.next.len() < BATCH { Ok(()) } else { self.turn() }
    }

    /// Applies the updates that have come, codes the stars of those before, and begins a new batch.
    fn turn(&mut self) -> Result<(), ConvertError> {
        let Self { mt, forest, names, margins, facts, reaches, mesh, scratch, next, applied, .. } = self;
        let (grown, whole, tree) = (&mut *next, &*mt, &*forest);
        let (done, coded) = threads::join(
            || grown.apply(whole, tree, names, mesh, scratch),
            || applied.code(whole, tree, margins),
        );
        applied.append(coded, mt, forest, (facts, reaches))?;
        if done.is_err() {
            // What comes before the fault may have one itself.
            next.append(next.code(mt, forest, margins), mt, forest, (facts, reaches))?;
        }
        std::mem::swap(next, applied);
        next.clear(self.len);
        done
    }

    /// The MT.
    ///
    /// # Errors
    /// As [`HalfEdgeBuilder::push`].
    pub fn finish(mut self) -> Result<HalfEdgeMt, ConvertError> {
        self.turn()?;
        self.turn()?;
        let Self { mut mt, mut facts, reaches, mesh, .. } = self;
        if mt.updates() == mt.info().updates {
            facts.reaches = reaches.of_pages(mt.pages.bits(), mt.info().fields.len());
            facts.volumes = level_volumes(mt.info(), &mesh);
            mt.measure_regions(&mesh).ok_or(damaged(UpdateError::Cavity { update: mt.updates() }))?;
            mt.set_facts(facts);
        }
        Ok(mt)
    }
}

//! Makes half-edge MTs: updates are appended coarse to fine to the mesh that those before make.
//!
//! They come in batches. While the updates of one are applied, the stars of the one before are coded, on the other threads where there
//! are some. Batches do not depend on how many there are.
//!
//! The mesh need not be there as a whole: updates may be applied to one [`Patch`] of it after the other, whose tetrahedra no update of another
//! patch removes. What is coded of an update depends on its star alone, which a patch holds whole. Updates of a patch may have numbers behind
//! those of the next patches: they wait until these have been appended.
//!
//! ```text
//!     numbers    0 ............. 60 ............ 100 ... 103 ... 105      patch a: 0 to 59, and 100 to 102
//!                |   patch a     |    patch b     |   a   |   b   |       patch b: 60 to 99, and 103 and 104
//! ```

pub use super::batch::NextUpdate;
use super::batch::{Batch, CodedBatch};
#[doc(hidden)]
pub use super::forest::Forest;
use super::refusal::{damaged, refused};
use super::removers::Remover;
use super::scratch::Scratch;
use super::store::{BaseMark, ForestChild, HalfEdgeMt};
use crate::mt::facts::{LevelVolumes, MtFacts};
use crate::mt::reaches::Reaches;
use crate::mt::regions::RegionSums;
use crate::mt::{
    ApplyUpdates, BaseMesh, BaseMeshError, ConvertError, CurrentMesh, Margins, MtInfo, MultiTessellation,
    Regions, UpdateError,
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
    volumes: LevelVolumes,
    regions: RegionSums,
    /// The mesh with all updates but those of the last batch, or a patch of it.
    mesh: CurrentMesh,
    in_patches: bool,
    scratch: Box<Scratch>,
    /// The number of the update that comes next.
    len: u32,
    /// The batch that grows, and the one before, whose stars are not coded yet.
    next: Batch,
    applied: Batch,
    /// Whether the updates of these are to wait, and those that do.
    are_later: bool,
    waiting: Vec<(Batch, CodedBatch)>,
}

/// Tetrahedra of the mesh that updates before have made: all that some of the next updates remove, and all around the vertices that these
/// insert.
#[doc(hidden)]
pub struct Patch {
    /// With numbers of its own.
    pub mesh: BaseMesh,
    /// The MT's number of each of its vertices.
    pub vertices: Vec<u32>,
    pub marks: Vec<BaseMark>,
    /// The region of each tetrahedron, if the MT has regions.
    pub regions: Vec<u16>,
    /// Where fields jump, the levels of its vertices in each region of the patch but the first there, as in [`BaseSides`](crate::mt::BaseSides).
    pub side_levels: Vec<i32>,
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
        let region_sums = RegionSums::new(regions.as_ref().map_or(0, |regions| regions.all.len()));
        if let Some(regions) = regions {
            mt.set_regions(regions).map_err(damaged)?;
        }
        let mut mesh = mt.start().map_err(unusable)?;
        mesh.make_room(mt.info());
        Ok(Self {
            margins: Margins::new(mt.info()),
            volumes: LevelVolumes::new(mt.info()),
            regions: region_sums,
            mt,
            forest,
            names,
            facts: MtFacts::default(),
            reaches: Reaches::default(),
            mesh,
            in_patches: false,
            scratch: Box::default(),
            len: 0,
            next: Batch::default(),
            applied: Batch::default(),
            are_later: false,
            waiting: Vec::new(),
        })
    }

    /// Goes on with the updates of a patch, without those that wait. The patch before must have been [ended](Self::end_patch).
    ///
    /// # Errors
    /// If the patch is not usable.
    pub fn start_patch(&mut self, patch: &Patch) -> Result<(), ConvertError> {
        self.flush()?;
        let mut mesh = CurrentMesh::new(self.mt.info(), &patch.mesh).map_err(unusable)?;
        mesh.name_vertices(&patch.vertices);
        let regions = self.mt.regions().map(|_| (&patch.regions[..], &patch.side_levels[..]));
        self.mesh = self.mt.marked(mesh, &patch.marks, regions);
        self.in_patches = true;
        self.begin(self.mt.updates(), false);
        Ok(())
    }

    /// The next updates of the patch are numbered from `first` on: they wait until all before have been appended.
    ///
    /// # Errors
    /// As [`HalfEdgeBuilder::push`].
    pub fn continue_later(&mut self, first: u32) -> Result<(), ConvertError> {
        self.flush()?;
        self.begin(first, true);
        Ok(())
    }

    /// Ends a patch, all of whose updates have come, those that wait, too. `is_reference`: what is left is a part of the reference mesh;
    /// all of these are to be told.
    ///
    /// # Errors
    /// As [`HalfEdgeBuilder::push`].
    pub fn end_patch(&mut self, is_reference: bool) -> Result<(), ConvertError> {
        self.flush()?;
        if is_reference {
            self.volumes.add(self.mt.info(), &self.mesh);
            self.regions.add(&self.mesh);
        } else {
            self.regions.add_touching(&self.mesh);
        }
        Ok(())
    }

    /// Appends the updates that wait.
    ///
    /// # Errors
    /// As [`HalfEdgeBuilder::push`].
    pub fn append_waiting(&mut self) -> Result<(), ConvertError> {
        self.flush()?;
        let Self { mt, forest, facts, reaches, waiting, .. } = self;
        waiting.drain(..).try_for_each(|(batch, coded)| batch.append(coded, mt, forest, (facts, reaches)))
    }

    /// Begins with new batches.
    fn begin(&mut self, first: u32, are_later: bool) {
        (self.len, self.are_later) = (first, are_later);
        self.next.clear(first);
        self.applied.clear(first);
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
        let Self { mt, forest, names, margins, facts, reaches, mesh, scratch, .. } = self;
        let Self { next, applied, are_later, waiting, .. } = self;
        let (grown, whole, tree, before) = (&mut *next, &*mt, &*forest, &waiting[..]);
        let (done, coded) = threads::join(
            || grown.apply(whole, tree, names, mesh, scratch),
            || applied.code(whole, tree, before, margins),
        );
        if !*are_later {
            applied.append(coded, mt, forest, (facts, reaches))?;
            if done.is_err() {
                // What comes before the fault may have one itself.
                next.append(next.code(mt, forest, waiting, margins), mt, forest, (facts, reaches))?;
            }
        } else if applied.len() > 0 {
            waiting.push((std::mem::take(applied), coded));
        }
        std::mem::swap(next, applied);
        next.clear(self.len);
        done
    }

    /// Applies, codes and appends all that has come.
    fn flush(&mut self) -> Result<(), ConvertError> {
        self.turn()?;
        self.turn()
    }

    /// The MT.
    ///
    /// # Errors
    /// As [`HalfEdgeBuilder::push`].
    pub fn finish(mut self) -> Result<HalfEdgeMt, ConvertError> {
        if self.in_patches {
            self.append_waiting()?;
        } else {
            self.end_patch(true)?;
        }
        let Self { mut mt, mut facts, reaches, volumes, regions, .. } = self;
        if mt.updates() == mt.info().updates {
            facts.reaches = reaches.of_pages(mt.pages.bits(), mt.info().fields.len());
            facts.volumes = volumes.finish();
            mt.state_regions(regions).ok_or(damaged(UpdateError::Cavity { update: mt.updates() }))?;
            mt.set_facts(facts);
        }
        Ok(mt)
    }
}

/// A mesh is not usable.
fn unusable(error: BaseMeshError) -> ConvertError {
    ConvertError::Damaged(error.into())
}

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
use super::batch::{Batch, Before, Chains, CodedBatch};
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
    ApplyUpdates, BaseMesh, BaseMeshError, ConvertError, CurrentMesh, ErrorCode, Margins, MtInfo,
    MultiTessellation, PagedArray, Regions, UpdateError, UpdatePages,
};
use crate::threads;
use std::ops::Range;

/// Updates of a batch.
const BATCH: usize = 1024;

/// A half-edge MT that grows.
#[doc(hidden)]
pub struct HalfEdgeBuilder {
    mt: HalfEdgeMt,
    forest: Forest,
    margins: Margins,
    facts: MtFacts,
    reaches: Reaches,
    volumes: LevelVolumes,
    regions: RegionSums,
    /// The mesh with all updates but those of the last batch, or a patch of it.
    mesh: CurrentMesh,
    /// The updates of the patch, if they come in patches.
    of_patch: Vec<Range<u32>>,
    /// Then, for each field, the errors of updates on which others may depend.
    errors: Vec<PagedArray<ErrorCode>>,
    chains: Chains,
    /// So many pages have been taken.
    taken: u32,
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
    /// Of these, and of those that the updates of the patch insert.
    pub forest: Forest,
    pub marks: Vec<BaseMark>,
    /// The region of each tetrahedron, if the MT has regions.
    pub regions: Vec<u16>,
    /// Where fields jump, the levels of its vertices in each region of the patch but the first there, as in [`BaseSides`](crate::mt::BaseSides).
    pub side_levels: Vec<i32>,
    /// How many vertices and tetrahedra it has with its updates.
    pub room: [usize; 2],
}

impl HalfEdgeBuilder {
    /// Without updates yet. Volumes, boxes and colours of `regions` are found at the end. If the updates do not come in patches, it is to
    /// [make room](Self::make_room) for the whole.
    ///
    /// # Errors
    /// If the base mesh is not usable.
    pub fn new(
        info: MtInfo,
        base: BaseMesh,
        marks: Vec<BaseMark>,
        forest: Forest,
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
        let mesh = mt.start().map_err(unusable)?;
        Ok(Self {
            margins: Margins::new(mt.info()),
            volumes: LevelVolumes::new(mt.info()),
            reaches: Reaches::new(mt.info(), mt.page_bits()),
            regions: region_sums,
            mt,
            forest,
            facts: MtFacts::default(),
            mesh,
            of_patch: Vec::new(),
            errors: Vec::new(),
            chains: Chains::new(),
            taken: 0,
            scratch: Box::default(),
            len: 0,
            next: Batch::default(),
            applied: Batch::default(),
            are_later: false,
            waiting: Vec::new(),
        })
    }

    /// Makes room for the mesh with all updates, if there is memory for it.
    pub fn make_room(&mut self) {
        self.mesh.make_room(self.mt.info());
    }

    /// Goes on with the updates of a patch, without those that wait. The patch before must have been [ended](Self::end_patch).
    ///
    /// # Errors
    /// If the patch is not usable.
    pub fn start_patch(&mut self, patch: Patch) -> Result<(), ConvertError> {
        self.flush()?;
        self.forest = patch.forest;
        let mut mesh = CurrentMesh::new(self.mt.info(), &patch.mesh).map_err(unusable)?;
        let [vertices, tets] = patch.room;
        mesh.make_room_for(vertices, tets);
        mesh.name_vertices(&patch.vertices);
        let regions = self.mt.regions().map(|_| (&patch.regions[..], &patch.side_levels[..]));
        self.mesh = self.mt.marked(mesh, &patch.marks, regions);
        self.of_patch.clear();
        self.errors.resize(self.mt.info().fields.len(), PagedArray::new(ErrorCode::ZERO));
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
        if let Some(last) = self.of_patch.last_mut() {
            last.end = self.len;
        }
        if is_reference {
            // No other patch has anything of these updates.
            for updates in &self.of_patch {
                self.errors.iter_mut().for_each(|errors| errors.forget(updates.clone()));
                self.chains.forget(updates.clone());
                self.margins.forget(updates.clone());
            }
            self.reaches.close_node(&self.of_patch);
            self.volumes.add(self.mt.info(), &self.mesh);
            self.regions.add(&self.mesh);
        } else {
            self.reaches.end_node();
            self.regions.add_touching(&self.mesh);
        }
        // What the next patch is made of comes before it is started: never are two there.
        self.mesh = self.mt.start().map_err(unusable)?;
        Ok(())
    }

    /// Appends the updates that wait.
    ///
    /// # Errors
    /// As [`HalfEdgeBuilder::push`].
    pub fn append_waiting(&mut self) -> Result<(), ConvertError> {
        self.flush()?;
        let Self { mt, errors, facts, waiting, .. } = self;
        waiting.drain(..).try_for_each(|(batch, coded)| {
            batch.note_errors(errors);
            batch.append(coded, mt, facts)
        })
    }

    /// Passes on the pages that are whole and have not been taken before; all that are left if `is_end`. They are not kept but for the last one.
    pub(crate) fn take_pages<E>(
        &mut self,
        is_end: bool,
        put: &mut dyn FnMut(&HalfEdgeMt, u32) -> Result<(), E>,
    ) -> Result<(), E> {
        let Self { mt, taken, .. } = self;
        // Without the last page the MT would not know how many updates it has.
        while mt.has_page(*taken + 1) || is_end && mt.has_page(*taken) {
            put(mt, *taken)?;
            if mt.has_page(*taken + 1) {
                mt.drop_page(*taken);
            }
            *taken += 1;
        }
        Ok(())
    }

    /// The length of the longest chain of updates.
    pub fn depth(&self) -> u32 {
        self.chains.longest
    }

    /// Begins with new batches.
    fn begin(&mut self, first: u32, are_later: bool) {
        if let Some(last) = self.of_patch.last_mut() {
            last.end = self.len;
        }
        self.of_patch.push(first..first);
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
        let Self { mt, forest, margins, facts, reaches, mesh, scratch, .. } = self;
        let Self { next, applied, are_later, waiting, errors, chains, .. } = self;
        let (grown, whole) = (&mut *next, &*mt);
        let before = Before { mt: whole, errors: &errors[..], waiting: &waiting[..] };
        let (done, coded) = threads::join(
            || grown.apply(whole, forest, mesh, scratch),
            || applied.code(before, forest, margins),
        );
        applied.note_reaches(&coded, mt, reaches, chains);
        if !*are_later {
            applied.append(coded, mt, facts)?;
            applied.note_errors(errors);
            if done.is_err() {
                // What comes before the fault may have one itself.
                let before = Before { mt: &*mt, errors: &errors[..], waiting: &waiting[..] };
                let coded = next.code(before, forest, margins);
                next.append(coded, mt, facts)?;
            }
        } else if applied.len() > 0 {
            let mut applied = std::mem::take(applied);
            applied.forget_stars();
            waiting.push((applied, coded));
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
    pub fn finish(self) -> Result<HalfEdgeMt, ConvertError> {
        let (mut mt, mut facts, reaches) = self.finish_without_reaches()?;
        if mt.updates() == mt.info().updates {
            facts.reaches = reaches.finish();
            mt.set_facts(facts);
        }
        Ok(mt)
    }

    /// The MT, and what is known of it but for what its pages reach.
    pub(crate) fn finish_without_reaches(mut self) -> Result<(HalfEdgeMt, MtFacts, Reaches), ConvertError> {
        if !self.errors.is_empty() {
            self.append_waiting()?;
        } else {
            self.end_patch(true)?;
        }
        let Self { mut mt, mut facts, reaches, volumes, regions, .. } = self;
        if mt.updates() == mt.info().updates {
            facts.volumes = volumes.finish();
            mt.state_regions(regions).ok_or(damaged(UpdateError::Cavity { update: mt.updates() }))?;
        }
        Ok((mt, facts, reaches))
    }
}

/// A mesh is not usable.
fn unusable(error: BaseMeshError) -> ConvertError {
    ConvertError::Damaged(error.into())
}

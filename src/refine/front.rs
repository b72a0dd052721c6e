//! The front: which updates are applied, and what is left to do for its goal.

use super::criterion::{Criterion, Verdict};
use super::ranked_queues::Ranked;
use super::request::Budget;
use super::timing_wheel::TimingWheels;
use crate::mesh::BitSet;
use crate::mt::{ApplyUpdates, BaseMeshError, CurrentMesh, ErrorCode, UpdateId};
use std::collections::BTreeSet;
use std::sync::Arc;

/// A consistent set of updates and its current mesh.
///
/// [`Front::request`] sets the request and [`Front::step`] refines towards it, at once or in steps; [`Front::satisfy`]
/// does both. The result is the same as from the base mesh, whatever was requested before. For small changes of the
/// request, the cost grows with the difference between the meshes, not with their size.
#[derive(Clone, Debug)]
pub struct Front {
    pub(super) mesh: CurrentMesh,
    pub(super) applied: BitSet,
    pub(super) applied_count: u32,
    /// Number of updates of the MT that have been registered.
    pub(super) known: u32,
    /// The least and the largest error of those that share [`CHUNK_WORDS`] words of `applied`: these allow whole chunks
    /// to be skipped.
    pub(super) chunks: Vec<[ErrorCode; 2]>,
    pub(super) goal: Option<Goal>,
    /// Whether `tets` and `leaves` cover the whole mesh.
    pub(super) tracked: bool,
    /// Tetrahedra that do not violate the criterion, with the end of their slack.
    pub(super) tets: TimingWheels,
    /// Applied updates without applied children, with the end of their slack; some may have children by now.
    pub(super) leaves: TimingWheels,
    /// Violations whose updates are still to be forced; the last one is next.
    pub(super) pending: Vec<Violation>,
    /// Awaited updates that have not arrived, each with a tetrahedron: the update removes it, or its remover depends on
    /// the update.
    pub(super) awaiting: BTreeSet<(u32, u32)>,
    pub(super) ranked: Ranked,
}

#[derive(Clone, Debug)]
pub(super) struct Goal {
    pub criterion: Arc<dyn Criterion>,
    pub budget: Budget,
    /// Whether the goal is reached, as far as the MT has arrived.
    pub reached: bool,
    /// The outcome, once it is reached.
    pub outcome: Outcome,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Violation {
    pub update: UpdateId,
    pub tet: u32,
    pub verdict: Verdict,
}

/// The goal that is worked on, with its inputs.
pub(super) struct Task<'a, M> {
    pub mt: &'a M,
    pub criterion: &'a dyn Criterion,
    pub budget: Budget,
    pub outcome: &'a mut Outcome,
}

/// The work towards a goal, and the quality of the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Updates applied on the way.
    pub refined: u64,
    /// Updates applied on the way only because another update depends on them.
    pub forced: u64,
    /// Updates undone on the way.
    pub coarsened: u64,
    /// Tetrahedra and updates evaluated on the way.
    pub judged: u64,
    /// Whether the goal is reached, as far as budget and data allow. The fields below are meaningful only then.
    pub done: bool,
    /// The largest error left in the selected part, of the field that each need measures; [`ErrorCode::MAX`] where the
    /// criterion does not measure it so.
    pub error: ErrorCode,
    /// The largest ratio of error to allowed error; not above 1 if the request is satisfied.
    pub excess: f64,
    /// Whether the mesh satisfies the request; false when the budget did not allow it, or data is missing.
    pub satisfied: bool,
    /// Whether data is missing: some tetrahedron may violate the request, and its remover has not arrived.
    pub missing: bool,
}

/// From a mesh of so many times what is wanted it is quicker to go back to the base mesh, and to refine from there,
/// than to undo one update after the other.
pub(super) const FAR: u32 = 3;

/// Words of the set of applied updates in a chunk.
pub(super) const CHUNK_WORDS: usize = 8;

/// Decides after each update whether [`Front::step`] continues, given the work so far.
pub type GoOn<'a> = &'a mut dyn FnMut(&Outcome) -> bool;

impl Front {
    /// The base mesh of `mt`: no update applied.
    ///
    /// # Errors
    /// If the base mesh is not valid, or does not fit its description.
    pub fn new(mt: &impl ApplyUpdates) -> Result<Self, BaseMeshError> {
        Ok(Self {
            mesh: mt.start()?,
            applied: BitSet::default(),
            applied_count: 0,
            known: 0,
            chunks: Vec::new(),
            goal: None,
            tracked: false,
            tets: TimingWheels::default(),
            leaves: TimingWheels::default(),
            pending: Vec::new(),
            awaiting: BTreeSet::new(),
            ranked: Ranked::default(),
        })
    }

    /// The current mesh; packed.
    pub fn mesh(&self) -> &CurrentMesh {
        &self.mesh
    }

    /// The current mesh, for taking its list of changes.
    pub(crate) fn mesh_mut(&mut self) -> &mut CurrentMesh {
        &mut self.mesh
    }

    /// Number of updates applied.
    pub fn applied_count(&self) -> u32 {
        self.applied_count
    }

    /// Whether update `u` is applied.
    #[inline]
    pub fn contains(&self, u: UpdateId) -> bool {
        self.applied.has(u.0)
    }

    /// Whether tetrahedron `t` is (still) in the mesh and update `u` removes it.
    pub(super) fn is_removed_by(&self, mt: &impl ApplyUpdates, t: u32, u: UpdateId) -> bool {
        self.mesh.tet(t).is_some() && mt.remover(&self.mesh, t) == Some(u)
    }

    /// Heap bytes in use by the queues and the set of applied updates, without reserved capacity. The mesh itself has
    /// [`CurrentMesh::bytes`].
    pub fn queue_bytes(&self) -> u64 {
        let own = size_of_val(self.applied.words())
            + size_of_val(&self.pending[..])
            + size_of_val(&self.chunks[..]);
        let awaiting = self.awaiting.len() * size_of::<(u32, u32)>();
        (own + awaiting) as u64 + self.tets.bytes() + self.leaves.bytes() + self.ranked.bytes()
    }

    pub(super) fn untrack(&mut self) {
        self.tracked = false;
        self.tets.clear();
        self.leaves.clear();
        self.pending.clear();
        self.awaiting.clear();
    }

    #[inline]
    pub(super) fn note(&mut self, u: UpdateId, applied: bool) {
        if applied {
            self.applied.insert(u.0);
            self.applied_count += 1;
        } else {
            self.applied.remove(u.0);
            self.applied_count -= 1;
        }
    }
}

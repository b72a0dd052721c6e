//! The front: which updates are applied, and how it moves when the request changes.

use super::converge::Way;
use super::ranked::Ranked;
use super::timing_wheel::TimingWheels;
use super::uniform::NeededUpdates;
use super::{ANY, Budget, COMPONENTS, Criterion, Verdict};
use crate::mesh::BitSet;
use crate::mt::{ApplyUpdates, BaseMeshError, CurrentMesh, ErrorCode, UpdateError, UpdateId};
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
    /// Those of them that were applied only because another update depends on them.
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

    /// Moves to the smallest consistent set that satisfies `criterion`; with a budget, to the one of the smallest excess that
    /// fits, but never below the base mesh.
    ///
    /// # Errors
    /// If the MT is damaged. The mesh is still valid, but does not satisfy the request.
    pub fn satisfy(
        &mut self,
        mt: &impl ApplyUpdates,
        criterion: &(impl Criterion + Clone),
        budget: Budget,
    ) -> Result<Outcome, UpdateError> {
        self.request(mt, Arc::new(criterion.clone()), budget);
        self.step(mt, &mut |_| true)
    }

    /// Sets the request. The mesh does not change before [`Front::step`].
    pub fn request(&mut self, mt: &impl ApplyUpdates, criterion: Arc<dyn Criterion>, budget: Budget) {
        let before = self.goal.take();
        let distance = before.as_ref().map_or(f64::INFINITY, |goal| criterion.distance(&*goal.criterion));
        match before {
            Some(goal) if distance == 0.0 && goal.budget == budget => self.goal = Some(goal),
            before => {
                let keeps = criterion.is_monotone() && !mt.has_tet_errors();
                let known = before.as_ref().filter(|_| keeps).map(|goal| &*goal.criterion);
                self.advance_tracking(distance, &*criterion, known);
                self.ranked.clear();
                let outcome = Outcome::default();
                self.goal = Some(Goal { criterion, budget, reached: false, outcome });
            }
        }
        self.sync(mt);
    }

    /// Makes verdicts due whose slack the movement of the criterion has used up; all of them, if `before` is no earlier
    /// criterion to move from.
    fn advance_tracking(&mut self, distance: f64, criterion: &dyn Criterion, before: Option<&dyn Criterion>) {
        // These verdicts were for the last goal.
        for violation in std::mem::take(&mut self.pending) {
            self.tets.open(violation.tet);
        }
        match before {
            Some(before) if self.tracked && distance.is_finite() => {
                for component in 0..COMPONENTS as u8 {
                    let moved = if component == ANY {
                        distance
                    } else {
                        criterion.component_distance(before, component).min(distance)
                    };
                    self.tets.advance(moved, component);
                    self.leaves.advance(moved, component);
                }
            }
            _ => self.untrack(),
        }
    }

    pub(super) fn untrack(&mut self) {
        self.tracked = false;
        self.tets.clear();
        self.leaves.clear();
        self.pending.clear();
        self.awaiting.clear();
    }

    /// Refines towards the request until it is reached or `go_on` returns false; that is called after every update
    /// together with those that it depends on. Does nothing without a request. The mesh is packed and within the budget
    /// afterwards.
    ///
    /// The result does not depend on the steps. The mesh is first refined, the coarsest parts before the others, and
    /// then coarsened; under a budget the other way round.
    ///
    /// # Errors
    /// As [`Front::satisfy`].
    pub fn step(&mut self, mt: &impl ApplyUpdates, go_on: GoOn<'_>) -> Result<Outcome, UpdateError> {
        self.sync(mt);
        let Some(mut goal) = self.goal.take() else { return Ok(Outcome::default()) };
        // The work of an earlier call is not counted again.
        let answer = Outcome { refined: 0, forced: 0, coarsened: 0, judged: 0, ..goal.outcome };
        goal.outcome = if goal.reached { answer } else { Outcome::default() };
        if !goal.reached {
            let moved = self.go(mt, &mut goal, go_on);
            self.pack();
            if let Err(error) = moved {
                // The state is unspecified after an error: everything is evaluated again for the next goal.
                self.untrack();
                self.ranked.clear();
                return Err(error);
            }
            if goal.reached {
                self.report(mt, &mut goal);
            }
        }
        let outcome = goal.outcome;
        self.goal = Some(goal);
        Ok(outcome)
    }

    /// Packs the mesh; the tetrahedra that move are evaluated again.
    fn pack(&mut self) {
        self.mesh.clear_touched();
        self.mesh.compact();
        self.ranked.note_moved(self.mesh.touched());
        self.open_touched();
    }

    /// Works on a goal, and sets whether it is reached.
    fn go(&mut self, mt: &impl ApplyUpdates, goal: &mut Goal, go_on: GoOn<'_>) -> Result<(), UpdateError> {
        let Goal { criterion, budget, outcome, .. } = goal;
        // If updates may make the mesh smaller, a budget may fit several thresholds with others between them: only a
        // start from the base mesh surely finds the first one.
        let is_monotone = criterion.is_monotone() && !mt.has_tet_errors();
        let restarts = !is_monotone || !budget.is_unlimited() && !mt.always_grows();
        let far = FAR as usize;
        let is_far = !budget.holds(self.mesh.vertex_count() / far, self.mesh.tet_count() / far);
        if (restarts && !self.tracked || is_far) && !self.ranked.is_running() {
            self.coarsen_all(mt, outcome)?;
        }
        // Without own errors of tetrahedra, the errors of updates decide.
        let uniform = criterion.uniform().filter(|_| budget.is_unlimited() && !mt.has_tet_errors());
        let mut task = Task { mt, criterion: &**criterion, budget: *budget, outcome };
        let done = match uniform {
            Some(tolerances) => {
                self.untrack();
                self.satisfy_uniform(mt, NeededUpdates::new(&tolerances), task.outcome, go_on)?
            }
            // Most budgets are for safety: while the mesh is below the budget, excesses need not be compared.
            None if budget.is_unlimited() || !restarts && self.ranked.has_room() => {
                match self.converge(&mut task, go_on)? {
                    Way::Done => true,
                    Way::Paused => false,
                    Way::Full => self.ranked_converge(&mut task, go_on)?,
                }
            }
            None => self.ranked_converge(&mut task, go_on)?,
        };
        goal.reached = done;
        Ok(())
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

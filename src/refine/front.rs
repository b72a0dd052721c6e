//! The front: which updates are applied, and how it moves when the request changes.

use super::converge::Way;
use super::ranked::Ranked;
use super::timing_wheel::TimingWheels;
use super::uniform::Wanted;
use super::{ANY, Budget, COMPONENTS, Criterion, Verdict};
use crate::mesh::BitSet;
use crate::mt::{ApplyUpdates, BaseMeshError, CurrentMesh, ErrorCode, UpdateError, UpdateId};
use std::collections::BTreeSet;
use std::sync::Arc;

/// A consistent set of updates and its current mesh.
///
/// [`Front::request`] tells it what is wanted and [`Front::step`] brings it there, all at once or little by little;
/// [`Front::satisfy`] does both. What comes out is the same as from the base mesh, whatever was asked for before. What it
/// costs grows with the difference between the meshes, not with their size, as long as the request changes by little.
#[derive(Clone, Debug)]
pub struct Front {
    pub(super) mesh: CurrentMesh,
    pub(super) applied: BitSet,
    pub(super) applied_count: u32,
    /// How many updates of the MT the mesh knows of.
    pub(super) known: u32,
    /// The least and the largest error of those that share [`CHUNK_WORDS`] words of `applied`: whole chunks are passed
    /// over by these.
    pub(super) chunks: Vec<[ErrorCode; 2]>,
    pub(super) goal: Option<Goal>,
    /// Whether `tets` and `leaves` account for the whole mesh.
    pub(super) tracked: bool,
    /// Tetrahedra that do not violate the criterion, by when they may.
    pub(super) tets: TimingWheels,
    /// Applied updates without applied children, by when nothing may ask for them any more; others that have got children
    /// since among them.
    pub(super) leaves: TimingWheels,
    /// Updates that tetrahedra ask for, the first one last, each with the tetrahedron and for how long that asks.
    pub(super) pending: Vec<Violation>,
    /// Updates that are not here but that something waits for, each with a tetrahedron: the update removes it, or what removes
    /// it depends on the update.
    pub(super) awaiting: BTreeSet<(u32, u32)>,
    pub(super) ranked: Ranked,
}

#[derive(Clone, Debug)]
pub(super) struct Goal {
    pub criterion: Arc<dyn Criterion>,
    pub budget: Budget,
    /// Whether the front is there, as far as the MT is known.
    pub reached: bool,
    /// The answer, once it is.
    pub outcome: Outcome,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Violation {
    pub update: UpdateId,
    pub tet: u32,
    pub verdict: Verdict,
}

/// A goal on the way to it.
pub(super) struct Task<'a, M> {
    pub mt: &'a M,
    pub criterion: &'a dyn Criterion,
    pub budget: Budget,
    pub outcome: &'a mut Outcome,
}

/// What has been done on the way to a goal, and how good the mesh is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Updates applied on the way.
    pub refined: u64,
    /// Those of them that nothing asked for when they were applied, but an update that depends on them.
    pub forced: u64,
    /// Updates undone on the way.
    pub coarsened: u64,
    /// Tetrahedra and updates that were judged on the way.
    pub judged: u64,
    /// Whether the front is where it was to go, as far as budget and data allow. The rest means something only then.
    pub done: bool,
    /// The largest error left in the selected part, of the field that each need measures; [`ErrorCode::MAX`] where the
    /// criterion does not measure it so.
    pub error: ErrorCode,
    /// How often the error exceeds what is wanted, at most; not above 1 if the request is satisfied.
    pub excess: f64,
    /// Whether the mesh is what was asked for; false when the budget did not allow it, or data is missing.
    pub satisfied: bool,
    /// Whether data is missing: some tetrahedron violates the request as far as is known, and what may remove it is not here.
    pub missing: bool,
}

/// Words of the set of applied updates whose errors are summed up.
pub(super) const CHUNK_WORDS: usize = 8;

/// A bound on what [`Front::step`] does: told of what has been done so far, says whether to go on.
pub type GoOn<'a> = &'a mut dyn FnMut(&Outcome) -> bool;

impl Front {
    /// The base mesh of `mt`: no update applied.
    ///
    /// # Errors
    /// If the base mesh is not a valid mesh, or does not fit its description.
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

    /// The current mesh, for what changes nothing but its records, like taking the list of changes.
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

    /// Heap bytes of the queues that say what has to be judged again, and of the set of applied updates: entries that are there,
    /// not what is reserved for more. The mesh itself has [`CurrentMesh::bytes`].
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
    /// If the MT turns out to be damaged. The mesh is then valid still, but no answer to the request.
    pub fn satisfy(
        &mut self,
        mt: &impl ApplyUpdates,
        criterion: &(impl Criterion + Clone),
        budget: Budget,
    ) -> Result<Outcome, UpdateError> {
        self.request(mt, Arc::new(criterion.clone()), budget);
        self.step(mt, &mut |_| true)
    }

    /// Tells what is wanted from now on. Nothing moves before [`Front::step`].
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

    /// The criterion has moved: verdicts whose slack is used up are void; all of them, if they were not for one from which
    /// the way leads on.
    fn advance_tracking(&mut self, distance: f64, criterion: &dyn Criterion, before: Option<&dyn Criterion>) {
        // Those judged for the last goal only.
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

    /// Goes on towards what [`Front::request`] was told, until it is reached or `go_on` says no; that is asked after every update
    /// with those that it depends on. Without a goal nothing happens. The mesh is packed and within the budget afterwards.
    ///
    /// What is reached does not depend on the steps. On the way there the mesh is refined first, the coarsest parts before
    /// the others, and coarsened then; under a budget the other way round.
    ///
    /// # Errors
    /// As [`Front::satisfy`].
    pub fn step(&mut self, mt: &impl ApplyUpdates, go_on: GoOn<'_>) -> Result<Outcome, UpdateError> {
        self.sync(mt);
        let Some(mut goal) = self.goal.take() else { return Ok(Outcome::default()) };
        // What was done for an earlier call does not count again.
        let answer = Outcome { refined: 0, forced: 0, coarsened: 0, judged: 0, ..goal.outcome };
        goal.outcome = if goal.reached { answer } else { Outcome::default() };
        if !goal.reached {
            let moved = self.go(mt, &mut goal, go_on);
            self.pack();
            if let Err(error) = moved {
                // The state is unspecified after an error: the next goal judges everything again.
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

    /// Fills the holes of the mesh; what moves is judged again where it is then.
    fn pack(&mut self) {
        self.mesh.clear_touched();
        self.mesh.compact();
        self.ranked.note_moved(self.mesh.touched());
        self.open_touched();
    }

    /// Whether the goal is reached is noted in it.
    fn go(&mut self, mt: &impl ApplyUpdates, goal: &mut Goal, go_on: GoOn<'_>) -> Result<(), UpdateError> {
        let Goal { criterion, budget, outcome, .. } = goal;
        // Where updates may make the mesh smaller, several thresholds fit a budget with larger ones between them: only
        // from the base mesh is the first one found for sure.
        let is_monotone = criterion.is_monotone() && !mt.has_tet_errors();
        let restarts = !is_monotone || !budget.is_unlimited() && !mt.always_grows();
        if restarts && !self.tracked && !self.ranked.is_running() {
            self.coarsen_all(mt, outcome)?;
        }
        // Errors of updates say what is wanted as long as tetrahedra have none of their own.
        let uniform = criterion.uniform().filter(|_| budget.is_unlimited() && !mt.has_tet_errors());
        let mut task = Task { mt, criterion: &**criterion, budget: *budget, outcome };
        let done = match uniform {
            Some(tolerances) => {
                self.untrack();
                self.satisfy_uniform(mt, Wanted::new(&tolerances), task.outcome, go_on)?
            }
            // Most budgets are there for safety: while they leave room, nothing needs to be compared.
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

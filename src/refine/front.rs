//! The front: which updates are applied, and how it moves when the request changes.

use super::ANY;
use super::Budget;
use super::Criterion;
use super::DIALS;
use super::TetLook;
use super::Tolerance;
use super::Verdict;
use super::ranked::Ranked;
use super::sweep::Window;
use super::sweep::window_size;
use super::watch::Waiting;
use crate::mt::Applied;
use crate::mt::ApplyUpdates;
use crate::mt::BaseMeshError;
use crate::mt::CurrentMesh;
use crate::mt::ErrorCode;
use crate::mt::MAX_QUARTERINGS;
use crate::mt::UpdateError;
use crate::mt::UpdateId;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;

/// A consistent set of updates and its current mesh.
///
/// [`Front::aim`] tells it what is wanted and [`Front::step`] brings it there, all at once or little by little;
/// [`Front::satisfy`] does both. What comes out is the same as from the base mesh, whatever was asked for before. What it
/// costs grows with the difference between the meshes, not with their size, as long as the request changes by little.
#[derive(Clone, Debug)]
pub struct Front {
    pub(super) mesh: CurrentMesh,
    applied: Vec<u64>,
    applied_count: u32,
    /// How many updates of the MT the mesh knows of.
    known: u32,
    /// The least and the largest error of those that share [`CHUNK_WORDS`] words of `applied`: whole chunks are passed
    /// over by these.
    chunks: Vec<[ErrorCode; 2]>,
    goal: Option<Goal>,
    /// Whether `tets` and `leaves` account for the whole mesh.
    watched: bool,
    /// Tetrahedra that do not violate the criterion, by when they may.
    pub(super) tets: Waiting,
    /// Applied updates without applied children, by when nothing may ask for them any more; others that have got children
    /// since among them.
    pub(super) leaves: Waiting,
    /// Updates that tetrahedra ask for, the first one last, each with the tetrahedron and for how long that asks.
    pending: Vec<Asked>,
    /// Updates that are not here but that something waits for, each with a tetrahedron: the update removes it, or what removes
    /// it depends on the update.
    pub(super) awaiting: BTreeSet<(u32, u32)>,
    pub(super) ranked: Ranked,
}

/// What came of the wish to apply an update with all that it depends on.
pub(super) enum Forced {
    /// It is applied.
    Applied,
    /// It depends on an update that is not here. These others have been applied on the way to it.
    Awaits(UpdateId, Vec<UpdateId>),
}

#[derive(Clone, Debug)]
struct Goal {
    criterion: Arc<dyn Criterion>,
    budget: Budget,
    /// Whether the front is there, as far as the MT is known.
    reached: bool,
    /// The answer, once it is.
    outcome: Outcome,
}

/// How far [`Front::converge`] has come.
enum Way {
    /// All the way.
    Done,
    /// It was told to stop.
    Paused,
    /// The budget is exceeded.
    Full,
}

#[derive(Clone, Copy, Debug)]
struct Asked {
    update: UpdateId,
    tet: u32,
    verdict: Verdict,
}

/// A tetrahedron that is to be judged, with what that takes.
struct Open<'a> {
    t: u32,
    tet: [u32; 4],
    update: UpdateId,
    errors: TetErrors<'a>,
    corners: [[i32; 3]; 4],
}

impl Open<'_> {
    fn look<'a>(&'a self, levels: &'a dyn Fn(usize) -> [i32; 4]) -> TetLook<'a> {
        let Self { corners, errors, update, .. } = self;
        TetLook { corners, levels, error: errors.largest, errors: &errors.by_field, update: *update }
    }
}

/// The errors of a tetrahedron.
pub(super) struct TetErrors<'a> {
    pub largest: ErrorCode,
    pub by_field: Cow<'a, [ErrorCode]>,
}

impl<'a> TetErrors<'a> {
    /// Those of a tetrahedron that update `u` removes, given its quarterings.
    #[inline]
    pub fn new(mt: &'a impl ApplyUpdates, u: UpdateId, quarterings: u8) -> Self {
        let (largest, errors, fall) = (mt.error(u), mt.errors(u), mt.own_fall(u));
        if quarterings == 0 && fall == 0 {
            return Self { largest, by_field: Cow::Borrowed(errors) };
        }
        let own: Vec<ErrorCode> = (0..errors.len()).map(|f| mt.own_error(u, f, quarterings)).collect();
        Self { largest: own.iter().copied().fold(ErrorCode::ZERO, ErrorCode::max), by_field: Cow::Owned(own) }
    }

    /// Those of tetrahedron `t` of the mesh, which update `u` removes.
    #[inline]
    pub fn of(mt: &'a impl ApplyUpdates, mesh: &CurrentMesh, t: u32, u: UpdateId) -> Self {
        Self::new(mt, u, mt.quarterings(mesh, t))
    }

    /// Those of a tetrahedron of which only this is known.
    pub fn bounded_by(errors: &'a [ErrorCode]) -> Self {
        let largest = errors.iter().copied().fold(ErrorCode::ZERO, ErrorCode::max);
        Self { largest, by_field: Cow::Borrowed(errors) }
    }
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

/// What violates a criterion.
struct Violations {
    /// The largest error that can be left where something is wanted.
    error: ErrorCode,
    /// The largest excess; 1 if nothing violates it.
    excess: f64,
    /// Whether what may remove one of the tetrahedra is not here.
    missing: bool,
}

/// Words of the set of applied updates whose errors are summed up.
const CHUNK_WORDS: usize = 8;

/// The updates that a sweep which undoes others leaves applied.
struct Staying<'a> {
    wanted: Wanted<'a>,
    /// Those on which such updates depend, as far as they were found; no bits where errors are monotone.
    others: Vec<u64>,
}

/// The updates that are asked for everywhere, by their errors alone.
#[derive(Clone, Copy)]
struct Wanted<'a> {
    tolerances: &'a [Tolerance],
    /// What all of them have a larger error than.
    least: ErrorCode,
    /// What has a larger error than this is wanted for sure.
    sure: ErrorCode,
}

impl<'a> Wanted<'a> {
    fn new(tolerances: &'a [Tolerance]) -> Self {
        let least = tolerances.iter().map(|t| t.error).min();
        // One field may have a small error where another has a large one.
        let sure = tolerances.iter().filter(|t| t.field.is_none()).map(|t| t.error).min();
        Self { tolerances, least: least.unwrap_or(ErrorCode::MAX), sure: sure.unwrap_or(ErrorCode::MAX) }
    }

    #[inline]
    fn has(&self, mt: &impl ApplyUpdates, u: UpdateId) -> bool {
        let error = mt.error(u);
        error > self.sure || error > self.least && self.has_of_field(mt, u)
    }

    fn has_of_field(&self, mt: &impl ApplyUpdates, u: UpdateId) -> bool {
        self.tolerances.iter().any(|t| t.field.is_some_and(|field| mt.error_of_field(u, field) > t.error))
    }
}

impl Staying<'_> {
    fn has(&self, mt: &impl ApplyUpdates, u: UpdateId) -> bool {
        let found = self.others.get(u.0 as usize / 64).is_some_and(|word| word >> (u.0 % 64) & 1 == 1);
        found || self.wanted.has(mt, u)
    }

    #[cold]
    fn add(&mut self, updates: &[UpdateId]) {
        for u in updates {
            let word = u.0 as usize / 64;
            if word >= self.others.len() {
                self.others.resize(word + 1, 0);
            }
            self.others[word] |= 1 << (u.0 % 64);
        }
    }
}

/// Tetrahedra that are judged together.
const AT_ONCE: usize = 64;

/// A violation that lasts so long need not be outdone by another one.
const LONG: f64 = 1.0 / 16.0;

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
            applied: Vec::new(),
            applied_count: 0,
            known: 0,
            chunks: Vec::new(),
            goal: None,
            watched: false,
            tets: Waiting::default(),
            leaves: Waiting::default(),
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
        self.applied.get(u.0 as usize / 64).is_some_and(|w| w >> (u.0 % 64) & 1 == 1)
    }

    /// Whether tetrahedron `t` is (still) in the mesh and update `u` removes it.
    pub(super) fn is_removed_by(&self, mt: &impl ApplyUpdates, t: u32, u: UpdateId) -> bool {
        self.mesh.tet(t).is_some() && mt.remover(&self.mesh, t) == Some(u)
    }

    /// Heap bytes of the queues that say what has to be judged again, and of the set of applied updates: entries that are there,
    /// not what is reserved for more. The mesh itself has [`CurrentMesh::bytes`].
    pub fn queue_bytes(&self) -> u64 {
        let own =
            size_of_val(&self.applied[..]) + size_of_val(&self.pending[..]) + size_of_val(&self.chunks[..]);
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
        self.aim(mt, Arc::new(criterion.clone()), budget);
        self.step(mt, &mut |_| true)
    }

    /// Tells what is wanted from now on. Nothing moves before [`Front::step`].
    pub fn aim(&mut self, mt: &impl ApplyUpdates, criterion: Arc<dyn Criterion>, budget: Budget) {
        let before = self.goal.take();
        let distance = before.as_ref().map_or(f64::INFINITY, |goal| criterion.distance(&*goal.criterion));
        match before {
            Some(goal) if distance == 0.0 && goal.budget == budget => self.goal = Some(goal),
            before => {
                let keeps = criterion.is_monotone() && !mt.has_tet_errors();
                let known = before.as_ref().filter(|_| keeps).map(|goal| &*goal.criterion);
                self.move_watch(distance, &*criterion, known);
                self.ranked.clear();
                let outcome = Outcome::default();
                self.goal = Some(Goal { criterion, budget, reached: false, outcome });
            }
        }
        self.learn(mt);
    }

    /// The criterion has moved: verdicts whose slack is used up are void; all of them, if they were not for one from which
    /// the way leads on.
    fn move_watch(&mut self, distance: f64, criterion: &dyn Criterion, before: Option<&dyn Criterion>) {
        // Those judged for the last goal only.
        for asked in std::mem::take(&mut self.pending) {
            self.tets.open(asked.tet);
        }
        match before {
            Some(before) if self.watched && distance.is_finite() => {
                for dial in 0..DIALS as u8 {
                    let moved =
                        if dial == ANY { distance } else { criterion.turned(before, dial).min(distance) };
                    self.tets.advance(moved, dial);
                    self.leaves.advance(moved, dial);
                }
            }
            _ => self.forget_watch(),
        }
    }

    pub(super) fn forget_watch(&mut self) {
        self.watched = false;
        self.tets.clear();
        self.leaves.clear();
        self.pending.clear();
        self.awaiting.clear();
    }

    /// Takes note of updates that have arrived.
    fn learn(&mut self, mt: &impl ApplyUpdates) {
        if mt.updates() <= self.known && !self.applied.is_empty() {
            return;
        }
        let arrived = self.known..mt.updates();
        self.known = arrived.end;
        self.applied.resize(self.known.div_ceil(64).max(1) as usize, 0);
        self.chunks.resize(self.applied.len().div_ceil(CHUNK_WORDS), [ErrorCode::MAX, ErrorCode::ZERO]);
        self.take_in(mt, arrived);
    }

    /// Tells the mesh of updates that have arrived. What they remove is judged again, and nothing else.
    fn take_in(&mut self, mt: &impl ApplyUpdates, updates: Range<u32>) {
        self.sum_up(mt, updates.clone());
        while let Some(&(u, t)) = self.awaiting.range((updates.start, 0)..(updates.end, 0)).next() {
            self.awaiting.remove(&(u, t));
            self.tets.open(t);
        }
        mt.page_inserted(&mut self.mesh, updates);
        self.open_touched();
        self.begin_again();
    }

    /// The goal is another one with what is here now.
    fn begin_again(&mut self) {
        self.ranked.clear();
        if let Some(goal) = &mut self.goal {
            goal.reached = false;
        }
    }

    /// Takes note that a page of updates has come to the MT, with all on which it depends. Updates that are not here are no
    /// updates: a mesh is what was asked for as far as those that are here go. Needs not be told of updates that came by
    /// `push`, behind all others.
    pub fn arrived(&mut self, mt: &impl ApplyUpdates, page: u32) {
        let (updates, known) = (mt.page_updates(page), self.known);
        self.learn(mt);
        if updates.start < known {
            self.mesh.forget_proven(updates.start);
            self.take_in(mt, updates);
        }
    }

    /// Gets ready for a page of updates to be taken from the MT, which has to follow at once. False if that must not be, since
    /// one of them is applied.
    pub fn leave(&mut self, mt: &impl ApplyUpdates, page: u32) -> bool {
        let updates = mt.page_updates(page);
        if updates.clone().any(|u| self.contains(UpdateId(u))) {
            return false;
        }
        mt.page_evicted(&mut self.mesh, updates.clone());
        self.leaves.forget(updates.clone());
        let (gone, kept) = std::mem::take(&mut self.pending)
            .into_iter()
            .partition(|asked: &Asked| updates.contains(&asked.update.0));
        self.pending = kept;
        self.awaiting.extend(Vec::into_iter(gone).map(|asked| (asked.update.0, asked.tet)));
        self.begin_again();
        true
    }

    /// Takes note of the errors of updates that have arrived.
    fn sum_up(&mut self, mt: &impl ApplyUpdates, updates: Range<u32>) {
        for u in updates {
            let chunk = u as usize / (64 * CHUNK_WORDS);
            if chunk >= self.chunks.len() {
                self.chunks.resize(chunk + 1, [ErrorCode::MAX, ErrorCode::ZERO]);
            }
            let (error, [least, largest]) = (mt.error(UpdateId(u)), self.chunks[chunk]);
            self.chunks[chunk] = [least.min(error), largest.max(error)];
        }
    }

    /// Goes on towards what [`Front::aim`] was told, until it is reached or `go_on` says no; that is asked after every update
    /// with those that it depends on. Without a goal nothing happens. The mesh is packed and within the budget afterwards.
    ///
    /// What is reached does not depend on the steps. On the way there the mesh is refined first, the coarsest parts before
    /// the others, and coarsened then; under a budget the other way round.
    ///
    /// # Errors
    /// As [`Front::satisfy`].
    pub fn step(&mut self, mt: &impl ApplyUpdates, go_on: GoOn<'_>) -> Result<Outcome, UpdateError> {
        self.learn(mt);
        let Some(mut goal) = self.goal.take() else { return Ok(Outcome::default()) };
        // What was done for an earlier call does not count again.
        let answer = Outcome { refined: 0, forced: 0, coarsened: 0, judged: 0, ..goal.outcome };
        goal.outcome = if goal.reached { answer } else { Outcome::default() };
        if !goal.reached {
            let moved = self.go(mt, &mut goal, go_on);
            self.pack();
            if let Err(error) = moved {
                // Where this leaves the front nobody knows: the next goal starts from a look at everything.
                self.forget_watch();
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
        if restarts && !self.watched && !self.ranked.is_running() {
            self.coarsen_all(mt, outcome)?;
        }
        // Errors of updates say what is wanted as long as tetrahedra have none of their own.
        let uniform = criterion.uniform().filter(|_| budget.is_unlimited() && !mt.has_tet_errors());
        let done = match uniform {
            Some(tolerances) => {
                self.forget_watch();
                self.satisfy_uniform(mt, Wanted::new(&tolerances), outcome, go_on)?
            }
            // Most budgets are there for safety: while they leave room, nothing needs to be compared.
            None if budget.is_unlimited() || !restarts && self.ranked.has_room() => {
                match self.converge(mt, &**criterion, *budget, outcome, go_on)? {
                    Way::Done => true,
                    Way::Paused => false,
                    Way::Full => self.ranked_converge(mt, &**criterion, *budget, outcome, go_on)?,
                }
            }
            None => self.ranked_converge(mt, &**criterion, *budget, outcome, go_on)?,
        };
        goal.reached = done;
        Ok(())
    }

    /// Back to the base mesh.
    fn coarsen_all(&mut self, mt: &impl ApplyUpdates, outcome: &mut Outcome) -> Result<(), UpdateError> {
        self.forget_watch();
        self.sweep(mt, Wanted::new(&[]), false, outcome, &mut |_| true).map(drop)
    }

    /// Undoes all updates within the tolerances and applies the others. Which these are, errors tell without a look at the
    /// mesh; they are monotone along the partial order, so no update is in the way of what is undone.
    fn satisfy_uniform(
        &mut self,
        mt: &impl ApplyUpdates,
        wanted: Wanted<'_>,
        outcome: &mut Outcome,
        go_on: GoOn<'_>,
    ) -> Result<bool, UpdateError> {
        Ok(self.sweep(mt, wanted, false, outcome, go_on)? && self.sweep(mt, wanted, true, outcome, go_on)?)
    }

    /// Applies all updates that are wanted, or undoes all others: windows by number, in each by place. What is in the way of
    /// one is done before it. False if it was told to stop.
    fn sweep(
        &mut self,
        mt: &impl ApplyUpdates,
        wanted: Wanted<'_>,
        applied: bool,
        outcome: &mut Outcome,
        go_on: GoOn<'_>,
    ) -> Result<bool, UpdateError> {
        let mut window = Window::default();
        let mut staying = Staying { wanted, others: Vec::new() };
        let words = self.applied.len();
        let mut done = 0;
        while done < words {
            window.updates.clear();
            let size = window_size(self.applied_count);
            while done < words && window.updates.len() < size {
                let word = if applied { done } else { words - 1 - done };
                self.push_unlike(mt, wanted, word, applied, &mut window.updates);
                done += 1;
            }
            window.sort(mt, &self.mesh);
            for &u in &window.updates {
                self.turn(mt, u, applied, &mut staying, outcome)?;
                if !go_on(outcome) {
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }

    /// Appends the updates of a word that a sweep has to apply, by rising number, or to undo, by falling number.
    fn push_unlike(
        &self,
        mt: &impl ApplyUpdates,
        wanted: Wanted<'_>,
        word: usize,
        applied: bool,
        updates: &mut Vec<UpdateId>,
    ) {
        let [least, largest] = self.chunks[word / CHUNK_WORDS];
        let mut rest = if applied { !self.applied[word] } else { self.applied[word] };
        if rest == 0 || (if applied { largest <= wanted.least } else { least > wanted.sure }) {
            return;
        }
        while rest != 0 {
            let bit = if applied { rest.trailing_zeros() } else { 63 - rest.leading_zeros() };
            rest &= !(1 << bit);
            let u = UpdateId(64 * word as u32 + bit);
            if u.0 < self.known && wanted.has(mt, u) == applied {
                updates.push(u);
            }
        }
    }

    /// Applies or undoes `u` and before it what is in the way. What has to stay for the sake of another update does so,
    /// which happens where errors grow along the partial order.
    fn turn(
        &mut self,
        mt: &impl ApplyUpdates,
        u: UpdateId,
        applied: bool,
        staying: &mut Staying<'_>,
        outcome: &mut Outcome,
    ) -> Result<(), UpdateError> {
        let mut next = Some(u).filter(|&u| self.contains(u) != applied);
        let mut waiting = Vec::new();
        while let Some(u) = next {
            let turned =
                if applied { mt.refine_marked(&mut self.mesh, u) } else { mt.coarsen(&mut self.mesh, u) };
            // What depends on an update that is not here is as if it were not here itself.
            let is_cut_off = match &turned {
                Ok(Applied::Blocked(other)) => applied && *other < u && !mt.has(*other),
                Err(UpdateError::Missing { .. }) => applied && mt.present() < mt.info().updates,
                _ => false,
            };
            if is_cut_off {
                return Ok(());
            }
            next = match turned? {
                Applied::Done => {
                    self.note(u, applied);
                    *(if applied { &mut outcome.refined } else { &mut outcome.coarsened }) += 1;
                    self.mesh.clear_touched();
                    waiting.pop()
                }
                // Numbers fall from child to parent, so this ends.
                Applied::Blocked(other)
                    if other != u && (other < u) == applied && self.contains(other) != applied =>
                {
                    waiting.push(u);
                    if !applied && staying.has(mt, other) {
                        staying.add(&waiting);
                        return Ok(());
                    }
                    Some(other)
                }
                Applied::Blocked(_) => return Err(UpdateError::Error { update: u.0 }),
            };
        }
        Ok(())
    }

    /// Refines until no tetrahedron violates the criterion, and undoes what nothing asks for: afterwards, or first if there is a
    /// budget. Then what is left is asked for, and the mesh only grows to what it is in the end.
    fn converge(
        &mut self,
        mt: &impl ApplyUpdates,
        criterion: &dyn Criterion,
        budget: Budget,
        outcome: &mut Outcome,
        go_on: GoOn<'_>,
    ) -> Result<Way, UpdateError> {
        self.watch_all(mt);
        if !budget.is_unlimited() {
            while let Some(u) = self.leaves.next().map(UpdateId) {
                self.coarsen_unless_needed(mt, criterion, u, outcome)?;
            }
            if !budget.holds(self.mesh.vertex_count(), self.mesh.tet_count()) {
                return Ok(Way::Full);
            }
        }
        loop {
            while let Some(asked) = self.next_asked(mt, criterion, outcome) {
                if self.contains(asked.update) {
                    continue;
                }
                // Between two steps holes are filled, and what was asked by then has moved.
                if self.is_removed_by(mt, asked.tet, asked.update) {
                    mt.start_at(&mut self.mesh, asked.tet);
                }
                match self.force(mt, asked.update, outcome)? {
                    // It is a leaf now; those that it forced are none.
                    Forced::Applied => {
                        self.leaves.defer(asked.update.0, asked.verdict.slack, asked.verdict.dial);
                    }
                    // Nothing may ask for what was forced in vain.
                    Forced::Awaits(absent, forced) => {
                        forced.iter().for_each(|u| self.leaves.open(u.0));
                        self.awaiting.insert((absent.0, asked.tet));
                    }
                }
                self.open_touched();
                if !budget.holds(self.mesh.vertex_count(), self.mesh.tet_count()) {
                    return Ok(Way::Full);
                }
                if !go_on(outcome) {
                    return Ok(Way::Paused);
                }
            }
            let Some(u) = self.leaves.next().map(UpdateId) else { return Ok(Way::Done) };
            if self.coarsen_unless_needed(mt, criterion, u, outcome)? && !go_on(outcome) {
                return Ok(Way::Paused);
            }
        }
    }

    /// Makes sure that everything is either judged or going to be.
    fn watch_all(&mut self, mt: &impl ApplyUpdates) {
        if self.watched {
            return;
        }
        self.forget_watch();
        for t in 0..self.mesh.tet_slots() as u32 {
            self.tets.open(t);
        }
        for u in (0..self.known).map(UpdateId) {
            if self.contains(u) && mt.may_coarsen(&self.mesh, u) {
                self.leaves.open(u.0);
            }
        }
        self.watched = true;
    }

    /// The next update that a tetrahedron asks for. All open tetrahedra are judged before the first one is forced, so that
    /// those which several updates change are judged once.
    fn next_asked(
        &mut self,
        mt: &impl ApplyUpdates,
        criterion: &dyn Criterion,
        outcome: &mut Outcome,
    ) -> Option<Asked> {
        if self.pending.is_empty() && !self.tets.is_settled() {
            if criterion.is_batched() {
                self.judge_batch(mt, criterion, outcome);
            } else {
                self.tets.sort();
                self.judge_open(mt, criterion, outcome);
            }
            // Parents have smaller numbers: in this order few updates are forced by others that wait too.
            self.pending.sort_unstable_by_key(|asked| std::cmp::Reverse(asked.update));
        }
        self.pending.pop()
    }

    /// Judges all open tetrahedra, some at a time: what they need is fetched from all over the memory for all of them before
    /// the first is judged.
    fn judge_open(&mut self, mt: &impl ApplyUpdates, criterion: &dyn Criterion, outcome: &mut Outcome) {
        let mut fetched = Vec::with_capacity(AT_ONCE);
        while !self.tets.is_settled() {
            self.fetch_open(mt, AT_ONCE, &mut fetched, outcome);
            for open in &fetched {
                let levels = |field: usize| open.tet.map(|v| self.mesh.levels(v)[field]);
                let verdict = criterion.judge(&open.look(&levels));
                self.take_verdict(open.t, open.update, verdict);
            }
        }
    }

    /// Takes at most so many open tetrahedra to be judged, in place of those in `fetched`.
    fn fetch_open<'a>(
        &mut self,
        mt: &'a impl ApplyUpdates,
        most: usize,
        fetched: &mut Vec<Open<'a>>,
        outcome: &mut Outcome,
    ) {
        fetched.clear();
        while fetched.len() < most {
            let Some(t) = self.tets.next() else { break };
            let Some(tet) = self.mesh.tet(t) else { continue };
            // If its update is not here, it is judged when that arrives.
            let Some(update) = mt.remover(&self.mesh, t) else {
                let awaited = mt.awaited(&self.mesh, t);
                self.awaiting.extend(awaited.map(|u| (u.0, t)));
                continue;
            };
            let corners = tet.map(|v| self.mesh.positions[v as usize]);
            let errors = TetErrors::of(mt, &self.mesh, t, update);
            fetched.push(Open { t, tet, update, errors, corners });
        }
        outcome.judged += fetched.len() as u64;
    }

    fn take_verdict(&mut self, tet: u32, update: UpdateId, verdict: Verdict) {
        if verdict.asks() {
            self.pending.push(Asked { update, tet, verdict });
        } else {
            self.tets.defer(tet, verdict.slack, verdict.dial);
        }
    }

    /// Judges all open tetrahedra at once.
    fn judge_batch(&mut self, mt: &impl ApplyUpdates, criterion: &dyn Criterion, outcome: &mut Outcome) {
        let mut fetched = Vec::new();
        self.fetch_open(mt, usize::MAX, &mut fetched, outcome);
        let mesh = &self.mesh;
        let levels: Vec<_> =
            fetched.iter().map(|open| move |f: usize| open.tet.map(|v| mesh.levels(v)[f])).collect();
        let looks: Vec<TetLook<'_>> =
            fetched.iter().zip(&levels).map(|(open, levels)| open.look(levels)).collect();
        let verdicts = criterion.judge_all(&looks);
        for (open, verdict) in fetched.iter().zip(verdicts) {
            self.take_verdict(open.t, open.update, verdict);
        }
    }

    /// Undoes an update that nothing asks for and none depends on; tells whether it did.
    fn coarsen_unless_needed(
        &mut self,
        mt: &impl ApplyUpdates,
        criterion: &dyn Criterion,
        u: UpdateId,
        outcome: &mut Outcome,
    ) -> Result<bool, UpdateError> {
        if !self.contains(u) || !mt.may_coarsen(&self.mesh, u) {
            return Ok(false);
        }
        outcome.judged += 1;
        match self.need(mt, criterion, u, false)? {
            // It is looked at again when the child that is in the way is undone.
            None => Ok(false),
            Some(verdict) if verdict.asks() => {
                self.leaves.defer(u.0, verdict.slack, verdict.dial);
                Ok(false)
            }
            Some(verdict) => {
                self.coarsen(mt, u, outcome)?;
                self.open_parents(mt);
                // What has come back has just been judged.
                for i in 0..self.mesh.touched().len() {
                    let t = self.mesh.touched()[i];
                    if self.mesh.tet(t).is_some() {
                        self.tets.defer(t, verdict.slack, verdict.dial);
                    }
                }
                self.mesh.clear_touched();
                Ok(true)
            }
        }
    }

    /// The updates that created the tetrahedra which have come back may have no children any more.
    fn open_parents(&mut self, mt: &impl ApplyUpdates) {
        let Self { mesh, leaves, .. } = self;
        creators_of_touched(mesh, mt).for_each(|parent| leaves.open(parent.0));
    }

    fn open_touched(&mut self) {
        if self.watched {
            for i in 0..self.mesh.touched().len() {
                self.tets.open(self.mesh.touched()[i]);
            }
        }
        self.mesh.clear_touched();
    }

    /// What the criterion says of the tetrahedra that an applied update removed, taken together: it is there for its own
    /// sake if one of them asks for it. None if a child is in the way.
    pub(super) fn need(
        &mut self,
        mt: &impl ApplyUpdates,
        criterion: &dyn Criterion,
        u: UpdateId,
        ranked: bool,
    ) -> Result<Option<Verdict>, UpdateError> {
        // With every number of quarterings.
        let all_errors = [0, 1, 2, MAX_QUARTERINGS]
            .map(|own| if own == 0 || mt.has_tet_errors() { Some(TetErrors::new(mt, u, own)) } else { None });
        let mut all = Verdict::NEVER;
        let mut look = |corners: &[[i32; 3]; 4], levels: &dyn Fn(usize) -> [i32; 4], own: u8| {
            let of_own = all_errors.get(usize::from(own)).and_then(Option::as_ref).or(all_errors[0].as_ref());
            let Some(TetErrors { largest, by_field }) = of_own else { return false };
            let look = TetLook { corners, levels, error: *largest, errors: by_field, update: u };
            let one = if ranked { criterion.rank(&look) } else { criterion.judge(&look) };
            all = all.or(one);
            !ranked && one.asks() && one.slack > LONG
        };
        let looked = mt.look_at_removed(&mut self.mesh, u, &mut look)?;
        Ok((looked == Applied::Done).then_some(all))
    }

    /// Applies `u` and all that it depends on, unless something of that is not here.
    pub(super) fn force(
        &mut self,
        mt: &impl ApplyUpdates,
        u: UpdateId,
        outcome: &mut Outcome,
    ) -> Result<Forced, UpdateError> {
        let mut stack = vec![u];
        let mut forced = Vec::new();
        while let Some(&top) = stack.last() {
            match mt.refine_marked(&mut self.mesh, top)? {
                Applied::Done => {
                    self.note(top, true);
                    self.ranked.note_applied(top);
                    outcome.refined += 1;
                    stack.pop();
                    outcome.forced += u64::from(!stack.is_empty());
                    forced.push(top);
                }
                // Numbers fall from child to parent, so this ends.
                Applied::Blocked(parent) if parent < top && mt.has(parent) => stack.push(parent),
                Applied::Blocked(parent) if parent < top => return Ok(Forced::Awaits(parent, forced)),
                Applied::Blocked(_) => return Err(UpdateError::Error { update: top.0 }),
            }
        }
        Ok(Forced::Applied)
    }

    /// Undoes `u`, none of whose children is applied.
    #[inline]
    pub(super) fn coarsen(
        &mut self,
        mt: &impl ApplyUpdates,
        u: UpdateId,
        outcome: &mut Outcome,
    ) -> Result<(), UpdateError> {
        match mt.coarsen(&mut self.mesh, u)? {
            Applied::Done => self.note(u, false),
            Applied::Blocked(_) => return Err(UpdateError::Error { update: u.0 }),
        }
        outcome.coarsened += 1;
        Ok(())
    }

    #[inline]
    fn note(&mut self, u: UpdateId, applied: bool) {
        let (word, bit) = (u.0 as usize / 64, 1 << (u.0 % 64));
        if applied {
            self.applied[word] |= bit;
            self.applied_count += 1;
        } else {
            self.applied[word] &= !bit;
            self.applied_count -= 1;
        }
    }

    /// Works out how good the mesh is, which is packed.
    fn report(&self, mt: &impl ApplyUpdates, goal: &mut Goal) {
        let complete = mt.present() >= mt.info().updates;
        let satisfied = goal.budget.is_unlimited() || self.ranked.has_room();
        let criterion = &*goal.criterion;
        let Violations { error, excess, missing } = if complete && satisfied {
            Violations { error: self.within(mt, criterion), excess: 1.0, missing: false }
        } else {
            self.violations(mt, criterion)
        };
        let satisfied = excess <= 1.0;
        let error = if satisfied { error.max(ErrorCode::ZERO).min(criterion.tolerance()) } else { error };
        goal.outcome = Outcome { done: true, error, excess, satisfied, missing, ..goal.outcome };
    }

    /// No update that is not applied, here or not, has a larger error in this field, or in all of them if it is none. What
    /// is at least `enough` is as good as any.
    pub fn largest_left(&self, mt: &impl ApplyUpdates, field: Option<usize>, enough: ErrorCode) -> ErrorCode {
        let error = |u: UpdateId| field.map_or_else(|| mt.error(u), |field| mt.error_of_field(u, field));
        let mut found = mt.to_come();
        for (chunk, words) in self.applied.chunks(CHUNK_WORDS).enumerate() {
            if found >= enough {
                break;
            }
            if self.chunks[chunk][1] <= found {
                continue;
            }
            for (i, &word) in words.iter().enumerate() {
                let first = 64 * (chunk * CHUNK_WORDS + i) as u32;
                let left = (0..64).filter(|bit| word >> bit & 1 == 0).map(|bit| UpdateId(first + bit));
                found = left.filter(|u| u.0 < self.known).map(error).fold(found, ErrorCode::max);
            }
        }
        found
    }

    /// The largest error that can be left where something is wanted, and the largest excess of all tetrahedra that violate the
    /// criterion; 1 if none does. Takes time in proportion to the mesh.
    pub fn largest_violation(&self, mt: &impl ApplyUpdates, criterion: &dyn Criterion) -> (ErrorCode, f64) {
        let Violations { error, excess, .. } = self.violations(mt, criterion);
        (error, excess)
    }

    /// The pages that are not here but hold what removes a tetrahedron that violates the criterion, as far as what is known of
    /// the page tells, or what such an update depends on; each with the largest excess. Only what the mesh shows at once:
    /// more may be demanded when these have come. Ascending.
    pub fn demanded_pages(
        &self,
        mt: &impl ApplyUpdates,
        criterion: &dyn Criterion,
        page_of: impl Fn(UpdateId) -> u32,
    ) -> BTreeMap<u32, f64> {
        let mut pages = BTreeMap::new();
        let mut demand = |absent: UpdateId, t: u32| {
            let Some(tet) = self.mesh.tet(t) else { return };
            let update = mt.remover(&self.mesh, t);
            let known = update.map(|u| TetErrors::of(mt, &self.mesh, t, u));
            let errors = known.or_else(|| mt.awaited_errors(&self.mesh, t).map(TetErrors::bounded_by));
            let Some(errors) = errors else { return };
            let verdict =
                see(&self.mesh, &tet, &errors, update.unwrap_or(absent), |look| criterion.rank(look));
            if verdict.asks() {
                let largest = pages.entry(page_of(absent)).or_insert(0.0_f64);
                *largest = largest.max(verdict.excess);
            }
        };
        if self.watched {
            self.awaiting.iter().for_each(|&(u, t)| demand(UpdateId(u), t));
        } else {
            let slots = 0..self.mesh.tet_slots() as u32;
            slots.filter_map(|t| mt.awaited(&self.mesh, t).map(|u| (u, t))).for_each(|(u, t)| demand(u, t));
            self.awaiting.iter().for_each(|&(u, t)| demand(UpdateId(u), t));
        }
        pages
    }

    /// The pages that are here and hold what removes a tetrahedron which might violate the criterion, as far as `bounds` of the
    /// page tell: without them it would be unknown whether the mesh is what was asked for. Some are named several times.
    pub fn telling_pages(
        &self,
        mt: &impl ApplyUpdates,
        criterion: &dyn Criterion,
        page_of: impl Fn(UpdateId) -> u32,
        bounds: impl Fn(u32) -> Vec<ErrorCode>,
    ) -> Vec<u32> {
        let mut pages = Vec::new();
        for (t, tet) in (0..).zip(self.mesh.tets()) {
            let Some(u) = mt.remover(&self.mesh, t) else { continue };
            let page = page_of(u);
            // Tetrahedra side by side are often removed by updates of a page.
            if pages.last() == Some(&page) {
                continue;
            }
            let bounds = bounds(page);
            let errors = TetErrors::bounded_by(&bounds);
            if see(&self.mesh, tet, &errors, u, |look| criterion.judge(look)).asks() {
                pages.push(page);
            }
        }
        pages
    }

    fn violations(&self, mt: &impl ApplyUpdates, criterion: &dyn Criterion) -> Violations {
        // Where no budget is in the way, what violates the criterion waits for something.
        let unlimited = self.ranked.has_room();
        let field = criterion.field();
        let to_come = vec![mt.to_come(); mt.info().fields.len()];
        let incomplete = mt.present() < mt.info().updates;
        let mut all = Violations { error: ErrorCode::ZERO, excess: 1.0, missing: false };
        for (t, tet) in (0..).zip(self.mesh.tets()) {
            let update = mt.remover(&self.mesh, t);
            let missing = incomplete && (update.is_none() || unlimited);
            let errors = match (update, mt.awaited_errors(&self.mesh, t)) {
                (Some(u), _) => TetErrors::of(mt, &self.mesh, t, u),
                (None, Some(errors)) => TetErrors::bounded_by(errors),
                (None, None) => TetErrors { largest: mt.to_come(), by_field: Cow::Borrowed(&to_come) },
            };
            // The last number there can be: nothing is added to what is wanted.
            let update = update.unwrap_or(UpdateId(mt.info().updates));
            let verdict = see(&self.mesh, tet, &errors, update, |look| criterion.rank(look));
            if verdict.asks() {
                let TetErrors { largest, by_field } = &errors;
                let error = field.and_then(|field| by_field.get(field)).copied().unwrap_or(*largest);
                all.error = all.error.max(error);
                all.excess = all.excess.max(verdict.excess);
                all.missing |= missing;
            }
        }
        // What violates nothing is within the tolerance: with several needs, that of another one may be larger.
        all.error = all.error.max(self.within(mt, criterion));
        all
    }

    /// The error that is left where nothing violates the criterion.
    fn within(&self, mt: &impl ApplyUpdates, criterion: &dyn Criterion) -> ErrorCode {
        let tolerance = criterion.tolerance();
        self.largest_left(mt, criterion.field(), tolerance).min(tolerance)
    }
}

/// The updates that created the tetrahedra just changed, as often as they did.
pub(super) fn creators_of_touched<'a>(
    mesh: &'a CurrentMesh,
    mt: &'a impl ApplyUpdates,
) -> impl Iterator<Item = UpdateId> + 'a {
    let live = mesh.touched().iter().filter(|&&t| mesh.tet(t).is_some());
    live.filter_map(|&t| mt.creator(mesh, t))
}

/// Shows a tetrahedron of the mesh to `judge`.
#[inline]
pub(super) fn see(
    mesh: &CurrentMesh,
    tet: &[u32; 4],
    errors: &TetErrors<'_>,
    update: UpdateId,
    judge: impl FnOnce(&TetLook<'_>) -> Verdict,
) -> Verdict {
    let corners = tet.map(|v| mesh.positions[v as usize]);
    let levels = |field: usize| tet.map(|v| mesh.levels(v)[field]);
    let TetErrors { largest: error, ref by_field } = *errors;
    judge(&TetLook { corners: &corners, levels: &levels, error, errors: by_field, update })
}

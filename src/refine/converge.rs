//! The way to a request without a tight budget: what violates it is refined, what nothing asks for is undone.

use super::front::{Front, GoOn, Task, Violation};
use super::look::{Open, TetErrors};
use super::{TetData, Verdict};
use crate::mt::{Applied, ApplyUpdates, CurrentMesh, MAX_QUARTERINGS, UpdateError, UpdateId};

/// What came of the wish to apply an update with all that it depends on.
pub(super) enum Forced {
    /// It is applied.
    Applied,
    /// It depends on an update that is not here. These others have been applied on the way to it.
    Awaits(UpdateId, Vec<UpdateId>),
}

/// How far [`Front::converge`] has come.
pub(super) enum Way {
    /// All the way.
    Done,
    /// It was told to stop.
    Paused,
    /// The budget is exceeded.
    Full,
}

/// Tetrahedra that are judged together.
const AT_ONCE: usize = 64;

/// A violation that lasts so long need not be outdone by another one.
const LONG: f64 = 1.0 / 16.0;

impl Front {
    /// Refines until no tetrahedron violates the criterion, and undoes what nothing asks for: afterwards, or first if there is a
    /// budget. Then what is left is asked for, and the mesh only grows to what it is in the end.
    pub(super) fn converge(
        &mut self,
        task: &mut Task<'_, impl ApplyUpdates>,
        go_on: GoOn<'_>,
    ) -> Result<Way, UpdateError> {
        self.track_all(task.mt);
        if !task.budget.is_unlimited() {
            while let Some(u) = self.leaves.next().map(UpdateId) {
                self.coarsen_unless_needed(task, u)?;
            }
            if !task.budget.holds(self.mesh.vertex_count(), self.mesh.tet_count()) {
                return Ok(Way::Full);
            }
        }
        loop {
            while let Some(violation) = self.next_violation(task) {
                if self.contains(violation.update) {
                    continue;
                }
                // Between two steps holes are filled, and what was asked by then has moved.
                if self.is_removed_by(task.mt, violation.tet, violation.update) {
                    task.mt.start_at(&mut self.mesh, violation.tet);
                }
                match self.force(task, violation.update)? {
                    // It is a leaf now; those that it forced are none.
                    Forced::Applied => {
                        self.leaves.defer(
                            violation.update.0,
                            violation.verdict.slack,
                            violation.verdict.component,
                        );
                    }
                    // Nothing may ask for what was forced in vain.
                    Forced::Awaits(absent, forced) => {
                        forced.iter().for_each(|u| self.leaves.open(u.0));
                        self.awaiting.insert((absent.0, violation.tet));
                    }
                }
                self.open_touched();
                if !task.budget.holds(self.mesh.vertex_count(), self.mesh.tet_count()) {
                    return Ok(Way::Full);
                }
                if !go_on(task.outcome) {
                    return Ok(Way::Paused);
                }
            }
            let Some(u) = self.leaves.next().map(UpdateId) else { return Ok(Way::Done) };
            if self.coarsen_unless_needed(task, u)? && !go_on(task.outcome) {
                return Ok(Way::Paused);
            }
        }
    }

    /// Makes sure that everything is either judged or going to be.
    fn track_all(&mut self, mt: &impl ApplyUpdates) {
        if self.tracked {
            return;
        }
        self.untrack();
        for t in 0..self.mesh.tet_slots() as u32 {
            self.tets.open(t);
        }
        for u in (0..self.known).map(UpdateId) {
            if self.contains(u) && mt.may_coarsen(&self.mesh, u) {
                self.leaves.open(u.0);
            }
        }
        self.tracked = true;
    }

    /// The next update that a tetrahedron asks for. All open tetrahedra are judged before the first one is forced, so that
    /// those which several updates change are judged once.
    fn next_violation(&mut self, task: &mut Task<'_, impl ApplyUpdates>) -> Option<Violation> {
        if self.pending.is_empty() && !self.tets.is_settled() {
            if task.criterion.is_batched() {
                self.judge_batch(task);
            } else {
                self.tets.sort();
                self.judge_open(task);
            }
            // Parents have smaller numbers: in this order few updates are forced by others that wait too.
            self.pending.sort_unstable_by_key(|violation| std::cmp::Reverse(violation.update));
        }
        self.pending.pop()
    }

    /// Judges all open tetrahedra, some at a time: what they need is fetched from all over the memory for all of them before
    /// the first is judged.
    fn judge_open(&mut self, task: &mut Task<'_, impl ApplyUpdates>) {
        let mut fetched = Vec::with_capacity(AT_ONCE);
        while !self.tets.is_settled() {
            self.fetch_open(task, AT_ONCE, &mut fetched);
            for open in &fetched {
                let levels = |field: usize| open.tet.map(|v| self.mesh.levels(v)[field]);
                let verdict = task.criterion.judge(&open.look(&levels));
                self.take_verdict(open.t, open.update, verdict);
            }
        }
    }

    /// Takes at most so many open tetrahedra to be judged, in place of those in `fetched`.
    fn fetch_open<'a>(
        &mut self,
        task: &mut Task<'a, impl ApplyUpdates>,
        most: usize,
        fetched: &mut Vec<Open<'a>>,
    ) {
        fetched.clear();
        while fetched.len() < most {
            let Some(t) = self.tets.next() else { break };
            let Some(tet) = self.mesh.tet(t) else { continue };
            // If its update is not here, it is judged when that arrives.
            let Some(update) = task.mt.remover(&self.mesh, t) else {
                let awaited = task.mt.awaited(&self.mesh, t);
                self.awaiting.extend(awaited.map(|u| (u.0, t)));
                continue;
            };
            let corners = tet.map(|v| self.mesh.positions[v as usize]);
            let errors = TetErrors::of(task.mt, &self.mesh, t, update);
            fetched.push(Open { t, tet, update, errors, corners });
        }
        task.outcome.judged += fetched.len() as u64;
    }

    fn take_verdict(&mut self, tet: u32, update: UpdateId, verdict: Verdict) {
        if verdict.violates() {
            self.pending.push(Violation { update, tet, verdict });
        } else {
            self.tets.defer(tet, verdict.slack, verdict.component);
        }
    }

    /// Judges all open tetrahedra at once.
    fn judge_batch(&mut self, task: &mut Task<'_, impl ApplyUpdates>) {
        let mut fetched = Vec::new();
        self.fetch_open(task, usize::MAX, &mut fetched);
        let mesh = &self.mesh;
        let levels: Vec<_> =
            fetched.iter().map(|open| move |f: usize| open.tet.map(|v| mesh.levels(v)[f])).collect();
        let looks: Vec<TetData<'_>> =
            fetched.iter().zip(&levels).map(|(open, levels)| open.look(levels)).collect();
        let verdicts = task.criterion.judge_all(&looks);
        for (open, verdict) in fetched.iter().zip(verdicts) {
            self.take_verdict(open.t, open.update, verdict);
        }
    }

    /// Undoes an update that nothing asks for and none depends on; tells whether it did.
    fn coarsen_unless_needed(
        &mut self,
        task: &mut Task<'_, impl ApplyUpdates>,
        u: UpdateId,
    ) -> Result<bool, UpdateError> {
        if !self.contains(u) || !task.mt.may_coarsen(&self.mesh, u) {
            return Ok(false);
        }
        task.outcome.judged += 1;
        match self.need(task, u, false)? {
            // It is looked at again when the child that is in the way is undone.
            None => Ok(false),
            Some(verdict) if verdict.violates() => {
                self.leaves.defer(u.0, verdict.slack, verdict.component);
                Ok(false)
            }
            Some(verdict) => {
                self.coarsen(task, u)?;
                self.open_parents(task.mt);
                // What has come back has just been judged.
                for i in 0..self.mesh.touched().len() {
                    let t = self.mesh.touched()[i];
                    if self.mesh.tet(t).is_some() {
                        self.tets.defer(t, verdict.slack, verdict.component);
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

    pub(super) fn open_touched(&mut self) {
        if self.tracked {
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
        task: &Task<'_, impl ApplyUpdates>,
        u: UpdateId,
        ranked: bool,
    ) -> Result<Option<Verdict>, UpdateError> {
        // With every number of quarterings.
        let all_errors = [0, 1, 2, MAX_QUARTERINGS].map(|own| {
            if own == 0 || task.mt.has_tet_errors() { Some(TetErrors::new(task.mt, u, own)) } else { None }
        });
        let mut all = Verdict::NEVER;
        let mut look = |corners: &[[i32; 3]; 4], levels: &dyn Fn(usize) -> [i32; 4], own: u8| {
            let of_own = all_errors.get(usize::from(own)).and_then(Option::as_ref).or(all_errors[0].as_ref());
            let Some(TetErrors { largest, by_field }) = of_own else { return false };
            let look = TetData { corners, levels, error: *largest, errors: by_field, update: u };
            let one = if ranked { task.criterion.rank(&look) } else { task.criterion.judge(&look) };
            all = all.or(one);
            !ranked && one.violates() && one.slack > LONG
        };
        let looked = task.mt.look_at_removed(&mut self.mesh, u, &mut look)?;
        Ok((looked == Applied::Done).then_some(all))
    }

    /// Applies `u` and all that it depends on, unless something of that is not here.
    pub(super) fn force(
        &mut self,
        task: &mut Task<'_, impl ApplyUpdates>,
        u: UpdateId,
    ) -> Result<Forced, UpdateError> {
        let mut stack = vec![u];
        let mut forced = Vec::new();
        while let Some(&top) = stack.last() {
            match task.mt.refine_marked(&mut self.mesh, top)? {
                Applied::Done => {
                    self.note(top, true);
                    self.ranked.note_applied(top);
                    task.outcome.refined += 1;
                    stack.pop();
                    task.outcome.forced += u64::from(!stack.is_empty());
                    forced.push(top);
                }
                // Numbers fall from child to parent, so this ends.
                Applied::Blocked(parent) if parent < top && task.mt.has(parent) => stack.push(parent),
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
        task: &mut Task<'_, impl ApplyUpdates>,
        u: UpdateId,
    ) -> Result<(), UpdateError> {
        match task.mt.coarsen(&mut self.mesh, u)? {
            Applied::Done => self.note(u, false),
            Applied::Blocked(_) => return Err(UpdateError::Error { update: u.0 }),
        }
        task.outcome.coarsened += 1;
        Ok(())
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

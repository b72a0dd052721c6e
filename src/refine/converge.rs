//! Refinement without a tight budget: violations are refined, updates that nothing needs are undone.

use super::criterion::{TetData, Verdict};
use super::front::{Front, GoOn, Task, Violation};
use super::look::{Open, TetErrors};
use super::single_updates::{Forced, creators_of_touched};
use crate::mt::ApplyUpdates;
use crate::mt::UpdateError;
use crate::mt::UpdateId;
use std::cmp::Reverse;

/// The state of [`Front::converge`].
pub(super) enum Way {
    /// Finished.
    Done,
    /// Stopped by the caller.
    Paused,
    /// The budget is exceeded.
    Full,
}

/// Tetrahedra that are evaluated together.
const AT_ONCE: usize = 64;

impl Front {
    /// Refines until no tetrahedron violates the criterion, and undoes unneeded updates: afterwards, or first if there
    /// is a budget, so that the mesh then only grows.
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
                // Packing between two steps may have moved the tetrahedron.
                if self.is_removed_by(task.mt, violation.tet, violation.update) {
                    task.mt.start_at(&mut self.mesh, violation.tet);
                }
                match self.force(task, violation.update)? {
                    // It is a leaf now; the updates that it forced are not.
                    Forced::Applied => {
                        self.leaves.defer(
                            violation.update.0,
                            violation.verdict.slack,
                            violation.verdict.component,
                        );
                    }
                    // The updates forced in vain may be unneeded.
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

    /// Schedules the whole mesh for evaluation, unless it is tracked already.
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

    /// The next violation. All due tetrahedra are evaluated before the first update is forced, so that those that
    /// several updates change are evaluated once.
    fn next_violation(&mut self, task: &mut Task<'_, impl ApplyUpdates>) -> Option<Violation> {
        if self.pending.is_empty() && !self.tets.is_settled() {
            if task.criterion.is_batched() {
                self.judge_batch(task);
            } else {
                self.tets.sort();
                self.judge_open(task);
            }
            // Parents have smaller numbers: in this order few pending updates are forced by others.
            self.sort_pending();
        }
        self.pending.pop()
    }

    /// Sorts what is pending by falling number of the update.
    fn sort_pending(&mut self) {
        self.pending.sort_by_key(|violation| Reverse(violation.update));
    }

    /// Evaluates all due tetrahedra in groups: fetching the data of a group first hides memory latency.
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

    /// Replaces `fetched` by at most so many due tetrahedra.
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
            // If its update has not arrived, the tetrahedron is evaluated when that arrives.
            let Some(update) = task.mt.remover(&self.mesh, t) else {
                let awaited = task.mt.awaited(&self.mesh, t);
                self.awaiting.extend(awaited.map(|u| (u.0, t)));
                continue;
            };
            let corners = tet.map(|v| self.mesh.positions[v as usize]);
            let errors = TetErrors::of(task.mt, &self.mesh, t, update);
            let region = self.mesh.region(t);
            fetched.push(Open { t, tet, update, errors, corners, region });
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

    /// Evaluates all due tetrahedra at once.
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

    /// Undoes an update that nothing needs and none depends on; returns whether it did.
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
            // It is evaluated again when the blocking child is undone.
            None => Ok(false),
            Some(verdict) if verdict.violates() => {
                self.leaves.defer(u.0, verdict.slack, verdict.component);
                Ok(false)
            }
            Some(verdict) => {
                self.coarsen(task, u)?;
                self.open_parents(task.mt);
                // The restored tetrahedra have just been evaluated.
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

    /// The creators of the restored tetrahedra may have no children any more.
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
}

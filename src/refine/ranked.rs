//! Refinement under a budget: two queues over the front, as in the paper [§2.3].
//!
//! The violation of largest excess is forced; when the mesh exceeds the budget, the applied update of least excess is
//! undone. This ends when the update forced last is the one to undo. The mesh is then that of all updates above a
//! threshold of excess, the smallest threshold that fits. No set within the budget has a smaller largest excess, since
//! each set with that excess contains this one.
//!
//! With own errors, a forced update may create violations of larger excess. They belong to the threshold that has been
//! reached: when the budget is exceeded, all updates applied since then are undone. Again the mesh is that of the
//! smallest threshold that fits.

use super::front::{Front, GoOn, Task};
use super::look::{TetErrors, see};
use super::ranked_queues::{State, rank};
use super::single_updates::{Forced, creators_of_touched};
use crate::mt::{ApplyUpdates, UpdateError, UpdateId};
use std::cmp::Reverse;

impl Front {
    /// Moves to the mesh of the smallest excess that fits the budget. True when that is reached.
    pub(super) fn ranked_converge(
        &mut self,
        task: &mut Task<'_, impl ApplyUpdates>,
        go_on: GoOn<'_>,
    ) -> Result<bool, UpdateError> {
        if !self.ranked.is_running() {
            self.fill_queues(task)?;
            self.trim(task, None)?;
        }
        for t in std::mem::take(&mut self.ranked.moved) {
            self.push_violation(task, t);
        }
        while let Some((rank, t)) = self.ranked.refinable.pop() {
            let (_, Reverse(u)) = rank;
            if self.contains(u) || !self.is_removed_by(task.mt, t, u) {
                continue;
            }
            if task.mt.has_tet_errors() {
                self.ranked.reach(rank);
            }
            task.mt.start_at(&mut self.mesh, t);
            if let Forced::Awaits(absent, forced) = self.force(task, u)? {
                self.awaiting.insert((absent.0, t));
                self.push_touched(task);
                for u in forced.into_iter().rev() {
                    if self.contains(u) && self.is_idle(task, u)? {
                        self.undo(task, u)?;
                    }
                }
                continue;
            }
            if !task.mt.has_tet_errors() {
                // A tetrahedron needs it, so it is queued. The updates that it forced are blocked by it and are queued
                // when it is undone.
                self.is_idle(task, u)?;
            }
            self.push_touched(task);
            let limited =
                if task.mt.has_tet_errors() { self.undo_threshold(task)? } else { self.trim(task, Some(u))? };
            if limited {
                self.ranked.clear();
                self.ranked.state = State::Limited;
                return Ok(true);
            }
            if !go_on(task.outcome) {
                return Ok(false);
            }
        }
        self.ranked.clear();
        self.ranked.state = State::Satisfied;
        Ok(true)
    }

    /// Fills both queues, and undoes unneeded updates.
    fn fill_queues(&mut self, task: &mut Task<'_, impl ApplyUpdates>) -> Result<(), UpdateError> {
        self.untrack();
        self.ranked.clear();
        self.ranked.state = State::Running;
        // Children have larger numbers, so one pass downwards sees each after all that depend on it.
        for u in (0..task.mt.updates()).rev().map(UpdateId) {
            if self.contains(u) && task.mt.may_coarsen(&self.mesh, u) {
                if self.is_idle(task, u)? {
                    self.coarsen(task, u)?;
                }
                self.mesh.clear_touched();
            }
        }
        for t in 0..self.mesh.tet_slots() as u32 {
            self.push_violation(task, t);
        }
        Ok(())
    }

    /// Queues an update for coarsening if the request needs it. True if neither the request nor a child needs it: then
    /// it is idle and can be undone.
    fn is_idle(&mut self, task: &mut Task<'_, impl ApplyUpdates>, u: UpdateId) -> Result<bool, UpdateError> {
        task.outcome.judged += 1;
        let Some(verdict) = self.need(task, u, true)? else { return Ok(false) };
        if verdict.violates() {
            self.ranked.coarsenable.push(Reverse(rank(verdict.excess, u)));
        }
        Ok(!verdict.violates())
    }

    fn push_violation(&mut self, task: &mut Task<'_, impl ApplyUpdates>, t: u32) {
        let Some(tet) = self.mesh.tet(t) else { return };
        let Some(u) = task.mt.remover(&self.mesh, t) else { return };
        task.outcome.judged += 1;
        let errors = TetErrors::of(task.mt, &self.mesh, t, u);
        let verdict = see(&self.mesh, (t, &tet), &errors, u, |look| task.criterion.rank(look));
        if verdict.violates() {
            self.ranked.refinable.push((rank(verdict.excess, u), t));
        }
    }

    fn push_touched(&mut self, task: &mut Task<'_, impl ApplyUpdates>) {
        for i in 0..self.mesh.touched().len() {
            self.push_violation(task, self.mesh.touched()[i]);
        }
        self.mesh.clear_touched();
    }

    /// Undoes all updates since the threshold was reached, if the budget is exceeded; returns whether it is.
    fn undo_threshold(&mut self, task: &mut Task<'_, impl ApplyUpdates>) -> Result<bool, UpdateError> {
        if task.budget.holds(self.mesh.vertex_count(), self.mesh.tet_count()) {
            return Ok(false);
        }
        // The last one has no child that is applied.
        while let Some(u) = self.ranked.since.pop() {
            self.coarsen(task, u)?;
        }
        self.mesh.clear_touched();
        Ok(true)
    }

    /// Undoes the updates of least excess until the budget is kept. Returns whether `last` was among them.
    fn trim(
        &mut self,
        task: &mut Task<'_, impl ApplyUpdates>,
        last: Option<UpdateId>,
    ) -> Result<bool, UpdateError> {
        let mut reached = false;
        while !task.budget.holds(self.mesh.vertex_count(), self.mesh.tet_count()) {
            let Some(Reverse((_, Reverse(u)))) = self.ranked.coarsenable.pop() else { break };
            if !self.contains(u) || self.need(task, u, false)?.is_none() {
                // With a child it is queued again when the child is undone.
                continue;
            }
            self.undo(task, u)?;
            reached |= last == Some(u);
        }
        Ok(reached)
    }

    /// Undoes `u` and the updates that only `u` needed.
    fn undo(&mut self, task: &mut Task<'_, impl ApplyUpdates>, u: UpdateId) -> Result<(), UpdateError> {
        let mut idle = vec![u];
        while let Some(u) = idle.pop() {
            if !self.contains(u) {
                continue;
            }
            self.coarsen(task, u)?;
            let parents = self.parents_of_touched(task.mt);
            self.push_touched(task);
            for parent in parents {
                if self.is_idle(task, parent)? {
                    idle.push(parent);
                }
            }
        }
        Ok(())
    }

    /// The updates that created the tetrahedra just changed.
    fn parents_of_touched(&self, mt: &impl ApplyUpdates) -> Vec<UpdateId> {
        let mut parents: Vec<u32> = creators_of_touched(&self.mesh, mt).map(|u| u.0).collect();
        parents.sort_unstable();
        parents.dedup();
        parents.into_iter().map(UpdateId).collect()
    }
}

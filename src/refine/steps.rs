//! How the front moves when the request changes: which way of refining goes with the request, in steps.

use super::converge::Way;
use super::criterion::{ANY, COMPONENTS, Criterion};
use super::front::{FAR, Front, GoOn, Goal, Outcome, Task};
use super::request::Budget;
use super::uniform::NeededUpdates;
use crate::mt::{ApplyUpdates, UpdateError};
use std::sync::Arc;

impl Front {
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
}

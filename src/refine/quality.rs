//! The quality of the mesh for a request.

use super::front::{CHUNK_WORDS, Front, Goal};
use super::look::{TetErrors, see};
use super::{Criterion, Outcome};
use crate::mt::{ApplyUpdates, ErrorCode, UpdateId};
use std::borrow::Cow;

/// The violations of a criterion.
struct Violations {
    /// The largest error left in the selected part.
    error: ErrorCode,
    /// The largest excess; 1 if nothing violates it.
    excess: f64,
    /// Whether the remover of one of the tetrahedra has not arrived.
    missing: bool,
}

impl Front {
    /// Determines the quality of the mesh, which is packed.
    pub(super) fn report(&self, mt: &impl ApplyUpdates, goal: &mut Goal) {
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

    /// An upper bound of the errors of all updates that are not applied, whether they have arrived or not, in this
    /// field or in all. The search stops at `enough`.
    pub fn largest_left(&self, mt: &impl ApplyUpdates, field: Option<usize>, enough: ErrorCode) -> ErrorCode {
        let error = |u: UpdateId| field.map_or_else(|| mt.error(u), |field| mt.error_of_field(u, field));
        let mut found = field.map_or_else(|| mt.to_come(), |field| mt.to_come_in(field));
        for (chunk, words) in self.applied.words().chunks(CHUNK_WORDS).enumerate() {
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

    /// The largest error left in the selected part, and the largest excess of all tetrahedra that violate the
    /// criterion; 1 if none does. Takes time in proportion to the mesh.
    pub fn largest_violation(&self, mt: &impl ApplyUpdates, criterion: &dyn Criterion) -> (ErrorCode, f64) {
        let Violations { error, excess, .. } = self.violations(mt, criterion);
        (error, excess)
    }

    fn violations(&self, mt: &impl ApplyUpdates, criterion: &dyn Criterion) -> Violations {
        // If the budget is not the limit, violations are due to missing data.
        let unlimited = self.ranked.has_room();
        let field = criterion.field();
        let to_come = to_come_by_field(mt);
        let incomplete = mt.present() < mt.info().updates;
        let mut all = Violations { error: ErrorCode::ZERO, excess: 1.0, missing: false };
        for (t, tet) in (0..).zip(&self.mesh.tets) {
            let (update, errors) = self.errors_of(mt, t, &to_come);
            let missing = incomplete && (update.is_none() || unlimited);
            // The last number: regions are not widened.
            let update = update.unwrap_or(UpdateId(mt.info().updates));
            let verdict = see(&self.mesh, (t, tet), &errors, update, |look| criterion.rank(look));
            if verdict.violates() {
                let TetErrors { largest, by_field } = &errors;
                let error = field.and_then(|field| by_field.get(field)).copied().unwrap_or(*largest);
                all.error = all.error.max(error);
                all.excess = all.excess.max(verdict.excess);
                all.missing |= missing;
            }
        }
        // Tetrahedra without violations are within the tolerance: with several needs, that of another one may be
        // larger.
        all.error = all.error.max(self.within(mt, criterion));
        all
    }

    /// The update that removes tetrahedron `t`, if it is here, and the errors of the tetrahedron; where it is
    /// not, bounds of them, `to_come` if nothing better is known.
    fn errors_of<'a>(
        &self,
        mt: &'a impl ApplyUpdates,
        t: u32,
        to_come: &'a [ErrorCode],
    ) -> (Option<UpdateId>, TetErrors<'a>) {
        let update = mt.remover(&self.mesh, t);
        let errors = match (update, mt.awaited_errors(&self.mesh, t)) {
            (Some(u), _) => TetErrors::of(mt, &self.mesh, t, u),
            (None, Some(errors)) => TetErrors::bounded_by(errors),
            (None, None) => TetErrors { largest: mt.to_come(), by_field: Cow::Borrowed(to_come) },
        };
        (update, errors)
    }

    /// The error of each tetrahedron of the mesh, as the criterion of the last request sees it: that of the
    /// update which removes it, or its own where it has one. If the criterion measures a single field it is
    /// the error in that field, else the largest of all fields. Where the update has not arrived it is a
    /// bound; zero for tetrahedra of the reference mesh.
    pub fn tet_errors(&self, mt: &impl ApplyUpdates) -> Vec<ErrorCode> {
        let to_come = to_come_by_field(mt);
        (0..self.mesh.tet_slots() as u32).map(|t| self.measured_error(mt, t, &to_come)).collect()
    }

    /// [`Front::tet_errors`] of one tetrahedron of the mesh.
    pub fn tet_error(&self, mt: &impl ApplyUpdates, t: u32) -> ErrorCode {
        self.measured_error(mt, t, &to_come_by_field(mt))
    }

    fn measured_error(&self, mt: &impl ApplyUpdates, t: u32, to_come: &[ErrorCode]) -> ErrorCode {
        let field = self.goal.as_ref().and_then(|goal| goal.criterion.field());
        let (_, TetErrors { largest, by_field }) = self.errors_of(mt, t, to_come);
        field.and_then(|field| by_field.get(field)).copied().unwrap_or(largest)
    }

    /// The largest error that tetrahedra of each of so many regions have in one field.
    pub fn errors_by_region(&self, mt: &impl ApplyUpdates, field: usize, regions: usize) -> Vec<ErrorCode> {
        let to_come = to_come_by_field(mt);
        let mut all = vec![ErrorCode::ZERO; regions];
        for t in 0..self.mesh.tet_slots() as u32 {
            let (_, TetErrors { largest, by_field }) = self.errors_of(mt, t, &to_come);
            let error = by_field.get(field).copied().unwrap_or(largest);
            let most = &mut all[usize::from(self.mesh.region(t))];
            *most = error.max(*most);
        }
        all
    }

    /// For each tetrahedron of the mesh whether it may violate the last request only because data has not
    /// arrived: the update that removes it is not here, or, once the work is done as far as data allows, one
    /// that has to come before. None when all updates are here, and without a request.
    pub fn missing_tets(&self, mt: &impl ApplyUpdates) -> Vec<bool> {
        let tets = &self.mesh.tets;
        let Some(goal) = self.goal.as_ref().filter(|_| mt.present() < mt.info().updates) else {
            return vec![false; tets.len()];
        };
        // What violates the request although all that is here has been done for it waits for something else.
        let is_stuck = goal.reached && (goal.budget.is_unlimited() || self.ranked.has_room());
        let to_come = to_come_by_field(mt);
        let is_missing = |(t, tet): (u32, &[u32; 4])| {
            let (update, errors) = self.errors_of(mt, t, &to_come);
            if update.is_some() && !is_stuck {
                return false;
            }
            let update = update.unwrap_or(UpdateId(mt.info().updates));
            see(&self.mesh, (t, tet), &errors, update, |look| goal.criterion.judge(look)).violates()
        };
        (0..).zip(tets).map(is_missing).collect()
    }

    /// The error left where no tetrahedron violates the criterion.
    fn within(&self, mt: &impl ApplyUpdates, criterion: &dyn Criterion) -> ErrorCode {
        let tolerance = criterion.tolerance();
        self.largest_left(mt, criterion.field(), tolerance).min(tolerance)
    }
}

/// The largest errors of updates that are not here.
fn to_come_by_field(mt: &impl ApplyUpdates) -> Vec<ErrorCode> {
    (0..mt.info().fields.len()).map(|field| mt.to_come_in(field)).collect()
}

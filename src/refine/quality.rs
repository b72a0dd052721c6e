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
        let mut found = mt.to_come();
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
            // The last number: regions are not widened.
            let update = update.unwrap_or(UpdateId(mt.info().updates));
            let verdict = see(&self.mesh, tet, &errors, update, |look| criterion.rank(look));
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

    /// The error left where no tetrahedron violates the criterion.
    fn within(&self, mt: &impl ApplyUpdates, criterion: &dyn Criterion) -> ErrorCode {
        let tolerance = criterion.tolerance();
        self.largest_left(mt, criterion.field(), tolerance).min(tolerance)
    }
}

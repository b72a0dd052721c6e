//! Updates that arrive one by one or in pages, pages that are evicted, and the pages that the front awaits.

use super::Criterion;
use super::front::{CHUNK_WORDS, Front, Violation};
use super::look::{TetErrors, see};
use crate::mt::{ApplyUpdates, ErrorCode, UpdateId};
use std::ops::Range;

impl Front {
    /// Registers updates that have arrived.
    pub(super) fn sync(&mut self, mt: &impl ApplyUpdates) {
        if mt.updates() <= self.known && !self.applied.words().is_empty() {
            return;
        }
        let arrived = self.known..mt.updates();
        self.known = arrived.end;
        self.applied.resize(self.known);
        self.chunks
            .resize(self.applied.words().len().div_ceil(CHUNK_WORDS), [ErrorCode::MAX, ErrorCode::ZERO]);
        self.add_updates(mt, arrived);
    }

    /// Registers a range of updates. Only the tetrahedra that they remove are evaluated again.
    fn add_updates(&mut self, mt: &impl ApplyUpdates, updates: Range<u32>) {
        self.note_errors(mt, updates.clone());
        while let Some(&(u, t)) = self.awaiting.range((updates.start, 0)..(updates.end, 0)).next() {
            self.awaiting.remove(&(u, t));
            self.tets.open(t);
        }
        mt.page_inserted(&mut self.mesh, updates);
        self.open_touched();
        self.restart();
    }

    /// The goal has to be reached anew with the present updates.
    fn restart(&mut self) {
        self.ranked.clear();
        if let Some(goal) = &mut self.goal {
            goal.reached = false;
        }
    }

    /// Registers a page that has been inserted into the MT. Updates added by
    /// `push`, after all others, need no call.
    pub fn page_inserted(&mut self, mt: &impl ApplyUpdates, page: u32) {
        let (updates, known) = (mt.page_updates(page), self.known);
        self.sync(mt);
        if updates.start < known {
            self.add_updates(mt, updates);
        }
    }

    /// Prepares the eviction of a page from the MT, which must follow at once. False if one of its updates is applied:
    /// then it must not be evicted.
    pub fn prepare_eviction(&mut self, mt: &impl ApplyUpdates, page: u32) -> bool {
        let updates = mt.page_updates(page);
        if updates.clone().any(|u| self.contains(UpdateId(u))) {
            return false;
        }
        mt.page_evicted(&mut self.mesh, updates.clone());
        self.leaves.forget(updates.clone());
        let (gone, kept) = std::mem::take(&mut self.pending)
            .into_iter()
            .partition(|violation: &Violation| updates.contains(&violation.update.0));
        self.pending = kept;
        self.awaiting.extend(Vec::into_iter(gone).map(|violation| (violation.update.0, violation.tet)));
        self.restart();
        true
    }

    /// Records the errors of updates that have arrived.
    fn note_errors(&mut self, mt: &impl ApplyUpdates, updates: Range<u32>) {
        for u in updates {
            let chunk = u as usize / (64 * CHUNK_WORDS);
            if chunk >= self.chunks.len() {
                self.chunks.resize(chunk + 1, [ErrorCode::MAX, ErrorCode::ZERO]);
            }
            let (error, [least, largest]) = (mt.error(UpdateId(u)), self.chunks[chunk]);
            self.chunks[chunk] = [least.min(error), largest.max(error)];
        }
    }

    /// The absent pages with the remover of a tetrahedron that may violate the criterion, or with an update on which
    /// that depends; each with the largest excess, ascending. More may be demanded when these have arrived.
    pub fn demanded_pages(
        &self,
        mt: &impl ApplyUpdates,
        criterion: &dyn Criterion,
        page_of: impl Fn(UpdateId) -> u32,
    ) -> Vec<(u32, f64)> {
        // Pages with excesses, which sort as their bits do: they are larger than 1.
        let mut demands: Vec<u128> = Vec::new();
        let mut demand = |absent: UpdateId, t: u32| {
            let Some(tet) = self.mesh.tet(t) else { return };
            let update = mt.remover(&self.mesh, t);
            let known = update.map(|u| TetErrors::of(mt, &self.mesh, t, u));
            let errors = known.or_else(|| mt.awaited_errors(&self.mesh, t).map(TetErrors::bounded_by));
            let Some(errors) = errors else { return };
            let verdict =
                see(&self.mesh, (t, &tet), &errors, update.unwrap_or(absent), |look| criterion.rank(look));
            if verdict.violates() {
                demands.push(u128::from(page_of(absent)) << 64 | u128::from(verdict.excess.to_bits()));
            }
        };
        if !self.tracked {
            let slots = 0..self.mesh.tet_slots() as u32;
            slots.filter_map(|t| mt.awaited(&self.mesh, t).map(|u| (u, t))).for_each(|(u, t)| demand(u, t));
        }
        self.awaiting.iter().for_each(|&(u, t)| demand(UpdateId(u), t));
        demands.sort_unstable();
        let largest = demands.chunk_by(|a, b| a >> 64 == b >> 64).filter_map(<[u128]>::last);
        largest.map(|&demand| ((demand >> 64) as u32, f64::from_bits(demand as u64))).collect()
    }

    /// The largest excess of a tetrahedron whose remover is present; 1 if none violates the criterion. Under a budget, what has a smaller
    /// excess does not come before it.
    pub fn largest_present_excess(&self, mt: &impl ApplyUpdates, criterion: &dyn Criterion) -> f64 {
        let tets = (0..).zip(&self.mesh.tets);
        let removed = tets.filter_map(|(t, tet)| Some((t, tet, mt.remover(&self.mesh, t)?)));
        let excesses = removed.map(|(t, tet, u)| {
            let errors = TetErrors::of(mt, &self.mesh, t, u);
            see(&self.mesh, (t, tet), &errors, u, |look| criterion.rank(look)).excess
        });
        excesses.fold(1.0, f64::max)
    }

    /// The present pages with the remover of a tetrahedron that may violate the criterion by the `bounds` of the page:
    /// without them it would be unknown whether the mesh satisfies the request. Some are listed several times.
    pub fn decisive_pages(
        &self,
        mt: &impl ApplyUpdates,
        criterion: &dyn Criterion,
        page_of: impl Fn(UpdateId) -> u32,
        bounds: impl Fn(u32) -> Vec<ErrorCode>,
    ) -> Vec<u32> {
        let mut pages = Vec::new();
        for (t, tet) in (0..).zip(&self.mesh.tets) {
            let Some(u) = mt.remover(&self.mesh, t) else { continue };
            let page = page_of(u);
            // Neighbouring tetrahedra are often removed by updates of one page.
            if pages.last() == Some(&page) {
                continue;
            }
            let bounds = bounds(page);
            let errors = TetErrors::bounded_by(&bounds);
            if see(&self.mesh, (t, tet), &errors, u, |look| criterion.judge(look)).violates() {
                pages.push(page);
            }
        }
        pages
    }
}

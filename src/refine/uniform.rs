//! Uniform requests: the errors of updates alone decide, not the mesh.

use super::front::{CHUNK_WORDS, FAR, Front, GoOn};
use super::sweep::{Window, window_size};
use super::{Outcome, Tolerance};
use crate::mesh::BitSet;
use crate::mt::{Applied, ApplyUpdates, ErrorCode, UpdateError, UpdateId};

/// One in so many of the known updates are few.
const FEW: u32 = 16;

/// The updates that a uniform request needs, by their errors.
#[derive(Clone, Copy)]
pub(super) struct NeededUpdates<'a> {
    tolerances: &'a [Tolerance],
    /// All of them have a larger error than this.
    least: ErrorCode,
    /// All updates with a larger error than this are needed.
    sure: ErrorCode,
}

impl<'a> NeededUpdates<'a> {
    pub fn new(tolerances: &'a [Tolerance]) -> Self {
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

/// The updates that stay applied in a sweep that undoes others.
struct Staying<'a> {
    needed: NeededUpdates<'a>,
    /// Updates on which needed ones depend, as far as they were found; none where errors are monotone.
    others: BitSet,
}

impl Staying<'_> {
    fn has(&self, mt: &impl ApplyUpdates, u: UpdateId) -> bool {
        self.others.has(u.0) || self.needed.has(mt, u)
    }

    #[cold]
    fn add(&mut self, updates: &[UpdateId]) {
        for u in updates {
            self.others.insert(u.0);
        }
    }
}

impl Front {
    /// Back to the base mesh: by a new one, which costs nothing that grows with the mesh but a look at each update
    /// that is known, or by undoing updates if they are few.
    pub(super) fn coarsen_all(
        &mut self,
        mt: &impl ApplyUpdates,
        outcome: &mut Outcome,
    ) -> Result<(), UpdateError> {
        self.untrack();
        let are_few = self.applied_count <= self.known / FEW;
        let (false, Ok(start)) = (are_few, mt.start()) else {
            return self.sweep(mt, NeededUpdates::new(&[]), false, outcome, &mut |_| true).map(drop);
        };
        self.mesh.start_again(start);
        outcome.coarsened += u64::from(self.applied_count);
        self.applied = BitSet::default();
        self.applied.resize(self.known);
        self.applied_count = 0;
        mt.page_inserted(&mut self.mesh, 0..self.known);
        self.mesh.clear_touched();
        Ok(())
    }

    /// Whether an update is applied for so few that are needed that it is quicker to start from the base mesh.
    fn is_mostly_unneeded(&self, mt: &impl ApplyUpdates, needed: NeededUpdates<'_>) -> bool {
        let most = self.applied_count / FAR;
        let wanted = (0..self.known).filter(|u| needed.has(mt, UpdateId(*u)));
        most > 0
            && self.applied_count > self.known / FEW
            && wanted.take(most as usize + 1).count() <= most as usize
    }

    /// Undoes all updates within the tolerances and applies the others. Errors alone decide. They are monotone along
    /// the partial order, so no needed update depends on one that is undone.
    pub(super) fn satisfy_uniform(
        &mut self,
        mt: &impl ApplyUpdates,
        needed: NeededUpdates<'_>,
        outcome: &mut Outcome,
        go_on: GoOn<'_>,
    ) -> Result<bool, UpdateError> {
        if self.is_mostly_unneeded(mt, needed) {
            self.coarsen_all(mt, outcome)?;
        }
        Ok(self.sweep(mt, needed, false, outcome, go_on)? && self.sweep(mt, needed, true, outcome, go_on)?)
    }

    /// Applies all needed updates, or undoes all others: in windows by number, in each by place. Updates that block
    /// another one come before it. False if the caller stopped it.
    fn sweep(
        &mut self,
        mt: &impl ApplyUpdates,
        needed: NeededUpdates<'_>,
        applied: bool,
        outcome: &mut Outcome,
        go_on: GoOn<'_>,
    ) -> Result<bool, UpdateError> {
        let mut window = Window::default();
        let mut staying = Staying { needed, others: BitSet::default() };
        let words = self.applied.words().len();
        let mut done = 0;
        while done < words {
            window.updates.clear();
            let size = window_size(self.applied_count);
            while done < words && window.updates.len() < size {
                let word = if applied { done } else { words - 1 - done };
                self.push_pending(mt, needed, word, applied, &mut window.updates);
                done += 1;
            }
            window.sort(mt, &self.mesh);
            for &u in &window.updates {
                self.apply_or_undo(mt, u, applied, &mut staying, outcome)?;
                if !go_on(outcome) {
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }

    /// Appends the updates of a word that a sweep has to apply, by rising number, or to undo, by falling number.
    fn push_pending(
        &self,
        mt: &impl ApplyUpdates,
        needed: NeededUpdates<'_>,
        word: usize,
        applied: bool,
        updates: &mut Vec<UpdateId>,
    ) {
        let [least, largest] = self.chunks[word / CHUNK_WORDS];
        let bits = self.applied.words()[word];
        let mut rest = if applied { !bits } else { bits };
        if rest == 0 || (if applied { largest <= needed.least } else { least > needed.sure }) {
            return;
        }
        while rest != 0 {
            let bit = if applied { rest.trailing_zeros() } else { 63 - rest.leading_zeros() };
            rest &= !(1 << bit);
            let u = UpdateId(64 * word as u32 + bit);
            if u.0 < self.known && needed.has(mt, u) == applied {
                updates.push(u);
            }
        }
    }

    /// Applies or undoes `u`, after the updates that block it. Where errors grow along the partial order, an update
    /// stays applied if a needed one depends on it.
    fn apply_or_undo(
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
            let result =
                if applied { mt.refine_marked(&mut self.mesh, u) } else { mt.coarsen(&mut self.mesh, u) };
            // An update that depends on a missing one counts as missing.
            let is_cut_off = match &result {
                Ok(Applied::Blocked(other)) => applied && *other < u && !mt.has(*other),
                Err(UpdateError::Missing { .. }) => applied && mt.present() < mt.info().updates,
                _ => false,
            };
            if is_cut_off {
                return Ok(());
            }
            next = match result? {
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
}

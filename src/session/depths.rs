//! How deep updates are in the partial order.
//!
//! The compact structures store no arcs, so the parents of an update are found by applying it: they created
//! what it removes. The set of applied updates holds all ancestors of each of its members, so applying it
//! once more, in the order of the numbers, gives the length of the longest path from the base mesh to each:
//! the same as in the whole MT. Depths never change, so this is done only for meshes with updates that no
//! mesh before had.

use crate::mt::{ApplyUpdates, PagedArray, ReplayError, UpdateId, apply_next};
use crate::refine::Front;

/// Depths of updates.
#[derive(Clone, Debug)]
pub(super) struct Depths {
    /// For each update the updates on the longest path to it, itself included; 0 where that is not known.
    of: PagedArray<u32>,
}

impl Default for Depths {
    fn default() -> Self {
        Self { of: PagedArray::new(0) }
    }
}

impl Depths {
    /// The depth of an update; 0 without one.
    pub fn get(&self, u: Option<UpdateId>) -> u32 {
        u.map_or(0, |u| self.of.get(u.0))
    }

    /// Finds the depths of all updates that are applied. Takes as long as applying them, if some are not
    /// known yet.
    ///
    /// # Errors
    /// If the MT is damaged.
    pub fn learn(&mut self, mt: &impl ApplyUpdates, front: &Front) -> Result<(), ReplayError> {
        let mut applied = (0..mt.updates()).map(UpdateId).filter(|u| front.contains(*u));
        if applied.all(|u| self.get(Some(u)) > 0) {
            return Ok(());
        }
        let mut mesh = mt.start()?;
        mt.updates_arrived(&mut mesh, 0);
        for u in (0..mt.updates()).map(UpdateId).filter(|u| front.contains(*u)) {
            let removed = mt.find_removed(&mut mesh, u)?;
            let above = removed.iter().map(|&t| self.get(mt.creator(&mesh, t))).max();
            self.of.set(u.0, above.unwrap_or(0) + 1);
            apply_next(mt, &mut mesh, u)?;
        }
        Ok(())
    }
}

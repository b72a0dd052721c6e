//! Single updates of the front: whether one is needed, applying it with those that it depends on, undoing it.

use super::criterion::{TetData, Verdict};
use super::front::{Front, Task};
use super::look::TetErrors;
use crate::mt::{Applied, ApplyUpdates, CurrentMesh, MAX_QUARTERINGS, UpdateError, UpdateId};

/// The result of forcing an update.
pub(super) enum Forced {
    /// The update is applied.
    Applied,
    /// The update depends on one that has not arrived. The others listed here have been applied.
    Awaits(UpdateId, Vec<UpdateId>),
}

/// With a violation of so much slack, the search for a longer one ends.
const LONG: f64 = 1.0 / 16.0;

impl Front {
    /// The verdict on all tetrahedra that an applied update removed: the update is needed if one of them violates the
    /// criterion. None if a child blocks it.
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
        let mut look = |corners: &[[i32; 3]; 4], levels: &dyn Fn(usize) -> [i32; 4], own: u8, region: u16| {
            let of_own = all_errors.get(usize::from(own)).and_then(Option::as_ref).or(all_errors[0].as_ref());
            let Some(TetErrors { largest, by_field }) = of_own else { return false };
            let look = TetData { corners, levels, error: *largest, errors: by_field, update: u, region };
            let one = if ranked { task.criterion.rank(&look) } else { task.criterion.judge(&look) };
            all = all.or(one);
            !ranked && one.violates() && one.slack > LONG
        };
        let looked = task.mt.look_at_removed(&mut self.mesh, u, &mut look)?;
        Ok((looked == Applied::Done).then_some(all))
    }

    /// Applies `u` and the updates that it depends on, unless one of them has not arrived.
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

/// The creators of the tetrahedra just changed, with repetitions.
pub(super) fn creators_of_touched<'a>(
    mesh: &'a CurrentMesh,
    mt: &'a impl ApplyUpdates,
) -> impl Iterator<Item = UpdateId> + 'a {
    let live = mesh.touched().iter().filter(|&&t| mesh.tet(t).is_some());
    live.filter_map(|&t| mt.creator(mesh, t))
}

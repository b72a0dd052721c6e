//! Do errors fall along the partial order, by as much as requests for values rely on?

use super::{ApplyUpdates, CurrentMesh, ErrorCode, MtInfo, PagedArray, UpdateId};
use std::ops::Range;

/// Follows the updates of an MT in their order, each before it is applied.
///
/// A request for values takes a tetrahedron if it has one of them, or one that is no further away than the tetrahedron's error. It
/// is answered the same way whatever was asked for before if, with a tetrahedron, it takes one of those that were removed where
/// that tetrahedron was created. So the range of values of what an update removes, widened by the update's error, must hold that of
/// each tetrahedron that it creates, widened by the error of the update which removes that one.
#[derive(Debug)]
#[doc(hidden)]
pub struct Margins {
    /// Levels of each field's whole range: by so many an error of 1 widens a range.
    levels: Vec<f64>,
    /// For each field the ranges of levels of what each update removes.
    removed: Vec<PagedArray<[i32; 2]>>,
    /// So many updates have been taken.
    len: u32,
}

/// The range of no level.
const NO_LEVEL: [i32; 2] = [i32::MAX, i32::MIN];

/// An update whose error is too large for one of its parents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[doc(hidden)]
pub struct Excess {
    pub update: UpdateId,
    pub parent: UpdateId,
    pub field: usize,
    /// Whether it is larger than the parent's, not just too near to it.
    pub larger: bool,
}

/// Far less than any difference of levels, and more than what rounding makes of one.
const SLACK: f64 = 1e-6;

impl Margins {
    pub fn new(info: &MtInfo) -> Self {
        let levels: Vec<f64> = info.fields.iter().map(|field| field.range() / field.step).collect();
        Self { removed: vec![PagedArray::new(NO_LEVEL); levels.len()], levels, len: 0 }
    }

    pub fn fields(&self) -> usize {
        self.levels.len()
    }

    /// By how much the error of a parent must be larger, if a tetrahedron between the two is so many levels beyond the range of what
    /// the parent removes.
    pub fn error_of(&self, field: usize, beyond: i32) -> f64 {
        f64::from(beyond) / self.levels[field] * (1.0 + 1e-9)
    }

    /// Takes the next update, which removes the tetrahedra `tets` of `mesh`. Appends its parents, ascending, and for each and
    /// every field how many levels what they created is beyond the range of what they removed.
    pub fn next(
        &mut self,
        mt: &impl ApplyUpdates,
        mesh: &CurrentMesh,
        tets: &[u32],
        parents: &mut Vec<UpdateId>,
        beyond: &mut Vec<i32>,
    ) {
        let tets = tets.iter().filter_map(|&t| Some((mt.creator(mesh, t), mesh.tet(t)?)));
        let tets = tets.map(|(parent, corners)| (parent, corners.map(|v| mesh.levels(v))));
        self.find_beyond(tets.clone(), parents, beyond);
        self.note(UpdateId(self.len), tets.flat_map(|(_, levels)| levels));
    }

    /// Takes an update, given the levels of the vertices of what it removes.
    pub fn note<'a>(&mut self, update: UpdateId, vertices: impl Iterator<Item = &'a [i32]>) {
        let mut own = vec![NO_LEVEL; self.levels.len()];
        for levels in vertices {
            for (all, &level) in own.iter_mut().zip(levels) {
                *all = [all[0].min(level), all[1].max(level)];
            }
        }
        self.removed.iter_mut().zip(own).for_each(|(removed, own)| removed.set(update.0, own));
        self.len = self.len.max(update.0 + 1);
    }

    /// Forgets updates on which no other one depends that is still to be taken.
    pub(crate) fn forget(&mut self, updates: Range<u32>) {
        self.removed.iter_mut().for_each(|removed| removed.forget(updates.clone()));
    }

    /// Appends the parents of an update, ascending, and for each and every field how many levels what they created is beyond the range of
    /// what they removed. `tets` has for each tetrahedron that the update removes what created it, and the levels at its corners.
    pub fn find_beyond<'a>(
        &self,
        tets: impl Iterator<Item = (Option<UpdateId>, [&'a [i32]; 4])> + Clone,
        parents: &mut Vec<UpdateId>,
        beyond: &mut Vec<i32>,
    ) {
        let fields = self.levels.len();
        let first = parents.len();
        parents.extend(tets.clone().filter_map(|(parent, _)| parent));
        parents[first..].sort_unstable();
        let mut kept = first;
        for i in first..parents.len() {
            if i == first || parents[i] != parents[kept - 1] {
                parents[kept] = parents[i];
                kept += 1;
            }
        }
        parents.truncate(kept);
        let start = beyond.len();
        beyond.resize(start + (parents.len() - first) * fields, 0);
        for (parent, corners) in tets {
            let Some(parent) = parent else { continue };
            let Ok(at) = parents[first..].binary_search(&parent) else { continue };
            for field in 0..fields {
                let values = corners.map(|levels| levels.get(field).copied().unwrap_or(0));
                let (low, high) = values.iter().fold((i32::MAX, i32::MIN), |(l, h), &x| (l.min(x), h.max(x)));
                let [least, most] = self.removed[field].get(parent.0);
                if least > most {
                    // An update that depends on a later one is refused elsewhere.
                    continue;
                }
                let beyond = &mut beyond[start + at * fields + field];
                *beyond = (*beyond).max(high.saturating_sub(most)).max(least.saturating_sub(low));
            }
        }
    }

    /// [`Margins::next`], and the fault of the errors of update `u`: one that is larger than a parent's first.
    pub fn check(
        &mut self,
        mt: &impl ApplyUpdates,
        mesh: &CurrentMesh,
        u: UpdateId,
        tets: &[u32],
    ) -> Option<Excess> {
        let (mut parents, mut beyond) = (Vec::new(), Vec::new());
        self.next(mt, mesh, tets, &mut parents, &mut beyond);
        self.fault(u, &parents, &beyond, |u, field| mt.error_of_field(u, field))
    }

    /// The fault of the errors of update `u`, one that is larger than a parent's first, given what [`Margins::find_beyond`] has found.
    pub fn fault(
        &self,
        u: UpdateId,
        parents: &[UpdateId],
        beyond: &[i32],
        error: impl Fn(UpdateId, usize) -> ErrorCode,
    ) -> Option<Excess> {
        let arcs = parents.iter().zip(beyond.chunks(self.levels.len().max(1)));
        let mut near = None;
        for (&parent, beyond) in arcs {
            for (field, &beyond) in beyond.iter().enumerate() {
                let [own, above] = [u, parent].map(|u| error(u, field));
                let larger = own > above;
                let excess = Excess { update: u, parent, field, larger };
                if larger {
                    return Some(excess);
                }
                if !self.suits(field, [own, above], beyond) {
                    near = near.or(Some(excess));
                }
            }
        }
        near
    }

    /// Whether the error of an update is small enough for that of its parent.
    fn suits(&self, field: usize, [own, above]: [ErrorCode; 2], beyond: i32) -> bool {
        // The largest code bounds nothing.
        if own > above || above == ErrorCode::MAX {
            return own <= above;
        }
        f64::from(beyond) <= (above.error() - own.error()) * self.levels[field] + SLACK
    }
}

//! Do errors fall along the partial order, by as much as requests for values rely on?

use super::{ApplyUpdates, CurrentMesh, ErrorCode, MtInfo, UpdateId};

/// Follows the updates of an MT in their order, each before it is applied.
///
/// A request for values takes a tetrahedron if it has one of them, or one that is no further away than the tetrahedron's error. It
/// is answered the same way whatever was asked for before if, with a tetrahedron, it takes one of those that were removed where
/// that tetrahedron was created. So the range of values of what an update removes, widened by the update's error, must hold that of
/// each tetrahedron that it creates, widened by the error of the update which removes that one.
#[derive(Debug)]
pub(crate) struct Margins {
    /// Levels of each field's whole range: by so many an error of 1 widens a range.
    levels: Vec<f64>,
    /// The ranges of levels of what each update removes, field by field.
    removed: Vec<[i32; 2]>,
}

/// An update whose error is too large for one of its parents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Excess {
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
        let levels = info.fields.iter().map(|field| field.range() / field.step).collect();
        Self { levels, removed: Vec::new() }
    }

    #[cfg(feature = "build")]
    pub fn fields(&self) -> usize {
        self.levels.len()
    }

    /// By how much the error of a parent must be larger, if a tetrahedron between the two is so many levels beyond the range of what
    /// the parent removes.
    #[cfg(feature = "build")]
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
        let fields = self.levels.len();
        let first = parents.len();
        parents.extend(tets.iter().filter_map(|&t| mt.creator(mesh, t)));
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
        let own = self.removed.len();
        self.removed.resize(own + fields, [i32::MAX, i32::MIN]);
        for &t in tets {
            let Some(corners) = mesh.tet(t) else { continue };
            let parent = mt.creator(mesh, t).and_then(|p| parents[first..].binary_search(&p).ok());
            for field in 0..fields {
                let values = corners.map(|v| mesh.levels(v).get(field).copied().unwrap_or(0));
                let (low, high) = values.iter().fold((i32::MAX, i32::MIN), |(l, h), &x| (l.min(x), h.max(x)));
                let all = &mut self.removed[own + field];
                *all = [all[0].min(low), all[1].max(high)];
                let Some(at) = parent else { continue };
                let known = parents[first + at].0 as usize * fields + field;
                // An update that depends on a later one is refused elsewhere.
                let Some(&[least, most]) = self.removed.get(known) else { continue };
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
        let arcs = parents.iter().zip(beyond.chunks(self.levels.len().max(1)));
        let mut near = None;
        for (&parent, beyond) in arcs {
            for (field, &beyond) in beyond.iter().enumerate() {
                let [own, above] = [u, parent].map(|u| mt.error_of_field(u, field));
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

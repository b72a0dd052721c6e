//! Criteria of the caller's own.

use super::{ANY, BlockData, Criterion, TetData, Verdict};
use crate::geom::{Bounds, Lattice, lattice_box};
use std::fmt;

/// A criterion from a closure that returns the excess of a tetrahedron (see [`Verdict::excess`]).
///
/// The change of such a criterion from one request to the next is unknown, so everything is evaluated again each time.
/// Add it to other needs with [`LodCriterion::and`](super::LodCriterion::and).
///
/// ```
/// use tetralod::refine::Custom;
/// // Within 1 % of the range left of x = 1000 on the lattice: some corner is there, or the tetrahedron is cut by the plane.
/// let left = Custom::new(|tet| {
///     let wanted = tet.corners.iter().any(|corner| corner[0] <= 1000);
///     if wanted { tet.error.error() / 0.01 } else { 0.0 }
/// });
/// ```
pub struct Custom<F> {
    excess: F,
    monotone: bool,
}

impl<F: Fn(&TetData<'_>) -> f64 + Send + Sync + 'static> Custom<F> {
    /// A criterion that is refined from the base mesh each time: correct for any closure.
    pub fn new(excess: F) -> Self {
        Self { excess, monotone: false }
    }

    /// A criterion that the caller knows to be monotone (see [`crate::refine`]): it is refined from the current mesh.
    /// If it is not monotone, the mesh still satisfies it but may depend on earlier requests.
    pub fn monotone(excess: F) -> Self {
        Self { excess, monotone: true }
    }
}

impl<F> fmt::Debug for Custom<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Custom").field("monotone", &self.monotone).finish_non_exhaustive()
    }
}

impl<F: Fn(&TetData<'_>) -> f64 + Send + Sync + 'static> Criterion for Custom<F> {
    fn judge(&self, tet: &TetData<'_>) -> Verdict {
        let excess = (self.excess)(tet);
        // NaN is no violation. The slack is unknown, so the tetrahedron is evaluated again after every change.
        Verdict { excess: if excess > 0.0 { excess } else { 0.0 }, slack: 0.0, component: ANY }
    }

    fn is_monotone(&self) -> bool {
        self.monotone
    }
}

/// A criterion of the caller's own that asks for nothing outside of a box: of other tetrahedra, whose own boxes do not meet that one, it is
/// not asked. So the index of a file tells what it can need, and all of that is fetched at once.
///
/// ```
/// # use tetralod::geom::Bounds;
/// # use tetralod::mt::MtInfo;
/// use tetralod::refine::{Custom, Inside};
/// # fn large_ones(info: &MtInfo) -> Inside<impl tetralod::refine::Criterion> {
/// let bounds = Bounds { min: [0.0; 3], max: [0.5; 3] };
/// let large = Custom::new(|tet| 100.0 * tet.error.error());
/// Inside::new(large, bounds, info.lattice)
/// # }
/// ```
#[derive(Debug)]
pub struct Inside<C> {
    criterion: C,
    bounds: Bounds,
    lattice: Lattice,
}

impl<C: Criterion> Inside<C> {
    /// Limits a criterion to a box in model units, for an MT with this lattice.
    pub fn new(criterion: C, bounds: Bounds, lattice: Lattice) -> Self {
        Self { criterion, bounds, lattice }
    }

    /// Whether a box on the lattice meets that of the criterion. Coordinates keep their order when they are rounded: a larger box meets it if
    /// a smaller one does.
    fn is_met_by(&self, [low, high]: [[i32; 3]; 2]) -> bool {
        let [low, high] = [low, high].map(|corner| self.lattice.point(corner));
        (0..3).all(|k| low[k] <= self.bounds.max[k] && self.bounds.min[k] <= high[k])
    }

    fn applies_to(&self, tet: &TetData<'_>) -> bool {
        lattice_box(tet.corners.iter().copied()).is_some_and(|bounds| self.is_met_by(bounds))
    }
}

impl<C: Criterion> Criterion for Inside<C> {
    fn judge(&self, tet: &TetData<'_>) -> Verdict {
        if self.applies_to(tet) { self.criterion.judge(tet) } else { Verdict::NEVER }
    }

    fn rank(&self, tet: &TetData<'_>) -> Verdict {
        if self.applies_to(tet) { self.criterion.rank(tet) } else { Verdict::NEVER }
    }

    fn judge_all(&self, tets: &[TetData<'_>]) -> Vec<Verdict> {
        let applies: Vec<bool> = tets.iter().map(|tet| self.applies_to(tet)).collect();
        let inside: Vec<TetData<'_>> =
            tets.iter().zip(&applies).filter(|(_, applies)| **applies).map(|(tet, _)| *tet).collect();
        let mut verdicts = self.criterion.judge_all(&inside).into_iter();
        let verdict = |applies| if applies { verdicts.next() } else { None };
        applies.into_iter().map(verdict).map(|verdict| verdict.unwrap_or(Verdict::NEVER)).collect()
    }

    fn may_need(&self, block: &BlockData<'_>) -> Option<bool> {
        let is_met = self.is_met_by(block.bounds);
        if is_met { self.criterion.may_need(block).or(Some(true)) } else { Some(false) }
    }

    fn is_batched(&self) -> bool {
        self.criterion.is_batched()
    }

    /// The box of a tetrahedron may meet that of the criterion where those of the tetrahedra before it do not.
    fn is_monotone(&self) -> bool {
        false
    }
}

//! Criteria of the caller's own.

use super::{ANY, Criterion, TetData, Verdict};
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

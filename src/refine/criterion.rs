//! LOD criteria: functions of a tetrahedron and its error.

use crate::mt::{ErrorCode, UpdateId};
use std::any::Any;
use std::fmt;

/// A tetrahedron of the MT as criteria see it.
#[derive(Clone, Copy)]
pub struct TetData<'a> {
    /// Positions of its corners on the lattice, in any positive order: verdicts must not depend on which.
    pub corners: &'a [[i32; 3]; 4],
    /// Levels of a field at its corners.
    pub levels: &'a dyn Fn(usize) -> [i32; 4],
    /// The error of the tetrahedron, the largest one of all fields: that of the update that removes it, or its own error.
    pub error: ErrorCode,
    /// The error of the tetrahedron in each field.
    pub errors: &'a [ErrorCode],
    /// The update that removes it.
    pub update: UpdateId,
    /// Its region, as an index into [`Regions::all`](crate::mt::Regions::all); 0 if the MT has none.
    pub region: u16,
}

impl TetData<'_> {
    /// The error of the tetrahedron in one field, or the largest one of all.
    #[inline]
    pub fn error_of(&self, field: Option<usize>) -> ErrorCode {
        field.and_then(|f| self.errors.get(f)).copied().unwrap_or(self.error)
    }
}

/// A block of updates as criteria see it, by what the index of a file says: what its updates, and all that depend on them, can be like.
#[derive(Clone, Copy, Debug)]
pub struct BlockData<'a> {
    /// A box on the lattice that holds every tetrahedron that one of them removes: its least and its largest corner.
    pub bounds: [[i32; 3]; 2],
    /// Field by field, the least and the largest level in these.
    pub ranges: &'a [[i32; 2]],
    /// Field by field, their largest error.
    pub errors: &'a [ErrorCode],
    /// The first update of the block.
    pub first: UpdateId,
    /// The regions of these tetrahedra, ascending; empty if the MT has none.
    pub regions: &'a [u16],
}

impl BlockData<'_> {
    /// The box as six tetrahedra, one for each order of the axes: each goes from the least to the largest corner along its edges.
    pub fn tets(&self) -> [[[i32; 3]; 4]; 6] {
        const ORDERS: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [1, 0], [2, 1], [0, 2]];
        let [low, high] = self.bounds;
        std::array::from_fn(|i| {
            let [first, second] = ORDERS[i];
            let mut one = low;
            one[first] = high[first];
            let mut two = one;
            two[second] = high[second];
            // The second half of the orders turns the other way.
            if i < 3 { [low, one, two, high] } else { [low, two, one, high] }
        })
    }
}

/// The result of a criterion for a tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// The error of the tetrahedron divided by the allowed error: above 1 it violates the request, and its remover has to be
    /// applied. Under a budget, larger values come first.
    pub excess: f64,
    /// How far the criterion may move (see [`Criterion::distance`]) before the tetrahedron can begin or cease to violate it.
    /// Any smaller number is right as well.
    pub slack: f64,
    /// The component of the movement that counts: [`ANY`], or one of the criterion's own, up to [`COMPONENTS`] - 1.
    pub component: u8,
}

/// Any movement of the criterion.
pub const ANY: u8 = 0;
/// The number of components of movement.
pub const COMPONENTS: usize = 8;
/// The components of the planes of regions and view frustums: this and the next ones.
pub(super) const PLANES: u8 = 1;
pub(super) const PLANE_COMPONENTS: usize = 6;
/// The component of tolerances.
pub(super) const TOLERANCE: u8 = 7;

impl Verdict {
    /// A tetrahedron that no criterion of the same kind can violate.
    pub const NEVER: Self = Self { excess: 0.0, slack: f64::INFINITY, component: ANY };

    /// Whether the tetrahedron violates the request.
    #[inline]
    pub fn violates(self) -> bool {
        self.excess > 1.0
    }

    /// The verdict of the union of two criteria: a violation lasts until both end, and begins when the first one
    /// begins.
    #[inline]
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        match (self.violates(), other.violates()) {
            (true, false) => self,
            (false, true) => other,
            (false, false) if other.slack == f64::INFINITY && other.excess == 0.0 => self,
            (false, false) if self.slack == f64::INFINITY && self.excess == 0.0 => other,
            (asks, _) => Self {
                excess: self.excess.max(other.excess),
                slack: if asks { self.slack.max(other.slack) } else { self.slack.min(other.slack) },
                component: if self.component == other.component { self.component } else { ANY },
            },
        }
    }
}

/// Decides which tetrahedra violate a request. [`crate::refine`] defines *monotone*.
pub trait Criterion: Any + fmt::Debug + Send + Sync {
    /// Evaluates a tetrahedron. The result depends only on `tet` and the criterion.
    fn judge(&self, tet: &TetData<'_>) -> Verdict;

    /// [`Criterion::judge`] with an exact excess, by which violations can be compared. Called under a budget only,
    /// since it may cost more.
    fn rank(&self, tet: &TetData<'_>) -> Verdict {
        self.judge(tet)
    }

    /// Evaluates many tetrahedra at once, each as [`Criterion::judge`] does; for criteria that are
    /// [batched](Criterion::is_batched).
    fn judge_all(&self, tets: &[TetData<'_>]) -> Vec<Verdict> {
        tets.iter().map(|tet| self.judge(tet)).collect()
    }

    /// Whether a tetrahedron that is removed by an update of the block, or by one that depends on it, can violate the criterion: if not,
    /// the block need not be fetched. None if the criterion cannot tell from blocks; then what is needed shows as the mesh is refined, with
    /// one wait after the other.
    fn may_need(&self, block: &BlockData<'_>) -> Option<bool> {
        let _ = block;
        None
    }

    /// Whether evaluating many tetrahedra at once is much cheaper than one by one.
    fn is_batched(&self) -> bool {
        false
    }

    /// The tolerances, if the criterion is the same everywhere.
    fn uniform(&self) -> Option<Vec<Tolerance>> {
        None
    }

    /// The field whose errors the criterion measures, if it is a single one.
    fn field(&self) -> Option<usize> {
        None
    }

    /// The largest tolerance of the field's error; [`ErrorCode::MAX`] if unknown.
    fn tolerance(&self) -> ErrorCode {
        ErrorCode::MAX
    }

    /// Whether the criterion is monotone. Others are refined from the base mesh each time.
    fn is_monotone(&self) -> bool {
        true
    }

    /// The distance of this criterion from the one before, in the unit of [`Verdict::slack`]. Infinity is always
    /// correct; every tetrahedron is then evaluated again.
    fn distance(&self, before: &dyn Criterion) -> f64 {
        let _ = before;
        f64::INFINITY
    }

    /// One component of that distance, for verdicts with this [`Verdict::component`].
    fn component_distance(&self, before: &dyn Criterion, component: u8) -> f64 {
        let _ = component;
        self.distance(before)
    }
}

/// The allowed error of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tolerance {
    /// The field; all of them if none.
    pub field: Option<usize>,
    /// The largest allowed error.
    pub error: ErrorCode,
}

/// The component of a plane.
#[inline]
pub(super) fn component_of(plane: Option<usize>) -> u8 {
    plane.map_or(ANY, |plane| PLANES + (plane % PLANE_COMPONENTS) as u8)
}

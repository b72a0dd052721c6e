//! LOD criteria: functions of a tetrahedron and its error.

use super::camera::Camera;
use super::palette::Palette;
use super::shape::Shape;
use super::{Need, Part, Request, Values};
use crate::geom::Lattice;
use crate::mt::{ErrorCode, MtInfo, UpdateId};
use glam::DVec3;
use std::any::Any;
use std::fmt;
use std::sync::Arc;

/// A tetrahedron of the MT as criteria see it.
#[derive(Clone, Copy)]
pub struct TetData<'a> {
    /// Positions of its corners on the lattice, in any positive order: verdicts must not depend on which.
    pub corners: &'a [[i32; 3]; 4],
    /// Levels of a field at its corners.
    pub levels: &'a dyn Fn(usize) -> [i32; 4],
    /// Its error, the largest one of all fields: that of the update that removes it, or its own error.
    pub error: ErrorCode,
    /// The same for each field.
    pub errors: &'a [ErrorCode],
    /// That update.
    pub update: UpdateId,
}

impl TetData<'_> {
    /// Its error in one field, or the largest one of all.
    #[inline]
    pub fn error_of(&self, field: Option<usize>) -> ErrorCode {
        field.and_then(|f| self.errors.get(f)).copied().unwrap_or(self.error)
    }
}

/// The result of a criterion for a tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Its error divided by the allowed error: above 1 the tetrahedron violates the request, and its remover has to be
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
const PLANES: u8 = 1;
const PLANE_COMPONENTS: usize = 6;
/// The component of tolerances.
const TOLERANCE: u8 = 7;

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

/// The criterion of a [`Request`]: the union of its needs.
#[derive(Clone)]
pub struct LodCriterion {
    frame: Frame,
    atoms: Vec<Atom>,
    custom: Vec<Arc<dyn Criterion>>,
    monotone: bool,
}

/// The domain: criteria compute in model units from its middle.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Frame {
    lattice: Lattice,
    pub middle: DVec3,
    /// From the lattice to there.
    shift: DVec3,
    step: DVec3,
    /// No point of a mesh is further from the middle.
    pub reach: f64,
    /// Nor along the axes than this.
    pub half: DVec3,
    /// The displacement that counts as an error of 1.
    pub displacement: f64,
    /// Updates of the MT.
    updates: f64,
    /// By how much regions are widened for the first update beyond its error. It falls to 0 for the last one, by more
    /// than the rounding error from each update to the next. Parents have smaller numbers than their children, so
    /// rounding cannot select a child without its parent.
    guard: f64,
}

/// Rounding of the functions of shapes is below this part of the domain's size.
const ROUNDING: f64 = 1.0 / (1_u64 << 44) as f64;

impl Frame {
    fn new(info: &MtInfo) -> Self {
        let lattice = info.lattice;
        let step = DVec3::from(lattice.step);
        let size = step * f64::from(1_u32 << lattice.bits);
        let middle = DVec3::from(lattice.origin) + 0.5 * size;
        let reach = 0.5 * size.length();
        let updates = f64::from(info.updates.max(1));
        Self {
            lattice,
            middle,
            shift: -0.5 * size,
            step,
            reach,
            half: 0.5 * size,
            displacement: info.displacement_per_error,
            updates,
            guard: 4.0 * ROUNDING * updates * reach,
        }
    }

    /// Corners in model units, from the middle.
    #[inline]
    pub fn place(&self, corners: &[[i32; 3]; 4]) -> [DVec3; 4] {
        corners.map(|q| {
            let q = DVec3::new(f64::from(q[0]), f64::from(q[1]), f64::from(q[2]));
            self.shift + self.step * q
        })
    }

    /// How far from a region a tetrahedron may be and still count: as far as its error may have displaced it.
    #[inline]
    pub fn margin(&self, tet: &TetData<'_>) -> f64 {
        tet.error.error() * self.displacement + self.guard * (1.0 - f64::from(tet.update.0) / self.updates)
    }
}

/// A part of a need, prepared for evaluation. A need with several ranges of values becomes several atoms.
#[derive(Clone, Debug)]
struct Atom {
    /// The field whose error counts, if it is not the largest one of all.
    field: Option<usize>,
    measure: Measure,
}

/// The quantity that an atom bounds.
#[derive(Clone, Debug)]
enum Measure {
    Field(FieldAtom),
    View { pixels: f64, camera: Camera },
    Transfer { error: f64, palette: Palette },
}

/// The error of the field, in a region, around values, or both.
#[derive(Clone, Debug)]
struct FieldAtom {
    tolerance: ErrorCode,
    shape: Option<Shape>,
    values: Option<Range>,
}

/// A range of a field, in levels.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Range {
    field: usize,
    /// The same, where there are others.
    error_of: Option<usize>,
    low: f64,
    high: f64,
    /// Levels of the field's whole range: by so much an error of 1 widens the range.
    levels: f64,
}

/// The smallest divisor of an excess: below the smallest error that can be stored, so that any error violates an error
/// of 0.
const LEAST_ERROR: f64 = 1.0 / (1_u64 << 26) as f64;

/// A scale on which a factor of 2 is a distance of [`OCTAVE`], without a logarithm: exact at powers of 2, linear between them.
/// Distances on it are sums of parts, whatever lies between. `x` is positive and finite.
pub(super) fn octaves(x: f64) -> f64 {
    OCTAVE * (x.to_bits() as f64 / (1_u64 << 52) as f64)
}

impl LodCriterion {
    /// The criterion of `request` for an MT. The caller checks that its fields exist; the budget is not part of the
    /// criterion.
    pub fn new(info: &MtInfo, request: &Request) -> Self {
        let frame = Frame::new(info);
        let monotone = !request.needs.iter().any(|need| matches!(need.part, Part::Both(..)));
        let atoms = request.needs.iter().flat_map(|need| atoms(info, &frame, need)).collect();
        Self { frame, atoms, custom: Vec::new(), monotone }
    }

    /// Adds a criterion of the caller's own to the union.
    #[must_use]
    pub fn and(mut self, custom: Arc<dyn Criterion>) -> Self {
        self.monotone &= custom.is_monotone();
        self.custom.push(custom);
        self
    }

    #[inline]
    fn union(&self, tet: &TetData<'_>, ranked: bool) -> Verdict {
        let corners = self.frame.place(tet.corners);
        let mut union = Verdict::NEVER;
        for atom in &self.atoms {
            union = union.or(atom.judge(&self.frame, tet, &corners, ranked));
        }
        for custom in &self.custom {
            union = union.or(if ranked { custom.rank(tet) } else { custom.judge(tet) });
        }
        union
    }
}

fn atoms(info: &MtInfo, frame: &Frame, need: &Need) -> Vec<Atom> {
    let tolerance = ErrorCode::at_most(need.error);
    // A single field's error is the largest.
    let error_of = |field: Option<usize>| field.filter(|_| info.fields.len() > 1);
    let atom = |measure: Measure| Atom { field: error_of(need.measured_field()), measure };
    let field = |shape: Option<Shape>, values| atom(Measure::Field(FieldAtom { tolerance, shape, values }));
    let ranges = |values: &Values| {
        let field = values.field.min(info.fields.len() - 1);
        let error_of = error_of(Some(field));
        let info = &info.fields[field];
        let level = move |value: f64| (value - info.origin) / info.step;
        let levels = info.range() / info.step;
        let range =
            move |r: &[f64; 2]| Some(Range { field, error_of, low: level(r[0]), high: level(r[1]), levels });
        values.ranges.iter().map(range).collect::<Vec<_>>()
    };
    match &need.part {
        Part::Everywhere => vec![field(None, None)],
        Part::Region(region) => vec![field(Some(Shape::new(region, frame.middle)), None)],
        Part::Values(values) => ranges(values).into_iter().map(|range| field(None, range)).collect(),
        Part::Both(region, values) => {
            let shape = Shape::new(region, frame.middle);
            ranges(values).into_iter().map(|range| field(Some(shape.clone()), range)).collect()
        }
        Part::View(view) => {
            vec![atom(Measure::View { pixels: need.error, camera: Camera::new(view, frame) })]
        }
        Part::Transfer(transfer) => {
            let field = &info.fields[transfer.field.min(info.fields.len() - 1)];
            vec![atom(Measure::Transfer { error: need.error, palette: Palette::new(transfer, field) })]
        }
    }
}

impl Criterion for LodCriterion {
    #[inline]
    fn judge(&self, tet: &TetData<'_>) -> Verdict {
        self.union(tet, false)
    }

    fn rank(&self, tet: &TetData<'_>) -> Verdict {
        self.union(tet, true)
    }

    fn judge_all(&self, tets: &[TetData<'_>]) -> Vec<Verdict> {
        let own = |tet: &TetData<'_>| {
            let corners = self.frame.place(tet.corners);
            let atoms = self.atoms.iter().map(|atom| atom.judge(&self.frame, tet, &corners, true));
            atoms.fold(Verdict::NEVER, Verdict::or)
        };
        let mut verdicts: Vec<Verdict> = tets.iter().map(own).collect();
        for custom in &self.custom {
            verdicts.iter_mut().zip(custom.judge_all(tets)).for_each(|(all, one)| *all = all.or(one));
        }
        verdicts
    }

    fn is_batched(&self) -> bool {
        self.custom.iter().any(|custom| custom.is_batched())
    }

    fn uniform(&self) -> Option<Vec<Tolerance>> {
        let everywhere = |atom: &Atom| match atom.measure {
            Measure::Field(FieldAtom { tolerance: error, shape: None, values: None }) => {
                Some(Tolerance { field: atom.field, error })
            }
            _ => None,
        };
        let all: Option<Vec<_>> = self.atoms.iter().map(everywhere).collect();
        all.filter(|_| self.custom.is_empty())
    }

    fn field(&self) -> Option<usize> {
        let first = self.atoms.first()?.field?;
        let alone = self.custom.is_empty() && self.atoms.iter().all(|atom| atom.field == Some(first));
        alone.then_some(first)
    }

    fn tolerance(&self) -> ErrorCode {
        let of = |atom: &Atom| {
            if let Measure::Field(measure) = &atom.measure { Some(measure.tolerance) } else { None }
        };
        let unmeasured = if self.atoms.is_empty() { ErrorCode::ZERO } else { ErrorCode::MAX };
        let own = self.atoms.iter().filter_map(of).max().unwrap_or(unmeasured);
        self.custom.iter().fold(own, |largest, custom| largest.max(custom.tolerance()))
    }

    /// With region and values together, one of the tetrahedra that an update removes meets the region and one takes a
    /// value of the range, but these may be different ones.
    fn is_monotone(&self) -> bool {
        self.monotone
    }

    fn distance(&self, before: &dyn Criterion) -> f64 {
        let before: &dyn Any = before;
        let Some(before) = before.downcast_ref::<Self>() else { return f64::INFINITY };
        let same = self.frame == before.frame
            && self.atoms.len() == before.atoms.len()
            && self.custom.len() == before.custom.len();
        if !same {
            return f64::INFINITY;
        }
        let pairs = self.atoms.iter().zip(&before.atoms);
        let own = pairs.map(|(a, b)| a.distance(b, &self.frame));
        let custom = self.custom.iter().zip(&before.custom);
        let custom = custom.map(|(a, b)| if Arc::ptr_eq(a, b) { 0.0 } else { a.distance(&**b) });
        own.chain(custom).fold(0.0, f64::max)
    }

    fn component_distance(&self, before: &dyn Criterion, component: u8) -> f64 {
        let any: &dyn Any = before;
        match any.downcast_ref::<Self>() {
            Some(other)
                if component != ANY && self.custom.is_empty() && self.atoms.len() == other.atoms.len() =>
            {
                let pairs = self.atoms.iter().zip(&other.atoms);
                pairs.fold(0.0, |m, (a, b)| f64::max(m, a.component_distance(b, &self.frame, component)))
            }
            _ => self.distance(before),
        }
    }
}

impl Atom {
    // Not inlined: it is large.
    #[inline(never)]
    fn judge(&self, frame: &Frame, tet: &TetData<'_>, corners: &[DVec3; 4], ranked: bool) -> Verdict {
        let narrowed;
        let tet = if self.field.is_none() {
            tet
        } else {
            narrowed = TetData { error: tet.error_of(self.field), ..*tet };
            &narrowed
        };
        match &self.measure {
            Measure::Field(atom) => atom.judge(frame, tet, corners),
            Measure::View { pixels, camera } => camera.judge(frame, tet, corners, *pixels, ranked),
            Measure::Transfer { error, palette } => {
                let change = palette.change(&(tet.levels)(palette.field), tet.error.error());
                let (change, error) = (change, error.max(LEAST_ERROR));
                if change <= 0.0 {
                    return Verdict::NEVER;
                }
                let slack = (octaves(change) - octaves(error)).abs();
                Verdict { excess: change / error, slack, component: ANY }
            }
        }
    }

    /// One component of the distance; not [`ANY`].
    fn component_distance(&self, before: &Self, frame: &Frame, component: u8) -> f64 {
        if self.field != before.field {
            return f64::INFINITY;
        }
        match (&self.measure, &before.measure) {
            (Measure::Field(a), Measure::Field(b)) => a.component_distance(b, frame, component),
            (Measure::View { pixels: p, camera: a }, Measure::View { pixels: q, camera: b }) => {
                a.component_distance(*p, b, *q, frame, usize::from(component - PLANES))
            }
            _ => self.distance(before, frame),
        }
    }

    fn distance(&self, before: &Self, frame: &Frame) -> f64 {
        if self.field != before.field {
            return f64::INFINITY;
        }
        match (&self.measure, &before.measure) {
            (Measure::Field(a), Measure::Field(b)) => a.distance(b, frame),
            (Measure::View { pixels: p, camera: a }, Measure::View { pixels: q, camera: b }) => {
                a.distance(*p, b, *q, frame)
            }
            (Measure::Transfer { error: e, palette: a }, Measure::Transfer { error: f, palette: b })
                if a == b =>
            {
                (octaves(e.max(LEAST_ERROR)) - octaves(f.max(LEAST_ERROR))).abs()
            }
            _ => f64::INFINITY,
        }
    }
}

/// The component of a plane.
pub(super) fn component_of(plane: Option<usize>) -> u8 {
    plane.map_or(ANY, |plane| PLANES + (plane % PLANE_COMPONENTS) as u8)
}

/// Errors have codes that are 2^11 to the octave. An octave is as much as sixteen ways through the domain: regions move
/// often, tolerances seldom, and each has a component of its own.
const CODES: f64 = 2048.0 / OCTAVE;
const OCTAVE: f64 = 16.0;

fn octaves_between(a: ErrorCode, b: ErrorCode) -> f64 {
    f64::from(a.0.abs_diff(b.0)) / CODES
}

impl FieldAtom {
    #[inline]
    fn judge(&self, frame: &Frame, tet: &TetData<'_>, corners: &[DVec3; 4]) -> Verdict {
        let exceeds = tet.error > self.tolerance;
        let mut conditions = Conditions::new();
        conditions.add(exceeds, octaves_between(tet.error, self.tolerance), TOLERANCE);
        if let Some(range) = &self.values {
            let inside = range.inside(&(tet.levels)(range.field), tet.error_of(range.error_of).error());
            conditions.add(inside >= 0.0, inside.abs() / range.levels, ANY);
        }
        // The dearest comes last, and only where it can matter.
        if let Some(shape) = &self.shape {
            let margin = frame.margin(tet);
            let (outside, plane) = shape.least(corners, margin);
            conditions.add(outside <= margin, (outside - margin).abs() / frame.reach, component_of(plane));
        }
        if !conditions.all {
            return Verdict { excess: 0.0, slack: conditions.missing, component: conditions.component };
        }
        let excess = tet.error.error() / self.tolerance.error().max(LEAST_ERROR);
        Verdict { excess, slack: conditions.held, component: ANY }
    }

    fn component_distance(&self, before: &Self, frame: &Frame, component: u8) -> f64 {
        if component == TOLERANCE {
            return octaves_between(self.tolerance, before.tolerance);
        }
        match (&self.shape, &before.shape) {
            (Some(a), Some(b)) => {
                a.approach(b, frame.half, usize::from(component - PLANES), PLANE_COMPONENTS) / frame.reach
            }
            _ => 0.0,
        }
    }

    fn distance(&self, before: &Self, frame: &Frame) -> f64 {
        let errors = octaves_between(self.tolerance, before.tolerance);
        let shapes = match (&self.shape, &before.shape) {
            (None, None) => 0.0,
            (Some(a), Some(b)) => a.difference(b, frame.half) / frame.reach,
            _ => f64::INFINITY,
        };
        let values = match (&self.values, &before.values) {
            (None, None) => 0.0,
            (Some(a), Some(b)) if (a.field, a.levels) == (b.field, b.levels) => {
                (a.low - b.low).abs().max((a.high - b.high).abs()) / a.levels
            }
            _ => f64::INFINITY,
        };
        // Sides at the same infinity differ by NaN, which `max` ignores.
        errors.max(shapes).max(values)
    }
}

/// The conjunction of conditions, with its slack.
struct Conditions {
    all: bool,
    /// The least slack of the conditions that hold.
    held: f64,
    /// The largest slack of the conditions that do not hold, and its component.
    missing: f64,
    component: u8,
}

impl Conditions {
    fn new() -> Self {
        Self { all: true, held: f64::INFINITY, missing: 0.0, component: ANY }
    }

    #[inline]
    fn add(&mut self, holds: bool, slack: f64, component: u8) {
        if holds {
            self.held = self.held.min(slack);
        } else {
            if self.all || slack > self.missing {
                (self.missing, self.component) = (slack, component);
            }
            self.all = false;
        }
    }
}

impl Range {
    /// By how many levels the values of a tetrahedron reach into the range, widened by the error; negative if they do not.
    #[inline]
    fn inside(&self, levels: &[i32; 4], error: f64) -> f64 {
        // Half a level: the reference values themselves were rounded to levels.
        let margin = error * self.levels + 0.5;
        let low = f64::from(levels[0].min(levels[1]).min(levels[2].min(levels[3])));
        let high = f64::from(levels[0].max(levels[1]).max(levels[2].max(levels[3])));
        margin - (low - self.high).max(self.low - high)
    }
}

impl fmt::Debug for LodCriterion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LodCriterion").field("atoms", &self.atoms.len()).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Lattice;
    use crate::mt::MtKind;

    #[test]
    fn margins_fall_by_more_than_rounding_from_each_update_to_the_next() {
        let updates = 1000;
        let info = MtInfo {
            kind: MtKind::HalfEdge,
            lattice: Lattice { origin: [5.8e6, 0.0, -1.0], step: [0.1; 3], bits: 6 },
            fields: Vec::new(),
            vertices: 0,
            tetrahedra: 0,
            updates,
            displacement_per_error: 1.0,
            quantization: 0.0,
            bounds: None,
        };
        let frame = Frame::new(&info);
        let margin = |update: u32| {
            let levels = |_: usize| [0; 4];
            let (corners, error, update) = (&[[0; 3]; 4], ErrorCode::ZERO, UpdateId(update));
            frame.margin(&TetData { corners, levels: &levels, error, errors: &[], update })
        };
        for update in 1..updates {
            assert!(margin(update - 1) - margin(update) > ROUNDING * frame.reach, "{update}");
        }
        assert!(margin(0) < 1e-6 * frame.reach);
    }
}

//! The criterion of a request: the union of its needs.

use super::camera::Camera;
use super::criterion::{
    ANY, BlockData, Criterion, PLANE_COMPONENTS, PLANES, TOLERANCE, TetData, Tolerance, Verdict, component_of,
};
use super::frame::Frame;
use super::palette::Palette;
use super::request::{Need, Part, Request, Values};
use super::shape::Shape;
use crate::mesh::BitSet;
use crate::mt::{ErrorCode, MtInfo};
use glam::DVec3;
use std::any::Any;
use std::fmt;
use std::sync::Arc;

/// The criterion of a [`Request`]: the union of its needs.
#[derive(Clone)]
pub struct LodCriterion {
    frame: Frame,
    atoms: Vec<Atom>,
    custom: Vec<Arc<dyn Criterion>>,
    monotone: bool,
}

/// A part of a need, prepared for evaluation. A need with several ranges of values becomes several atoms.
#[derive(Clone, Debug)]
struct Atom {
    /// The field whose error counts, if it is not the largest one of all.
    field: Option<usize>,
    /// The regions in which it counts; all if there is no set.
    regions: Option<Arc<BitSet>>,
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
    /// The field whose error widens the range; none if the MT has no other field.
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
fn octaves(x: f64) -> f64 {
    OCTAVE * (x.to_bits() as f64 / (1_u64 << 52) as f64)
}

impl LodCriterion {
    /// The criterion of `request` for an MT. The caller checks that its fields exist; the budget is not part of the
    /// criterion.
    pub fn new(info: &MtInfo, request: &Request) -> Self {
        let frame = Frame::new(info);
        // Where something is asked for in some regions alone, one of the tetrahedra that an update removes may be in the region, and another
        // one where the part is. Of the whole of a region, what creates a tetrahedron removes one of the same region.
        let is_monotone = |need: &Need| match need.part {
            Part::Both(..) => false,
            Part::Everywhere => true,
            _ => need.regions.is_none(),
        };
        let monotone = request.needs.iter().all(is_monotone);
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
    let regions = need.regions.as_ref();
    let regions: Option<Arc<BitSet>> =
        regions.map(|regions| Arc::new(regions.iter().map(|&region| region.into()).collect()));
    let atom =
        |measure: Measure| Atom { field: error_of(need.measured_field()), regions: regions.clone(), measure };
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

    /// What holds for a tetrahedron holds for one of those that fill the block's box, with its largest error and all of its levels: every
    /// measure asks for a point where some function is small enough, and is the looser the larger the error.
    fn may_need(&self, block: &BlockData<'_>) -> Option<bool> {
        let levels =
            |field: usize| block.ranges.get(field).map_or([0; 4], |&[low, high]| [low, high, low, high]);
        let error = block.errors.iter().copied().fold(ErrorCode::ZERO, ErrorCode::max);
        let asks = |corners: [[i32; 3]; 4]| {
            let tet = TetData {
                corners: &corners,
                levels: &levels,
                error,
                errors: block.errors,
                update: block.first,
                region: 0,
            };
            let placed = self.frame.place(&corners);
            let mut atoms = self.atoms.iter().filter(|atom| atom.meets(block.regions));
            atoms.any(|atom| atom.measure_of(&self.frame, &tet, &placed, false).violates())
        };
        let mut is_needed = block.tets().into_iter().any(asks);
        for custom in &self.custom {
            is_needed |= custom.may_need(block)?;
        }
        Some(is_needed)
    }

    fn is_batched(&self) -> bool {
        self.custom.iter().any(|custom| custom.is_batched())
    }

    fn uniform(&self) -> Option<Vec<Tolerance>> {
        let everywhere = |atom: &Atom| match atom.measure {
            Measure::Field(FieldAtom { tolerance: error, shape: None, values: None })
                if atom.regions.is_none() =>
            {
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
    fn judge(&self, frame: &Frame, tet: &TetData<'_>, corners: &[DVec3; 4], ranked: bool) -> Verdict {
        // Whoever asks for other regions is infinitely far away.
        match &self.regions {
            Some(regions) if !regions.has(u32::from(tet.region)) => Verdict::NEVER,
            _ => self.measure_of(frame, tet, corners, ranked),
        }
    }

    /// Whether it counts in one of these regions of a block; none are known of an MT without regions.
    fn meets(&self, of_block: &[u16]) -> bool {
        self.regions.as_ref().is_none_or(|regions| of_block.iter().any(|&r| regions.has(u32::from(r))))
    }

    /// What it says of a tetrahedron in one of its regions.
    // Not inlined: it is large.
    #[inline(never)]
    fn measure_of(&self, frame: &Frame, tet: &TetData<'_>, corners: &[DVec3; 4], ranked: bool) -> Verdict {
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
        if (self.field, &self.regions) != (before.field, &before.regions) {
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
        if (self.field, &self.regions) != (before.field, &before.regions) {
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
        let of_error = octaves_between(tet.error, self.tolerance);
        if tet.error <= self.tolerance {
            // Wherever it lies: the tolerance seldom moves, and what is asked for at other places changes nothing.
            return Verdict { excess: 0.0, slack: of_error, component: TOLERANCE };
        }
        let mut conditions = Conditions::new(of_error);
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
    /// With one that holds.
    fn new(slack: f64) -> Self {
        Self { all: true, held: slack, missing: 0.0, component: ANY }
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

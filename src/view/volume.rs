//! Light through a volume: emission and absorption along rays (Max, *Optical models for direct volume rendering*, 1995),
//! integrated through the piecewise linear field.
//!
//! A transfer function gives each value of the field a colour `c` and an opacity. The opacity is that of a way of the *unit
//! length* through a constant field: the extinction is `σ = −ln(1 − opacity) / unit length`. Along a ray from 0 to `d`, the
//! light that arrives at its start is
//!
//! ```text
//! ∫ c(s(t)) σ(s(t)) T(t) dt,   T(t) = exp(−∫ from 0 to t of σ(s(u)) du),   the opacity is 1 − T(d).
//! ```
//!
//! In a tetrahedron the field `s` is linear along the ray. Between the values at which the transfer function bends, colour and
//! extinction are linear in `s`, so the exponent is a parabola; the light is summed up by Gauss-Legendre quadrature in pieces of
//! little optical depth. So there are no steps along the ray, and nothing between samples is missed. This is the slow, plain twin that the
//! renderer is compared with.

use crate::geom::{Camera, SinglePoints, SingleValues};
use crate::view::{MeshView, Probe, Span};
use glam::DVec2;

/// Opacities are held below this, since 1 would take an infinite extinction.
const MOST_OPAQUE: f64 = 0.9999;

/// Parts of an interval of the transfer function, in each of which extinction is taken to be linear in the value.
const PARTS: usize = 16;

/// Largest optical depth of a piece that is summed up at once.
const PIECE_DEPTH: f64 = 0.25;

/// Most pieces between two bends of the transfer function: what lies behind so much is not seen.
const MOST_PIECES: f64 = 128.0;

/// A ray ends where less than this fraction of the light comes through.
const DARK: f64 = 1e-9;

/// Nodes and weights of Gauss-Legendre quadrature over 0 to 1; exact for polynomials of degree 7.
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// The colour and extinction of each value of a field.
#[derive(Clone, Debug, PartialEq)]
pub struct Medium {
    /// Where it bends; at least one, ascending. Linear in between, constant beyond.
    knots: Vec<Knot>,
}

/// What the medium is where the field has a value.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Knot {
    value: f64,
    colour: [f64; 3],
    /// For each model unit.
    extinction: f64,
}

/// Light that a piece of a ray adds, and the fraction that comes through it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Red, green, blue; 0 to 1 for colours of 0 to 1.
    pub colour: [f64; 3],
    /// The fraction of what is behind that comes through, 0 to 1.
    pub transmittance: f64,
}

impl Light {
    /// A ray through nothing.
    pub const NONE: Self = Self { colour: [0.0; 3], transmittance: 1.0 };

    /// This in front of `behind`.
    #[must_use]
    pub fn over(self, behind: Self) -> Self {
        Self {
            colour: [0, 1, 2].map(|k| self.colour[k] + self.transmittance * behind.colour[k]),
            transmittance: self.transmittance * behind.transmittance,
        }
    }

    /// The colour in front of an opaque background.
    pub fn on(self, background: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| self.colour[k] + self.transmittance * background[k])
    }
}

impl Medium {
    /// The medium of a transfer function: values in field units, ascending, each with `[red, green, blue, opacity]` of 0 to 1, of
    /// which the last is that of a way of `unit_length` model units.
    ///
    /// # Panics
    /// If there are no points, or `unit_length` is not positive.
    pub fn new(points: &[(f64, [f64; 4])], unit_length: f64) -> Self {
        assert!(!points.is_empty() && unit_length > 0.0, "a transfer function has points and a unit length");
        let knot = |value: f64, [r, g, b, opacity]: [f64; 4]| Knot {
            value,
            colour: [r, g, b],
            extinction: -(-opacity.clamp(0.0, MOST_OPAQUE)).ln_1p() / unit_length,
        };
        let mut knots = Vec::new();
        for pair in points.windows(2) {
            let [(from, first), (to, last)] = [pair[0], pair[1]];
            // Opacities are linear between points, extinctions are not.
            let parts = if first[3] == last[3] { 1 } else { PARTS };
            knots.extend((0..parts).map(|i| {
                let t = i as f64 / parts as f64;
                knot(from + t * (to - from), [0, 1, 2, 3].map(|k| first[k] + t * (last[k] - first[k])))
            }));
        }
        knots.extend(points.last().map(|&(value, colour)| knot(value, colour)));
        Self { knots }
    }

    /// The medium where points and values are stored in single precision.
    #[must_use]
    pub fn relative_to(&self, points: &SinglePoints, values: &SingleValues) -> Self {
        let knot = |knot: &Knot| Knot {
            value: values.relative(knot.value),
            extinction: knot.extinction * points.unit,
            ..*knot
        };
        Self { knots: self.knots.iter().map(knot).collect() }
    }

    /// What the medium is where the field is `value`.
    fn at(&self, value: f64) -> Knot {
        let after = self.knots.partition_point(|knot| knot.value <= value);
        match (after.checked_sub(1).map(|before| self.knots[before]), self.knots.get(after)) {
            (Some(before), Some(after)) => {
                before.towards(after, (value - before.value) / (after.value - before.value))
            }
            (Some(only), None) => Knot { value, ..only },
            (None, first) => first.map_or(self.knots[0], |first| Knot { value, ..*first }),
        }
    }

    /// The first and the last value where it bends, and a table of `count` values between them, evenly spaced: colour and extinction
    /// of each, then for each the integral over the values below it of colour times extinction, and of extinction.
    #[doc(hidden)]
    pub fn table(&self, count: usize) -> ([f64; 2], Vec<[f32; 4]>) {
        let [first, last] = [self.knots[0].value, self.knots[self.knots.len() - 1].value];
        // A constant medium has a table, too.
        let last = if last > first { last } else { first + 1.0 };
        let step = (last - first) / (count - 1) as f64;
        let entries: Vec<Knot> = (0..count).map(|i| self.at(first + i as f64 * step)).collect();
        let with = |c: [f64; 3], w: f64| [c[0] as f32, c[1] as f32, c[2] as f32, w as f32];
        let mut table: Vec<[f32; 4]> = entries.iter().map(|e| with(e.colour, e.extinction)).collect();
        let (mut colour, mut depth) = ([0.0; 3], 0.0);
        table.push(with(colour, depth));
        for pair in entries.windows(2) {
            let [a, b] = [pair[0], pair[1]];
            let mean = |k: usize| 0.5 * (a.colour[k] * a.extinction + b.colour[k] * b.extinction);
            (0..3).for_each(|k| colour[k] += step * mean(k));
            depth += step * 0.5 * (a.extinction + b.extinction);
            table.push(with(colour, depth));
        }
        ([first, last], table)
    }

    /// The light of a piece of a ray of `length` model units, along which the field goes from one value to another linearly.
    pub fn piece(&self, [from, to]: [f64; 2], length: f64) -> Light {
        let inside = |knot: &&Knot| from.min(to) < knot.value && knot.value < from.max(to);
        let mut knots: Vec<Knot> = self.knots.iter().filter(inside).copied().collect();
        if from > to {
            knots.reverse();
        }
        let mut light = Light::NONE;
        let (mut before, span) = (self.at(from), to - from);
        for knot in knots.into_iter().chain([self.at(to)]) {
            let part = if span == 0.0 { 1.0 } else { ((knot.value - before.value) / span).clamp(0.0, 1.0) };
            light = light.over(linear(before, knot, part * length));
            before = knot;
        }
        light
    }

    /// The light along a ray through a mesh: `spans` are the parts of a line of `length` model units, as [`Probe::line`] gives them.
    pub fn along(&self, mesh: &MeshView<'_>, spans: &[Span], length: f64) -> Light {
        let mut light = Light::NONE;
        for span in spans {
            let ends = [span.entry, span.exit].map(|place| place.value(mesh));
            light = light.over(self.piece(ends, (span.to - span.from) * length));
            if light.transmittance < DARK {
                break;
            }
        }
        light
    }

    /// The picture of a mesh that a camera sees, of `[width, height]` pixels: the light through the centre of each, row by row from the
    /// top. For tests and small pictures: each ray is cut with the tetrahedra around it.
    pub fn picture(&self, mesh: MeshView<'_>, camera: &Camera, [width, height]: [u32; 2]) -> Vec<Light> {
        let mut probe = Probe::new(mesh);
        probe.make_grid();
        let aspect = f64::from(width) / f64::from(height);
        let rays = camera.rays(aspect);
        let distances = mesh.positions.iter().map(|p| rays.origin[0].distance((*p).into()));
        let farthest = distances.fold(0.0, f64::max);
        let place = |i: u32, count: u32| 2.0 * (f64::from(i) + 0.5) / f64::from(count) - 1.0;
        let pixels = (0..height).flat_map(|row| (0..width).map(move |column| [column, row]));
        pixels
            .map(|[column, row]| {
                let ray = rays.at(DVec2::new(place(column, width), -place(row, height)));
                let length = 1.01 * (farthest + rays.origin[0].distance(ray.origin));
                self.along(&mesh, &probe.line(ray.origin.into(), ray.at(length).into()), length)
            })
            .collect()
    }
}

impl Knot {
    /// Between two knots, linear in `t` of 0 to 1.
    fn towards(&self, other: &Self, t: f64) -> Self {
        let mix = |a: f64, b: f64| a + t * (b - a);
        Self {
            value: mix(self.value, other.value),
            colour: [0, 1, 2].map(|k| mix(self.colour[k], other.colour[k])),
            extinction: mix(self.extinction, other.extinction),
        }
    }
}

/// The light of a piece of a ray along which colour and extinction are linear.
fn linear(from: Knot, to: Knot, length: f64) -> Light {
    let depth = 0.5 * (from.extinction + to.extinction) * length;
    if depth <= 0.0 {
        return Light::NONE;
    }
    let pieces = (depth / PIECE_DEPTH).ceil().clamp(1.0, MOST_PIECES);
    let mut light = Light::NONE;
    for i in 0..pieces as u32 {
        let ends = [f64::from(i), f64::from(i + 1)].map(|end| from.towards(&to, end / pieces));
        light = light.over(short(ends, length / pieces));
    }
    light
}

/// [`linear`] for a piece of little optical depth.
fn short([from, to]: [Knot; 2], length: f64) -> Light {
    // The optical depth from the start to `t`, a parabola.
    let depth = |t: f64| length * t * (from.extinction + 0.5 * t * (to.extinction - from.extinction));
    let mut colour = [0.0; 3];
    for (t, weight) in GAUSS {
        let at = from.towards(&to, t);
        let emitted = weight * length * at.extinction * (-depth(t)).exp();
        (0..3).for_each(|k| colour[k] += emitted * at.colour[k]);
    }
    Light { colour, transmittance: (-depth(1.0)).exp() }
}

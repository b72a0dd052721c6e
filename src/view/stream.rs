//! Streamlines of a vector field that is linear in every tetrahedron.
//!
//! The method of Dormand and Prince (1980): fifth order, with an estimate of its error. Steps are a fraction of the
//! tetrahedron's shortest edge, halved until the error is small enough. Nothing but the basic operations and square
//! roots, so a line is the same on every platform.

use crate::view::{MeshView, Place, Probe};

/// Halvings of a step before the boundary counts as reached: to a millionth of a step.
const HALVINGS: u32 = 20;

/// The stages of a step: what of the vectors so far leads to the next point.
const STAGES: [&[f64]; 6] = [
    &[1.0 / 5.0],
    &[3.0 / 40.0, 9.0 / 40.0],
    &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
    &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
    &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
    &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];

/// The difference from the step of fourth order.
const ERROR: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339_200.0, 22.0 / 525.0, -1.0 / 40.0];

/// How far, and how carefully, a streamline is followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceOptions {
    /// Length of a step as a fraction of the shortest edge of the tetrahedron that it starts in.
    pub step: f64,
    /// Largest error of a step, as a fraction of its length.
    pub tolerance: f64,
    /// Most steps.
    pub max_steps: u32,
    /// Largest length of the line, in model units.
    pub max_length: f64,
    /// Smallest speed, as a fraction of the largest at any point of the mesh.
    pub min_speed: f64,
    /// Against the field.
    pub backward: bool,
}

impl Default for TraceOptions {
    fn default() -> Self {
        Self {
            step: 0.5,
            tolerance: 1e-5,
            max_steps: 10_000,
            max_length: f64::INFINITY,
            min_speed: 1e-6,
            backward: false,
        }
    }
}

/// Why a streamline ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StreamEnd {
    /// The domain does.
    Boundary,
    /// Nothing moves there.
    Stagnation,
    /// The line is as long as it may be.
    Length,
    /// The line has as many steps as it may have.
    Steps,
}

impl StreamEnd {
    /// The reason in a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Boundary => "boundary",
            Self::Stagnation => "stagnation",
            Self::Length => "length",
            Self::Steps => "steps",
        }
    }
}

/// A point of a streamline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreamPoint {
    /// In model units.
    pub position: [f64; 3],
    /// When a particle that starts at the first point is here; negative against the field.
    pub time: f64,
    /// The vector here.
    pub vector: [f64; 3],
    /// Where this is in the mesh.
    pub place: Place,
}

/// A streamline from its seed on.
#[derive(Clone, Debug, PartialEq)]
pub struct Streamline {
    /// The seed is the first.
    pub points: Vec<StreamPoint>,
    /// Why there are no more.
    pub end: StreamEnd,
}

/// Follows a vector field.
#[derive(Clone, Debug)]
pub struct Tracer<'a> {
    probe: Probe<'a>,
    /// The components along x, y and z, one number a point each.
    vectors: [&'a [f64]; 3],
    largest_speed: f64,
}

impl<'a> Tracer<'a> {
    /// A tracer of the field with these components.
    ///
    /// # Panics
    /// If a component has fewer numbers than the mesh has points.
    pub fn new(mesh: MeshView<'a>, vectors: [&'a [f64]; 3]) -> Self {
        let vector = |p: usize| vectors.map(|component| component[p]);
        let speeds = (0..mesh.positions.len()).map(|p| length(vector(p)));
        let largest_speed = speeds.fold(0.0, f64::max);
        Self { probe: Probe::new(mesh), vectors, largest_speed }
    }

    /// The streamline from a seed; none if that is outside.
    pub fn trace(&mut self, seed: [f64; 3], options: &TraceOptions) -> Option<Streamline> {
        let sign = if options.backward { -1.0 } else { 1.0 };
        let slowest = self.largest_speed * options.min_speed;
        let mut here = self.point(seed, 0.0)?;
        let mut points = vec![here];
        let (mut travelled, mut halvings) = (0.0, 0_u32);
        let end = loop {
            let speed = length(here.vector);
            // Written so that NaN is no speed.
            if !(speed > slowest && speed > 0.0) {
                break StreamEnd::Stagnation;
            }
            let rest = options.max_length - travelled;
            if rest <= 0.0 {
                break StreamEnd::Length;
            }
            if points.len() > options.max_steps as usize {
                break StreamEnd::Steps;
            }
            let whole = (options.step * self.shortest_edge(here.place.tet)).min(rest);
            let step = whole / f64::from(1_u32 << halvings);
            let Some((next, error)) = self.advance(&here, sign * step / speed) else {
                if halvings == HALVINGS {
                    break StreamEnd::Boundary;
                }
                halvings += 1;
                continue;
            };
            if error > options.tolerance * step && halvings < HALVINGS {
                halvings += 1;
                continue;
            }
            if next.position == here.position {
                break StreamEnd::Stagnation;
            }
            // Twice the step has 32 times the error.
            if 64.0 * error < options.tolerance * step {
                halvings = halvings.saturating_sub(1);
            }
            // Along the curve: a chord would be too short.
            travelled += 0.5 * (next.time - here.time).abs() * (speed + length(next.vector));
            here = next;
            points.push(here);
        };
        Some(Streamline { points, end })
    }

    /// One step and its error; none if it leaves the domain on its way.
    fn advance(&mut self, here: &StreamPoint, dt: f64) -> Option<(StreamPoint, f64)> {
        let mut vectors = [here.vector; 7];
        let mut next = *here;
        for (stage, parts) in STAGES.iter().enumerate() {
            let sum = combined(parts, &vectors);
            let position = [0, 1, 2].map(|i| here.position[i] + dt * sum[i]);
            next = self.point(position, here.time + dt)?;
            vectors[stage + 1] = next.vector;
        }
        Some((next, dt.abs() * length(combined(&ERROR, &vectors))))
    }

    fn point(&mut self, position: [f64; 3], time: f64) -> Option<StreamPoint> {
        let place = self.probe.locate(position)?;
        Some(StreamPoint { position, time, vector: self.vector_at(&place), place })
    }

    fn vector_at(&self, place: &Place) -> [f64; 3] {
        self.vectors.map(|component| place.interpolate(self.probe.mesh(), component))
    }

    fn shortest_edge(&self, tet: u32) -> f64 {
        let mesh = self.probe.mesh();
        let corners = mesh.tets[tet as usize].map(|v| mesh.positions[v as usize]);
        let edges = crate::mesh::EDGES.map(|[a, b]| distance(corners[a], corners[b]));
        edges.into_iter().fold(f64::INFINITY, f64::min)
    }
}

fn combined(parts: &[f64], vectors: &[[f64; 3]; 7]) -> [f64; 3] {
    [0, 1, 2].map(|i| parts.iter().zip(vectors).map(|(part, vector)| part * vector[i]).sum())
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    length([0, 1, 2].map(|i| b[i] - a[i]))
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

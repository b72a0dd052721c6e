//! Promise: surfaces, sections, probes and sums are as exact where coordinates or values are large for what they differ by as they are near 0.

use crate::support::meshes::{bent, blocks, built, cube, hilly};
use crate::support::random::Random;
use glam::DVec3;
use tetralod::format::{EncodeOptions, encode};
use tetralod::geom::Ray;
use tetralod::mesh::TetMesh;
use tetralod::mt::Mt;
use tetralod::refine::Request;
use tetralod::session::Session;
use tetralod::view::{
    BoundarySurface, FieldStats, IsoSurface, Plane, Probe, Slice, Triangles, area, first_hit,
};

/// The reference mesh of what an MT keeps of a mesh.
pub fn opened(mesh: &TetMesh) -> Session {
    let mut session = Session::new();
    let bytes = encode(&Mt::from(built(mesh).mt), &EncodeOptions::default()).expect("a complete MT");
    session.feed(&bytes).expect("a good file");
    session.refine(&Request::within(0.0)).expect("a good request");
    session
}

/// Where a model is, how large, and from where its field goes how far.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    pub origin: [f64; 3],
    pub size: f64,
    pub low: f64,
    pub range: f64,
}

pub const NEAR: Frame = Frame { origin: [0.0; 3], size: 1.0, low: 0.0, range: 1.0 };

/// What surveys, clocks, barometers and units of physics make of numbers.
pub const FAR: [Frame; 12] = [
    Frame { origin: [600_000.0, 5_800_000.0, 0.0], size: 0.35, ..NEAR },
    Frame { origin: [600_000.123, 5_800_000.789, -45.6], size: 35.0, low: 101_325.0 - 1e-4, range: 2e-4 },
    Frame { origin: [4_180_456.7, 171_234.5, 4_796_789.1], size: 10.0, ..NEAR },
    Frame { origin: [-1e8, 0.0, 3.0], size: 1.0, low: 1.7e9, range: 3.0 },
    Frame { origin: [1e12, -1e12, 1e12], size: 1e4, low: -273.15, range: 1e-6 },
    Frame { origin: [0.0; 3], size: 1e-15, low: 1e39, range: 1e39 },
    Frame { origin: [1e-9, 0.0, 0.0], size: 1e-14, low: 1e50, range: 1e49 },
    Frame { origin: [0.0; 3], size: 1e20, low: -1e38, range: 9e38 },
    Frame { origin: [1e22, 0.0, -1e23], size: 1e19, low: 1e-40, range: 2e-40 },
    Frame { low: 1.7e18, range: 3e6, ..NEAR },
    Frame { low: -1e9 - 0.5, range: 1.0, ..NEAR },
    Frame { low: 0.0, range: 1e-44, ..NEAR },
];

impl Frame {
    pub fn point(&self, p: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|i| self.origin[i] + self.size * p[i])
    }

    pub fn value(&self, t: f64) -> f64 {
        self.low + self.range * t
    }

    /// A mesh of the unit cube with a field of 0 to 1, put here.
    pub fn of(&self, mesh: &TetMesh) -> TetMesh {
        let mut mesh = mesh.clone();
        mesh.grid = None;
        mesh.positions.iter_mut().for_each(|p| *p = self.point(*p));
        for field in &mut mesh.fields {
            field.values.iter_mut().for_each(|value| *value = self.value(*value));
        }
        mesh
    }
}

/// From 0 to 1 over the unit cube, linear.
fn ramp([x, y, z]: [f64; 3]) -> f64 {
    (x + 2.0 * y + 3.0 * z) / 6.0
}

fn close(found: f64, wanted: f64, what: &str, frame: &Frame) {
    assert!(
        (found - wanted).abs() <= 1e-4 * wanted.abs().max(0.1),
        "{what}: {found}, not {wanted}, in {frame:?}"
    );
}

#[test]
fn surfaces_sections_and_sums_are_those_of_the_same_model_near_the_origin() {
    let unit = cube(5, &[hilly]);
    let wanted = numbers(&NEAR, &unit);
    assert!(wanted[1] > 0.1 && wanted[2] > 0.5, "{wanted:?}");
    close(wanted[0], 6.0, "the boundary of a cube", &NEAR);
    for frame in FAR {
        let names = ["boundary", "isosurfaces", "slice", "volume", "mean", "deviation"];
        for ((found, wanted), name) in numbers(&frame, &unit).into_iter().zip(wanted).zip(names) {
            close(found, wanted, name, &frame);
        }
    }
}

/// Areas, volume and moments of the field, in units of the frame.
fn numbers(frame: &Frame, unit: &TetMesh) -> [f64; 6] {
    let mut session = opened(&frame.of(unit));
    let per_area = 1.0 / (frame.size * frame.size);
    let isovalues = [0.3, 0.55].map(|t| frame.value(t));
    let surface = session.isosurfaces(&isovalues).expect("it is open");
    let isosurfaces = area(&surface.positions, &surface.indices);
    assert!(
        surface.values.iter().all(|value| isovalues.contains(value)),
        "isovalues are not rounded: {frame:?}"
    );
    let plane = Plane::through(frame.point([0.4, 0.5, 0.6]), [1.0, 0.5, 0.25]);
    let slice = session.slice(&plane).expect("it is open").clone();
    let mesh = session.view();
    let mut boundary = BoundarySurface::new();
    boundary.extract(&mesh);
    let stats = FieldStats::of(&mesh);
    [
        boundary.area() * per_area,
        isosurfaces * per_area,
        area(slice.positions(), slice.indices()) * per_area,
        stats.volume() * per_area / frame.size,
        (stats.mean() - frame.low) / frame.range,
        stats.deviation() / frame.range,
    ]
}

#[test]
fn probes_are_within_the_bound_of_the_mesh() {
    let unit = cube(4, &[ramp]);
    for frame in FAR.into_iter().chain([NEAR]) {
        let mut session = opened(&frame.of(&unit));
        let bound = session.info().expect("it is open").field_bound(0, 0.0);
        let mesh = session.view();
        let mut probe = Probe::new(mesh);
        let mut random = Random::new(5);
        for _ in 0..300 {
            let p = [0; 3].map(|_| 0.02 + 0.96 * random.fraction());
            let place = probe.locate(frame.point(p)).expect("it is inside");
            let off = (place.value(&mesh) - frame.value(ramp(p))).abs();
            // The place itself has no more digits than a coordinate.
            let largest = frame.origin.iter().fold(frame.size, |m, x| m.max(x.abs()));
            let rounding = 8.0 * f64::EPSILON * (frame.low.abs() + frame.range * largest / frame.size);
            assert!(off <= bound * 1.01 + rounding, "{off} off, within {bound} promised, in {frame:?}");
        }
        let line = probe.line(frame.point([0.1, 0.2, 0.3]), frame.point([0.9, 0.8, 0.4]));
        let inside: f64 = line.iter().map(|span| span.to - span.from).sum();
        assert!((inside - 1.0).abs() < 1e-6, "{inside} of the line in {frame:?}");
    }
}

#[test]
fn surfaces_that_follow_changes_are_those_from_scratch() {
    for frame in [FAR[0], FAR[3]] {
        let mut session = opened(&frame.of(&cube(5, &[hilly])));
        let isovalue = frame.value(0.4);
        let plane = Plane::through(frame.point([0.5; 3]), [0.3, 1.0, 0.2]);
        for error in [0.2, 0.05, 0.01, 0.0, 0.1] {
            session.refine(&Request::within(error)).expect("a good request");
            let followed = session.isosurface(isovalue).expect("it is open").clone();
            let slice = session.slice(&plane).expect("it is open").clone();
            let (mut surface, mut section) = (IsoSurface::new(), Slice::new());
            surface.extract(&session.view(), isovalue);
            section.extract(&session.view(), &plane);
            let areas = [
                [area(&followed.positions, &followed.indices), area(&surface.positions, &surface.indices)],
                [area(slice.positions(), slice.indices()), area(section.positions(), section.indices())],
            ];
            let size = frame.size * frame.size;
            assert!(areas.iter().all(|[a, b]| (a - b).abs() < 1e-9 * size && *a > 0.0), "{areas:?}");
        }
    }
}

/// A bracket: two plates, a hole, a notch; turned so that no face is along an axis.
fn bracket() -> TetMesh {
    let is_inside = |[x, y, z]: [u32; 3]| (z < 2 || x < 2) && !(x == 5 && y == 2) && !(y > 4 && z > 3);
    let mut mesh = blocks([8, 6, 6], &[hilly], is_inside);
    mesh.grid = None;
    let [u, v] = [DVec3::new(0.8, 0.53, 0.28).normalize(), DVec3::new(-0.31, 0.77, -0.55)];
    let v = (v - u * u.dot(v)).normalize();
    let w = u.cross(v);
    for p in &mut mesh.positions {
        let [x, y, z] = *p;
        *p = (u * (1.3 * x) + v * y + w * (0.7 * z + 0.1 * x * x)).to_array();
    }
    mesh
}

#[test]
fn every_point_of_a_boundary_or_a_section_has_a_value() {
    for frame in [NEAR, FAR[0], FAR[2], FAR[5], FAR[8]] {
        for mesh in [bracket(), bent(5)] {
            let mut session = opened(&frame.of(&mesh));
            let centre = session.view().bounds();
            let middle = DVec3::from([0, 1, 2].map(|i| f64::midpoint(centre.min[i], centre.max[i])));
            let plane = Plane { normal: [0.4, 0.7, -0.2], offset: DVec3::new(0.4, 0.7, -0.2).dot(middle) };
            let slice = session.slice(&plane).expect("it is open").clone();
            let view = session.view();
            let mut boundary = BoundarySurface::new();
            boundary.extract(&view);
            let mut probe = Probe::new(view);
            let size = centre.diagonal();
            let mut hits = 0;
            for i in 0..30 {
                for j in 0..30 {
                    let [a, b] = [i, j].map(|k| (f64::from(k) - 14.7) / 30.0 * size);
                    let origin = middle + DVec3::new(-2.0, a / size, b / size) * size;
                    let ray = Ray { origin, direction: DVec3::new(0.97, 0.2, -0.1).normalize() };
                    for triangles in [Triangles::from(&boundary), Triangles::from(&slice)] {
                        let Some(hit) = first_hit(&triangles, &ray, &[]) else { continue };
                        hits += 1;
                        let place = probe.locate(hit.position);
                        let place =
                            place.unwrap_or_else(|| panic!("{:?} is not found in {frame:?}", hit.position));
                        let off = (place.value(&view) - hit.value).abs();
                        assert!(off <= 1e-5 * frame.range + 1e-15 * frame.low.abs(), "{off} in {frame:?}");
                        assert!(session_weights(place.weights));
                    }
                }
            }
            assert!(hits > 100, "{hits}");
            // What is further outside than rounding is not found.
            let largest = centre.min.into_iter().chain(centre.max).fold(0.0, |m: f64, x| m.max(x.abs()));
            let beside = centre.max[0] + 1e-11 * largest;
            assert_eq!(probe.locate([beside, middle.y, middle.z]), None);
        }
    }
}

fn session_weights(weights: [f64; 4]) -> bool {
    weights.iter().all(|w| *w >= 0.0) && (weights.iter().sum::<f64>() - 1.0).abs() < 1e-12
}

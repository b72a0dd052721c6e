//! Promise: flat parts of the boundary stay flat, and sharp creases and corners where they are, at every error, on noisy data too,
//! and within what rounding moves them if they are not along the axes.

use crate::support::meshes::blocks;
use crate::support::random::Random;
use tetralod::mesh::{FACES, NONE, TetMesh};
use tetralod::mt::{CurrentMesh, Mt, MtKind, MultiTessellation};
use tetralod::refine::{Front, LodCriterion, Request};
use tetralod_build::{BuildConfig, BuildCriterion, Construction, Method, build};

fn made(mesh: &TetMesh, kind: MtKind, criterion: BuildCriterion) -> Mt {
    let method = if kind == MtKind::Edge { Method::Collapse } else { Method::Decimate };
    let construction = Construction::new(kind, method, criterion).expect("they go together");
    let config = BuildConfig { construction, ..BuildConfig::of(MtKind::Edge) };
    build(mesh, &config).expect("a mesh to build on").mt
}

/// How many boundary faces are in none of the planes of the axes through these lattice positions, and the corners of the box.
fn tilted(mesh: &CurrentMesh, sides: &[Vec<i32>; 3]) -> usize {
    let mut count = 0;
    for (tet, around) in mesh.tets().iter().zip(mesh.neighbors()) {
        for face in (0..4).filter(|&i| around[i] == NONE) {
            let corners = FACES[face].map(|i| mesh.positions()[tet[i] as usize]);
            let flat =
                (0..3).any(|axis| sides[axis].iter().any(|&side| corners.iter().all(|q| q[axis] == side)));
            count += usize::from(!flat);
        }
    }
    count
}

fn noise(mesh: &mut TetMesh, seed: u64) {
    let mut random = Random::new(seed);
    mesh.fields[0].values.iter_mut().for_each(|x| *x = random.below(1000) as f64);
}

#[test]
fn noisy_boxes_and_notched_ones_keep_their_faces() {
    let ell = |c: [u32; 3]| c[0] < 3 || c[1] < 4;
    for (name, mut mesh) in
        [("box", blocks([7, 8, 6], &[|_| 0.0], |_| true)), ("notched", blocks([7, 8, 6], &[|_| 0.0], ell))]
    {
        noise(&mut mesh, 11);
        // One outlier makes the rest small, so that errors of a few percent take away nearly all.
        mesh.fields[0].values[100] = 20_000.0;
        for (kind, criterion) in [
            (MtKind::Edge, BuildCriterion::HalfEdge),
            (MtKind::Vertex, BuildCriterion::HalfEdge),
            (MtKind::Vertex, BuildCriterion::Delaunay),
        ] {
            let mt = made(&mesh, kind, criterion);
            let at = |axis: usize, part: f64| {
                let mut p = [0.0; 3];
                p[axis] = part;
                mt.info().lattice.nearest(p)[axis]
            };
            let sides = [
                vec![at(0, 0.0), at(0, 3.0 / 7.0), at(0, 1.0)],
                vec![at(1, 0.0), at(1, 0.5), at(1, 1.0)],
                vec![at(2, 0.0), at(2, 1.0)],
            ];
            for error in [0.0, 0.01, 0.05, 0.2, 1.0, f64::INFINITY] {
                let mut front = Front::new(&mt).expect("a valid base mesh");
                let request = Request::within(error);
                let criterion = LodCriterion::new(mt.info(), &request);
                front.satisfy(&mt, &criterion, request.budget).expect("a valid MT");
                let mesh = front.mesh();
                assert_eq!(tilted(mesh, &sides), 0, "{name}, {}, error {error}", kind.name());
                for corner in 0..8 {
                    let corner = [0, 1, 2].map(|axis| {
                        *sides[axis][if corner >> axis & 1 == 0 { 0 } else { sides[axis].len() - 1 }..]
                            .first()
                            .expect("a side")
                    });
                    let cut = name == "notched" && corner[0] > 0 && corner[1] > 0;
                    assert!(
                        cut || mesh.positions().contains(&corner),
                        "{name}: the corner {corner:?} is gone at error {error}"
                    );
                }
            }
        }
    }
}

/// The points of a mesh turned around an axis that is none of the grid's.
fn turned(mut mesh: TetMesh) -> TetMesh {
    let turn = |[x, y, z]: [f64; 3]| {
        let [x, y] = [0.8 * x - 0.6 * y, 0.6 * x + 0.8 * y];
        let [y, z] = [y * 12.0 / 13.0 - z * 5.0 / 13.0, y * 5.0 / 13.0 + z * 12.0 / 13.0];
        [x, y, z]
    };
    mesh.positions.iter_mut().for_each(|p| *p = turn(*p));
    mesh.grid = None;
    mesh
}

/// The same the other way round.
fn turned_back([x, y, z]: [f64; 3]) -> [f64; 3] {
    let [y, z] = [y * 12.0 / 13.0 + z * 5.0 / 13.0, z * 12.0 / 13.0 - y * 5.0 / 13.0];
    [0.8 * x + 0.6 * y, 0.8 * y - 0.6 * x, z]
}

/// The boundary triangles, in the place that they had before they were turned.
fn boundary(mt: &Mt, mesh: &CurrentMesh) -> Vec<[[f64; 3]; 3]> {
    let place = |v: u32| turned_back(mt.info().lattice.point(mesh.positions()[v as usize]));
    let mut triangles = Vec::new();
    for (tet, around) in mesh.tets().iter().zip(mesh.neighbors()) {
        let faces = (0..4).filter(|&i| around[i] == NONE);
        triangles.extend(faces.map(|i| FACES[i].map(|k| place(tet[k]))));
    }
    triangles
}

/// How far the corners of a triangle are at most from the plane of `sides` that they are nearest to.
fn away(triangle: &[[f64; 3]; 3], sides: &[&[f64]; 3]) -> f64 {
    let from = |axis: usize, side: f64| triangle.iter().map(|p| (p[axis] - side).abs()).fold(0.0, f64::max);
    let all = (0..3).flat_map(|axis| sides[axis].iter().map(move |&side| (axis, side)));
    all.map(|(axis, side)| from(axis, side)).fold(f64::INFINITY, f64::min)
}

fn area([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let [a, b, c] = [a, b, c].map(glam::DVec3::from);
    (b - a).cross(c - a).length() / 2.0
}

/// How many steps of the lattice rounding may move the boundary by, away from its planes.
const FEW: f64 = 4.0;

#[test]
fn turned_boxes_and_notched_ones_keep_their_planes() {
    let ell = |c: [u32; 3]| c[0] < 3 || c[1] < 4;
    let inner: [&[f64]; 3] = [&[0.0, 3.0 / 7.0, 1.0], &[0.0, 0.5, 1.0], &[0.0, 1.0]];
    let outer: [&[f64]; 3] = [&[0.0, 1.0]; 3];
    for (name, mesh, sides) in [
        ("box", blocks([7, 8, 6], &[|_| 0.0], |_| true), outer),
        ("notched", blocks([7, 8, 6], &[|_| 0.0], ell), inner),
    ] {
        let mut mesh = turned(mesh);
        noise(&mut mesh, 12);
        mesh.fields[0].values[100] = 20_000.0;
        for (kind, criterion) in [
            (MtKind::Edge, BuildCriterion::HalfEdge),
            (MtKind::Vertex, BuildCriterion::HalfEdge),
            (MtKind::HalfEdge, BuildCriterion::HalfEdge),
        ] {
            let mt = made(&mesh, kind, criterion);
            let few = FEW * mt.info().lattice.step.into_iter().fold(0.0, f64::max);
            let at = |error: f64| {
                let request = Request::within(error);
                let mut front = Front::new(&mt).expect("a valid base mesh");
                let criterion = LodCriterion::new(mt.info(), &request);
                front.satisfy(&mt, &criterion, request.budget).expect("a valid MT");
                (front.mesh().tets().len(), boundary(&mt, front.mesh()))
            };
            let whole = |triangles: &[[[f64; 3]; 3]]| triangles.iter().map(|t| area(*t)).sum::<f64>();
            let (all, triangles) = at(0.0);
            let (mut least, area) = (all, whole(&triangles));
            for error in [0.01, 0.05, 0.2, 1.0, f64::INFINITY] {
                let (count, triangles) = at(error);
                let what = format!("{name}, {}, error {error}, {count} tetrahedra", kind.name());
                let away = triangles.iter().map(|t| away(t, &sides)).fold(0.0, f64::max);
                assert!(away <= few, "{what}: {away} away from all planes, not {few}");
                for p in corners(sides, name == "notched") {
                    let beside = |q: &[f64; 3]| (0..3).all(|k| (p[k] - q[k]).abs() <= few);
                    assert!(triangles.iter().flatten().any(beside), "{what}: the corner {p:?} is gone");
                }
                let now = whole(&triangles);
                assert!((now - area).abs() < 0.001 * area, "{what}: an area of {now}, not {area}");
                least = least.min(count);
            }
            assert!(4 * least < all, "{name}, {}: {least} of {all} tetrahedra are left", kind.name());
        }
    }
}

/// The corners of a box, or of one that is notched.
fn corners([x, y, z]: [&[f64]; 3], is_notched: bool) -> Vec<[f64; 3]> {
    let all = x.iter().flat_map(|&x| y.iter().flat_map(move |&y| z.iter().map(move |&z| [x, y, z])));
    // Of the inner places along a side only those are corners at which the notch begins and ends.
    let inside = |x: f64| x > 0.0 && x < 1.0;
    let is_corner = |p: &[f64; 3]| match (inside(p[0]), inside(p[1])) {
        (true, true) => true,
        (true, false) => p[1] == 1.0,
        (false, true) => p[0] == 1.0,
        (false, false) => !is_notched || p[0] == 0.0 || p[1] == 0.0,
    };
    all.filter(is_corner).collect()
}

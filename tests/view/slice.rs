//! Promise: a slice is the section of the mesh with the plane, whole and once, from scratch as after any change.

use crate::scenes::Scene;
use crate::support::meshes::{bent, built, cube, hilly, linear as linear_field};
use crate::support::random::Random;
use crate::support::requests::requests;
use crate::walk::{KINDS, Walk, changed};
use std::collections::{BTreeMap, BTreeSet};
use tetralod::format::{EncodeOptions, encode};
use tetralod::session::Session;
use tetralod::view::{BoundarySurface, MeshView, Plane, Slice, area, is_closed};

fn linear([x, y, z]: [f64; 3]) -> f64 {
    x + 2.0 * y - 3.0 * z
}

fn cut(mesh: &MeshView<'_>, plane: &Plane) -> Slice {
    let mut slice = Slice::new();
    slice.extract(mesh, plane);
    slice
}

fn plane(normal: [f64; 3], offset: f64) -> Plane {
    Plane { normal, offset }
}

/// The parts of a triangle's area along the axes, doubled.
fn doubled(corners: [[f64; 3]; 3]) -> [f64; 3] {
    let [a, b, c] = corners.map(|p| p.map(f64::from));
    let [u, v] = [b, c].map(|p| [0, 1, 2].map(|i| p[i] - a[i]));
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

/// What must hold for every slice; `border` tells where it may end.
fn check(slice: &Slice, plane: &Plane, border: impl Fn([f64; 3]) -> bool) {
    let corner = |v: u32| slice.positions()[v as usize];
    let length = plane.normal.iter().map(|x| x * x).sum::<f64>().sqrt();
    let mut sides: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for &[a, b, c] in slice.indices() {
        assert!(a != b && b != c && c != a);
        let area = doubled([a, b, c].map(corner));
        let up: f64 = (0..3).map(|i| area[i] * plane.normal[i]).sum();
        assert!(up > -1e-9, "triangles face the normal");
        assert!([a, b, c].iter().all(|&v| plane.height(corner(v)).abs() < 1e-6 * length));
        for side in [[a, b], [b, c], [c, a]] {
            *sides.entry(side).or_default() += 1;
        }
    }
    for ([a, b], count) in &sides {
        assert_eq!(*count, 1, "a plane has no room for two");
        if !sides.contains_key(&[*b, *a]) {
            let middle = [0, 1, 2].map(|i| 0.5 * (corner(*a)[i] + corner(*b)[i]));
            assert!(border(middle), "the slice ends inside, at {middle:?}");
        }
    }
}

fn on_cube(p: [f64; 3]) -> bool {
    p.iter().any(|c| c.abs() < 1e-6 || (c - 1.0).abs() < 1e-6)
}

#[test]
fn the_section_of_a_box_has_its_area_with_and_without_ties() {
    let root = f64::sqrt;
    let sections = [
        ([0.0, 0.0, 1.0], 0.3, 1.0),
        // Through points of the grid, and in the boundary from either side.
        ([0.0, 0.0, 1.0], 0.5, 1.0),
        ([0.0, 0.0, 1.0], 0.0, 1.0),
        ([0.0, 0.0, 1.0], 1.0, 1.0),
        ([0.0, -2.0, 0.0], 0.0, 1.0),
        ([0.0, -2.0, 0.0], -2.0, 1.0),
        ([1.0, 1.0, 0.0], 1.0, root(2.0)),
        ([1.0, -1.0, 0.0], 0.0, root(2.0)),
        ([1.0, 1.0, 1.0], 1.5, 0.75 * root(3.0)),
        ([1.0, 1.0, 1.0], 1.0, 0.5 * root(3.0)),
        ([3.0, 0.0, 4.0], 2.0, 5.0 / 6.0),
        // An edge, a corner, nothing.
        ([1.0, 1.0, 0.0], 0.0, 0.0),
        ([1.0, 1.0, 1.0], 3.0, 0.0),
        ([0.0, 1.0, 0.0], 1.5, 0.0),
    ];
    for cells in [1, 4, 7] {
        let scene = Scene::cube(cells, linear);
        for (normal, offset, expected) in sections {
            let plane = plane(normal, offset);
            let slice = cut(&scene.view(), &plane);
            check(&slice, &plane, on_cube);
            let area = area(slice.positions(), slice.indices());
            assert!((area - expected).abs() < 1e-5, "{plane:?} at {cells}: {area} for {expected}");
            for (p, value) in slice.positions().iter().zip(slice.values()) {
                assert!((linear(*p) - value).abs() < 1e-5);
            }
            let named: BTreeSet<u32> = slice.indices().iter().flatten().copied().collect();
            assert_eq!(named.len(), slice.positions().len());
        }
    }
}

#[test]
fn every_pattern_of_heights_has_its_polygon() {
    for pattern in 0..81 {
        let heights = [1, 3, 9, 27].map(|place| f64::from(pattern / place % 3 - 1));
        // The plane whose heights at the corners 0, x, y, z are these.
        let plane = plane([1, 2, 3].map(|i| heights[i] - heights[0]), -heights[0]);
        if plane.normal == [0.0; 3] {
            continue;
        }
        let scene = Scene::tet([0.0; 4]);
        let slice = cut(&scene.view(), &plane);
        check(&slice, &plane, |_| true);
        let [below, at, above] = [-1.0, 0.0, 1.0].map(|h| heights.iter().filter(|x| **x == h).count());
        let corners = below * above + at;
        let expected = if corners < 3 || at == 4 { 0 } else { corners - 2 };
        assert_eq!(slice.indices().len(), expected, "{heights:?}");
        let mut lines = Vec::new();
        slice.cell_edges(&mut lines);
        assert_eq!(lines.len(), if expected == 0 { 0 } else { corners }, "{heights:?}");
    }
}

#[test]
fn cell_edges_are_the_sides_of_the_polygons_each_once() {
    for (normal, offset) in [([0.0, 0.0, 1.0], 0.3), ([0.0, 0.0, 1.0], 0.5), ([1.0, 2.0, 3.0], 2.9)] {
        let scene = Scene::cube(6, linear);
        let plane = plane(normal, offset);
        let slice = cut(&scene.view(), &plane);
        let mut lines = vec![[7, 7]];
        slice.cell_edges(&mut lines);
        let distinct: BTreeSet<_> = lines.iter().collect();
        assert_eq!(distinct.len(), lines.len());
        // A diagonal is a side of no polygon in either of its triangles.
        let inner: u32 = slice.cell_sides().iter().map(|sides| 3 - sides.count_ones()).sum();
        let polygons = slice.indices().len() - inner as usize / 2;
        assert_eq!(slice.positions().len() + polygons, lines.len() + 1, "Euler: V - E + F = 1 for a disc");
    }
}

/// Triangles by the bits of their corners and values, from the smallest corner on.
fn as_set(slice: &Slice) -> Vec<[[u64; 4]; 3]> {
    let bits = |v: u32| {
        let [x, y, z] = slice.positions()[v as usize];
        [x, y, z, slice.values()[v as usize]].map(f64::to_bits)
    };
    let turned =
        |[a, b, c]: [[u64; 4]; 3]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap_or_default();
    let mut set: Vec<_> = slice.indices().iter().map(|t| turned(t.map(bits))).collect();
    set.sort_unstable();
    set
}

fn lines_as_set(slice: &Slice) -> Vec<[[u64; 3]; 2]> {
    let mut lines = Vec::new();
    slice.cell_edges(&mut lines);
    let bits = |v: u32| slice.positions()[v as usize].map(f64::to_bits);
    let ordered = |[a, b]: [[u64; 3]; 2]| [a.min(b), a.max(b)];
    let mut set: Vec<_> = lines.iter().map(|line| ordered(line.map(bits))).collect();
    set.sort_unstable();
    set
}

/// A copy of a slice's arrays that follows its changes.
#[derive(Default, PartialEq, Debug)]
struct Copy {
    positions: Vec<[f64; 3]>,
    values: Vec<f64>,
    indices: Vec<[u32; 3]>,
}

impl Copy {
    fn follow(&mut self, slice: &mut Slice) {
        let changes = slice.take_changes();
        self.positions.resize(slice.positions().len(), [f64::NAN; 3]);
        self.values.resize(slice.values().len(), f64::NAN);
        self.indices.resize(slice.indices().len(), [u32::MAX; 3]);
        for v in changes.vertices.into_iter().flatten().map(|v| v as usize) {
            self.positions[v] = slice.positions()[v];
            self.values[v] = slice.values()[v];
        }
        for t in changes.triangles.into_iter().flatten().map(|t| t as usize) {
            self.indices[t] = slice.indices()[t];
        }
        assert_eq!(self.indices, slice.indices());
        for &v in slice.indices().iter().flatten() {
            assert_eq!(self.positions[v as usize], slice.positions()[v as usize]);
            assert_eq!(self.values[v as usize], slice.values()[v as usize]);
        }
    }
}

#[test]
fn a_slice_that_follows_the_mesh_is_that_from_scratch() {
    for kind in KINDS {
        for (mesh, plane) in [
            (cube(8, &[hilly]), plane([0.0, 0.0, 1.0], 0.5)),
            (cube(7, &[hilly]), plane([1.0, 2.0, -0.5], 0.9)),
            (bent(7), plane([1.0, 1.0, 1.0], 2.0)),
        ] {
            // Insertion would fill up the hull of the bent mesh, and refuses to.
            if kind.1.keeps_the_mesh() || mesh.grid.is_some() {
                follow(&mut Walk::new(&mesh, kind), &plane);
            }
        }
    }
}

fn follow(walk: &mut Walk, plane: &Plane) {
    let mut slice = cut(&walk.view(), plane);
    let mut copy = Copy::default();
    let mut largest = 0;
    for round in 0..60 {
        let refine = round / 10 % 2 == 0;
        let count = [1, 2, 3, 5, 20, walk.updates()][walk.random.below(6)];
        let changes = if round == 30 { walk.refine_all() } else { walk.change(count, refine) };
        slice.update(&walk.view(), &changes.vertices, &changes.tets);
        let fresh = cut(&walk.view(), plane);
        assert!(as_set(&slice) == as_set(&fresh), "round {round}");
        assert_eq!(lines_as_set(&slice), lines_as_set(&fresh));
        largest = largest.max(slice.indices().len());
        copy.follow(&mut slice);
        let again = slice.take_changes();
        assert!(again.vertices.is_empty() && again.triangles.is_empty());
    }
    assert!(largest > 50, "there was something to cut");
    let (view, named) = (walk.view(), slice.indices().iter().flatten());
    let again = slice.interpolate(&view, view.field);
    named.for_each(|&v| assert_eq!(again[v as usize], slice.values()[v as usize]));
    // Ranges that are too wide do no harm.
    let all = std::slice::from_ref(&(0..u32::MAX));
    slice.update(&walk.view(), all, all);
    assert_eq!(as_set(&slice), as_set(&cut(&walk.view(), plane)));
}

#[test]
fn a_slice_follows_a_session_from_request_to_request() {
    let whole = built(&cube(11, &[hilly, linear_field]));
    let mut session = Session::new();
    session
        .feed(&encode(&whole.mt.into(), &EncodeOptions::default()).expect("a complete MT"))
        .expect("a good file");
    let plane = plane([0.3, -0.4, 1.0], 0.45);
    let mut slice = cut(&session.view(), &plane);
    let (requests, mut random) = (requests(), Random::new(3));
    let mut sizes = BTreeSet::new();
    for _ in 0..60 {
        let before = session.view();
        let (positions, values) = (before.positions.to_vec(), before.field.to_vec());
        let (tets, neighbors) = (before.tets.to_vec(), before.neighbors.to_vec());
        session.set_field(random.below(2)).expect("there are two");
        session.refine(&requests[random.below(requests.len())]).expect("a good request");
        let now = session.view();
        let points = [changed(&positions, now.positions), changed(&values, now.field)].concat();
        let cells = [changed(&tets, now.tets), changed(&neighbors, now.neighbors)].concat();
        slice.update(&now, &points, &cells);
        assert_eq!(as_set(&slice), as_set(&cut(&now, &plane)));
        sizes.insert(slice.indices().len());
    }
    assert!(sizes.len() > 3, "{sizes:?}");
}

#[test]
fn values_may_change_where_tetrahedra_do_not() {
    let mut scene = Scene::ball(6);
    let plane = plane([1.0, 0.2, 0.1], 0.6);
    let mut slice = cut(&scene.view(), &plane);
    let points = scene.positions.len() as u32;
    // Part by part, then another field altogether.
    for (i, range) in [0..0, 100..150, 200..240, 0..100, 0..points].into_iter().enumerate() {
        for p in range.clone().map(|p| p as usize) {
            scene.field[p] = linear(scene.positions[p]) * (1.0 + i as f64);
            scene.positions[p][0] += if i < 4 { 0.01 * (p % 7) as f64 } else { 0.0 };
        }
        slice.update(&scene.view(), std::slice::from_ref(&range), &[]);
        assert_eq!(as_set(&slice), as_set(&cut(&scene.view(), &plane)), "{range:?}");
    }
}

#[test]
fn a_slice_that_shrinks_gives_its_memory_back() {
    let walk = &mut Walk::new(&cube(26, &[linear_field]), KINDS[0]);
    let plane = plane([0.0, 1.0, 0.0], 0.47);
    walk.refine_all();
    let mut slice = cut(&walk.view(), &plane);
    let fine = slice.positions().len();
    let mut copy = Copy::default();
    for _ in 0..100 {
        let changes = walk.change(4000, false);
        slice.update(&walk.view(), &changes.vertices, &changes.tets);
        copy.follow(&mut slice);
    }
    assert_eq!(as_set(&slice), as_set(&cut(&walk.view(), &plane)));
    let named: BTreeSet<u32> = slice.indices().iter().flatten().copied().collect();
    assert!(fine > 2000 && slice.positions().len() <= 4 * named.len() + 1024);
}

#[test]
fn the_boundary_is_closed_and_has_the_area_of_the_box() {
    for cells in [1, 5] {
        let scene = Scene::cube(cells, linear);
        let mut surface = BoundarySurface::new();
        for _ in 0..2 {
            surface.extract(&scene.view());
        }
        assert!(surface.is_closed() && (surface.area() - 6.0).abs() < 1e-6);
        assert_eq!(surface.indices.len(), 12 * cells * cells);
        assert_eq!(surface.positions.len(), 6 * cells * cells + 2);
        for ((p, value), point) in surface.positions.iter().zip(&surface.values).zip(&surface.points) {
            assert_eq!((*p, *value), (scene.positions[*point as usize], scene.field[*point as usize]));
        }
        // The volume, from the divergence theorem: it is positive when triangles face outwards.
        let volume: f64 = surface
            .indices
            .iter()
            .map(|t| t.map(|v| surface.positions[v as usize]))
            .map(|t| (0..3).map(|i| doubled(t)[i] * t[0][i]).sum::<f64>() / 6.0)
            .sum();
        assert!((volume - 1.0).abs() < 1e-6);
    }
    assert!(is_closed(&[]) && !is_closed(&[[0, 1, 2]]));
    assert!(is_closed(&[[0, 1, 2], [0, 2, 1]]) && !is_closed(&[[0, 1, 2], [0, 1, 2]]));
}

#[test]
fn the_boundary_of_every_current_mesh_is_closed() {
    for kind in KINDS.into_iter().filter(|kind| kind.1.keeps_the_mesh()) {
        let mut walk = Walk::new(&bent(6), kind);
        for round in 0..10 {
            walk.change(200, round % 3 != 2);
            let mut surface = BoundarySurface::new();
            surface.extract(&walk.view());
            assert!(surface.is_closed() && !surface.indices.is_empty());
        }
    }
}

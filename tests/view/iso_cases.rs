//! Isosurfaces and cut-away views, case by case and against plain twins.

use crate::cutaway::Cutaway;
use crate::scenes::{Scene, distance_to_centre};
use std::collections::{BTreeMap, BTreeSet};
use tetralod::mesh::{EDGES, NONE};
use tetralod::view::{ClipPlane, IsoSurface};

type Point = [f64; 3];

fn extract(scene: &Scene, value: f64) -> IsoSurface {
    let mut surface = IsoSurface::new();
    surface.extract(&scene.view(), value);
    surface
}

fn sub(a: Point, b: Point) -> [f64; 3] {
    [0, 1, 2].map(|i| a[i] - b[i])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

/// Twice the area of a triangle, along its right-handed normal.
fn area(corners: [Point; 3]) -> [f64; 3] {
    let (u, v) = (sub(corners[1], corners[0]), sub(corners[2], corners[0]));
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

/// How often each directed edge occurs in the surface.
fn directed_edges(surface: &IsoSurface) -> BTreeMap<[u32; 2], usize> {
    let mut count = BTreeMap::new();
    for [a, b, c] in &surface.indices {
        for edge in [[*a, *b], [*b, *c], [*c, *a]] {
            *count.entry(edge).or_insert(0) += 1;
        }
    }
    count
}

fn on_border(p: Point) -> bool {
    p.iter().any(|c| *c == 0.0 || *c == 1.0)
}

#[test]
fn all_patterns_of_signs_give_the_right_triangles() {
    // Below, at, above the isovalue at each of the four corners: 81 patterns, all 16 masks among them.
    for pattern in 0..81 {
        let field = [1, 3, 9, 27].map(|place| (pattern / place % 3 - 1) as f64);
        let surface = extract(&Scene::tet(field), 0.0);
        let [below, at, above] = [-1.0, 0.0, 1.0].map(|v| field.iter().filter(|f| **f == v).count());
        // A polygon with a corner for each crossed edge (below-above) and each touched point, if there is both an
        // inside and a piece of surface; two touched points alone span no area.
        let corners = below * above + if below > 0 { at } else { 0 };
        let expected = if below == 0 || corners < 3 { 0 } else { corners - 2 };
        assert_eq!(surface.indices.len(), expected, "pattern {field:?}");
        // The field is linear: f = a + gradient · p, and its gradient is known from the corners.
        let gradient = [1, 2, 3].map(|i| field[i] - field[0]);
        for triangle in &surface.indices {
            let normal = area(triangle.map(|v| surface.positions[v as usize]));
            assert!(
                dot(normal, gradient) < -0.01,
                "pattern {field:?}: triangle {triangle:?} faces the wrong way"
            );
        }
        for v in surface.indices.iter().flatten() {
            let (p, n) = (surface.positions[*v as usize], surface.normals[*v as usize].map(f64::from));
            let value = field[0] + dot(gradient, p.map(f64::from));
            assert!(value.abs() < 1e-6, "pattern {field:?}: vertex {p:?} has value {value}");
            assert!(
                (dot(n, gradient) + dot(gradient, gradient).sqrt()).abs() < 1e-5,
                "pattern {field:?}: normal"
            );
        }
    }
}

#[test]
fn closed_surfaces_use_every_edge_twice() {
    let scene = Scene::ball(12);
    let surface = extract(&scene, 0.217);
    assert!(surface.indices.len() > 500);
    let edges = directed_edges(&surface);
    for ([a, b], count) in &edges {
        assert_eq!((*count, edges.get(&[*b, *a])), (1, Some(&1)), "edge {a}-{b}");
    }
    // Euler's number of a sphere: one closed piece, no vertex left over or doubled.
    assert_eq!(surface.positions.len() as i64 - edges.len() as i64 / 2 + surface.indices.len() as i64, 2);
    let named: BTreeSet<_> = surface.indices.iter().flatten().collect();
    assert_eq!(named.len(), surface.positions.len());
}

#[test]
fn surfaces_end_only_at_the_border_of_the_domain() {
    // The sphere of radius 0.6 is cut by the cube's faces.
    let surface = extract(&Scene::ball(10), -0.2);
    let edges = directed_edges(&surface);
    let mut open = 0;
    for ([a, b], count) in &edges {
        assert_eq!(*count, 1);
        if !edges.contains_key(&[*b, *a]) {
            open += 1;
            assert!(
                [a, b].iter().all(|v| on_border(surface.positions[**v as usize])),
                "open edge {a}-{b} inside"
            );
        }
    }
    assert!(open > 50, "the sphere is cut by the cube");
}

#[test]
fn with_ties_every_directed_edge_has_its_opposite() {
    // Whole numbers: thousands of points have exactly the isovalue.
    let scene = Scene::cube(14, |p| (7.0 - 14.0 * distance_to_centre(p)).round());
    let touched = scene.field.iter().filter(|f| **f == 2.0).count();
    assert!(touched > 100, "{touched} ties");
    let surface = extract(&scene, 2.0);
    let edges = directed_edges(&surface);
    assert!(edges.len() > 1000);
    for ([a, b], count) in &edges {
        assert_eq!(edges.get(&[*b, *a]), Some(count), "edge {a}-{b}");
    }
    assert!(surface.indices.iter().all(|[a, b, c]| a != b && b != c && c != a));
}

#[test]
fn normals_follow_the_gradient_to_lower_values() {
    let surface = extract(&Scene::ball(16), 0.3);
    for (p, n) in surface.positions.iter().zip(&surface.normals) {
        let out = sub(*p, [0.5; 3]);
        let n = n.map(f64::from);
        assert!((dot(n, n) - 1.0).abs() < 1e-5);
        let cosine = dot(out, n) / dot(out, out).sqrt();
        assert!(cosine > 0.99, "at {p:?}: {n:?} is {}° off", cosine.acos().to_degrees());
    }
    let volume: f64 = surface
        .indices
        .iter()
        .map(|t| t.map(|v| surface.positions[v as usize]))
        .map(|t| dot(area(t), sub(t[0], [0.5; 3])) / 6.0)
        .sum();
    let exact = 4.0 / 3.0 * std::f64::consts::PI * 0.35_f64.powi(3);
    assert!((volume / exact - 1.0).abs() < 0.03, "the fronts enclose {volume} instead of {exact}");
}

#[test]
fn normals_are_unit_vectors_even_where_the_gradient_cancels() {
    // A ridge one point wide: at its points the gradients of both sides cancel.
    let scene = Scene::cube(4, |p| if p[0] == 0.5 { 1.0 } else { 0.0 });
    let surface = extract(&scene, 1.0);
    for n in &surface.normals {
        assert!((dot(n.map(f64::from), n.map(f64::from)) - 1.0).abs() < 1e-5, "{n:?}");
    }
    assert!(!surface.normals.is_empty());
}

/// The plain twin: vertices in a map by the edge they lie on, triangles cut from tetrahedra by definition.
fn plain(scene: &Scene, iso: f64) -> BTreeSet<[[u32; 2]; 3]> {
    let inside = |p: u32| scene.field[p as usize] < iso;
    let mut triangles = BTreeMap::new();
    for tet in &scene.tets {
        // Keys of the crossings: the two ends, or one point twice.
        let mut keys: Vec<[u32; 2]> = EDGES
            .iter()
            .map(|edge| edge.map(|i| tet[i]))
            .filter(|[a, b]| inside(*a) != inside(*b))
            .map(|[a, b]| if inside(a) { [a, b] } else { [b, a] })
            .map(|[a, b]| if scene.field[b as usize] == iso { [b, b] } else { [a, b] })
            .collect();
        keys.sort_unstable();
        keys.dedup();
        if keys.len() >= 3 {
            *triangles.entry(keys).or_insert(0) += 1;
        }
    }
    triangles.into_keys().filter(|keys| keys.len() == 3).map(|keys| [keys[0], keys[1], keys[2]]).collect()
}

#[test]
fn equals_the_plain_version() {
    let wavy = |p: Point| ((p[0] * 9.0).sin() + (p[1] * 7.0).cos() * (p[2] * 5.0).sin()) * 4.0;
    for (scene, iso) in [
        (Scene::cube(7, wavy), 0.5),
        (Scene::cube(7, move |p| wavy(p).round()), 1.0),
        (Scene::cube(6, |p| (p[0] * 6.0).round()), 3.0),
    ] {
        let surface = extract(&scene, iso);
        // Name every vertex by the edge it lies on, found anew from its position.
        let mut names = BTreeMap::new();
        let mut edges = BTreeSet::new();
        for tet in &scene.tets {
            for [a, b] in EDGES.map(|edge| edge.map(|i| tet[i])) {
                edges.insert(if scene.field[a as usize] < scene.field[b as usize] { [a, b] } else { [b, a] });
            }
        }
        for [a, b] in edges {
            let [fa, fb] = [a, b].map(|p| scene.field[p as usize]);
            if fa < iso && iso <= fb {
                let [p, q] = [a, b].map(|p| scene.positions[p as usize].map(f64::from));
                let t = (iso - fa) / (fb - fa);
                let at = [0, 1, 2].map(|i| (p[i] + t * (q[i] - p[i])).to_bits());
                names.insert(at, if fb == iso { [b, b] } else { [a, b] });
            }
        }
        let name = |v: u32| names[&surface.positions[v as usize].map(f64::to_bits)];
        let mut found = BTreeSet::new();
        let mut quads = 0;
        let wanted = plain(&scene, iso);
        for triangle in &surface.indices {
            let mut keys = triangle.map(name);
            keys.sort_unstable();
            if wanted.contains(&keys) {
                found.insert(keys);
            } else {
                quads += 1
            }
        }
        assert_eq!(found, wanted);
        assert_eq!(quads % 2, 0, "what is left are halves of quadrilaterals");
    }
}

#[test]
fn reuse_and_order_change_nothing() {
    let big = Scene::ball(9);
    let small = Scene::tet([-1.0, 1.0, 1.0, 1.0]);
    let mut reused = IsoSurface::new();
    for (scene, value) in
        [(&big, 0.1), (&small, 0.0), (&big, 0.4), (&big, 9.0), (&big, f64::NAN), (&big, 0.1)]
    {
        reused.extract(&scene.view(), value);
        let fresh = extract(scene, value);
        assert_eq!(reused.positions, fresh.positions);
        assert_eq!(reused.normals, fresh.normals);
        assert_eq!(reused.indices, fresh.indices);
    }
    reused.extract(&big.view(), f64::NAN);
    assert!(reused.indices.is_empty(), "no surface at no value");
}

#[test]
fn values_at_the_ends_of_f64_stay_finite() {
    let surface = extract(&Scene::tet([-f64::MAX, f64::MAX, f64::MAX, f64::MAX]), 0.0);
    assert_eq!(surface.indices.len(), 1);
    let is_finite = |surface: &IsoSurface| {
        let normals = surface.normals.iter().flatten().copied().map(f64::from);
        surface.positions.iter().flatten().copied().chain(normals).all(f64::is_finite)
    };
    assert!(is_finite(&surface));
    let infinite = extract(&Scene::tet([f64::NEG_INFINITY, f64::INFINITY, 1.0, f64::NAN]), 0.0);
    assert!(is_finite(&infinite));
}

#[test]
fn a_cutaway_shows_the_closed_border_of_what_is_kept() {
    let scene = Scene::ball(6);
    for (plane, all) in [
        (ClipPlane::NOTHING, true),
        (ClipPlane { normal: [1.0, 0.0, 0.0], offset: 0.5 }, false),
        (ClipPlane { normal: [0.3, -0.5, 0.8], offset: 0.31 }, false),
    ] {
        let mut cutaway = Cutaway::new();
        cutaway.cut(&scene.view(), &plane);
        assert_eq!(cutaway.kept == scene.tets.len(), all);
        assert_eq!(cutaway.values.len(), cutaway.positions.len());
        // The triangles, seen from outside, enclose exactly the kept volume.
        let volume: f64 = cutaway
            .positions
            .chunks_exact(3)
            .map(|t| dot(area([t[0], t[1], t[2]]), t[0].map(f64::from)) / 6.0)
            .sum();
        let expected = cutaway.kept as f64 / scene.tets.len() as f64;
        assert!((volume - expected).abs() < 1e-5, "{volume} instead of {expected}");
        for (p, value) in cutaway.positions.iter().zip(&cutaway.values) {
            assert_eq!(*value, 1.0 - 2.0 * distance_to_centre(*p));
        }
        // By definition: faces with a kept tetrahedron on exactly one side.
        let kept =
            |t: u32| t != NONE && plane.keeps(scene.tets[t as usize].map(|p| scene.positions[p as usize]));
        let faces = (0..scene.tets.len() as u32)
            .flat_map(|t| scene.neighbors[t as usize].map(|n| (t, n)))
            .filter(|(t, n)| kept(*t) && !kept(*n));
        assert_eq!(cutaway.triangles(), faces.count());
    }
}

#[test]
fn nothing_is_kept_behind_a_far_plane() {
    let mut cutaway = Cutaway::new();
    cutaway.cut(&Scene::ball(3).view(), &ClipPlane { normal: [0.0, 0.0, 1.0], offset: -1.0 });
    assert_eq!((cutaway.kept, cutaway.triangles()), (0, 0));
}

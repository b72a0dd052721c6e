//! Promise: tubes and arrows are closed, face outwards, and are as thick and as long as was asked for.

use crate::scenes::Scene;
use crate::support::meshes::{cube, linear};
use std::collections::BTreeMap;
use std::f64::consts::PI;
use tetralod::view::{
    ArrowLength, ArrowOptions, Place, Probe, Solids, StreamEnd, StreamPoint, Streamline, TubeEnd, TubeOptions,
};

fn line(points: impl IntoIterator<Item = [f64; 3]>) -> Streamline {
    let place = Place { tet: 0, weights: [0.25; 4] };
    let point = |position| StreamPoint { position, time: 0.0, vector: [0.0, 3.0, 4.0], place };
    Streamline { points: points.into_iter().map(point).collect(), end: StreamEnd::Boundary }
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| a[i] - b[i])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
}

fn corners(solids: &Solids, triangle: [u32; 3]) -> [[f64; 3]; 3] {
    triangle.map(|v| solids.positions[v as usize].map(f64::from))
}

fn area_vector([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    cross(sub(b, a), sub(c, a)).map(|x| 0.5 * x)
}

fn area(solids: &Solids) -> f64 {
    solids.indices.iter().map(|t| area_vector(corners(solids, *t))).map(|n| dot(n, n).sqrt()).sum()
}

fn volume(solids: &Solids) -> f64 {
    solids.indices.iter().map(|t| corners(solids, *t)).map(|[a, b, c]| dot(a, cross(b, c)) / 6.0).sum()
}

/// Every directed edge between places has as many opposite ones, normals have length 1, and no array is
/// short.
fn check(solids: &Solids, name: &str) {
    let mut edges = BTreeMap::<[[u64; 3]; 2], i64>::new();
    let place = |v: u32| solids.positions[v as usize].map(|x| (x + 0.0).to_bits());
    for triangle in &solids.indices {
        for i in 0..3 {
            let [a, b] = [place(triangle[i]), place(triangle[(i + 1) % 3])];
            *edges.entry([a, b]).or_default() += 1;
            *edges.entry([b, a]).or_default() -= 1;
        }
    }
    assert!(edges.iter().all(|([a, b], count)| *count == 0 || a == b), "{name} is closed");
    assert_eq!(solids.normals.len(), solids.positions.len());
    assert_eq!(solids.values.len(), solids.positions.len());
    for normal in &solids.normals {
        let normal = normal.map(f64::from);
        assert!((dot(normal, normal) - 1.0).abs() < 1e-5, "{name}: {normal:?}");
    }
}

/// Triangles face the way of the normals of their corners.
fn check_normals(solids: &Solids, name: &str) {
    for triangle in &solids.indices {
        let face = area_vector(corners(solids, *triangle));
        let size = dot(face, face).sqrt();
        if size < 1e-8 {
            continue;
        }
        for v in triangle {
            let normal = solids.normals[*v as usize].map(f64::from);
            assert!(dot(face, normal) > 0.2 * size, "{name}: {normal:?} of {face:?}");
        }
    }
}

const ENDS: [TubeEnd; 2] = [TubeEnd::Flat, TubeEnd::Round];

#[test]
fn straight_tubes_are_prisms() {
    let (r, length) = (0.2, 3.0);
    let straight = line((0..4).map(|i| [1.0 + f64::from(i), 0.5, -0.5]));
    for sides in 3..=16 {
        let mut solids = Solids::with_sides(sides);
        for ends in ENDS {
            solids.set_tubes(std::slice::from_ref(&straight), &TubeOptions { radius: r, ends });
            check(&solids, "a straight tube");
            check_normals(&solids, "a straight tube");
            assert!(solids.values.iter().all(|v| *v == 5.0), "the speed");
            for (p, n) in solids.positions.iter().zip(&solids.normals) {
                let [x, y, z] = p.map(f64::from);
                let nearest = [x.clamp(1.0, 4.0), 0.5, -0.5];
                let d = sub([x, y, z], nearest);
                assert!((dot(d, d).sqrt() - r).abs() < 1e-6, "at the radius");
                let outwards = dot(d, n.map(f64::from));
                assert!(outwards > 0.99 * r || n[0].abs() > 0.99 && ends == TubeEnd::Flat);
            }
            let half = PI / f64::from(sides);
            if ends == TubeEnd::Flat {
                let base = f64::from(sides) * r * r * half.sin() * half.cos();
                assert!((volume(&solids) - base * length).abs() < 1e-5);
                let side = f64::from(sides) * 2.0 * r * half.sin() * length;
                assert!((area(&solids) - side - 2.0 * base).abs() < 1e-4);
            } else {
                assert!(volume(&solids) > 0.3 * PI * r * r * length);
            }
        }
    }
}

#[test]
fn curved_tubes_have_the_area_of_their_length() {
    let (ring, r) = (2.0, 0.1);
    let at = |i: u32| {
        let angle = 1.5 * PI * f64::from(i) / 300.0;
        [ring * angle.cos(), ring * angle.sin(), 0.3 * angle]
    };
    let spiral = line((0..=300).map(at));
    let length: f64 = (0..300).map(|i| sub(at(i + 1), at(i))).map(|d| dot(d, d).sqrt()).sum();
    let mut solids = Solids::with_sides(16);
    let options = TubeOptions { radius: r, ends: TubeEnd::Flat };
    solids.set_tubes(&[spiral], &options);
    check(&solids, "a spiral");
    check_normals(&solids, "a spiral");
    let wanted = 2.0 * PI * r * length + 2.0 * PI * r * r;
    assert!((area(&solids) - wanted).abs() < 0.02 * wanted, "{} {wanted}", area(&solids));
    for p in &solids.positions {
        let p = p.map(f64::from);
        let nearest = (0..3000).map(|i| {
            let (k, s) = (i / 10, f64::from(i % 10) / 10.0);
            let [a, b] = [at(k), at(k + 1)];
            let d = [0, 1, 2].map(|i| p[i] - a[i] - s * (b[i] - a[i]));
            dot(d, d).sqrt()
        });
        assert!((nearest.fold(f64::INFINITY, f64::min) - r).abs() < 1e-3);
    }
}

#[test]
fn sharp_turns_are_not_pinched() {
    for turn in [10.0_f64, 29.0, 31.0, 60.0, 90.0, 120.0, 170.0, 179.9, 180.0] {
        let (sin, cos) = turn.to_radians().sin_cos();
        let bent = line([[0.0; 3], [2.0, 0.0, 0.0], [2.0 + 2.0 * cos, 2.0 * sin, 0.0]]);
        for ends in ENDS {
            let mut solids = Solids::with_sides(12);
            let radius = 0.1;
            solids.set_tubes(std::slice::from_ref(&bent), &TubeOptions { radius, ends });
            check(&solids, "a bend");
            for p in &solids.positions {
                let d = sub(p.map(f64::from), [2.0, 0.0, 0.0]);
                let away = dot(d, d).sqrt();
                assert!(away > 0.999 * radius, "{turn} degrees: {away}");
                assert!(away < 1.04 * radius || away > 1.9, "{turn} degrees: {away}");
            }
        }
    }
}

#[test]
fn bad_lines_have_no_tubes() {
    let mut solids = Solids::with_sides(99);
    let good = line([[0.0; 3], [1.0, 0.0, 0.0]]);
    for lines in [vec![], vec![line([])], vec![line([[1.0; 3]])], vec![line([[1.0; 3]; 5])]] {
        solids.set_tubes(std::slice::from_ref(&good), &TubeOptions::default());
        assert!(!solids.indices.is_empty());
        solids.set_tubes(&lines, &TubeOptions::default());
        assert!(solids.positions.is_empty() && solids.indices.is_empty());
    }
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        solids.set_tubes(std::slice::from_ref(&good), &TubeOptions { radius, ..TubeOptions::default() });
        assert!(solids.indices.is_empty());
    }
    let broken = line([[0.0; 3], [f64::NAN; 3], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]);
    solids.set_tubes_with(&[broken, good], &TubeOptions::default(), |p| p.position[0]);
    check(&solids, "a line with gaps");
    assert_eq!(solids.values.iter().copied().fold(0.0, f64::max), 2.0);
    assert_eq!(solids.indices.len(), (2 * 16 * 2 + 14 * 2) + (2 * 16 + 14 * 2), "sixteen sides");
}

fn scene() -> Scene {
    let mesh = cube(6, &[linear]);
    let positions = mesh.positions.clone();
    Scene::new(positions, mesh.fields[0].values.clone(), mesh.tets.clone())
}

/// How far the vertices of one arrow reach.
fn reach(solids: &Solids, arrow: usize, arrows: usize) -> f64 {
    let each = solids.positions.len() / arrows;
    let points = &solids.positions[arrow * each..(arrow + 1) * each];
    let ends = points.iter().map(|p| p[2]);
    ends.clone().fold(f64::NEG_INFINITY, f64::max) - ends.fold(f64::INFINITY, f64::min)
}

#[test]
fn arrows_are_closed_and_as_long_as_their_vectors() {
    let scene = scene();
    let view = scene.view();
    let count = view.positions.len();
    let zero = vec![0.0; count];
    let along_z: Vec<f64> = view.positions.iter().map(|p| 1.0 + p[0]).collect();
    for sides in [3, 8, 16] {
        let mut solids = Solids::with_sides(sides);
        let options = ArrowOptions { spacing: 0.2, length: ArrowLength::Magnitude };
        let arrows = solids.set_arrows(view, [&zero, &zero, &along_z], None, &options);
        assert_eq!(arrows, 125, "five along each axis");
        check(&solids, "arrows");
        check_normals(&solids, "arrows");
        assert!(volume(&solids) > 0.0);
        let largest = solids.values.iter().copied().fold(0.0, f64::max);
        let each = solids.positions.len() / arrows;
        for arrow in 0..arrows {
            let part = solids.values[arrow * each] / largest;
            assert!((reach(&solids, arrow, arrows) - 0.2 * part).abs() < 1e-6);
            // The tip is where the vector leads.
            let tip = solids.positions[(arrow + 1) * each - 1].map(f64::from);
            let place = Probe::new(view).locate(sub(tip, [0.0, 0.0, 0.1 * part])).expect("inside");
            assert!((place.interpolate(&view, &along_z) - solids.values[arrow * each]).abs() < 1e-5);
        }
    }
    let mut solids = Solids::new();
    let options = ArrowOptions { spacing: 0.3, length: ArrowLength::Constant };
    let arrows = solids.set_arrows(view, [&zero, &zero, &along_z], Some(view.own_field()), &options);
    assert_eq!(arrows, 27);
    assert!((0..arrows).all(|arrow| (reach(&solids, arrow, arrows) - 0.3).abs() < 1e-6));
    assert!(solids.values.iter().any(|v| *v < 0.0), "coloured by the field");
    let before = solids.clone();
    solids.set_arrows(view, [&zero, &zero, &along_z], Some(view.own_field()), &options);
    assert_eq!(solids, before, "the same again");
}

#[test]
fn bad_fields_have_no_arrows() {
    let scene = scene();
    let view = scene.view();
    let [zero, nan, one] = [0.0, f64::NAN, 1.0].map(|x| vec![x; view.positions.len()]);
    let mut solids = Solids::with_sides(3);
    let options = ArrowOptions::default();
    assert_eq!(solids.set_arrows(view, [&zero, &zero, &zero], None, &options), 0);
    assert_eq!(solids.set_arrows(view, [&zero, &nan, &one], None, &options), 0);
    assert_eq!(solids.set_arrows(view, [&zero, &one[1..], &one], None, &options), 0);
    assert_eq!(solids.set_arrows(view, [&zero, &one, &one], Some([].as_slice().into()), &options), 0);
    for spacing in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let options = ArrowOptions { spacing, ..options };
        assert_eq!(solids.set_arrows(view, [&zero, &one, &one], None, &options), 0);
    }
    assert_eq!(solids.set_arrows(Scene::default().view(), [&[], &[], &[]], None, &options), 0);
    let tiny = ArrowOptions { spacing: 1e-200, ..options };
    let arrows = solids.set_arrows(view, [&zero, &one, &one], None, &tiny);
    assert!(arrows > 1000 && arrows <= 1 << 18, "the spacing is doubled: {arrows}");
}

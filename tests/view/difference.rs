//! Promise: the difference of two meshes is nothing where both are exact, and is measured by volume where
//! they are not.

use crate::scenes::Scene;
use crate::support::meshes::{cube, linear};
use tetralod::view::{Difference, FieldStats, MeshView};

fn scene(n: u32, field: fn([f64; 3]) -> f64) -> Scene {
    let mesh = cube(n, &[field]);
    let positions = mesh.positions.clone();
    Scene::new(positions, mesh.fields[0].values.clone(), mesh.tets.clone())
}

#[test]
fn linear_fields_are_the_same_on_all_meshes() {
    for [n, m] in [[2, 7], [7, 2], [5, 5]] {
        let [a, b] = [n, m].map(|n| scene(n, linear));
        let difference = Difference::of(&a.view(), b.view()).expect("a mesh");
        assert_eq!(difference.values.len(), a.positions.len());
        assert!(difference.largest < 1e-5 && difference.root_mean_square < 1e-5, "{difference:?}");
    }
}

#[test]
fn differences_are_linear_fields_if_the_fields_are() {
    let [a, b] = [scene(6, |p| linear(p) + p[0]), scene(4, linear)];
    let difference = Difference::of(&a.view(), b.view()).expect("a mesh");
    for (p, value) in a.positions.iter().zip(&difference.values) {
        assert!((p[0] - value).abs() < 1e-5);
    }
    // The mean of x² over the cube is a third.
    assert!((difference.root_mean_square - (1.0_f64 / 3.0).sqrt()).abs() < 1e-5);
    assert!((difference.largest - 1.0).abs() < 1e-5);
    let back = Difference::of(&b.view(), a.view()).expect("a mesh");
    assert!((back.root_mean_square - difference.root_mean_square).abs() < 1e-5);
}

#[test]
fn coarse_meshes_differ_where_the_field_bends() {
    let [coarse, fine] = [scene(2, |p| p[0] * p[0]), scene(16, |p| p[0] * p[0])];
    let here = Difference::of(&fine.view(), coarse.view()).expect("a mesh");
    // A parabola is at most h²/4 below its chord.
    assert!((here.largest - 0.0625).abs() < 1e-4, "{}", here.largest);
    assert!(here.values.iter().all(|d| *d < 1e-5), "below");
    let there = Difference::of(&coarse.view(), fine.view()).expect("a mesh");
    assert!(there.largest < 1e-6, "the points of the coarse one are exact");
}

#[test]
fn points_outside_are_compared_with_the_nearest() {
    let b = scene(4, linear);
    let mut a = scene(3, linear);
    a.positions.iter_mut().for_each(|p| p[2] += 0.5);
    let difference = Difference::of(&a.view(), b.view()).expect("a mesh");
    assert_eq!(difference.outside, a.positions.iter().filter(|p| p[2] > 1.0).count());
    for ((p, own), value) in a.positions.iter().zip(&a.field).zip(&difference.values) {
        let nearest = [p[0], p[1], p[2].min(1.0)].map(f64::from);
        assert!((own - value - linear(nearest)).abs() < 1e-4, "{p:?}");
    }
    let stats = FieldStats::of(&MeshView { field: &difference.values, ..a.view() });
    assert!(difference.root_mean_square >= stats.mean().abs());
}

#[test]
fn points_too_far_outside_have_no_value() {
    let b = scene(4, linear);
    let mut a = scene(3, linear);
    a.positions.iter_mut().for_each(|p| p[2] += 0.5);
    let everywhere = Difference::of(&a.view(), b.view()).expect("a mesh");
    let near = Difference::within(&a.view(), b.view(), 0.25).expect("a mesh");
    for (i, p) in a.positions.iter().enumerate() {
        let is_near = p[2] - 1.0 <= 0.25;
        assert_eq!(near.values[i].is_nan(), !is_near, "{p:?}");
        assert!(!is_near || near.values[i] == everywhere.values[i], "{p:?}");
    }
    assert!(near.values.iter().any(|value| value.is_nan()) && near.largest.is_finite());
}

#[test]
fn bad_meshes_do_no_harm() {
    let a = scene(2, linear);
    assert_eq!(Difference::of(&a.view(), Scene::default().view()), None);
    let nothing = Difference::of(&Scene::default().view(), a.view()).expect("a mesh");
    assert_eq!(nothing, Difference::default());
    assert_eq!(Difference::of(&Scene::default().view(), Scene::default().view()), None);
    let mut broken = scene(2, linear);
    broken.positions[3] = [f64::NAN; 3];
    let difference = Difference::of(&broken.view(), a.view()).expect("a mesh");
    assert!(difference.values[3].is_nan() && difference.largest.is_finite());
}

//! Promise: shade falls into hollows alone. What is flat or bulges out gets none, whatever its triangles are, nor do silhouettes.

use crate::twin::{self, UNIT};
use glam::DVec3;
use tetralod::geom::{Bounds, Camera, Projection};
use tetralod::view::Triangles;
use tetralod_render::draw::{Colouring, Lighting, Look, Style};
use tetralod_render::gpu::Renderer;

const SIZE: [u32; 2] = [240, 180];

/// A surface of triangles.
#[derive(Default)]
struct Surface {
    positions: Vec<[f64; 3]>,
    indices: Vec<[u32; 3]>,
}

impl Surface {
    /// A grid of `n` by `m` cells that are triangles each, where `place` says for 0 to 1 in both directions.
    fn grid([n, m]: [u32; 2], place: impl Fn(f64, f64) -> DVec3) -> Self {
        let points = (0..=m)
            .flat_map(|j| (0..=n).map(move |i| (f64::from(i) / f64::from(n), f64::from(j) / f64::from(m))));
        let positions = points.map(|(x, y)| place(x, y).into()).collect();
        let at = |i: u32, j: u32| i + (n + 1) * j;
        let cell = |i: u32, j: u32| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        };
        let indices = (0..m).flat_map(|j| (0..n).flat_map(move |i| cell(i, j))).collect();
        Self { positions, indices }
    }

    /// An octahedron, each of whose triangles is split into four so many times, with all vertices on an ellipsoid.
    fn ellipsoid(splits: u32, radii: DVec3) -> Self {
        let corner = |i: usize| DVec3::AXES[i % 3] * if i < 3 { 1.0 } else { -1.0 };
        let mut all: Vec<[DVec3; 3]> = Vec::new();
        for i in 0..8_usize {
            let [x, y, z] = [0, 1, 2].map(|k| corner(k + 3 * (i >> k & 1)));
            all.push(if i.count_ones() % 2 == 0 { [x, y, z] } else { [x, z, y] });
        }
        for _ in 0..splits {
            let split = |[a, b, c]: [DVec3; 3]| {
                let [ab, bc, ca] = [a + b, b + c, c + a].map(DVec3::normalize);
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            };
            all = all.into_iter().flat_map(split).collect();
        }
        let mut surface = Self::default();
        for (i, triangle) in (0..).zip(&all) {
            surface.positions.extend(triangle.map(|p| (p * radii + 0.5).to_array()));
            surface.indices.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        surface
    }

    fn show(&self, renderer: &mut Renderer, key: u32) {
        let triangles =
            Triangles { positions: &self.positions, indices: &self.indices, ..Triangles::default() };
        renderer.set_surface(key, &triangles, None).unwrap();
        let white = Colouring::Sides([[1.0; 3]; 2]);
        renderer.set_style(key, &Style { colouring: white, lighting: Lighting::None, ..Style::default() });
    }
}

fn look(strength: f32) -> Look {
    let ground = [0.5, 0.5, 0.5, 1.0];
    Look { sky: ground, ground, shade: [strength, 0.1], ..Look::default() }
}

/// From all around, in both projections.
fn cameras(bounds: &Bounds) -> impl Iterator<Item = Camera> {
    let bounds = *bounds;
    (0..8).map(move |i| {
        let mut camera = Camera::home(&bounds, twin::aspect(SIZE));
        if i % 2 == 1 {
            camera.set_projection(Projection::Orthographic);
        }
        camera.orbit(0.53 * f64::from(i), 1.1 * (f64::from(i) * 0.37).sin());
        camera.zoom(if i % 3 == 0 { 0.35 } else { 0.8 });
        camera
    })
}

/// How much darker each pixel gets, 0 to 1.
fn darkening(renderer: &mut Renderer, camera: &Camera, name: &str) -> Vec<f64> {
    let [without, with] = [0.0, 1.0].map(|strength| twin::picture(renderer, camera, &look(strength)));
    twin::save(&format!("shade-{name}"), SIZE, &with);
    without
        .iter()
        .zip(&with)
        .map(|(a, b)| (0..3).map(|k| a[k] - b[k]).fold(f64::NEG_INFINITY, f64::max))
        .collect()
}

fn assert_none(renderer: &mut Renderer, name: &str) {
    let levels = |x: &f64| 255.0 * x;
    for (i, camera) in cameras(&UNIT).enumerate() {
        let found = darkening(renderer, &camera, &format!("{name}-{i}"));
        let dark = found.iter().filter(|x| levels(x) > 1.5).count();
        let worst = found.iter().map(levels).fold(0.0, f64::max);
        assert!(dark == 0, "{name}, camera {i}: {dark} pixels are darker, by up to {worst:.1} of 255");
    }
}

#[test]
fn flat_surfaces_of_any_triangles_get_no_shade() {
    let mut renderer = twin::renderer(SIZE);
    // Wide triangles, small ones, slivers; across the view and along it.
    for (name, cells) in [("wide", [1, 1]), ("small", [60, 60]), ("slivers", [200, 3])] {
        for (tilt, along) in [("steep", DVec3::new(0.1, 0.2, 0.95)), ("level", DVec3::new(0.0, 0.9, 0.05))] {
            let place = |x: f64, y: f64| DVec3::new(x, 0.0, 0.0) + along * y;
            Surface::grid(cells, place).show(&mut renderer, 0);
            assert_none(&mut renderer, &format!("{name}-{tilt}"));
        }
    }
}

#[test]
fn convex_bodies_of_any_facets_get_no_shade() {
    let mut renderer = twin::renderer(SIZE);
    for radii in [DVec3::splat(0.45), DVec3::new(0.48, 0.2, 0.06)] {
        for splits in [0, 1, 2, 3, 5] {
            Surface::ellipsoid(splits, radii).show(&mut renderer, 0);
            assert_none(&mut renderer, &format!("ellipsoid-{splits}-{}", radii.z));
        }
    }
}

#[test]
fn silhouettes_before_what_is_far_behind_get_no_shade() {
    let mut renderer = twin::renderer(SIZE);
    Surface::ellipsoid(2, DVec3::splat(0.2)).show(&mut renderer, 0);
    for (key, axis) in [(1, 0), (2, 1), (3, 2)] {
        // Walls around it, farther away than the shade reaches; where two of them meet there is shade.
        let place = |x: f64, y: f64| {
            let mut p = DVec3::splat(-4.0);
            (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (9.0 * x - 4.0, 9.0 * y - 4.0);
            p
        };
        Surface::grid([3, 3], place).show(&mut renderer, key);
    }
    let mut camera = Camera::home(&UNIT, twin::aspect(SIZE));
    camera.orbit(0.4, 0.3);
    camera.zoom(0.5);
    let found = darkening(&mut renderer, &camera, "silhouettes");
    assert!(
        found.iter().all(|x| 255.0 * x < 1.5),
        "{:?}",
        found.iter().map(|x| 255.0 * x).fold(0.0, f64::max)
    );
}

#[test]
fn hollows_get_shade_as_far_as_it_reaches_and_evenly() {
    let mut renderer = twin::renderer(SIZE);
    // A valley whose sides rise by 45 degrees, along y.
    let valley = |x: f64, y: f64| DVec3::new(x, y, 0.5 + (x - 0.5).abs());
    Surface::grid([2, 1], valley).show(&mut renderer, 0);
    let mut camera = Camera::home(&UNIT, twin::aspect(SIZE));
    camera.set_projection(Projection::Orthographic);
    camera.turn_to(tetralod::geom::ViewPreset::AgainstZ);
    let found = darkening(&mut renderer, &camera, "valley");
    let [width, height] = SIZE.map(|side| side as usize);
    let at = |x: f64, y: f64| {
        let screen = camera.project(valley(x, y), twin::aspect(SIZE)).unwrap();
        let column = ((screen.x + 1.0) / 2.0 * width as f64) as usize;
        let row = ((1.0 - screen.y) / 2.0 * height as f64) as usize;
        255.0 * found[row * width + column]
    };
    let across: Vec<f64> = [0.505, 0.53, 0.56].map(|x| at(x, 0.5)).into();
    assert!(across[0] > 30.0, "the bottom is dark: {across:?}");
    assert!(across.is_sorted_by(|a, b| a >= b), "it gets lighter upwards: {across:?}");
    assert!(at(0.7, 0.5).abs() < 1.5 && at(0.3, 0.5).abs() < 1.5, "farther away there is none");
    let along: Vec<f64> = (0..40).map(|i| at(0.51, 0.2 + 0.015 * f64::from(i))).collect();
    let mean = along.iter().sum::<f64>() / along.len() as f64;
    let uneven = along.iter().map(|x| (x - mean).abs()).fold(0.0, f64::max);
    assert!(uneven < 0.25 * mean + 2.0, "it is the same along the valley: {mean:.1}, up to {uneven:.1} off");
}

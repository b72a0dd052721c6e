//! Promise: each side of an isosurface has its own colour, also at silhouettes, where triangles of both sides
//! meet in one pixel.

use crate::scenes::Scene;
use crate::twin::{self, AROUND, Triangle, UNIT};
use tetralod::geom::Camera;
use tetralod::view::{IsoSurface, Triangles};
use tetralod_render::draw::{Colouring, Look, Style};
use tetralod_render::gpu::Renderer;

const SIZE: [u32; 2] = [400, 300];
const RED: [f32; 3] = [1.0, 0.0, 0.0];
const GREEN: [f32; 3] = [0.0, 1.0, 0.0];

/// Balls that have grown together, with bumps all over.
fn bumpy(cells: usize, bumps: f64) -> Scene {
    let balls = [[0.36, 0.42, 0.45], [0.62, 0.55, 0.40], [0.50, 0.40, 0.63], [0.45, 0.64, 0.55]];
    Scene::cube(cells, |p| {
        let near = |ball: &[f64; 3]| {
            let square: f64 = (0..3).map(|i| (p[i] - ball[i]).powi(2)).sum();
            (-square / 0.012).exp()
        };
        let wave = (40.0 * p[0]).sin() * (37.0 * p[1]).sin() * (43.0 * p[2]).sin();
        balls.iter().map(near).sum::<f64>() + bumps * wave
    })
}

fn look() -> Look {
    let colour = [0.3, 0.1, 0.2, 1.0];
    Look { sky: colour, ground: colour, ..Look::default() }
}

fn cameras() -> impl Iterator<Item = Camera> {
    (0..24).map(|i| {
        let mut camera = Camera::home(&UNIT, twin::aspect(SIZE));
        camera.orbit(0.7 * f64::from(i), 0.9 * (f64::from(i) * 0.37).sin());
        camera.zoom(0.6);
        camera
    })
}

fn sides(renderer: &mut Renderer, front: [f32; 3], back: [f32; 3]) {
    renderer.set_style(0, &Style { colouring: Colouring::Sides([front, back]), ..Style::default() });
}

/// Pixels in which any sample shows the back, and pixels that are greener than red.
fn strays(renderer: &mut Renderer, name: &str) -> [usize; 2] {
    let mut count = [0; 2];
    for (i, camera) in cameras().enumerate() {
        sides(renderer, RED, RED);
        let red = twin::bytes(renderer, &camera, &look());
        sides(renderer, RED, GREEN);
        let both = twin::bytes(renderer, &camera, &look());
        if i % 8 == 0 {
            twin::save(&format!("silhouettes-{name}-{i}"), SIZE, &twin::colours(&both));
        }
        let pairs = || red.chunks_exact(4).zip(both.chunks_exact(4));
        count[0] += pairs().filter(|(a, b)| a != b).count();
        count[1] += pairs().filter(|(_, b)| b[1] > b[0]).count();
    }
    count
}

#[test]
fn the_back_of_a_closed_surface_is_never_seen() {
    let mut renderer = twin::renderer(SIZE);
    for (name, cells, bumps) in [("smooth", 20, 0.0), ("bumpy", 20, 0.12), ("fine", 40, 0.12)] {
        let mut surface = IsoSurface::new();
        surface.extract(&bumpy(cells, bumps).view(), 0.5);
        assert!(surface.indices.len() > 1000);
        renderer.set_surface(0, &Triangles::from(&surface), None).unwrap();
        let [any, greener] = strays(&mut renderer, name);
        println!("{name}: {} triangles, {any} pixels with strays", surface.indices.len());
        assert_eq!(greener, 0, "{name}: pixels that show the back");
        // Where fronts and backs are hardly any pixel wide, single samples may meet a back.
        assert!(any <= 40, "{name}: {any} of {} pixels", 24 * SIZE[0] * SIZE[1]);
    }
}

#[test]
fn each_side_of_an_open_surface_has_its_colour() {
    let mut renderer = twin::renderer(SIZE);
    let whole = bumpy(20, 0.12);
    // Of the domain a part alone, which cuts the surface open.
    let is_kept = |tet: &&[u32; 4]| tet.iter().all(|p| whole.positions[*p as usize][0] < 0.51);
    let tets: Vec<_> = whole.tets.iter().filter(is_kept).copied().collect();
    for value in [0.15, 0.5] {
        // The other way round, the back is outside.
        for sign in [1.0, -1.0] {
            let field = whole.field.iter().map(|x| sign * x).collect();
            let scene = Scene::new(whole.positions.clone(), field, tets.clone());
            let mut surface = IsoSurface::new();
            surface.extract(&scene.view(), sign * value);
            let triangles = Triangle::all(&Triangles::from(&surface));
            renderer.set_surface(0, &Triangles::from(&surface), None).unwrap();
            sides(&mut renderer, RED, GREEN);
            let mut seen = [0; 2];
            for (i, camera) in cameras().enumerate().step_by(6) {
                let pixels = twin::picture(&mut renderer, &camera, &look());
                twin::save(&format!("sides-{value}-{sign}-{i}"), SIZE, &pixels);
                for (at, pixel) in pixels.iter().enumerate() {
                    let front = |beside| {
                        let ray = camera.ray(twin::screen(SIZE, at, beside), twin::aspect(SIZE));
                        twin::cast(&triangles, &ray).map(|hit| hit.is_front(&ray))
                    };
                    let Some(is_front) = front([0.0; 2]) else { continue };
                    if AROUND.iter().all(|beside| front(*beside) == Some(is_front)) {
                        seen[usize::from(is_front)] += 1;
                        assert_eq!(pixel[0] > pixel[1], is_front, "{value} {sign} {i}: pixel {at}");
                    }
                }
            }
            assert!(seen.iter().all(|count| *count > 4000), "{seen:?}");
        }
    }
}

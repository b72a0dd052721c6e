//! Promise: volumes, surfaces with opacity, opaque surfaces and clip planes in one picture are composited
//! exactly along each ray.

use crate::mixed::Mixed;
use crate::scenes::Scene;
use crate::twin::{self, UNIT};
use tetralod::geom::{Camera, Projection};
use tetralod::view::{ClipPlane, ColourScale, IsoSurface, Medium, Plane, Slice, Triangles, VIRIDIS};
use tetralod_render::draw::{Colouring, Lighting, Look, SIDES, Style};
use tetralod_render::gpu::{Renderer, wait};

const SIZE: [u32; 2] = [96, 72];

fn iso(scene: &Scene, value: f64) -> IsoSurface {
    let mut surface = IsoSurface::new();
    surface.extract(&scene.view(), value);
    assert!(surface.indices.len() > 100);
    surface
}

fn translucent(opacity: f32, front: [f32; 3]) -> Style {
    Style { opacity, colouring: Colouring::Sides([front, SIDES[1]]), ..Style::default() }
}

fn planes() -> Vec<ClipPlane> {
    vec![
        ClipPlane { normal: [1.0, 0.2, 0.0], offset: 0.75 },
        ClipPlane { normal: [0.0, -1.0, 0.6], offset: 0.05 },
    ]
}

const CASES: [&str; 6] = ["clipped fog", "two", "opaque", "slice", "clipped", "all"];

/// One of the pictures; the volume is all that some have.
fn mixed<'a>(renderer: &mut Renderer, scene: &'a Scene, medium: &'a Medium, case: &str) -> Mixed<'a> {
    let look = Look { clips: if case.contains("clipped") { planes() } else { Vec::new() }, ..twin::plain() };
    let mut mixed = Mixed::new(scene, Some((medium, u32::MAX)), look);
    let mut add = |triangles: &Triangles<'_>, style| mixed.add(renderer, triangles, style);
    if case == "two" || case == "all" {
        add(&Triangles::from(&iso(scene, 0.32)), translucent(0.5, [0.9, 0.3, 0.2]));
        add(&Triangles::from(&iso(scene, 0.02)), translucent(0.35, [0.3, 0.9, 0.5]));
    }
    if case == "opaque" || case == "all" {
        add(&Triangles::from(&iso(scene, 0.12)), Style::default());
    }
    if case == "slice" || case == "all" {
        let scale = ColourScale::new(VIRIDIS, [-0.8, 1.0]).unwrap();
        let mut slice = Slice::new();
        slice.extract(&scene.view(), &Plane::through([0.52, 0.4, 0.5], [0.9, 0.4, 0.3]));
        let lighting = Lighting::Flat;
        let colouring = Colouring::Scale(scale);
        add(&Triangles::from(&slice), Style { colouring, lighting, opacity: 0.6, ..Style::default() });
    }
    if case == "clipped" {
        // The first plane alone cuts one surface, none the other.
        let style = translucent(0.5, [0.9, 0.3, 0.2]);
        add(&Triangles::from(&iso(scene, 0.02)), Style { clips: 0b01, ..style });
        add(&Triangles::from(&iso(scene, 0.32)), Style { clips: 0, ..Style::default() });
        mixed.medium = Some((medium, 0b10));
    }
    mixed
}

fn cameras() -> Vec<(&'static str, Camera)> {
    let mut outside = Camera::home(&UNIT, twin::aspect(SIZE));
    outside.zoom(0.8);
    let mut parallel = outside;
    parallel.orbit(1.3, -0.3);
    parallel.set_projection(Projection::Orthographic);
    let mut inside = outside;
    inside.fly(0.08, 0.03, 0.72);
    inside.look(0.2, 0.1);
    vec![("outside", outside), ("parallel", parallel), ("inside", inside)]
}

#[test]
fn mixed_pictures_are_those_of_the_twin() {
    let mut renderer = twin::renderer(SIZE);
    let [(_, fog), _] = twin::media();
    let pixels = SIZE[0] as usize * SIZE[1] as usize;
    for (mesh, scene, cases) in
        [("ball", Scene::ball(8), &CASES[..]), ("hollow", twin::hollow(), &CASES[4..])]
    {
        for &case in cases {
            let mixed = mixed(&mut renderer, &scene, &fog, case);
            for (place, camera) in cameras() {
                let name = format!("mixed-{mesh}-{case}-{place}");
                let found = mixed.picture(&mut renderer, &camera);
                let expected = mixed.expected(&camera, SIZE);
                twin::save(&name, SIZE, &found);
                let known: Vec<_> = expected.iter().map(|c| c.map_or([1.0, 0.0, 1.0], Into::into)).collect();
                twin::save(&format!("{name}-twin"), SIZE, &known);
                let difference = twin::compare(&found, |pixel| expected[pixel]);
                let worst = 255.0 * difference.worst;
                println!("{name}: {:.2} of 255, {} of {pixels} pixels", worst, difference.compared);
                // Rounding to bytes takes two levels and a half. The colours of surfaces with opacity are
                // rounded, too, each and its opacity, and gloss has high powers of normals that are rounded.
                let most = if case == "clipped fog" { 2.5 } else { 5.0 };
                assert!(worst <= most, "{name}: {worst} at {}", difference.at);
                let least = if case == "all" { 5 } else { 6 };
                assert!(10 * difference.compared > least * pixels, "{name}: {} pixels", difference.compared);
            }
            (0..4).for_each(|key| renderer.remove_surface(key));
        }
    }
}

/// The triangles of a ball around the middle of the unit cube.
fn ball(radius: f64, parts: u32) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    use std::f64::consts::{PI, TAU};
    let at = |i: u32, j: u32| {
        let (around, up) =
            (TAU * f64::from(i % (2 * parts)) / f64::from(2 * parts), PI * f64::from(j) / f64::from(parts));
        [up.sin() * around.cos(), up.sin() * around.sin(), -up.cos()].map(|x| 0.5 + radius * x)
    };
    let places = (0..2 * parts).flat_map(|i| (0..parts).map(move |j| (i, j)));
    let corners = places.map(|(i, j)| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
    let positions: Vec<_> = corners.flatten().collect();
    let quads = (0..positions.len() as u32 / 4).map(|quad| 4 * quad);
    (positions, quads.flat_map(|q| [[q, q + 1, q + 2], [q, q + 2, q + 3]]).collect())
}

const NESTED: u8 = 12;

/// Balls around each other, so that each pixel needs two fragments for each of them: more than lists have room for at first.
fn add_nested(mixed: &mut Mixed<'_>, renderer: &mut Renderer) {
    for i in 0..NESTED {
        let t = f32::from(i) / f32::from(NESTED - 1);
        let colouring = Colouring::Sides([[t, 0.3, 1.0 - t], [1.0 - t, 0.9 * t, 0.2]]);
        let style = Style { colouring, opacity: 0.3, lighting: Lighting::None, ..Style::default() };
        let (positions, indices) = ball(0.5 + 0.02 * f64::from(i), 10);
        let triangles = Triangles { positions: &positions, indices: &indices, ..Triangles::default() };
        mixed.add(renderer, &triangles, style);
    }
}

#[test]
fn lists_get_as_long_as_pictures_need() {
    let mut renderer = twin::renderer(SIZE);
    let empty = Scene::default();
    let mut mixed = Mixed::new(&empty, None, twin::plain());
    add_nested(&mut mixed, &mut renderer);
    let mut camera = Camera::home(&UNIT, twin::aspect(SIZE));
    camera.zoom(0.45);
    renderer.draw(&camera, &mixed.look).unwrap();
    let short = twin::colours(&wait(renderer.read()).unwrap());
    assert!(renderer.is_short());
    let expected = mixed.expected(&camera, SIZE);
    let worst = |pixels: &[[f64; 3]]| 255.0 * twin::compare(pixels, |pixel| expected[pixel]).worst;
    assert!(worst(&short) > 10.0, "{}", worst(&short));
    let whole = mixed.picture(&mut renderer, &camera);
    twin::save("nested", SIZE, &whole);
    assert!(!renderer.is_short());
    println!("nested: {:.2} of 255", worst(&whole));
    // Each of the colours is rounded.
    assert!(worst(&whole) <= 3.5, "{}", worst(&whole));
    let known = expected.iter().flatten().count();
    assert!(2 * known > expected.len(), "{known} pixels");
}

#[test]
fn pictures_without_lists_lack_no_room() {
    let mut renderer = twin::renderer(SIZE);
    let empty = Scene::default();
    add_nested(&mut Mixed::new(&empty, None, twin::plain()), &mut renderer);
    let mut camera = Camera::home(&UNIT, twin::aspect(SIZE));
    camera.zoom(0.45);
    renderer.draw(&camera, &twin::plain()).unwrap();
    wait(renderer.read()).unwrap();
    // It is known now that this picture lacked room, and nobody has asked.
    (0..NESTED).for_each(|key| renderer.remove_surface(key.into()));
    renderer.draw(&camera, &twin::plain()).unwrap();
    assert!(!renderer.is_short(), "to draw it again would change nothing");
}

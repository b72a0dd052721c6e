//! The renderer against a plain twin on the CPU: a ray caster over the same triangles with the same light.

use crate::cutaway::Cutaway;
use crate::scenes::Scene;
use crate::twin::{self, AROUND, Difference, Hit, Lights, Triangle, UNIT, picture, renderer, vec};
use glam::DVec3;
use tetralod::geom::Camera;
use tetralod::view::{ClipPlane, ColourScale, IsoSurface, Light, Medium, Probe, Triangles, VIRIDIS};
use tetralod_render::draw::{BoxLines, CellStyle, Colouring, Look, Style};
use tetralod_render::gpu::Renderer;

const SIZE: [u32; 2] = [160, 120];
/// What a pixel shows when all of it shows the same kind of thing.
fn steady(triangles: &[Triangle], camera: &Camera, pixel: usize) -> Option<Option<Hit>> {
    let at = |beside| {
        let ray = camera.ray(twin::screen(SIZE, pixel, beside), aspect());
        twin::cast(triangles, &ray).map(|hit| (hit.is_front(&ray), hit))
    };
    let middle = at([0.0; 2]);
    for beside in AROUND {
        match (&middle, at(beside)) {
            (None, None) => {}
            // Neighbouring triangles of one smooth surface are fine, silhouettes are not.
            (Some((front, a)), Some((same, b))) if *front == same && a.place.distance(b.place) < 0.05 => {}
            _ => return None,
        }
    }
    Some(middle.map(|(_, hit)| hit))
}

/// Whether all of the screen within two pixels shows this triangle.
fn alone(triangles: &[Triangle], camera: &Camera, pixel: usize, triangle: usize) -> bool {
    [[-2.0, -2.0], [2.0, -2.0], [-2.0, 2.0], [2.0, 2.0]].into_iter().all(|beside| {
        let ray = camera.ray(twin::screen(SIZE, pixel, beside), aspect());
        twin::cast(triangles, &ray).is_some_and(|hit| hit.triangle == triangle)
    })
}

fn aspect() -> f64 {
    twin::aspect(SIZE)
}

/// Asserts that a picture is as expected, and returns how many pixels were compared.
fn check(pixels: &[[f64; 3]], expected: impl Fn(usize) -> Option<DVec3>) -> usize {
    let Difference { compared, worst, at } = twin::compare(pixels, expected);
    assert!(worst < 0.02, "pixel {at} is {:?}, which is {worst} off", pixels[at]);
    compared
}

#[test]
fn the_lit_isosurface_matches_the_ray_caster() {
    let mut renderer = renderer(SIZE);
    let scene = Scene::ball(8);
    let look = Look::default();
    // A closed ball from outside; and an open one, whose inside is seen through the cube's faces.
    for (value, turn) in [(0.3, 0.0), (-0.15, 0.8)] {
        let mut surface = IsoSurface::new();
        surface.extract(&scene.view(), value);
        renderer.set_surface(0, &Triangles::from(&surface), None).unwrap();
        let mut camera = Camera::home(&UNIT, aspect());
        camera.orbit(turn, -0.1);
        let triangles = Triangle::all(&Triangles::from(&surface));
        let lights = Lights::of(&camera);
        let pixels = picture(&mut renderer, &camera, &look);
        let (hits, misses) = (std::cell::Cell::new(0), std::cell::Cell::new(0));
        let compared = check(&pixels, |pixel| {
            Some(match steady(&triangles, &camera, pixel)? {
                Some(hit) => {
                    hits.set(hits.get() + 1);
                    lights.colour(&Style::default(), &hit)
                }
                None => {
                    misses.set(misses.get() + 1);
                    twin::background(&look, SIZE, pixel)
                }
            })
        });
        assert!(hits.get() > 1200 && misses.get() > 5000, "{hits:?} hits, {misses:?} misses");
        assert!(compared > pixels.len() * 9 / 10, "only {compared} pixels were certain");
    }
}

#[test]
fn the_cutaway_matches_the_ray_caster() {
    let mut renderer = renderer(SIZE);
    let scene = Scene::ball(2);
    let look = Look::default();
    let mut cutaway = Cutaway::new();
    let cut = ClipPlane { normal: [1.0, 0.4, 0.0], offset: 0.7 };
    cutaway.cut(&scene.view(), &cut);
    let camera = Camera::home(&UNIT, aspect());
    let triangles: Vec<_> = cutaway
        .positions
        .chunks_exact(3)
        .zip(cutaway.values.chunks_exact(3))
        .map(|(p, v)| {
            let corners = [vec(p[0]), vec(p[1]), vec(p[2])];
            Triangle::new(corners, [DVec3::ZERO; 3], [0, 1, 2].map(|i| v[i]))
        })
        .collect();
    let lights = Lights::of(&camera);
    let mut pixels = Vec::new();
    for (bands, most) in [(5, 5500), (0, 8000)] {
        let scale = ColourScale { bands, ..ColourScale::new(VIRIDIS, [-0.8, 1.0]).unwrap() };
        let cells = CellStyle::default();
        let style = Style { colouring: Colouring::Scale(scale), ..cells.style };
        renderer.set_cells(Some(&CellStyle { style, cut, ..cells }));
        if renderer.wants_mesh() {
            renderer.update_mesh(&scene.view(), None).unwrap();
        }
        assert!(!renderer.wants_mesh());
        pixels = picture(&mut renderer, &camera, &look);
        let compared = check(&pixels, |pixel| {
            let Some(hit) = steady(&triangles, &camera, pixel)? else {
                return Some(twin::background(&look, SIZE, pixel));
            };
            // A pixel where bands meet has parts of both.
            let band = scale.fraction(hit.value) * f64::from(bands);
            let is_between = bands > 0 && (band - band.round()).abs() < 0.15;
            // Far enough inside of the face that neither outline nor neighbour is in the pixel.
            let is_certain = !is_between && alone(&triangles, &camera, pixel, hit.triangle);
            is_certain.then(|| lights.colour(&style, &hit))
        });
        assert!(compared > most, "only {compared} pixels were certain with {bands} bands");
    }

    // Outlines: along the middle of a seen side the picture is darker than the faces beside it.
    let luma = |p: &[f64; 3]| p.iter().sum::<f64>();
    let darkest = pixels.iter().map(luma).fold(f64::INFINITY, f64::min);
    assert!(darkest < 0.3, "outlines are dark: {darkest}");
}

#[test]
fn lines_and_handles_are_where_the_camera_puts_them() {
    let mut renderer = renderer(SIZE);
    let camera = Camera::home(&UNIT, aspect());
    let look = Look::default();
    let roi = BoxLines { bounds: UNIT, colour: [1.0, 0.2, 0.1, 1.0], width: 2.0, handles: true };
    renderer.set_boxes(&[roi]).unwrap();
    let pixels = picture(&mut renderer, &camera, &look);
    let at = |p: DVec3| {
        let screen = camera.project(p, aspect()).unwrap();
        let x = ((screen.x + 1.0) / 2.0 * f64::from(SIZE[0])) as usize;
        let y = ((1.0 - screen.y) / 2.0 * f64::from(SIZE[1])) as usize;
        pixels[y * SIZE[0] as usize + x]
    };
    let red = |p: [f64; 3]| p[0] - p[1];
    // Lines of two pixels, sampled a quarter along an edge; handles in the middle of the faces.
    for p in [DVec3::new(0.25, 0.0, 0.0), DVec3::new(1.0, 0.0, 0.25), DVec3::new(1.0, 0.75, 1.0)] {
        assert!(red(at(p)) > 0.25, "line at {p}: {:?}", at(p));
    }
    for p in [DVec3::new(0.5, 0.0, 0.5), DVec3::new(0.5, 0.5, 1.0), DVec3::new(0.0, 0.5, 0.5)] {
        assert!(red(at(p)) > 0.7, "handle at {p}: {:?}", at(p));
    }
    assert!(red(at(DVec3::new(0.8, 0.0, 0.8))) < 0.05, "faces stay empty");
    let coloured = pixels.iter().filter(|p| red(**p) > 0.1).count();
    assert!((700..4000).contains(&coloured), "{coloured} coloured pixels");
    renderer.set_boxes(&[]).unwrap();
    let empty = picture(&mut renderer, &camera, &look);
    assert_eq!(empty.iter().filter(|p| red(**p) > 0.05).count(), 0);
}

#[test]
fn pictures_are_repeatable_and_follow_the_size() {
    let mut renderer = renderer(SIZE);
    let mut surface = IsoSurface::new();
    surface.extract(&Scene::ball(5).view(), 0.2);
    renderer.set_surface(0, &Triangles::from(&surface), None).unwrap();
    let camera = Camera::home(&UNIT, aspect());
    let first = picture(&mut renderer, &camera, &Look::default());
    renderer.resize([33, 200]);
    assert_eq!(renderer.size(), [33, 200]);
    let narrow = picture(&mut renderer, &camera, &Look::default());
    assert_eq!(narrow.len(), 33 * 200);
    renderer.resize([0, u32::MAX]);
    let [width, height] = renderer.size();
    assert!(width == 1 && (2048..=1 << 20).contains(&height));
    renderer.resize(SIZE);
    assert_eq!(picture(&mut renderer, &camera, &Look::default()), first);
    // An empty surface leaves the background.
    surface.extract(&Scene::ball(5).view(), 7.0);
    renderer.set_surface(0, &Triangles::from(&surface), None).unwrap();
    let empty = picture(&mut renderer, &camera, &Look::default());
    assert!(empty.iter().all(|p| (p[0] - p[2]).abs() < 0.2) && empty != first);
}

/// The largest difference of a channel between the picture of the renderer and that of the slow twin, over
/// all pixels.
fn volume_difference(
    renderer: &mut Renderer,
    scene: &Scene,
    medium: &Medium,
    camera: &Camera,
    name: &str,
) -> f64 {
    let look = twin::plain();
    renderer.set_volume(Some((medium, u32::MAX))).unwrap();
    renderer.update_mesh(&scene.view(), None).unwrap();
    let eye = Probe::new(scene.view()).locate(camera.eye().into());
    renderer.set_eye(&scene.view(), eye.as_ref());
    let found = picture(renderer, camera, &look);
    let lights = medium.picture(scene.view(), camera, SIZE);
    twin::save(name, SIZE, &found);
    let expected: Vec<[f64; 3]> = lights.iter().map(|light| light.on([0.2, 0.3, 0.4])).collect();
    twin::save(&format!("{name}-twin"), SIZE, &expected);
    let worst = |(pixel, light): (&[f64; 3], &Light)| {
        let expected = light.on([0.2, 0.3, 0.4]);
        (0..3).map(|k| (pixel[k] - expected[k]).abs()).fold(0.0, f64::max)
    };
    found.iter().zip(&lights).map(worst).fold(0.0, f64::max)
}

#[test]
fn gpu_matches_cpu_in_volumes() {
    let mut renderer = renderer(SIZE);
    let scenes = [("ball", Scene::ball(10)), ("hollow", twin::hollow())];
    for (scene_name, scene) in &scenes {
        for (medium_name, medium) in &twin::media() {
            let mut camera = Camera::home(&UNIT, f64::from(SIZE[0]) / f64::from(SIZE[1]));
            for turn in 0..2 {
                let name = format!("{scene_name}-{medium_name}-{turn}");
                let worst = volume_difference(&mut renderer, scene, medium, &camera, &name);
                // Two levels, and half of one for rounding and the noise of the background.
                assert!(worst <= 2.5 / 255.0, "{name}: {:.2} of 255", 255.0 * worst);
                camera.orbit(1.1, -0.35);
            }
            // From the middle of the mesh, or of its hollow, and from near a side.
            for factor in [0.01, 12.0] {
                camera.zoom(factor);
                let name = format!("{scene_name}-{medium_name}-inside-{factor}");
                let worst = volume_difference(&mut renderer, scene, medium, &camera, &name);
                assert!(worst <= 2.5 / 255.0, "{name}: {:.2} of 255", 255.0 * worst);
            }
        }
    }
}

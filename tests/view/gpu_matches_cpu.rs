//! The renderer against a plain twin on the CPU: a ray caster over the same triangles with the same light.

use crate::scenes::{Scene, distance_to_centre};
use crate::support::meshes::{blocks, linear};
use glam::{DVec2, DVec3};
use std::pin::pin;
use std::task::{Context as Task, Poll, Waker};
use tetralod::geom::{Bounds, Camera};
use tetralod::gpu::{BoxLines, CellStyle, Colouring, GpuError, Look, Renderer, SIDES, Style};
use tetralod::view::{ClipPlane, ColourScale, Cutaway, IsoSurface, Light, Medium, Probe, Triangles, VIRIDIS};

const SIZE: [u32; 2] = [160, 120];
const UNIT: Bounds = Bounds { min: [0.0; 3], max: [1.0; 3] };

/// Runs a future that makes progress whenever it is asked to, as those of native devices do.
fn wait<T>(future: impl Future<Output = T>) -> T {
    let mut future = pin!(future);
    loop {
        if let Poll::Ready(value) = future.as_mut().poll(&mut Task::from_waker(Waker::noop())) {
            return value;
        }
        std::thread::yield_now();
    }
}

/// A renderer, or `None` after saying that this machine has no adapter. Set `TETRALOD_NEED_GPU` to make that a
/// failure.
fn renderer() -> Option<Renderer> {
    match wait(Renderer::headless(SIZE)) {
        Ok(renderer) => Some(renderer),
        Err(GpuError::NoAdapter(why)) => {
            assert!(std::env::var_os("TETRALOD_NEED_GPU").is_none(), "no Vulkan adapter: {why}");
            println!("skipped: no Vulkan adapter");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

fn picture(renderer: &mut Renderer, camera: &Camera, look: &Look) -> Vec<[f64; 3]> {
    let bytes = wait(renderer.picture(camera, look, 1)).unwrap();
    assert_eq!(bytes.len(), renderer.size().iter().product::<u32>() as usize * 4);
    assert!(bytes.chunks_exact(4).all(|p| p[3] == 255), "pictures are opaque");
    bytes.chunks_exact(4).map(|p| [p[0], p[1], p[2]].map(|c| f64::from(c) / 255.0)).collect()
}

/// A triangle of the twin: corners, what is interpolated over them, and its index.
struct Triangle {
    corners: [DVec3; 3],
    data: [DVec3; 3],
}

struct Hit {
    triangle: usize,
    place: DVec3,
    data: DVec3,
    /// Whether the counter-clockwise side is seen.
    front: bool,
}

/// The nearest triangle along a ray.
fn cast(triangles: &[Triangle], origin: DVec3, direction: DVec3) -> Option<Hit> {
    let mut best: Option<(f64, Hit)> = None;
    for (index, Triangle { corners: [a, b, c], data }) in triangles.iter().enumerate() {
        let (u, v) = (b - a, c - a);
        let normal = u.cross(v);
        let slope = normal.dot(direction);
        if slope == 0.0 {
            continue;
        }
        let t = normal.dot(a - origin) / slope;
        let p = origin + direction * t;
        let size = normal.length_squared();
        let (beta, gamma) = (normal.dot((p - a).cross(v)) / size, normal.dot(u.cross(p - a)) / size);
        let alpha = 1.0 - beta - gamma;
        let inner = alpha.min(beta).min(gamma);
        if t > 0.0 && inner >= 0.0 && best.as_ref().is_none_or(|(nearest, _)| t < *nearest) {
            let data = data[0] * alpha + data[1] * beta + data[2] * gamma;
            best = Some((t, Hit { triangle: index, place: p, data, front: slope < 0.0 }));
        }
    }
    best.map(|(_, hit)| hit)
}

fn decode(c: f64) -> f64 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

fn encode(c: f64) -> f64 {
    let c = c.clamp(0.0, 1.0);
    if c <= 0.0031308 { c * 12.92 } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
}

fn vec(c: [f32; 3]) -> DVec3 {
    DVec3::from(c.map(f64::from))
}

fn rgb([r, g, b, _]: [f32; 4]) -> DVec3 {
    vec([r, g, b])
}

struct Lights {
    key: DVec3,
    fill: DVec3,
    up: DVec3,
    eye: DVec3,
}

impl Lights {
    fn of(camera: &Camera) -> Self {
        let at = |x: f64, y: f64, z: f64| {
            (camera.right() * x + camera.up() * y - camera.forward() * z).normalize()
        };
        Self { key: at(-0.5, 0.75, 0.8), fill: at(0.9, -0.25, 0.35), up: camera.up(), eye: camera.eye() }
    }

    fn diffuse(&self, n: DVec3) -> DVec3 {
        let key = ((n.dot(self.key) + 0.3) / 1.3).max(0.0);
        let fill = ((n.dot(self.fill) + 0.5) / 1.5).max(0.0);
        let sky = 0.5 + 0.5 * n.dot(self.up);
        DVec3::new(1.0, 0.97, 0.92) * (0.82 * key * key)
            + DVec3::new(0.62, 0.74, 0.95) * (0.28 * fill)
            + DVec3::new(0.07, 0.065, 0.06).lerp(DVec3::new(0.13, 0.15, 0.18), sky)
    }

    fn surface(&self, hit: &Hit) -> DVec3 {
        let view = (self.eye - hit.place).normalize();
        let normal = hit.data.normalize();
        let outside = normal.dot(view) + if hit.front { 0.2 } else { -0.2 } > 0.0;
        let n = if outside { normal } else { -normal };
        let albedo = vec(SIDES[usize::from(!outside)]).map(decode);
        let rim = (1.0 - n.dot(view).abs().min(1.0)).powi(3) * (0.5 + 0.5 * n.dot(self.up));
        let gloss = n.dot((view + self.key).normalize()).max(0.0).powi(50);
        let lit = albedo * self.diffuse(n) + DVec3::new(0.75, 0.85, 1.0) * (0.16 * rim) + 0.16 * gloss;
        lit.map(encode)
    }
}

fn background(look: &Look, row: usize, rows: usize) -> DVec3 {
    let t = (row as f64 + 0.5) / rows as f64;
    rgb(look.sky).lerp(rgb(look.ground), t * t * (3.0 - 2.0 * t))
}

/// Compares the picture with `expected`, which says `None` where it cannot tell (close to a side, where samples of
/// one pixel differ). Returns how many pixels were compared.
fn compare(pixels: &[[f64; 3]], expected: impl Fn(DVec2, usize) -> Option<DVec3>) -> usize {
    let [width, height] = SIZE.map(|s| s as usize);
    let mut compared = 0;
    for (i, pixel) in pixels.iter().enumerate() {
        let (x, y) = (i % width, i / width);
        let screen = DVec2::new(
            (x as f64 + 0.5) / width as f64 * 2.0 - 1.0,
            1.0 - (y as f64 + 0.5) / height as f64 * 2.0,
        );
        if let Some(colour) = expected(screen, y) {
            compared += 1;
            let off = (DVec3::from(*pixel) - colour).abs().max_element();
            assert!(off < 0.02, "pixel {x}, {y} is {pixel:?} instead of {colour:?}");
        }
    }
    compared
}

fn aspect() -> f64 {
    f64::from(SIZE[0]) / f64::from(SIZE[1])
}

/// What a pixel shows when all of it shows the same kind of thing.
fn steady(triangles: &[Triangle], camera: &Camera, screen: DVec2) -> Option<Option<Hit>> {
    let at = |dx: f64, dy: f64| {
        let pixel = DVec2::new(dx * 2.0 / f64::from(SIZE[0]), dy * 2.0 / f64::from(SIZE[1]));
        let ray = camera.ray(screen + pixel, aspect());
        cast(triangles, ray.origin, ray.direction)
    };
    let middle = at(0.0, 0.0);
    for (dx, dy) in [(-0.6, -0.6), (0.6, -0.6), (-0.6, 0.6), (0.6, 0.6)] {
        match (&middle, at(dx, dy)) {
            (None, None) => {}
            // Neighbouring triangles of one smooth surface are fine, silhouettes are not.
            (Some(a), Some(b)) if a.front == b.front && a.place.distance(b.place) < 0.05 => {}
            _ => return None,
        }
    }
    Some(middle)
}

/// Whether all of the screen within two pixels shows this triangle.
fn alone(triangles: &[Triangle], camera: &Camera, screen: DVec2, triangle: usize) -> bool {
    [(-2.0, -2.0), (2.0, -2.0), (-2.0, 2.0), (2.0, 2.0)].iter().all(|(dx, dy)| {
        let pixel = DVec2::new(dx * 2.0 / f64::from(SIZE[0]), dy * 2.0 / f64::from(SIZE[1]));
        let ray = camera.ray(screen + pixel, aspect());
        cast(triangles, ray.origin, ray.direction).is_some_and(|hit| hit.triangle == triangle)
    })
}

#[test]
fn the_lit_isosurface_matches_the_ray_caster() {
    let Some(mut renderer) = renderer() else { return };
    let scene = Scene::ball(8);
    let look = Look::default();
    // A closed ball from outside; and an open one, whose inside is seen through the cube's faces.
    for (value, turn) in [(0.3, 0.0), (-0.15, 0.8)] {
        let mut surface = IsoSurface::new();
        surface.extract(&scene.view(), value);
        renderer.set_surface(0, &Triangles::from(&surface), None).unwrap();
        let mut camera = Camera::home(&UNIT, aspect());
        camera.orbit(turn, -0.1);
        let triangles: Vec<_> = surface
            .indices
            .iter()
            .map(|t| Triangle {
                corners: t.map(|v| vec(surface.positions[v as usize])),
                data: t.map(|v| vec(surface.normals[v as usize])),
            })
            .collect();
        let lights = Lights::of(&camera);
        let pixels = picture(&mut renderer, &camera, &look);
        let (hits, misses) = (std::cell::Cell::new(0), std::cell::Cell::new(0));
        let compared = compare(&pixels, |screen, row| {
            Some(match steady(&triangles, &camera, screen)? {
                Some(hit) => {
                    hits.set(hits.get() + 1);
                    lights.surface(&hit)
                }
                None => {
                    misses.set(misses.get() + 1);
                    background(&look, row, SIZE[1] as usize)
                }
            })
        });
        assert!(hits.get() > 1200 && misses.get() > 5000, "{hits:?} hits, {misses:?} misses");
        assert!(compared > pixels.len() * 9 / 10, "only {compared} pixels were certain");
    }
}

#[test]
fn the_cutaway_matches_the_ray_caster() {
    let Some(mut renderer) = renderer() else { return };
    let scene = Scene::ball(2);
    let look = Look::default();
    let mut cutaway = Cutaway::new();
    let cut = ClipPlane { normal: [1.0, 0.4, 0.0], offset: 0.7 };
    cutaway.cut(&scene.view(), &cut);
    let scale = ColourScale::new(VIRIDIS, [-0.8, 1.0]).unwrap();
    let cells = CellStyle::default();
    let style = Style { colouring: Colouring::Scale(scale), ..cells.style };
    renderer.set_cells(Some(&CellStyle { style, cut, ..cells }));
    assert!(renderer.wants_mesh());
    renderer.update_mesh(&scene.view(), None).unwrap();
    assert!(!renderer.wants_mesh());
    let camera = Camera::home(&UNIT, aspect());
    let triangles: Vec<_> = cutaway
        .positions
        .chunks_exact(3)
        .zip(cutaway.values.chunks_exact(3))
        .map(|(p, v)| Triangle {
            corners: [vec(p[0]), vec(p[1]), vec(p[2])],
            data: [0, 1, 2].map(|i| DVec3::splat(f64::from(v[i]))),
        })
        .collect();
    let lights = Lights::of(&camera);
    let pixels = picture(&mut renderer, &camera, &look);
    let compared = compare(&pixels, |screen, row| {
        let Some(hit) = steady(&triangles, &camera, screen)? else {
            return Some(background(&look, row, SIZE[1] as usize));
        };
        // Far enough inside of the face that neither outline nor neighbour is in the pixel.
        if !alone(&triangles, &camera, screen, hit.triangle) {
            return None;
        }
        let [a, b, c] = triangles[hit.triangle].corners;
        let n = (b - a).cross(c - a).normalize();
        let colour = vec(scale.colour(hit.data.x)).map(decode);
        Some((colour * (DVec3::splat(0.62) + 0.55 * lights.diffuse(n))).map(encode))
    });
    assert!(compared > 8000, "only {compared} pixels were certain");

    // Outlines: along the middle of a seen side the picture is darker than the faces beside it.
    let luma = |p: &[f64; 3]| p.iter().sum::<f64>();
    let darkest = pixels.iter().map(luma).fold(f64::INFINITY, f64::min);
    assert!(darkest < 0.3, "outlines are dark: {darkest}");
}

#[test]
fn lines_and_handles_are_where_the_camera_puts_them() {
    let Some(mut renderer) = renderer() else { return };
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
    let Some(mut renderer) = renderer() else { return };
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

fn plain() -> Look {
    let colour = [0.2, 0.3, 0.4, 1.0];
    Look { sky: colour, ground: colour, ..Look::default() }
}

/// The largest difference of a channel between the picture of the renderer and that of the slow twin, over all pixels.
fn volume_difference(
    renderer: &mut Renderer,
    scene: &Scene,
    medium: &Medium,
    camera: &Camera,
    name: &str,
) -> f64 {
    let look = plain();
    renderer.set_volume(Some((medium, u32::MAX))).unwrap();
    renderer.update_mesh(&scene.view(), None).unwrap();
    let eye = Probe::new(scene.view()).locate(camera.eye().into());
    renderer.set_eye(&scene.view(), eye.as_ref());
    let found = picture(renderer, camera, &look);
    let twin = medium.picture(scene.view(), camera, SIZE);
    if let Some(folder) = std::env::var_os("TETRALOD_PICTURES") {
        save(&std::path::Path::new(&folder).join(format!("{name}.ppm")), &found);
        let expected: Vec<[f64; 3]> = twin.iter().map(|light| light.on([0.2, 0.3, 0.4])).collect();
        save(&std::path::Path::new(&folder).join(format!("{name}-twin.ppm")), &expected);
    }
    let worst = |(pixel, light): (&[f64; 3], &Light)| {
        let expected = light.on([0.2, 0.3, 0.4]);
        (0..3).map(|k| (pixel[k] - expected[k]).abs()).fold(0.0, f64::max)
    };
    found.iter().zip(&twin).map(worst).fold(0.0, f64::max)
}

fn save(path: &std::path::Path, pixels: &[[f64; 3]]) {
    let mut bytes = format!("P6 {} {} 255\n", SIZE[0], SIZE[1]).into_bytes();
    bytes.extend(pixels.iter().flatten().map(|c| (c * 255.0).round() as u8));
    std::fs::write(path, bytes).expect("a folder for pictures");
}

fn media() -> [(&'static str, Medium); 2] {
    let fog = [(-1.0, [0.1, 0.3, 0.9, 0.0]), (1.0, [1.0, 0.6, 0.2, 0.7])];
    let shells = [
        (-0.5, [0.2, 0.4, 1.0, 0.0]),
        (-0.1, [0.2, 0.8, 0.6, 0.6]),
        (0.0, [0.9, 0.9, 0.2, 0.0]),
        (0.35, [1.0, 0.5, 0.1, 0.0]),
        (0.4, [1.0, 0.2, 0.1, 0.95]),
        (0.45, [1.0, 0.2, 0.1, 0.0]),
    ];
    [("fog", Medium::new(&fog, 0.5)), ("shells", Medium::new(&shells, 0.2))]
}

#[test]
fn gpu_matches_cpu_in_volumes() {
    let Some(mut renderer) = renderer() else { return };
    let hollow = |cell: [u32; 3]| !cell.iter().all(|c| (2..6).contains(c)) && (cell[0] < 6 || cell[1] > 2);
    let mesh = blocks([8, 8, 8], &[linear], hollow);
    let positions: Vec<[f32; 3]> = mesh.positions.iter().map(|p| p.map(|x| x as f32)).collect();
    let field: Vec<f32> = positions.iter().map(|p| 1.0 - 2.0 * distance_to_centre(*p)).collect();
    let scenes = [("ball", Scene::ball(10)), ("hollow", Scene::new(positions, field, mesh.tets.clone()))];
    for (scene_name, scene) in &scenes {
        for (medium_name, medium) in &media() {
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

//! Promise: the mean of pictures from places inside of the pixels gets to what the pixels cover; transparent
//! backgrounds lie under everything.

use crate::scenes::Scene;
use crate::twin::{self, UNIT};
use tetralod::geom::Camera;
use tetralod::view::{IsoSurface, Medium, Triangles};
use tetralod_render::draw::{BoxLines, Look, Style};
use tetralod_render::gpu::{Renderer, wait};

const SIZE: [u32; 2] = [120, 90];
/// Pixels of the large picture for each of the small one, along each side.
const FINE: u32 = 4;

fn show(renderer: &mut Renderer, scene: &Scene, value: f64, opacity: f32) {
    let mut surface = IsoSurface::new();
    surface.extract(&scene.view(), value);
    renderer.set_surface(0, &Triangles::from(&surface), None).unwrap();
    renderer.set_style(0, &Style { opacity, ..Style::default() });
}

fn camera() -> Camera {
    let mut camera = Camera::home(&UNIT, twin::aspect(SIZE));
    camera.orbit(0.3, 0.1);
    // So far that much of what is covered is covered in part.
    camera.zoom(0.75);
    camera
}

fn mean(renderer: &mut Renderer, look: &Look, pictures: u32) -> Vec<[f64; 3]> {
    twin::colours(&wait(renderer.picture(&camera(), look, pictures)).unwrap())
}

/// The mean of the pixels of a large picture.
fn shrunk(large: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let [width, height] = SIZE;
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
    let parts = |x: u32, y: u32| (0..FINE * FINE).map(move |i| [FINE * x + i % FINE, FINE * y + i / FINE]);
    let colour = |[x, y]: [u32; 2]| large[(y * width * FINE + x) as usize];
    let scale = f64::from(FINE * FINE);
    pixels.map(|[x, y]| [0, 1, 2].map(|k| parts(x, y).map(|at| colour(at)[k]).sum::<f64>() / scale)).collect()
}

/// In levels of a byte, without the one that rounding and the noise of the background make.
fn difference(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let off = a.iter().flatten().zip(b.iter().flatten()).map(|(x, y)| 255.0 * (x - y).abs());
    off.map(|levels| (levels - 1.0).max(0.0)).sum::<f64>() / a.len() as f64
}

#[test]
fn the_mean_of_many_pictures_gets_to_what_pixels_cover() {
    let mut renderer = twin::renderer(SIZE);
    let scene = Scene::ball(10);
    let fog = Medium::new(&[(-1.0, [0.1, 0.3, 0.9, 0.0]), (1.0, [1.0, 0.6, 0.2, 0.7])], 0.5);
    for (name, opacity, has_fog) in [("opaque", 1.0, false), ("translucent", 0.4, false), ("fog", 1.0, true)]
    {
        show(&mut renderer, &scene, 0.3, opacity);
        renderer.set_volume(has_fog.then_some((&fog, u32::MAX))).unwrap();
        renderer.update_mesh(&scene.view(), None).unwrap();
        let look = twin::plain();
        renderer.resize(SIZE.map(|s| FINE * s));
        let exact = shrunk(&mean(&mut renderer, &look, 16));
        renderer.resize(SIZE);
        assert_eq!(renderer.drawn(), 0);
        assert!(!renderer.draw_again().unwrap(), "there is nothing to draw again");
        let off = [1, 4, 16].map(|pictures| {
            let found = mean(&mut renderer, &look, pictures);
            twin::save(&format!("mean-{name}-{pictures}"), SIZE, &found);
            assert_eq!(renderer.drawn(), pictures);
            difference(&found, &exact)
        });
        println!("{name}: 1, 4, 16 pictures are {off:.3?} of 255 off");
        assert!(off[1] < off[0] && off[2] < off[1] && off[2] < 0.7 * off[0], "{name}: {off:?}");
        // The same again, from the beginning.
        assert!(mean(&mut renderer, &look, 16) == mean(&mut renderer, &look, 16));
    }
}

#[test]
fn lines_do_not_blur_in_the_mean() {
    let mut renderer = twin::renderer(SIZE);
    let lines = BoxLines { bounds: UNIT, colour: [1.0, 0.9, 0.2, 1.0], width: 1.0, handles: true };
    renderer.set_boxes(&[lines]).unwrap();
    let [one, many] = [1, 16].map(|pictures| mean(&mut renderer, &twin::plain(), pictures));
    twin::save("lines-16", SIZE, &many);
    let off = one.iter().flatten().zip(many.iter().flatten()).map(|(a, b)| (a - b).abs());
    let worst = 255.0 * off.fold(0.0, f64::max);
    assert!(worst <= 3.0, "{worst}");
}

#[test]
fn what_is_drawn_on_nothing_can_be_laid_over_anything() {
    let mut renderer = twin::renderer(SIZE);
    let scene = Scene::ball(8);
    let fog = Medium::new(&[(-1.0, [0.1, 0.3, 0.9, 0.0]), (1.0, [1.0, 0.6, 0.2, 0.7])], 0.5);
    let lines = BoxLines { bounds: UNIT, colour: [1.0, 0.9, 0.2, 0.8], width: 2.0, handles: true };
    renderer.set_boxes(&[lines]).unwrap();
    for (opacity, has_fog, shade) in
        [(1.0, false, 0.0), (0.5, false, 0.0), (1.0, true, 0.0), (0.5, true, 0.7)]
    {
        show(&mut renderer, &scene, 0.3, opacity);
        renderer.set_volume(has_fog.then_some((&fog, u32::MAX))).unwrap();
        renderer.update_mesh(&scene.view(), None).unwrap();
        for colour in [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.2, 0.6, 0.9]] {
            let [r, g, b] = colour;
            let on = |opacity| {
                let colour = [r, g, b, opacity];
                Look { sky: colour, ground: colour, shade: [shade, 0.2], ..Look::default() }
            };
            for pictures in [1, 3] {
                let bytes = wait(renderer.picture(&camera(), &on(0.0), pictures)).unwrap();
                assert!(bytes.chunks_exact(4).all(|p| p[..3].iter().all(|c| *c <= p[3].saturating_add(1))));
                assert!(bytes.chunks_exact(4).any(|p| p[3] == 0), "there is nothing in the corners");
                let opaque = mean(&mut renderer, &on(1.0), pictures);
                let over = bytes.chunks_exact(4).map(|p| {
                    let through = 1.0 - f64::from(p[3]) / 255.0;
                    [0, 1, 2].map(|k| f64::from(p[k]) / 255.0 + through * f64::from(colour[k]))
                });
                let over: Vec<[f64; 3]> = over.collect();
                let off =
                    |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max);
                let worst = 255.0 * over.iter().zip(&opaque).map(off).fold(0.0, f64::max);
                println!("opacity {opacity}, fog {has_fog}, {pictures} over {colour:?}: {worst:.2} of 255");
                assert!(worst < 2.01, "{worst}");
            }
        }
    }
}

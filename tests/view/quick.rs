//! Promise: quick pictures differ from others at edges and in hollows alone, take less memory, and leave no trace.

use crate::scenes::Scene;
use crate::twin::{self, UNIT};
use tetralod::geom::Camera;
use tetralod::view::{IsoSurface, Medium, Triangles};
use tetralod_render::draw::{BoxLines, Look, Style};
use tetralod_render::gpu::Renderer;

const SIZE: [u32; 2] = [160, 120];

fn renderer(opacity: f32, has_fog: bool) -> Renderer {
    let mut renderer = twin::renderer(SIZE);
    let scene = Scene::ball(10);
    let mut surface = IsoSurface::new();
    surface.extract(&scene.view(), 0.3);
    renderer.set_surface(0, &Triangles::from(&surface), None).unwrap();
    renderer.set_style(0, &Style { opacity, ..Style::default() });
    let fog = Medium::new(&[(-1.0, [0.1, 0.3, 0.9, 0.0]), (1.0, [1.0, 0.6, 0.2, 0.7])], 0.5);
    renderer.set_volume(has_fog.then_some((&fog, u32::MAX))).unwrap();
    renderer.update_mesh(&scene.view(), None).unwrap();
    let lines = BoxLines { bounds: UNIT, colour: [1.0, 0.9, 0.2, 0.8], width: 1.0, handles: true };
    renderer.set_boxes(&[lines]).unwrap();
    renderer
}

fn camera() -> Camera {
    let mut camera = Camera::home(&UNIT, twin::aspect(SIZE));
    camera.orbit(0.3, 0.1);
    camera
}

fn shaded() -> Look {
    Look { shade: [0.7, 0.2], ..twin::plain() }
}

/// Pixels whose colours are more than some levels apart.
fn differing(a: &[u8], b: &[u8]) -> usize {
    let pixels = a.chunks_exact(4).zip(b.chunks_exact(4));
    pixels.filter(|(a, b)| a.iter().zip(*b).any(|(x, y)| x.abs_diff(*y) > 4)).count()
}

#[test]
fn they_differ_at_edges_alone_and_have_no_shade() {
    for (name, opacity, has_fog) in [("opaque", 1.0, false), ("translucent", 0.4, false), ("fog", 1.0, true)]
    {
        let mut renderer = renderer(opacity, has_fog);
        let mut draw = |is_quick: bool, look: &Look| {
            renderer.set_quick(is_quick);
            twin::bytes(&mut renderer, &camera(), look)
        };
        let plain = draw(false, &twin::plain());
        let quick = draw(true, &twin::plain());
        twin::save(&format!("quick-{name}"), SIZE, &twin::colours(&quick));
        let edges = differing(&plain, &quick);
        println!("{name}: {edges} of {} pixels differ", plain.len() / 4);
        assert!(edges < plain.len() / 4 / 20, "{name}: {edges}");
        assert!(draw(true, &shaded()) == quick, "{name}: quick pictures have no shade");
        // What was drawn quickly is not seen in what is drawn then.
        assert!(draw(false, &twin::plain()) == plain, "{name}: the picture is another one after a quick one");
    }
}

#[test]
fn they_are_no_part_of_a_mean() {
    let mut renderer = renderer(1.0, false);
    renderer.draw(&camera(), &shaded()).unwrap();
    assert_eq!(renderer.drawn(), 1);
    let memory = renderer.memory();
    renderer.set_quick(true);
    assert_eq!(renderer.drawn(), 0, "the picture is out of date");
    renderer.draw(&camera(), &shaded()).unwrap();
    assert_eq!(renderer.drawn(), 0);
    assert!(!renderer.draw_again().unwrap(), "there is nothing to make better");
    assert!(renderer.memory() < memory, "{} of {memory}", renderer.memory());
    renderer.set_quick(false);
    renderer.draw(&camera(), &shaded()).unwrap();
    assert_eq!(renderer.drawn(), 1);
}

#[test]
fn they_can_have_fewer_pixels() {
    let mut renderer = renderer(1.0, false);
    let plain = twin::picture(&mut renderer, &camera(), &twin::plain());
    renderer.set_quick(true);
    renderer.set_scale(0.5);
    let coarse = twin::picture(&mut renderer, &camera(), &twin::plain());
    twin::save("quick-half", SIZE, &coarse);
    let off = plain.iter().flatten().zip(coarse.iter().flatten()).map(|(a, b)| (a - b).abs());
    let mean = 255.0 * off.sum::<f64>() / (3 * plain.len()) as f64;
    assert!(mean > 0.5 && mean < 6.0, "{mean} levels of a byte");
}

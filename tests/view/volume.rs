//! Promise: the light through a volume is the integral of emission and absorption along each ray, also where the domain is
//! not convex, has holes, or comes in several pieces.

use crate::scenes::Scene;
use crate::support::meshes::{blocks, cube, hilly, linear};
use crate::support::random::Random;
use tetralod::geom::{Bounds, Camera};
use tetralod::mesh::TetMesh;
use tetralod::view::{Light, Medium, MeshView, Probe};

fn scene(mesh: &TetMesh) -> Scene {
    let positions = mesh.positions.clone();
    let field = mesh.fields[0].values.clone();
    Scene::new(positions, field, mesh.tets.clone())
}

/// Bends at several values, with an opacity that rises and falls.
fn bumpy() -> Medium {
    let points = [
        (-1.0, [0.1, 0.2, 0.9, 0.0]),
        (0.2, [0.2, 0.9, 0.3, 0.5]),
        (0.3, [0.9, 0.8, 0.1, 0.05]),
        (0.8, [0.9, 0.1, 0.1, 0.9]),
        (0.9, [1.0, 1.0, 1.0, 0.0]),
    ];
    Medium::new(&points, 0.3)
}

fn through(medium: &Medium, mesh: MeshView<'_>, from: [f64; 3], to: [f64; 3]) -> Light {
    let length = (0..3).map(|k| (to[k] - from[k]).powi(2)).sum::<f64>().sqrt();
    medium.along(&mesh, &Probe::new(mesh).line(from, to), length)
}

fn assert_near(found: Light, expected: Light, most: f64) {
    for k in 0..3 {
        assert!((found.colour[k] - expected.colour[k]).abs() < most, "{found:?}, not {expected:?}");
    }
    assert!((found.transmittance - expected.transmittance).abs() < most, "{found:?}, not {expected:?}");
}

/// The same integral by very many short steps.
fn by_steps(medium: &Medium, value: impl Fn(f64) -> Option<f64>, length: f64) -> Light {
    let steps = 200_000;
    (0..steps).fold(Light::NONE, |light, i| match value((f64::from(i) + 0.5) / f64::from(steps)) {
        Some(value) => light.over(medium.piece([value; 2], length / f64::from(steps))),
        None => light,
    })
}

#[test]
fn a_constant_medium_absorbs_by_the_way_through_it() {
    let mesh = scene(&cube(3, &[linear]));
    let colour = [0.25, 0.5, 1.0];
    // 0.6 of the light is absorbed on each 0.5 units.
    let medium = Medium::new(&[(0.0, [colour[0], colour[1], colour[2], 0.6])], 0.5);
    let mut random = Random::new(3);
    for _ in 0..50 {
        // From one side of the cube to the opposite one.
        let (a, b) = ([(); 2].map(|()| random.fraction()), [(); 2].map(|()| random.fraction()));
        let (from, to) = ([a[0], a[1], 0.0], [b[0], b[1], 1.0]);
        let way = ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2) + 1.0).sqrt();
        let transmittance = 0.4_f64.powf(way / 0.5);
        let expected = Light { colour: colour.map(|c| c * (1.0 - transmittance)), transmittance };
        assert_near(through(&medium, mesh.view(), from, to), expected, 1e-9);
        // What lies outside adds nothing.
        let beyond = |p: [f64; 3], q: [f64; 3]| [0, 1, 2].map(|k| p[k] + 2.0 * (p[k] - q[k]));
        assert_near(through(&medium, mesh.view(), beyond(from, to), beyond(to, from)), expected, 1e-9);
    }
}

/// Along x the field of this mesh is x itself; an extinction that grows linearly has a depth that grows with the square.
#[test]
fn a_linear_medium_in_a_linear_field_has_the_integral_of_theory() {
    let mut mesh = cube(4, &[linear]);
    mesh.fields[0].values = mesh.positions.iter().map(|p| p[0]).collect();
    let scene = scene(&mesh);
    let small = 1e-3;
    // For small opacities the extinction is the opacity; what is left of the square is below the tolerance.
    let medium = Medium::new(&[(0.0, [1.0, 0.0, 0.0, 0.0]), (1.0, [0.0, 1.0, 0.0, small])], 1.0);
    let light = through(&medium, scene.view(), [-1.0, 0.3, 0.4], [2.0, 0.3, 0.4]);
    // Depth: ∫ small·x; red: ∫ small·x·(1 − x); green: ∫ small·x².
    let expected = Light { colour: [small / 6.0, small / 3.0, 0.0], transmittance: 1.0 - small / 2.0 };
    assert_near(light, expected, 1.5e-6);
}

#[test]
fn pieces_are_the_limit_of_short_steps() {
    let medium = bumpy();
    for (from, to) in [(-2.0, 2.0), (1.0, -0.5), (0.25, 0.25), (0.1, 0.85), (5.0, 7.0), (-3.0, -2.0)] {
        for length in [0.01, 1.0, 20.0] {
            let expected = by_steps(&medium, |t| Some(from + t * (to - from)), length);
            assert_near(medium.piece([from, to], length), expected, 1e-6);
        }
    }
    // A piece may be cut anywhere.
    let whole = medium.piece([-0.4, 0.9], 0.7);
    let cut = medium.piece([-0.4, 0.25], 0.35).over(medium.piece([0.25, 0.9], 0.35));
    assert_near(whole, cut, 1e-9);
}

/// A hollow cube: rays enter it twice, and the field is not linear.
#[test]
fn rays_through_a_hollow_domain_skip_what_is_outside() {
    let hollow = |cell: [u32; 3]| !cell.iter().all(|c| (2..6).contains(c));
    let mesh = blocks([8, 8, 8], &[hilly], hollow);
    let scene = scene(&mesh);
    let (medium, view) = (bumpy(), scene.view());
    let mut random = Random::new(5);
    let mut twice = 0;
    for _ in 0..40 {
        let end =
            |random: &mut Random, x: f64| [x, 0.2 + 0.6 * random.fraction(), 0.2 + 0.6 * random.fraction()];
        let (from, to) = (end(&mut random, -0.2), end(&mut random, 1.2));
        let length = (0..3).map(|k| (to[k] - from[k]).powi(2)).sum::<f64>().sqrt();
        let mut probe = Probe::new(view);
        let spans = probe.line(from, to);
        twice += usize::from(spans.windows(2).any(|pair| pair[1].from - pair[0].to > 0.1));
        let at = |t: f64| {
            let p = [0, 1, 2].map(|k| from[k] + t * (to[k] - from[k]));
            probe.locate(p).map(|place| place.value(&view))
        };
        let mut at = at;
        let steps = 4000;
        let mut expected = Light::NONE;
        for i in 0..steps {
            if let Some(value) = at((f64::from(i) + 0.5) / f64::from(steps)) {
                expected = expected.over(medium.piece([value; 2], length / f64::from(steps)));
            }
        }
        assert_near(medium.along(&view, &spans, length), expected, 2e-3);
    }
    assert!(twice > 10, "{twice} rays go through the hollow");
}

#[test]
fn pictures_show_the_domain_and_nothing_beside_it() {
    let mesh = scene(&cube(4, &[linear]));
    let bounds = Bounds { min: [0.0; 3], max: [1.0; 3] };
    let camera = Camera::home(&bounds, 1.0);
    let medium = Medium::new(&[(0.0, [1.0, 1.0, 1.0, 0.5])], 1.0);
    let size = 24;
    let picture = medium.picture(mesh.view(), &camera, [size; 2]);
    assert_eq!(picture.len(), (size * size) as usize);
    let is_seen = |light: &Light| light.transmittance < 1.0;
    assert!(is_seen(&picture[(size / 2 * size + size / 2) as usize]), "the middle");
    assert!([0, size - 1].iter().all(|&corner| !is_seen(&picture[corner as usize])), "the corners");
    let seen = picture.iter().filter(|light| is_seen(light)).count();
    assert!((100..500).contains(&seen), "{seen} pixels");
    // White light of a white medium: what is absorbed is emitted.
    for light in picture {
        let absorbed = 1.0 - light.transmittance;
        assert!(light.colour.iter().all(|c| (c - absorbed).abs() < 1e-9));
        assert!(light.on([1.0; 3]).iter().all(|c| (c - 1.0).abs() < 1e-9));
    }
}

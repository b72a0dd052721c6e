//! Promise: the light through a linear field is the integral that theory gives in closed form: in a box, and in a shell
//! around a hole, which rays enter twice; along rays of the twin, and in pictures of the renderer.

use crate::scenes::Scene;
use crate::support::meshes::{blocks, linear};
use crate::support::random::Random;
use glam::DVec3;
use tetralod::view::{Light, Medium, Probe};

/// The opacity of a unit length.
const UNIT_LENGTH: f64 = 0.5;
/// A part of a ray: the distances of its ends.
type Part = [f64; 2];

/// A domain in the unit cube.
struct Domain {
    name: &'static str,
    scene: Scene,
    /// Along each axis, the ends of the cube that is missing.
    hole: Option<[f64; 2]>,
}

fn domains() -> [Domain; 2] {
    let scene = |is_inside: fn([u32; 3]) -> bool| {
        let mesh = blocks([8; 3], &[linear], is_inside);
        let positions = mesh.positions.clone();
        Scene::new(positions, mesh.fields[0].values.clone(), mesh.tets)
    };
    let is_shell = |cell: [u32; 3]| !cell.iter().all(|c| (2..6).contains(c));
    [
        Domain { name: "box", scene: scene(|_| true), hole: None },
        Domain { name: "shell", scene: scene(is_shell), hole: Some([0.25, 0.75]) },
    ]
}

impl Domain {
    /// Where a ray, from distance 0 on, is in the domain.
    fn parts(&self, origin: DVec3, direction: DVec3) -> Vec<Part> {
        let Some([enter, leave]) = in_cube(origin, direction, [0.0, 1.0]) else { return Vec::new() };
        match self.hole.and_then(|hole| in_cube(origin, direction, hole)) {
            Some([a, b]) => [[enter, a], [b, leave]].into_iter().filter(|[a, b]| a < b).collect(),
            None => vec![[enter, leave]],
        }
    }

    fn light(&self, theory: &Theory, origin: DVec3, direction: DVec3) -> Light {
        let parts = self.parts(origin, direction);
        parts.iter().fold(Light::NONE, |light, part| {
            let values = part.map(|t| linear((origin + t * direction).into()));
            light.over((theory.part)(values, part[1] - part[0]))
        })
    }
}

/// Where a ray, from distance 0 on, is in the cube from `low` to `high`.
fn in_cube(origin: DVec3, direction: DVec3, [low, high]: [f64; 2]) -> Option<Part> {
    let (a, b) = ((low - origin) / direction, (high - origin) / direction);
    let enter = a.min(b).max_element().max(0.0);
    let leave = a.max(b).min_element();
    (enter < leave).then_some([enter, leave])
}

/// A medium with the closed form of its light.
struct Theory {
    name: &'static str,
    medium: Medium,
    /// The light of a part of a ray with these values at its ends, and this length.
    part: fn([f64; 2], f64) -> Light,
    /// How far the medium may be from that: opacities are taken piece by piece.
    most: f64,
}

const ENDS: [f64; 2] = [-3.0, 3.0];
const DENSE: f64 = 0.6;
const COLOURS: [[f64; 3]; 2] = [[0.1, 0.3, 0.9], [1.0, 0.6, 0.2]];
const OPACITIES: [f64; 2] = [0.05, 0.5];

/// What is linear over [`ENDS`], at a value of the field.
fn between(value: f64, [low, high]: [f64; 2]) -> f64 {
    low + (high - low) * (value - ENDS[0]) / (ENDS[1] - ENDS[0])
}

/// Constant extinction σ, linear colour: ∫ (a + (b − a) t/d) σ exp(−σ t) dt = a (1 − E) + (b − a) ((1 − E)/(σ d) − E) with
/// E = exp(−σ d).
fn linear_colour(values: [f64; 2], length: f64) -> Light {
    let depth = -(1.0 - DENSE).ln() / UNIT_LENGTH * length;
    let through = (-depth).exp();
    let colour = [0, 1, 2].map(|k| {
        let [a, b] = values.map(|value| between(value, [COLOURS[0][k], COLOURS[1][k]]));
        a * (1.0 - through) + (b - a) * ((1.0 - through) / depth - through)
    });
    Light { colour, transmittance: through }
}

/// Linear opacity, constant colour: with u = 1 − opacity the extinction is −ln u for each unit length, and
/// ∫ −ln u dt = d (F(a) − F(b)) / (b − a) with F(u) = u ln u − u.
fn linear_opacity(values: [f64; 2], length: f64) -> Light {
    let [a, b] = values.map(|value| 1.0 - between(value, OPACITIES));
    let antiderivative = |u: f64| u * u.ln() - u;
    let is_constant = (b - a).abs() < 1e-7;
    let mean = if is_constant { -a.ln() } else { (antiderivative(a) - antiderivative(b)) / (b - a) };
    let through = (-mean * length / UNIT_LENGTH).exp();
    Light { colour: COLOURS[1].map(|c| c * (1.0 - through)), transmittance: through }
}

fn theories() -> [Theory; 2] {
    let medium = |colours: [[f64; 3]; 2], opacities: [f64; 2]| {
        let point = |i: usize| {
            let [r, g, b] = colours[i];
            (ENDS[i], [r, g, b, opacities[i]])
        };
        Medium::new(&[point(0), point(1)], UNIT_LENGTH)
    };
    [
        Theory {
            name: "linear colour",
            medium: medium(COLOURS, [DENSE; 2]),
            part: linear_colour,
            // The field is rounded to 32 bits.
            most: 1e-6,
        },
        Theory {
            name: "linear opacity",
            medium: medium([COLOURS[1]; 2], OPACITIES),
            part: linear_opacity,
            most: 5e-4,
        },
    ]
}

/// The largest difference of a channel.
fn off(a: &Light, b: &Light) -> f64 {
    let colours = (0..3).map(|k| (a.colour[k] - b.colour[k]).abs()).fold(0.0, f64::max);
    colours.max((a.transmittance - b.transmittance).abs())
}

#[test]
fn the_twin_has_the_integrals_of_theory() {
    for domain in domains() {
        let mut probe = Probe::new(domain.scene.view());
        probe.make_grid();
        for theory in theories() {
            let mut random = Random::new(11);
            let mut near = || [(); 3].map(|()| 1.6 * random.fraction() - 0.3);
            let (mut worst, mut twice) = (0.0_f64, 0);
            for _ in 0..400 {
                let (from, through) = (near(), near());
                let direction = (DVec3::from(through) - DVec3::from(from)).normalize();
                let (from, to) = (DVec3::from(from) - 3.0 * direction, DVec3::from(from) + 3.0 * direction);
                let spans = probe.line(from.into(), to.into());
                let found = theory.medium.along(&domain.scene.view(), &spans, from.distance(to));
                worst = worst.max(off(&found, &domain.light(&theory, from, direction)));
                twice += usize::from(domain.parts(from, direction).len() == 2);
            }
            println!("{}, {}: {worst:.1e} off, {twice} rays enter twice", domain.name, theory.name);
            assert!(worst < theory.most, "{}, {}: {worst}", domain.name, theory.name);
            assert_eq!(twice > 50, domain.hole.is_some());
        }
    }
}

#[test]
fn pictures_have_the_integrals_of_theory() {
    use crate::twin::{self, UNIT};
    use tetralod::geom::{Camera, Projection};

    const SIZE: [u32; 2] = [120, 90];
    let mut renderer = twin::renderer(SIZE);
    let mut outside = Camera::home(&UNIT, twin::aspect(SIZE));
    outside.orbit(0.2, 0.05);
    let mut parallel = outside;
    parallel.orbit(1.9, -0.4);
    parallel.set_projection(Projection::Orthographic);
    // In the hole of the shell, and in the middle of the box.
    let mut inside = outside;
    inside.zoom(0.01);
    let cameras = [("outside", outside), ("parallel", parallel), ("inside", inside)];
    for domain in domains() {
        let view = domain.scene.view();
        for theory in theories() {
            renderer.set_volume(Some((&theory.medium, u32::MAX))).unwrap();
            renderer.update_mesh(&view, None).unwrap();
            for (place, camera) in &cameras {
                renderer.set_eye(&view, Probe::new(view).locate(camera.eye().into()).as_ref());
                let found = twin::picture(&mut renderer, camera, &twin::plain());
                let difference = twin::compare(&found, |pixel| {
                    let ray = camera.ray(twin::screen(SIZE, pixel, [0.0; 2]), twin::aspect(SIZE));
                    Some(domain.light(&theory, ray.origin, ray.direction).on([0.2, 0.3, 0.4]).into())
                });
                let worst = 255.0 * difference.worst;
                let name = format!("{}, {}, {place}", domain.name, theory.name);
                println!("{name}: {worst:.2} of 255 over {} pixels", difference.compared);
                // Two levels, and half of one for rounding and the noise of the background.
                assert!(worst <= 2.5, "{name}: {worst} at pixel {}", difference.at);
                assert_eq!(difference.compared, found.len());
            }
        }
    }
}

//! The twin of pictures in which a volume, surfaces with opacity and opaque ones are mixed: exact along each
//! ray.

use crate::scenes::Scene;
use crate::twin::{self, AROUND, Hit, Lights, Triangle};
use glam::DVec3;
use tetralod::geom::{Camera, Ray};
use tetralod::view::{ClipPlane, Light, Medium, Probe, Span, Triangles};
use tetralod_render::draw::{Look, Style};
use tetralod_render::gpu::Renderer;

/// A surface of a mixed picture.
pub struct Part {
    pub triangles: Vec<Triangle>,
    pub style: Style,
}

/// All that a picture shows.
pub struct Mixed<'a> {
    scene: &'a Scene,
    /// The medium of the volume, and the clip planes that cut it.
    pub medium: Option<(&'a Medium, u32)>,
    parts: Vec<Part>,
    pub look: Look,
}

/// Where a ray meets which part, from which side.
struct Met {
    part: usize,
    is_front: bool,
    hit: Hit,
}

impl<'a> Mixed<'a> {
    pub fn new(scene: &'a Scene, medium: Option<(&'a Medium, u32)>, look: Look) -> Self {
        Self { scene, medium, parts: Vec::new(), look }
    }

    /// Adds a surface here and to the renderer.
    pub fn add(&mut self, renderer: &mut Renderer, triangles: &Triangles<'_>, style: Style) {
        let key = self.parts.len() as u32;
        renderer.set_surface(key, triangles, None).unwrap();
        renderer.set_style(key, &style);
        self.parts.push(Part { triangles: Triangle::all(triangles), style });
    }

    /// The renderer's picture, twice the same, and the surfaces removed from it.
    pub fn picture(&self, renderer: &mut Renderer, camera: &Camera) -> Vec<[f64; 3]> {
        renderer.set_volume(self.medium).unwrap();
        let view = self.scene.view();
        renderer.update_mesh(&view, None).unwrap();
        renderer.set_eye(&view, Probe::new(view).locate(camera.eye().into()).as_ref());
        let first = twin::bytes(renderer, camera, &self.look);
        // Fragments come in any order into the lists.
        assert!(twin::bytes(renderer, camera, &self.look) == first, "the same picture again");
        twin::colours(&first)
    }

    /// What pixels show, where all of a pixel shows the same.
    pub fn expected(&self, camera: &Camera, size: [u32; 2]) -> Vec<Option<DVec3>> {
        let mut probe = Probe::new(self.scene.view());
        probe.make_grid();
        let lights = Lights::of(camera);
        let length = 4.0 * camera.distance() + 4.0;
        let at = |pixel: usize| {
            let ray = |beside| camera.ray(twin::screen(size, pixel, beside), twin::aspect(size));
            let middle = ray([0.0; 2]);
            let met = self.meet(camera, &middle);
            for beside in AROUND {
                let other = self.meet(camera, &ray(beside));
                let is_same = |(a, b): (&Met, &Met)| {
                    (a.part, a.is_front) == (b.part, b.is_front) && a.hit.place.distance(b.hit.place) < 0.1
                };
                if met.len() != other.len() || !met.iter().zip(&other).all(is_same) {
                    return None;
                }
            }
            let spans = probe.line(middle.origin.into(), middle.at(length).into());
            let mut light = Light::NONE;
            let mut from = 0.0;
            for Met { part, hit, .. } in &met {
                light = light.over(self.volume(&middle, &spans, length, [from, hit.distance]));
                from = hit.distance;
                let style = &self.parts[*part].style;
                let colour = lights.colour(style, hit);
                if style.opacity >= 1.0 {
                    return Some(light.on(colour.into()).into());
                }
                let opacity = f64::from(style.opacity);
                let own = Light { colour: (opacity * colour).into(), transmittance: 1.0 - opacity };
                light = light.over(own);
            }
            light = light.over(self.volume(&middle, &spans, length, [from, length]));
            Some(light.on(twin::background(&self.look, size, pixel).into()).into())
        };
        (0..size[0] as usize * size[1] as usize).map(at).collect()
    }

    fn is_cut(&self, mask: u32, p: DVec3) -> bool {
        let cuts = |plane: &ClipPlane| twin::vec(plane.normal).dot(p) > plane.offset;
        self.look.clips.iter().enumerate().any(|(i, plane)| mask >> i & 1 == 1 && cuts(plane))
    }

    /// All that the ray meets up to what is opaque.
    fn meet(&self, camera: &Camera, ray: &Ray) -> Vec<Met> {
        let near = camera.clip()[0];
        let mut met = Vec::new();
        for (number, part) in self.parts.iter().enumerate() {
            let hits = twin::hits(&part.triangles, ray).into_iter();
            let seen = hits
                .filter(|hit| !self.is_cut(part.style.clips, hit.place) && camera.depth(hit.place) > near);
            met.extend(seen.map(|hit| Met { part: number, is_front: hit.is_front(ray), hit }));
        }
        met.sort_by(|a, b| a.hit.distance.total_cmp(&b.hit.distance));
        let opaque = met.iter().position(|met| self.parts[met.part].style.opacity >= 1.0);
        met.truncate(opaque.map_or(met.len(), |at| at + 1));
        met
    }

    /// The light of the volume on a part of a ray.
    fn volume(&self, ray: &Ray, spans: &[Span], length: f64, [mut from, mut to]: [f64; 2]) -> Light {
        let Some((medium, mask)) = self.medium else { return Light::NONE };
        for (i, plane) in self.look.clips.iter().enumerate().filter(|(i, _)| mask >> i & 1 == 1) {
            let normal = twin::vec(plane.normal);
            let height = plane.offset - normal.dot(ray.origin);
            let slope = normal.dot(ray.direction);
            assert!(slope != 0.0, "plane {i} is seen from its edge");
            let limit = height / slope;
            (from, to) = if slope > 0.0 { (from, to.min(limit)) } else { (from.max(limit), to) };
        }
        let view = self.scene.view();
        spans.iter().fold(Light::NONE, |light, span| {
            let [enter, leave] = [span.from, span.to].map(|t| t * length);
            let [low, high] = [span.entry, span.exit].map(|place| place.value(&view));
            let (a, b) = (from.max(enter), to.min(leave));
            if a >= b {
                return light;
            }
            let at = |t: f64| low + (high - low) * (t - enter) / (leave - enter);
            light.over(medium.piece([at(a), at(b)], b - a))
        })
    }
}

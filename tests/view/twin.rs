//! The slow twin of the renderer on the CPU: rays through the middles of pixels meet the same triangles and
//! the same tetrahedra, with the same light. Also what all tests of pictures share.

use crate::scenes::{Scene, distance_to_centre};
use crate::support::meshes::{blocks, linear};
use glam::{DVec2, DVec3};
use std::path::Path;
use tetralod::geom::{Bounds, Camera, Ray};
use tetralod::view::{Medium, Triangles};
use tetralod_render::draw::{Colouring, Lighting, Look, Style};
use tetralod_render::gpu::{Renderer, wait};

pub const UNIT: Bounds = Bounds { min: [0.0; 3], max: [1.0; 3] };

/// A renderer. A Vulkan driver is needed, for which software will do.
pub fn renderer(size: [u32; 2]) -> Renderer {
    wait(Renderer::headless(size)).unwrap_or_else(|error| panic!("{error}"))
}

/// The bytes of a picture: red, green, blue, opacity.
pub fn bytes(renderer: &mut Renderer, camera: &Camera, look: &Look) -> Vec<u8> {
    let bytes = wait(renderer.picture(camera, look, 1)).unwrap();
    assert_eq!(bytes.len(), renderer.size().iter().product::<u32>() as usize * 4);
    bytes
}

/// The colours of an opaque picture.
pub fn picture(renderer: &mut Renderer, camera: &Camera, look: &Look) -> Vec<[f64; 3]> {
    let bytes = bytes(renderer, camera, look);
    assert!(bytes.chunks_exact(4).all(|p| p[3] == 255), "pictures are opaque");
    colours(&bytes)
}

/// Colours without opacity.
pub fn colours(bytes: &[u8]) -> Vec<[f64; 3]> {
    bytes.chunks_exact(4).map(|p| [p[0], p[1], p[2]].map(|c| f64::from(c) / 255.0)).collect()
}

/// Writes a picture to the folder that `TETRALOD_PICTURES` names, if it does.
pub fn save(name: &str, [width, height]: [u32; 2], pixels: &[[f64; 3]]) {
    let Some(folder) = std::env::var_os("TETRALOD_PICTURES") else { return };
    let mut bytes = format!("P6 {width} {height} 255\n").into_bytes();
    bytes.extend(pixels.iter().flatten().map(|c| (c * 255.0).round() as u8));
    std::fs::write(Path::new(&folder).join(format!("{name}.ppm")), bytes).expect("a folder for pictures");
}

/// A triangle of the twin, with what is interpolated over it.
#[derive(Clone, Debug)]
pub struct Triangle {
    corners: [DVec3; 3],
    normals: [DVec3; 3],
    values: [f64; 3],
    /// A ball around it.
    middle: DVec3,
    reach: f64,
}

impl Triangle {
    pub fn new(corners: [DVec3; 3], normals: [DVec3; 3], values: [f64; 3]) -> Self {
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let reach = corners.map(|c| c.distance_squared(middle)).into_iter().fold(0.0, f64::max);
        Self { corners, normals, values, middle, reach: reach * 1.000_001 }
    }

    pub fn all(triangles: &Triangles<'_>) -> Vec<Self> {
        let one = |t: &[u32; 3]| {
            let corners = t.map(|v| vec(triangles.positions[v as usize]));
            let normals = t.map(|v| triangles.normals.get(v as usize).map_or(DVec3::ZERO, |n| vec(*n)));
            let values = t.map(|v| triangles.values.get(v as usize).map_or(0.0, |x| *x));
            Self::new(corners, normals, values)
        };
        triangles.indices.iter().map(one).collect()
    }

    /// Where the ray meets it, if it does.
    fn meet(&self, index: usize, ray: &Ray) -> Option<Hit> {
        let away = self.middle - ray.origin;
        let along = away.dot(ray.direction);
        if away.length_squared() - along * along > self.reach {
            return None;
        }
        let [a, b, c] = self.corners;
        let (u, v) = (b - a, c - a);
        let face = u.cross(v);
        let slope = face.dot(ray.direction);
        let distance = face.dot(a - ray.origin) / slope;
        let place = ray.at(distance);
        let size = face.length_squared();
        let (beta, gamma) = (face.dot((place - a).cross(v)) / size, face.dot(u.cross(place - a)) / size);
        let weights = [1.0 - beta - gamma, beta, gamma];
        let is_met = slope != 0.0 && distance > 0.0 && weights.iter().all(|w| *w >= 0.0);
        is_met.then(|| Hit {
            triangle: index,
            distance,
            place,
            normal: (0..3).map(|i| self.normals[i] * weights[i]).sum(),
            value: (0..3).map(|i| self.values[i] * weights[i]).sum(),
            face: face.normalize(),
        })
    }
}

/// Where a ray meets a triangle.
#[derive(Clone, Debug)]
pub struct Hit {
    pub triangle: usize,
    pub distance: f64,
    pub place: DVec3,
    /// Interpolated.
    pub normal: DVec3,
    pub value: f64,
    /// The side from which the corners are counter-clockwise; length 1.
    pub face: DVec3,
}

impl Hit {
    /// Whether the counter-clockwise side is seen.
    pub fn is_front(&self, ray: &Ray) -> bool {
        self.face.dot(ray.direction) < 0.0
    }
}

/// All triangles along a ray, the nearest first.
pub fn hits(triangles: &[Triangle], ray: &Ray) -> Vec<Hit> {
    let mut hits: Vec<_> = triangles.iter().enumerate().filter_map(|(i, t)| t.meet(i, ray)).collect();
    hits.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    hits
}

/// The nearest triangle along a ray.
pub fn cast(triangles: &[Triangle], ray: &Ray) -> Option<Hit> {
    hits(triangles, ray).into_iter().next()
}

pub fn decode(c: f64) -> f64 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

pub fn encode(c: f64) -> f64 {
    let c = c.clamp(0.0, 1.0);
    if c <= 0.0031308 { c * 12.92 } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
}

pub fn vec(c: [impl Into<f64>; 3]) -> DVec3 {
    DVec3::from(c.map(Into::into))
}

pub fn rgb([r, g, b, _]: [f32; 4]) -> DVec3 {
    vec([r, g, b])
}

/// The light of the shaders.
pub struct Lights {
    key: DVec3,
    fill: DVec3,
    up: DVec3,
    camera: Camera,
}

impl Lights {
    pub fn of(camera: &Camera) -> Self {
        let at = |x: f64, y: f64, z: f64| {
            (camera.right() * x + camera.up() * y - camera.forward() * z).normalize()
        };
        let (key, fill) = (at(-0.5, 0.75, 0.8), at(0.9, -0.25, 0.35));
        Self { key, fill, up: camera.up(), camera: *camera }
    }

    fn diffuse(&self, n: DVec3) -> DVec3 {
        let key = ((n.dot(self.key) + 0.3) / 1.3).max(0.0);
        let fill = ((n.dot(self.fill) + 0.5) / 1.5).max(0.0);
        let sky = 0.5 + 0.5 * n.dot(self.up);
        DVec3::new(1.0, 0.97, 0.92) * (0.82 * key * key)
            + DVec3::new(0.62, 0.74, 0.95) * (0.28 * fill)
            + DVec3::new(0.07, 0.065, 0.06).lerp(DVec3::new(0.13, 0.15, 0.18), sky)
    }

    /// The light on a surface whose normal, turned to the side that is seen, is `n`.
    fn lit(&self, albedo: DVec3, n: DVec3, view: DVec3) -> DVec3 {
        let rim = (1.0 - n.dot(view).clamp(0.0, 1.0)).powi(3) * (0.5 + 0.5 * n.dot(self.up));
        let gloss = n.dot((view + self.key).normalize()).max(0.0).powi(50);
        albedo * self.diffuse(n) + DVec3::new(0.75, 0.85, 1.0) * (0.16 * rim) + 0.16 * gloss
    }

    /// The colour of a surface without edges.
    pub fn colour(&self, style: &Style, hit: &Hit) -> DVec3 {
        let view = self.camera.towards_eye(hit.place);
        let side = hit.face.dot(view).signum();
        let albedo = match &style.colouring {
            Colouring::Sides(sides) => vec(sides[usize::from(side < 0.0)]),
            Colouring::Scale(scale) => vec(scale.colour(hit.value)),
        };
        let albedo = albedo.map(decode);
        let linear = match style.lighting {
            Lighting::Smooth => self.lit(albedo, side * hit.normal.normalize(), view),
            Lighting::Flat => albedo * (DVec3::splat(0.62) + 0.55 * self.diffuse(side * hit.face)),
            Lighting::None => albedo,
        };
        linear.map(encode)
    }
}

/// The middle of a pixel, or a place beside it, in normalised coordinates of the screen.
pub fn screen([width, height]: [u32; 2], pixel: usize, beside: [f64; 2]) -> DVec2 {
    let [width, height] = [width, height].map(f64::from);
    let (x, y) = ((pixel % width as usize) as f64, (pixel / width as usize) as f64);
    let [dx, dy] = beside;
    DVec2::new((x + 0.5 + dx) / width * 2.0 - 1.0, 1.0 - (y + 0.5 + dy) / height * 2.0)
}

pub fn aspect([width, height]: [u32; 2]) -> f64 {
    f64::from(width) / f64::from(height)
}

pub fn background(look: &Look, [width, height]: [u32; 2], pixel: usize) -> DVec3 {
    let row = pixel / width as usize;
    let t = (row as f64 + 0.5) / f64::from(height);
    rgb(look.sky).lerp(rgb(look.ground), t * t * (3.0 - 2.0 * t))
}

/// A background of one colour.
pub fn plain() -> Look {
    let colour = [0.2, 0.3, 0.4, 1.0];
    Look { sky: colour, ground: colour, ..Look::default() }
}

/// How two pictures differ where the second is known.
#[derive(Clone, Copy, Debug, Default)]
pub struct Difference {
    pub compared: usize,
    /// The largest of a channel, and in which pixel.
    pub worst: f64,
    pub at: usize,
}

/// Compares a picture with `expected`, which says `None` where it cannot tell (close to a side, where samples
/// of one pixel differ).
pub fn compare(pixels: &[[f64; 3]], expected: impl Fn(usize) -> Option<DVec3>) -> Difference {
    let mut difference = Difference::default();
    for (at, pixel) in pixels.iter().enumerate() {
        if let Some(colour) = expected(at) {
            difference.compared += 1;
            let off = (DVec3::from(*pixel) - colour).abs().max_element();
            if off > difference.worst {
                (difference.worst, difference.at) = (off, at);
            }
        }
    }
    difference
}

/// Places beside the middle of a pixel that are asked whether it shows one thing alone: around it, and its
/// four samples.
pub const AROUND: [[f64; 2]; 8] = [
    [-0.6, -0.6],
    [0.6, -0.6],
    [-0.6, 0.6],
    [0.6, 0.6],
    [-0.125, -0.375],
    [0.375, -0.125],
    [-0.375, 0.125],
    [0.125, 0.375],
];

/// A fog that gets denser with the value, and one that shows the shells of three.
pub fn media() -> [(&'static str, Medium); 2] {
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

/// The field of [`Scene::ball`] in a cube that is hollow and has a notch.
pub fn hollow() -> Scene {
    let is_inside = |cell: [u32; 3]| !cell.iter().all(|c| (2..6).contains(c)) && (cell[0] < 6 || cell[1] > 2);
    let mesh = blocks([8, 8, 8], &[linear], is_inside);
    let positions: Vec<[f64; 3]> = mesh.positions.clone();
    let field = positions.iter().map(|p| 1.0 - 2.0 * distance_to_centre(*p)).collect();
    Scene::new(positions, field, mesh.tets)
}

//! The uniform of a frame and the lines of boxes, in the layout of the shaders.

use crate::draw::{Look, MOST_CLIPS};
use glam::{DMat4, DVec2, DVec3, DVec4};
use tetralod::geom::Camera;
use tetralod::view::ClipPlane;

/// The uniform `frame` of every shader.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Frame {
    view_projection: [[f32; 4]; 4],
    /// Origin and direction of rays: in the middle, and the changes to the right and upper edges; in w their lengths.
    rays: [[f32; 4]; 6],
    eye: [f32; 4],
    /// In their last numbers, how much the picture is moved on the screen.
    key_light: [f32; 4],
    fill_light: [f32; 4],
    up: [f32; 4],
    viewport: [f32; 4],
    depth: [f32; 4],
    sky: [f32; 4],
    ground: [f32; 4],
    moved: [f32; 4],
    clips: [[f32; 4]; MOST_CLIPS],
}

impl Frame {
    /// Camera and look are those of the model as it is stored. `shift` moves the picture by a part of a pixel, to the right and down.
    pub(super) fn new(camera: &Camera, look: &Look, [width, height]: [u32; 2], shift: [f64; 2]) -> Self {
        let [w, h] = [f64::from(width), f64::from(height)];
        let moved = DVec2::new(2.0 * shift[0] / w, -2.0 * shift[1] / h);
        let matrix = DMat4::from_translation(moved.extend(0.0)) * camera.view_projection(w / h);
        let rays = camera.rays(w / h);
        let with_length = |v: DVec3| v.extend(v.length()).as_vec4().to_array();
        let shifted =
            |[middle, x, y]: [DVec3; 3]| [middle - x * moved.x - y * moved.y, x, y].map(with_length);
        let ([o, ox, oy], [d, dx, dy]) = (shifted(rays.origin), shifted(rays.direction));
        let (right, up, back) = (camera.right(), camera.up(), -camera.forward());
        let light = |x: f64, y: f64, z: f64, moved: f64| {
            let towards = (right * x + up * y + back * z).normalize();
            towards.extend(moved).as_vec4().to_array()
        };
        let is_parallel = rays.direction[1] == DVec3::ZERO;
        let eye = if is_parallel { back.extend(0.0) } else { camera.eye().extend(1.0) };
        let mut clips = [[0.0; 4]; MOST_CLIPS];
        for (place, clip) in clips.iter_mut().zip(&look.clips) {
            *place = plane(clip);
        }
        let count = look.clips.len().min(MOST_CLIPS);
        Self {
            view_projection: matrix.as_mat4().to_cols_array_2d(),
            rays: [o, ox, oy, d, dx, dy],
            eye: eye.as_vec4().to_array(),
            // The lights move with the camera: the key from the upper left, the fill from the lower right.
            key_light: light(-0.5, 0.75, 0.8, moved.x),
            fill_light: light(0.9, -0.25, 0.35, moved.y),
            up: wide(up),
            viewport: [width as f32, height as f32, look.pixel_ratio, count as f32],
            depth: depth_terms(&matrix, rays.origin[0], camera.forward()),
            sky: look.sky,
            ground: look.ground,
            moved: [look.moved as f32, 0.0, 0.0, 0.0],
            clips,
        }
    }
}

/// What gives, for a depth `d`, the distance from `origin` along `forward`: `(x − y d) / (z d − w)`.
fn depth_terms(matrix: &DMat4, origin: DVec3, forward: DVec3) -> [f32; 4] {
    let at: DVec4 = *matrix * origin.extend(1.0);
    let slope: DVec4 = *matrix * forward.extend(0.0);
    [at.z, at.w, slope.w, slope.z].map(|term| term as f32)
}

/// An instance of the wire shader: a line, or a handle at `from`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Line {
    pub from: [f32; 3],
    pub to: [f32; 3],
    /// Premultiplied sRGB.
    pub colour: [f32; 4],
    pub width: f32,
}

impl Line {
    pub(super) const ATTRIBUTES: [wgpu::VertexAttribute; 4] =
        wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x4, 3 => Float32];
}

/// A plane for shaders.
pub(super) fn plane(clip: &ClipPlane) -> [f32; 4] {
    let [x, y, z] = clip.normal;
    [x, y, z, clip.offset].map(|number| number as f32)
}

fn wide(v: DVec3) -> [f32; 4] {
    v.as_vec3().extend(0.0).to_array()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::mem::offset_of;
    use tetralod::geom::{Bounds, Projection};

    #[test]
    fn twins_have_the_sizes_and_places_that_wgsl_gives_them() {
        assert_eq!(size_of::<Frame>(), 64 + 15 * 16 + MOST_CLIPS * 16);
        assert_eq!(offset_of!(Frame, eye), 160);
        assert_eq!(offset_of!(Frame, viewport), 224);
        assert_eq!(offset_of!(Frame, clips), 304);
        assert_eq!(size_of::<Line>(), 44);
        let places = Line::ATTRIBUTES.map(|a| a.offset as usize);
        let fields =
            [offset_of!(Line, from), offset_of!(Line, to), offset_of!(Line, colour), offset_of!(Line, width)];
        assert_eq!(places, fields);
    }

    #[test]
    fn depths_give_distances_back() {
        let bounds = Bounds { min: [0.0; 3], max: [2.0, 1.0, 1.0] };
        for projection in [Projection::Perspective, Projection::Orthographic] {
            let mut camera = Camera::home(&bounds, 1.5);
            camera.set_projection(projection);
            let frame = Frame::new(&camera, &Look::default(), [150, 100], [0.3, -0.2]);
            let [x, y, z, w] = frame.depth.map(f64::from);
            let matrix = camera.view_projection(1.5);
            let start = camera.rays(1.5).origin[0];
            for along in [0.7, 1.0, 1.4] {
                let p = start + camera.forward() * along * camera.distance();
                let clip = matrix * p.extend(1.0);
                let d = clip.z / clip.w;
                let found = (x - y * d) / (z * d - w);
                assert!((found / (along * camera.distance()) - 1.0).abs() < 1e-4, "{projection:?} {along}");
            }
        }
    }
}

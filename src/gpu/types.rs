//! The data that shaders read, in their layout, and the appearance of the picture.

use crate::geom::{Bounds, Camera};
use crate::view::{Colormap, VIRIDIS};
use glam::DVec3;

/// The appearance of the picture; colours are sRGB from 0 to 1.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// The field values at the two ends of the colour map.
    pub range: [f32; 2],
    /// The colour map of the cut-away view.
    pub colormap: Colormap,
    /// The isosurface, seen from lower values.
    pub front: [f32; 3],
    /// The isosurface, seen from higher values.
    pub back: [f32; 3],
    /// The background at the top.
    pub sky: [f32; 3],
    /// The background at the bottom.
    pub ground: [f32; 3],
    /// Pixels of the target per unit of the page's layout: widths of lines scale with it.
    pub pixel_ratio: f32,
}

impl Default for Look {
    fn default() -> Self {
        Self {
            range: [0.0, 1.0],
            colormap: VIRIDIS,
            front: [0.93, 0.70, 0.36],
            back: [0.38, 0.56, 0.72],
            sky: [0.075, 0.09, 0.115],
            ground: [0.27, 0.31, 0.365],
            pixel_ratio: 1.0,
        }
    }
}

/// The edges of a box, drawn as lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxLines {
    /// The box.
    pub bounds: Bounds,
    /// sRGB and opacity.
    pub colour: [f32; 4],
    /// Width in units of the page's layout.
    pub width: f32,
    /// Whether each face shows a handle in its middle.
    pub handles: bool,
}

/// The uniform `frame` of every shader.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Frame {
    view_projection: [[f32; 4]; 4],
    eye: [f32; 4],
    key_light: [f32; 4],
    fill_light: [f32; 4],
    up: [f32; 4],
    viewport: [f32; 4],
    range: [f32; 4],
    front: [f32; 4],
    back: [f32; 4],
    sky: [f32; 4],
    ground: [f32; 4],
    palette: [[f32; 4]; 16],
}

impl Frame {
    pub(super) fn new(camera: &Camera, look: &Look, [width, height]: [u32; 2]) -> Self {
        let [w, h] = [width as f32, height as f32];
        let (right, up, back) = (camera.right(), camera.up(), -camera.forward());
        let light = |x: f64, y: f64, z: f64| wide((right * x + up * y + back * z).normalize());
        let [low, high] = look.range;
        let opaque = |c: [f32; 3]| [c[0], c[1], c[2], 1.0];
        Self {
            view_projection: camera.view_projection(f64::from(width) / f64::from(height)).to_cols_array_2d(),
            eye: wide(camera.eye()),
            // The lights move with the camera: the key from the upper left, the fill from the lower right.
            key_light: light(-0.5, 0.75, 0.8),
            fill_light: light(0.9, -0.25, 0.35),
            up: wide(up),
            viewport: [w, h, look.pixel_ratio, 0.0],
            range: [low, if high > low { 1.0 / (high - low) } else { 0.0 }, 0.0, 0.0],
            front: opaque(look.front),
            back: opaque(look.back),
            sky: opaque(look.sky),
            ground: opaque(look.ground),
            palette: look.colormap.table::<16>().map(|c| c.map(|b| f32::from(b) / 255.0)),
        }
    }
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

fn wide(v: DVec3) -> [f32; 4] {
    v.as_vec3().extend(0.0).to_array()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::mem::{offset_of, size_of};

    #[test]
    fn twins_have_the_sizes_and_places_that_wgsl_gives_them() {
        assert_eq!(size_of::<Frame>(), 64 + 10 * 16 + 16 * 16);
        assert_eq!(offset_of!(Frame, eye), 64);
        assert_eq!(offset_of!(Frame, viewport), 128);
        assert_eq!(offset_of!(Frame, palette), 224);
        assert_eq!(size_of::<Line>(), 44);
        let places = Line::ATTRIBUTES.map(|a| a.offset as usize);
        let fields =
            [offset_of!(Line, from), offset_of!(Line, to), offset_of!(Line, colour), offset_of!(Line, width)];
        assert_eq!(places, fields);
    }

    #[test]
    fn a_constant_field_does_not_divide_by_zero() {
        let camera = Camera::home(&Bounds { min: [0.0; 3], max: [1.0; 3] }, 1.0);
        let look = Look { range: [3.0, 3.0], ..Look::default() };
        assert_eq!(Frame::new(&camera, &look, [4, 4]).range, [3.0, 0.0, 0.0, 0.0]);
    }
}

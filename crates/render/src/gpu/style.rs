//! The uniform of how a thing is drawn, in the layout of the shaders.

use crate::draw::{CellShape, CellStyle, Colouring, EdgeLook, Style};
use crate::gpu::types::plane;
use tetralod::geom::{SinglePoints, SingleValues};
use tetralod::view::ColourScale;

/// The uniform `style`.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct StyleUniform {
    front: [f32; 4],
    back: [f32; 4],
    scale: [f32; 4],
    edge: [f32; 4],
    shape: [f32; 4],
    clips: [u32; 4],
    cut: [f32; 4],
    palette: [[u8; 4]; 256],
}

impl StyleUniform {
    /// The style of a surface with values that are stored like this, and so many numbers a vertex in its moves.
    pub(super) fn of_surface(style: &Style, values: &SingleValues, moves: u32) -> Self {
        let bands = match &style.colouring {
            Colouring::Scale(scale) if scale.bands > 1 => f32::from(scale.bands),
            _ => 0.0,
        };
        let (sides, scale, palette) = match &style.colouring {
            Colouring::Sides(sides) => (*sides, [0.0; 4], [[0; 4]; 256]),
            Colouring::Scale(scale) => ([[0.0; 3]; 2], terms(scale, values), smooth(scale).table()),
        };
        let [front, back] = sides.map(|side| side.map(linear));
        let edges = style.edges.unwrap_or(EdgeLook { colour: [0.0; 4], width: 0.0 });
        Self {
            front: [front[0], front[1], front[2], style.opacity.clamp(0.0, 1.0)],
            back: [back[0], back[1], back[2], 0.0],
            scale,
            edge: edges.colour,
            shape: [edges.width, bands, 0.0, 0.0],
            clips: [style.clips, 0, moves, 0],
            cut: [0.0, 0.0, 0.0, f32::INFINITY],
            palette,
        }
    }

    /// The style of tetrahedra with points and values that are stored like this.
    pub(super) fn of_cells(cells: &CellStyle, points: &SinglePoints, values: &SingleValues) -> Self {
        let mut uniform = Self::of_surface(&cells.style, values, 0);
        match cells.shape {
            CellShape::Solid(shrunk) => uniform.shape[2] = shrunk.clamp(0.0, 0.95),
            CellShape::Points(diameter) => uniform.shape[3] = diameter,
            CellShape::Wire => {}
        }
        // A plane at infinity cuts nothing; infinite numbers are not sure to work in shaders.
        let cuts = cells.cut.offset.is_finite();
        uniform.cut = if cuts { plane(&cells.cut.relative_to(points)) } else { [0.0; 4] };
        uniform.clips[1] = u32::from(cells.own_values);
        uniform
    }
}

/// A scale without bands: the shader makes them.
fn smooth(scale: &ColourScale) -> ColourScale {
    ColourScale { bands: 0, ..*scale }
}

/// The light that a channel of sRGB means.
fn linear(channel: f32) -> f32 {
    if channel <= 0.040_45 { channel / 12.92 } else { ((channel + 0.055) / 1.055).powf(2.4) }
}

/// For values that are stored like this: the smallest value, one over the range, whether both are logarithms, and if these are relative to an
/// offset one over that.
fn terms(scale: &ColourScale, values: &SingleValues) -> [f32; 4] {
    let SingleValues { offset, unit } = *values;
    let [low, high] = scale.range.map(|end| match (scale.is_log, offset > 0.0) {
        (false, _) => values.relative(end),
        (true, false) => end.ln() - unit.ln(),
        (true, true) => ((end - offset) / offset).ln_1p(),
    });
    // No value is positive.
    let is_below = scale.is_log && offset < 0.0;
    let slope = if high > low && !is_below { 1.0 / (high - low) } else { 0.0 };
    let part = if scale.is_log && offset > 0.0 { unit / offset } else { 0.0 };
    let held = |x: f64| x.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32;
    [held(low), held(slope), f32::from(u8::from(scale.is_log)), held(part)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::mem::offset_of;
    use tetralod::view::VIRIDIS;

    #[test]
    fn the_uniform_has_the_layout_that_wgsl_gives_it() {
        assert_eq!(size_of::<StyleUniform>(), 7 * 16 + 1024);
        assert_eq!(offset_of!(StyleUniform, clips), 80);
        assert_eq!(offset_of!(StyleUniform, palette), 112);
    }

    #[test]
    fn scales_become_terms() {
        let scale =
            ColourScale { map: VIRIDIS, range: [3.0, 3.0], is_reversed: false, is_log: false, bands: 0 };
        assert_eq!(terms(&scale, &SingleValues::PLAIN), [3.0, 0.0, 0.0, 0.0]);
        let scale = ColourScale { range: [1.0, 100.0], is_log: true, ..scale };
        let [low, slope, is_log, _] = terms(&scale, &SingleValues::PLAIN);
        assert!(low == 0.0 && is_log == 1.0 && (slope * 100f32.ln() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn terms_of_stored_values_give_the_fractions_of_the_values() {
        let stores = [
            (SingleValues::PLAIN, [1.0, 100.0]),
            (SingleValues { offset: 1.7e9, unit: 1.0 }, [1.7e9 - 2.0, 1.7e9 + 2.0]),
            (SingleValues { offset: 101_325.0, unit: 1.0 }, [101_324.999, 101_325.001]),
            (SingleValues { offset: 0.0, unit: 1e300 }, [1e298, 4e300]),
            (SingleValues { offset: 1e200, unit: 1e190 }, [0.9e200, 1.1e200]),
        ];
        for (values, range) in stores {
            for is_log in [false, true] {
                let scale = ColourScale { map: VIRIDIS, range, is_reversed: false, is_log, bands: 0 };
                let [low, slope, log, part] = terms(&scale, &values).map(f64::from);
                for t in [0.0, 0.1, 0.5, 1.0] {
                    let value = range[0] + t * (range[1] - range[0]);
                    let stored = f64::from(values.store(value));
                    // As the shader does.
                    let even = match (log > 0.0, part == 0.0) {
                        (false, _) => stored,
                        (true, true) => stored.max(1e-38).ln(),
                        (true, false) => (stored * part).ln_1p(),
                    };
                    let found = (even - low) * slope;
                    assert!((found - scale.fraction(value)).abs() < 1e-5, "{values:?} {is_log} {t}: {found}");
                }
            }
        }
    }
}

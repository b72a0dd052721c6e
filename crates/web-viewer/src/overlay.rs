//! What an overlay over the picture draws: axes of the box with their ticks, a scale bar, the rotation of the camera.
//!
//! Points are in normalised coordinates of the canvas, as in [`Camera`](tetralod::geom::Camera). The worker makes objects of the
//! numbers; types for each of them would make the module larger.

use crate::{Viewer, numbers_and_labels};
use js_sys::Array;
use tetralod::geom::Projection;
use tetralod::view::{BoxAxis, ScaleBar, box_axis, scale_bar, tick_edges};
use wasm_bindgen::prelude::wasm_bindgen;

/// The smallest mean distance between ticks, in units of the page's layout: labels are about as wide.
const TICK_SPACING: f64 = 56.0;

#[wasm_bindgen]
impl Viewer {
    /// What an overlay over the last picture draws, as a list of numbers and a list of labels; both are empty until the base mesh is
    /// there.
    ///
    /// The numbers are: length and width (of 1) of the scale bar, and whether it holds everywhere; right, up and towards the eye as
    /// directions in the model; the matrix from the model to the canvas, column by column; and for each axis its number, its two
    /// ends, the direction of its labels, how many ticks it has, and their points. The labels are those of the bar and of the ticks.
    pub fn overlay(&mut self) -> Array {
        let (mut numbers, labels) = (Vec::new(), Array::new());
        if let Some(bounds) = self.scene.bounds().copied() {
            let (camera, aspect) = (self.camera, self.aspect());
            let ScaleBar { length, label, width } = scale_bar(&camera, aspect);
            let everywhere = camera.projection() == Projection::Orthographic;
            labels.push(&label.into());
            numbers.extend_from_slice(&[length, width, f64::from(u8::from(everywhere))]);
            for direction in [camera.right(), camera.up(), -camera.forward()] {
                numbers.extend_from_slice(&direction.to_array());
            }
            numbers.extend_from_slice(&self.view().matrix);
            let spacing = 2.0 * TICK_SPACING * self.ratio / f64::from(self.scene.renderer().size()[1]);
            self.tick_edges = tick_edges(&bounds, &camera, aspect, self.tick_edges);
            let edges = self.tick_edges.into_iter().flatten();
            for axis in edges.filter_map(|edge| box_axis(edge, &bounds, &camera, aspect, spacing)) {
                put(axis, &mut numbers, &labels);
            }
        }
        numbers_and_labels(&numbers, labels)
    }
}

fn put(BoxAxis { edge, ends: [from, to], outward, ticks }: BoxAxis, numbers: &mut Vec<f64>, labels: &Array) {
    numbers.push(edge.axis as f64);
    for point in [from, to, outward] {
        numbers.extend_from_slice(&point.to_array());
    }
    numbers.push(ticks.len() as f64);
    for tick in ticks {
        numbers.extend_from_slice(&tick.screen.to_array());
        labels.push(&tick.tick.label.into());
    }
}

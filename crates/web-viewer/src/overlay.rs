//! What an overlay over the picture draws: axes of the box with their ticks, a scale bar, the rotation of the camera.
//!
//! Points are in normalised coordinates of the canvas, as in [`Camera`](tetralod::geom::Camera).

use crate::Viewer;
use tetralod::geom::Projection;
use tetralod::view::{BoxAxis, ScaleBar, box_axis, scale_bar, tick_edges};
use tetralod_web::arrays::{list, object, objects};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

/// The smallest mean distance between ticks, in units of the page's layout: labels are about as wide.
const TICK_SPACING: f64 = 56.0;

#[wasm_bindgen]
extern "C" {
    /// What an overlay draws.
    #[wasm_bindgen(typescript_type = "Overlay")]
    pub type JsOverlay;
}

#[wasm_bindgen]
impl Viewer {
    /// What an overlay over the last picture draws; nothing until the base mesh is there.
    pub fn overlay(&mut self) -> Option<JsOverlay> {
        let bounds = *self.scene.bounds()?;
        let (camera, aspect) = (self.camera, self.aspect());
        let directions = [camera.right(), camera.up(), -camera.forward()];
        let spacing = 2.0 * TICK_SPACING * self.ratio / f64::from(self.scene.renderer().size()[1]);
        self.tick_edges = tick_edges(&bounds, &camera, aspect, self.tick_edges);
        let edges = self.tick_edges.into_iter().flatten();
        let axes = edges.filter_map(|edge| box_axis(edge, &bounds, &camera, aspect, spacing));
        let everywhere = camera.projection() == Projection::Orthographic;
        let deformation = self.scene.deformation().map_or(JsValue::UNDEFINED, |deformation| {
            object(&[("factor", deformation.factor.into()), ("part", deformation.part.into())])
        });
        Some(object(&[
            ("axes", objects(axes.map(axis))),
            ("scaleBar", bar(scale_bar(&camera, aspect), everywhere)),
            ("rotation", objects(directions.iter().map(|direction| list(&direction.to_array())))),
            ("matrix", list(&self.view().matrix)),
            ("deformation", deformation),
        ]))
    }
}

fn bar(ScaleBar { length, label, width }: ScaleBar, everywhere: bool) -> JsValue {
    object(&[
        ("label", label.into()),
        ("length", length.into()),
        ("width", width.into()),
        ("everywhere", everywhere.into()),
    ])
}

fn axis(BoxAxis { edge, ends, outward, ticks }: BoxAxis) -> JsValue {
    let ticks = ticks
        .into_iter()
        .map(|tick| object(&[("label", tick.tick.label.into()), ("at", list(&tick.screen.to_array()))]));
    object(&[
        ("axis", (edge.axis as f64).into()),
        ("ends", objects(ends.iter().map(|end| list(&end.to_array())))),
        ("outward", list(&outward.to_array())),
        ("ticks", objects(ticks)),
    ])
}

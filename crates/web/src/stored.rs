//! How numbers of a mesh are stored in arrays of single precision: what they are relative to, beside them.

use crate::arrays::{floats, list, set};
use tetralod::geom::{SinglePoints, SingleValues};
use tetralod::mt::MtInfo;
use tetralod_web_options::error::WebError;
use wasm_bindgen::JsValue;

/// How positions and the values of a field are stored. JavaScript knows it as `origin`, `offset` and `scale`: a position is `origin + p`, a
/// value `offset + scale · v`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stored {
    points: SinglePoints,
    values: SingleValues,
}

/// Sizes of models that single precision has a place for.
const SIZES: [f64; 2] = [1e-30, 1e38];

impl Stored {
    /// How meshes of an MT are stored with a field. Fails where no origin brings the coordinates into the range of single precision.
    pub fn of(info: &MtInfo, field: usize) -> Result<Self, WebError> {
        let size = info.lattice.step.into_iter().fold(0.0, f64::max) * f64::from(1_u32 << info.lattice.bits);
        if !(SIZES[0]..=SIZES[1]).contains(&size) {
            let problem = format!(
                "the model is {size:e} units large, for which arrays of single precision have no place; scale its coordinates"
            );
            return Err(WebError::new("limit", problem));
        }
        let values = info.fields.get(field).map_or(SingleValues::PLAIN, |field| field.single_values());
        Ok(Self { points: info.single_points().in_model_units(), values })
    }

    /// A position as it is stored.
    pub fn position(&self, point: [f64; 3]) -> [f32; 3] {
        self.points.store(point)
    }

    /// A value as it is stored.
    pub fn value(&self, value: f64) -> f32 {
        self.values.store(value)
    }

    /// Positions as an array.
    pub fn positions(&self, points: impl Iterator<Item = [f64; 3]>) -> JsValue {
        floats(points.map(|point| self.position(point)).collect::<Vec<_>>().as_flattened())
    }

    /// Values as an array.
    pub fn values(&self, values: impl Iterator<Item = f64>) -> JsValue {
        floats(&values.map(|value| self.value(value)).collect::<Vec<_>>())
    }

    /// Says it beside the arrays of `object`.
    pub fn put(&self, object: &JsValue) {
        set(object, "origin", &list(&self.points.origin));
        set(object, "offset", &self.values.offset.into());
        set(object, "scale", &self.values.unit.into());
    }
}

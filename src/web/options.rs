//! What JavaScript asks for, checked: every refusal names the option.

use super::error::WebError;
use crate::geom::Bounds;
use crate::mt::FieldInfo;
use crate::mt::MtInfo;
use crate::refine::Budget;
use crate::refine::Need;
use crate::refine::Region;
use crate::refine::Request;
use js_sys::Object;
use serde::de::DeserializeOwned;
use wasm_bindgen::JsCast;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = r#"
/** Which mesh is wanted. Every option may be left out; names that are not listed here are refused. */
export interface RefineOptions {
  /**
   * The largest error that the mesh may have where it counts: a number in the field's own units, or a string such as
   * `"1%"` relative to the field's range. Default 0: the reference mesh.
   */
  error?: number | string;
  /** Only tetrahedra that meet this box count: `[x0, y0, z0, x1, y1, z1]`. Default: all. */
  box?: ArrayLike<number>;
  /** Only tetrahedra whose values may span one of these values, in field units, count. Default: all. */
  isovalues?: ArrayLike<number>;
  /** The name of the field that `error` and `isovalues` speak of and that the mesh carries. Default: the first. */
  field?: string;
  /** The mesh may have at most so many tetrahedra; the error is then as small as that allows. Default: no limit. */
  maxTets?: number;
}
"#;

#[wasm_bindgen]
extern "C" {
    /// [`RefineOptions`](TYPES) as JavaScript gives it: anything at all.
    #[wasm_bindgen(typescript_type = "RefineOptions")]
    pub type RefineOptions;
}

const NAMES: [&str; 5] = ["error", "box", "isovalues", "field", "maxTets"];

/// The request that `options` describes for the MT of `info`, and the field that it speaks of.
pub fn request(options: &JsValue, info: &MtInfo) -> Result<(Request, usize), WebError> {
    let Some(options) = object(options)? else { return Ok((Request::within(0.0), 0)) };
    for name in Object::keys(&options).iter().filter_map(|name| name.as_string()) {
        if !NAMES.contains(&name.as_str()) {
            return Err(WebError::bad_option(
                &name,
                format_args!("there is none of this name, only {}", NAMES.join(", ")),
            ));
        }
    }
    let field = option(&options, "field")?.map_or(Ok(0), |name: String| field_index(info, &name))?;
    let roi = option(&options, "box")?.map(|numbers: Vec<f64>| bounds(&numbers)).transpose()?;
    let need = Need::within(error(&options, &info.fields[field])?);
    let need = need.limited(roi.map(Region::Box), field, &isovalues(&options)?);
    let budget = Budget { tets: max_tets(&options)?, ..Budget::default() };
    Ok((Request { needs: vec![need], budget }, field))
}

/// The index of the field `name`.
pub fn field_index(info: &MtInfo, name: &str) -> Result<usize, WebError> {
    info.fields.iter().position(|field| field.name == name).ok_or_else(|| {
        let known: Vec<&str> = info.fields.iter().map(|field| field.name.as_str()).collect();
        WebError::bad_option("field", format_args!("there is no field `{name}`, only {}", known.join(", ")))
    })
}

/// `options` as an object; nothing at all is the same as an empty one.
fn object(options: &JsValue) -> Result<Option<Object>, WebError> {
    if options.is_undefined() || options.is_null() {
        return Ok(None);
    }
    let object =
        options.dyn_ref::<Object>().ok_or_else(|| WebError::bad_option("options", "must be an object"))?;
    Ok(Some(object.clone()))
}

fn option<T: DeserializeOwned>(options: &Object, name: &str) -> Result<Option<T>, WebError> {
    let value = js_sys::Reflect::get(options, &name.into()).unwrap_or(JsValue::UNDEFINED);
    if value.is_undefined() {
        return Ok(None);
    }
    serde_wasm_bindgen::from_value(value).map(Some).map_err(|error| WebError::bad_option(name, error))
}

/// The error relative to the field's range.
fn error(options: &Object, field: &FieldInfo) -> Result<f64, WebError> {
    let value = js_sys::Reflect::get(options, &"error".into()).unwrap_or(JsValue::UNDEFINED);
    let relative = match value.as_string() {
        Some(text) => percentage(&text)?,
        None => option(options, "error")?.unwrap_or(0.0) / field.range(),
    };
    if relative.is_finite() && relative >= 0.0 {
        return Ok(relative);
    }
    Err(WebError::bad_option("error", "must be a finite number that is not negative"))
}

fn percentage(text: &str) -> Result<f64, WebError> {
    let number = text.trim().strip_suffix('%').and_then(|number| number.trim_end().parse::<f64>().ok());
    let number = number.ok_or_else(|| {
        WebError::bad_option(
            "error",
            format_args!("`{text}` is neither a number nor a percentage such as \"1%\""),
        )
    })?;
    Ok(number / 100.0)
}

pub fn bounds(numbers: &[f64]) -> Result<Bounds, WebError> {
    let &[x0, y0, z0, x1, y1, z1] = numbers else {
        return Err(WebError::bad_option("box", "must be six numbers: x0, y0, z0, x1, y1, z1"));
    };
    if !(x0 <= x1 && y0 <= y1 && z0 <= z1) {
        return Err(WebError::bad_option("box", "each of x0, y0, z0 must be at most x1, y1, z1"));
    }
    Ok(Bounds { min: [x0, y0, z0], max: [x1, y1, z1] })
}

fn isovalues(options: &Object) -> Result<Vec<f64>, WebError> {
    let values: Vec<f64> = option(options, "isovalues")?.unwrap_or_default();
    if values.iter().all(|value| value.is_finite()) {
        return Ok(values);
    }
    Err(WebError::bad_option("isovalues", "must be finite numbers"))
}

fn max_tets(options: &Object) -> Result<Option<u32>, WebError> {
    let Some(number) = option::<f64>(options, "maxTets")? else { return Ok(None) };
    if number.is_nan() || number < 1.0 {
        return Err(WebError::bad_option("maxTets", "must be a number of at least 1"));
    }
    // Saturates: more than u32 can count, infinity included, is no limit.
    Ok(Some(number as u32))
}

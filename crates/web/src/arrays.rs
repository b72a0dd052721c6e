//! Plain objects and typed arrays for JavaScript.

use js_sys::{Array, Float32Array, Float64Array, Object, Reflect, Uint32Array};
use wasm_bindgen::{JsCast, JsValue};

/// Setting a property on a fresh ordinary object cannot fail.
#[inline(never)]
pub fn set(object: &JsValue, name: &str, value: &JsValue) {
    let _ = Reflect::set(object, &name.into(), value);
}

pub fn floats(values: &[f32]) -> JsValue {
    Float32Array::from(values).into()
}

pub fn doubles(values: &[f64]) -> JsValue {
    Float64Array::from(values).into()
}

pub fn integers(values: &[u32]) -> JsValue {
    Uint32Array::from(values).into()
}

/// A plain object with these members.
pub fn object<T: JsCast>(members: &[(&str, JsValue)]) -> T {
    plain(members).unchecked_into()
}

// No generic code: one copy serves all types.
#[inline(never)]
fn plain(members: &[(&str, JsValue)]) -> JsValue {
    let object = JsValue::from(Object::new());
    for (name, value) in members {
        set(&object, name, value);
    }
    object
}

/// A plain object of numbers, with the names of the same place.
pub fn record<T: JsCast>(names: &[&str], numbers: &[f64]) -> T {
    let object: JsValue = object(&[]);
    for (name, number) in names.iter().zip(numbers) {
        set(&object, name, &(*number).into());
    }
    object.unchecked_into()
}

/// A plain list of objects or of arrays.
pub fn objects(all: impl Iterator<Item = JsValue>) -> JsValue {
    all.collect::<Array>().into()
}

/// A plain list of numbers.
pub fn list(numbers: &[f64]) -> JsValue {
    numbers.iter().copied().map(JsValue::from).collect::<Array>().into()
}

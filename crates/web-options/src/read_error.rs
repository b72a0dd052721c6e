//! What is wrong with an option, and which one it is.

use crate::error::WebError;
use js_sys::{Array, Object, Reflect};
use thiserror::Error;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsCast, JsValue};

#[wasm_bindgen]
extern "C" {
    /// The global function of this name: a text for any value.
    #[wasm_bindgen(js_name = String, catch)]
    fn text(value: &JsValue) -> Result<String, JsValue>;
}

/// An option that cannot be used, and why.
#[derive(Debug, Error)]
#[error("{path}: {problem}")]
pub struct ReadError {
    /// The option, from the value on that was read; empty for that value itself.
    path: String,
    pub(crate) problem: String,
}

impl ReadError {
    #[inline(never)]
    pub fn new(problem: &str) -> Self {
        Self { path: String::new(), problem: problem.to_owned() }
    }

    /// Adds what `options` contain at the path.
    #[inline(never)]
    pub fn with_value(mut self, options: &JsValue) -> Self {
        let mut value = options.clone();
        for name in self.path.split(['.', '[', ']']).filter(|name| !name.is_empty()) {
            value = Reflect::get(&value, &name.into()).unwrap_or(JsValue::UNDEFINED);
        }
        if let (false, Ok(text)) = (value.is_undefined(), text(&value)) {
            self.problem += "; given: ";
            self.problem += &text;
        }
        self
    }

    /// The error of the option `name`, in which this one was found.
    #[inline(never)]
    pub fn inside(mut self, name: &str) -> Self {
        let between = if self.path.is_empty() || self.path.starts_with('[') { "" } else { "." };
        self.path = [name, between, &self.path].concat();
        self
    }
}

impl From<ReadError> for WebError {
    fn from(error: ReadError) -> Self {
        let path = if error.path.is_empty() { "options" } else { &error.path };
        Self::bad_option(path, &error.problem)
    }
}

/// An array, typed array or anything like one, as an array.
pub fn list(value: &JsValue) -> Option<Array> {
    let has_length = || Reflect::get(value, &"length".into()).is_ok_and(|length| length.as_f64().is_some());
    (value.is_object() && has_length()).then(|| Array::from(value))
}

/// Whether `value` is an object with names, not a list. Objects of other pages are instances of other classes.
pub fn is_plain(value: &JsValue) -> bool {
    value.is_object() && !Array::is_array(value)
}

/// The names of the members of `object`.
pub fn names(object: &JsValue) -> impl Iterator<Item = String> {
    Object::keys(object.unchecked_ref::<Object>()).into_iter().filter_map(|name| name.as_string())
}

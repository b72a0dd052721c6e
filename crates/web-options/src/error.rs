//! Errors at the edge to JavaScript: an `Error` with a `code` that programs can act on.

use tetralod::Coded;
use wasm_bindgen::JsValue;

/// A typed error of the core, or a wrong argument, on its way to JavaScript.
#[derive(Debug)]
pub struct WebError {
    /// In a word, for programs.
    pub code: &'static str,
    /// For people.
    pub message: String,
}

impl WebError {
    /// An error with this code.
    pub fn new(code: &'static str, message: String) -> Self {
        Self { code, message }
    }

    /// An error of the library.
    pub fn of(error: &impl Coded) -> Self {
        Self { code: error.code(), message: error.to_string() }
    }

    /// A call that the state of the session does not allow.
    pub fn not_ready() -> Self {
        Self {
            code: "not-ready",
            message: "the base mesh has not arrived yet; wait until `ready`".to_owned(),
        }
    }

    /// The option or argument `name` cannot be used.
    pub fn bad_option(name: &str, problem: &str) -> Self {
        Self { code: "bad-option", message: format!("option `{name}`: {problem}") }
    }
}

impl<E: Coded> From<E> for WebError {
    fn from(error: E) -> Self {
        Self::of(&error)
    }
}

impl From<WebError> for JsValue {
    fn from(error: WebError) -> Self {
        let js = js_sys::Error::new(&error.message);
        // Setting a property on a fresh ordinary object cannot fail.
        let _ = js_sys::Reflect::set(&js, &"code".into(), &error.code.into());
        js.into()
    }
}

//! Errors at the edge to JavaScript: an `Error` with a `code` that programs can act on.

use crate::format::FormatError;
use crate::session::SessionError;
use crate::stream::StreamError;
use wasm_bindgen::JsValue;

/// A typed error of the core, or a wrong argument, on its way to JavaScript.
#[derive(Debug)]
pub struct WebError {
    pub(super) code: &'static str,
    pub(super) message: String,
}

impl WebError {
    /// An error with this code.
    pub fn new(code: &'static str, message: String) -> Self {
        Self { code, message }
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

impl From<FormatError> for WebError {
    fn from(error: FormatError) -> Self {
        Self { code: format_code(&error), message: error.to_string() }
    }
}

impl From<SessionError> for WebError {
    fn from(error: SessionError) -> Self {
        Self { code: session_code(&error), message: error.to_string() }
    }
}

impl From<&StreamError> for WebError {
    fn from(error: &StreamError) -> Self {
        Self { code: stream_code(error), message: error.to_string() }
    }
}

#[cfg(feature = "gpu")]
impl From<crate::gpu::GpuError> for WebError {
    fn from(error: crate::gpu::GpuError) -> Self {
        Self { code: gpu_code(&error), message: error.to_string() }
    }
}

#[cfg(feature = "gpu")]
impl From<crate::scene::SceneError> for WebError {
    fn from(error: crate::scene::SceneError) -> Self {
        use crate::scene::SceneError;
        match error {
            SceneError::Gpu(error) => error.into(),
            SceneError::Session(error) => error.into(),
            SceneError::State { what, problem } => Self::bad_option(&what, &problem),
            SceneError::Scale(error) => Self::bad_option("colours", &error.to_string()),
        }
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

fn format_code(error: &FormatError) -> &'static str {
    match error {
        FormatError::NotMt => "not-mt",
        FormatError::UnsupportedVersion { .. } | FormatError::UnsupportedFeature { .. } => {
            "unsupported-version"
        }
        FormatError::Kind { .. } => "kind",
        FormatError::Corrupt { .. }
        | FormatError::Update(_)
        | FormatError::Base(_)
        | FormatError::Page(_) => "corrupt",
        FormatError::Field { .. } => "bad-option",
        FormatError::Truncated { .. } => "truncated",
        FormatError::Limit { .. } => "limit",
    }
}

fn session_code(error: &SessionError) -> &'static str {
    match error {
        SessionError::NotReady | SessionError::ExactMissing => "not-ready",
        SessionError::Request(_) | SessionError::Isovalue => "bad-option",
        SessionError::Format(error) => format_code(error),
    }
}

fn stream_code(error: &StreamError) -> &'static str {
    match error {
        StreamError::Status(_) | StreamError::Network(_) | StreamError::Timeout => "network",
        StreamError::Blocked => "cors",
        StreamError::Changed => "changed",
        StreamError::WebPage | StreamError::Encoded(_) | StreamError::WrongRange(_) => "server",
        StreamError::Unreadable(_) => "network",
    }
}

#[cfg(feature = "gpu")]
fn gpu_code(error: &crate::gpu::GpuError) -> &'static str {
    use crate::gpu::GpuError;
    match error {
        GpuError::NoAdapter(_) | GpuError::NoDevice(_) | GpuError::NoSurface(_) => "no-webgpu",
        GpuError::TooLarge { .. } => "too-large",
        GpuError::DeviceLost(_) => "device-lost",
        GpuError::Refused(_) => "gpu",
    }
}

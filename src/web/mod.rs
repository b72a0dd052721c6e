//! The JavaScript API: a thin façade over [`session`](crate::session) for wasm-bindgen. The package's JavaScript
//! (`pkg-template/`) wraps it with streams, workers and promises; nothing here waits or does I/O.

mod error;
mod options;
mod results;
mod session;

pub use session::CoreSession;

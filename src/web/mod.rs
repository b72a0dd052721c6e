//! The JavaScript API: a thin façade over [`session`](crate::session) for wasm-bindgen. The package's JavaScript
//! (`pkg-template/`) wraps it with streams, workers and promises; nothing here waits or does I/O.

// Without a class that uses it, nothing here is used.
#![cfg_attr(
    not(any(feature = "web-session", all(feature = "gpu", target_arch = "wasm32"))),
    allow(dead_code)
)]

#[cfg(any(feature = "web-session", feature = "web-tools", feature = "gpu"))]
mod arrays;
#[cfg(feature = "web-bench")]
mod bench;
#[cfg(feature = "web-build")]
mod build;
#[cfg(feature = "web-build")]
mod build_memory;
#[cfg(feature = "web-build")]
mod build_options;
#[cfg(any(feature = "web-session", feature = "gpu"))]
mod callback;
mod error;
#[cfg(any(feature = "web-session", feature = "gpu"))]
mod file;
#[cfg(any(feature = "web-session", feature = "gpu"))]
mod given;
#[cfg(any(feature = "web-session", feature = "gpu"))]
mod loader;
#[cfg(feature = "web-session")]
mod mesh_changes;
#[cfg(feature = "web-tools")]
mod mesh_tools;
#[cfg(any(feature = "web-session", feature = "gpu"))]
mod options;
#[cfg(any(feature = "web-session", feature = "web-tools"))]
mod places;
#[cfg(any(feature = "web-session", feature = "gpu"))]
mod read_error;
#[cfg(all(feature = "gpu", target_arch = "wasm32"))]
mod reader;
#[cfg(any(feature = "web-session", feature = "gpu"))]
mod results;
#[cfg(feature = "web-session")]
mod session;
#[cfg(any(feature = "web-session", feature = "web-tools", feature = "gpu"))]
mod stored;
#[cfg(any(feature = "web-tools", all(feature = "gpu", target_arch = "wasm32")))]
mod tools;
#[cfg(all(feature = "gpu", target_arch = "wasm32"))]
mod viewer;
#[cfg(all(feature = "gpu", target_arch = "wasm32"))]
mod viewer_overlay;
#[cfg(all(feature = "gpu", target_arch = "wasm32"))]
mod viewer_screenshot;
#[cfg(all(feature = "gpu", target_arch = "wasm32"))]
mod viewer_tools;

#[cfg(feature = "web-build")]
pub use build::MeshBuilder;
#[cfg(any(feature = "web-session", feature = "gpu"))]
pub use loader::RangeLoader;
#[cfg(feature = "web-tools")]
pub use mesh_tools::MeshTools;
#[cfg(feature = "web-session")]
pub use session::CoreSession;
#[cfg(all(feature = "gpu", target_arch = "wasm32"))]
pub use viewer::Viewer;

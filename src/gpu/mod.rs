//! The renderer, on wgpu: WebGPU in the browser, Vulkan in the tests. It uses no MT: it draws what [`crate::view`]
//! computes.
//!
//! A [`Renderer`] owns a [`Context`] (the device), a target (a canvas, or an image to read back), and one pass for
//! each thing that is seen. Failures of the device arrive as [`GpuError`]s from [`Renderer::draw`], also those that
//! the device reports late.

mod buffers;
mod context;
mod cutaway;
mod error;
mod pipeline;
mod renderer;
mod surface;
mod target;
mod types;
mod volume;
mod wire;

pub use context::Context;
pub use error::GpuError;
pub use renderer::{Renderer, Show};
pub use types::{BoxLines, Look};

/// Samples per pixel.
pub const SAMPLES: u32 = 4;

/// The shaders, each complete: name and WGSL source.
pub const SHADERS: [(&str, &str); 6] = [
    ("background", concat!(include_str!("shaders/common.wgsl"), include_str!("shaders/background.wgsl"))),
    ("surface", concat!(include_str!("shaders/common.wgsl"), include_str!("shaders/surface.wgsl"))),
    ("cutaway", concat!(include_str!("shaders/common.wgsl"), include_str!("shaders/cutaway.wgsl"))),
    (
        "volume_entries",
        concat!(include_str!("shaders/common.wgsl"), include_str!("shaders/volume_entries.wgsl")),
    ),
    ("volume", concat!(include_str!("shaders/common.wgsl"), include_str!("shaders/volume.wgsl"))),
    ("wire", concat!(include_str!("shaders/common.wgsl"), include_str!("shaders/wire.wgsl"))),
];

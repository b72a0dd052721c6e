//! The renderer, on wgpu: WebGPU in the browser, Vulkan in native programs. It uses no MT: it draws slices of numbers, such as
//! those that [`tetralod::view`] computes, one by one or as a list of [edits](crate::draw::Edit).
//!
//! A [`Renderer`] owns a [`Context`] (the device), a target (a canvas, an image to read back, or views that the caller gives),
//! and the things that are drawn: the mesh as a volume or as tetrahedra, surfaces of triangles, and boxes. What is opaque is
//! drawn with depth and samples; all else is listed for each pixel and composited in exact order. Failures of the device
//! arrive as [`GpuError`]s from [`Renderer::draw`], also those that the device reports late.

mod buffers;
mod cell_parts;
mod cells;
mod composite;
mod context;
mod edits;
mod error;
mod fragments;
mod mesh;
mod pipeline;
mod present;
mod renderer;
mod shade;
mod side_target;
mod style;
mod surface;
mod target;
mod types;
#[doc(hidden)]
pub mod webgl;
mod wire;

/// The version of wgpu that the renderer takes devices of.
pub use wgpu;
#[doc(hidden)]
pub use wgpu::TextureView;

#[doc(hidden)]
pub use context::Context;
pub use error::GpuError;
pub use renderer::Renderer;
#[doc(hidden)]
pub use side_target::SideTarget;

/// Samples per pixel.
#[doc(hidden)]
pub const SAMPLES: u32 = 4;

/// Runs a future of a native device to its end: such futures make progress when they are asked.
///
/// ```no_run
/// # fn main() -> Result<(), tetralod_render::gpu::GpuError> {
/// let renderer = tetralod_render::gpu::wait(tetralod_render::gpu::Renderer::headless([640, 480]))?;
/// # Ok(())
/// # }
/// ```
#[cfg(not(target_arch = "wasm32"))]
pub fn wait<T>(future: impl Future<Output = T>) -> T {
    let mut future = std::pin::pin!(future);
    let mut task = std::task::Context::from_waker(std::task::Waker::noop());
    loop {
        if let std::task::Poll::Ready(value) = future.as_mut().poll(&mut task) {
            return value;
        }
        std::thread::yield_now();
    }
}

/// A shader from its files.
macro_rules! shader {
    ($($file:literal),*) => { concat!(include_str!("shaders/common.wgsl"), $(include_str!(concat!("shaders/", $file))),*) };
}

/// The shaders, each complete: name and WGSL source.
#[doc(hidden)]
pub const SHADERS: [(&str, &str); 8] = [
    ("background", shader!("background.wgsl")),
    ("surface", shader!("fragments.wgsl", "shading.wgsl", "surface.wgsl")),
    ("cells", shader!("shading.wgsl", "cells.wgsl")),
    ("volume_entries", shader!("fragments.wgsl", "crossing.wgsl", "volume_entries.wgsl")),
    ("composite", shader!("crossing.wgsl", "composite.wgsl")),
    ("shade", shader!("shade.wgsl")),
    ("wire", shader!("fragments.wgsl", "wire.wgsl")),
    ("present", shader!("present.wgsl")),
];

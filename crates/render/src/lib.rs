//! Draws the meshes of [`tetralod`] with wgpu: on WebGPU in pages, on Vulkan natively.
//!
//! A [`scene::Scene`] lists what is to be drawn of a session's mesh, as plain data ([`draw`]) and without a GPU. A [`gpu::Renderer`]
//! draws it. [`SceneRenderer`] is both, and what programs use.

#![warn(missing_docs)]
#![deny(rustdoc::broken_intra_doc_links)]

#[doc(hidden)]
pub mod draw;
pub mod gpu;
pub mod scene;
mod scene_renderer;

#[doc(hidden)]
pub use scene_renderer::Draw;
pub use scene_renderer::{SceneRenderer, ShowError};

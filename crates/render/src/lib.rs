//! Draws the meshes of [`tetralod`] with wgpu: on WebGPU in pages, on Vulkan natively.
//!
//! [`scene::Scene`] makes of a session's mesh and of plain data ([`scene::SceneState`]) what is to be drawn, and [`gpu::Renderer`] draws it.

#![warn(missing_docs)]
#![deny(rustdoc::broken_intra_doc_links)]

pub mod gpu;
pub mod scene;

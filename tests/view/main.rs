//! Promises of what is shown: isosurfaces, slices and probes, on the CPU and with the feature `vulkan` on the GPU.

mod cutaway;
mod difference;
#[cfg(feature = "vulkan")]
mod gpu_matches_cpu;
mod iso_cases;
mod iso_session;
mod iso_update;
mod pick;
mod probe;
#[allow(dead_code, reason = "each test uses a part of it")]
mod scenes;
#[cfg(feature = "gpu")]
mod shaders;
#[cfg(feature = "vulkan")]
mod silhouettes;
mod slice;
mod solids;
#[path = "../support/mod.rs"]
mod support;
#[cfg(feature = "vulkan")]
mod twin;
mod volume;
#[allow(dead_code, reason = "each test uses a part of it")]
mod walk;

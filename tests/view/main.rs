//! Promises of what is shown: isosurfaces, slices and probes, on the CPU and with the feature `vulkan` on the GPU.

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
mod slice;
mod solids;
#[path = "../support/mod.rs"]
mod support;
mod volume;
#[allow(dead_code, reason = "each test uses a part of it")]
mod walk;

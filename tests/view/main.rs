//! Promises of what is shown: isosurfaces, slices and probes, on the CPU and with the feature `vulkan` on the GPU.

#[cfg(feature = "vulkan")]
mod by_ranges;
#[cfg(feature = "vulkan")]
mod cells;
mod colour_error;
#[cfg(feature = "vulkan")]
mod compare;
mod cutaway;
#[cfg(feature = "vulkan")]
mod data_sets;
mod difference;
mod far;
#[cfg(feature = "vulkan")]
mod far_pictures;
#[cfg(feature = "vulkan")]
mod gpu_matches_cpu;
mod integrals;
mod iso_cases;
mod iso_session;
mod iso_update;
#[cfg(feature = "vulkan")]
mod mixed;
#[cfg(feature = "vulkan")]
mod mixed_pictures;
mod pick;
mod probe;
#[cfg(feature = "vulkan")]
mod samples;
#[cfg(feature = "vulkan")]
mod scene_pick;
mod scenes;
#[cfg(feature = "vulkan")]
mod shade;
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
mod walk;

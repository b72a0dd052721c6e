//! Promises of what is shown: isosurfaces, slices and probes, on the CPU and on the GPU.

mod by_ranges;
mod cells;
mod colour_error;
mod compare;
mod cutaway;
mod data_sets;
mod deform;
mod difference;
mod far;
mod far_pictures;
mod gpu_matches_cpu;
mod integrals;
mod iso_cases;
mod iso_session;
mod iso_update;
mod labels;
mod mixed;
mod mixed_pictures;
mod pick;
mod probe;
mod quick;
mod samples;
mod scene_list;
mod scene_pick;
mod scenes;
mod shade;
mod shaders;
mod silhouettes;
mod slice;
mod solids;
#[path = "../support/mod.rs"]
mod support;
mod twin;
mod volume;
mod walk;
mod within;

//! Meshes and what has changed in them, for JavaScript that follows them.

use super::results::{JsDelta, JsMesh, floats, integers, mesh_arrays, object, set};
use crate::mt::MeshChanges;
use crate::view::MeshView;
use js_sys::Object;
use std::ops::Range;
use wasm_bindgen::JsValue;

/// What has changed in a mesh since one was handed out before, and the number of this one.
pub struct Changes {
    pub ranges: MeshChanges,
    pub to: u32,
}

/// A copy of `mesh` outside wasm memory, with what has changed in it.
pub fn mesh(mesh: &MeshView<'_>, changes: &Changes) -> JsMesh {
    let arrays: JsMesh = mesh_arrays(mesh);
    set(arrays.as_ref(), "changes", &ranges(changes));
    arrays
}

/// A copy of those parts of `mesh` that have changed.
pub fn delta(mesh: &MeshView<'_>, changes: &Changes) -> JsDelta {
    let MeshChanges { vertices, tets } = &changes.ranges;
    object(&[
        ("vertexCount", mesh.positions.len().into()),
        ("tetCount", mesh.tets.len().into()),
        ("changes", ranges(changes)),
        ("positions", floats(&parts(mesh.positions.as_flattened(), vertices, 3))),
        ("field", floats(&parts(mesh.field, vertices, 1))),
        ("tets", integers(&parts(mesh.tets.as_flattened(), tets, 4))),
        ("neighbors", integers(&parts(mesh.neighbors.as_flattened(), tets, 4))),
    ])
}

fn ranges(changes: &Changes) -> JsValue {
    let flat = |ranges: &[Range<u32>]| {
        integers(&ranges.iter().flat_map(|range| [range.start, range.end]).collect::<Vec<_>>())
    };
    let MeshChanges { vertices, tets } = &changes.ranges;
    let all: Object = object(&[
        ("from", (changes.to - 1).into()),
        ("to", changes.to.into()),
        ("vertices", flat(vertices)),
        ("tets", flat(tets)),
    ]);
    all.into()
}

/// The ranges of items of `size` numbers, one behind the other.
fn parts<T: Copy>(numbers: &[T], ranges: &[Range<u32>], size: usize) -> Vec<T> {
    let mut parts = Vec::with_capacity(size * ranges.iter().map(Range::len).sum::<usize>());
    for range in ranges {
        parts.extend_from_slice(&numbers[size * range.start as usize..size * range.end as usize]);
    }
    parts
}

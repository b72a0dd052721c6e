//! Meshes and what has changed in them, for JavaScript that follows them.

use crate::arrays::{integers, object, set};
use crate::results::{JsDelta, JsMesh, mesh_arrays, put_arrays};
use crate::stored::Stored;
use js_sys::Object;
use std::ops::Range;
use tetralod::mt::MeshChanges;
use tetralod::view::MeshView;
use wasm_bindgen::JsValue;

/// What has changed in a mesh since one was handed out before, and the number of this one.
pub struct Changes {
    pub ranges: MeshChanges,
    pub to: u32,
}

/// A copy of the `wanted` arrays of `view` (see [`put_arrays`]) outside wasm memory, with what has changed in it.
pub fn mesh(view: &MeshView<'_>, stored: &Stored, changes: &Changes, wanted: u32) -> JsMesh {
    let mesh = mesh_arrays(view, stored, wanted);
    set(mesh.as_ref(), "changes", &ranges(changes));
    mesh
}

/// A copy of those parts of the `wanted` arrays of `mesh` that have changed.
pub fn delta(mesh: &MeshView<'_>, stored: &Stored, changes: &Changes, wanted: u32) -> JsDelta {
    let MeshChanges { vertices, tets } = &changes.ranges;
    let delta: JsDelta = object(&[
        ("vertexCount", mesh.positions.len().into()),
        ("tetCount", mesh.tets.len().into()),
        ("changes", ranges(changes)),
    ]);
    stored.put(delta.as_ref());
    put_arrays(delta.as_ref(), wanted, |at| match at {
        0 => stored.positions(parts(mesh.positions, vertices, 1).into_iter()),
        1 => stored.values(parts(mesh.field, vertices, 1).into_iter()),
        2 => integers(&parts(mesh.tets.as_flattened(), tets, 4)),
        _ => integers(&parts(mesh.neighbors.as_flattened(), tets, 4)),
    });
    delta
}

fn flat(ranges: &[Range<u32>]) -> JsValue {
    integers(&ranges.iter().flat_map(|range| [range.start, range.end]).collect::<Vec<_>>())
}

fn ranges(changes: &Changes) -> JsValue {
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

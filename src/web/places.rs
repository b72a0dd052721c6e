//! Where a mesh is in the memory of its wasm module, for JavaScript that reads it there or copies it.

use crate::view::MeshView;

/// Where the arrays of `mesh` are in wasm memory: an address and a number of elements each.
pub fn places(mesh: &MeshView<'_>) -> Vec<usize> {
    let MeshView { positions, field, tets, neighbors } = mesh;
    let floats = [positions.as_flattened(), field].map(|array| (array.as_ptr() as usize, array.len()));
    let integers = [tets, neighbors].map(|array| array.as_flattened());
    let integers = integers.map(|array| (array.as_ptr() as usize, array.len()));
    floats.into_iter().chain(integers).flat_map(|(address, length)| [address, length]).collect()
}

//! Where a mesh is in the memory of its wasm module, for JavaScript that reads it there or copies it.

use crate::view::MeshView;

/// Where the arrays of `mesh` are in wasm memory: an address and a number of elements each.
pub fn places(mesh: &MeshView<'_>) -> Vec<usize> {
    let MeshView { positions, field, tets, neighbors } = mesh;
    [
        place(positions.as_flattened()),
        place(field),
        place(tets.as_flattened()),
        place(neighbors.as_flattened()),
    ]
    .concat()
}

/// The same of one array.
pub fn place<T>(array: &[T]) -> [usize; 2] {
    [array.as_ptr() as usize, array.len()]
}

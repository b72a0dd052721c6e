//! What a mesh keeps of vertices with a value for each region: see [`super::sides`].

use crate::mesh::NONE;

/// The sides of the vertices of a mesh.
#[derive(Clone, Debug)]
pub(in crate::mt) struct SideSlots {
    /// For each field whether its values depend on the region.
    pub jumps: Vec<bool>,
    /// For each slot the next side of the same vertex; [`NONE`] behind the last.
    pub(super) next: Vec<u32>,
    /// The tetrahedra with sides as corners, as of the last call of [`CurrentMesh::compact`] or [`CurrentMesh::take_changes`].
    pub(super) corners: Vec<[u32; 4]>,
}

impl SideSlots {
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.next[..]) + size_of_val(&self.corners[..])
    }

    pub(super) fn push(&mut self) {
        self.next.push(NONE);
    }

    pub(super) fn pop(&mut self) {
        self.next.pop();
    }
}

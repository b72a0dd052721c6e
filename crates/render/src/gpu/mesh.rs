//! The mesh on the GPU: points with values, tetrahedra with their neighbours for rays, faces of the boundary, and
//! tetrahedra by their points for cells. Each part is there while something needs it, and kept up by ranges.

use crate::gpu::buffers::GrowBuffer;
use crate::gpu::{Context, GpuError};
use std::ops::Range;
use tetralod::geom::{SinglePoints, SingleValues};
use tetralod::mesh::boundary_faces;
use tetralod::view::MeshView;

#[derive(Debug)]
pub(super) struct MeshBuffers {
    pub(super) points: GrowBuffer<[f32; 4]>,
    /// How points and values are stored.
    stored: (SinglePoints, SingleValues),
    /// 20 bytes a tetrahedron.
    pub(super) linked: Part<[u32; 5]>,
    pub(super) faces: GrowBuffer<[u32; 4]>,
    pub(super) corners: Part<[u32; 4]>,
    /// Where the points go; none if they stay.
    moves: GrowBuffer<[f32; 4]>,
}

/// A buffer that is there if it is needed.
#[derive(Debug)]
pub(super) struct Part<T> {
    pub(super) buffer: GrowBuffer<T>,
    is_needed: bool,
    /// Whether it holds the mesh of the last update.
    is_current: bool,
}

impl<T: bytemuck::Pod> Part<T> {
    fn new(what: &'static str) -> Self {
        let buffer = GrowBuffer::new(what, wgpu::BufferUsages::STORAGE);
        Self { buffer, is_needed: false, is_current: false }
    }

    pub(super) fn set_needed(&mut self, is_needed: bool) {
        self.is_needed = is_needed;
        self.is_current &= is_needed;
    }

    /// The buffer that an update must fill, if it is needed; empty if it lacks an update. If that fails, all
    /// is forgotten.
    fn begin_update(&mut self) -> Option<&mut GrowBuffer<T>> {
        if !self.is_current {
            self.buffer.clear();
        }
        self.is_current = self.is_needed;
        self.is_needed.then_some(&mut self.buffer)
    }
}

impl MeshBuffers {
    pub(super) fn new() -> Self {
        let storage = wgpu::BufferUsages::STORAGE;
        Self {
            points: GrowBuffer::new("points of the mesh", storage),
            stored: Default::default(),
            linked: Part::new("tetrahedra with their neighbours"),
            faces: GrowBuffer::new("faces of the boundary", storage),
            corners: Part::new("tetrahedra"),
            moves: GrowBuffer::new("moves of the mesh", storage),
        }
    }

    /// How points and values are stored from now on. If that is another way, all must come next.
    pub(super) fn set_stored(&mut self, points: SinglePoints, values: SingleValues) {
        if self.stored != (points, values) {
            self.stored = (points, values);
            self.forget();
        }
    }

    /// Whether something needs a part of the mesh that is not there.
    pub(super) fn is_behind(&self) -> bool {
        self.linked.is_needed && !self.linked.is_current || self.corners.is_needed && !self.corners.is_current
    }

    /// Follows the mesh, of which only these ranges have changed since the last call; without them, all.
    pub(super) fn update(
        &mut self,
        context: &Context,
        mesh: &MeshView<'_>,
        changes: Option<[&[Range<u32>]; 2]>,
    ) -> Result<(), GpuError> {
        if !self.linked.is_needed && !self.corners.is_needed {
            self.forget();
            return Ok(());
        }
        // Parts that come later have missed changes of points: then nothing has been kept up.
        if changes.is_none() || !self.linked.is_current && !self.corners.is_current {
            self.forget();
        }
        let [points, tets] = changes.unwrap_or_default();
        let updated = self.update_parts(context, mesh, points, tets);
        // If something does not fit, nothing is drawn.
        updated.inspect_err(|_| self.forget())
    }

    /// Where the points go of the mesh that came last; they stay if there are none.
    pub(super) fn set_moves(&mut self, context: &Context, moves: &[[f64; 3]]) -> Result<(), GpuError> {
        self.moves.clear();
        if self.points.len() != moves.len() {
            return Ok(());
        }
        let stored = |way: &[f64; 3]| {
            let [x, y, z] = way.map(|x| x as f32);
            [x, y, z, 0.0]
        };
        self.moves.write(context, &moves.iter().map(stored).collect::<Vec<_>>())
    }

    /// The moves, if all points have one.
    pub(super) fn moves(&self) -> Option<wgpu::BindingResource<'_>> {
        self.moves.binding().filter(|_| self.moves.len() == self.points.len())
    }

    fn update_parts(
        &mut self,
        context: &Context,
        mesh: &MeshView<'_>,
        points: &[Range<u32>],
        tets: &[Range<u32>],
    ) -> Result<(), GpuError> {
        let (places, values) = self.stored;
        self.points.update_with(context, mesh.positions.len(), points, |range| {
            let both = mesh.positions[range.clone()].iter().zip(&mesh.field[range]);
            let stored = both.map(|(&point, &value)| (places.store(point), values.store(value)));
            stored.map(|([x, y, z], value)| [x, y, z, value]).collect()
        })?;
        if let Some(corners) = self.corners.begin_update() {
            corners.update(context, mesh.tets, tets)?;
        }
        if let Some(buffer) = self.linked.begin_update() {
            buffer.update_with(context, mesh.tets.len(), tets, |range| {
                let both = mesh.tets[range.clone()].iter().zip(&mesh.neighbors[range]);
                both.map(|(tet, around)| linked(*tet, *around)).collect()
            })?;
            let faces = boundary_faces(mesh.tets, mesh.neighbors);
            self.faces.write(context, &faces.map(|(t, [a, b, c])| [a, b, c, t]).collect::<Vec<_>>())?;
        }
        Ok(())
    }

    /// Holds nothing any more.
    pub(super) fn forget(&mut self) {
        self.points.clear();
        self.moves.clear();
        self.faces.clear();
        self.linked.buffer.clear();
        self.corners.buffer.clear();
        (self.linked.is_current, self.corners.is_current) = (false, false);
    }

    /// Bytes of memory on the GPU.
    pub(super) fn bytes(&self) -> u64 {
        let tets = self.linked.buffer.bytes() + self.corners.buffer.bytes();
        self.points.bytes() + self.moves.bytes() + self.faces.bytes() + tets
    }
}

/// A tetrahedron in 20 bytes: its neighbours in ascending order of the points opposite the faces to them, and the exclusive or of its
/// points (Aman, Demirci, Güdükbay 2022: *Compact tetrahedralization-based acceleration structures for ray tracing*).
fn linked(tet: [u32; 4], around: [u32; 4]) -> [u32; 5] {
    let mut order = [0, 1, 2, 3];
    order.sort_unstable_by_key(|&i: &usize| tet[i]);
    let [a, b, c, d] = order.map(|i| around[i]);
    [a, b, c, d, tet[0] ^ tet[1] ^ tet[2] ^ tet[3]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_opposite_points_in_ascending_order() {
        let tet = linked([7, 2, 9, 4], [70, 20, 90, 40]);
        assert_eq!(tet, [20, 40, 70, 90, 7 ^ 2 ^ 9 ^ 4]);
        assert_eq!(size_of_val(&tet), 20);
    }
}

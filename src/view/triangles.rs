//! Surfaces of triangles as slices: what the renderer and picking take.

use crate::view::{BoundarySurface, IsoSurface, Slice, Solids};

/// A surface of triangles as slices.
#[derive(Clone, Copy, Debug, Default)]
pub struct Triangles<'a> {
    /// Vertices, in model units.
    pub positions: &'a [[f32; 3]],
    /// A direction a vertex, of length 1; none if it has none, as flat surfaces do.
    pub normals: &'a [[f32; 3]],
    /// One number a vertex; none if they have none.
    pub values: &'a [f32],
    /// Triangles. Picking leaves those out that name a vertex which is not there.
    pub indices: &'a [[u32; 3]],
    /// Which sides of each triangle are no edges, because it is part of a larger face: bit `k` is for the side from corner `k` to the
    /// next. None if all are edges.
    pub inner_sides: &'a [u8],
}

impl<'a> From<&'a IsoSurface> for Triangles<'a> {
    fn from(surface: &'a IsoSurface) -> Self {
        let IsoSurface { positions, normals, values, indices, .. } = surface;
        Self { positions, normals, values, indices, inner_sides: &[] }
    }
}

impl<'a> From<&'a BoundarySurface> for Triangles<'a> {
    fn from(surface: &'a BoundarySurface) -> Self {
        let BoundarySurface { positions, values, indices, .. } = surface;
        Self { positions, normals: &[], values, indices, inner_sides: &[] }
    }
}

impl<'a> From<&'a Solids> for Triangles<'a> {
    fn from(solids: &'a Solids) -> Self {
        let Solids { positions, normals, values, indices, .. } = solids;
        Self { positions, normals, values, indices, inner_sides: &[] }
    }
}

impl<'a> From<&'a Slice> for Triangles<'a> {
    /// With all sides as edges: see [`Slice::cell_sides`].
    fn from(slice: &'a Slice) -> Self {
        Self {
            positions: slice.positions(),
            normals: &[],
            values: slice.values(),
            indices: slice.indices(),
            inner_sides: &[],
        }
    }
}

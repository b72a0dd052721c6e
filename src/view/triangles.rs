//! Surfaces of triangles as slices: what the renderer and picking take.

use crate::geom::SingleValues;
use crate::view::{BoundarySurface, IsoSurface, Slice, Solids};

/// A surface of triangles as slices.
#[derive(Clone, Copy, Debug, Default)]
pub struct Triangles<'a> {
    /// Vertices, in model units.
    pub positions: &'a [[f64; 3]],
    /// A direction a vertex, of length 1; none if it has none, as flat surfaces do.
    pub normals: &'a [[f32; 3]],
    /// One number a vertex; none if they have none.
    pub values: &'a [f64],
    /// How a renderer stores the values.
    pub single: SingleValues,
    /// Triangles. Picking leaves those out that name a vertex which is not there.
    pub indices: &'a [[u32; 3]],
    /// Which sides of each triangle are no edges, because it is part of a larger face: bit `k` is for the side from corner `k` to the
    /// next. None if all are edges.
    pub inner_sides: &'a [u8],
}

/// Of what has normals.
macro_rules! from_curved {
    ($($surface:ty),*) => {$(
        impl<'a> From<&'a $surface> for Triangles<'a> {
            fn from(surface: &'a $surface) -> Self {
                let normals = &surface.normals;
                let values = &surface.values;
                let (positions, indices) = (&surface.positions, &surface.indices);
                Self { positions, normals, values, indices, ..Self::default() }
            }
        }
    )*};
}

from_curved!(IsoSurface, Solids);

impl<'a> From<&'a BoundarySurface> for Triangles<'a> {
    fn from(surface: &'a BoundarySurface) -> Self {
        let BoundarySurface { positions, values, indices, .. } = surface;
        Self { positions, values, indices, ..Self::default() }
    }
}

impl<'a> From<&'a Slice> for Triangles<'a> {
    /// With all sides as edges: see [`Slice::cell_sides`].
    fn from(slice: &'a Slice) -> Self {
        Self {
            positions: slice.positions(),
            values: slice.values(),
            indices: slice.indices(),
            ..Self::default()
        }
    }
}

//! Surfaces of triangles as slices: what the renderer and picking take.

use crate::geom::SingleValues;
use crate::view::moves::turned;
use crate::view::{BoundarySurface, IsoSurface, Slice, Slope, Solids};

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
    /// Where each vertex goes if the surface is displaced: so many times this, in model units. None if it stays.
    pub moves: &'a [[f64; 3]],
    /// How the moves change around each vertex, so that normals turn as the surface does; none where normals stay as they are.
    pub slopes: &'a [Slope],
}

impl Triangles<'_> {
    /// The vertices, each displaced by so many times its move.
    pub fn moved_positions(&self, times: f64) -> Vec<[f64; 3]> {
        let all = self.positions.iter().enumerate();
        all.map(|(v, p)| self.moves.get(v).map_or(*p, |m| [0, 1, 2].map(|i| p[i] + times * m[i]))).collect()
    }

    /// The normals of the surface that is displaced by so many times its moves.
    pub fn turned_normals(&self, times: f64) -> Vec<[f32; 3]> {
        let all = self.normals.iter().enumerate();
        all.map(|(v, n)| self.slopes.get(v).map_or(*n, |slope| turned(*n, slope, times))).collect()
    }
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

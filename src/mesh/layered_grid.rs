//! A regular grid whose values are made layer by layer, so that nobody needs to hold all of them.

use crate::mesh::{Field, Grid, TetMesh, VectorPart};
use std::fmt;

/// An array of values at the points of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GridArray {
    /// The name of the array.
    pub name: &'static str,
    /// Values of a point: 1, or 3 for a vector.
    pub components: usize,
    /// Whether the values are of single precision.
    pub is_single: bool,
}

/// Fills in the values of the array of a number in the layer of a number.
type Fill = dyn Fn(usize, u32, &mut [f64]) + Send + Sync;

/// A regular grid whose values are made layer by layer (along z).
pub struct LayeredGrid {
    grid: Grid,
    arrays: Vec<GridArray>,
    fill: Box<Fill>,
}

impl fmt::Debug for LayeredGrid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LayeredGrid")
            .field("grid", &self.grid)
            .field("arrays", &self.arrays)
            .finish_non_exhaustive()
    }
}

impl LayeredGrid {
    /// A grid of which `fill(array, z, values)` adds to `values`, which are zero, those of an array in layer `z`: the points with x
    /// fastest, the components of a point one behind the other.
    pub fn new(
        grid: Grid,
        arrays: Vec<GridArray>,
        fill: impl Fn(usize, u32, &mut [f64]) + Send + Sync + 'static,
    ) -> Self {
        Self { grid, arrays, fill: Box::new(fill) }
    }

    /// The places of the points.
    pub const fn grid(&self) -> Grid {
        self.grid
    }

    /// The arrays, in order.
    pub fn arrays(&self) -> &[GridArray] {
        &self.arrays
    }

    /// How many points there are.
    pub fn points(&self) -> u64 {
        self.grid.dims.iter().map(|&d| u64::from(d)).product()
    }

    /// Makes the values of the array of number `array` in layer `z`: x fastest, the components of a point one behind the other.
    ///
    /// # Panics
    /// If there is no such array.
    pub fn layer(&self, array: usize, z: u32, values: &mut Vec<f64>) {
        let GridArray { components, is_single, .. } = self.arrays[array];
        values.clear();
        values.resize(self.grid.dims[0] as usize * self.grid.dims[1] as usize * components, 0.0);
        (self.fill)(array, z, values);
        if is_single {
            values.iter_mut().for_each(|value| *value = f64::from(*value as f32));
        }
    }

    /// All of it as a mesh: its Kuhn split, and a field for each component, named as readers of files name it (`name_x`).
    ///
    /// # Panics
    /// If the grid has more points than `u32` can number.
    pub fn to_mesh(&self) -> TetMesh {
        let mut fields = Vec::new();
        let mut values = Vec::new();
        for (number, GridArray { name, components, .. }) in self.arrays.iter().enumerate() {
            let mut parts: Vec<Field> = match components {
                1 => vec![Field::new(*name, Vec::new())],
                _ => ["x", "y", "z"].iter().zip(0..).map(|(axis, c)| component(name, axis, c)).collect(),
            };
            for z in 0..self.grid.dims[2] {
                self.layer(number, z, &mut values);
                for (c, part) in parts.iter_mut().enumerate() {
                    part.values.extend(values.iter().skip(c).step_by(*components));
                }
            }
            fields.append(&mut parts);
        }
        TetMesh::from_grid(self.grid, fields)
    }
}

fn component(vector: &str, axis: &str, component: u8) -> Field {
    let part = VectorPart { name: vector.to_owned(), component: Some(component) };
    Field { vector: Some(part), ..Field::new(format!("{vector}_{axis}"), Vec::new()) }
}

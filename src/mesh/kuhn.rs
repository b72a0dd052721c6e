//! Regular grids as tetrahedral meshes: every cube becomes six tetrahedra around its main diagonal.

use crate::mesh::{Field, Grid, TetMesh};

/// The six ways from corner (0,0,0) of a cube to (1,1,1) along three edges, each a positive tetrahedron.
///
/// Corners are numbered `x + 2y + 4z`. Neighbouring cubes cut their common square along the same diagonal,
/// so the split conforms.
const KUHN: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 5, 1, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 6, 4, 7]];

/// The Kuhn split of a grid of `dims` points, x fastest; the number of points must fit in `u32`.
///
/// # Panics
/// If there are more points than `u32` can number.
pub fn kuhn_tets(dims: [u32; 3]) -> Vec<[u32; 4]> {
    let points = dims.iter().try_fold(1_u32, |n, d| n.checked_mul(*d));
    assert!(points.is_some(), "a grid of {dims:?} points is too large");
    let cells = dims.map(|d| d.saturating_sub(1));
    let (row, layer) = (dims[0], dims[0] * dims[1]);
    let corner_offsets = [0, 1, row, row + 1, layer, layer + 1, layer + row, layer + row + 1];
    let mut tets = Vec::with_capacity(6 * cells.iter().map(|&c| c as usize).product::<usize>());
    for z in 0..cells[2] {
        for y in 0..cells[1] {
            for x in 0..cells[0] {
                let first = x + row * y + layer * z;
                tets.extend(KUHN.map(|tet| tet.map(|corner| first + corner_offsets[corner])));
            }
        }
    }
    tets
}

impl TetMesh {
    /// The Kuhn split of a regular grid.
    ///
    /// # Panics
    /// If the grid has more points than `u32` can number.
    pub fn from_grid(grid: Grid, fields: Vec<Field>) -> Self {
        let tets = kuhn_tets(grid.dims);
        let [nx, ny, nz] = grid.dims;
        let mut positions = Vec::with_capacity(nx as usize * ny as usize * nz as usize);
        for z in 0..nz {
            for y in 0..ny {
                positions.extend((0..nx).map(|x| grid.point([x, y, z])));
            }
        }
        Self { positions, fields, tets, grid: Some(grid), ..Self::default() }
    }
}

impl TetMesh {
    /// A regular grid alone: its points and tetrahedra follow from it, and take no memory until [`TetMesh::expand_grid`] makes them.
    pub fn of_grid_alone(grid: Grid, fields: Vec<Field>) -> Self {
        Self { fields, grid: Some(grid), ..Self::default() }
    }

    /// Whether it is a grid whose points and tetrahedra have not been made: see [`TetMesh::of_grid_alone`].
    pub fn is_grid_alone(&self) -> bool {
        self.grid.is_some() && self.positions.is_empty() && self.tets.is_empty()
    }

    /// How many points and tetrahedra there are, those of a grid alone included.
    pub fn counts(&self) -> [u64; 2] {
        match self.grid {
            Some(Grid { dims, .. }) if self.is_grid_alone() => {
                let product = |first: u64, less: u32| {
                    let along = dims.iter().map(|&d| u64::from(d.saturating_sub(less)));
                    along.fold(first, u64::saturating_mul)
                };
                [product(1, 0), product(6, 1)]
            }
            _ => [self.positions.len() as u64, self.tets.len() as u64],
        }
    }

    /// Makes the points and tetrahedra of a grid alone; other meshes stay as they are.
    ///
    /// # Panics
    /// If the grid has more points than `u32` can number.
    pub fn expand_grid(&mut self) {
        if let Some(grid) = self.grid.filter(|_| self.is_grid_alone()) {
            let Self { positions, tets, .. } = Self::from_grid(grid, Vec::new());
            (self.positions, self.tets) = (positions, tets);
        }
    }
}

impl Grid {
    /// The position of the point with these indices.
    pub fn point(&self, index: [u32; 3]) -> [f64; 3] {
        [0, 1, 2].map(|i| self.origin[i] + self.spacing[i] * f64::from(index[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::check;

    #[test]
    fn grids_of_every_small_size_are_valid_and_fill_their_box() {
        for dims in [[2, 2, 2], [3, 2, 2], [2, 3, 2], [2, 2, 3], [4, 3, 5]] {
            let grid = Grid { dims, origin: [1.0, -2.0, 0.5], spacing: [0.5, 1.0, 2.0] };
            let mesh = TetMesh::from_grid(grid, Vec::new());
            check(&mesh).unwrap();
            let cells: u32 = dims.iter().map(|d| d - 1).product();
            assert_eq!(mesh.tets.len(), 6 * cells as usize);
            let six_volumes: f64 = mesh.tets.iter().map(|t| six_volume(&mesh, *t)).sum();
            assert_eq!(six_volumes, 6.0 * f64::from(cells));
        }
    }

    fn six_volume(mesh: &TetMesh, tet: [u32; 4]) -> f64 {
        let p = tet.map(|v| mesh.positions[v as usize]);
        let [u, v, w] = [1, 2, 3].map(|k| [0, 1, 2].map(|i| p[k][i] - p[0][i]));
        (u[1] * v[2] - u[2] * v[1]) * w[0]
            + (u[2] * v[0] - u[0] * v[2]) * w[1]
            + (u[0] * v[1] - u[1] * v[0]) * w[2]
    }
}

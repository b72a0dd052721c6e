//! Small meshes made by code, for the tests of what is seen.

use std::collections::BTreeMap;
use tetralod::mesh::{FACES, NONE};
use tetralod::view::MeshView;

/// A mesh that owns what a `MeshView` borrows.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    pub positions: Vec<[f64; 3]>,
    pub field: Vec<f64>,
    pub tets: Vec<[u32; 4]>,
    pub neighbors: Vec<[u32; 4]>,
}

impl Scene {
    pub fn new(positions: Vec<[f64; 3]>, field: Vec<f64>, tets: Vec<[u32; 4]>) -> Self {
        let neighbors = neighbors(&tets);
        Self { positions, field, tets, neighbors }
    }

    /// One positive tetrahedron with these values at its corners.
    pub fn tet(field: [f64; 4]) -> Self {
        let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Self::new(corners, field.to_vec(), vec![[0, 1, 2, 3]])
    }

    /// The unit cube as `cells`³ cubes of six tetrahedra each, with `field` at its points.
    pub fn cube(cells: usize, field: impl Fn([f64; 3]) -> f64) -> Self {
        let side = cells + 1;
        let at = |x: usize, y: usize, z: usize| (x + side * (y + side * z)) as u32;
        let positions: Vec<_> = (0..side * side * side)
            .map(|i| [i % side, i / side % side, i / side / side].map(|c| c as f64 / cells as f64))
            .collect();
        let mut tets = Vec::new();
        for cell in 0..cells * cells * cells {
            let low = [cell % cells, cell / cells % cells, cell / cells / cells];
            for (order, even) in [
                ([0, 1, 2], true),
                ([1, 2, 0], true),
                ([2, 0, 1], true),
                ([0, 2, 1], false),
                ([2, 1, 0], false),
                ([1, 0, 2], false),
            ] {
                let mut corner = low;
                let mut path = [at(low[0], low[1], low[2]); 4];
                for (step, axis) in order.into_iter().enumerate() {
                    corner[axis] += 1;
                    path[step + 1] = at(corner[0], corner[1], corner[2]);
                }
                let [a, b, c, d] = path;
                tets.push(if even { [a, b, c, d] } else { [a, c, b, d] });
            }
        }
        let values = positions.iter().map(|p| field(*p)).collect();
        Self::new(positions, values, tets)
    }

    /// The cube around a ball: high inside, falling linearly with the distance from the centre.
    pub fn ball(cells: usize) -> Self {
        Self::cube(cells, |p| 1.0 - 2.0 * distance_to_centre(p))
    }

    pub fn view(&self) -> MeshView<'_> {
        MeshView {
            positions: &self.positions,
            field: &self.field,
            is_label: false,
            tets: &self.tets,
            neighbors: &self.neighbors,
        }
    }
}

pub fn distance_to_centre(p: [f64; 3]) -> f64 {
    p.iter().map(|c| (c - 0.5) * (c - 0.5)).sum::<f64>().sqrt()
}

fn neighbors(tets: &[[u32; 4]]) -> Vec<[u32; 4]> {
    let mut open = BTreeMap::new();
    let mut neighbors = vec![[NONE; 4]; tets.len()];
    for (t, tet) in tets.iter().enumerate() {
        for (i, face) in FACES.iter().enumerate() {
            let mut key = face.map(|corner| tet[corner]);
            key.sort_unstable();
            if let Some((other, j)) = open.remove(&key) {
                let other: usize = other;
                neighbors[t][i] = other as u32;
                neighbors[other][j] = t as u32;
            } else {
                open.insert(key, (t, i));
            }
        }
    }
    neighbors
}

//! Fields at cells as fields at points.

use crate::geom::bits_of;
use crate::mesh::{Field, TetMesh};
use std::collections::HashSet;

impl TetMesh {
    /// Turns the fields at cells that have values into fields at points: the mean of the cells around a point, weighted
    /// by volume. A name that a field at points has already gets `_cells` behind it.
    ///
    /// Points without cells get 0; [`repair`](crate::mesh::repair) drops them, and turns cells whose volume would
    /// otherwise count as negative.
    pub fn cells_to_points(&mut self) {
        let (read, named) = std::mem::take(&mut self.cell_fields)
            .into_iter()
            .partition::<Vec<Field>, _>(|field| field.values.len() == self.tets.len());
        self.cell_fields = named;
        if read.is_empty() {
            return;
        }
        let volumes = self.relative_volumes();
        // Time steps share a name.
        let key = |field: &Field| (field.name.clone(), field.time.map(bits_of));
        let mut taken: HashSet<_> = self.fields.iter().map(key).collect();
        for mut field in read {
            field.values = self.mean_of_cells(&field.values, &volumes);
            field.integer = false;
            while !taken.insert(key(&field)) {
                field.name.push_str("_cells");
                field.vector = None;
            }
            self.fields.push(field);
        }
    }

    fn mean_of_cells(&self, values: &[f64], volumes: &[f64]) -> Vec<f64> {
        let mut means = vec![0.0; self.positions.len()];
        let mut weights = vec![0.0; self.positions.len()];
        for ((tet, value), volume) in self.tets.iter().zip(values).zip(volumes) {
            for &v in tet {
                let v = v as usize;
                weights[v] += volume;
                // A running mean stays between the values that it is of: no sum that could overflow.
                if weights[v] > 0.0 {
                    let share = volume / weights[v];
                    means[v] = means[v] * (1.0 - share) + value * share;
                }
            }
        }
        means
    }

    /// Volumes in a unit in which none overflows, and none is 0 that is not almost flat.
    fn relative_volumes(&self) -> Vec<f64> {
        let bounds = crate::geom::Bounds::of(&self.positions);
        let scale = bounds.extent().into_iter().fold(f64::MIN_POSITIVE, f64::max);
        let volume = |tet: &[u32; 4]| {
            let [a, b, c, d] = tet.map(|v| self.positions[v as usize].map(|x| x / scale));
            let [u, v, w] = [b, c, d].map(|p| glam::DVec3::from_array(p) - glam::DVec3::from_array(a));
            u.cross(v).dot(w).abs().max(f64::MIN_POSITIVE)
        };
        self.tets.iter().map(volume).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Grid;

    #[test]
    fn points_get_the_mean_weighted_by_volume() {
        // Two tetrahedra on one face, the second three times as high.
        let positions =
            vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -3.0]];
        let mut mesh = TetMesh {
            positions,
            tets: vec![[0, 1, 2, 3], [0, 2, 1, 4]],
            cell_fields: vec![Field::new("m", vec![8.0, 4.0])],
            ..TetMesh::default()
        };
        mesh.cells_to_points();
        assert_eq!(mesh.fields[0].values, [5.0, 5.0, 5.0, 8.0, 4.0]);
        assert!(mesh.cell_fields.is_empty());
    }

    #[test]
    fn a_constant_stays_and_names_stay_different() {
        let grid = Grid { dims: [4, 3, 3], origin: [1e200; 3], spacing: [1e190; 3] };
        let mut mesh = TetMesh::from_grid(grid, vec![Field::new("m", vec![0.0; 36])]);
        let huge = vec![f64::MAX; mesh.tets.len()];
        mesh.cell_fields = vec![Field::new("m", huge), Field::new("only named", Vec::new())];
        mesh.cells_to_points();
        assert_eq!(mesh.fields[1].name, "m_cells");
        assert!(mesh.fields[1].values.iter().all(|v| (v / f64::MAX - 1.0).abs() < 1e-12));
        assert_eq!(mesh.cell_fields.len(), 1);
    }
}

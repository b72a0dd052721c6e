//! Fields that follow from the positions of points alone, for meshes that have none.

use crate::geom::Bounds;
use crate::mesh::{Field, TetMesh};

/// A field that every mesh has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GeometryField {
    /// The distance from the middle of the bounding box.
    Distance,
    /// A coordinate.
    X,
    /// A coordinate.
    Y,
    /// A coordinate.
    Z,
    /// 0 everywhere: the shape of the mesh alone decides.
    None,
}

impl GeometryField {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Distance, Self::X, Self::Y, Self::Z, Self::None];

    /// What users call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Distance => "distance",
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::None => "none",
        }
    }

    /// The field of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|field| field.name() == name)
    }
}

impl TetMesh {
    /// Adds those of the [geometry fields](GeometryField) that are named and that no field of the mesh, at points or cells,
    /// answers to.
    pub fn add_geometry_fields(&mut self, names: &[String]) {
        for name in names {
            let is_there = self.fields.iter().chain(&self.cell_fields).any(|field| field.answers_to(name));
            if let Some(field) = GeometryField::named(name).filter(|_| !is_there) {
                let values = self.geometry_values(field);
                self.fields.push(Field::new(name.clone(), values));
            }
        }
    }

    fn geometry_values(&self, field: GeometryField) -> Vec<f64> {
        let axis = |i: usize| self.positions.iter().map(|p| p[i]).collect();
        match field {
            GeometryField::X => axis(0),
            GeometryField::Y => axis(1),
            GeometryField::Z => axis(2),
            GeometryField::None => vec![0.0; self.positions.len()],
            GeometryField::Distance => {
                let bounds = Bounds::of(&self.positions);
                let middle = [0, 1, 2].map(|i| bounds.min[i] / 2.0 + bounds.max[i] / 2.0);
                let middle = glam::DVec3::from_array(middle);
                self.positions.iter().map(|p| glam::DVec3::from_array(*p).distance(middle)).collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_of_the_file_come_first() {
        let mut mesh = TetMesh {
            positions: vec![[0.0, 0.0, 0.0], [6.0, 8.0, 0.0], [3.0, 4.0, 2.0]],
            fields: vec![Field::new("y", vec![7.0; 3])],
            ..TetMesh::default()
        };
        let names = ["x", "y", "z", "distance", "none", "other"].map(str::to_owned);
        mesh.add_geometry_fields(&names);
        mesh.add_geometry_fields(&names);
        let fields: Vec<_> = mesh.fields.iter().map(|f| (f.name.as_str(), f.values.as_slice())).collect();
        let far = 26.0_f64.sqrt();
        assert_eq!(
            fields,
            [
                ("y", &[7.0; 3][..]),
                ("x", &[0.0, 6.0, 3.0]),
                ("z", &[0.0, 0.0, 2.0]),
                ("distance", &[far, far, 1.0]),
                ("none", &[0.0; 3]),
            ]
        );
    }
}

//! Time steps over one mesh.

use crate::mesh::{Field, NONE, TetMesh};
use std::collections::HashSet;
use thiserror::Error;

/// What to do with steps over meshes that differ.
const REMEDY: &str = "time steps must share one mesh: build an MT of each instead";

/// Why two meshes are not time steps over one mesh. Cells and points are numbered as in the input, from 0.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum StepError {
    /// They do not have as many points.
    #[error("the first time step has {} points, this one {}; {REMEDY}", .counts[0], .counts[1])]
    Points {
        /// Points of the first step and of this one.
        counts: [usize; 2],
    },
    /// They do not have as many cells.
    #[error("the first time step has {} cells, this one {}; {REMEDY}", .counts[0], .counts[1])]
    Cells {
        /// Cells of the first step and of this one.
        counts: [usize; 2],
    },
    /// A point that cells use has moved.
    #[error("point {point} is not where it is in the first time step; {REMEDY}")]
    Moved {
        /// The first such point.
        point: usize,
    },
    /// A cell has other points.
    #[error("cell {cell} has other points than in the first time step; {REMEDY}")]
    Cell {
        /// The first such cell.
        cell: usize,
    },
    /// They do not have the same fields.
    #[error("field \"{name}\" is in some time steps alone; choose fields that all of them have")]
    Field {
        /// The first one that only one of them has.
        name: String,
    },
}

impl TetMesh {
    /// Appends the fields of another time step. Both are meshes as they were read: of what [`repair`](crate::mesh::repair)
    /// mends later, how cells are turned and where points are that no cell uses may differ.
    ///
    /// # Errors
    /// The first difference between the meshes; this one is unchanged then.
    pub fn add_step(&mut self, step: Self) -> Result<(), StepError> {
        self.same_mesh(&step)?;
        let (known, new) = (self.names_of_a_step(), step.names_of_a_step());
        if let Some((_, name)) = first_only_in(&new, &known).or_else(|| first_only_in(&known, &new)) {
            return Err(StepError::Field { name: name.to_owned() });
        }
        self.fields.extend(step.fields);
        self.cell_fields.extend(step.cell_fields.into_iter().filter(|f| !f.values.is_empty()));
        let new: Vec<String> = step.notes.into_iter().filter(|note| !self.notes.contains(note)).collect();
        self.notes.extend(new);
        Ok(())
    }

    /// The names of the fields of the first time step, and whether they are at cells. Those of later steps follow.
    fn names_of_a_step(&self) -> Vec<(bool, &str)> {
        let of_first = |fields: &'_ [Field]| {
            let time = fields.first().and_then(|field| field.time);
            fields.iter().take_while(|field| field.time == time).count()
        };
        let [points, cells] = [&self.fields, &self.cell_fields].map(|fields| &fields[..of_first(fields)]);
        let points = points.iter().map(|field| (false, field.name.as_str()));
        points.chain(cells.iter().map(|field| (true, field.name.as_str()))).collect()
    }

    fn same_mesh(&self, step: &Self) -> Result<(), StepError> {
        if self.positions.len() != step.positions.len() {
            return Err(StepError::Points { counts: [self.positions.len(), step.positions.len()] });
        }
        if self.tets.len() != step.tets.len() {
            return Err(StepError::Cells { counts: [self.tets.len(), step.tets.len()] });
        }
        let sorted = |mut tet: [u32; 4]| {
            tet.sort_unstable();
            tet
        };
        let mut pairs = self.tets.iter().zip(&step.tets);
        if let Some(cell) = pairs.position(|(a, b)| a != b && sorted(*a) != sorted(*b)) {
            return Err(StepError::Cell { cell });
        }
        let mut moved: Vec<u32> = (0..self.positions.len() as u32).collect();
        for (number, (a, b)) in moved.iter_mut().zip(self.positions.iter().zip(&step.positions)) {
            if a == b {
                *number = NONE;
            }
        }
        let first = if self.tets.is_empty() {
            moved.into_iter().find(|&v| v != NONE)
        } else {
            let used = self.tets.iter().flatten().filter_map(|&v| moved.get(v as usize).copied());
            used.filter(|&v| v != NONE).min()
        };
        first.map_or(Ok(()), |point| Err(StepError::Moved { point: point as usize }))
    }
}

/// The first of some names that is not among others.
fn first_only_in<'a>(names: &[(bool, &'a str)], others: &[(bool, &str)]) -> Option<(bool, &'a str)> {
    let others: HashSet<_> = others.iter().copied().collect();
    names.iter().copied().find(|name| !others.contains(name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Field, Grid};

    fn step(time: f64) -> TetMesh {
        let grid = Grid { dims: [2, 2, 2], origin: [0.0; 3], spacing: [1.0; 3] };
        let field = Field { time: Some(time), ..Field::new("p", vec![time; 8]) };
        TetMesh { grid: None, ..TetMesh::from_grid(grid, vec![field]) }
    }

    #[test]
    fn steps_over_one_mesh_become_fields_of_one_name() {
        let mut mesh = step(0.0);
        let mut turned = step(0.5);
        turned.tets[2].swap(0, 3);
        mesh.add_step(turned).unwrap();
        let fields: Vec<_> = mesh.fields.iter().map(|f| (f.name.as_str(), f.time)).collect();
        assert_eq!(fields, [("p", Some(0.0)), ("p", Some(0.5))]);
    }

    #[test]
    fn the_first_difference_is_named() {
        let refused = |change: fn(&mut TetMesh)| {
            let (mut mesh, mut other) = (step(0.0), step(1.0));
            change(&mut other);
            let error = mesh.add_step(other).unwrap_err();
            assert_eq!(mesh, step(0.0));
            error
        };
        assert_eq!(refused(|m| m.positions[5][1] = 2.0), StepError::Moved { point: 5 });
        assert_eq!(refused(|m| m.tets.swap(1, 2)), StepError::Cell { cell: 1 });
        assert_eq!(refused(|m| m.tets.truncate(5)), StepError::Cells { counts: [6, 5] });
        assert_eq!(refused(|m| m.positions.push([0.0; 3])), StepError::Points { counts: [8, 9] });
        assert_eq!(refused(|m| m.fields[0].name = "q".into()), StepError::Field { name: "q".into() });
    }
}

//! The smallest and the largest value of a field, and where the input has them.

use serde::Serialize;

/// A value of a field, and where the input has it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Extreme {
    /// The value, in field units.
    pub value: f64,
    /// Where the input has its point, in model units; of a value at a cell the centre of the cell's volume.
    pub place: [f64; 3],
    /// Of a value at a cell, the cell's number in the input, from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cell: Option<u32>,
    /// The part of the input in which cells are numbered so, if it has several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
}

/// The smallest and the largest value of a field.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Extremes {
    /// The smallest value.
    pub min: Extreme,
    /// The largest value.
    pub max: Extreme,
}

impl Extremes {
    /// Those of values at places, of equal values the first; none without values.
    #[doc(hidden)]
    pub fn of(values: impl IntoIterator<Item = (f64, [f64; 3])>) -> Option<Self> {
        let mut values = values.into_iter();
        let first = values.next()?;
        let [mut least, mut largest] = [first; 2];
        for at in values {
            if at.0 < least.0 {
                least = at;
            }
            if at.0 > largest.0 {
                largest = at;
            }
        }
        let of = |(value, place)| Extreme { value, place, ..Extreme::default() };
        Some(Self { min: of(least), max: of(largest) })
    }

    /// Both, the smallest first.
    #[doc(hidden)]
    pub fn both(&self) -> [&Extreme; 2] {
        [&self.min, &self.max]
    }
}

/// What averaging has done to a field that the input has at cells: see [`TetMesh::cells_to_points`](crate::mesh::TetMesh::cells_to_points).
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Averaged {
    /// The smallest and the largest value that the input has at cells.
    pub input: Extremes,
    /// How far the field at points is from these values.
    pub difference: Difference,
}

/// How far a field at points is from values at cells. Of each cell the difference is the mean over the cell's volume of the field at points,
/// which is linear in each of the cell's tetrahedra, less the cell's value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Difference {
    /// The square root of the mean of the squared differences over the volume: each cell counts by its volume.
    pub rms: f64,
    /// The largest difference of a cell, as a positive number.
    pub largest: f64,
}

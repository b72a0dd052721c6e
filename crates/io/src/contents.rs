//! What a file contains, as far as it says so.

use crate::error::ReadReason;
use crate::grid::{Placement, checked_dims, most_tets};
use tetralod::mesh::{Field, Grid};

/// What a file says that it contains. The data may be damaged even so.
#[derive(Clone, Debug, PartialEq)]
pub struct Survey {
    /// The format: `"vtu"`, `"vti"`, `"vtr"`, `"vts"`, the same with a `p` in front where it lists files with pieces, `"vtk"`, `"raw"`,
    /// `"gmsh"`, `"medit"`, `"tetgen"`, `"netgen"`, `"nrrd"` or `"metaimage"`, and with the feature `hdf5` `"vtkhdf"` or `"exodus"`.
    pub format: &'static str,
    /// The number of points; those that several pieces have count in each. Polyhedra may get more in their middle.
    pub points: u64,
    /// The tetrahedra, at most, that its cells are or are split into; more where bent faces of polyhedra get points in their middle.
    pub cells: u64,
    /// The grid, if it is one.
    pub grid: Option<Grid>,
    /// The fields at points, without values.
    pub fields: Vec<Field>,
    /// The fields at cells, without values.
    pub cell_fields: Vec<Field>,
}

impl Survey {
    /// A grid that may be turned.
    pub(super) fn of_placement(
        format: &'static str,
        placement: &Placement,
        fields: [Vec<Field>; 2],
    ) -> Result<Self, ReadReason> {
        if let Some(grid) = placement.grid()? {
            return Ok(Self::of_grid(format, grid, fields));
        }
        checked_dims(placement.dims)?;
        let ([fields, cell_fields], points) = (fields, placement.dims.iter().product());
        Ok(Self { format, points, cells: most_tets(placement.dims), grid: None, fields, cell_fields })
    }

    /// A grid; six tetrahedra a cube.
    pub(super) fn of_grid(format: &'static str, grid: Grid, [fields, cell_fields]: [Vec<Field>; 2]) -> Self {
        let product =
            |less: u64| grid.dims.iter().map(|&d| u64::from(d).saturating_sub(less)).product::<u64>();
        Self { format, points: product(0), cells: 6 * product(1), grid: Some(grid), fields, cell_fields }
    }
}

/// How much there is in pieces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PieceCounts {
    /// Points of all pieces; those that several have count in each.
    pub points: u64,
    /// Tetrahedra of all pieces, at most.
    pub tetrahedra: u64,
    /// How many pieces there are.
    pub pieces: u64,
    /// Tetrahedra of the largest piece, at most.
    pub largest: u64,
    /// Fields at points.
    pub fields: u64,
    /// Points that several pieces have, about.
    pub meeting: u64,
}

impl PieceCounts {
    /// As of pieces that are as long as they are wide: of the six sides of each, two of them share one.
    pub(super) fn in_boxes(mut self) -> Self {
        let side = libm::cbrt(self.points as f64 / self.pieces.max(1) as f64);
        let sides = if self.pieces > 1 { 3.0 * self.pieces as f64 * side * side } else { 0.0 };
        self.meeting = self.points.min(sides as u64);
        self
    }

    /// As of ranges of cells, which are layers of a volume: each has as many in common with the next one as the volume is wide. The most
    /// that was measured, in layers around a hole.
    pub(super) fn in_layers(mut self) -> Self {
        let side = libm::cbrt(self.points as f64);
        let between = self.pieces.saturating_sub(1) as f64;
        self.meeting = self.points.min((WIDTH_OF_LAYERS * between * side * side) as u64);
        self
    }
}

/// Points of a layer that are in the next one, for each of the side of a cube of as many points.
const WIDTH_OF_LAYERS: f64 = 1.85;

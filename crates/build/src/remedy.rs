//! What of the configuration or of the input to change after an error: programs name the option by which their users do so.

use super::BuildError;

/// What to change so that a build which failed may succeed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Remedy {
    /// Build by [insertion](super::Method::Insert): it needs no cells.
    Insert,
    /// Build by [decimation](super::Method::Decimate): it keeps the mesh as it is.
    Decimate,
    /// Name a field, or what of the geometry is to be one.
    Field,
    /// Turn fields at cells into fields at points: see [`TetMesh::cells_to_points`](tetralod::mesh::TetMesh::cells_to_points).
    CellsToPoints,
    /// Allow a larger tolerance of the values of fields, or keep their exact values.
    FieldTolerance,
    /// Allow a larger tolerance of positions.
    PositionTolerance,
    /// Use more bits for positions.
    PositionBits,
}

impl BuildError {
    /// What to change, where that is known.
    pub fn remedy(&self) -> Option<Remedy> {
        match self {
            Self::Empty => Some(Remedy::Insert),
            Self::NoField => Some(Remedy::Field),
            Self::CellField { .. } => Some(Remedy::CellsToPoints),
            Self::Tolerance { field: Some(_), .. } => Some(Remedy::FieldTolerance),
            Self::Tolerance { field: None, .. } => Some(Remedy::PositionTolerance),
            Self::TooThin { enough: Some(_), .. } | Self::SamePlace { .. } => Some(Remedy::PositionBits),
            Self::Crowded { .. } | Self::NotConvex => Some(Remedy::Decimate),
            _ => None,
        }
    }
}

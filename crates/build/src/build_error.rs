//! Why no MT was built, and what to do.

use tetralod::mesh::{InputCell, MeshError};
use tetralod::mt::{ConvertError, MAX_VERTICES, UpdateError};
use thiserror::Error;

/// Why no MT was built.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum BuildError {
    /// Kind, method and criterion do not go together.
    #[error("{} does not go with {}: {instead}", .which[0], .which[1])]
    Combination {
        /// The two that do not.
        which: [String; 2],
        /// What goes with what.
        instead: &'static str,
    },
    /// The MT could not be converted to the kind of the configuration.
    #[error(transparent)]
    Convert(#[from] ConvertError),
    /// The mesh has no tetrahedra.
    #[error("the mesh has no tetrahedra; only insertion builds an MT of points alone")]
    Empty,
    /// The mesh has no point field.
    #[error(
        "the mesh has no point field, and an MT needs at least one scalar at its points: name a field of the geometry (distance, x, \
         y, z or none)"
    )]
    NoField,
    /// The mesh has no field of this name.
    #[error("there is no point field '{name}'; the mesh has: {}", .known.join(", "))]
    UnknownField {
        /// The name.
        name: String,
        /// The names of its fields.
        known: Vec<String>,
    },
    /// The field has values at cells, not at points: see [`TetMesh::cells_to_points`](tetralod::mesh::TetMesh::cells_to_points).
    #[error("'{name}' is a field at cells, but an MT has fields at points; turn it into one at points first")]
    CellField {
        /// The name of the field.
        name: String,
    },
    /// The mesh has no label of this name.
    #[error("there is no label '{name}' at cells or points; the mesh has: {}", .known.join(", "))]
    UnknownLabel {
        /// The name.
        name: String,
        /// The names of its fields.
        known: Vec<String>,
    },
    /// The labels part the mesh into too many regions.
    #[error(
        "the labels part the mesh into {count} regions, of which there may be {most}: keep fewer arrays apart"
    )]
    Regions {
        /// How many regions there are.
        count: usize,
        /// How many there may be.
        most: usize,
    },
    /// A label is not an integer.
    #[error("'{name}' is no label: labels are integers of less than 2^53, but number {at} is {value}")]
    Label {
        /// The name of the label.
        name: String,
        /// The cell or point.
        at: u32,
        /// The value that is no integer.
        value: f64,
    },
    /// Labels are more than 2^24 apart.
    #[error("the labels of '{name}' are too far apart: the largest may be less than 2^24 above the smallest")]
    LabelRange {
        /// The name of the label.
        name: String,
    },
    /// A precision was given for a label.
    #[error("'{name}' is a label, and labels are exact: give no precision for it")]
    LabelPrecision {
        /// The name of the label.
        name: String,
    },
    /// An edge MT was to have labels.
    #[error(
        "'{name}' cannot be a label with kind edge: its collapses make points between others, which would have values between labels; \
         take another kind, or no label"
    )]
    LabelOfEdges {
        /// The name of the label.
        name: String,
    },
    /// A label is another one at another time.
    #[error(
        "'{name}' changes from one time step to another: keep apart by a label that stays, or build a single step"
    )]
    LabelChanges {
        /// The name of the label.
        name: String,
    },
    /// There is no point where one is to be kept.
    #[error(
        "there is no point to keep at {} {} {}: give the coordinates of points of the mesh, to a millionth of its diagonal",
        .place[0],
        .place[1],
        .place[2]
    )]
    NoPoint {
        /// Where it was to be.
        place: [f64; 3],
    },
    /// More fields than an MT can have.
    #[error("{fields} fields and time steps are too many (at most 255); name those to keep")]
    TooManyFields {
        /// How many were chosen.
        fields: usize,
    },
    /// The range of a field overflows.
    #[error("the values of field '{field}' are too far apart; scale them down")]
    WideRange {
        /// The field.
        field: String,
    },
    /// Coordinates, or the values of a field, are so small or so large that double precision cannot compute with them.
    #[error("{}", scale_message(.field.as_deref(), *.step, *.origin))]
    Scale {
        /// The field; none for positions.
        field: Option<String>,
        /// The step of the lattice that they would be put on.
        step: f64,
        /// The smallest one.
        origin: f64,
    },
    /// The finest lattice moves positions, or values, by more than the tolerance.
    #[error("{}", tolerance_message(.field.as_deref(), *.reached))]
    Tolerance {
        /// The field; none for positions.
        field: Option<String>,
        /// How far it moves them.
        reached: f64,
    },
    /// An option is out of its range.
    #[error("option {name} must be {expected}")]
    Option {
        /// The name of the option.
        name: &'static str,
        /// The allowed values.
        expected: &'static str,
    },
    /// The mesh is not valid; repair it first.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A coordinate or a field value is not finite.
    #[error("point {point} has a coordinate or a value that is not finite")]
    NotFinite {
        /// The point.
        point: u32,
    },
    /// A tetrahedron is too thin for the lattice.
    #[error(
        "cell {cell} is too thin for a lattice of {bits} bits: it turns flat or inside out{}",
        thin_remedy(*.enough)
    )]
    TooThin {
        /// The cell.
        cell: InputCell,
        /// The bits of the configuration, or those tried last.
        bits: u32,
        /// The fewest bits that keep all cells positive, unless all are too few.
        enough: Option<u32>,
    },
    /// Fewer than four points, or all of them in one plane.
    #[error("the points do not span a volume: there must be four that are not in one plane")]
    Flat,
    /// Two points have the same position.
    #[error(
        "points {} and {} are in the same place on the lattice: remove one, or use more position bits (at most 30)",
        .points[0],
        .points[1]
    )]
    SamePlace {
        /// The points.
        points: [u32; 2],
    },
    /// More tetrahedra share a point than an MT can describe.
    #[error("too many tetrahedra meet around point {point} for insertion; build by decimation")]
    Crowded {
        /// The point.
        point: u32,
    },
    /// The mesh is not convex: insertion fills the convex hull of the points.
    #[error("the mesh does not fill its convex hull, which insertion would do; build by decimation")]
    NotConvex,
    /// More vertices or tetrahedra than a mesh in memory can number.
    #[error(
        "there are more than 2^30 points or 2^30 - 1 tetrahedra in one mesh or part; build it in more parts, or split it"
    )]
    TooLarge,
    /// More points than an MT can number.
    #[error(
        "{points} points are more than one MT can number, {MAX_VERTICES} (a grid of 1625 x 1625 x 1625 points, or as many of any shape), \
         however many parts there are; keep fewer samples along each axis, or split the data and build an MT of each piece"
    )]
    Points {
        /// How many there are, as far as they were counted.
        points: u64,
    },
    /// The caller stopped the work.
    #[error("stopped")]
    Stopped,
    /// The finished MT failed its own check: a bug in the builder, not in the input.
    #[error("the built MT is not sound ({0}); please report this")]
    Internal(UpdateError),
}

fn scale_message(field: Option<&str>, step: f64, origin: f64) -> String {
    let what = field.map_or("the coordinates".to_owned(), |field| format!("the values of field '{field}'"));
    format!(
        "{what} are too small or too large to compute with in double precision (from {origin:e} on, in steps of {step:e}; steps are to be \
         at least 1e-51, numbers at most 1e51): scale them, as by using another unit"
    )
}

fn tolerance_message(field: Option<&str>, reached: f64) -> String {
    match field {
        Some(field) => format!(
            "24 bits keep the values of field '{field}' within {reached:e}, no closer; allow a larger tolerance, or keep \
             its exact values"
        ),
        None => {
            format!("30 bits keep the positions within {reached:e}, no closer; allow a larger tolerance")
        }
    }
}

fn thin_remedy(enough: Option<u32>) -> String {
    match enough {
        Some(bits) => format!("; use {bits} position bits"),
        None => ", and no lattice of at most 30 bits keeps all cells; remove the cell".to_owned(),
    }
}

impl tetralod::Coded for BuildError {
    fn code(&self) -> &'static str {
        match self {
            Self::Combination { .. }
            | Self::UnknownField { .. }
            | Self::CellField { .. }
            | Self::UnknownLabel { .. }
            | Self::LabelPrecision { .. }
            | Self::LabelOfEdges { .. }
            | Self::TooManyFields { .. }
            | Self::Tolerance { .. }
            | Self::Option { .. } => "bad-option",
            Self::TooLarge | Self::Points { .. } => "limit",
            Self::Stopped => "stopped",
            Self::Internal(_) | Self::Convert(_) => "internal",
            _ => "bad-mesh",
        }
    }
}

//! What can be wrong with a mesh, named by the cells of the file it came from.

use super::{InputCell, MAX_TETS};
use thiserror::Error;

/// Why a mesh cannot be used. Cells are those of the input, numbered as there, from 0; so are points.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum MeshError {
    /// There is no tetrahedron, or none is left.
    #[error("the mesh has no tetrahedron (left); check that the right file was given")]
    Empty,
    /// More tetrahedra than the arrays here can index.
    #[error("{tets} tetrahedra are too many (at most {MAX_TETS}); split the mesh")]
    TooMany {
        /// How many there are.
        tets: usize,
    },
    /// A field is not as long as the list of points.
    #[error("field \"{field}\" has {values} values for {points} points; give one value a point")]
    FieldLength {
        /// The field's name.
        field: String,
        /// How many values it has.
        values: usize,
        /// How many points there are.
        points: usize,
    },
    /// A field at the cells is not as long as the list of cells.
    #[error("field \"{field}\" has {values} values for {cells} cells; give one value a cell")]
    CellFieldLength {
        /// The field's name.
        field: String,
        /// How many values it has.
        values: usize,
        /// How many cells there are.
        cells: usize,
    },
    /// A point has an infinite or undefined coordinate.
    #[error("point {point} has an infinite or undefined coordinate; mend it in the input")]
    NotFinite {
        /// The point.
        point: usize,
    },
    /// A tetrahedron refers to a point that does not exist.
    #[error("cell {tet} refers to point {point}, but there are {points} points; mend the input")]
    MissingPoint {
        /// The cell.
        tet: InputCell,
        /// The index it holds.
        point: u32,
        /// How many points there are.
        points: usize,
    },
    /// A tetrahedron has the same vertex twice.
    #[error("cell {tet} has the same vertex twice; remove it")]
    RepeatedVertex {
        /// The cell.
        tet: InputCell,
    },
    /// A tetrahedron has no volume.
    #[error("cell {tet} has no volume; repair the mesh first")]
    Flat {
        /// The cell.
        tet: InputCell,
    },
    /// A tetrahedron is turned inside out.
    #[error("cell {tet} is turned inside out; repair the mesh first")]
    Inverted {
        /// The cell.
        tet: InputCell,
    },
    /// Three or more tetrahedra share a face.
    #[error(
        "face ({}, {}, {}) is shared by {} cells ({}), but at most two can meet in a face; remove overlapping cells",
        .face[0], .face[1], .face[2], .tets.len(), listed(.tets)
    )]
    CrowdedFace {
        /// The face's points.
        face: [u32; 3],
        /// The cells, in increasing order.
        tets: Vec<InputCell>,
    },
    /// Two tetrahedra lie on the same side of the face they share: the mesh is folded there.
    #[error("{}; remesh this region", folded(.tets))]
    Folded {
        /// The cells, in increasing order.
        tets: [InputCell; 2],
    },
    /// A tetrahedron without volume cannot be dropped without tearing the mesh.
    #[error(
        "cell {tet} has no volume and shares {shared} of its faces with other cells, so dropping it would tear the \
         mesh; collapse it in a mesh editor or remesh this region"
    )]
    InnerFlat {
        /// The cell.
        tet: InputCell,
        /// How many of its faces are shared with other cells.
        shared: u32,
    },
    /// The mesh is to be used as it is, but needs repair.
    #[error(
        "repair level \"none\" leaves the mesh as it is, which is not valid; level \"safe\" repairs it: {repairs}"
    )]
    NeedsRepair {
        /// What has to be done.
        repairs: String,
    },
    /// The weld distance is not a number, infinite or negative.
    #[error("the weld distance must be a finite number that is not negative")]
    WeldDistance,
    /// Points of a cell would become one, or the cell would be flattened or turned inside out.
    #[error(
        "welding at this distance would flatten cell {tet}, turn it inside out or make two of its points one; give a \
         smaller distance"
    )]
    WeldTooFar {
        /// The cell.
        tet: InputCell,
    },
}

impl MeshError {
    /// The error with cells of the input, given the cell of each tetrahedron; its cells are numbers of tetrahedra until then.
    pub(super) fn in_input(self, cell_of: impl Fn(u32) -> InputCell) -> Self {
        let cell = |tet: InputCell| cell_of(tet.number);
        match self {
            Self::MissingPoint { tet, point, points } => Self::MissingPoint { tet: cell(tet), point, points },
            Self::RepeatedVertex { tet } => Self::RepeatedVertex { tet: cell(tet) },
            Self::Flat { tet } => Self::Flat { tet: cell(tet) },
            Self::Inverted { tet } => Self::Inverted { tet: cell(tet) },
            Self::CrowdedFace { face, tets } => {
                Self::CrowdedFace { face, tets: tets.into_iter().map(cell).collect() }
            }
            Self::Folded { tets } => Self::Folded { tets: tets.map(cell) },
            Self::InnerFlat { tet, shared } => Self::InnerFlat { tet: cell(tet), shared },
            Self::WeldTooFar { tet } => Self::WeldTooFar { tet: cell(tet) },
            other => other,
        }
    }
}

/// The first few of `tets`, as text.
fn listed(tets: &[InputCell]) -> String {
    const SHOWN: usize = 8;
    let mut text = tets.iter().take(SHOWN).map(InputCell::to_string).collect::<Vec<_>>().join(", ");
    if tets.len() > SHOWN {
        text.push_str(", ...");
    }
    text
}

fn folded([a, b]: &[InputCell; 2]) -> String {
    if a == b {
        return format!("cell {a} is folded: parts of it lie on the same side of the face they share");
    }
    format!("cells {a} and {b} lie on the same side of the face they share: the mesh is folded there")
}

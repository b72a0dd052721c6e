//! What can be wrong with a mesh, named by the cells of the file it came from.

use super::MAX_TETS;
use thiserror::Error;

/// Why a mesh cannot be used. Cells and points are numbered as in the input, from 0.
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
        tet: u32,
        /// The index it holds.
        point: u32,
        /// How many points there are.
        points: usize,
    },
    /// A tetrahedron has the same vertex twice.
    #[error("cell {tet} has the same vertex twice; remove it")]
    RepeatedVertex {
        /// The cell.
        tet: u32,
    },
    /// A tetrahedron has no volume.
    #[error("cell {tet} has no volume; repair the mesh first")]
    Flat {
        /// The cell.
        tet: u32,
    },
    /// A tetrahedron is turned inside out.
    #[error("cell {tet} is turned inside out; repair the mesh first")]
    Inverted {
        /// The cell.
        tet: u32,
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
        tets: Vec<u32>,
    },
    /// Two tetrahedra lie on the same side of the face they share: the mesh is folded there.
    #[error(
        "cells {} and {} lie on the same side of the face they share: the mesh is folded there; remesh this region",
        .tets[0], .tets[1]
    )]
    Folded {
        /// The cells, in increasing order.
        tets: [u32; 2],
    },
    /// A tetrahedron without volume cannot be dropped without tearing the mesh.
    #[error(
        "cell {tet} has no volume and shares {shared} of its faces with other cells, so dropping it would tear the \
         mesh; collapse it in a mesh editor or remesh this region"
    )]
    InnerFlat {
        /// The cell.
        tet: u32,
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
        tet: u32,
    },
}

/// The first few of `tets`, as text.
fn listed(tets: &[u32]) -> String {
    const SHOWN: usize = 8;
    let mut text = tets.iter().take(SHOWN).map(u32::to_string).collect::<Vec<_>>().join(", ");
    if tets.len() > SHOWN {
        text.push_str(", ...");
    }
    text
}

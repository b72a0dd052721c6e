//! Why a file could not be read: where, what and what to do about it.

use thiserror::Error;

use crate::io::cell_shapes::PYRAMID_14;
use crate::io::cells::is_flat;

/// A file that could not be read.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{file}: {}{reason}", prefix(.place))]
pub struct ReadError {
    /// The file's name as it was given.
    pub file: String,
    /// The section or array; empty when the whole file is meant.
    pub place: String,
    /// What is wrong.
    pub reason: ReadReason,
}

/// What is wrong with a file.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ReadReason {
    /// The file could not be opened or read.
    #[error("{0}")]
    Io(String),
    /// The content is of no known kind.
    #[error(
        "not a format that is known here; give VTK XML (.vtu, .vti, .vts, .vtr), legacy VTK (.vtk){}{}, or raw samples with a \
         .json sidecar",
        if cfg!(feature = "hdf5") { ", VTKHDF, Exodus" } else { "" },
        if cfg!(feature = "formats") { ", Gmsh (.msh), Medit (.mesh), TetGen (.node, .ele), Netgen (.vol), NRRD or MetaImage" } else { "" }
    )]
    UnknownFormat,
    /// The text does not follow the rules of its format.
    #[error("{0}; the file is damaged or not of this format")]
    Syntax(String),
    /// Something that every such file has is not there.
    #[error("{0} is missing; write the file again")]
    Missing(String),
    /// The file ends, or a section ends, before its data is complete.
    #[error(
        "the data ends too early ({needed} needed, {found} left); the file is cut short or its header holds a wrong count"
    )]
    Truncated {
        /// Bytes or numbers that are needed.
        needed: u64,
        /// Bytes or numbers that are there.
        found: u64,
    },
    /// Compressed or encoded data is damaged.
    #[error("the data is damaged: {0}; copy or write the file again")]
    Damaged(String),
    /// Two counts that must agree do not.
    #[error(
        "{what}: expected {expected}, found {found}; the header and the data disagree, write the file again"
    )]
    Count {
        /// What is counted.
        what: String,
        /// How many there should be.
        expected: u64,
        /// How many there are.
        found: u64,
    },
    /// Valid, but not read here.
    #[error("{what} cannot be read here; {remedy}")]
    Unsupported {
        /// What it is.
        what: String,
        /// What to do instead.
        remedy: String,
    },
    /// There are cells that cannot be split into tetrahedra, or none that has a volume: VTK cell type and count of all.
    #[error("{}", of_cells(.0))]
    CellTypes(Vec<(i64, u64)>),
    /// A value or coordinate is infinite or not a number.
    #[error("the value at point {point} is infinite or not a number; replace it or leave this array out")]
    NotFinite {
        /// The point that it belongs to.
        point: u64,
    },
    /// A value of a field at cells is infinite or not a number.
    #[error("the value at cell {cell} is infinite or not a number; replace it or leave this array out")]
    NotFiniteCell {
        /// The cell that it belongs to.
        cell: u64,
    },
    /// A cell refers to a point that does not exist.
    #[error(
        "cell {cell} refers to point {point}, but there are {points} points; the cells and the points do not belong together"
    )]
    MissingPoint {
        /// The cell.
        cell: u64,
        /// The index it holds.
        point: i64,
        /// How many points there are.
        points: u64,
    },
    /// More than this program handles.
    #[error("more than {limit} {what}; split the data")]
    TooLarge {
        /// What is counted.
        what: String,
        /// The largest number allowed.
        limit: u64,
    },
}

impl ReadReason {
    /// The same of a field at cells: what was a point is a cell.
    pub(super) fn at_cells(self) -> Self {
        match self {
            Self::NotFinite { point } => Self::NotFiniteCell { cell: point },
            reason => reason,
        }
    }
}

/// A place in front of a reason; nothing for the whole file.
fn prefix(place: &str) -> String {
    if place.is_empty() { String::new() } else { format!("{place}: ") }
}

/// Gives a reason its place.
pub(super) trait At<T> {
    /// Turns the reason into an error at `place`; [`super::read_bytes`] adds the file.
    fn at(self, place: impl FnOnce() -> String) -> Result<T, ReadError>;
}

impl<T> At<T> for Result<T, ReadReason> {
    fn at(self, place: impl FnOnce() -> String) -> Result<T, ReadError> {
        self.map_err(|reason| ReadError { file: String::new(), place: place(), reason })
    }
}

/// "1 hexahedron", "3 wedges", "2 cells of type 99".
fn named_count(kind: i64, count: u64) -> String {
    match names(kind) {
        Some((one, many)) => format!("{count} {}", if count == 1 { one } else { many }),
        None => format!("{count} {} of type {kind}", if count == 1 { "cell" } else { "cells" }),
    }
}

/// Why cells of these types, and so many, are refused.
fn of_cells(counts: &[(i64, u64)]) -> String {
    let total: u64 = counts.iter().map(|(_, count)| count).sum();
    let list: Vec<String> = counts.iter().map(|&(kind, count)| named_count(kind, count)).collect();
    let list = list.join(", ");
    if counts.iter().all(|(kind, _)| is_flat(*kind)) {
        return format!(
            "a mesh of surfaces or lines ({list}), which has no volume; fill it with tetrahedra first, with Gmsh, TetGen or fTetWild"
        );
    }
    format!(
        "{total} cells: {list}; tetrahedra, hexahedra, voxels, wedges, pyramids and prisms are read, also quadratic ones, and what \
         has no volume is left out beside them: convert the others (in ParaView: Tetrahedralize)"
    )
}

/// What a cell of this type is called.
pub(super) fn cell_name(kind: i64) -> String {
    names(kind).map_or_else(|| format!("cell of type {kind}"), |(one, _)| one.to_owned())
}

/// What one cell of this type, by VTK's number, is called, and several.
fn names(kind: i64) -> Option<(&'static str, &'static str)> {
    Some(match kind {
        0 => ("empty cell", "empty cells"),
        1 => ("vertex", "vertices"),
        2 => ("poly-vertex", "poly-vertices"),
        3 => ("line", "lines"),
        4 => ("poly-line", "poly-lines"),
        5 => ("triangle", "triangles"),
        6 => ("triangle strip", "triangle strips"),
        7 => ("polygon", "polygons"),
        8 => ("pixel", "pixels"),
        9 => ("quad", "quads"),
        10 => ("tetrahedron", "tetrahedra"),
        11 => ("voxel", "voxels"),
        12 => ("hexahedron", "hexahedra"),
        13 => ("wedge", "wedges"),
        14 => ("pyramid", "pyramids"),
        15 => ("pentagonal prism", "pentagonal prisms"),
        16 => ("hexagonal prism", "hexagonal prisms"),
        21 => ("quadratic edge", "quadratic edges"),
        22 => ("quadratic triangle", "quadratic triangles"),
        23 => ("quadratic quad", "quadratic quads"),
        24 => ("quadratic tetrahedron", "quadratic tetrahedra"),
        25 => ("quadratic hexahedron", "quadratic hexahedra"),
        26 => ("quadratic wedge", "quadratic wedges"),
        27 => ("quadratic pyramid", "quadratic pyramids"),
        29 => ("triquadratic hexahedron", "triquadratic hexahedra"),
        32 => ("biquadratic wedge", "biquadratic wedges"),
        42 => ("polyhedron", "polyhedra"),
        71 => ("Lagrange tetrahedron", "Lagrange tetrahedra"),
        72 => ("Lagrange hexahedron", "Lagrange hexahedra"),
        78 => ("Bezier tetrahedron", "Bezier tetrahedra"),
        PYRAMID_14 => ("quadratic pyramid of 14 points", "quadratic pyramids of 14 points"),
        _ => return None,
    })
}

//! Why a file could not be read: where, what and what to do about it.

use thiserror::Error;

use crate::cell_shapes::PYRAMID_14;
use crate::cell_types::{ANY_ORDER, GHOST, HIDDEN, is_flat};

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
    /// A file that this one needs is not among those that were given.
    #[error("it needs the file \"{0}\", which is not among those that were given; give them together")]
    NotGiven(String),
    /// Several of the files that were given may be the one that this one needs.
    #[error(
        "it needs the file \"{0}\", of which several were given; give them in their folders, or one of them"
    )]
    SeveralGiven(String),
    /// The content is of no known kind.
    #[error(
        "not a format that is known here; give VTK XML (.vtu, .vti, .vts, .vtr), legacy VTK (.vtk){}, Gmsh (.msh), Medit (.mesh), \
         TetGen (.node, .ele), Netgen (.vol), NRRD or MetaImage{}, or raw samples with a .json sidecar",
        if cfg!(feature = "hdf5") { ", VTKHDF, Exodus" } else { "" },
        if cfg!(feature = "zarr") { ", a folder of Zarr (.zarr)" } else { "" }
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
    /// There are cells that cannot be split into tetrahedra: VTK cell type and count of all.
    #[error("{}", of_cells(.0))]
    CellTypes(Vec<(i64, u64)>),
    /// Nothing but what has no volume, in words.
    #[error("{}", no_volume(.0))]
    NoVolume(String),
    /// A value or coordinate is infinite or not a number, at a point that cells use.
    #[error("{}", not_finite(.array, "point", *.point))]
    NotFinite {
        /// The array; empty for coordinates.
        array: String,
        /// The point that it belongs to.
        point: u64,
    },
    /// A value of a field at cells is infinite or not a number.
    #[error("{}", not_finite(.array, "cell", *.cell))]
    NotFiniteCell {
        /// The array.
        array: String,
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
    /// A polyhedron that is no cell, or that no point in it can be joined to all faces of.
    #[error(
        "cell {cell}, a polyhedron, cannot be split into tetrahedra: {fault}; correct it, or leave it out"
    )]
    Polyhedron {
        /// The cell.
        cell: u64,
        /// What is wrong with it.
        fault: String,
    },
    /// Reading takes more memory than is allowed.
    #[error("reading it takes more memory than the {} that are allowed; allow more, or read fewer fields", mebibytes(*.limit))]
    Memory {
        /// How many bytes are allowed.
        limit: u64,
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
    /// That something is valid but not read here, and what to do instead.
    pub(crate) fn unsupported(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Unsupported { what: what.into(), remedy: remedy.into() }
    }

    /// The same of the cell that has another number elsewhere.
    pub(crate) fn with_cell(mut self, number: impl Fn(u64) -> u64) -> Self {
        if let Self::MissingPoint { cell, .. }
        | Self::Polyhedron { cell, .. }
        | Self::NotFiniteCell { cell, .. } = &mut self
        {
            *cell = number(*cell);
        }
        self
    }
}

/// Checks that there are as many of something as there should be.
pub(super) fn expect_count(
    what: impl Into<String>,
    expected: impl TryInto<u64>,
    found: impl TryInto<u64>,
) -> Result<(), ReadReason> {
    // What is counted is in memory, or a number of a file.
    let [expected, found] = [expected.try_into().unwrap_or(u64::MAX), found.try_into().unwrap_or(u64::MAX)];
    if expected == found { Ok(()) } else { Err(ReadReason::Count { what: what.into(), expected, found }) }
}

/// What of a word is put into messages.
pub(super) fn shown(word: &str) -> String {
    word.chars().take(24).collect()
}

/// Bytes in words.
fn mebibytes(bytes: u64) -> String {
    if bytes < 10 << 20 { format!("{bytes} bytes") } else { format!("{} MiB", bytes >> 20) }
}

fn not_finite(array: &str, owner: &str, number: u64) -> String {
    if array.is_empty() {
        return format!("{owner} {number} has a coordinate that is infinite or not a number; replace it");
    }
    format!(
        "the value of \"{array}\" at {owner} {number} is infinite or not a number; replace it, or name other fields to read"
    )
}

/// A place in front of a reason; nothing for the whole file.
fn prefix(place: &str) -> String {
    if place.is_empty() { String::new() } else { format!("{place}: ") }
}

/// Gives a reason its place.
pub(super) trait At<T> {
    /// Turns the reason into an error at `place`; [`super::read_bytes`] adds the file.
    fn at(self, place: impl FnOnce() -> String) -> Result<T, ReadError>;

    /// Turns the reason into an error of the whole file called `name`.
    fn in_file(self, name: &str) -> Result<T, ReadError>;
}

impl<T> At<T> for Result<T, ReadReason> {
    fn at(self, place: impl FnOnce() -> String) -> Result<T, ReadError> {
        self.map_err(|reason| ReadError { file: String::new(), place: place(), reason })
    }

    fn in_file(self, name: &str) -> Result<T, ReadError> {
        self.at(String::new).map_err(|error| in_file(error, name))
    }
}

/// Why a file is not read by parts of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Stop {
    /// It has to be read as a whole, for this reason.
    Whole(&'static str),
    /// It cannot be read.
    Read(ReadError),
}

impl Stop {
    /// The error where a file that could be read by parts was changed since.
    pub fn into_changed(self) -> ReadError {
        match self {
            Self::Read(error) => error,
            Self::Whole(why) => {
                let reason = ReadReason::Io(format!("it has changed: {why}"));
                ReadError { file: String::new(), place: String::new(), reason }
            }
        }
    }
}

impl From<ReadReason> for Stop {
    fn from(reason: ReadReason) -> Self {
        Self::Read(ReadError { file: String::new(), place: String::new(), reason })
    }
}

impl From<ReadError> for Stop {
    fn from(error: ReadError) -> Self {
        Self::Read(error)
    }
}

impl Stop {
    /// The same at `place`, if nothing else was said of where it is.
    pub fn at(self, place: impl FnOnce() -> String) -> Self {
        match self {
            Self::Read(ReadError { file, place: none, reason }) if none.is_empty() => {
                Self::Read(ReadError { file, place: place(), reason })
            }
            other => other,
        }
    }
}

/// "1 hexahedron", "3 wedges", "2 cells of type 99", "5 Lagrange tetrahedra of 20 points".
fn named_count(kind: i64, count: u64) -> String {
    let (of, points) = match kind.checked_div(ANY_ORDER) {
        Some(of) if of > 1 => (of, format!(" of {} points", kind % ANY_ORDER)),
        _ => (kind, String::new()),
    };
    match names(of) {
        Some((one, many)) => format!("{count} {}{points}", if count == 1 { one } else { many }),
        None => format!("{count} {} of type {of}{points}", if count == 1 { "cell" } else { "cells" }),
    }
}

/// Why cells of these types, and so many, are refused.
fn of_cells(counts: &[(i64, u64)]) -> String {
    let total: u64 = counts.iter().map(|(_, count)| count).sum();
    let list: Vec<String> = counts.iter().map(|&(kind, count)| named_count(kind, count)).collect();
    let list = list.join(", ");
    if counts.iter().all(|(kind, _)| is_flat(*kind)) {
        return no_volume(&list);
    }
    format!(
        "{total} cells: {list}; tetrahedra, hexahedra, voxels, wedges, pyramids, prisms and polyhedra are read, also quadratic ones and Lagrange \
         cells of the first two orders, and what has no volume is left out beside them: convert the others (in ParaView: \
         Tetrahedralize), or save them with an order of at most 2"
    )
}

fn no_volume(what: &str) -> String {
    format!(
        "a mesh of surfaces or lines ({what}), which has no volume; fill it with tetrahedra first, with Gmsh, TetGen or fTetWild"
    )
}

/// What a cell of this type is called.
pub(super) fn cell_name(kind: i64) -> String {
    names(kind).map_or_else(|| format!("cell of type {kind}"), |(one, _)| one.to_owned())
}

/// What one cell of this type, by VTK's number, is called, and several.
pub(super) fn names(kind: i64) -> Option<(&'static str, &'static str)> {
    Some(match kind {
        HIDDEN => ("hidden cell", "hidden cells"),
        GHOST => ("ghost cell", "ghost cells"),
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
        28 => ("biquadratic quad", "biquadratic quads"),
        29 => ("triquadratic hexahedron", "triquadratic hexahedra"),
        30 => ("quadratic-linear quad", "quadratic-linear quads"),
        31 => ("quadratic-linear wedge", "quadratic-linear wedges"),
        32 => ("biquadratic wedge", "biquadratic wedges"),
        33 => ("biquadratic hexahedron", "biquadratic hexahedra"),
        34 => ("biquadratic triangle", "biquadratic triangles"),
        35 => ("cubic line", "cubic lines"),
        36 => ("quadratic polygon", "quadratic polygons"),
        37 => ("triquadratic pyramid", "triquadratic pyramids"),
        41 => ("convex point set", "convex point sets"),
        42 => ("polyhedron", "polyhedra"),
        64 => ("higher-order tetrahedron", "higher-order tetrahedra"),
        65 => ("higher-order wedge", "higher-order wedges"),
        66 => ("higher-order pyramid", "higher-order pyramids"),
        67 => ("higher-order hexahedron", "higher-order hexahedra"),
        68 => ("Lagrange curve", "Lagrange curves"),
        69 => ("Lagrange triangle", "Lagrange triangles"),
        70 => ("Lagrange quad", "Lagrange quads"),
        71 => ("Lagrange tetrahedron", "Lagrange tetrahedra"),
        72 => ("Lagrange hexahedron", "Lagrange hexahedra"),
        73 => ("Lagrange wedge", "Lagrange wedges"),
        74 => ("Lagrange pyramid", "Lagrange pyramids"),
        75 => ("Bezier curve", "Bezier curves"),
        76 => ("Bezier triangle", "Bezier triangles"),
        77 => ("Bezier quad", "Bezier quads"),
        78 => ("Bezier tetrahedron", "Bezier tetrahedra"),
        79 => ("Bezier hexahedron", "Bezier hexahedra"),
        80 => ("Bezier wedge", "Bezier wedges"),
        81 => ("Bezier pyramid", "Bezier pyramids"),
        PYRAMID_14 => ("quadratic pyramid of 14 points", "quadratic pyramids of 14 points"),
        _ => return None,
    })
}

impl tetralod::Coded for ReadError {
    fn code(&self) -> &'static str {
        match self.reason {
            ReadReason::Io(_) | ReadReason::NotGiven(_) | ReadReason::SeveralGiven(_) => "bad-source",
            ReadReason::UnknownFormat => "unknown-format",
            ReadReason::Unsupported { .. } | ReadReason::CellTypes(_) | ReadReason::NoVolume(_) => {
                "unsupported"
            }
            ReadReason::Truncated { .. } => "truncated",
            ReadReason::TooLarge { .. } => "limit",
            ReadReason::Memory { .. } => "memory",
            ReadReason::NotFinite { .. }
            | ReadReason::NotFiniteCell { .. }
            | ReadReason::Polyhedron { .. } => "bad-mesh",
            ReadReason::Syntax(_)
            | ReadReason::Missing(_)
            | ReadReason::Damaged(_)
            | ReadReason::Count { .. }
            | ReadReason::MissingPoint { .. } => "corrupt",
        }
    }
}

/// Names the file of an error that does not name another one.
pub(super) fn in_file(error: ReadError, name: &str) -> ReadError {
    if error.file.is_empty() { ReadError { file: name.to_owned(), ..error } } else { error }
}

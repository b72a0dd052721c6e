//! How an MT is built, and which kinds come out.

use super::BuildConfig;
use super::BuildError;
use crate::mt::MtKind;

/// How an MT is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Bottom-up: edges are collapsed to their midpoints, cheapest first. The updates are vertex splits.
    Collapse,
    /// Top-down: the vertex of largest error is inserted next. The reference mesh is a triangulation of the points.
    Insert,
    /// Bottom-up: vertices are removed, cheapest first. The reference mesh is the input.
    Decimate,
}

/// What decides on the tetrahedra around a vertex that is removed or inserted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Criterion {
    /// They are Delaunay: no vertex lies in the circumsphere of one.
    Delaunay,
    /// The vertex is moved onto a neighbour.
    HalfEdge,
}

/// What an MT is built for, where that makes a difference: with [`Method::Decimate`].
///
/// Vertices go in levels of error, and within a level in rounds of removals that do not depend on each other. Wide levels
/// leave more freedom to remove first what depends on little. Then less has to be refined beside a region for the region's
/// sake; but vertices go that should have stayed a little longer, so that meshes of one error everywhere are larger. For the
/// generated bucky at 33³ points, by half-edges:
///
/// | | an octant at error 0, tetrahedra of all | a box of 1/64 of the volume, updates of all | 0.1 / 1 / 5 % everywhere, tetrahedra |
/// |---|--:|--:|--:|
/// | uniform | 42.1 % | 24.1 % | 97 120 / 49 770 / 18 712 |
/// | regions | 40.2 % | 21.5 % | 99 259 / 51 996 / 18 928 |
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Purpose {
    /// Meshes of one error everywhere: levels are 2^¼ wide.
    #[default]
    Uniform,
    /// Regions at full detail: levels are √2 wide.
    Regions,
}

impl Purpose {
    /// All purposes.
    pub const ALL: [Self; 2] = [Self::Uniform, Self::Regions];

    /// The purpose in one word, as options have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Regions => "regions",
        }
    }
}

impl Method {
    /// All methods.
    pub const ALL: [Self; 3] = [Self::Collapse, Self::Insert, Self::Decimate];

    /// The method in one word, as options and files have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Collapse => "collapse",
            Self::Insert => "insert",
            Self::Decimate => "decimate",
        }
    }

    /// What is used for a kind of MT if nothing else is asked for.
    pub fn usual(kind: MtKind) -> Self {
        match kind {
            MtKind::Edge | MtKind::Explicit => Self::Collapse,
            MtKind::Vertex | MtKind::HalfEdge => Self::Decimate,
        }
    }

    /// Whether the reference mesh is the input, tetrahedron for tetrahedron, and not only a mesh of its points.
    pub fn keeps_the_mesh(self) -> bool {
        self != Self::Insert
    }
}

impl Criterion {
    /// All criteria.
    pub const ALL: [Self; 2] = [Self::Delaunay, Self::HalfEdge];

    /// The criterion in one word, as options and files have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Delaunay => "delaunay",
            Self::HalfEdge => "half-edge",
        }
    }

    /// What is used with a method if nothing else is asked for.
    pub fn usual(method: Method) -> Self {
        match method {
            Method::Insert => Self::Delaunay,
            Method::Collapse | Method::Decimate => Self::HalfEdge,
        }
    }
}

impl BuildConfig {
    /// Whether kind, method and criterion go together: collapses make edge-based MTs, insertion and decimation
    /// vertex-based ones, and all make explicit ones; insertion is always by the Delaunay criterion.
    ///
    /// # Errors
    /// [`BuildError::Combination`], with what does go together.
    pub fn check(&self) -> Result<(), BuildError> {
        let refuse = |which, instead| Err(BuildError::Combination { which, instead });
        match (self.kind, self.method) {
            (MtKind::Edge, Method::Insert | Method::Decimate) => refuse(
                [
                    "kind edge",
                    if self.method == Method::Insert { "method insert" } else { "method decimate" },
                ],
                "MTs of kind edge are built by method collapse; methods insert and decimate build kinds vertex and \
                 explicit",
            ),
            (MtKind::Vertex, Method::Collapse) => refuse(
                ["kind vertex", "method collapse"],
                "MTs of kind vertex are built by methods insert and decimate; method collapse builds kinds edge and \
                 explicit",
            ),
            (MtKind::HalfEdge, Method::Collapse | Method::Insert) => refuse(
                [
                    "kind half-edge",
                    if self.method == Method::Insert { "method insert" } else { "method collapse" },
                ],
                "MTs of kind half-edge are built by method decimate with criterion half-edge",
            ),
            (MtKind::HalfEdge, Method::Decimate) if self.criterion != Criterion::HalfEdge => refuse(
                ["kind half-edge", "criterion delaunay"],
                "MTs of kind half-edge are built with criterion half-edge; criterion delaunay builds kinds vertex and \
                 explicit",
            ),
            (_, Method::Insert) if self.criterion != Criterion::Delaunay => refuse(
                ["method insert", "criterion half-edge"],
                "method insert has criterion delaunay; criterion half-edge goes with method decimate",
            ),
            (_, Method::Collapse | Method::Decimate) if self.tet_errors => refuse(
                [
                    "tet errors",
                    if self.method == Method::Collapse { "method collapse" } else { "method decimate" },
                ],
                "errors of tetrahedra by themselves go with method insert; by the other methods they hardly differ from those \
                 of updates",
            ),
            _ => Ok(()),
        }
    }
}

//! How an MT is built, and which kinds come out.

use super::BuildError;
use tetralod::mt::MtKind;

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
pub enum BuildCriterion {
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

    fn described(self) -> String {
        format!("method {}", self.name())
    }

    /// Whether the reference mesh is the input, tetrahedron for tetrahedron, and not only a mesh of its points.
    pub fn keeps_the_mesh(self) -> bool {
        self != Self::Insert
    }
}

impl BuildCriterion {
    /// All criteria.
    pub const ALL: [Self; 2] = [Self::Delaunay, Self::HalfEdge];

    /// The criterion in one word, as options and files have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Delaunay => "delaunay",
            Self::HalfEdge => "half-edge",
        }
    }

    /// The default criterion of a method.
    pub fn default_for(method: Method) -> Self {
        match method {
            Method::Insert => Self::Delaunay,
            Method::Collapse | Method::Decimate => Self::HalfEdge,
        }
    }
}

/// The kind of MT and how it is built: exactly what goes together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Construction {
    /// An edge-based MT, by [`Method::Collapse`].
    Edge,
    /// A half-edge MT, by [`Method::Decimate`] with [`BuildCriterion::HalfEdge`].
    HalfEdge {
        /// What it is built for.
        purpose: Purpose,
    },
    /// A vertex-based MT.
    Vertex(VertexMethod),
}

/// How the updates of a vertex-based MT are built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexMethod {
    /// [`Method::Insert`], always by [`BuildCriterion::Delaunay`].
    Insert {
        /// Whether tetrahedra have errors of their own, two bits each (see
        /// [`quarterings`](tetralod::mt::ApplyUpdates::quarterings)): requests take fewer tetrahedra then, but each is
        /// answered from the base mesh.
        tet_errors: bool,
    },
    /// [`Method::Decimate`].
    Decimate {
        /// How a vertex is removed.
        criterion: BuildCriterion,
        /// What the MT is built for.
        purpose: Purpose,
    },
}

/// What a user has chosen of a [`Construction`]; the rest follows from it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ConstructionChoice {
    /// The kind of MT.
    pub kind: Option<MtKind>,
    /// How it is built.
    pub method: Option<Method>,
    /// By what criterion.
    pub criterion: Option<BuildCriterion>,
    /// What for.
    pub purpose: Option<Purpose>,
    /// Whether tetrahedra have errors of their own.
    pub tet_errors: bool,
}

impl ConstructionChoice {
    /// The kind of MT that goes with the choice.
    pub fn kind(&self) -> MtKind {
        let by_others = match (self.method, self.criterion) {
            (Some(Method::Collapse), _) => MtKind::Edge,
            (Some(Method::Insert), _) | (_, Some(BuildCriterion::Delaunay)) => MtKind::Vertex,
            (Some(Method::Decimate), _) | (_, Some(BuildCriterion::HalfEdge)) => MtKind::HalfEdge,
            (None, None) if self.purpose.is_some() => MtKind::HalfEdge,
            (None, None) if self.tet_errors => MtKind::Vertex,
            (None, None) => MtKind::HalfEdge,
        };
        self.kind.unwrap_or(by_others)
    }

    /// The method that goes with the choice.
    pub fn method(&self) -> Method {
        let default = Construction::default_for(self.kind()).method();
        self.method.unwrap_or(if self.tet_errors { Method::Insert } else { default })
    }

    /// The construction that goes with the choice.
    ///
    /// # Errors
    /// [`BuildError::Combination`] if what was chosen does not go together.
    pub fn construction(&self) -> Result<Construction, BuildError> {
        let method = self.method();
        let criterion = self.criterion.unwrap_or(BuildCriterion::default_for(method));
        let mut construction = Construction::new(self.kind(), method, criterion)?;
        if self.tet_errors {
            construction = construction.with_tet_errors()?;
        }
        if method == Method::Collapse && self.criterion.is_some() {
            return Err(BuildError::Combination {
                which: ["a criterion".to_owned(), method.described()],
                instead: "a criterion goes with methods insert and decimate",
            });
        }
        self.purpose.map_or(Ok(construction), |purpose| construction.with_purpose(purpose))
    }
}

impl Construction {
    /// The keys under which [`Construction::metadata`] says how a file was built.
    pub const METADATA_KEYS: [&str; 2] = ["method", "criterion"];

    /// The entries of a file's metadata that say how it was built.
    pub fn metadata(self) -> Vec<(String, String)> {
        let names = [Some(self.method().name()), self.criterion().map(BuildCriterion::name)];
        let entry = |(key, name): (&str, Option<&str>)| Some((key.to_owned(), name?.to_owned()));
        Self::METADATA_KEYS.into_iter().zip(names).filter_map(entry).collect()
    }

    /// The default construction of a kind of MT.
    pub fn default_for(kind: MtKind) -> Self {
        let purpose = Purpose::default();
        match kind {
            MtKind::Edge => Self::Edge,
            MtKind::HalfEdge => Self::HalfEdge { purpose },
            MtKind::Vertex => {
                Self::Vertex(VertexMethod::Decimate { criterion: BuildCriterion::HalfEdge, purpose })
            }
        }
    }

    /// An MT of this kind by this method and criterion; [`Method::Collapse`] has its own criterion.
    ///
    /// # Errors
    /// [`BuildError::Combination`], with what does go together.
    pub fn new(kind: MtKind, method: Method, criterion: BuildCriterion) -> Result<Self, BuildError> {
        let purpose = Purpose::default();
        let by_vertices = match (method, criterion) {
            (Method::Decimate, criterion) => Some(VertexMethod::Decimate { criterion, purpose }),
            (Method::Insert, BuildCriterion::Delaunay) => Some(VertexMethod::Insert { tet_errors: false }),
            _ => None,
        };
        match (kind, method, by_vertices) {
            (MtKind::Edge, Method::Collapse, _) => Ok(Self::Edge),
            (MtKind::HalfEdge, Method::Decimate, _) if criterion == BuildCriterion::HalfEdge => {
                Ok(Self::HalfEdge { purpose })
            }
            (MtKind::Vertex, _, Some(method)) => Ok(Self::Vertex(method)),
            _ => Err(contradiction(kind, method, criterion)),
        }
    }

    /// The construction for a purpose.
    ///
    /// # Errors
    /// [`BuildError::Combination`] if the method is not [`Method::Decimate`].
    pub fn with_purpose(self, purpose: Purpose) -> Result<Self, BuildError> {
        match self {
            Self::HalfEdge { .. } => Ok(Self::HalfEdge { purpose }),
            Self::Vertex(VertexMethod::Decimate { criterion, .. }) => {
                Ok(Self::Vertex(VertexMethod::Decimate { criterion, purpose }))
            }
            _ => Err(BuildError::Combination {
                which: ["a purpose".to_owned(), self.method().described()],
                instead: "only method decimate builds for a purpose",
            }),
        }
    }

    /// The construction with errors that tetrahedra have of their own.
    ///
    /// # Errors
    /// [`BuildError::Combination`] if the method is not [`Method::Insert`].
    pub fn with_tet_errors(self) -> Result<Self, BuildError> {
        let method = VertexMethod::Insert { tet_errors: true };
        match self {
            Self::Vertex(VertexMethod::Insert { .. }) => Ok(Self::Vertex(method)),
            _ => Err(BuildError::Combination {
                which: ["tet errors".to_owned(), self.method().described()],
                instead: "errors of tetrahedra by themselves go with method insert; by the other methods they hardly \
                          differ from those of updates",
            }),
        }
    }

    /// The kind of MT.
    pub fn kind(self) -> MtKind {
        match self {
            Self::Edge => MtKind::Edge,
            Self::HalfEdge { .. } => MtKind::HalfEdge,
            Self::Vertex(_) => MtKind::Vertex,
        }
    }

    /// How it is built.
    pub fn method(self) -> Method {
        match self {
            Self::Edge => Method::Collapse,
            Self::HalfEdge { .. } => Method::Decimate,
            Self::Vertex(method) => match method {
                VertexMethod::Insert { .. } => Method::Insert,
                VertexMethod::Decimate { .. } => Method::Decimate,
            },
        }
    }

    /// By what criterion vertices are removed or inserted; none for [`Method::Collapse`].
    pub fn criterion(self) -> Option<BuildCriterion> {
        match self {
            Self::Edge => None,
            Self::HalfEdge { .. } => Some(BuildCriterion::HalfEdge),
            Self::Vertex(method) => Some(match method {
                VertexMethod::Insert { .. } => BuildCriterion::Delaunay,
                VertexMethod::Decimate { criterion, .. } => criterion,
            }),
        }
    }
}

/// Why kind, method and criterion do not go together.
fn contradiction(kind: MtKind, method: Method, criterion: BuildCriterion) -> BuildError {
    let of_kind = format!("kind {}", kind.name());
    let by_criterion = format!("criterion {}", criterion.name());
    let (which, instead) = match (kind, method) {
        (MtKind::Edge, _) => (
            [of_kind, method.described()],
            "MTs of kind edge are built by method collapse; methods insert and decimate build kind vertex",
        ),
        (MtKind::Vertex, Method::Collapse) => (
            [of_kind, method.described()],
            "MTs of kind vertex are built by methods insert and decimate; method collapse builds kind edge",
        ),
        (MtKind::HalfEdge, Method::Collapse | Method::Insert) => (
            [of_kind, method.described()],
            "MTs of kind half-edge are built by method decimate with criterion half-edge",
        ),
        (MtKind::HalfEdge, Method::Decimate) => (
            [of_kind, by_criterion],
            "MTs of kind half-edge are built with criterion half-edge; criterion delaunay builds kind vertex",
        ),
        (MtKind::Vertex, _) => (
            [method.described(), by_criterion],
            "method insert has criterion delaunay; criterion half-edge goes with method decimate",
        ),
    };
    BuildError::Combination { which, instead }
}

//! From a tetrahedral mesh to a Multi-Tessellation, offline.
//!
//! [`build`] makes an MT of any kind by any method that goes with it: see [`Method`]. The default,
//! [`Method::Decimate`], collapses vertices onto neighbours in rounds of removals that do not depend on each other; the
//! removals in reverse are the updates of a half-edge MT. [`edge_mt`] is behind edge-based MTs: it collapses edges to
//! their midpoints, cheapest first, until nothing can be collapsed any more; the collapses in reverse are the updates
//! of an edge-based MT [§2.1]. The cost of a collapse is the largest error it leads to, evaluated exactly at every
//! reference vertex that its star covers. The model is the greedy scheme of Cignoni, Costanza, Montani, Rocchini,
//! Scopigno (*Simplification of tetrahedral meshes with accurate error evaluation*, 2000): a cheap prediction orders
//! the candidates, the exact error decides.
//!
//! Guarantees:
//! - **Errors** bound the deviation from the input's field at every reference vertex, where the input has it, for all consistent
//!   sets, and grow along the partial order towards the base mesh. (By insertion: where the lattice has put it.)
//! - **Topology** never changes: the link condition is checked inside and on the boundary, and vertices at which the
//!   input is not a manifold stay where they are.
//! - **Geometry**: every tetrahedron is positive on the lattice, exactly. Parts of the boundary that are flat, but for what
//!   rounding to the lattice has moved their points, stay flat, and the creases and corners where such parts meet at 60° or more stay
//!   straight and where they are; where the boundary moves, that is counted into the error.
//! - **Determinism**: the same input gives the same MT on every platform.
//!
//! Not guaranteed: distant parts of a curved boundary may come to overlap where they were nearer to each other than the
//! error allows the boundary to move.

#![warn(missing_docs)]
#![deny(rustdoc::broken_intra_doc_links)]

mod change;
mod collapse;
mod decimate;
mod error;
mod geometry;
mod insert;
mod lattice;
pub mod measure;
mod memory;
mod method;
mod order;
pub mod parts;
mod remedy;
mod restrict;
pub mod verify;
mod vertex;

use decimate::Decimated;
use decimate::collapses::Collapses;

pub use collapse::edge_mt;
pub use geometry::delaunay::delaunay;
pub use memory::memory_needed;
pub use memory::{memory_needed_in_parts, memory_needed_in_pieces};
pub use method::{BuildCriterion, Construction, ConstructionChoice, Method, Purpose, VertexMethod};
pub use remedy::Remedy;

use serde::Serialize;
use std::borrow::Cow;
use std::ops::ControlFlow;
use tetralod::mesh::{InputCell, MeshError, TetMesh};
use tetralod::mt::{
    ConvertError, Exact, ExplicitMt, Mt, MtKind, MultiTessellation, UpdateError, UpdateId, UpdatePages,
    VertexId,
};
use thiserror::Error;

/// How to build.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildConfig {
    /// The kind of MT and how it is built.
    pub construction: Construction,
    /// Names of the fields to keep, in this order; a vector's name means its components. Of a time series all steps are
    /// kept. The first field of the mesh if empty.
    pub fields: Vec<String>,
    /// Keep all fields but the lengths of vectors, which follow from their components; those that are named come first.
    pub all_fields: bool,
    /// Bits of the position lattice, 1 to 30. If neither these nor a tolerance are given: 16 where that keeps every cell
    /// positive, else as few as do, and two more to spare. No side of the domain is longer than 2^bits steps.
    pub position_bits: Option<u32>,
    /// How far the lattice may move a point, in model units: as few bits are taken as keep within it, and every cell
    /// positive.
    pub position_tolerance: Option<f64>,
    /// How finely fields are kept. Fields of integers whose range fits 24 bits are exact unless they are named in
    /// [`BuildConfig::precision_of`].
    pub field_precision: FieldPrecision,
    /// How finely fields, or vectors, of these names are kept.
    pub precision_of: Vec<(String, FieldPrecision)>,
    /// Names of fields, or vectors, of which the exact values are kept as well.
    pub lossless: Vec<String>,
    /// Keep the exact values of all fields.
    pub all_lossless: bool,
    /// The displacement of the boundary that counts as much as an error of the field's whole range, as a fraction
    /// of the domain's diagonal; not negative. With 0.2, an error of 1 % allows the boundary to move by 0.2 % of the
    /// diagonal.
    pub displacement: f64,
    /// The same in lengths of the shortest edge of the reference mesh at each place, where that is less; infinite where cells do not
    /// matter. With 10, an error of 1 % allows the boundary to move by a tenth of such an edge.
    pub displacement_edges: f64,
    /// No update makes a cell with a smaller dihedral angle than so many degrees, 0 to 70, unless one of the cells that it takes the
    /// place of had a smaller one still. Not by [`Method::Insert`].
    pub min_dihedral: Option<f64>,
    /// From so many degrees on, 1 to 90, two flat parts of the boundary meet at a crease that stays where it is; 60 if none.
    /// Not by [`Method::Insert`].
    pub feature_angle: Option<f64>,
    /// Names of labels, integers at cells or points: the surfaces between cells of different labels stay the sets of points that they are.
    /// A label at points is that of a cell, the least one at its corners. Only by [`Method::Decimate`] with [`BuildCriterion::HalfEdge`].
    pub preserve: Vec<String>,
    /// How far, in model units, curved parts of these surfaces may move to have fewer triangles; 0 if they stay. Where a surface ends, at
    /// the boundary or at a third region, it stays.
    pub preserve_within: f64,
    /// Places of points of the mesh that stay in all meshes, in model units. Not by [`Method::Insert`].
    pub keep_points: Vec<[f64; 3]>,
    /// log2 of the updates that pages of the MT, and so the blocks of its file, are going to have, 4 to 16: within a page of an
    /// edge-based MT updates are numbered so that they take few bits.
    pub block_bits: u32,
}

impl Default for BuildConfig {
    /// The default configuration of the default kind, [`MtKind::HalfEdge`].
    fn default() -> Self {
        Self::of(MtKind::HalfEdge)
    }
}

impl BuildConfig {
    /// The default configuration for a kind of MT.
    pub fn of(kind: MtKind) -> Self {
        Self {
            construction: Construction::default_for(kind),
            fields: Vec::new(),
            all_fields: false,
            position_bits: None,
            position_tolerance: None,
            field_precision: FieldPrecision::Bits(16),
            precision_of: Vec::new(),
            lossless: Vec::new(),
            all_lossless: false,
            displacement: 0.2,
            displacement_edges: 10.0,
            min_dihedral: None,
            feature_angle: None,
            preserve: Vec::new(),
            preserve_within: 0.0,
            keep_points: Vec::new(),
            block_bits: kind.usual_block_bits(),
        }
    }
}

/// The precision of a field's values; the loss remains as an error at full resolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FieldPrecision {
    /// By a lattice of so many bits, 1 to 24.
    Bits(u32),
    /// By as few bits as keep each value within so many units of the field.
    Units(f64),
    /// By as few bits as keep each value within this fraction of the field's range.
    Fraction(f64),
}

/// The progress of the work; sent now and then, so that a caller can show it and stop the work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildProgress {
    /// The current stage of the work.
    pub stage: &'static str,
    /// How much of it is done.
    pub done: u64,
    /// The whole work, as far as it is known.
    pub total: u64,
    /// Tetrahedra of the mesh as it is now; none in stages that do not change it.
    pub tetrahedra: Option<u32>,
}

/// Receives progress; [`ControlFlow::Break`] stops the work.
pub type OnProgress<'a> = &'a mut dyn FnMut(BuildProgress) -> ControlFlow<()>;

/// An MT, and facts about its construction.
#[derive(Clone, Debug)]
pub struct BuildResult<M = Mt> {
    /// The MT, complete and applied once from base to reference mesh.
    pub mt: M,
    /// Counts.
    pub summary: BuildSummary,
    /// The MT's vertex for each point of the mesh.
    pub vertices: Vec<VertexId>,
    /// The exact values of the lossless fields, in the order of the MT's fields.
    pub exact: Vec<Exact>,
}

/// Counts of a finished build.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct BuildSummary {
    /// Vertices of the reference mesh.
    pub vertices: u32,
    /// Tetrahedra of the reference mesh.
    pub tetrahedra: u32,
    /// Vertices of the base mesh.
    pub base_vertices: u32,
    /// Tetrahedra of the base mesh.
    pub base_tetrahedra: u32,
    /// Updates of the MT.
    pub updates: u32,
    /// Bits of the position lattice.
    pub position_bits: u32,
    /// Length of the longest chain of updates, each of which depends on the one before.
    pub depth: u32,
    /// How far interfaces between regions have moved, in model units; see [`BuildConfig::preserve_within`].
    #[serde(skip)]
    pub interface_deviation: f64,
}

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
    /// The field has values at cells, not at points: see [`TetMesh::cells_to_points`].
    #[error("'{name}' is a field at cells, but an MT has fields at points; turn it into one at points first")]
    CellField {
        /// Its name.
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
    /// A label is not an integer.
    #[error("'{name}' is no label: labels are integers, but number {at} is {value}")]
    Label {
        /// Its name.
        name: String,
        /// The cell or point.
        at: u32,
        /// Its value.
        value: f64,
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
        /// Its name.
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
    /// More vertices than an MT can number.
    #[error("the mesh has more than 2^30 points; split it into parts")]
    TooLarge,
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

/// Builds an MT of `mesh`, which must be valid: see [`tetralod::mesh::repair`].
///
/// With the feature `parallel` it uses the threads of rayon's current pool. The result does not depend on how many there are.
/// Calls `progress` now and then, on the thread that it was called from.
///
/// ```
/// use std::ops::ControlFlow;
/// use std::sync::atomic::{AtomicBool, Ordering};
/// use tetralod::builder::{BuildConfig, BuildError, build};
///
/// let mesh = tetralod::generate::bucky(9)?;
/// let mut lines = Vec::new();
/// let built = build(&mesh, &BuildConfig::default(), &mut |at| {
///     lines.push(format!("{}: {} of {}", at.stage, at.done, at.total));
///     ControlFlow::Continue(())
/// })?;
/// assert_eq!(built.summary.tetrahedra, 6 * 8 * 8 * 8);
/// assert!(!lines.is_empty());
///
/// // Another thread, or a handler of signals, may set this at any time.
/// let cancelled = AtomicBool::new(true);
/// let stopped = build(&mesh, &BuildConfig::default(), &mut |_| {
///     if cancelled.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
/// });
/// assert!(matches!(stopped, Err(BuildError::Stopped)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// If the mesh is not valid, lacks a configured field, or does not fit the lattice; if `progress` stops the work.
pub fn build(
    mesh: &TetMesh,
    config: &BuildConfig,
    progress: OnProgress<'_>,
) -> Result<BuildResult, BuildError> {
    build_cow(Cow::Borrowed(mesh), config, progress)
}

/// As [`build`], but takes the mesh: its tetrahedra become those that the builder works on, which saves 16 bytes of memory for each.
///
/// # Errors
/// As [`build`].
pub fn build_owned(
    mesh: TetMesh,
    config: &BuildConfig,
    progress: OnProgress<'_>,
) -> Result<BuildResult, BuildError> {
    build_cow(Cow::Owned(mesh), config, progress)
}

fn build_cow(
    mut mesh: Cow<'_, TetMesh>,
    config: &BuildConfig,
    progress: OnProgress<'_>,
) -> Result<BuildResult, BuildError> {
    let kind = config.construction.kind();
    restrict::restrictions::check(config)?;
    let result = match config.construction {
        Construction::Edge | Construction::ExplicitEdge => {
            let BuildResult { mt, summary, vertices, exact } = edge_mt(&mesh, config, progress)?;
            BuildResult { mt: Mt::from(mt), summary, vertices, exact }
        }
        Construction::HalfEdge { purpose } => half_edge_mt(&mut mesh, config, purpose, progress)?,
        Construction::Vertex(method) | Construction::ExplicitVertex(method) => {
            summed_up(&mesh, config, vertex::mt_by(method, &mesh, config, progress)?)?
        }
    };
    // Conversions keep the numbers of the vertices.
    let mt = match result.mt.info().kind == kind {
        true => result.mt,
        false => result.mt.convert(kind)?,
    };
    let bits = config.block_bits.clamp(4, 16);
    let mt = if mt.page_bits() == bits { mt } else { mt.in_pages(bits).map_err(BuildError::Internal)? };
    Ok(BuildResult { mt, ..result })
}

/// The half-edge MT of `mesh`, its updates in blocks by what they reach.
fn half_edge_mt(
    mesh: &mut Cow<'_, TetMesh>,
    config: &BuildConfig,
    purpose: Purpose,
    progress: OnProgress<'_>,
) -> Result<BuildResult, BuildError> {
    let how = (BuildCriterion::HalfEdge, purpose);
    let Decimated::<Collapses> { record, quantized, info, interface_deviation } =
        decimate::decimate(mesh, config, how, progress)?;
    let block_bits = config.block_bits.clamp(4, 16);
    let (mt, vertices, summary) = record.half_edge_mt(info, &quantized, block_bits, progress)?;
    let summary = BuildSummary { interface_deviation, ..summary };
    let exact = lattice::field_selection::exact_values(mesh, config, &vertices)?;
    Ok(BuildResult { mt: mt.into(), summary, vertices, exact })
}

/// Adds the summary of an explicit MT.
fn summed_up(
    mesh: &TetMesh,
    config: &BuildConfig,
    (mt, vertices, interface_deviation): (ExplicitMt, Vec<VertexId>, f64),
) -> Result<BuildResult, BuildError> {
    let mut depths: Vec<u32> = Vec::new();
    for u in (0..mt.updates()).map(UpdateId) {
        let above = mt.parents(u).iter().map(|&p| depths[p as usize]).max();
        depths.push(above.unwrap_or(0) + 1);
    }
    let info = mt.info();
    let summary = BuildSummary {
        vertices: info.vertices,
        tetrahedra: info.tetrahedra,
        base_vertices: mt.base().positions.len() as u32,
        base_tetrahedra: mt.base().tets.len() as u32,
        updates: mt.updates(),
        position_bits: info.lattice.bits,
        depth: depths.into_iter().max().unwrap_or(0),
        interface_deviation,
    };
    let exact = lattice::field_selection::exact_values(mesh, config, &vertices)?;
    Ok(BuildResult { mt: mt.into(), summary, vertices, exact })
}

impl tetralod::Coded for BuildError {
    fn code(&self) -> &'static str {
        match self {
            Self::Combination { .. }
            | Self::UnknownField { .. }
            | Self::CellField { .. }
            | Self::TooManyFields { .. }
            | Self::Tolerance { .. }
            | Self::Option { .. } => "bad-option",
            Self::TooLarge => "limit",
            Self::Stopped => "stopped",
            Self::Internal(_) | Self::Convert(_) => "internal",
            _ => "bad-mesh",
        }
    }
}

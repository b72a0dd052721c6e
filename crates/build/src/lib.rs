//! Builds Multi-Tessellations of tetrahedral meshes, offline, for [`tetralod`]; measures them, and checks all that they promise.
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

/// The code of README.md, as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod build_error;
mod change;
mod collapse;
mod config;
mod decimate;
mod error;
mod geometry;
mod insert;
mod lattice;
#[doc(hidden)]
pub mod measure;
mod memory;
mod method;
mod order;
#[doc(hidden)]
pub mod parts;
mod progress;
mod remedy;
mod restrict;
mod result;
mod scratch;
pub mod verify;
mod vertex;

use decimate::Decimated;
use decimate::collapses::Collapses;

pub use build_error::BuildError;
#[doc(hidden)]
pub use collapse::edge_mt;
pub use config::{BuildConfig, FieldPrecision};
#[doc(hidden)]
pub use geometry::delaunay::delaunay;
#[doc(hidden)]
pub use lattice::field_lattice::mark_labels;
pub use memory::memory_needed;
#[doc(hidden)]
pub use memory::{memory_needed_in_parts, memory_needed_in_pieces};
#[doc(hidden)]
pub use method::ConstructionChoice;
pub use method::{BuildCriterion, Construction, Method, Purpose, VertexMethod};
pub use progress::{BuildProgress, OnProgress};
#[doc(hidden)]
pub use remedy::Remedy;
pub use result::{BuildResult, BuildSummary};

use std::borrow::Cow;
use std::ops::ControlFlow;
use tetralod::mesh::TetMesh;
use tetralod::mt::{ExplicitMt, Mt, MultiTessellation, UpdateId, UpdatePages, VertexId, VertexMt};
use tetralod::threads;

/// Builds an MT of `mesh`, which must be valid: see [`tetralod::mesh::repair`]. [`build_with`] can be watched and stopped.
///
/// ```
/// use tetralod_build::{BuildConfig, build};
///
/// let mesh = tetralod_io::generate::bucky(9)?;
/// let built = build(&mesh, &BuildConfig::default())?;
/// assert_eq!(built.summary.tetrahedra, 6 * 8 * 8 * 8);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// If the mesh is not valid, lacks a configured field, or does not fit the lattice.
pub fn build(mesh: &TetMesh, config: &BuildConfig) -> Result<BuildResult, BuildError> {
    build_with(mesh, config, &mut |_| ControlFlow::Continue(()))
}

/// Builds an MT as [`build`] does, and calls `progress` now and then, on the thread that it was called from. A mesh that is given away
/// saves 16 bytes of memory for each of its tetrahedra, which the builder then works on.
///
/// With the feature `parallel` of [`tetralod`] it uses the threads of rayon's current pool. The result does not depend on how many there are.
///
/// ```
/// use std::ops::ControlFlow;
/// use std::sync::atomic::{AtomicBool, Ordering};
/// use tetralod_build::{BuildConfig, BuildError, build_with};
///
/// let mesh = tetralod_io::generate::bucky(9)?;
/// let mut lines = Vec::new();
/// let built = build_with(&mesh, &BuildConfig::default(), &mut |at| {
///     lines.push(format!("{}: {} of {}", at.stage, at.done, at.total));
///     ControlFlow::Continue(())
/// })?;
/// assert!(!lines.is_empty());
///
/// // Another thread, or a handler of signals, may set this at any time.
/// let cancelled = AtomicBool::new(true);
/// let stopped = build_with(mesh, &BuildConfig::default(), &mut |_| {
///     if cancelled.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
/// });
/// assert!(matches!(stopped, Err(BuildError::Stopped)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`build`]; if `progress` stops the work.
pub fn build_with<'a>(
    mesh: impl Into<Cow<'a, TetMesh>>,
    config: &BuildConfig,
    progress: OnProgress<'_>,
) -> Result<BuildResult, BuildError> {
    let mesh = mesh.into();
    // The threads reach one another sooner than from outside; progress is told where it is asked for.
    let built = threads::inside(
        |ask| build_inside(mesh, config, &mut |at| ask(at).unwrap_or(ControlFlow::Break(()))),
        progress,
    );
    built.unwrap_or(Err(BuildError::Stopped))
}

/// [`build_with`] on one of the pool's threads.
fn build_inside(
    mut mesh: Cow<'_, TetMesh>,
    config: &BuildConfig,
    progress: OnProgress<'_>,
) -> Result<BuildResult, BuildError> {
    restrict::restrictions::check(config)?;
    let result = match config.construction {
        Construction::Edge => {
            let BuildResult { mt, summary, vertices, exact } = edge_mt(&mesh, config, progress)?;
            BuildResult { mt: Mt::from(mt), summary, vertices, exact }
        }
        Construction::HalfEdge { purpose } => half_edge_mt(&mut mesh, config, purpose, progress)?,
        Construction::Vertex(method) => {
            vertex_mt(&mesh, config, vertex::mt_by(method, &mesh, config, progress)?)?
        }
    };
    let (mt, bits) = (result.mt, config.block_bits.clamp(4, 16));
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
    let Decimated::<Collapses> { record, quantized, info, interface_deviation, regions } =
        decimate::decimate(mesh, config, how, progress)?;
    let block_bits = config.block_bits.clamp(4, 16);
    let (mt, vertices, summary) = record.half_edge_mt(info, regions, &quantized, block_bits, progress)?;
    let summary = BuildSummary { interface_deviation, ..summary };
    let exact = lattice::field_selection::exact_values(mesh, config, &vertices)?;
    Ok(BuildResult { mt: mt.into(), summary, vertices, exact })
}

/// The vertex-based MT of the same updates as an explicit one, which has the same numbers of vertices.
fn vertex_mt(
    mesh: &TetMesh,
    config: &BuildConfig,
    (mt, vertices, interface_deviation): (ExplicitMt, Vec<VertexId>, f64),
) -> Result<BuildResult, BuildError> {
    let mut depths: Vec<u32> = Vec::new();
    for u in (0..mt.updates()).map(UpdateId) {
        let above = mt.parents(u).iter().map(|&p| depths[p as usize]).max();
        depths.push(above.unwrap_or(0) + 1);
    }
    let summary = BuildSummary::of(mt.info(), mt.base(), depths.into_iter().max().unwrap_or(0));
    let summary = BuildSummary { interface_deviation, ..summary };
    let exact = lattice::field_selection::exact_values(mesh, config, &vertices)?;
    Ok(BuildResult { mt: VertexMt::from_explicit(&mt)?.into(), summary, vertices, exact })
}

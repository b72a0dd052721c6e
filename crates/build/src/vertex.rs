//! Vertex-based MTs, by decimation or insertion.

use super::{BuildConfig, BuildCriterion, BuildError, OnProgress, Purpose, VertexMethod, decimate, insert};
use crate::decimate::Decimated;
use crate::insert::sequence::Sequence;
use crate::lattice::quantize;
use std::borrow::Cow;
use tetralod::geom::Bounds;
use tetralod::mesh;
use tetralod::mesh::TetMesh;
use tetralod::mt::{ExplicitMt, MAX_UPDATES, VertexId};

/// Builds a vertex-based MT of `mesh` by this method, as an explicit MT. Also returns how far interfaces have moved, in model units.
///
/// # Errors
/// As [`decimated_mt`] and [`inserted_mt`].
pub(super) fn mt_by(
    method: VertexMethod,
    mesh: &TetMesh,
    config: &BuildConfig,
    progress: OnProgress<'_>,
) -> Result<(ExplicitMt, Vec<VertexId>, f64), BuildError> {
    match method {
        VertexMethod::Insert { tet_errors } => {
            let (mt, vertices) = inserted_mt(mesh, config, tet_errors, progress)?;
            Ok((mt, vertices, 0.0))
        }
        VertexMethod::Decimate { criterion, purpose } => {
            decimated_mt(mesh, config, (criterion, purpose), progress)
        }
    }
}

/// Builds a vertex-based MT of `mesh` by removing vertices, cheapest first, as an explicit MT: see
/// [`VertexMt::from_explicit`](tetralod::mt::VertexMt::from_explicit).
///
/// # Errors
/// As [`edge_mt`](crate::edge_mt).
pub(super) fn decimated_mt(
    mesh: &TetMesh,
    config: &BuildConfig,
    how: (BuildCriterion, Purpose),
    progress: OnProgress<'_>,
) -> Result<(ExplicitMt, Vec<VertexId>, f64), BuildError> {
    let Decimated::<Sequence> { record, quantized, info, interface_deviation, .. } =
        decimate::decimate(&mut Cow::Borrowed(mesh), config, how, progress)?;
    let (mt, vertices) = record.explicit_mt(info, &quantized, progress)?;
    Ok((mt, vertices, interface_deviation))
}

/// Builds a vertex-based MT of the points of `mesh` by inserting them into a coarse mesh of their convex hull, the one
/// with the largest error first, as an explicit MT. The reference mesh is the Delaunay triangulation of the points,
/// whatever tetrahedra `mesh` has; it may have none.
///
/// # Errors
/// If the tetrahedra of `mesh` do not fill the convex hull of its points, two points coincide on the lattice or they
/// span no volume; if an option is out of its range; if `progress` stops the work.
pub(super) fn inserted_mt(
    mesh: &TetMesh,
    config: &BuildConfig,
    tet_errors: bool,
    progress: OnProgress<'_>,
) -> Result<(ExplicitMt, Vec<VertexId>), BuildError> {
    if mesh.positions.len() > MAX_UPDATES as usize {
        return Err(BuildError::TooLarge);
    }
    if !mesh.tets.is_empty() {
        mesh::check(mesh)?;
    }
    let quantized = quantize::quantize(mesh, config)?;
    let displacement_per_error = config.displacement * Bounds::of(&mesh.positions).diagonal();
    let sequence = insert::insert(&quantized, &mesh.tets, tet_errors, progress)?;
    let grown: usize = sequence.steps.iter().map(|step| step.inserted.len()).sum();
    let shrunk: usize = sequence.steps.iter().map(|step| step.removed.len()).sum();
    let info = quantized.info((sequence.base.len() + grown - shrunk) as u64, displacement_per_error);
    sequence.explicit_mt(info, &quantized, progress)
}

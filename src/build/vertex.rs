//! The front door to vertex-based MTs.

use super::BuildConfig;
use super::BuildError;
use super::BuildProgress;
use super::OnProgress;
use super::decimate;
pub use super::decimate::Criterion;
use super::quantize::Quantized;
use super::sequence::Sequence;
use crate::mesh::TetMesh;
use crate::mt::ExplicitMt;
use crate::mt::MtInfo;
use crate::mt::MtKind;

pub fn decimated_mt(
    mesh: &TetMesh,
    config: &BuildConfig,
    criterion: Criterion,
    progress: OnProgress<'_>,
) -> Result<ExplicitMt, BuildError> {
    let decimated = decimate::decimate(mesh, config, criterion, progress)?;
    let quantized = &decimated.quantized;
    let info = MtInfo {
        kind: MtKind::Explicit,
        lattice: quantized.lattice,
        fields: quantized.fields.clone(),
        vertices: mesh.positions.len() as u32,
        tetrahedra: mesh.tets.len() as u32,
        updates: 0,
        displacement_per_error: decimated.displacement_per_error,
    };
    decimated.sequence.explicit_mt(info, quantized, progress)
}

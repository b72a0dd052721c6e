//! The MT files that are measured.

use super::Result;
use tetralod::format::{EncodeOptions, encode};
use tetralod::mesh::TetMesh;
use tetralod::mt::MtKind;
use tetralod_build::{BuildConfig, Purpose, build};

/// The MT file of a mesh.
pub fn mt_file(mesh: &TetMesh, kind: MtKind, purpose: Purpose) -> Result<Vec<u8>> {
    let mut config = BuildConfig::of(kind);
    // Other methods know no purpose.
    config.construction = config.construction.with_purpose(purpose).unwrap_or(config.construction);
    let mt = build(mesh, &config)?.mt;
    Ok(encode(&mt, &EncodeOptions::default())?)
}

//! What a build makes.

use serde::Serialize;
use tetralod::mt::{BaseMesh, Exact, Mt, MtInfo, VertexId};

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
    pub tetrahedra: u64,
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
    /// How far interfaces between regions have moved, in model units; see [`BuildConfig::preserve_within`](crate::BuildConfig::preserve_within).
    #[serde(skip)]
    pub interface_deviation: f64,
}

impl BuildSummary {
    /// Of an MT with this base mesh.
    pub(crate) fn of(info: &MtInfo, base: &BaseMesh, depth: u32) -> Self {
        Self {
            vertices: info.vertices,
            tetrahedra: info.tetrahedra,
            base_vertices: base.positions.len() as u32,
            base_tetrahedra: base.tets.len() as u32,
            updates: info.updates,
            position_bits: info.lattice.bits,
            depth,
            interface_deviation: 0.0,
        }
    }
}

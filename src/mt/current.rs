//! The current mesh Σ_S.

/// The current mesh Σ_S, in packed arrays with adjacency.
#[derive(Clone, Debug, Default)]
pub struct CurrentMesh {
    /// The tetrahedra, as slots of vertices.
    pub tets: Vec<[u32; 4]>,
}

impl CurrentMesh {
    /// An empty mesh.
    pub fn new() -> Self {
        Self::default()
    }
}

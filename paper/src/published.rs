//! Numbers that others have printed. Ours are never constants: they are computed each time.

/// A row of the paper's Table 1, and what its text says of the same MT.
pub struct PublishedMt {
    pub kind: &'static str,
    pub explicit_bytes: u64,
    pub compact_bytes: u64,
    /// Tetrahedra that an update inserts, on average.
    pub inserted_per_update: f64,
    /// Tetrahedra that an update removes, on average, where they are told.
    pub removed_per_update: Option<f64>,
    /// Arcs of the DAG per node, where they are told.
    pub arcs_per_update: Option<f64>,
    /// Bits per node that describe T_u and where it is, where there are any.
    pub shape_bits: Option<f64>,
}

pub const EDGE: PublishedMt = PublishedMt {
    kind: "edge",
    explicit_bytes: 29_433_916,
    compact_bytes: 1_289_964,
    inserted_per_update: 27.0,
    removed_per_update: None,
    arcs_per_update: None,
    shape_bits: None,
};

pub const VERTEX: PublishedMt = PublishedMt {
    kind: "vertex",
    explicit_bytes: 13_930_564,
    compact_bytes: 2_015_523,
    inserted_per_update: 16.0,
    removed_per_update: Some(12.0),
    arcs_per_update: Some(5.0),
    shape_bits: Some(69.0),
};

/// Smallbucky.
pub const VERTICES: u64 = 35_937;
/// Tetrahedra of its reference mesh.
pub const TETRAHEDRA: u64 = 194_620;
pub const INDEXED_BYTES: u64 = 3_688_912;
pub const ADJACENCY_BYTES: u64 = 6_802_832;

/// A caption: tetrahedra and facets of the isosurface, at a uniform and at a variable resolution.
pub struct Caption {
    pub uniform_tets: u64,
    pub uniform_facets: u64,
    pub variable_tets: u64,
    /// As far as the caption tells.
    pub variable_facets: Option<u64>,
}

/// Vertex-based MT, error 0.1 %. The caption gives one number of facets for both meshes.
pub const FIGURE_6: Caption = Caption {
    uniform_tets: 146_211,
    uniform_facets: 18_523,
    variable_tets: 70_205,
    variable_facets: Some(18_523),
};

/// Edge-based MT, error 0 (in a box).
pub const FIGURE_7: Caption = Caption {
    uniform_tets: 163_831,
    uniform_facets: 16_272,
    variable_tets: 41_326,
    variable_facets: Some(9_654),
};

/// Errors on the axis of Figure 8, as fractions of the field's range.
pub const FIGURE_8_ERRORS: [f64; 6] = [0.0, 0.001, 0.005, 0.01, 0.05, 0.1];
/// How many fewer tetrahedra the vertex-based MT needs than the edge-based one: uniform, and by field value.
pub const FIGURE_8_SAVED: [f64; 2] = [0.08, 0.20];
/// How many fewer tetrahedra half-edge collapses need than general edge collapses, on average: the abstract of *The half-edge tree*.
pub const HALF_EDGE_SAVED: f64 = 0.34;

//! How large the stars are that an update of an edge-based MT may change. The mesh reserves for them.

/// Largest number of tetrahedra around a vertex that an update of an edge-based MT splits.
pub const MAX_STAR: usize = 64;

/// Largest number of vertices around a vertex that an update of an edge-based MT splits.
pub const MAX_LINK: usize = 32;

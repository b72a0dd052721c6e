//! A tetrahedral mesh as files give it and builders take it.

/// A scalar field with one value per point.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// The field's name in the file it came from.
    pub name: String,
    /// One value per point, in the order of [`TetMesh::positions`].
    pub values: Vec<f64>,
}

/// The regular grid that a mesh was split from; its points run x fastest, then y, then z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Points along x, y and z.
    pub dims: [u32; 3],
    /// Position of the first point.
    pub origin: [f64; 3],
    /// Distance between neighbouring points along x, y and z; positive.
    pub spacing: [f64; 3],
}

/// A tetrahedral mesh with scalar fields at its points: plain arrays, nothing promised about validity.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TetMesh {
    /// Coordinates of the points, in model units.
    pub positions: Vec<[f64; 3]>,
    /// Scalar fields, each as long as `positions`.
    pub fields: Vec<Field>,
    /// Tetrahedra as indices into `positions`.
    pub tets: Vec<[u32; 4]>,
    /// Set when the points are exactly those of a regular grid: the lattice then falls on the grid.
    pub grid: Option<Grid>,
}

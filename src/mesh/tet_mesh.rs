//! A tetrahedral mesh as files give it and builders take it.

use crate::mesh::MeshInput;
use serde::Serialize;

/// A scalar field with one value per point (or per tetrahedron), and what is known of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Field {
    /// The field's name in the file it came from. Only the time steps of one field share a name.
    pub name: String,
    /// One value per point, in the order of [`TetMesh::positions`]; of fields at cells, one per tetrahedron.
    pub values: Vec<f64>,
    /// The unit of the values; empty if it is not known.
    pub unit: String,
    /// Set when the field is a part of a vector or tensor.
    pub vector: Option<VectorPart>,
    /// The time that the values are of.
    pub time: Option<f64>,
    /// Whether the values are integers by the type that the file gave them.
    pub integer: bool,
}

impl Field {
    /// A field of which no more is known.
    pub fn new(name: impl Into<String>, values: Vec<f64>) -> Self {
        Self { name: name.into(), values, ..Self::default() }
    }

    /// Whether a user who asks for `name` means this field: it has this name, or it is a component (not the length) of
    /// the vector of this name.
    pub fn answers_to(&self, name: &str) -> bool {
        self.name == name || self.vector.as_ref().is_some_and(|v| v.name == name && v.component.is_some())
    }
}

/// Which part of a vector or tensor a scalar field is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct VectorPart {
    /// The vector's name.
    pub name: String,
    /// The component, from 0; none for the vector's length, which follows from the components.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub component: Option<u8>,
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

/// A tetrahedral mesh with scalar fields at its points: plain arrays that need not be valid. What it was read from does not
/// count when two are compared.
#[derive(Clone, Debug, Default)]
pub struct TetMesh {
    /// Coordinates of the points, in model units.
    pub positions: Vec<[f64; 3]>,
    /// Scalar fields, each as long as `positions`.
    pub fields: Vec<Field>,
    /// Tetrahedra as indices into `positions`.
    pub tets: Vec<[u32; 4]>,
    /// Set when the points are exactly those of a regular grid: the lattice then falls on the grid.
    pub grid: Option<Grid>,
    /// Scalar fields at the cells, each as long as `tets`; without values where only their names were asked for.
    pub cell_fields: Vec<Field>,
    /// What its reader left out of the file, or took in a way that the file does not state: in words, for users.
    pub notes: Vec<String>,
    /// What is known of the input that it was read from.
    pub input: MeshInput,
}

impl PartialEq for TetMesh {
    fn eq(&self, other: &Self) -> bool {
        let Self { positions, fields, tets, grid, cell_fields, input: _, notes: _ } = self;
        *positions == other.positions
            && *fields == other.fields
            && *tets == other.tets
            && *grid == other.grid
            && *cell_fields == other.cell_fields
    }
}

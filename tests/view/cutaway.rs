//! The cut-away view on the CPU, as the renderer's twin: what is seen of the tetrahedra that lie behind a
//! plane.
//!
//! Whole tetrahedra are kept or taken away. The triangles are those faces of kept tetrahedra that have no
//! kept tetrahedron on their other side.

use tetralod::mesh::{FACES, NONE};
use tetralod::view::{ClipPlane, MeshView};

/// The visible triangles of the kept tetrahedra, flat, three corners each; the memory is used again.
#[derive(Clone, Debug, Default)]
pub struct Cutaway {
    /// Corners in model units, three per triangle, counter-clockwise when seen from outside.
    pub positions: Vec<[f64; 3]>,
    /// The field's value at each corner.
    pub values: Vec<f64>,
    /// Tetrahedra that were kept.
    pub kept: usize,
    keep: Vec<bool>,
}

impl Cutaway {
    /// Nothing to see yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.positions.len() / 3
    }

    /// Replaces the triangles by those of `mesh` behind `plane`, in the order of the tetrahedra.
    ///
    /// # Panics
    /// If the mesh names a point or a neighbour that it does not have.
    pub fn cut(&mut self, mesh: &MeshView<'_>, plane: &ClipPlane) {
        self.positions.clear();
        self.values.clear();
        self.keep.clear();
        self.keep.extend(mesh.tets.iter().map(|tet| plane.keeps(tet.map(|p| mesh.positions[p as usize]))));
        self.kept = self.keep.iter().filter(|kept| **kept).count();
        for (t, _) in self.keep.iter().enumerate().filter(|(_, kept)| **kept) {
            for (face, neighbor) in FACES.iter().zip(mesh.neighbors[t]) {
                if neighbor == NONE || !self.keep[neighbor as usize] {
                    let corners = face.map(|i| mesh.tets[t][i] as usize);
                    self.positions.extend(corners.map(|p| mesh.positions[p]));
                    self.values.extend(corners.map(|p| mesh.field[p]));
                }
            }
        }
    }
}

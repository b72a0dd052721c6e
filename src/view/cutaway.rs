//! The cut-away view: what is seen of the tetrahedra that lie behind a plane.
//!
//! Whole tetrahedra are kept or taken away, so the cut shows the mesh as it is. The triangles are those faces of
//! kept tetrahedra that have no kept tetrahedron on their other side; all their sides are edges of tetrahedra, so a
//! renderer draws outlines along the sides of every triangle.

use crate::mesh::{FACES, NONE};
use crate::view::MeshView;

/// A plane `normal · p = offset`; the half-space in which the product is larger is cut away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipPlane {
    /// Points into the part that is cut away; any length but zero.
    pub normal: [f32; 3],
    /// `normal · p` of the points of the plane.
    pub offset: f32,
}

impl ClipPlane {
    /// The plane that cuts nothing away.
    pub const NOTHING: Self = Self { normal: [0.0, 0.0, 1.0], offset: f32::INFINITY };

    /// Whether a tetrahedron with these corners is kept: its centroid is on the plane or behind it.
    pub fn keeps(&self, corners: [[f32; 3]; 4]) -> bool {
        let side = |p: [f32; 3]| (0..3).map(|i| f64::from(self.normal[i]) * f64::from(p[i])).sum::<f64>();
        corners.map(side).iter().sum::<f64>() <= 4.0 * f64::from(self.offset)
    }
}

/// The visible triangles of the kept tetrahedra, flat, three corners each; the memory is used again.
#[derive(Clone, Debug, Default)]
pub struct Cutaway {
    /// Corners in model units, three per triangle, counter-clockwise when seen from outside.
    pub positions: Vec<[f32; 3]>,
    /// The field's value at each corner.
    pub values: Vec<f32>,
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

//! The boundary of a mesh as a surface of its own.

use crate::mesh::{NONE, boundary_faces, faces};
use crate::view::MeshView;
use glam::DVec3;

/// The faces without neighbour, with the points that they need and no others; the memory is used again.
///
/// Triangles face outwards and come in the order of their tetrahedra; vertices in the order in which triangles name
/// them.
#[derive(Clone, Debug, Default)]
pub struct BoundarySurface {
    /// Vertices, in model units.
    pub positions: Vec<[f64; 3]>,
    /// The field's value at each vertex.
    pub values: Vec<f64>,
    /// Triangles, counter-clockwise when seen from outside.
    pub indices: Vec<[u32; 3]>,
    /// Which point of the mesh each vertex is.
    pub points: Vec<u32>,
    /// Per point of the mesh its vertex; all [`NONE`] between two extractions.
    vertex_of: Vec<u32>,
}

impl BoundarySurface {
    /// Nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Replaces the surface by the boundary of `mesh`. Costs one pass over the neighbours.
    ///
    /// # Panics
    /// If the mesh names a point that it does not have.
    pub fn extract(&mut self, mesh: &MeshView<'_>) {
        self.take(mesh, boundary_faces(mesh.tets, mesh.neighbors).map(|(_, face)| face));
    }

    /// Replaces the surface by those faces of tetrahedra that are wanted, given the tetrahedron and its neighbour at the face, or [`NONE`].
    ///
    /// # Panics
    /// If the mesh names a point that it does not have.
    pub fn extract_of(&mut self, mesh: &MeshView<'_>, is_wanted: impl Fn(u32, u32) -> bool) {
        let faces = faces(mesh.tets, mesh.neighbors).filter(|(tet, beside, _)| is_wanted(*tet, *beside));
        self.take(mesh, faces.map(|(_, _, face)| face));
    }

    fn take(&mut self, mesh: &MeshView<'_>, faces: impl Iterator<Item = [u32; 3]>) {
        self.indices.clear();
        self.points.clear();
        self.vertex_of.resize(mesh.positions.len(), NONE);
        for face in faces {
            let triangle = face.map(|point| self.vertex(point));
            self.indices.push(triangle);
        }
        self.positions.clear();
        self.positions.extend(self.points.iter().map(|p| mesh.positions[*p as usize]));
        self.values.clear();
        self.values.extend(self.points.iter().map(|p| mesh.field[*p as usize]));
        self.points.iter().for_each(|p| self.vertex_of[*p as usize] = NONE);
    }

    fn vertex(&mut self, point: u32) -> u32 {
        let vertex = &mut self.vertex_of[point as usize];
        if *vertex == NONE {
            *vertex = self.points.len() as u32;
            self.points.push(point);
        }
        *vertex
    }

    /// The value at each vertex of another field of the mesh that the surface was made of, given by one number a point.
    ///
    /// # Panics
    /// If there are fewer numbers than points in that mesh.
    pub fn interpolate(&self, field: &[f64]) -> Vec<f64> {
        self.points.iter().map(|p| field[*p as usize]).collect()
    }

    /// Where each vertex is, as [`LabelParts`](super::LabelParts) takes it.
    #[doc(hidden)]
    pub fn edge_places(&self) -> Vec<([u32; 2], f64)> {
        self.points.iter().map(|&point| ([point; 2], 0.0)).collect()
    }

    /// The surface's area, in square model units.
    pub fn area(&self) -> f64 {
        area(&self.positions, &self.indices)
    }

    /// Whether every directed side has as many opposite ones: true for the boundary of a mesh that conforms.
    pub fn is_closed(&self) -> bool {
        is_closed(&self.indices)
    }
}

/// The area of indexed triangles.
///
/// # Panics
/// If a triangle names a vertex that is not there.
pub fn area(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    let corner = |v: u32| DVec3::from(positions[v as usize]);
    let of = |t: &[u32; 3]| (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0])).length();
    0.5 * triangles.iter().map(of).fold(0.0, |sum, area| sum + area)
}

/// Whether every directed side of indexed triangles has as many opposite ones.
pub fn is_closed(triangles: &[[u32; 3]]) -> bool {
    let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    // The smaller end first, then whether that turned the side around.
    let mut sides: Vec<(u32, u32, bool)> = sides.map(|[a, b]| (a.min(b), a.max(b), a > b)).collect();
    sides.sort_unstable();
    sides.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)).all(|same| {
        let turned = same.iter().filter(|side| side.2).count();
        2 * turned == same.len()
    })
}

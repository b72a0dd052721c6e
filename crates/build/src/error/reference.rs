//! The reference mesh that errors are measured against: their units, and which tetrahedron has which of its vertices.

use crate::change::work_mesh::WorkMesh;
use crate::error::boundary_distance::BoundaryDistance;
use crate::error::outside_points::OutsidePoints;
use crate::error::points::{Lists, SparseLists, as_vec};
use crate::lattice::quantize::Quantized;
use glam::DVec3;
use tetralod::mesh::NONE;

/// The reference vertices that belong to each tetrahedron.
pub(crate) struct Buckets {
    /// Points of the reference mesh in the tetrahedron.
    pub inside: Lists,
    /// Points of the reference boundary near its boundary faces.
    pub border: SparseLists,
    /// Points outside of the tetrahedron in whose bucket they are.
    pub outside_points: OutsidePoints,
}

impl Buckets {
    /// Of a mesh with so many tetrahedra.
    pub fn new(tets: usize, quantized: &Quantized) -> Self {
        let points = quantized.places.len();
        let mut inside = Lists::new(tets, points);
        let mut outside_points = OutsidePoints::new(quantized.places.clone());
        for location in &quantized.locations {
            inside.put(location.tet, location.point);
            outside_points.set_outside(location.point, location.outside);
        }
        Self { inside, border: SparseLists::default(), outside_points }
    }

    /// Keeps the buckets of these tetrahedra, which ascend, under their places as numbers. All others are empty.
    pub fn renumber(&mut self, live: &[u32]) {
        self.inside.renumber(live);
        self.border.renumber(live);
        self.outside_points.renumber(live);
    }

    /// Empties the buckets of a tetrahedron, which may be a new one.
    pub fn clear(&mut self, t: u32) {
        self.inside.reserve(t);
        self.inside.take(t);
        self.border.take(t);
        self.outside_points.clear(t);
    }
}

/// The reference mesh and the units of its errors.
pub(crate) struct Reference<'a> {
    pub quantized: &'a Quantized,
    pub points: u32,
    pub boundary: BoundaryDistance,
    /// For each vertex of the reference mesh the square of the shortest edge there.
    pub shortest: Vec<f64>,
    /// Model units of displacement of the boundary that count as an error of 1 at most, and as a multiple of the shortest edge there.
    pub displacement_per_error: f64,
    edges: f64,
}

impl<'a> Reference<'a> {
    /// A displacement by `edges` times the shortest edge at a vertex counts as an error of 1 there, but at most one of
    /// `displacement_per_error`.
    pub fn new(quantized: &'a Quantized, mesh: &WorkMesh, displacement_per_error: f64, edges: f64) -> Self {
        let shortest = quantized.shortest_edges(&mesh.tets);
        let boundary = BoundaryDistance::new(&mesh.tets, &mesh.neighbors, quantized);
        Self::of(quantized, boundary, shortest, (displacement_per_error, edges))
    }

    /// The reference of [`Reference::new`], given the boundary of the reference mesh and for each of its vertices the square of the shortest edge there.
    pub fn of(
        quantized: &'a Quantized,
        boundary: BoundaryDistance,
        shortest: Vec<f64>,
        (displacement_per_error, edges): (f64, f64),
    ) -> Self {
        Self { quantized, points: shortest.len() as u32, boundary, shortest, displacement_per_error, edges }
    }

    /// The displacement that counts as an error of 1 at a vertex.
    fn allowance(&self, vertex: u32) -> f64 {
        // With no displacement allowed any movement is an infinite error.
        let own = if self.edges > 0.0 { self.edges * self.shortest[vertex as usize].sqrt() } else { 0.0 };
        own.min(self.displacement_per_error)
    }

    /// What a displacement at a reference vertex counts as.
    pub fn error_at(&self, point: u32, distance: f64) -> f64 {
        let vertex = self.quantized.vertex(point);
        if distance > 0.0 { distance / self.allowance(vertex) } else { 0.0 }
    }

    /// What a displacement from a triangle of the reference boundary counts as.
    pub fn error_from(&self, triangle: u32, distance: f64) -> f64 {
        if distance > 0.0 { distance / self.allowance_from(triangle) } else { 0.0 }
    }

    /// How far the middles of a boundary triangle and of its edges are from the reference boundary, as an error, or `largest` if that
    /// is more. `from` are triangles of that boundary near the corners; [`NONE`] where none is known.
    pub fn chord(&self, [a, b, c]: [DVec3; 3], from: [u32; 3], mut largest: f64) -> f64 {
        for p in [(a + b + c) / 3.0, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5] {
            let mut least = f64::INFINITY;
            for from in from.into_iter().filter(|&from| from != NONE) {
                if least > largest {
                    let (foot, distance) = self.boundary.walk(p, from, largest * self.allowance_from(from));
                    least = least.min(self.error_from(foot, distance));
                }
            }
            largest = largest.max(least);
        }
        largest
    }

    /// The displacement from a triangle of the reference boundary that counts as an error of 1.
    pub fn allowance_from(&self, triangle: u32) -> f64 {
        self.boundary
            .corners(triangle)
            .map(|point| self.allowance(point))
            .into_iter()
            .fold(f64::INFINITY, f64::min)
    }

    /// What a displacement counts as at least, wherever it is.
    pub fn least_error_of(&self, distance: f64) -> f64 {
        if distance > 0.0 { distance / self.displacement_per_error } else { 0.0 }
    }

    /// Where a reference vertex is in the input, in model units from the lattice's origin, and how far the lattice has moved it: what
    /// that alone puts outside is no displacement.
    pub fn place(&self, point: u32) -> (DVec3, f64) {
        let p = self.quantized.places.at(point) * DVec3::from_array(self.quantized.lattice.step);
        (p, p.distance(self.position(point)))
    }

    /// Where the lattice has put a reference vertex, in model units from the lattice's origin.
    pub fn position(&self, point: u32) -> DVec3 {
        self.scaled(self.quantized.positions[self.quantized.vertex(point) as usize])
    }

    /// A lattice point in model units, from the lattice's origin.
    pub fn scaled(&self, q: [i32; 3]) -> DVec3 {
        as_vec(q) * DVec3::from_array(self.quantized.lattice.step)
    }
}

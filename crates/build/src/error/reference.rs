//! The reference mesh that errors are measured against, its points, and the units of errors.

use crate::change::work_mesh::WorkMesh;
use crate::error::boundary_distance::BoundaryDistance;
use crate::error::points::as_vec;
use crate::lattice::quantize::Quantized;
use glam::DVec3;
use tetralod::mesh::NONE;

/// A point of the reference mesh: its number, or a record of it.
pub(crate) trait ReferencePoint: Copy {
    /// Where it is, in steps of the lattice.
    fn place(self, reference: &Reference<'_>) -> DVec3;
    /// Where the lattice has put it.
    fn rounded(self, reference: &Reference<'_>) -> [i32; 3];
    /// The square of the shortest edge of the reference mesh there.
    fn shortest(self, reference: &Reference<'_>) -> f64;
    /// Its region, where fields jump.
    fn region(self, reference: &Reference<'_>) -> Option<u32>;
    /// Its values, as [`Quantized::exact`] has them.
    fn values(self, quantized: &Quantized) -> impl Iterator<Item = f64>;
}

impl ReferencePoint for u32 {
    fn place(self, reference: &Reference<'_>) -> DVec3 {
        reference.quantized.places.at(self)
    }

    fn rounded(self, reference: &Reference<'_>) -> [i32; 3] {
        reference.quantized.positions[reference.quantized.vertex(self) as usize]
    }

    fn shortest(self, reference: &Reference<'_>) -> f64 {
        reference.shortest[reference.quantized.vertex(self) as usize]
    }

    fn region(self, reference: &Reference<'_>) -> Option<u32> {
        reference.quantized.region(self)
    }

    fn values(self, quantized: &Quantized) -> impl Iterator<Item = f64> {
        quantized.values(self)
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

    /// The displacement that counts as an error of 1 at a vertex with this square of the shortest edge.
    fn allowance(&self, shortest: f64) -> f64 {
        // With no displacement allowed any movement is an infinite error.
        let own = if self.edges > 0.0 { self.edges * shortest.sqrt() } else { 0.0 };
        own.min(self.displacement_per_error)
    }

    /// What a displacement at a reference vertex counts as.
    pub fn error_at(&self, point: impl ReferencePoint, distance: f64) -> f64 {
        if distance > 0.0 { distance / self.allowance(point.shortest(self)) } else { 0.0 }
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
            .map(|point| self.allowance(self.shortest[point as usize]))
            .into_iter()
            .fold(f64::INFINITY, f64::min)
    }

    /// What a displacement counts as at least, wherever it is.
    pub fn least_error_of(&self, distance: f64) -> f64 {
        if distance > 0.0 { distance / self.displacement_per_error } else { 0.0 }
    }

    /// Where a reference vertex is in the input, in model units from the lattice's origin, and how far the lattice has moved it: what
    /// that alone puts outside is no displacement.
    pub fn place(&self, point: impl ReferencePoint) -> (DVec3, f64) {
        let p = point.place(self) * DVec3::from_array(self.quantized.lattice.step);
        (p, p.distance(self.scaled(point.rounded(self))))
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

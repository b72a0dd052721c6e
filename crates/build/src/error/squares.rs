//! The squares of the errors in each tetrahedron, where they count for the order of removals.

use crate::change::work_mesh::{StarTet, WorkMesh, keep};
use crate::error::cost::{Buckets, Reference};
use crate::error::points::{barycentric, clamped};

/// For each tetrahedron the sum of the squares of the errors at its points; nothing where squares do not count.
#[derive(Default)]
pub(crate) struct Squares(Vec<f32>);

impl Squares {
    /// Of a mesh that is what removals have left. Points outside of it count as at a place of the tetrahedron that they belong to.
    pub fn of(mesh: &WorkMesh, buckets: &Buckets, reference: &Reference<'_>) -> Self {
        let quantized = reference.quantized;
        let mut errors = vec![0.0; quantized.fields.len()];
        let mut sum = |t: u32| {
            let tet = mesh.tets[t as usize];
            let corners = tet.map(|v| quantized.rounded(v));
            let matrix = barycentric(corners);
            let square = |point: u32| {
                let lambda = clamped(matrix * (quantized.places.at(point) - corners[0]));
                let levels = |f: usize| tet.map(|v| quantized.level(v, f));
                quantized.deviation(point, lambda, levels, &mut errors).powi(2)
            };
            buckets.inside.iter(t).map(square).sum::<f64>() as f32
        };
        let tets = 0..mesh.tets.len() as u32;
        Self(tets.map(|t| if mesh.is_live(t) { sum(t) } else { 0.0 }).collect())
    }

    /// That of some tetrahedra.
    pub fn sum(&self, star: &[StarTet]) -> f64 {
        let own = |s: &StarTet| self.0.get(s.tet as usize).copied().map_or(0.0, f64::from);
        star.iter().map(own).sum()
    }

    /// Keeps those of these tetrahedra, which ascend, under their places as numbers.
    pub fn renumber(&mut self, live: &[u32]) {
        if !self.0.is_empty() {
            keep(&mut self.0, live);
        }
    }

    /// Sets those of tetrahedra that have replaced others.
    pub fn set(&mut self, slots: &[u32], squares: &[f64]) {
        if self.0.is_empty() {
            return;
        }
        for (&t, &square) in slots.iter().zip(squares) {
            self.0[t as usize] = square as f32;
        }
    }
}

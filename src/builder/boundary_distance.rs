//! The boundary of the reference mesh, and how far a point is from it.

use crate::geom::{Groups, nearest_on_triangle};
use crate::mesh::boundary_faces;
use glam::DVec3;

/// The boundary triangles of the reference mesh, in model units.
pub(super) struct BoundaryDistance {
    triangles: Vec<[DVec3; 3]>,
    corners: Vec<[u32; 3]>,
    /// The triangles at each vertex.
    around: Groups,
}

impl BoundaryDistance {
    /// Of the triangles without a neighbour.
    pub fn new(tets: &[[u32; 4]], neighbors: &[[u32; 4]], positions: &[DVec3]) -> Self {
        Self::of(boundary_faces(tets, neighbors).map(|(_, face)| face).collect(), positions)
    }

    /// Of these triangles, counter-clockwise when seen from outside.
    pub fn of(corners: Vec<[u32; 3]>, positions: &[DVec3]) -> Self {
        let triangles = corners.iter().map(|face| face.map(|v| positions[v as usize])).collect();
        let around = Groups::new(positions.len(), |add| {
            (0..).zip(&corners).for_each(|(t, face)| face.iter().for_each(|v| add(*v as usize, t)));
        });
        Self { triangles, corners, around }
    }

    /// All triangles.
    #[cfg(feature = "parts")]
    pub fn all(&self) -> &[[u32; 3]] {
        &self.corners
    }

    /// The triangles at a vertex of the reference mesh.
    pub fn at(&self, v: u32) -> &[u32] {
        self.around.of(v as usize)
    }

    /// The corners of a triangle.
    pub fn corners(&self, triangle: u32) -> [u32; 3] {
        self.corners[triangle as usize]
    }

    /// Walks from a triangle to ever nearer ones, until one is as near as `enough`. Returns the last one and
    /// its distance from `p`: an upper bound of how far `p` is from the boundary.
    pub fn walk(&self, p: DVec3, from: u32, enough: f64) -> (u32, f64) {
        let squared = |t: u32| p.distance_squared(nearest_on_triangle(p, self.triangles[t as usize]));
        let (mut best, mut least) = (from, squared(from));
        while least > enough * enough {
            let here = best;
            for &v in &self.corners[here as usize] {
                for &t in self.at(v) {
                    let distance = squared(t);
                    if distance < least {
                        (best, least) = (t, distance);
                    }
                }
            }
            if best == here {
                break;
            }
        }
        (best, least.sqrt())
    }
}

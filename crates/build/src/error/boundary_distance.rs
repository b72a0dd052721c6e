//! The boundary of the reference mesh, and how far a point is from it.

use crate::geometry::triangle_fan::TriangleFan;
use crate::lattice::quantize::Quantized;
use foldhash::HashMap;
use glam::DVec3;
use tetralod::geom::{Groups, nearest_on_triangle};
use tetralod::mesh::boundary_faces;

/// Of vertices with more triangles than this not all are looked at.
const MANY: usize = 64;

/// The boundary triangles of the reference mesh, in model units.
pub(crate) struct BoundaryDistance {
    triangles: Vec<[DVec3; 3]>,
    corners: Vec<[u32; 3]>,
    /// The triangles at each vertex.
    around: Groups,
    /// The fans of the vertices with more than [`MANY`] triangles.
    fans: HashMap<u32, TriangleFan>,
    /// How many triangles were compared with a point.
    #[cfg(test)]
    pub compared: std::sync::atomic::AtomicU64,
}

impl BoundaryDistance {
    /// Of the triangles without a neighbour.
    pub fn new(tets: &[[u32; 4]], neighbors: &[[u32; 4]], quantized: &Quantized) -> Self {
        let faces = boundary_faces(tets, neighbors).map(|(_, face)| face).collect();
        Self::of(faces, quantized.positions.len(), quantized)
    }

    /// Of these triangles, counter-clockwise when seen from outside, given how many vertices may be asked for besides their corners.
    pub fn of(corners: Vec<[u32; 3]>, vertices: usize, quantized: &Quantized) -> Self {
        let triangles: Vec<_> = corners.iter().map(|face| face.map(|v| quantized.scaled(v))).collect();
        let points = corners.iter().flatten().fold(vertices, |points, &v| points.max(v as usize + 1));
        let around = Groups::new(points, |add| {
            (0..).zip(&corners).for_each(|(t, face)| face.iter().for_each(|v| add(*v as usize, t)));
        });
        let fan = |v: u32| {
            let others = |t: u32| {
                let first = corners[t as usize].iter().position(|&corner| corner == v).unwrap_or(0);
                [1, 2].map(|k| triangles[t as usize][(first + k) % 3])
            };
            TriangleFan::new(quantized.scaled(v), around.of(v as usize), others)
        };
        let with_many = (0..points as u32).filter(|&v| around.of(v as usize).len() > MANY);
        let fans = with_many.map(|v| (v, fan(v))).collect();
        Self {
            triangles,
            corners,
            around,
            fans,
            #[cfg(test)]
            compared: std::sync::atomic::AtomicU64::new(0),
        }
    }

    /// All triangles.
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
        let (mut best, mut least) = (from, self.squared(p, from));
        while least > enough * enough {
            let here = best;
            for &v in &self.corners[here as usize] {
                (best, least) = self.nearer(p, v, (best, least));
            }
            if best == here {
                break;
            }
        }
        (best, least.sqrt())
    }

    /// The triangle at a vertex that is nearest to `p`, the first one of several, and the square of its distance, if that is less than
    /// the one of `known`; else `known`.
    fn nearer(&self, p: DVec3, v: u32, known: (u32, f64)) -> (u32, f64) {
        let all = self.at(v);
        if all.len() > MANY
            && let Some(fan) = self.fans.get(&v)
        {
            return fan.nearer(p, known, |t| self.squared(p, t));
        }
        all.iter().fold(known, |known, &t| {
            let squared = self.squared(p, t);
            if squared < known.1 { (t, squared) } else { known }
        })
    }

    /// The square of how far `p` is from a triangle.
    fn squared(&self, p: DVec3, triangle: u32) -> f64 {
        #[cfg(test)]
        self.compared.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        p.distance_squared(nearest_on_triangle(p, self.triangles[triangle as usize]))
    }
}

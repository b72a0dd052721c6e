//! The boundary of the reference mesh, and how far a point is from it.

use crate::geom::nearest_on_triangle;
use crate::mesh::FACES;
use crate::mesh::NONE;
use glam::DVec3;

/// The boundary triangles of the reference mesh, in model units.
pub(super) struct Skin {
    triangles: Vec<[DVec3; 3]>,
    corners: Vec<[u32; 3]>,
    /// Where the triangles at each vertex start in `around`.
    starts: Vec<u32>,
    around: Vec<u32>,
}

impl Skin {
    pub fn new(tets: &[[u32; 4]], neighbors: &[[u32; 4]], positions: &[DVec3]) -> Self {
        let mut corners: Vec<[u32; 3]> = Vec::new();
        for (tet, around) in tets.iter().zip(neighbors) {
            corners.extend((0..4).filter(|&i| around[i] == NONE).map(|i| FACES[i].map(|j| tet[j])));
        }
        let triangles = corners.iter().map(|face| face.map(|v| positions[v as usize])).collect();
        let mut starts = vec![0_u32; positions.len() + 1];
        corners.iter().flatten().for_each(|&v| starts[v as usize + 1] += 1);
        (1..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
        let mut next = starts.clone();
        let mut around = vec![0; 3 * corners.len()];
        for (t, &v) in corners.iter().enumerate().flat_map(|(t, face)| face.iter().map(move |v| (t, v))) {
            around[next[v as usize] as usize] = t as u32;
            next[v as usize] += 1;
        }
        Self { triangles, corners, starts, around }
    }

    /// The triangles at a vertex of the reference mesh.
    pub fn at(&self, v: u32) -> &[u32] {
        &self.around[self.starts[v as usize] as usize..self.starts[v as usize + 1] as usize]
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

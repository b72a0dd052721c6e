//! Where the input's own points are in the reference mesh on its lattice.
//!
//! Cells may be thinner than the lattice moves points: a point then lies in a cell that does not even have it as a corner. Errors are
//! measured at the input's own points, so each point that the lattice has moved is in the bucket of such a cell from the start.

use super::cost::SLACK;
use super::quantize::Quantized;
use crate::mesh::{MeshError, NONE};
use glam::{DMat3, DVec3};

/// A point of the input, and the cell on the lattice that it lies in or is least outside of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Home {
    pub point: u32,
    pub tet: u32,
    /// Barycentric coordinates there, but for the first one.
    pub lambda: DVec3,
    pub outside: bool,
}

/// The homes of all points that the lattice has moved and that are corners of a cell.
pub(super) fn homes(tets: &[[u32; 4]], quantized: &Quantized) -> Result<Vec<Home>, MeshError> {
    let points = 0..quantized.positions.len() as u32;
    if !points.clone().any(|point| quantized.is_moved(point)) {
        return Ok(Vec::new());
    }
    let neighbors = crate::mesh::neighbors(tets)?;
    let mut first = vec![NONE; quantized.positions.len()];
    for (t, tet) in (0..).zip(tets) {
        tet.iter().for_each(|&v| first[v as usize] = t);
    }
    let mut search = Search { tets, neighbors: &neighbors, quantized, found: Vec::new() };
    let moved = points.filter(|&point| quantized.is_moved(point) && first[point as usize] != NONE);
    Ok(moved.map(|point| search.home(point, first[point as usize])).collect())
}

struct Search<'a> {
    tets: &'a [[u32; 4]],
    neighbors: &'a [[u32; 4]],
    quantized: &'a Quantized,
    /// The cells that have been reached, in this order.
    found: Vec<u32>,
}

impl Search<'_> {
    /// Goes from a cell at the point through all that are near the way from where the lattice has put it to where it was.
    fn home(&mut self, point: u32, first: u32) -> Home {
        let (place, rounded) = (self.quantized.places[point as usize], self.quantized.rounded(point));
        let (low, high) = (place.min(rounded), place.max(rounded));
        self.found.clear();
        self.found.push(first);
        let mut best = Home { point, tet: first, lambda: DVec3::ZERO, outside: true };
        let mut deepest = f64::NEG_INFINITY;
        let mut next = 0;
        while next < self.found.len() {
            let t = self.found[next];
            next += 1;
            let corners = self.tets[t as usize].map(|v| self.quantized.rounded(v));
            let lambda = barycentric(corners) * (place - corners[0]);
            let depth = lambda.min_element().min(1.0 - lambda.element_sum());
            if depth > deepest {
                deepest = depth;
                best = Home { tet: t, lambda, ..best };
            }
            if depth >= 0.0 {
                break;
            }
            for n in self.neighbors[t as usize].into_iter().filter(|&n| n != NONE) {
                let tet = self.tets[n as usize];
                let corners = tet.map(|v| self.quantized.rounded(v));
                let least = corners.into_iter().fold(DVec3::INFINITY, DVec3::min);
                let most = corners.into_iter().fold(DVec3::NEG_INFINITY, DVec3::max);
                let is_near = least.cmple(high).all() && most.cmpge(low).all();
                if is_near && !self.found.contains(&n) {
                    self.found.push(n);
                }
            }
        }
        Home { outside: deepest < -SLACK, ..best }
    }
}

/// `(λ_1, λ_2, λ_3)` of a point are this times its position relative to corner 0.
fn barycentric([a, b, c, d]: [DVec3; 4]) -> DMat3 {
    // Cells are positive on the lattice, so the matrix is regular.
    DMat3::from_cols(b - a, c - a, d - a).inverse()
}

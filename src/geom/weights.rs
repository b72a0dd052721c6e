//! Barycentric coordinates in a tetrahedron on the lattice.

use super::orient3d;
use glam::{DMat3, DVec3};

/// Points are taken to be on the lattice if they are nearer than this, in its steps.
#[doc(hidden)]
pub const ON_LATTICE: f64 = 1e-7;
/// Barycentric coordinates this far below zero are rounding errors of a point on a face. Builders allow for more.
const SIDE_SLACK: f64 = 1e-10;

/// A tetrahedron on the lattice in which points are looked for: most are clearly outside, which is told at little cost.
#[doc(hidden)]
pub struct TetPlaces {
    corners: [[i32; 3]; 4],
    /// For each face a normal inwards, of twice its area, and a corner of the face.
    faces: [(DVec3, DVec3); 4],
    /// A point is outside if it is so far behind a face, as six times the volume between it and the face.
    outside: f64,
    /// For points beside the lattice.
    inverse: DMat3,
}

impl TetPlaces {
    /// The tetrahedron, for points that are in its bounding box or at most a step beside it.
    pub fn new(corners: [[i32; 3]; 4]) -> Self {
        let places @ [a, b, c, d] = corners.map(|q| DVec3::from_array(q.map(f64::from)));
        let face = |i: usize| {
            let [j, k, l] = [1, 2, 3].map(|next| places[(i + next) % 4]);
            let normal = (k - j).cross(l - j);
            (if normal.dot(places[i] - j) < 0.0 { -normal } else { normal }, j)
        };
        let low = places.into_iter().fold(DVec3::INFINITY, DVec3::min);
        let high = places.into_iter().fold(DVec3::NEG_INFINITY, DVec3::max);
        let length = (high - low).max_element() + 2.0;
        let whole = (b - a).cross(c - a).dot(d - a).abs();
        Self {
            corners,
            faces: [0, 1, 2, 3].map(face),
            // No sum of products of three lengths is rounded by more than the first part of this.
            outside: -64.0 * f64::EPSILON * length * length * length - 10.0 * SIDE_SLACK * whole,
            inverse: DMat3::from_cols(b - a, c - a, d - a).inverse(),
        }
    }

    /// The barycentric coordinates of a point that is at `place`, in steps of the lattice, which has it at `position`; none if it is
    /// outside. Decided exactly where the lattice has not moved it.
    pub fn weights(&self, position: [i32; 3], place: DVec3) -> Option<[f64; 4]> {
        if self.faces.iter().any(|(normal, corner)| normal.dot(place - corner) < self.outside) {
            return None;
        }
        if place.distance(DVec3::from_array(position.map(f64::from))) < ON_LATTICE {
            return barycentric(self.corners, position);
        }
        let lambda = self.inverse * (place - DVec3::from_array(self.corners[0].map(f64::from)));
        let weights = [1.0 - lambda.element_sum(), lambda.x, lambda.y, lambda.z];
        weights.iter().all(|&weight| weight >= -SIDE_SLACK).then_some(weights)
    }
}

/// The barycentric coordinates of `p`; none if it is outside the tetrahedron.
fn barycentric([a, b, c, d]: [[i32; 3]; 4], p: [i32; 3]) -> Option<[f64; 4]> {
    let parts = [orient3d(p, b, c, d), orient3d(a, p, c, d), orient3d(a, b, p, d), orient3d(a, b, c, p)];
    let whole: i128 = parts.iter().sum();
    let inside = whole > 0 && parts.iter().all(|&part| part >= 0);
    inside.then(|| parts.map(|part| part as f64 / whole as f64))
}

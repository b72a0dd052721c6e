//! Barycentric coordinates in a tetrahedron on the lattice.

use super::orient3d;
use glam::{DMat3, DVec3};

/// Points are taken to be on the lattice if they are nearer than this, in its steps.
pub(crate) const ON_LATTICE: f64 = 1e-7;
/// Barycentric coordinates this far below zero are rounding errors of a point on a face. Builders allow for more.
const SIDE_SLACK: f64 = 1e-10;

/// The barycentric coordinates of a point that is at `place`, in steps of the lattice, which has it at `position`; none if it is
/// outside the tetrahedron. Decided exactly where the lattice has not moved it.
pub(crate) fn weights_at(corners: [[i32; 3]; 4], position: [i32; 3], place: DVec3) -> Option<[f64; 4]> {
    let at = |q: [i32; 3]| DVec3::from_array(q.map(f64::from));
    if place.distance(at(position)) < ON_LATTICE {
        return barycentric(corners, position);
    }
    let [a, b, c, d] = corners.map(at);
    let lambda = DMat3::from_cols(b - a, c - a, d - a).inverse() * (place - a);
    let weights = [1.0 - lambda.element_sum(), lambda.x, lambda.y, lambda.z];
    weights.iter().all(|&weight| weight >= -SIDE_SLACK).then_some(weights)
}

/// The barycentric coordinates of `p`; none if it is outside the tetrahedron.
fn barycentric([a, b, c, d]: [[i32; 3]; 4], p: [i32; 3]) -> Option<[f64; 4]> {
    let parts = [orient3d(p, b, c, d), orient3d(a, p, c, d), orient3d(a, b, p, d), orient3d(a, b, c, p)];
    let whole: i128 = parts.iter().sum();
    let inside = whole > 0 && parts.iter().all(|&part| part >= 0);
    inside.then(|| parts.map(|part| part as f64 / whole as f64))
}

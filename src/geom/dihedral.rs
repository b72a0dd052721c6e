//! Dihedral angles of tetrahedra, by basic arithmetic alone: the same on every platform.

use glam::DVec3;

/// The faces of a tetrahedron, all ordered alike: as seen from outside, or all from inside.
const SIDES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// How sharp the sharpest edge of a tetrahedron is: the square of the cosine of its smallest dihedral angle, with the sign of the cosine.
/// It is 1 where two faces lie on each other, and where a face has no area; the larger the angle is, the less it is.
pub fn sharpness(corners: [DVec3; 4]) -> f64 {
    let normals = SIDES.map(|side| {
        let [a, b, c] = side.map(|i| corners[i]);
        (b - a).cross(c - a)
    });
    let squares = normals.map(|n| n.dot(n));
    let mut largest = -1.0_f64;
    for i in 1..4 {
        for j in 0..i {
            let across = -normals[i].dot(normals[j]);
            let product = squares[i] * squares[j];
            let square = if product > 0.0 { across * across.abs() / product } else { 1.0 };
            largest = largest.max(square);
        }
    }
    largest.min(1.0)
}

#[cfg(test)]
mod tests {
    use super::sharpness;
    use glam::DVec3;

    fn of(corners: [[f64; 3]; 4]) -> f64 {
        sharpness(corners.map(DVec3::from))
    }

    #[test]
    fn known_angles() {
        // Regular: the cosine is 1/3.
        let regular = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
        assert!((of(regular) - 1.0 / 9.0).abs() < 1e-15);
        // The corner of a cube: three angles of 90 degrees, three with a cosine of 1/√3.
        let corner = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert!((of(corner) - 1.0 / 3.0).abs() < 1e-15);
        // Of a cube cut into six: 45 degrees.
        let kuhn = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0; 3]];
        assert!((of(kuhn) - 0.5).abs() < 1e-15);
    }

    #[test]
    fn flat_ones_are_the_sharpest_and_order_does_not_matter() {
        let flat = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.3, 0.0]];
        assert_eq!(of(flat), 1.0);
        assert_eq!(of([[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]]), 1.0);
        let thin = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.3, 0.01]];
        let [a, b, c, d] = thin;
        assert!(of(thin) > 0.99 && of(thin) < 1.0);
        assert!((of([b, a, c, d]) - of(thin)).abs() < 1e-12);
    }
}

//! Vectors that displace a mesh. They are linear in each tetrahedron, as fields are, so each point of a surface that was cut out of the mesh
//! goes where the surface of the displaced mesh has it.

use glam::{DMat3, DVec3};

/// The derivatives of a vector field along x, y and z.
pub type Slope = [[f64; 3]; 3];

/// The slope in a tetrahedron of vectors at its corners; 0 in one without volume.
pub(super) fn slope(corners: [[f64; 3]; 4], vectors: [[f64; 3]; 4]) -> Slope {
    let from_first = |all: [[f64; 3]; 4]| {
        let [first, others @ ..] = all.map(DVec3::from);
        DMat3::from_cols(others[0] - first, others[1] - first, others[2] - first)
    };
    let slope = from_first(vectors) * from_first(corners).inverse();
    if slope.is_finite() { slope.to_cols_array_2d() } else { [[0.0; 3]; 3] }
}

/// The normal of a surface after it was displaced by so many times vectors of this slope. Twin: `vs` in `surface.wgsl` of the renderer.
pub(super) fn turned(normal: [f32; 3], slope: &Slope, times: f64) -> [f32; 3] {
    // Areas turn with the cofactors of what happens to edges.
    let [x, y, z] = [0, 1, 2].map(|i| DVec3::AXES[i] + times * DVec3::from(slope[i]));
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    let turned = cofactors * DVec3::from(normal.map(f64::from));
    let unit = turned / turned.length();
    if unit.is_finite() { unit.as_vec3().to_array() } else { normal }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [[f64; 3]; 4] = [[0.5, 0.0, 0.0], [2.0, 0.25, 0.0], [0.0, 1.5, 0.5], [0.25, 0.0, 1.0]];
    const MAP: [[f64; 3]; 3] = [[0.5, -0.25, 0.125], [1.0, 0.75, -0.5], [0.25, 0.5, -1.0]];

    fn image(p: [f64; 3]) -> [f64; 3] {
        (DMat3::from_cols_array_2d(&MAP) * DVec3::from(p)).into()
    }

    #[test]
    fn slopes_of_linear_vectors_are_their_matrix() {
        let slope = slope(CORNERS, CORNERS.map(image));
        for (found, known) in slope.iter().flatten().zip(MAP.iter().flatten()) {
            assert!((found - known).abs() < 1e-14, "{slope:?}");
        }
        assert_eq!(super::slope([[1.0; 3]; 4], CORNERS), [[0.0; 3]; 3]);
    }

    #[test]
    fn normals_turn_as_their_faces_do() {
        let face = [CORNERS[0], CORNERS[1], CORNERS[2]];
        let normal = |corners: [[f64; 3]; 3]| {
            let [a, b, c] = corners.map(DVec3::from);
            (b - a).cross(c - a).normalize()
        };
        for times in [0.0, 0.3, 1.0, -0.5] {
            let moved = face.map(|p| [0, 1, 2].map(|i| p[i] + times * image(p)[i]));
            let found = turned(normal(face).as_vec3().to_array(), &MAP, times);
            let off = (DVec3::from(found.map(f64::from)) - normal(moved)).length();
            assert!(off < 1e-6, "{times}: {off}");
        }
        // What nothing displaces keeps its bits.
        assert_eq!(turned([0.6, 0.8, 0.0], &[[0.0; 3]; 3], 5.0), [0.6, 0.8, 0.0]);
    }
}

//! How good the cells of a mesh are.

use glam::DVec3;
use tetralod::mesh::TetMesh;

/// Cells whose smallest dihedral angle is less are counted as thin.
const THIN_DEGREES: f64 = 5.0;

/// What is to be said of the cells, as members of a JSON object: how many there are, how many are flat or turned over, their volume,
/// and how thin they are.
pub fn report(mesh: &TetMesh) -> String {
    let (mut turned, mut volume, mut thin) = (0_usize, 0.0, 0_usize);
    for tet in &mesh.tets {
        let corners = tet.map(|v| DVec3::from(mesh.positions[v as usize]));
        let signed = signed_volume(corners);
        turned += usize::from(signed <= 0.0);
        volume += signed.abs();
        thin += usize::from(smallest_angle(corners) < THIN_DEGREES);
    }
    let count = mesh.tets.len();
    format!("\"tets\": {count}, \"turned\": {turned}, \"volume\": {volume:e}, \"thin\": {thin}")
}

fn signed_volume([a, b, c, d]: [DVec3; 4]) -> f64 {
    (b - a).cross(c - a).dot(d - a) / 6.0
}

/// The smallest of the six dihedral angles, in degrees; 0 for a flat cell.
fn smallest_angle(corners: [DVec3; 4]) -> f64 {
    let normals = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]].map(|face: [usize; 3]| {
        let [a, b, c] = face.map(|i| corners[i]);
        (b - a).cross(c - a).normalize_or_zero()
    });
    let pairs = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
    let cosines = pairs.map(|[i, j]: [usize; 2]| -normals[i].dot(normals[j]));
    cosines.into_iter().fold(-1.0, f64::max).clamp(-1.0, 1.0).acos().to_degrees()
}

//! The largest error of a mesh at the reference vertices, by comparing each with everything.

use super::border;
use tetralod::mesh::TetMesh;
use tetralod::mt::{CurrentMesh, MultiTessellation};

type Point = [f64; 3];

/// Asserts that the field at every vertex of the reference mesh, where the input has it, is within `epsilon` (or what the
/// lattices round off, where that is more): in a tetrahedron around it, or at a place of the boundary so near that its
/// distance is worth no more.
pub fn assert_within(reference: &TetMesh, mt: &impl MultiTessellation, mesh: &CurrentMesh, epsilon: f64) {
    let info = mt.info();
    let rounding = (0..info.fields.len()).map(|f| info.floor(f)).fold(0.0, f64::max);
    let allowed = epsilon.max(rounding) + 1e-9;
    let tets: Vec<[u32; 4]> = (0..mesh.tet_slots() as u32).filter_map(|t| mesh.tet(t)).collect();
    let border = border(&tets);
    for (i, p) in reference.positions.iter().enumerate() {
        let at = [0, 1, 2].map(|k| (p[k] - info.lattice.origin[k]) / info.lattice.step[k]);
        // The largest difference of any field, interpolated from these slots.
        let difference = |slots: &[u32], weights: &[f64]| {
            let fields = info.fields.iter().zip(&reference.fields).enumerate();
            let differences = fields.map(|(f, (field, wanted))| {
                let values = slots.iter().map(|&v| field.value(mesh.levels(v)[f]));
                let value: f64 = values.zip(weights).map(|(value, weight)| value * weight).sum();
                (value - wanted.values[i]).abs() / field.range()
            });
            differences.fold(0.0, f64::max)
        };
        let inside = tets.iter().filter_map(|tet| {
            let weights = barycentric(tet.map(|v| mesh.positions()[v as usize]), at)?;
            Some(difference(tet, &weights))
        });
        let mut least = inside.fold(f64::INFINITY, f64::min);
        if least > allowed {
            for face in &border {
                let corners = face.map(|v| info.lattice.point(mesh.positions()[v as usize]));
                let (distance, weights) = nearest(*p, corners);
                let displaced = if distance > 1e-9 { distance / info.displacement_per_error } else { 0.0 };
                least = least.min(difference(face, &weights).max(displaced));
            }
        }
        assert!(least <= allowed, "reference vertex {i} at {p:?}: {least}, more than {allowed}");
    }
}

/// Barycentric coordinates of a point in steps of the lattice; none outside.
fn barycentric(corners: [[i32; 3]; 4], p: Point) -> Option<[f64; 4]> {
    let [a, b, c, d] = corners.map(|corner| corner.map(f64::from));
    let volume6 = |[a, b, c, d]: [Point; 4]| {
        let (u, v, w) = (minus(b, a), minus(c, a), minus(d, a));
        let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        dot(cross, w)
    };
    let whole = volume6([a, b, c, d]);
    let parts = [[p, b, c, d], [a, p, c, d], [a, b, p, d], [a, b, c, p]].map(|tet| volume6(tet) / whole);
    parts.iter().all(|&part| part >= -1e-9).then_some(parts)
}

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The distance of a point from a triangle, and the weights of the corners at the nearest place: that in the plane if it
/// lies in the triangle, else the best on its sides.
fn nearest(p: Point, corners: [Point; 3]) -> (f64, [f64; 3]) {
    let [a, b, c] = corners;
    let (u, v, w) = (minus(b, a), minus(c, a), minus(p, a));
    let (uu, uv, vv, uw, vw) = (dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w));
    let area = uu * vv - uv * uv;
    let (s, t) = ((vv * uw - uv * vw) / area, (uu * vw - uv * uw) / area);
    let mut choices = Vec::new();
    if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
        choices.push([1.0 - s - t, s, t]);
    }
    for i in 0..3 {
        let j = (i + 1) % 3;
        let side = minus(corners[j], corners[i]);
        let x = (dot(minus(p, corners[i]), side) / dot(side, side)).clamp(0.0, 1.0);
        let mut weights = [0.0; 3];
        (weights[i], weights[j]) = (1.0 - x, x);
        choices.push(weights);
    }
    let distance = |weights: &[f64; 3]| {
        let q = [0, 1, 2].map(|k| (0..3).map(|i| weights[i] * corners[i][k]).sum());
        let away = minus(p, q);
        dot(away, away).sqrt()
    };
    let all = choices.into_iter().map(|weights| (distance(&weights), weights));
    all.min_by(|a, b| a.0.total_cmp(&b.0)).expect("a triangle has sides")
}

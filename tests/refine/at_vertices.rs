//! What an extracted mesh shows at the vertices of the input, found by plain search.

use tetralod::mesh::TetMesh;
use tetralod::mt::{CurrentMesh, Mt, MtInfo, MultiTessellation};
use tetralod::refine::{Front, LodCriterion, Request};

/// The mesh within an error, and the bound that it keeps.
pub fn refined(mt: &Mt, error: f64) -> (Front, f64) {
    let mut front = Front::new(mt).expect("a valid base mesh");
    let request = Request::within(error);
    let criterion = LodCriterion::new(mt.info(), &request);
    let outcome = front.satisfy(mt, &criterion, request.budget).expect("a valid MT");
    (front, outcome.error.error())
}

/// How much the first field differs, as a fraction of its range, at each vertex of the input that is inside the mesh.
pub fn errors_inside(info: &MtInfo, mesh: &CurrentMesh, input: &TetMesh) -> Vec<f64> {
    let mut least = vec![f64::INFINITY; input.positions.len()];
    for tet in mesh.tets() {
        let [a, b, c, d] = tet.map(|v| info.lattice.point(mesh.positions()[v as usize]));
        let low = [0, 1, 2].map(|i| a[i].min(b[i]).min(c[i]).min(d[i]));
        let high = [0, 1, 2].map(|i| a[i].max(b[i]).max(c[i]).max(d[i]));
        let whole = volume(a, b, c, d);
        for (i, &p) in input.positions.iter().enumerate() {
            if (0..3).any(|k| p[k] < low[k] || p[k] > high[k]) {
                continue;
            }
            let weights = [volume(p, b, c, d), volume(a, p, c, d), volume(a, b, p, d), volume(a, b, c, p)];
            let weights = weights.map(|part| part / whole);
            if weights.iter().all(|&weight| weight >= -1e-9) {
                let levels = tet.iter().zip(weights);
                let shown: f64 = levels.map(|(&v, w)| w * info.fields[0].value(mesh.levels(v)[0])).sum();
                least[i] = least[i].min((shown - input.fields[0].values[i]).abs() / info.fields[0].range());
            }
        }
    }
    least.into_iter().filter(|error| error.is_finite()).collect()
}

/// Six times the volume.
fn volume(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> f64 {
    let [u, v, w] = [b, c, d].map(|q| [q[0] - a[0], q[1] - a[1], q[2] - a[2]]);
    u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0])
        + u[2] * (v[0] * w[1] - v[1] * w[0])
}

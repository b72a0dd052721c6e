//! Promise: what a build is for shows in its meshes.

use std::ops::ControlFlow;
use tetralod::mesh::TetMesh;
use tetralod::mt::{CurrentMesh, Mt, MtInfo, MultiTessellation};
use tetralod::refine::{Front, LodCriterion, Request};
use tetralod_build::{BuildConfig, Construction, Purpose, build};
use tetralod_io::generate;

fn built(mesh: &TetMesh, purpose: Purpose) -> Mt {
    let config = BuildConfig { construction: Construction::HalfEdge { purpose }, ..BuildConfig::default() };
    build(mesh, &config, &mut |_| ControlFlow::Continue(())).expect("a mesh to build on").mt
}

/// The field in a tetrahedron at a point, if the point is inside.
fn value(corners: [[f64; 3]; 4], values: [f64; 4], p: [f64; 3]) -> Option<f64> {
    let [u, v, w, x] =
        [corners[1], corners[2], corners[3], p].map(|q| [0, 1, 2].map(|k| q[k] - corners[0][k]));
    let det = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| {
        a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
    };
    let whole = det(u, v, w);
    let [b, c, d] = [det(x, v, w), det(u, x, w), det(u, v, x)].map(|part| part / whole);
    let weights = [1.0 - b - c - d, b, c, d];
    let is_inside = weights.iter().all(|weight| *weight >= -1e-9);
    is_inside.then(|| weights.iter().zip(values).map(|(weight, value)| weight * value).sum())
}

/// The root of the mean square of the differences from the field of a convex reference mesh, at its points.
fn mean_error(reference: &TetMesh, info: &MtInfo, mesh: &CurrentMesh) -> f64 {
    let field = &info.fields[0];
    let mut sum = 0.0;
    for (p, expected) in reference.positions.iter().zip(&reference.fields[0].values) {
        let found = mesh.tets().iter().find_map(|tet| {
            let corners = tet.map(|v| info.lattice.point(mesh.positions()[v as usize]));
            value(corners, tet.map(|v| field.origin + field.step * f64::from(mesh.levels(v)[0])), *p)
        });
        sum += (found.expect("the domain is covered") - expected).powi(2);
    }
    (sum / reference.positions.len() as f64).sqrt() / field.range()
}

#[test]
fn a_build_for_the_mean_has_less_of_it_at_the_same_budget() {
    let mesh = generate::bucky(17).expect("a size that is known");
    let [uniform, mean] = [Purpose::Uniform, Purpose::Mean].map(|purpose| built(&mesh, purpose));
    let mut ratio = 1.0;
    for budget in [2000, 1000, 500] {
        let [uniform, mean] = [&uniform, &mean].map(|mt| {
            let mut front = Front::new(mt).expect("a valid base mesh");
            let request = Request::within(0.0).at_most(budget);
            front.satisfy(mt, &LodCriterion::new(mt.info(), &request), request.budget).expect("a valid MT");
            mean_error(&mesh, mt.info(), front.mesh())
        });
        println!("{budget} tetrahedra: {uniform} and {mean}");
        ratio *= mean / uniform;
    }
    assert!(ratio < 0.97_f64.powi(3), "{ratio}");
}

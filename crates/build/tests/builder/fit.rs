//! Promise: fitted values are nearer to the reference than those of the mesh, and the differences that are reported are those that are left.

use std::ops::ControlFlow;
use tetralod::mesh::TetMesh;
use tetralod::mt::{Mt, MtKind, MultiTessellation};
use tetralod::refine::{Front, LodCriterion, Request};
use tetralod_build::measure::{Part, Reference, deviation, fit};
use tetralod_build::{BuildConfig, Construction, build};
use tetralod_io::generate;

fn built(mesh: &TetMesh, kind: MtKind) -> Mt {
    let config = BuildConfig { construction: Construction::default_for(kind), ..BuildConfig::of(kind) };
    build(mesh, &config, &mut |_| ControlFlow::Continue(())).expect("a mesh to build on").mt
}

fn front(mt: &Mt, request: &Request) -> Front {
    let mut front = Front::new(mt).expect("a valid base mesh");
    front.satisfy(mt, &LodCriterion::new(mt.info(), request), request.budget).expect("a valid MT");
    front
}

fn of(mesh: &TetMesh) -> Reference<'_> {
    Reference { positions: &mesh.positions, values: &mesh.fields[0].values, field: 0 }
}

#[test]
fn the_mean_gets_smaller_and_the_largest_hardly_larger() {
    let mesh = generate::bucky(17).expect("a size that is known");
    for kind in [MtKind::HalfEdge, MtKind::Edge] {
        let mt = built(&mesh, kind);
        for budget in [4000, 2000, 1000, 500] {
            let front = front(&mt, &Request::within(0.0).at_most(budget));
            let found = fit(mt.info(), front.mesh(), &of(&mesh));
            println!("{kind:?} {budget}: {:?} and {:?}", found.before, found.after);
            assert_eq!(found.values.len(), front.mesh().positions().len());
            assert!(found.after.root_mean_square < 0.93 * found.before.root_mean_square);
            assert!(found.after.largest < 1.25 * found.before.largest);
            let measured = deviation(mt.info(), front.mesh(), &of(&mesh), &Part::default());
            assert!((measured.field - found.before.largest).abs() < 1e-9 * mt.info().fields[0].range());
            assert_eq!(found, fit(mt.info(), front.mesh(), &of(&mesh)), "the same again");
        }
    }
}

/// A reference that some values at the vertices fit exactly: they are found.
#[test]
fn values_that_fit_exactly_are_found() {
    let mut mesh = generate::bucky(9).expect("a size that is known");
    let mt = built(&mesh, MtKind::HalfEdge);
    let front = front(&mt, &Request::within(0.05));
    let range = mt.info().fields[0].range();
    // Any linear function is linear in each tetrahedron.
    let linear = |p: &[f64; 3]| range * (0.25 + 0.5 * p[0] - 0.125 * p[1] + 0.25 * p[2]);
    let positions = mesh.positions.clone();
    mesh.fields[0].values = positions.iter().map(linear).collect();
    let found = fit(mt.info(), front.mesh(), &of(&mesh));
    assert!(found.before.largest > 0.1 * range);
    assert!(found.after.largest < 0.01 * range, "{:?}", found.after);
    for (q, value) in front.mesh().positions().iter().zip(&found.values) {
        let expected = linear(&mt.info().lattice.point(*q));
        assert!((value - expected).abs() < 0.01 * range, "{value} {expected}");
    }
}

#[test]
fn what_fits_already_stays() {
    let mesh = generate::bucky(9).expect("a size that is known");
    let mt = built(&mesh, MtKind::HalfEdge);
    let front = front(&mt, &Request::within(0.05));
    let field = &mt.info().fields[0];
    let own: Vec<f64> = front
        .mesh()
        .positions()
        .iter()
        .enumerate()
        .map(|(v, _)| field.value(front.mesh().levels(v as u32)[0]))
        .collect();
    let at: Vec<[f64; 3]> = front.mesh().positions().iter().map(|q| mt.info().lattice.point(*q)).collect();
    let reference = Reference { positions: &at, values: &own, field: 0 };
    let found = fit(mt.info(), front.mesh(), &reference);
    assert_eq!((found.after.largest, found.before.largest), (0.0, 0.0));
    assert_eq!(found.values, own);
    // Where there is no point at all, too.
    let nothing = fit(mt.info(), front.mesh(), &Reference { positions: &[], values: &[], field: 0 });
    assert_eq!(nothing.values, own);
}

//! Promise: what is built from any valid mesh keeps every promise, and is the same each time.

use crate::support::meshes::{bent, blocks, built, cube, hilly, linear};
use std::ops::ControlFlow;
use tetralod::format::{EncodeOptions, encode};
use tetralod::geom::orient3d;
use tetralod::mesh::TetMesh;
use tetralod::mt::{EdgeMt, ExplicitMt, MtKind, MultiTessellation, UpdateId, check_errors};
use tetralod::refine::{Front, LodCriterion, Outcome, Request};
use tetralod_build::verify;
use tetralod_build::verify::Reference;
use tetralod_build::{BuildConfig, BuildError, FieldPrecision, build, edge_mt};
use tetralod_io::generate;

fn refined(mt: &EdgeMt, request: &Request) -> (Front, Outcome) {
    let mut front = Front::new(mt).expect("a valid base mesh");
    let criterion = LodCriterion::new(mt.info(), request);
    let outcome = front.satisfy(mt, &criterion, request.budget).expect("a valid MT");
    (front, outcome)
}

fn uniform(error: f64) -> Request {
    Request::within(error)
}

/// Six times the volume on the lattice.
fn volume(front: &Front) -> i128 {
    let mesh = front.mesh();
    let six = |tet: &[u32; 4]| {
        let [a, b, c, d] = tet.map(|v| mesh.positions()[v as usize]);
        orient3d(a, b, c, d)
    };
    mesh.tets().iter().map(six).sum()
}

/// Builds, verifies, and checks the MT as such. Returns it.
fn keeps_its_promises(name: &str, mesh: &TetMesh) -> EdgeMt {
    let mt = built(mesh).mt;
    let report = verify::run(&mt, mesh, Reference::Mesh, &mut |_, _| {});
    assert!(report.valid && report.failures.is_empty(), "{name}: {:#?}", report.failures);
    assert!(report.queries >= 30 && report.worst_error_ratio <= 1.0, "{name}: {report:?}");
    let explicit = ExplicitMt::of(&mt).expect("a valid MT");
    assert_eq!(explicit.check(), Ok(()), "{name}");
    mt
}

#[test]
fn generated_data() {
    keeps_its_promises("bucky", &generate::bucky(10).expect("a size that is known"));
    let mt = keeps_its_promises("sphere-flow", &generate::sphere_flow(5).expect("a size that is known"));
    assert_eq!(mt.info().fields.len(), 2);
}

#[test]
fn flat_and_curved_domains_of_every_shape() {
    let ell = |c: [u32; 3]| c[0] < 3 || c[1] < 3;
    let ring = |c: [u32; 3]| !((2..4).contains(&c[0]) && (2..4).contains(&c[1]));
    let hollow = |c: [u32; 3]| !c.iter().all(|&x| (2..4).contains(&x));
    let apart = |c: [u32; 3]| c[0] != 3;
    keeps_its_promises("L", &blocks([6, 6, 3], &[hilly], ell));
    keeps_its_promises("ring", &blocks([6, 6, 3], &[hilly], ring));
    keeps_its_promises("hollow", &blocks([6; 3], &[hilly], hollow));
    keeps_its_promises("two components", &blocks([7, 4, 4], &[hilly], apart));
    keeps_its_promises("bent", &bent(7));
    keeps_its_promises("one cell", &cube(1, &[hilly]));
    keeps_its_promises("a constant field", &cube(5, &[|_| 7.0]));
    keeps_its_promises("three fields", &cube(6, &[hilly, linear, |p| (9.0 * p[0]).sin()]));
}

#[test]
fn parts_that_touch_keep_their_common_vertices() {
    let corner = |c: [u32; 3]| (c[0] < 3) == (c[1] < 3) && (c[1] < 3) == (c[2] < 3);
    let edge = |c: [u32; 3]| (c[0] < 3) == (c[1] < 3);
    for (name, mesh) in
        [("at a corner", blocks([6; 3], &[hilly], corner)), ("at an edge", blocks([6; 3], &[hilly], edge))]
    {
        let mt = keeps_its_promises(name, &mesh);
        let places: Vec<[f64; 3]> = mt.base().positions.iter().map(|&q| mt.info().lattice.point(q)).collect();
        let levels =
            if name == "at a corner" { vec![0.5] } else { (0..=6).map(|z| f64::from(z) / 6.0).collect() };
        for z in levels {
            let is_there = |p: &[f64; 3]| [0.5, 0.5, z].iter().zip(p).all(|(a, b)| (a - b).abs() < 1e-4);
            assert!(places.iter().any(is_there), "{name}: the vertex at height {z} is gone");
        }
    }
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    for mesh in [generate::bucky(9).expect("a size that is known"), bent(5)] {
        let [first, second] = [built(&mesh), built(&mesh)];
        assert_eq!(first.mt, second.mt);
        assert_eq!(first.summary, second.summary);
        let bytes =
            [first, second].map(|b| encode(&b.mt.into(), &EncodeOptions::default()).expect("a whole MT"));
        assert_eq!(bytes[0], bytes[1]);
    }
}

#[test]
fn flat_boundaries_stay_exactly_where_they_are() {
    let ell = |c: [u32; 3]| c[0] < 4 || c[1] < 4;
    for mesh in [cube(8, &[hilly]), blocks([8, 8, 4], &[hilly], ell), blocks([8, 3, 5], &[hilly], |_| true)] {
        let mt = built(&mesh).mt;
        let whole = volume(&refined(&mt, &uniform(0.0)).0);
        for error in [0.0005, 0.002, 0.005, 0.01, 0.02, 0.05] {
            let (front, outcome) = refined(&mt, &uniform(error));
            assert!(outcome.satisfied && front.mesh().tet_count() < mesh.tets.len());
            assert_eq!(volume(&front), whole, "error {error}");
        }
    }
}

#[test]
fn a_linear_field_in_a_box_needs_next_to_nothing() {
    let mesh = cube(8, &[linear]);
    let result = built(&mesh);
    let (front, _) = refined(&result.mt, &uniform(0.001));
    assert!(front.mesh().tet_count() < 100, "{} tetrahedra", front.mesh().tet_count());
    assert_eq!(volume(&front), volume(&refined(&result.mt, &uniform(0.0)).0));
    // Corners stay, and creases and sides between them cannot be collapsed onto them: 8, 12, 6 and one inside.
    assert!(result.summary.base_vertices <= 27, "{:?}", result.summary);
}

#[test]
fn a_convex_grid_gets_a_small_base_mesh() {
    let summary = built(&generate::bucky(17).expect("a size that is known")).summary;
    assert_eq!((summary.vertices, summary.tetrahedra), (17 * 17 * 17, 6 * 16 * 16 * 16));
    assert_eq!(summary.vertices, summary.base_vertices + summary.updates);
    assert!(summary.base_vertices < 200, "{summary:?}");
}

#[test]
fn a_larger_budget_is_never_worse() {
    let mesh = generate::bucky(10).expect("a size that is known");
    let mt = built(&mesh).mt;
    let (least, all) = (mt.base().tets.len() as u32, mt.info().tetrahedra as u32);
    let mut last = f64::INFINITY;
    for part in 0..=20 {
        let budget = least + (all - least) * part / 20;
        let (front, outcome) = refined(&mt, &Request::within(0.0).at_most(budget));
        assert!(front.mesh().tet_count() <= budget as usize);
        assert!(outcome.error.error() <= last, "{budget}: {} after {last}", outcome.error.error());
        assert_eq!(outcome.satisfied, outcome.error.error() == 0.0);
        last = outcome.error.error();
    }
    assert_eq!(last, 0.0);
}

#[test]
fn errors_fall_and_are_never_zero() {
    for kind in MtKind::ALL {
        let config = BuildConfig::of(kind);
        let built = build(&cube(5, &[|_| 7.0]), &config);
        let mt = built.expect("a valid mesh").mt;
        assert!(mt.updates() > 100);
        // Error 0 means the reference mesh, even where a coarser one is as good.
        assert!((0..mt.updates()).all(|u| mt.error(UpdateId(u)).error() > 0.0), "{}", kind.name());
        // They never grow from an update to those that depend on it.
        assert_eq!(check_errors(&mt), Ok(None), "{}", kind.name());
    }
}

#[test]
fn what_cannot_be_built_is_refused() {
    let refusal = |mesh: &TetMesh, config: BuildConfig| {
        edge_mt(mesh, &config, &mut |_| ControlFlow::Continue(())).expect_err("refused")
    };
    let default = BuildConfig::default;
    let good = cube(3, &[hilly]);
    let without_tets = TetMesh { tets: Vec::new(), ..good.clone() };
    assert!(matches!(refusal(&without_tets, default()), BuildError::Empty | BuildError::Mesh(_)));
    assert_eq!(refusal(&TetMesh { fields: Vec::new(), ..good.clone() }, default()), BuildError::NoField);
    let unknown = BuildConfig { fields: vec!["nothing".into()], ..default() };
    assert!(matches!(refusal(&good, unknown), BuildError::UnknownField { known, .. } if known == ["f0"]));
    let mut not_finite = good.clone();
    not_finite.fields[0].values[5] = f64::NAN;
    assert_eq!(refusal(&not_finite, default()), BuildError::NotFinite { point: 5 });
    let few = BuildConfig { position_bits: Some(1), ..default() };
    assert!(matches!(refusal(&bent(5), few), BuildError::TooThin { bits: 1, .. }));
    for (position_bits, field_bits) in [(Some(0), 16), (Some(31), 16), (None, 0), (None, 25)] {
        let field_precision = FieldPrecision::Bits(field_bits);
        let config = BuildConfig { position_bits, field_precision, ..default() };
        assert!(matches!(refusal(&good, config), BuildError::Option { .. }));
    }
    let mut inverted = good.clone();
    inverted.tets[0].swap(0, 1);
    assert!(matches!(refusal(&inverted, default()), BuildError::Mesh(_)));
}

#[test]
fn a_build_can_be_stopped_at_any_time() {
    let mesh = cube(12, &[hilly]);
    let mut calls = 0;
    let finished = edge_mt(&mesh, &BuildConfig::of(MtKind::Edge), &mut |_| {
        calls += 1;
        ControlFlow::Continue(())
    });
    assert!(finished.is_ok() && calls > 2, "{calls} calls");
    for stop in [1, calls / 2, calls] {
        let mut left = stop;
        let stopped = edge_mt(&mesh, &BuildConfig::of(MtKind::Edge), &mut |_| {
            left -= 1;
            if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        assert_eq!(stopped.err(), Some(BuildError::Stopped));
    }
}

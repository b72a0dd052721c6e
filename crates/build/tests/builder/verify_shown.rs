//! Promise: what a session shows — arrays, probes, sections, isosurfaces — is the mesh itself, however large coordinates and values are
//! beside the size of the model and the range of the field; `verify` says so, and finds where it is not.

use crate::support::files::{encoded, options};
use crate::support::meshes::{bent, blocks, hilly, linear};
use tetralod::mesh::TetMesh;
use tetralod::mt::MtKind;
use tetralod::session::Session;
use tetralod_build::verify::{self, Reference};
use tetralod_build::{BuildConfig, build};

/// What `verify` finds in what is shown of an MT file of a mesh.
fn check(name: &str, mesh: &TetMesh, kind: MtKind) {
    let fields = mesh.fields.iter().map(|field| field.name.clone()).collect();
    let config = BuildConfig { fields, ..BuildConfig::of(kind) };
    let mt = build(mesh, &config).expect("a mesh to build on").mt;
    let bytes = encoded(&mt, &options()).expect("an MT to write");
    let mut session = Session::new();
    session.feed(&bytes).expect("a valid file");
    session.finish().expect("all of it");
    let report = verify::run_shown(&mut session, mesh, Reference::Mesh);
    assert!(report.valid && report.queries == 3, "{name}, {}: {:#?}", kind.name(), report.failures);
}

fn both(name: &str, mesh: &TetMesh) {
    for kind in [MtKind::HalfEdge, MtKind::Edge] {
        check(name, mesh, kind);
    }
}

fn cube() -> TetMesh {
    blocks([8, 7, 6], &[hilly, linear], |_| true)
}

/// The mesh in other units and somewhere else.
fn moved(mut mesh: TetMesh, size: f64, origin: [f64; 3]) -> TetMesh {
    mesh.grid = None;
    mesh.positions.iter_mut().for_each(|p| *p = [0, 1, 2].map(|i| origin[i] + size * p[i]));
    mesh
}

fn valued(mut mesh: TetMesh, of: impl Fn(f64) -> f64) -> TetMesh {
    mesh.fields.iter_mut().for_each(|field| field.values.iter_mut().for_each(|x| *x = of(*x)));
    mesh
}

#[test]
fn plain_models() {
    both("a cube", &cube());
    both("a bent one", &bent(6));
}

#[test]
fn models_in_utm_coordinates() {
    for size in [35_000.0, 35.0, 0.35] {
        both(&format!("{size} m"), &moved(bent(6), size, [448_262.0, 5_800_123.0, 87.0]));
        both(&format!("cube of {size} m"), &moved(cube(), size, [-448_262.0, -5_800_123.0, 1e3]));
    }
}

#[test]
fn values_with_a_large_offset() {
    both("seconds since 1970", &valued(cube(), |x| 1.7e9 + (3.0 * x).round()));
    both("a pressure", &valued(cube(), |x| 101_325.0 + 1e-4 * (2.0 * x - 1.0)));
    both("a year", &valued(bent(5), |x| 2024.0 + x / 365.0));
}

#[test]
fn values_beyond_single_precision() {
    both("very large", &valued(cube(), |x| 1e40 * (x + 1.0)));
    both("very small", &valued(cube(), |x| 1e-45 * x));
    both("both signs", &valued(cube(), |x| 1e50 * (x - 0.5)));
}

//! Promise: errors are bounded where the input has its vertices, not only where the lattice has put them, also where cells are so thin
//! that the one is far from the other.

use crate::at_vertices::{errors_inside, refined};
use crate::support::meshes::blocks;
use crate::support::random::Random;
use tetralod::mesh::TetMesh;
use tetralod::mt::{CurrentMesh, Mt, MtInfo, MtKind, MultiTessellation};
use tetralod_build::measure;
use tetralod_build::verify;
use tetralod_build::verify::Reference;
use tetralod_build::{BuildConfig, BuildCriterion, Construction, Method, build};

/// A box with ever thinner layers towards its bottom, across which the field rises steeply; no vertex inside is on a lattice.
fn layers(thinnest: f64) -> TetMesh {
    let mut mesh = blocks([7, 6, 8], &[|_| 0.0], |_| true);
    mesh.grid = None;
    let mut random = Random::new(7);
    for (p, value) in mesh.positions.iter_mut().zip(&mut mesh.fields[0].values) {
        let mut moved = |x: f64, by: f64| {
            let inside = x > 0.0 && x < 1.0;
            if inside { x + by * (random.below(1001) as f64 / 1000.0 - 0.5) } else { x }
        };
        let (x, y) = (moved(p[0], 0.06), moved(p[1], 0.06));
        let height = (p[2] * 8.0).round();
        let z = if height > 0.0 { thinnest.powf(1.0 - height / 8.0) } else { 0.0 };
        *p = [x, y, moved(z, 0.2 * thinnest)];
        *value = height.sqrt() + 0.1 * (5.0 * x).sin() * y;
    }
    mesh
}

fn made(mesh: &TetMesh, kind: MtKind, position_bits: Option<u32>) -> Mt {
    let (method, criterion) = match kind {
        MtKind::Edge => (Method::Collapse, BuildCriterion::HalfEdge),
        _ => (Method::Decimate, BuildCriterion::HalfEdge),
    };
    let construction = Construction::new(kind, method, criterion).expect("they go together");
    let config = BuildConfig { construction, position_bits, ..BuildConfig::default() };
    build(mesh, &config).expect("a mesh to build on").mt
}

/// The largest error at the vertices of the input that are inside the mesh.
fn largest_error(info: &MtInfo, mesh: &CurrentMesh, input: &TetMesh) -> f64 {
    errors_inside(info, mesh, input).into_iter().fold(0.0, f64::max)
}

#[test]
fn bounds_hold_where_the_input_has_its_vertices() {
    let input = layers(1.0 / 512.0);
    for kind in [MtKind::Edge, MtKind::Vertex] {
        for bits in [None, Some(11), Some(13)] {
            let mt = made(&input, kind, bits);
            for error in [0.0, 0.01, 0.03, 0.1] {
                let (front, bound) = refined(&mt, error);
                let found = largest_error(mt.info(), front.mesh(), &input);
                // Also where no error is left but that of the lattices.
                let range = mt.info().fields[0].range();
                let allowed = mt.info().field_bound(0, bound) / range + 1e-9;
                assert!(found <= allowed, "{} {bits:?} {error}: {found} of {allowed}", kind.name());
                assert!(error > 0.0 || found > 2e-9, "the lattices round something off");
                let reference = measure::Reference {
                    positions: &input.positions,
                    values: &input.fields[0].values,
                    field: 0,
                    regions: &[],
                };
                let promise = Some(measure::Promise::of(mt.info(), 0, bound));
                let part = measure::Part { promise, ..measure::Part::default() };
                let told = measure::deviation(mt.info(), front.mesh(), &reference, &part);
                let most = allowed * range * 1.001;
                assert!(told.field <= most, "{} {bits:?} {error}: measured {}", kind.name(), told.field);
            }
            let report = verify::run(&mt, &input, Reference::Mesh, &mut |_, _| {});
            assert!(report.valid, "{} {bits:?}: {:#?}", kind.name(), report.failures);
        }
    }
}

/// Without other wishes the lattice is so fine that little is left at full resolution.
#[test]
fn thin_cells_get_a_finer_lattice() {
    for thinnest in [1.0 / 64.0, 1.0 / 4096.0] {
        let input = layers(thinnest);
        let mt = made(&input, MtKind::Vertex, None);
        let found = largest_error(mt.info(), refined(&mt, 0.0).0.mesh(), &input);
        assert!(
            found <= mt.info().floor(0) + 1e-12 && mt.info().floor(0) < 0.002,
            "{found} of {}",
            mt.info().floor(0)
        );
    }
}

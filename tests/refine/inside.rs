//! Promise: reference vertices inside an extracted mesh are within its bound there, also where the boundary has moved away from
//! them and back again: where the input has them, not only where the lattice has put them.

use crate::at_vertices::{errors_inside, refined};
use crate::support::meshes::blocks;
use tetralod::mesh::TetMesh;
use tetralod::mt::{Mt, MtKind, MultiTessellation};
use tetralod_build::{BuildConfig, BuildCriterion, Construction, Method, build};

/// The kinds and builders that move a boundary.
const WAYS: [(MtKind, Method, BuildCriterion); 4] = [
    (MtKind::Edge, Method::Collapse, BuildCriterion::HalfEdge),
    (MtKind::Vertex, Method::Decimate, BuildCriterion::HalfEdge),
    (MtKind::HalfEdge, Method::Decimate, BuildCriterion::HalfEdge),
    (MtKind::Vertex, Method::Decimate, BuildCriterion::Delaunay),
];

/// Layers of cells around a part of a cylinder, or of a sphere, that are the thinner the nearer they are to it, across which the field
/// rises steeply.
fn boundary_layer(cells: [u32; 3], growth: f64, roughness: f64, field: fn([f64; 3]) -> f64) -> TetMesh {
    let mut mesh = blocks(cells, &[|_| 0.0], |_| true);
    mesh.grid = None;
    let [along, across, layers] = cells.map(f64::from);
    for (p, value) in mesh.positions.iter_mut().zip(&mut mesh.fields[0].values) {
        let [u, v, w] = *p;
        let height = (growth.powf((w * layers).round()) - 1.0) / (growth.powf(layers) - 1.0);
        let bump = ((u * along).round() * 12.9898 + (v * across).round() * 78.233).sin();
        let radius = 1.0 + height + roughness * bump * (1.0 - height);
        let (turn, rise) = (3.0 * (u - 0.5), 0.8 * (v - 0.5));
        *p = if roughness > 0.0 {
            [radius * turn.cos() * rise.cos(), radius * turn.sin() * rise.cos(), radius * rise.sin()]
        } else {
            [radius * turn.cos(), radius * turn.sin(), 1.5 * v + 0.1 * (3.0 * turn).sin()]
        };
        *value = field([u, v, height]);
    }
    mesh
}

fn smooth() -> TetMesh {
    let field = |[u, v, height]: [f64; 3]| (150.0 * height).tanh() + 0.1 * (9.0 * u + 7.0 * v).sin();
    boundary_layer([60, 5, 14], 1.6, 0.0, field)
}

fn rough() -> TetMesh {
    let field = |[u, v, height]: [f64; 3]| (40.0 * u + 30.0 * v).sin() * (20.0 * height).tanh() + height;
    boundary_layer([24, 12, 9], 1.5, 0.003, field)
}

fn made(mesh: &TetMesh, (kind, method, criterion): (MtKind, Method, BuildCriterion)) -> Mt {
    let construction = Construction::new(kind, method, criterion).expect("they go together");
    let config = BuildConfig { construction, ..BuildConfig::default() };
    build(mesh, &config).expect("a mesh to build on").mt
}

#[test]
fn vertices_inside_are_within_the_bound() {
    for (name, input) in [("smooth", smooth()), ("rough", rough())] {
        for way in WAYS {
            let mt = made(&input, way);
            for error in [0.0, 0.003, 0.01, 0.05, 0.2] {
                let (front, bound) = refined(&mt, error);
                let errors = errors_inside(mt.info(), front.mesh(), &input);
                let allowed = bound.max(mt.info().floor(0)) + 1e-9;
                let over = errors.iter().filter(|&&error| error > allowed).count();
                let largest = errors.iter().copied().fold(0.0, f64::max);
                assert!(over == 0, "{name} {way:?} {error}: {over} over {bound}, up to {largest}");
            }
        }
    }
}

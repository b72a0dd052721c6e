//! Promise: flat parts of the boundary stay flat, and sharp creases and corners where they are, at every error, on noisy data too.

use crate::support::meshes::blocks;
use crate::support::random::Random;
use std::ops::ControlFlow;
use tetralod::builder::{BuildConfig, BuildCriterion, Construction, Method, build};
use tetralod::mesh::{FACES, NONE, TetMesh};
use tetralod::mt::{CurrentMesh, Mt, MtKind, MultiTessellation};
use tetralod::refine::{Front, LodCriterion, Request};

fn made(mesh: &TetMesh, kind: MtKind, criterion: BuildCriterion) -> Mt {
    let method = if kind == MtKind::Edge { Method::Collapse } else { Method::Decimate };
    let construction = Construction::new(kind, method, criterion).expect("they go together");
    let config = BuildConfig { construction, ..BuildConfig::of(MtKind::Edge) };
    build(mesh, &config, &mut |_| ControlFlow::Continue(())).expect("a mesh to build on").mt
}

/// How many boundary faces are in none of the planes of the axes through these lattice positions, and the corners of the box.
fn tilted(mesh: &CurrentMesh, sides: &[Vec<i32>; 3]) -> usize {
    let mut count = 0;
    for (tet, around) in mesh.tets().iter().zip(mesh.neighbors()) {
        for face in (0..4).filter(|&i| around[i] == NONE) {
            let corners = FACES[face].map(|i| mesh.positions()[tet[i] as usize]);
            let flat =
                (0..3).any(|axis| sides[axis].iter().any(|&side| corners.iter().all(|q| q[axis] == side)));
            count += usize::from(!flat);
        }
    }
    count
}

fn noise(mesh: &mut TetMesh, seed: u64) {
    let mut random = Random::new(seed);
    mesh.fields[0].values.iter_mut().for_each(|x| *x = random.below(1000) as f64);
}

#[test]
fn noisy_boxes_and_notched_ones_keep_their_faces() {
    let ell = |c: [u32; 3]| c[0] < 3 || c[1] < 4;
    for (name, mut mesh) in
        [("box", blocks([7, 8, 6], &[|_| 0.0], |_| true)), ("notched", blocks([7, 8, 6], &[|_| 0.0], ell))]
    {
        noise(&mut mesh, 11);
        // One outlier makes the rest small, so that errors of a few percent take away nearly all.
        mesh.fields[0].values[100] = 20_000.0;
        for (kind, criterion) in [
            (MtKind::Edge, BuildCriterion::HalfEdge),
            (MtKind::Vertex, BuildCriterion::HalfEdge),
            (MtKind::Vertex, BuildCriterion::Delaunay),
        ] {
            let mt = made(&mesh, kind, criterion);
            let at = |axis: usize, part: f64| {
                let mut p = [0.0; 3];
                p[axis] = part;
                mt.info().lattice.nearest(p)[axis]
            };
            let sides = [
                vec![at(0, 0.0), at(0, 3.0 / 7.0), at(0, 1.0)],
                vec![at(1, 0.0), at(1, 0.5), at(1, 1.0)],
                vec![at(2, 0.0), at(2, 1.0)],
            ];
            for error in [0.0, 0.01, 0.05, 0.2, 1.0, f64::INFINITY] {
                let mut front = Front::new(&mt).expect("a valid base mesh");
                let request = Request::within(error);
                let criterion = LodCriterion::new(mt.info(), &request);
                front.satisfy(&mt, &criterion, request.budget).expect("a valid MT");
                let mesh = front.mesh();
                assert_eq!(tilted(mesh, &sides), 0, "{name}, {}, error {error}", kind.name());
                for corner in 0..8 {
                    let corner = [0, 1, 2].map(|axis| {
                        *sides[axis][if corner >> axis & 1 == 0 { 0 } else { sides[axis].len() - 1 }..]
                            .first()
                            .expect("a side")
                    });
                    let cut = name == "notched" && corner[0] > 0 && corner[1] > 0;
                    assert!(
                        cut || mesh.positions().contains(&corner),
                        "{name}: the corner {corner:?} is gone at error {error}"
                    );
                }
            }
        }
    }
}

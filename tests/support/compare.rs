//! Compares a current mesh with the oracle, by everything that its public face shows.

use super::builder::Built;
use super::domains::volume6;
use super::oracle::sorted;
use std::collections::BTreeSet;
use tetralod::mt::CurrentMesh;
use tetralod::mt::EdgeMt;
use tetralod::mt::MultiTessellation;

/// The base mesh, told of all updates.
pub fn fresh_mesh(mt: &EdgeMt) -> CurrentMesh {
    let mut mesh = CurrentMesh::new(mt.info(), mt.base()).expect("a valid base mesh");
    mt.updates_arrived(&mut mesh, 0);
    mesh
}

/// The live tetrahedra by slot, as MT vertex numbers.
pub fn live_tets(mesh: &CurrentMesh) -> Vec<[u32; 4]> {
    let slots = (0..mesh.tet_slots() as u32).filter_map(|t| mesh.tet(t));
    slots.map(|tet| tet.map(|slot| mesh.vertex(slot).0)).collect()
}

/// Asserts that the mesh is exactly Σ_S as the oracle has it.
pub fn assert_same(mesh: &CurrentMesh, built: &Built, live: &BTreeSet<[u32; 4]>) {
    assert_eq!(mesh.check(), Ok(()));
    let tets = live_tets(mesh);
    let found: BTreeSet<[u32; 4]> = tets.iter().map(|t| sorted(*t)).collect();
    assert_eq!(found.len(), tets.len(), "a tetrahedron is there twice");
    assert_eq!(&found, live);
    assert_eq!(mesh.tet_count(), live.len());
    let oracle = &built.oracle;
    let vertices: BTreeSet<u32> = live.iter().flatten().copied().collect();
    assert_eq!(mesh.vertex_count(), vertices.len());
    for &v in &vertices {
        let slot = mesh.slot(tetralod::mt::VertexId(v)).expect("the vertex is in the mesh");
        assert_eq!(mesh.vertex(slot).0, v);
        assert_eq!(mesh.positions()[slot as usize], oracle.positions[v as usize], "position of {v}");
        assert_eq!(mesh.levels(slot), oracle.levels[v as usize], "levels of {v}");
    }
    let volume: i128 = (0..mesh.tet_slots() as u32)
        .filter_map(|t| mesh.tet(t))
        .map(|tet| volume6(tet.map(|slot| mesh.positions()[slot as usize])))
        .sum();
    assert_eq!(volume, oracle.volume(live));
}

/// All that a copy of the mesh elsewhere would hold, with what a test needs to see that nothing changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    pub vertices: Vec<u32>,
    pub positions: Vec<[i32; 3]>,
    pub levels: Vec<i32>,
    pub tets: Vec<[u32; 4]>,
    pub neighbors: Vec<[u32; 4]>,
    pub counts: [usize; 2],
}

pub fn snapshot(mesh: &CurrentMesh) -> Snapshot {
    let slots = 0..mesh.positions().len() as u32;
    Snapshot {
        vertices: slots.clone().map(|slot| mesh.vertex(slot).0).collect(),
        positions: mesh.positions().to_vec(),
        levels: slots.flat_map(|slot| mesh.levels(slot).to_vec()).collect(),
        tets: mesh.tets().to_vec(),
        neighbors: mesh.neighbors().to_vec(),
        counts: [mesh.vertex_count(), mesh.tet_count()],
    }
}

//! What a current mesh shows of itself.

use tetralod::mt::CurrentMesh;

/// The live tetrahedra by slot, as MT vertex numbers.
pub fn live_tets(mesh: &CurrentMesh) -> Vec<[u32; 4]> {
    let slots = (0..mesh.tet_slots() as u32).filter_map(|t| mesh.tet(t));
    slots.map(|tet| tet.map(|slot| mesh.vertex(slot).0)).collect()
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

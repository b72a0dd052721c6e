//! The base mesh of an MT, numbered so that it costs few bits in a file.

use tetralod::mesh::growth_order;
use tetralod::mt::BaseMesh;

/// A base mesh, and where its parts come from.
pub(crate) struct Numbered {
    pub mesh: BaseMesh,
    /// The MT's number for each of the builder's vertices; [`NONE`](tetralod::mesh::NONE) for those that are not in the base mesh.
    pub number: Vec<u32>,
    /// The builder's place of each tetrahedron.
    pub places: Vec<u32>,
}

/// The base mesh of these tetrahedra, given all of the builder's vertices.
pub(crate) fn number_base(
    positions: &[[i32; 3]],
    levels: &[i32],
    fields: usize,
    tets: &[[u32; 4]],
) -> Numbered {
    let order = growth_order(positions, tets);
    let mut mesh = BaseMesh { tets: order.tets, ..BaseMesh::default() };
    for v in order.vertices.iter().map(|&v| v as usize) {
        mesh.positions.push(positions[v]);
        mesh.values.extend_from_slice(&levels[v * fields..][..fields]);
    }
    Numbered { mesh, number: order.number, places: order.places }
}

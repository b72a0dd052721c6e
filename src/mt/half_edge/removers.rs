//! What removes the tetrahedra of a star, and which of their faces go with them, from an order of faces to the corners of the star.

use super::forest::Forest;
use super::new_star::{MOST, NEW};
use super::scratch::Scratch;
use crate::mt::{CurrentMesh, VertexId};

/// What removes a tetrahedron, [`NONE`](crate::mesh::NONE) if nothing does, and which of its faces go with it (see [`BaseMark`](super::store::BaseMark)): bit `i` is
/// that of the face opposite the `i`-th vertex in ascending order.
pub(crate) type Remover = (u32, u8);

/// Bits of the vertices of a tetrahedron in ascending order, by its corners.
#[doc(hidden)]
pub fn by_corner(bits: u8, tet: [u32; 4]) -> u8 {
    let rank = |v: u32| tet.iter().filter(|&&other| other < v).count();
    (0..4).fold(0, |all, corner| all | (bits >> rank(tet[corner]) & 1) << corner)
}

/// Enters what removes the tetrahedra of a star, given in the order of their faces opposite the new vertex. None if there are not as many of
/// them, or these are not the given faces.
pub(super) fn set_removers(
    scratch: &mut Scratch,
    mesh: &CurrentMesh,
    forest: &Forest,
    vertex: VertexId,
    (removers, given): (&[Remover], &[[u32; 3]]),
) -> Option<()> {
    let Scratch { star, star_len, link, link_len, .. } = scratch;
    let (star, link) = (&mut star[..*star_len], &link[..*link_len]);
    if removers.len() != star.len() {
        return None;
    }
    // Names are compared once for each vertex: the rest goes by ranks.
    let name = |v: VertexId| u64::from(forest.name(v.0));
    let mut sorted = [0; MOST + 1];
    let sorted = &mut sorted[..=link.len()];
    for (entry, (i, &slot)) in sorted.iter_mut().zip((0..).zip(link)) {
        *entry = name(mesh.vertex(slot)) << 8 | i;
    }
    sorted[link.len()] = name(vertex) << 8 | u64::from(NEW);
    sorted.sort_unstable();
    let mut ranks = [0_u8; NEW as usize + 1];
    (0..).zip(&*sorted).for_each(|(rank, &entry)| ranks[usize::from(entry as u8)] = rank);
    let mut faces = [0_u32; MOST];
    let faces = &mut faces[..star.len()];
    for (i, (face, new)) in faces.iter_mut().zip(&*star).enumerate() {
        let mut corners = new.corners.map(|corner| ranks[usize::from(corner)]);
        // The new vertex goes to the end.
        corners[usize::from(new.own) & 3] = u8::MAX;
        corners.sort_unstable();
        corners[3] = i as u8;
        *face = u32::from_be_bytes(corners);
    }
    faces.sort_unstable();
    for (at, (&face, &(remover, inner))) in faces.iter().zip(removers).enumerate() {
        let [a, b, c, i] = face.to_be_bytes();
        if let Some(given) = given.get(at) {
            let name = |rank: u8| (sorted[usize::from(rank)] >> 8) as u32;
            if *given != [a, b, c].map(name) {
                return None;
            }
        }
        let new = &mut star[usize::from(i)];
        new.remover = remover;
        new.inner = by_corner(inner, new.corners.map(|corner| u32::from(ranks[usize::from(corner)])));
    }
    Some(())
}

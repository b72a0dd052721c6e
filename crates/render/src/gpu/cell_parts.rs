//! What is seen of tetrahedra: of solid ones the faces that no other one hides, of wires each edge once, of points
//! each once.

use tetralod::mesh::NONE;
use tetralod::view::{ClipPlane, MeshView};

/// The corners of each edge of a tetrahedron.
const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// Whether each tetrahedron is there, and is kept by the cut.
fn kept(mesh: &MeshView<'_>, cut: &ClipPlane) -> Vec<bool> {
    let is_kept = |tet: &[u32; 4]| tet[0] != NONE && cut.keeps(tet.map(|p| mesh.positions[p as usize]));
    mesh.tets.iter().map(is_kept).collect()
}

/// The faces of kept tetrahedra that are on the boundary of them: four times the tetrahedron, plus the corner opposite
/// to the face.
pub(super) fn outer_faces(mesh: &MeshView<'_>, cut: &ClipPlane) -> Vec<u32> {
    let kept = kept(mesh, cut);
    let is_kept = |t: u32| kept.get(t as usize).is_some_and(|is_kept| *is_kept);
    let faces = (0..).zip(mesh.neighbors).filter(|(t, _)| is_kept(*t));
    let outer = |(t, around): (u32, &[u32; 4])| {
        let around = *around;
        (0..4).filter(move |k| !is_kept(around[*k as usize])).map(move |k| 4 * t + k)
    };
    faces.flat_map(outer).collect()
}

/// The edges of kept tetrahedra: two points each, and the first of the tetrahedra around it.
pub(super) fn edges(mesh: &MeshView<'_>, cut: &ClipPlane) -> Vec<u32> {
    let kept = kept(mesh, cut);
    let tets = (0..).zip(mesh.tets).zip(kept).filter(|(_, is_kept)| *is_kept);
    let of = |((t, tet), _): ((u32, &[u32; 4]), bool)| {
        let tet = *tet;
        EDGES.map(|[i, j]| (u64::from(tet[i].min(tet[j])) << 32 | u64::from(tet[i].max(tet[j])), t))
    };
    let mut all: Vec<(u64, u32)> = tets.flat_map(of).collect();
    all.sort_unstable();
    all.dedup_by_key(|(edge, _)| *edge);
    all.into_iter().flat_map(|(edge, t)| [(edge >> 32) as u32, edge as u32, t]).collect()
}

/// The points of kept tetrahedra: each once, with the first of the tetrahedra around it.
pub(super) fn points(mesh: &MeshView<'_>, cut: &ClipPlane) -> Vec<u32> {
    let mut first = vec![NONE; mesh.positions.len()];
    let kept = kept(mesh, cut);
    for ((t, tet), _) in (0..).zip(mesh.tets).zip(kept).filter(|(_, is_kept)| *is_kept) {
        for v in tet {
            let own = &mut first[*v as usize];
            *own = t.min(*own);
        }
    }
    let there = (0..).zip(first).filter(|(_, t)| *t != NONE);
    there.flat_map(|(v, t)| [v, t]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two tetrahedra with a common face, and a free place between them.
    const TETS: [[u32; 4]; 3] = [[0, 1, 2, 3], [NONE; 4], [4, 1, 3, 2]];
    const AROUND: [[u32; 4]; 3] = [[2, NONE, NONE, NONE], [NONE; 4], [0, NONE, NONE, NONE]];
    const PLACES: [[f64; 3]; 5] =
        [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]];

    fn mesh() -> MeshView<'static> {
        MeshView { positions: &PLACES, field: &[0.0; 5], is_label: false, tets: &TETS, neighbors: &AROUND }
    }

    #[test]
    fn the_common_face_is_hidden_until_one_of_both_is_cut_away() {
        assert_eq!(outer_faces(&mesh(), &ClipPlane::NOTHING), [1, 2, 3, 9, 10, 11]);
        let cut = ClipPlane { normal: [1.0, 1.0, 1.0], offset: 1.0 };
        assert_eq!(outer_faces(&mesh(), &cut), [0, 1, 2, 3]);
    }

    #[test]
    fn points_are_those_of_kept_tetrahedra() {
        assert_eq!(points(&mesh(), &ClipPlane::NOTHING), [0, 0, 1, 0, 2, 0, 3, 0, 4, 2]);
        let cut = ClipPlane { normal: [1.0, 1.0, 1.0], offset: 1.0 };
        assert_eq!(points(&mesh(), &cut), [0, 0, 1, 0, 2, 0, 3, 0]);
    }

    #[test]
    fn each_edge_is_there_once() {
        let all = edges(&mesh(), &ClipPlane::NOTHING);
        let pairs: Vec<_> = all.as_chunks::<3>().0.iter().map(|[a, b, t]| ([*a, *b], *t)).collect();
        assert_eq!(pairs.len(), 9);
        assert_eq!(pairs.iter().filter(|(_, t)| *t == 2).count(), 3, "those of point 4");
        assert!(pairs.windows(2).all(|pair| pair[0].0 < pair[1].0));
    }
}

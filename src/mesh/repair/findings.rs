//! What is unusual about a valid mesh, and is kept.

use std::fmt;

use super::weld::places;
use crate::mesh::adjacency::{check_indices, components, is_odd, non_manifold};
use crate::mesh::{MeshError, RepairLevel, TetMesh, boundary_faces, neighbors};

/// What a valid mesh has that users may not expect; displays as one line, empty for a mesh of one part whose boundary
/// is a surface without open seams.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshFindings {
    /// Parts that hang together by faces.
    pub components: usize,
    /// Edges with more than two faces of the boundary, which touches itself there.
    pub non_manifold_edges: usize,
    /// Points at which the boundary touches itself, those at the ends of such edges among them.
    pub non_manifold_vertices: usize,
    /// Faces of the boundary of which each point lies at the place of another point: the two sides of seams that are
    /// open.
    pub open_seam_faces: usize,
    /// Those of them that [`RepairLevel::Weld`] closes. The others lie on faces that are cut differently.
    pub weldable_faces: usize,
}

impl fmt::Display for MeshFindings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = |n: usize, one: &str, many: &str| format!("{n} {}", if n == 1 { one } else { many });
        let mut kept = Vec::new();
        if self.components > 1 {
            kept.push(format!("{} parts that share no face", self.components));
        }
        if self.non_manifold_vertices > 0 {
            kept.push(format!(
                "a boundary that touches itself at {} and {}",
                count(self.non_manifold_edges, "edge", "edges"),
                count(self.non_manifold_vertices, "point", "points")
            ));
        }
        if self.open_seam_faces > 0 {
            let weld = RepairLevel::Weld { distance: 0.0 }.name();
            kept.push(format!(
                "{} on open seams ({})",
                count(self.open_seam_faces, "face", "faces"),
                match self.weldable_faces {
                    0 => "their two sides are cut differently: welding points does not close them".to_owned(),
                    n if n == self.open_seam_faces => format!("repair level \"{weld}\" closes them"),
                    n =>
                        format!("repair level \"{weld}\" closes {n} of them, the others are cut differently"),
                }
            ));
        }
        if kept.is_empty() { Ok(()) } else { write!(f, "kept: {}", kept.join("; ")) }
    }
}

/// What is unusual about a valid mesh. Points are at one place if they are at most `distance` apart, or joined by
/// points that are.
///
/// # Errors
/// If the mesh is so broken that its boundary is not known: see [`crate::mesh::topology`].
pub fn findings(mesh: &TetMesh, distance: f64) -> Result<MeshFindings, MeshError> {
    let TetMesh { positions, tets, .. } = mesh;
    check_indices(positions.len(), tets)?;
    let neighbors = neighbors(tets)?;
    let faces: Vec<[u32; 3]> = boundary_faces(tets, &neighbors).map(|(_, face)| face).collect();
    let mut on_boundary = vec![false; positions.len()];
    faces.iter().flatten().for_each(|&v| on_boundary[v as usize] = true);
    let non_manifold = non_manifold(positions.len(), tets, &neighbors, |v| on_boundary[v]);
    let boundary_points = (0..).zip(&on_boundary).filter(|(_, is)| **is).map(|(v, _)| v).collect();
    let places = places(positions, boundary_points, distance);
    let mut seam_faces = seam_faces(&faces, &places, &on_boundary);
    seam_faces.sort_unstable();
    let is_closed = |pair: &&[([u32; 3], bool)]| matches!(pair, [(_, a), (_, b)] if a != b);
    Ok(MeshFindings {
        components: components(&neighbors),
        non_manifold_edges: crowded_edges(&faces),
        non_manifold_vertices: non_manifold.iter().filter(|&&marked| marked).count(),
        open_seam_faces: seam_faces.len(),
        weldable_faces: 2 * seam_faces.chunk_by(|a, b| a.0 == b.0).filter(is_closed).count(),
    })
}

/// The faces whose points all lie at the places of others: their places in increasing order, and whether that turns
/// them around.
fn seam_faces(faces: &[[u32; 3]], places: &[u32], on_boundary: &[bool]) -> Vec<([u32; 3], bool)> {
    let mut points_at = vec![0_u8; places.len()];
    for (&place, _) in places.iter().zip(on_boundary).filter(|(_, is)| **is) {
        points_at[place as usize] = points_at[place as usize].saturating_add(1);
    }
    let has_twin = |v: &u32| points_at[places[*v as usize] as usize] > 1;
    let placed = |face: &[u32; 3]| {
        let mut places = face.map(|v| places[v as usize]);
        let odd = is_odd(places);
        places.sort_unstable();
        (places, odd)
    };
    let is_face = |([a, b, c], _): &([u32; 3], bool)| a != b && b != c;
    faces.iter().filter(|face| face.iter().all(has_twin)).map(placed).filter(is_face).collect()
}

/// How many edges have more than two of the faces.
fn crowded_edges(faces: &[[u32; 3]]) -> usize {
    let edge = |a: u32, b: u32| [a.min(b), a.max(b)];
    let mut edges: Vec<[u32; 2]> =
        faces.iter().flat_map(|&[a, b, c]| [edge(a, b), edge(b, c), edge(c, a)]).collect();
    edges.sort_unstable();
    edges.chunk_by(|a, b| a == b).filter(|run| run.len() > 2).count()
}

//! What is unusual about a valid mesh, and is kept.

use std::fmt;

use glam::DVec3;
use serde::Serialize;

use super::weld::places;
use crate::mesh::adjacency::{check_indices, components, is_odd, non_manifold};
use crate::mesh::{MeshError, RepairLevel, TetMesh, boundary_faces, neighbors};

/// What a valid mesh has that users may not expect; displays as one line, empty for a mesh of one part whose boundary
/// is a surface without open seams.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct MeshFindings {
    /// Parts that hang together by faces.
    pub components: usize,
    /// Edges with more than two faces of the boundary, which touches itself there.
    pub non_manifold_edges: usize,
    /// Points at which the boundary touches itself, those at the ends of such edges among them.
    pub non_manifold_vertices: usize,
    /// Faces of the boundary that lie on others, which are the two sides of an open seam: with the same three corners, or
    /// two with the same four corners as two others, which meet in the other diagonal.
    pub open_seam_faces: usize,
    /// Faces of open seams with the same three corners, which [`RepairLevel::Weld`] closes.
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
            let edges = match self.non_manifold_edges {
                0 => String::new(),
                n => format!("{} and ", count(n, "edge", "edges")),
            };
            let points = count(self.non_manifold_vertices, "point", "points");
            kept.push(format!("a boundary that touches itself at {edges}{points}"));
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
    let faces: Vec<(u32, [u32; 3])> = boundary_faces(tets, &neighbors).collect();
    let mut on_boundary = vec![false; positions.len()];
    faces.iter().flat_map(|(_, face)| face).for_each(|&v| on_boundary[v as usize] = true);
    let non_manifold = non_manifold(positions.len(), tets, &neighbors, |v| on_boundary[v]);
    let points = (0..).zip(&on_boundary).filter(|(_, is)| **is).map(|(v, _)| v).collect();
    let edges = edges(&faces);
    let seams = Seams { faces: &faces, positions, places: places(positions, points, distance) };
    let mut open = vec![false; faces.len()];
    seams.mark_equal_faces(&mut open);
    let weldable_faces = count(&open);
    seams.mark_equal_quads(&edges, &mut open);
    Ok(MeshFindings {
        components: components(&neighbors).count(),
        non_manifold_edges: edges.chunk_by(same_edge).filter(|run| run.len() > 2).count(),
        non_manifold_vertices: count(&non_manifold),
        open_seam_faces: count(&open),
        weldable_faces,
    })
}

fn count(marked: &[bool]) -> usize {
    marked.iter().filter(|&&marked| marked).count()
}

/// An edge of the boundary by its points, and the number of a face there.
type EdgeOfFace = ([u32; 2], u32);

fn same_edge(a: &EdgeOfFace, b: &EdgeOfFace) -> bool {
    a.0 == b.0
}

/// The edges of all faces, equal ones side by side.
fn edges(faces: &[(u32, [u32; 3])]) -> Vec<EdgeOfFace> {
    let of_face = |(number, (_, [a, b, c])): (u32, &(u32, [u32; 3]))| {
        [[a, b], [b, c], [c, a]].map(|[a, b]| ([*a.min(b), *a.max(b)], number))
    };
    let mut edges: Vec<EdgeOfFace> = (0..).zip(faces).flat_map(of_face).collect();
    edges.sort_unstable();
    edges
}

/// The boundary, for the search of faces that lie on each other.
struct Seams<'a> {
    /// Each with its tetrahedron, and its points as they are seen from outside.
    faces: &'a [(u32, [u32; 3])],
    positions: &'a [[f64; 3]],
    /// The place of each point.
    places: Vec<u32>,
}

impl Seams<'_> {
    fn placed<const N: usize>(&self, points: [u32; N]) -> [u32; N] {
        points.map(|v| self.places[v as usize])
    }

    /// Marks pairs of faces at the same places that are seen from opposite sides.
    fn mark_equal_faces(&self, open: &mut [bool]) {
        let key = |(number, (_, face)): (u32, &(u32, [u32; 3]))| {
            let mut places = self.placed(*face);
            let odd = is_odd(places);
            places.sort_unstable();
            (places, odd, number)
        };
        let mut keys: Vec<_> = (0..).zip(self.faces).map(key).collect();
        keys.sort_unstable();
        for run in keys.chunk_by(|a, b| a.0 == b.0) {
            if let [(_, false, a), (_, true, b)] = *run {
                open[a as usize] = true;
                open[b as usize] = true;
            }
        }
    }

    /// Marks pairs of faces with a common edge that have the same four places as another pair, across the other diagonal.
    fn mark_equal_quads(&self, edges: &[EdgeOfFace], open: &mut [bool]) {
        let mut quads = Vec::new();
        for run in edges.chunk_by(same_edge) {
            // Where several sheets meet in an edge, it is not clear which faces are side by side.
            let [(edge, a), (_, b)] = *run else { continue };
            let [(t, face), (u, other)] = [a, b].map(|number| self.faces[number as usize]);
            let beyond = |face: [u32; 3]| face.into_iter().find(|v| !edge.contains(v));
            let (Some(v), Some(w)) = (beyond(face), beyond(other)) else { continue };
            let mut diagonal = self.placed(edge);
            diagonal.sort_unstable();
            let mut points = [edge[0], edge[1], v, w];
            points.sort_unstable();
            let mut quad = self.placed(points);
            quad.sort_unstable();
            // Two faces of one tetrahedron meet in an edge of it, not in the diagonal of a quad.
            if t != u && quad.windows(2).all(|pair| pair[0] != pair[1]) {
                quads.push((quad, diagonal, points, [a, b]));
            }
        }
        quads.sort_unstable();
        for run in quads.chunk_by(|a, b| a.0 == b.0) {
            for (_, diagonal, points, pair) in run {
                let lies_on = |(_, other, others, _): &(_, [u32; 2], [u32; 4], _)| {
                    // What is between them, if all points are the same, may also be the gap that a missing cell left.
                    diagonal.iter().all(|v| !other.contains(v)) && (points != others || self.is_thin(*points))
                };
                if run.iter().any(lies_on) {
                    pair.iter().for_each(|&face| open[face as usize] = true);
                }
            }
        }
    }

    /// Whether four points lie in a plane, nearly.
    fn is_thin(&self, points: [u32; 4]) -> bool {
        /// Six times the volume, of a tetrahedron whose longest side along an axis is 1.
        const THIN: f64 = 1e-3;
        let [a, b, c, d] = points.map(|v| DVec3::from_array(self.positions[v as usize]));
        let sides = [b - a, c - a, d - a];
        let scale = sides.iter().fold(0.0_f64, |most, side| most.max(side.abs().max_element()));
        let [u, v, w] = sides.map(|side| side / scale);
        u.cross(v).dot(w).abs() < THIN
    }
}

//! Is this a valid conforming mesh? Asked of plain arrays, with nothing but sorting and exact orientation.

use crate::geom::orient3d;
use crate::mesh::EDGES;
use crate::mesh::FACES;
use crate::mesh::NONE;
use crate::mt::CurrentMesh;

/// An extracted mesh as plain arrays.
pub struct PlainMesh<'a> {
    pub mesh: &'a CurrentMesh,
    pub positions: &'a [[i32; 3]],
    pub tets: &'a [[u32; 4]],
    pub neighbors: &'a [[u32; 4]],
}

/// A mesh on the lattice as the input gives it.
pub struct PlainReference<'a> {
    pub positions: &'a [[i32; 3]],
    /// `levels[vertex * fields + f]`.
    pub levels: &'a [i32],
    pub tets: &'a [[u32; 4]],
}

/// What no update changes.
pub struct Shape {
    /// Vertices − edges + faces − tetrahedra.
    euler: i64,
}

impl Shape {
    pub fn of(reference: &PlainReference<'_>) -> Result<Self, String> {
        Ok(Self { euler: euler(reference.positions.len(), reference.tets, &sorted_faces(reference.tets)?) })
    }
}

/// A face by its sorted vertices, the side its tetrahedron is on, and where it is: `4 · tet + face`.
type Face = ([u32; 3], bool, u32);

impl<'a> PlainMesh<'a> {
    /// The mesh, which must be packed.
    pub fn of(mesh: &'a CurrentMesh) -> Self {
        Self { mesh, positions: mesh.positions(), tets: mesh.tets(), neighbors: mesh.neighbors() }
    }

    /// Everything that makes a valid mesh.
    pub fn check(&self, reference: &Shape) -> Result<(), String> {
        self.check_vertices()?;
        self.check_orientation()?;
        let faces = sorted_faces(self.tets)?;
        let boundary = self.check_faces(&faces)?;
        check_closed(&boundary)?;
        let euler = euler(self.positions.len(), self.tets, &faces);
        if euler != reference.euler {
            return Err(format!("the Euler number is {euler}, that of the input {}", reference.euler));
        }
        Ok(())
    }

    fn check_vertices(&self) -> Result<(), String> {
        let count = self.positions.len();
        let mut used = vec![false; count];
        for (t, tet) in self.tets.iter().enumerate() {
            for &v in tet {
                *used.get_mut(v as usize).ok_or(format!("tetrahedron {t} has no vertex {v}"))? = true;
            }
        }
        if let Some(v) = used.iter().position(|used| !used) {
            return Err(format!("no tetrahedron uses vertex {v}"));
        }
        let counted = (self.mesh.vertex_count(), self.mesh.tet_count());
        if counted != (count, self.tets.len()) || self.neighbors.len() != self.tets.len() {
            return Err(format!("{count} vertices and {} tetrahedra, reported {counted:?}", self.tets.len()));
        }
        Ok(())
    }

    fn check_orientation(&self) -> Result<(), String> {
        let positive = |tet: &[u32; 4]| {
            let [a, b, c, d] = tet.map(|v| self.positions[v as usize]);
            orient3d(a, b, c, d) > 0
        };
        match self.tets.iter().position(|tet| !positive(tet)) {
            Some(t) => Err(format!("tetrahedron {t} is not positive")),
            None => Ok(()),
        }
    }

    /// Compares adjacency with what the faces say. Returns the boundary.
    fn check_faces(&self, faces: &[Face]) -> Result<Vec<[u32; 3]>, String> {
        let across = |at: u32| self.neighbors[at as usize / 4][at as usize % 4];
        let mut boundary = Vec::new();
        for group in faces.chunk_by(|a, b| a.0 == b.0) {
            match group {
                &[(face, _, at)] if across(at) == NONE => boundary.push(face),
                &[(.., at)] => return Err(format!("tetrahedron {} has a neighbour too many", at / 4)),
                &[(_, side, a), (_, other_side, b)] => {
                    if side == other_side {
                        return Err(format!("tetrahedra {} and {} overlap at a face", a / 4, b / 4));
                    }
                    if across(a) != b / 4 || across(b) != a / 4 {
                        return Err(format!("tetrahedra {} and {} are not neighbours", a / 4, b / 4));
                    }
                }
                [(.., at), ..] => {
                    return Err(format!("a face of tetrahedron {} is shared by {}", at / 4, group.len()));
                }
                [] => {}
            }
        }
        Ok(boundary)
    }

    /// The triangles of the boundary, each with its tetrahedron.
    pub fn boundary(&self) -> impl Iterator<Item = (u32, [u32; 3])> {
        self.tets.iter().zip(self.neighbors).zip(0..).flat_map(|((tet, around), t)| {
            (0..4).filter(|&i| around[i] == NONE).map(move |i| (t, FACES[i].map(|j| tet[j])))
        })
    }
}

fn sorted_faces(tets: &[[u32; 4]]) -> Result<Vec<Face>, String> {
    if tets.len() > crate::mesh::MAX_TETS {
        return Err("too many tetrahedra to check".into());
    }
    let mut faces: Vec<Face> = Vec::with_capacity(4 * tets.len());
    for (t, tet) in tets.iter().enumerate() {
        for (i, corners) in FACES.iter().enumerate() {
            let [a, b, c] = corners.map(|j| tet[j]);
            let odd = (a > b) ^ (b > c) ^ (a > c);
            let mut face = [a, b, c];
            face.sort_unstable();
            faces.push((face, odd, (4 * t + i) as u32));
        }
    }
    faces.sort_unstable();
    Ok(faces)
}

fn check_closed(boundary: &[[u32; 3]]) -> Result<(), String> {
    let mut edges: Vec<[u32; 2]> = boundary.iter().flat_map(|&[a, b, c]| [[a, b], [a, c], [b, c]]).collect();
    edges.sort_unstable();
    match edges.chunk_by(|a, b| a == b).find(|group| group.len() % 2 != 0) {
        Some(group) => Err(format!("the boundary is open at the edge {:?}", group[0])),
        None => Ok(()),
    }
}

fn euler(vertices: usize, tets: &[[u32; 4]], faces: &[Face]) -> i64 {
    let mut edges: Vec<(u32, u32)> = Vec::with_capacity(6 * tets.len());
    for tet in tets {
        edges.extend(EDGES.map(|[i, j]| (tet[i].min(tet[j]), tet[i].max(tet[j]))));
    }
    edges.sort_unstable();
    edges.dedup();
    let faces = faces.chunk_by(|a, b| a.0 == b.0).count();
    vertices as i64 - edges.len() as i64 + faces as i64 - tets.len() as i64
}

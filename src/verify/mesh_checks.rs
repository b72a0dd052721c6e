//! Checks that a mesh is valid and conforming, from plain arrays, by sorting and exact orientation only.

use crate::geom::{Groups, orient3d};
use crate::mesh::{FACES, NONE, boundary_faces, stars};
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
        let around = Around::new(reference.positions.len(), reference.tets)?;
        let mut faces = Vec::new();
        let mut count = Counts::default();
        (0..reference.positions.len() as u32).for_each(|v| count.add(&around.at(v, &mut faces), &faces));
        Ok(Self { euler: count.euler(reference.positions.len(), reference.tets.len()) })
    }
}

/// A face at its least vertex: the two others, ascending, the side its tetrahedron is on, and where it is: `4 · tet + face`.
type Face = ([u32; 2], bool, u32);

impl<'a> PlainMesh<'a> {
    /// The mesh, which must be packed.
    pub fn of(mesh: &'a CurrentMesh) -> Self {
        Self { mesh, positions: mesh.positions(), tets: mesh.tets(), neighbors: mesh.neighbors() }
    }

    /// Everything that makes a valid mesh.
    pub fn check(&self, reference: &Shape) -> Result<(), String> {
        self.check_vertices()?;
        self.check_orientation()?;
        let around = Around::new(self.positions.len(), self.tets)?;
        let (mut faces, mut boundary) = (Vec::new(), Vec::new());
        let mut count = Counts::default();
        for v in 0..self.positions.len() as u32 {
            count.add(&around.at(v, &mut faces), &faces);
            self.check_faces(v, &faces, &mut boundary)?;
        }
        check_closed(&boundary)?;
        let euler = count.euler(self.positions.len(), self.tets.len());
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
                *used.get_mut(v as usize).ok_or_else(|| format!("tetrahedron {t} has no vertex {v}"))? = true;
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

    /// Compares adjacency with the sorted faces of least vertex `v`. Appends those of the boundary.
    fn check_faces(&self, v: u32, faces: &[Face], boundary: &mut Vec<[u32; 3]>) -> Result<(), String> {
        let across = |at: u32| self.neighbors[at as usize / 4][at as usize % 4];
        for group in faces.chunk_by(|a, b| a.0 == b.0) {
            match group {
                &[([b, c], _, at)] if across(at) == NONE => boundary.push([v, b, c]),
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
        Ok(())
    }

    /// The triangles of the boundary, each with its tetrahedron.
    pub fn boundary(&self) -> impl Iterator<Item = (u32, [u32; 3])> {
        boundary_faces(self.tets, self.neighbors)
    }
}

/// The tetrahedra around each vertex: checks vertex by vertex need no list of all faces or edges.
struct Around<'a> {
    tets: &'a [[u32; 4]],
    stars: Groups,
}

impl<'a> Around<'a> {
    fn new(vertices: usize, tets: &'a [[u32; 4]]) -> Result<Self, String> {
        if tets.len() > crate::mesh::MAX_TETS {
            return Err("too many tetrahedra to check".into());
        }
        if let Some(v) = tets.iter().flatten().find(|v| **v as usize >= vertices) {
            return Err(format!("there is no vertex {v}"));
        }
        Ok(Self { tets, stars: stars(vertices, tets) })
    }

    /// Gives the vertices that have larger numbers and share an edge with `v`, and sorted the faces of which it is the least vertex.
    fn at(&self, v: u32, faces: &mut Vec<Face>) -> Vec<u32> {
        faces.clear();
        let mut larger = Vec::new();
        for &t in self.stars.of(v as usize) {
            let tet = self.tets[t as usize];
            larger.extend(tet.iter().filter(|&&w| w > v));
            for (i, corners) in FACES.iter().enumerate() {
                let [a, b, c] = corners.map(|j| tet[j]);
                let odd = (a > b) ^ (b > c) ^ (a > c);
                let mut face = [a, b, c];
                face.sort_unstable();
                if face[0] == v {
                    faces.push(([face[1], face[2]], odd, 4 * t + i as u32));
                }
            }
        }
        larger.sort_unstable();
        larger.dedup();
        faces.sort_unstable();
        larger
    }
}

/// Edges and faces of a mesh, each once.
#[derive(Default)]
struct Counts {
    edges: i64,
    faces: i64,
}

impl Counts {
    fn add(&mut self, larger: &[u32], faces: &[Face]) {
        self.edges += larger.len() as i64;
        self.faces += faces.chunk_by(|a, b| a.0 == b.0).count() as i64;
    }

    fn euler(&self, vertices: usize, tets: usize) -> i64 {
        vertices as i64 - self.edges + self.faces - tets as i64
    }
}

fn check_closed(boundary: &[[u32; 3]]) -> Result<(), String> {
    let mut edges: Vec<[u32; 2]> = boundary.iter().flat_map(|&[a, b, c]| [[a, b], [a, c], [b, c]]).collect();
    edges.sort_unstable();
    match edges.chunk_by(|a, b| a == b).find(|group| group.len() % 2 != 0) {
        Some(group) => Err(format!("the boundary is open at the edge {:?}", group[0])),
        None => Ok(()),
    }
}

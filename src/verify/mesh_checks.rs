//! Checks that a mesh is valid and conforming, from plain arrays, by sorting and exact orientation only.

use crate::geom::{Groups, orient3d};
use crate::mesh::{FACES, NONE, boundary_faces};
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
        let mut around = Around::new(reference.positions.len(), reference.tets)?;
        let mut faces = Vec::new();
        let mut count = Counts::default();
        (0..reference.positions.len() as u32).for_each(|v| count.add(around.at(v, &mut faces), &faces));
        Ok(Self { euler: count.euler(reference.positions.len(), reference.tets.len()) })
    }
}

/// A face at its least vertex.
#[derive(Clone, Copy)]
struct Face {
    /// The two other vertices, the smaller one in the upper half.
    others: u64,
    /// Which side its tetrahedron is on.
    side: bool,
    /// Where it is: `4 · tet + face`.
    at: u32,
}

impl Face {
    /// Face number `at` of a mesh, and its least vertex.
    fn of(tets: &[[u32; 4]], at: u32) -> (u32, Self) {
        let tet = tets[at as usize / 4];
        let [a, b, c] = FACES[at as usize % 4].map(|corner| tet[corner]);
        let side = (a > b) ^ (b > c) ^ (a > c);
        let (least, most) = (a.min(b).min(c), a.max(b).max(c));
        let between = a ^ b ^ c ^ least ^ most;
        (least, Self { others: u64::from(between) << 32 | u64::from(most), side, at })
    }
}

impl<'a> PlainMesh<'a> {
    /// The mesh, which must be packed.
    pub fn of(mesh: &'a CurrentMesh) -> Self {
        Self { mesh, positions: mesh.positions(), tets: mesh.tets(), neighbors: mesh.neighbors() }
    }

    /// Everything that makes a valid mesh.
    pub fn check(&self, reference: &Shape) -> Result<(), String> {
        self.check_vertices()?;
        self.check_orientation()?;
        let mut around = Around::new(self.positions.len(), self.tets)?;
        let (mut faces, mut boundary) = (Vec::new(), Vec::new());
        let mut count = Counts::default();
        for v in 0..self.positions.len() as u32 {
            count.add(around.at(v, &mut faces), &faces);
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
        for group in faces.chunk_by(|a, b| a.others == b.others) {
            match group {
                &[Face { others, at, .. }] if across(at) == NONE => {
                    boundary.push([v, (others >> 32) as u32, others as u32]);
                }
                &[Face { at, .. }] => return Err(format!("tetrahedron {} has a neighbour too many", at / 4)),
                &[Face { side, at: a, .. }, Face { side: other_side, at: b, .. }] => {
                    if side == other_side {
                        return Err(format!("tetrahedra {} and {} overlap at a face", a / 4, b / 4));
                    }
                    if across(a) != b / 4 || across(b) != a / 4 {
                        return Err(format!("tetrahedra {} and {} are not neighbours", a / 4, b / 4));
                    }
                }
                [Face { at, .. }, ..] => {
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

/// What is around each vertex: checks vertex by vertex need no list of all faces or edges.
struct Around<'a> {
    tets: &'a [[u32; 4]],
    /// The faces of which a vertex is the least one, by their numbers `4 · tet + face`.
    faces: Groups,
    /// Edges from a vertex to a larger one that may be in none of these faces: those between the two largest vertices of each
    /// tetrahedron.
    edges: Groups,
    /// For each vertex the last one that was found to share an edge with it.
    seen: Vec<u32>,
}

impl<'a> Around<'a> {
    fn new(vertices: usize, tets: &'a [[u32; 4]]) -> Result<Self, String> {
        if tets.len() > crate::mesh::MAX_TETS {
            return Err("too many tetrahedra to check".into());
        }
        if let Some(v) = tets.iter().flatten().find(|v| **v as usize >= vertices) {
            return Err(format!("there is no vertex {v}"));
        }
        let faces = Groups::new(vertices, |add| {
            (0..4 * tets.len() as u32).for_each(|at| add(Face::of(tets, at).0 as usize, at));
        });
        let edges = Groups::new(vertices, |add| {
            tets.iter().for_each(|tet| {
                let mut tet = *tet;
                tet.sort_unstable();
                add(tet[2] as usize, tet[3]);
            });
        });
        Ok(Self { tets, faces, edges, seen: vec![NONE; vertices] })
    }

    /// Gives how many vertices have larger numbers and share an edge with `v`, and sorted the faces of which it is the least vertex.
    fn at(&mut self, v: u32, faces: &mut Vec<Face>) -> usize {
        faces.clear();
        faces.extend(self.faces.of(v as usize).iter().map(|&at| Face::of(self.tets, at).1));
        faces.sort_unstable_by_key(|face| face.others);
        let seen = &mut self.seen;
        let mut is_new = |w: u32| std::mem::replace(&mut seen[w as usize], v) != v;
        let ends = faces.iter().flat_map(|face| [(face.others >> 32) as u32, face.others as u32]);
        ends.chain(self.edges.of(v as usize).iter().copied()).filter(|&w| is_new(w)).count()
    }
}

/// Edges and faces of a mesh, each once.
#[derive(Default)]
struct Counts {
    edges: i64,
    faces: i64,
}

impl Counts {
    fn add(&mut self, larger: usize, faces: &[Face]) {
        self.edges += larger as i64;
        self.faces += faces.chunk_by(|a, b| a.others == b.others).count() as i64;
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

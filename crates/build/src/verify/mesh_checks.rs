//! Checks that a mesh is valid and conforming, from plain arrays, by sorting and exact orientation only.

use std::fmt;

use tetralod::geom::{Groups, orient3d};
use tetralod::mesh::{DisjointSets, FACES, NONE, boundary_faces};
use tetralod::mt::CurrentMesh;

/// An extracted mesh as plain arrays.
pub struct PlainMesh<'a> {
    pub mesh: &'a CurrentMesh,
    pub positions: &'a [[i32; 3]],
    pub tets: &'a [[u32; 4]],
    /// The same with one vertex for all regions that meet there.
    joined: &'a [[u32; 4]],
    pub neighbors: &'a [[u32; 4]],
}

/// A mesh on the lattice as the input gives it.
pub struct PlainReference<'a> {
    pub positions: &'a [[i32; 3]],
    /// `levels[vertex * fields + f]`.
    pub levels: &'a [i32],
    pub tets: &'a [[u32; 4]],
}

/// What no update changes. Where the boundary does not touch itself, the Betti numbers of the mesh follow: its components, its cavities
/// (boundary surfaces − components) and its tunnels (components + cavities − Euler number).
#[derive(Debug, PartialEq, Eq)]
pub struct Shape {
    /// Parts that hang together by faces.
    components: usize,
    /// Parts of the boundary that hang together by edges.
    surfaces: usize,
    /// Vertices − edges + faces − tetrahedra.
    euler: i64,
    /// The Euler number of the boundary.
    boundary_euler: i64,
    /// Vertices at which the boundary touches itself, ends of such edges, too.
    touching: usize,
}

impl Shape {
    pub fn of(reference: &PlainReference<'_>) -> Result<Self, String> {
        let mut around = Around::new(reference.positions.len(), reference.tets)?;
        let (mut faces, mut count) = (Vec::new(), Counts::new(reference.tets.len()));
        (0..reference.positions.len() as u32).for_each(|v| count.add(v, around.at(v, &mut faces), &faces));
        count.shape(reference.positions.len(), reference.tets.len())
    }
}

impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { components, surfaces, euler, boundary_euler, touching } = self;
        write!(
            f,
            "{components} components, Euler number {euler}, a boundary of {surfaces} surfaces with Euler number {boundary_euler}, which \
             touches itself at {touching} vertices"
        )
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
        let joined = mesh.joined_tets();
        Self { mesh, positions: mesh.positions(), tets: mesh.tets(), joined, neighbors: mesh.neighbors() }
    }

    /// Everything that makes a valid mesh.
    pub fn check(&self, reference: &Shape) -> Result<(), String> {
        self.check_vertices()?;
        self.check_orientation()?;
        let shape = self.shape()?;
        if shape != *reference {
            return Err(format!("the topology has changed: {shape}; of the input: {reference}"));
        }
        Ok(())
    }

    /// The topology, if adjacency is right.
    pub fn shape(&self) -> Result<Shape, String> {
        let mut around = Around::new(self.positions.len(), self.joined)?;
        let (mut faces, mut count) = (Vec::new(), Counts::new(self.tets.len()));
        for v in 0..self.positions.len() as u32 {
            count.add(v, around.at(v, &mut faces), &faces);
            self.check_faces(&faces)?;
        }
        count.shape(self.count_joined()?, self.tets.len())
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

    /// How many vertices there are if those of several regions are one. All have their places.
    fn count_joined(&self) -> Result<usize, String> {
        let mut used = vec![false; self.positions.len()];
        if self.joined.len() != self.tets.len() {
            return Err("tetrahedra with shared vertices are not as many".to_owned());
        }
        for (t, (tet, joined)) in self.tets.iter().zip(self.joined).enumerate() {
            for (&v, &w) in tet.iter().zip(joined) {
                used[w as usize] = true;
                if self.positions[v as usize] != self.positions[w as usize] {
                    return Err(format!("tetrahedron {t} is elsewhere with shared vertices"));
                }
            }
        }
        Ok(used.iter().filter(|used| **used).count())
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

    /// Compares adjacency with the sorted faces of one least vertex.
    fn check_faces(&self, faces: &[Face]) -> Result<(), String> {
        let across = |at: u32| self.neighbors[at as usize / 4][at as usize % 4];
        for group in faces.chunk_by(|a, b| a.others == b.others) {
            match group {
                &[Face { at, .. }] if across(at) == NONE => {}
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
        if tets.len() > tetralod::mesh::MAX_TETS {
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
struct Counts {
    edges: i64,
    faces: i64,
    /// Tetrahedra that hang together by faces.
    components: DisjointSets,
    /// The triangles of the boundary, with vertices in increasing order.
    boundary: Vec<[u32; 3]>,
}

impl Counts {
    fn new(tets: usize) -> Self {
        Self { edges: 0, faces: 0, components: DisjointSets::of(tets), boundary: Vec::new() }
    }

    /// Adds what is at vertex `v`: so many edges, and the sorted faces.
    fn add(&mut self, v: u32, larger: usize, faces: &[Face]) {
        self.edges += larger as i64;
        for group in faces.chunk_by(|a, b| a.others == b.others) {
            self.faces += 1;
            if let [Face { others, .. }] = group {
                self.boundary.push([v, (others >> 32) as u32, *others as u32]);
            }
            group.windows(2).for_each(|two| {
                self.components.join(two[0].at as usize / 4, two[1].at as usize / 4);
            });
        }
    }

    /// The shape of the mesh, whose boundary must be closed.
    fn shape(self, vertices: usize, tets: usize) -> Result<Shape, String> {
        let Self { edges, faces, components, boundary } = self;
        // Each edge with the corners at its ends: corner `c` of triangle `f` is number `3 · f + c`.
        let mut ends: Vec<([u32; 2], [usize; 2])> = Vec::with_capacity(3 * boundary.len());
        for (at, &[a, b, c]) in (0..).step_by(3).zip(&boundary) {
            ends.extend([([b, c], [at + 1, at + 2]), ([a, c], [at, at + 2]), ([a, b], [at, at + 1])]);
        }
        ends.sort_unstable();
        let mut surfaces = DisjointSets::of(boundary.len());
        // Corners of triangles that meet at an edge, which no others share, are of one fan around their vertex.
        let mut fans = DisjointSets::of(3 * boundary.len());
        let (mut boundary_edges, mut touching) = (0, Vec::new());
        for group in ends.chunk_by(|a, b| a.0 == b.0) {
            let (edge, first) = group[0];
            if group.len() % 2 != 0 {
                return Err(format!("the boundary is open at the edge {edge:?}"));
            }
            boundary_edges += 1;
            for (_, other) in &group[1..] {
                surfaces.join(first[0] / 3, other[0] / 3);
                if group.len() == 2 {
                    (0..2).for_each(|end| fans.join(first[end], other[end]));
                }
            }
            if group.len() > 2 {
                touching.extend(edge);
            }
        }
        let mut around: Vec<(u32, usize)> = (0..3 * boundary.len())
            .map(|corner| (boundary[corner / 3][corner % 3], fans.root(corner)))
            .collect();
        around.sort_unstable();
        around.dedup();
        let boundary_vertices = around.chunk_by(|a, b| a.0 == b.0).count();
        touching
            .extend(around.chunk_by(|a, b| a.0 == b.0).filter(|fans| fans.len() > 1).map(|fans| fans[0].0));
        touching.sort_unstable();
        touching.dedup();
        Ok(Shape {
            components: components.count(),
            surfaces: surfaces.count(),
            euler: vertices as i64 - edges + faces - tets as i64,
            boundary_euler: boundary_vertices as i64 - boundary_edges + boundary.len() as i64,
            touching: touching.len(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetralod::mesh::kuhn_tets;

    /// Components, surfaces, both Euler numbers and touching vertices of some cubes of a grid.
    fn shape(cubes: [u32; 3], is_there: impl Fn([u32; 3]) -> bool) -> [i64; 5] {
        let tets = kuhn_tets(cubes.map(|c| c + 1));
        let [nx, ny, _] = cubes;
        let place = |cube: u32| [cube % nx, cube / nx % ny, cube / (nx * ny)];
        let of_cubes = (0..).zip(tets.chunks_exact(6)).filter(|(cube, _)| is_there(place(*cube)));
        let mut tets: Vec<[u32; 4]> = of_cubes.flat_map(|(_, six)| six).copied().collect();
        let mut used: Vec<u32> = tets.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        tets.iter_mut().flatten().for_each(|v| *v = used.binary_search(v).unwrap() as u32);
        let positions = vec![[0; 3]; used.len()];
        let shape = Shape::of(&PlainReference { positions: &positions, levels: &[], tets: &tets }).unwrap();
        let Shape { components, surfaces, euler, boundary_euler, touching } = shape;
        [components as i64, surfaces as i64, euler, boundary_euler, touching as i64]
    }

    #[test]
    fn shapes_of_balls_rings_shells_and_what_touches_itself() {
        assert_eq!(shape([3, 3, 3], |_| true), [1, 1, 1, 2, 0], "a ball");
        assert_eq!(shape([3, 3, 1], |at| at != [1, 1, 0]), [1, 1, 0, 0, 0], "a ring");
        assert_eq!(
            shape([5, 3, 1], |at| at != [1, 1, 0] && at != [3, 1, 0]),
            [1, 1, -1, -2, 0],
            "two tunnels"
        );
        assert_eq!(shape([3, 3, 3], |at| at != [1, 1, 1]), [1, 2, 2, 4, 0], "a shell");
        assert_eq!(shape([3, 1, 1], |[x, ..]| x != 1), [2, 2, 2, 4, 0], "two balls");
        assert_eq!(
            shape([2, 2, 2], |[x, y, z]| x == y && y == z),
            [2, 2, 1, 3, 1],
            "two balls with a vertex in common"
        );
        assert_eq!(shape([2, 2, 1], |[x, y, _]| x == y), [2, 1, 1, 3, 2], "two balls with an edge in common");
        let hollow = |at: [u32; 3]| at != [1, 1, 1] && at != [2, 2, 2];
        assert_eq!(shape([4, 4, 4], hollow), [1, 3, 3, 5, 1], "two cavities with a vertex in common");
    }

    #[test]
    fn open_boundaries_are_found() {
        let open = [[0, 1, 2, 3], [0, 1, 2, 4], [0, 1, 2, 5]];
        let found = Shape::of(&PlainReference { positions: &[[0; 3]; 6], levels: &[], tets: &open });
        assert!(found.is_err_and(|error| error.contains("the boundary is open")));
    }
}

//! The mesh that the builder edits: topology only.
//!
//! Vertices are numbered as they come: those of the input first, then one for each collapse. Tetrahedra keep their
//! numbers; those that a collapse removes are marked dead. Removals of vertices use dead numbers again.

use crate::mesh::NONE;

/// A tetrahedral mesh with adjacency, edited by edge collapses or vertex removals.
pub(super) struct WorkMesh {
    pub tets: Vec<[u32; 4]>,
    pub neighbors: Vec<[u32; 4]>,
    /// A tetrahedron at each vertex; [`NONE`] once the vertex is gone.
    pub incident: Vec<u32>,
    /// Numbers of dead tetrahedra that [`WorkMesh::fresh`] may reuse.
    unused: Vec<u32>,
    /// How many tetrahedra are dead.
    dead: usize,
}

/// Marks on tetrahedra. They are not part of the mesh, so that searches need not change it.
#[derive(Default)]
pub(super) struct TetMarks {
    marks: Vec<u32>,
    epoch: u32,
}

impl TetMarks {
    /// Clears all marks, for a mesh of so many tetrahedra.
    fn start(&mut self, tets: usize) {
        self.epoch = self.epoch.wrapping_add(1);
        if self.epoch == 0 {
            self.marks.fill(0);
            self.epoch = 1;
        }
        if self.marks.len() < tets {
            self.marks.resize(tets, 0);
        }
    }

    #[inline]
    fn has(&self, t: u32) -> bool {
        self.marks[t as usize] == self.epoch
    }

    #[inline]
    fn add(&mut self, t: u32) {
        self.marks[t as usize] = self.epoch;
    }
}

/// A tetrahedron of a star, and which of its corners is the centre.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct StarTet {
    pub tet: u32,
    pub corner: u8,
}

impl WorkMesh {
    pub fn new(tets: Vec<[u32; 4]>, neighbors: Vec<[u32; 4]>, vertices: usize) -> Self {
        let mut incident = vec![NONE; vertices];
        for (t, tet) in tets.iter().enumerate() {
            tet.iter().for_each(|&v| incident[v as usize] = t as u32);
        }
        Self { tets, neighbors, incident, unused: Vec::new(), dead: 0 }
    }

    /// The number of tetrahedra around each vertex.
    pub fn degrees(&self) -> Vec<u32> {
        let mut degrees = vec![0; self.incident.len()];
        self.tets.iter().flatten().for_each(|&v| degrees[v as usize] += 1);
        degrees
    }

    /// Whether the vertex is in the mesh.
    pub fn has(&self, v: u32) -> bool {
        self.incident[v as usize] != NONE
    }

    /// How many tetrahedra are in the mesh.
    pub fn live(&self) -> u32 {
        (self.tets.len() - self.dead) as u32
    }

    /// Whether the tetrahedron is in the mesh.
    pub fn is_live(&self, t: u32) -> bool {
        self.tets[t as usize][0] != NONE
    }

    /// The tetrahedra around `v` that are connected through faces; false if there are more than `most`.
    pub fn star(&self, v: u32, most: usize, marks: &mut TetMarks, star: &mut Vec<StarTet>) -> bool {
        marks.start(self.tets.len());
        star.clear();
        self.reach(self.incident[v as usize], v, marks, star);
        let mut next = 0;
        while next < star.len() {
            let StarTet { tet, corner } = star[next];
            next += 1;
            for (i, n) in self.neighbors[tet as usize].into_iter().enumerate() {
                if i != corner as usize && n != NONE && !marks.has(n) {
                    if star.len() == most {
                        return false;
                    }
                    self.reach(n, v, marks, star);
                }
            }
        }
        true
    }

    #[inline]
    fn reach(&self, t: u32, v: u32, marks: &mut TetMarks, star: &mut Vec<StarTet>) {
        marks.add(t);
        let tet = self.tets[t as usize];
        let corner =
            usize::from(tet[1] == v) | (usize::from(tet[2] == v) << 1) | (usize::from(tet[3] == v) * 3);
        star.push(StarTet { tet: t, corner: corner as u8 });
    }

    /// Removes fan tetrahedron `t`, whose corners `i` and `j` are the ends of the collapsing edge.
    pub fn close(&mut self, t: u32, i: usize, j: usize) {
        let (tet, around) = (self.tets[t as usize], self.neighbors[t as usize]);
        let (beyond_i, beyond_j) = (around[i], around[j]);
        self.relink(beyond_i, t, beyond_j);
        self.relink(beyond_j, t, beyond_i);
        for k in (0..4).filter(|&k| k != i && k != j) {
            self.incident[tet[k] as usize] = beyond_i;
        }
        self.tets[t as usize] = [NONE; 4];
        self.dead += 1;
    }

    /// Removes tetrahedron `t`; the caller updates its neighbours.
    pub fn free(&mut self, t: u32) {
        self.tets[t as usize] = [NONE; 4];
        self.unused.push(t);
        self.dead += 1;
    }

    /// The number of a new tetrahedron, for the caller to fill in.
    pub fn fresh(&mut self) -> u32 {
        if let Some(t) = self.unused.pop() {
            self.dead -= 1;
            return t;
        }
        self.tets.push([NONE; 4]);
        self.neighbors.push([NONE; 4]);
        (self.tets.len() - 1) as u32
    }

    fn relink(&mut self, t: u32, from: u32, to: u32) {
        if let Some(n) = self.neighbors[t as usize].iter_mut().find(|n| **n == from) {
            *n = to;
        }
    }
}

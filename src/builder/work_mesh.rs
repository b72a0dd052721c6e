//! The mesh that the builder edits: topology only.
//!
//! Vertices are numbered as they come: those of the input first, then one for each collapse. Tetrahedra keep their
//! numbers; those that a collapse removes are marked dead. What fills the hole of a removed vertex takes the numbers of its star.

use crate::mesh::NONE;

/// Across a face to a part of the domain that is built elsewhere: no tetrahedron, but no boundary either.
pub(super) const ELSEWHERE: u32 = NONE - 1;

/// A tetrahedral mesh with adjacency, edited by edge collapses or vertex removals.
pub(super) struct WorkMesh {
    pub tets: Vec<[u32; 4]>,
    pub neighbors: Vec<[u32; 4]>,
    /// A tetrahedron at each vertex; [`NONE`] once the vertex is gone.
    pub incident: Vec<u32>,
    /// How many tetrahedra are dead.
    dead: usize,
}

/// A small set of tetrahedra: a hash table with open addressing. It takes far less memory than a mark on each tetrahedron, and stays
/// in the cache.
#[derive(Default)]
pub(super) struct TetSet {
    /// Twice as many places as tetrahedra at least, a power of two; [`NONE`] where there is none.
    table: Vec<u32>,
    len: usize,
    /// The neighbours of the tetrahedra in the order in which they were found.
    around: Vec<[u32; 4]>,
}

/// Places of a set that has not grown.
const PLACES: usize = 128;

impl TetSet {
    /// Empties the set.
    fn clear(&mut self) {
        // A large star is rare: after it the set is small again.
        self.table.truncate(PLACES);
        self.table.fill(NONE);
        self.table.resize(PLACES, NONE);
        self.len = 0;
        self.around.clear();
    }

    /// Adds a tetrahedron; false if it is there already. Only after [`TetSet::clear`].
    #[inline]
    fn insert(&mut self, t: u32) -> bool {
        let place = self.place(t);
        if self.table[place] == t {
            return false;
        }
        self.table[place] = t;
        self.len += 1;
        if 2 * self.len >= self.table.len() {
            self.grow();
        }
        true
    }

    /// Where a tetrahedron is, or would be put.
    #[inline]
    fn place(&self, t: u32) -> usize {
        let mask = self.table.len() - 1;
        // Fibonacci hashing: the highest bits of the product depend on all of the number.
        let mut place = (t.wrapping_mul(0x9E37_79B9) >> 16) as usize & mask;
        while self.table[place] != NONE && self.table[place] != t {
            place = (place + 1) & mask;
        }
        place
    }

    #[cold]
    fn grow(&mut self) {
        let size = 2 * self.table.len();
        for t in std::mem::replace(&mut self.table, vec![NONE; size]) {
            if t != NONE {
                let place = self.place(t);
                self.table[place] = t;
            }
        }
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
        Self { tets, neighbors, incident, dead: 0 }
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
    pub fn star(&self, v: u32, most: usize, seen: &mut TetSet, star: &mut Vec<StarTet>) -> bool {
        seen.clear();
        star.clear();
        let first = self.incident[v as usize];
        seen.insert(first);
        star.push(self.star_tet(first, v));
        seen.around.push(self.neighbors[first as usize]);
        let mut next = 0;
        while next < star.len() {
            let corner = star[next].corner;
            let around = seen.around[next];
            next += 1;
            for (i, n) in around.into_iter().enumerate() {
                if i != corner as usize && n < ELSEWHERE && seen.insert(n) {
                    if star.len() == most {
                        return false;
                    }
                    star.push(self.star_tet(n, v));
                    // Read as soon as the tetrahedron is known: the memory delivers several at a time.
                    seen.around.push(self.neighbors[n as usize]);
                }
            }
        }
        true
    }

    #[inline]
    fn star_tet(&self, t: u32, v: u32) -> StarTet {
        let tet = self.tets[t as usize];
        let corner =
            usize::from(tet[1] == v) | (usize::from(tet[2] == v) << 1) | (usize::from(tet[3] == v) * 3);
        StarTet { tet: t, corner: corner as u8 }
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
        self.dead += 1;
    }

    fn relink(&mut self, t: u32, from: u32, to: u32) {
        if let Some(n) = self.neighbors[t as usize].iter_mut().find(|n| **n == from) {
            *n = to;
        }
    }
}

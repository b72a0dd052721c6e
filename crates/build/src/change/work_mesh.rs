//! The mesh that the builder edits: topology only.
//!
//! Vertices are numbered as they come: those of the input first, then one for each collapse. Tetrahedra keep their
//! numbers; those that a collapse removes are marked dead. What fills the hole of a removed vertex takes the numbers of its star.

use tetralod::mesh::NONE;

/// Across a face to a part of the domain that is built elsewhere: no tetrahedron, but no boundary either.
pub(crate) const ELSEWHERE: u32 = NONE - 1;

/// Meshes with fewer numbers are not compacted.
const SMALLEST: usize = 1 << 8;

/// Keeps what has these indices, which ascend, and frees the rest.
pub(crate) fn keep<T: Copy>(all: &mut Vec<T>, indices: &[u32]) {
    for (new, &old) in indices.iter().enumerate() {
        all[new] = all[old as usize];
    }
    all.truncate(indices.len());
    all.shrink_to_fit();
}

/// A tetrahedral mesh with adjacency, edited by edge collapses or vertex removals.
pub(crate) struct WorkMesh {
    pub tets: Vec<[u32; 4]>,
    pub neighbors: Vec<[u32; 4]>,
    /// A tetrahedron at each vertex; [`NONE`] once the vertex is gone.
    pub incident: Vec<u32>,
    /// How many tetrahedra are dead.
    dead: usize,
}

/// A small set of tetrahedra: a hash table with open addressing. It takes far less memory than a mark on each tetrahedron, and stays
/// in the cache.
pub(crate) struct TetSet {
    /// A place is taken if its upper half is `epoch`; the lower half is the tetrahedron then. So the set is emptied without writing to
    /// the table.
    table: Box<[u64; PLACES]>,
    epoch: u32,
    /// The neighbours of the tetrahedra of a star, in its order.
    around: Box<[[u32; 4]; LARGEST_STAR]>,
    /// From which of the star each was found; the first one from itself.
    parents: Box<[u16; LARGEST_STAR]>,
}

/// The most tetrahedra of a star.
pub(crate) const LARGEST_STAR: usize = 512;

/// At most half of the places are taken.
const PLACES: usize = 2 * LARGEST_STAR;

impl Default for TetSet {
    fn default() -> Self {
        Self {
            table: Box::new([0; PLACES]),
            epoch: 0,
            around: Box::new([[NONE; 4]; LARGEST_STAR]),
            parents: Box::new([0; LARGEST_STAR]),
        }
    }
}

impl TetSet {
    /// Empties the set.
    fn clear(&mut self) {
        if self.epoch == u32::MAX {
            self.table.fill(0);
            self.epoch = 0;
        }
        self.epoch += 1;
    }

    /// The neighbours of the `i`-th tetrahedron of the star that was found last.
    #[inline]
    fn around(&self, i: usize) -> [u32; 4] {
        self.around[i % LARGEST_STAR]
    }

    /// From which tetrahedron of that star the `i`-th was found, across a face.
    #[inline]
    fn parent(&self, i: usize) -> usize {
        usize::from(self.parents[i % LARGEST_STAR])
    }

    /// Adds a tetrahedron; false if it is there already. Only after [`TetSet::clear`], and no more than [`LARGEST_STAR`].
    #[inline]
    fn insert(&mut self, t: u32) -> bool {
        let entry = u64::from(self.epoch) << 32 | u64::from(t);
        // Fibonacci hashing: the highest bits of the product depend on all of the number.
        let mut place = (t.wrapping_mul(0x9E37_79B9) >> 16) as usize;
        loop {
            let found = &mut self.table[place % PLACES];
            if *found == entry {
                return false;
            }
            if (*found >> 32) as u32 != self.epoch {
                *found = entry;
                return true;
            }
            place += 1;
        }
    }

    /// Notes the neighbours of the `i`-th tetrahedron of a star, and from which one it was found.
    #[inline]
    fn note(&mut self, i: usize, around: [u32; 4], parent: usize) {
        self.around[i % LARGEST_STAR] = around;
        self.parents[i % LARGEST_STAR] = parent as u16;
    }
}

/// A tetrahedron of a star, and which of its corners is the centre.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct StarTet {
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

    /// Gives the tetrahedra that are left new numbers without gaps, in their order, where at most half of the numbers are still used:
    /// those that are read together are then nearer to each other in memory, and much of it is free. Returns the old numbers.
    pub fn compact(&mut self) -> Option<Vec<u32>> {
        if 2 * self.dead < self.tets.len() || self.tets.len() < SMALLEST {
            return None;
        }
        let mut number = vec![NONE; self.tets.len()];
        let mut live = Vec::with_capacity(self.tets.len() - self.dead);
        for (t, _) in (0..).zip(&self.tets).filter(|(_, tet)| tet[0] != NONE) {
            number[t as usize] = live.len() as u32;
            live.push(t);
        }
        keep(&mut self.tets, &live);
        keep(&mut self.neighbors, &live);
        // Not a tetrahedron: [`NONE`] or [`ELSEWHERE`].
        let renumber = |t: &mut u32| *t = number.get(*t as usize).copied().unwrap_or(*t);
        self.neighbors.iter_mut().flatten().for_each(renumber);
        self.incident.iter_mut().for_each(renumber);
        self.dead = 0;
        Some(live)
    }

    /// Whether the tetrahedron is in the mesh.
    pub fn is_live(&self, t: u32) -> bool {
        self.tets[t as usize][0] != NONE
    }

    /// The tetrahedra around `v` that are connected through faces; false if there are more than `most`, which is at most
    /// [`LARGEST_STAR`].
    pub fn star(&self, v: u32, most: usize, seen: &mut TetSet, star: &mut Vec<StarTet>) -> bool {
        self.star_from(self.incident[v as usize], v, most, seen, star)
    }

    /// The tetrahedra at a vertex that are connected with `first`: where the boundary touches itself, there may be others.
    pub fn star_from(
        &self,
        first: u32,
        v: u32,
        most: usize,
        seen: &mut TetSet,
        star: &mut Vec<StarTet>,
    ) -> bool {
        seen.clear();
        star.clear();
        seen.insert(first);
        seen.note(0, self.neighbors[first as usize], 0);
        star.push(self.star_tet(first, v));
        let mut next = 0;
        while next < star.len() {
            let corner = usize::from(star[next].corner);
            let from = star[seen.parent(next)].tet;
            for (i, n) in seen.around(next).into_iter().enumerate() {
                if i != corner && n < ELSEWHERE && n != from && seen.insert(n) {
                    if star.len() >= most.min(LARGEST_STAR) {
                        return false;
                    }
                    // Read as soon as the tetrahedron is known: the memory delivers several at a time.
                    seen.note(star.len(), self.neighbors[n as usize], next);
                    star.push(self.star_tet(n, v));
                }
            }
            next += 1;
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

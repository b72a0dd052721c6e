//! The lists of an edited surface: the triangles of each tetrahedron and the triangles at each vertex, as lists that
//! run through arrays.

use crate::mesh::NONE;

/// 4 bytes a tetrahedron and a vertex, 16 bytes a triangle.
#[derive(Clone, Debug, Default)]
pub(super) struct Links {
    /// Per tetrahedron its first triangle.
    heads: Vec<u32>,
    /// Per triangle the next one of the same tetrahedron.
    next: Vec<u32>,
    /// Per vertex its first corner; corner `3 t + k` is corner `k` of triangle `t`.
    first: Vec<u32>,
    /// Per corner the next one at the same vertex.
    corners: Vec<[u32; 3]>,
}

/// The tetrahedron that owns a triangle.
pub(super) fn tet_of(owner: u32) -> usize {
    (owner >> 1) as usize
}

impl Links {
    /// The links of a surface in a mesh of `tets` tetrahedra.
    pub fn new(tets: usize, vertices: usize, indices: &[[u32; 3]], owners: &[u32]) -> Self {
        let mut links = Self { heads: vec![NONE; tets], ..Self::default() };
        links.make_room(vertices);
        for (triangle, owner) in owners.iter().enumerate() {
            links.put(triangle, indices, *owner);
        }
        links
    }

    /// Sets the number of tetrahedra; removed ones have no triangles.
    pub fn resize(&mut self, tets: usize) {
        self.heads.resize(tets, NONE);
    }

    /// Makes space for so many vertices.
    pub fn make_room(&mut self, vertices: usize) {
        self.first.resize(vertices, NONE);
    }

    pub fn tet_count(&self) -> usize {
        self.heads.len()
    }

    /// Adds triangle `triangle`, the next one or one that was removed.
    pub fn put(&mut self, triangle: usize, indices: &[[u32; 3]], owner: u32) {
        if triangle == self.next.len() {
            self.next.push(NONE);
            self.corners.push([NONE; 3]);
        }
        self.put_back(triangle, owner);
        for (k, v) in indices[triangle].into_iter().enumerate() {
            let corner = (3 * triangle + k) as u32;
            self.corners[triangle][k] = std::mem::replace(&mut self.first[v as usize], corner);
        }
    }

    /// Puts a triangle back into the list of its tetrahedron, out of which it was taken.
    pub fn put_back(&mut self, triangle: usize, owner: u32) {
        self.next[triangle] = std::mem::replace(&mut self.heads[tet_of(owner)], triangle as u32);
    }

    /// The triangles of a tetrahedron.
    pub fn triangles(&self, t: u32) -> impl Iterator<Item = u32> {
        let some = |triangle: u32| (triangle != NONE).then_some(triangle);
        let head = self.heads.get(t as usize).copied().and_then(some);
        std::iter::successors(head, move |triangle| some(self.next[*triangle as usize]))
    }

    /// Empties the list of triangles of a tetrahedron.
    pub fn take(&mut self, t: u32, taken: &mut Vec<u32>) {
        taken.clear();
        taken.extend(self.triangles(t));
        self.heads[t as usize] = NONE;
    }

    /// The triangles at a vertex.
    pub fn fan(&self, v: u32) -> impl Iterator<Item = u32> {
        self.corners_at(v).map(|corner| corner / 3)
    }

    fn corners_at(&self, v: u32) -> impl Iterator<Item = u32> {
        let some = |corner: u32| (corner != NONE).then_some(corner);
        let next = move |corner: &u32| some(self.corners[(corner / 3) as usize][(corner % 3) as usize]);
        std::iter::successors(some(self.first[v as usize]), next)
    }

    /// Whether a vertex has a triangle.
    pub fn is_used(&self, v: u32) -> bool {
        self.first[v as usize] != NONE
    }

    /// Takes a triangle from its three vertices.
    pub fn unlink(&mut self, triangle: u32, vertices: [u32; 3]) {
        for (k, v) in vertices.into_iter().enumerate() {
            let next = self.corners[triangle as usize][k];
            *self.link_to(v, 3 * triangle + k as u32) = next;
        }
    }

    /// The link to a corner in the list of vertex `v`.
    fn link_to(&mut self, v: u32, corner: u32) -> &mut u32 {
        let mut before = NONE;
        let mut at = self.first[v as usize];
        while at != corner {
            before = at;
            at = self.corners[(at / 3) as usize][(at % 3) as usize];
        }
        match before {
            NONE => &mut self.first[v as usize],
            _ => &mut self.corners[(before / 3) as usize][(before % 3) as usize],
        }
    }

    /// The last triangle, which has `vertices` and `owner`, takes the number of one that was taken out.
    pub fn swap_remove(&mut self, hole: u32, vertices: [u32; 3], owner: u32) {
        let last = self.next.len() as u32 - 1;
        if hole != last {
            for (k, v) in vertices.into_iter().enumerate() {
                *self.link_to(v, 3 * last + k as u32) = 3 * hole + k as u32;
            }
            let head = &mut self.heads[tet_of(owner)];
            let mut at = *head;
            if at == last {
                *head = hole;
            } else {
                while self.next[at as usize] != last {
                    at = self.next[at as usize];
                }
                self.next[at as usize] = hole;
            }
        }
        self.next.swap_remove(hole as usize);
        self.corners.swap_remove(hole as usize);
    }

    /// The last vertex takes the number of vertex `v`, which has no triangle.
    pub fn rename_last(&mut self, v: u32, indices: &mut [[u32; 3]], mut changed: impl FnMut(u32)) {
        let last = self.first.len() as u32 - 1;
        if v != last {
            let corners = Vec::from_iter(self.corners_at(last));
            for corner in corners {
                indices[(corner / 3) as usize][(corner % 3) as usize] = v;
                changed(corner / 3);
            }
        }
        self.first.swap_remove(v as usize);
    }
}

//! A surface made of pieces, at most one polygon a tetrahedron, that is kept up while its mesh changes.
//!
//! [`Watch`] tells which tetrahedra are not what they were, [`Patches`] replaces their pieces. Both cost what changed.
//!
//! What holds:
//! - Pieces of neighbouring tetrahedra share their vertices: one for each crossed edge or touched point.
//! - After an update the triangles are those of a surface made from scratch; only their order and that of the
//!   vertices differ. Vertices that no triangle names may be left over; they are used again.

use crate::mesh::EDGES;
use crate::mesh::FACES;
use crate::mesh::NONE;
use crate::view::MeshView;
use crate::view::cases::CASES;
use std::ops::Range;

/// Where a surface crosses an edge of the mesh: the end inside and the end outside, or twice the same point if the
/// surface goes through that point.
pub(super) type Crossing = [u32; 2];

/// The piece of a surface in one tetrahedron: none, three or four different crossings, counter-clockwise when seen
/// from the inside.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Polygon {
    corners: [Crossing; 4],
    len: usize,
}

/// On which side of a surface a point is: bits, so that those of a tetrahedron can be put together.
pub(super) mod side {
    /// Below: inside.
    pub const INSIDE: u8 = 1;
    /// In the surface itself.
    pub const TOUCHED: u8 = 2;
    /// Above: outside.
    pub const OUTSIDE: u8 = 4;
    /// Neither: a point that is no number is in no piece.
    pub const NOWHERE: u8 = 8;

    /// The side of a point at this height above the surface.
    pub fn of(height: f64) -> u8 {
        if height < 0.0 {
            INSIDE
        } else if height > 0.0 {
            OUTSIDE
        } else if height == 0.0 {
            TOUCHED
        } else {
            NOWHERE
        }
    }

    /// Whether a tetrahedron whose corners have these sides, put together, may have a piece.
    pub fn may_pass(all: u8) -> bool {
        // Nothing inside leaves faces at the bottom of the domain.
        all & TOUCHED != 0 && all & OUTSIDE != 0 || all & INSIDE != 0 && all & (TOUCHED | OUTSIDE) != 0
    }
}

impl Polygon {
    /// The piece of the surface in a tetrahedron whose corners have these sides; a touched corner is used itself. A
    /// face that lies in the surface belongs to the tetrahedron below it or, at the bottom of the domain, to the one
    /// above.
    pub fn of(tet: [u32; 4], sides: [u8; 4], neighbors: [u32; 4]) -> Self {
        if sides.contains(&side::NOWHERE) {
            return Self::default();
        }
        let case = sides.iter().rev().fold(0, |case, s| case << 1 | usize::from(*s == side::INSIDE));
        if case == 0 {
            return Self::of_floor(tet, sides, neighbors);
        }
        let mut polygon = Self::default();
        for &edge in CASES[case] {
            let [a, b] = EDGES[edge];
            let [inside, outside] = if case >> a & 1 == 1 { [a, b] } else { [b, a] };
            let touched = sides[outside] == side::TOUCHED;
            polygon.push([tet[if touched { outside } else { inside }], tet[outside]]);
        }
        polygon.closed()
    }

    /// A face of the domain's boundary that lies in the surface, with nothing below it.
    fn of_floor(tet: [u32; 4], sides: [u8; 4], neighbors: [u32; 4]) -> Self {
        let touched = sides.iter().filter(|s| **s == side::TOUCHED).count();
        let top = sides.iter().position(|s| *s != side::TOUCHED);
        match top {
            Some(top) if touched == 3 && neighbors[top] == NONE => {
                let mut polygon = Self::default();
                FACES[top].iter().for_each(|&i| polygon.push([tet[i]; 2]));
                polygon
            }
            _ => Self::default(),
        }
    }

    /// Edges that end in the same touched point follow one another: one corner for all of them.
    fn push(&mut self, corner: Crossing) {
        if self.len == 0 || self.corners[self.len - 1] != corner {
            self.corners[self.len] = corner;
            self.len += 1;
        }
    }

    /// What spans no area is nothing.
    fn closed(mut self) -> Self {
        if self.len > 1 && self.corners[self.len - 1] == self.corners[0] {
            self.len -= 1;
        }
        if self.len < 3 { Self::default() } else { self }
    }

    /// The same seen from the other side.
    pub fn reversed(mut self) -> Self {
        self.corners[..self.len].reverse();
        self
    }

    fn corners(&self) -> &[Crossing] {
        &self.corners[..self.len]
    }
}

/// A vertex of the surface.
#[derive(Clone, Copy, Debug)]
struct Vertex {
    crossing: Crossing,
    /// The next vertex that is chained at the same point; in a free one anything.
    next: u32,
    /// Triangles that name it; 0 in a free one.
    uses: u32,
}

/// Whose a triangle is.
#[derive(Clone, Copy, Debug)]
struct Owner {
    tet: u32,
    /// The other triangle of the same tetrahedron.
    next: u32,
}

/// The triangles of a surface with the tetrahedron that each is from.
#[derive(Clone, Debug, Default)]
pub(super) struct Patches {
    pub triangles: Vec<[u32; 3]>,
    /// Per triangle: bit `k` is set when the side from corner `k` to the next one is a side of the polygon.
    pub sides: Vec<u8>,
    owners: Vec<Owner>,
    /// Per tetrahedron its first triangle.
    heads: Vec<u32>,
    vertices: Vec<Vertex>,
    /// Per point of the mesh the first vertex on an edge from it.
    chains: Vec<u32>,
    free: Vec<u32>,
    /// Vertices that the owner of the surface has to place.
    fresh: Vec<u32>,
    changed_vertices: Blocks,
    changed_triangles: Blocks,
}

impl Patches {
    /// Nothing, for a mesh of so many points and tetrahedra.
    pub fn clear(&mut self, points: usize, tets: usize) {
        self.triangles.clear();
        self.sides.clear();
        self.owners.clear();
        self.vertices.clear();
        self.free.clear();
        self.fresh.clear();
        self.heads.clear();
        self.heads.resize(tets, NONE);
        self.chains.clear();
        self.chains.resize(points, NONE);
    }

    /// Takes away the pieces of `dirty` tetrahedra and of those that are no more.
    pub fn remove(&mut self, dirty: &[u32], tets: usize) {
        let gone = tets.min(self.heads.len()) as u32..self.heads.len() as u32;
        for t in dirty.iter().copied().chain(gone) {
            while let Some(triangle) = self.head(t) {
                self.remove_triangle(triangle);
            }
        }
    }

    /// Makes room for the points and tetrahedra that there are now; the pieces of the others have been removed.
    pub fn resize(&mut self, points: usize, tets: usize) {
        self.heads.resize(tets, NONE);
        self.chains.resize(points, NONE);
    }

    /// Adds the piece of a tetrahedron that has none.
    pub fn add(&mut self, tet: u32, polygon: &Polygon) {
        let corners = polygon.corners();
        if corners.is_empty() {
            return;
        }
        let mut v = [0; 4];
        for (v, corner) in v.iter_mut().zip(corners) {
            *v = self.vertex(*corner);
        }
        if corners.len() == 3 {
            self.add_triangle(tet, [v[0], v[1], v[2]], 0b111);
        } else {
            self.add_triangle(tet, [v[0], v[1], v[2]], 0b011);
            self.add_triangle(tet, [v[0], v[2], v[3]], 0b110);
        }
    }

    /// Numbers the vertices again if most of them are free; then all are fresh.
    pub fn repack(&mut self) {
        let used = self.vertices.len() - self.free.len();
        if self.free.len() <= 3 * used + 1024 {
            return;
        }
        let mut new = vec![NONE; self.vertices.len()];
        let mut packed = Vec::with_capacity(used);
        for (v, vertex) in self.vertices.iter().enumerate().filter(|(_, vertex)| vertex.uses > 0) {
            new[v] = packed.len() as u32;
            packed.push(*vertex);
            self.chains[vertex.crossing[0] as usize] = NONE;
        }
        for (v, vertex) in (0..).zip(&mut packed) {
            vertex.next = std::mem::replace(&mut self.chains[vertex.crossing[0] as usize], v);
        }
        self.triangles.iter_mut().flatten().for_each(|v| *v = new[*v as usize]);
        self.vertices = packed;
        self.free.clear();
        self.fresh.clear();
        self.fresh.extend(0..used as u32);
        self.changed_triangles.mark_all(self.triangles.len());
    }

    /// Number of vertices, free ones among them.
    pub fn vertex_count(&self) -> usize {
        self.vertices.len()
    }

    /// Lets `place` see every vertex that has come since, and those alone.
    pub fn place_fresh(&mut self, mut place: impl FnMut(usize, Crossing)) {
        for v in self.fresh.drain(..) {
            let vertex = self.vertices[v as usize];
            if vertex.uses > 0 {
                self.changed_vertices.mark(v);
                place(v as usize, vertex.crossing);
            }
        }
    }

    /// Lets `see` every vertex that is not free.
    pub fn each_vertex(&self, mut see: impl FnMut(usize, Crossing)) {
        for (v, vertex) in self.vertices.iter().enumerate().filter(|(_, vertex)| vertex.uses > 0) {
            see(v, vertex.crossing);
        }
    }

    /// What has changed since this was last asked: vertices and triangles.
    pub fn take_changes(&mut self) -> [Vec<Range<u32>>; 2] {
        let vertices = self.changed_vertices.take(self.vertices.len());
        [vertices, self.changed_triangles.take(self.triangles.len())]
    }

    /// Whether a tetrahedron has a piece.
    pub fn has_piece(&self, t: u32) -> bool {
        self.head(t).is_some()
    }

    fn head(&self, t: u32) -> Option<u32> {
        self.heads.get(t as usize).copied().filter(|head| *head != NONE)
    }

    fn add_triangle(&mut self, tet: u32, corners: [u32; 3], sides: u8) {
        let new = self.triangles.len() as u32;
        corners.iter().for_each(|&v| self.vertices[v as usize].uses += 1);
        let next = std::mem::replace(&mut self.heads[tet as usize], new);
        self.triangles.push(corners);
        self.sides.push(sides);
        self.owners.push(Owner { tet, next });
        self.changed_triangles.mark(new);
    }

    /// Removes the first triangle of its tetrahedron; the last of all takes its place.
    fn remove_triangle(&mut self, triangle: u32) {
        let at = triangle as usize;
        let Owner { tet, next } = self.owners[at];
        self.heads[tet as usize] = next;
        for v in self.triangles[at] {
            self.release(v);
        }
        self.triangles.swap_remove(at);
        self.sides.swap_remove(at);
        self.owners.swap_remove(at);
        if at == self.triangles.len() {
            return;
        }
        self.changed_triangles.mark(triangle);
        let moved = self.triangles.len() as u32;
        let head = &mut self.heads[self.owners[at].tet as usize];
        if *head == moved {
            *head = triangle;
        } else {
            self.owners[*head as usize].next = triangle;
        }
    }

    /// The vertex of this crossing: one that is there, or a new one.
    fn vertex(&mut self, crossing: Crossing) -> u32 {
        let first = self.chains[crossing[0] as usize];
        let mut at = first;
        while at != NONE {
            let vertex = &self.vertices[at as usize];
            if vertex.crossing == crossing {
                return at;
            }
            at = vertex.next;
        }
        let vertex = Vertex { crossing, next: first, uses: 0 };
        let new = match self.free.pop() {
            Some(v) => {
                self.vertices[v as usize] = vertex;
                v
            }
            None => {
                self.vertices.push(vertex);
                self.vertices.len() as u32 - 1
            }
        };
        self.chains[crossing[0] as usize] = new;
        self.fresh.push(new);
        new
    }

    /// One triangle less names `v`; the last one frees it.
    fn release(&mut self, v: u32) {
        let vertex = &mut self.vertices[v as usize];
        vertex.uses -= 1;
        if vertex.uses > 0 {
            return;
        }
        let (point, next) = (vertex.crossing[0] as usize, vertex.next);
        if self.chains[point] == v {
            self.chains[point] = next;
        } else {
            let mut at = self.chains[point];
            while self.vertices[at as usize].next != v {
                at = self.vertices[at as usize].next;
            }
            self.vertices[at as usize].next = next;
        }
        self.free.push(v);
    }
}

/// Remembers a mesh, to tell which of its tetrahedra are not what they were.
#[derive(Clone, Debug, Default)]
pub(super) struct Watch {
    /// Position and value of each point, as bits.
    seen: Vec<[u32; 4]>,
    /// Per point a tetrahedron that has it.
    incident: Vec<u32>,
    /// Bits of the tetrahedra in `dirty`; all 0 in between.
    marks: Vec<u64>,
    /// Bits of the tetrahedra in `star`; all 0 in between.
    visited: Vec<u64>,
    /// The tetrahedra around a point, some of which are yet to be looked at.
    star: Vec<u32>,
    /// The tetrahedra that [`Watch::look`] found.
    pub dirty: Vec<u32>,
}

impl Watch {
    /// Remembers a mesh of which nothing is known.
    pub fn reset(&mut self, mesh: &MeshView<'_>) {
        self.dirty.clear();
        self.seen.clear();
        self.seen.extend((0..mesh.positions.len()).map(|p| bits_of(mesh, p)));
        self.incident.clear();
        self.incident.resize(mesh.positions.len(), NONE);
        for t in 0..mesh.tets.len() as u32 {
            self.set_incident(mesh, t);
        }
    }

    /// Finds the tetrahedra that have changed, or have a corner that has, given where to look, as far as they `matter`.
    ///
    /// Of a point that has changed those tetrahedra are found that hang together through faces at the point; where a
    /// mesh is pinched, the others must be among the changed ones.
    pub fn look(
        &mut self,
        mesh: &MeshView<'_>,
        points: &[Range<u32>],
        tets: &[Range<u32>],
        matter: impl Fn(u32) -> bool,
    ) {
        self.dirty.clear();
        self.marks.resize(mesh.tets.len().div_ceil(64), 0);
        self.visited.resize(mesh.tets.len().div_ceil(64), 0);
        self.incident.resize(mesh.positions.len(), NONE);
        let known = self.seen.len();
        self.seen.resize(mesh.positions.len(), [0; 4]);
        for t in within(tets, mesh.tets.len()) {
            self.set_incident(mesh, t);
            if matter(t) {
                self.add(t);
            }
        }
        for p in within(points, mesh.positions.len()) {
            let bits = bits_of(mesh, p as usize);
            let old = std::mem::replace(&mut self.seen[p as usize], bits);
            // The tetrahedra around a new point are new themselves.
            if old != bits && (p as usize) < known {
                self.add_star(mesh, p, &matter);
            }
        }
        for t in &self.dirty {
            self.marks[*t as usize / 64] = 0;
        }
    }

    fn add(&mut self, t: u32) {
        if set(&mut self.marks, t) {
            self.dirty.push(t);
        }
    }

    fn set_incident(&mut self, mesh: &MeshView<'_>, t: u32) {
        for v in mesh.tets[t as usize].into_iter().filter(|v| *v != NONE) {
            self.incident[v as usize] = t;
        }
    }

    /// Adds the tetrahedra around a point. When the one that is remembered is gone or has lost the point, so have all.
    fn add_star(&mut self, mesh: &MeshView<'_>, point: u32, matter: impl Fn(u32) -> bool) {
        let has_point = |t: u32| mesh.tets.get(t as usize).is_some_and(|tet| tet.contains(&point));
        let mut star = std::mem::take(&mut self.star);
        star.extend(
            Some(self.incident[point as usize]).filter(|t| has_point(*t) && set(&mut self.visited, *t)),
        );
        let mut next = 0;
        while let Some(&t) = star.get(next) {
            next += 1;
            if matter(t) {
                self.add(t);
            }
            for n in mesh.neighbors[t as usize] {
                if n != NONE && has_point(n) && set(&mut self.visited, n) {
                    star.push(n);
                }
            }
        }
        star.drain(..).for_each(|t| self.visited[t as usize / 64] = 0);
        self.star = star;
    }
}

/// Sets a bit; whether it was not set.
fn set(bits: &mut [u64], t: u32) -> bool {
    let (word, bit) = (&mut bits[t as usize / 64], 1 << (t % 64));
    let is_new = *word & bit == 0;
    *word |= bit;
    is_new
}

/// All entries of `ranges` below `len`.
pub(super) fn within(ranges: &[Range<u32>], len: usize) -> impl Iterator<Item = u32> + '_ {
    ranges.iter().flat_map(move |range| range.start..range.end.min(len as u32))
}

fn bits_of(mesh: &MeshView<'_>, p: usize) -> [u32; 4] {
    let [x, y, z] = mesh.positions[p];
    [x, y, z, mesh.field[p]].map(f32::to_bits)
}

/// Changed entries of an array, by blocks of 64.
#[derive(Clone, Debug, Default)]
struct Blocks {
    words: Vec<u64>,
}

impl Blocks {
    fn mark(&mut self, entry: u32) {
        let block = entry / 64;
        let word = (block / 64) as usize;
        if word >= self.words.len() {
            self.words.resize(word + 1, 0);
        }
        self.words[word] |= 1 << (block % 64);
    }

    fn mark_all(&mut self, len: usize) {
        (0..len).step_by(64).for_each(|entry| self.mark(entry as u32));
    }

    fn take(&mut self, len: usize) -> Vec<Range<u32>> {
        let mut ranges: Vec<Range<u32>> = Vec::new();
        for block in 0..len.div_ceil(64) as u32 {
            let changed =
                self.words.get((block / 64) as usize).is_some_and(|word| word >> (block % 64) & 1 == 1);
            let (start, end) = (block * 64, (block * 64 + 64).min(len as u32));
            match ranges.last_mut() {
                _ if !changed => {}
                Some(last) if last.end == start => last.end = end,
                _ => ranges.push(start..end),
            }
        }
        self.words.clear();
        ranges
    }
}

//! The current mesh Σ_S: packed arrays with adjacency, edited in place by updates.
//!
//! Vertices and tetrahedra live in *slots*. Refinement appends slots and reuses free ones; coarsening frees slots;
//! [`CurrentMesh::compact`] moves the last entries into the holes, after which the arrays are without holes. Slots
//! changed since [`CurrentMesh::take_changes`] was last called are known by blocks, so that copies elsewhere (a GPU)
//! can be kept up to date at the cost of the change.
//!
//! Guarantees: after every operation [`CurrentMesh::check`] holds. Positions and field levels are integers, so the
//! mesh depends on the set of applied updates alone, not on their order or on the platform.

use super::BaseMesh;
use super::BaseMeshError;
use super::MAX_STAR;
use super::MtInfo;
use super::Sparse;
use super::VertexId;
use super::half_edge_apply::Scratch;
use super::half_edge_star::KnownStars;
use super::insertion::Cavity;
use super::ring::HALF_CAPACITY;
use super::ring::HalfStar;
pub(super) use super::ring::LINK_CAPACITY;
use super::ring::RING_CAPACITY;
use super::ring::Ring;
use super::ring::TURN;
use super::taken::Taken;
use super::tet_errors::TetErrors;
use crate::mesh::{BitSet, ChangedBlocks, FACES, NONE, match_faces, sorted_faces};
use std::ops::Range;

/// The labels of the vertex in a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Labels {
    /// Which vertex of the MT it is; [`NONE`] in a free slot.
    pub vertex: u32,
    /// In edge-based MTs the update that splits it, [`NONE`] if nothing does (yet); in vertex-based ones a fingerprint
    /// of what its insertion removed.
    pub split: u32,
}

/// The current mesh Σ_S.
#[derive(Clone, Debug)]
pub struct CurrentMesh {
    pub(crate) labels: Vec<Labels>,
    pub(crate) positions: Vec<[i32; 3]>,
    /// `levels[slot * fields + f]`.
    pub(crate) levels: Vec<i32>,
    /// A tetrahedron at each vertex.
    pub(crate) incident: Vec<u32>,
    pub(crate) tets: Vec<[u32; 4]>,
    pub(crate) neighbors: Vec<[u32; 4]>,
    /// The slot of each vertex of the MT, [`NONE`] when it is not in the mesh.
    pub(super) slot_of: Sparse<u32>,
    pub(crate) fields: usize,
    /// What the MT knows each tetrahedron by; without entries for kinds of MT that need none.
    tags: Vec<u32>,
    /// For kinds of MT that need it: bit `i` tells that the update which removes the tetrahedron removes its face `i`, too.
    inner: Vec<u8>,
    /// Whether every vertex that is not of the base mesh has a star whose tetrahedra hang together through faces.
    whole_stars: bool,
    /// For each tag a tetrahedron that has it, [`NONE`] if none does: the last that got it.
    place_of: Sparse<u32>,
    /// What is known of the errors of tetrahedra, for MTs that tell it.
    pub(super) tet_errors: Option<Box<TetErrors>>,
    /// What is taken, for kinds of MT whose updates are spelled out.
    pub(super) taken: Option<Box<Taken>>,
    free_vertices: Vec<u32>,
    free_tets: Vec<u32>,
    /// `epoch << MARK_BITS | index in the star` of the last star that each tetrahedron was in.
    marks: Vec<u32>,
    /// The same for the vertices of a link.
    vertex_marks: Vec<u32>,
    epoch: u32,
    ring: Option<Box<Ring>>,
    cavity: Option<Box<Cavity>>,
    scratch: Option<Box<Scratch>>,
    /// For half-edge MTs.
    pub(super) stars: KnownStars,
    changed_vertices: ChangedBlocks,
    changed_tets: ChangedBlocks,
    /// The tetrahedra of the stars that updates changed since the list was last cleared, and where others were moved;
    /// free slots among them.
    touched: Vec<u32>,
    /// Updates that have been applied before and so need not be checked again: their stars are always the same.
    proven: BitSet,
    /// Base vertices whose star is not connected through faces: they cannot be split.
    pinched: Vec<u32>,
}

/// The tetrahedra around a vertex; scratch space that is filled by [`CurrentMesh::gather_star`].
#[derive(Clone, Debug)]
pub(crate) struct Star {
    pub len: usize,
    pub tets: [u32; GATHERED],
    /// Which corner of each tetrahedron is the centre of the star.
    pub corner: [u8; GATHERED],
}

impl Default for Star {
    fn default() -> Self {
        Self { len: 0, tets: [0; GATHERED], corner: [0; GATHERED] }
    }
}

/// Why a star was not gathered.
#[derive(Debug)]
pub(crate) enum Gather<T> {
    /// It has more than [`GATHERED`] tetrahedra, none of which the caller wanted to stop at.
    TooLarge,
    /// The caller's look at a tetrahedron stopped it.
    Stopped(T),
}

/// Largest star that is gathered: the two sides of a collapse have at most `MAX_STAR` tetrahedra together, and at
/// most `MAX_LINK` more lie between them.
pub(crate) const GATHERED: usize = 128;
/// Faces of [`GATHERED`] tetrahedra.
pub(crate) const BARE: usize = 4 * GATHERED;
/// Tags from here on are not looked for.
pub(crate) const FIRST_ANONYMOUS_TAG: u32 = 1 << 31;
const MARK_BITS: u32 = GATHERED.trailing_zeros();
const MARK_MASK: u32 = (1 << MARK_BITS) - 1;
const EPOCHS: u32 = 1 << (32 - MARK_BITS);

impl CurrentMesh {
    /// The base mesh as the current mesh: no update applied.
    ///
    /// # Errors
    /// If the base mesh does not fit `info` or is not a valid mesh.
    pub fn new(info: &MtInfo, base: &BaseMesh) -> Result<Self, BaseMeshError> {
        base.check(info)?;
        let neighbors = face_neighbors(&base.tets)?;
        let vertices = base.positions.len();
        let mut incident = vec![NONE; vertices];
        for (t, tet) in base.tets.iter().enumerate() {
            for &v in tet {
                incident[v as usize] = t as u32;
            }
        }
        if let Some(v) = incident.iter().position(|&t| t == NONE) {
            return Err(BaseMeshError::Vertex(v as u32));
        }
        let mut slot_of = Sparse::new(NONE);
        (0..vertices as u32).for_each(|v| slot_of.set(v, v));
        let mut mesh = Self {
            labels: (0..vertices as u32).map(|vertex| Labels { vertex, split: NONE }).collect(),
            positions: base.positions.clone(),
            levels: base.values.clone(),
            incident,
            tets: base.tets.clone(),
            neighbors,
            slot_of,
            fields: info.fields.len(),
            tags: Vec::new(),
            inner: Vec::new(),
            whole_stars: false,
            place_of: Sparse::new(NONE),
            tet_errors: None,
            taken: None,
            free_vertices: Vec::new(),
            free_tets: Vec::new(),
            marks: vec![0; base.tets.len()],
            vertex_marks: vec![0; vertices],
            epoch: 0,
            ring: None,
            cavity: None,
            scratch: None,
            stars: KnownStars::default(),
            changed_vertices: ChangedBlocks::all(vertices),
            changed_tets: ChangedBlocks::all(base.tets.len()),
            touched: Vec::new(),
            proven: BitSet::default(),
            pinched: Vec::new(),
        };
        mesh.find_pinched();
        Ok(mesh)
    }

    /// Finds the vertices whose tetrahedra do not all hang together through faces at the vertex.
    fn find_pinched(&mut self) {
        let mut around = vec![0_u32; self.labels.len()];
        self.tets.iter().flatten().for_each(|&v| around[v as usize] += 1);
        let mut seen = vec![NONE; self.tets.len()];
        for v in 0..self.labels.len() as u32 {
            let mut stack = vec![self.incident[v as usize]];
            let mut reached = 0;
            while let Some(t) = stack.pop() {
                if std::mem::replace(&mut seen[t as usize], v) == v {
                    continue;
                }
                reached += 1;
                let (tet, next) = (self.tets[t as usize], self.neighbors[t as usize]);
                stack.extend((0..4).filter(|&i| tet[i] != v && next[i] != NONE).map(|i| next[i]));
            }
            if reached != around[v as usize] {
                self.pinched.push(v);
            }
        }
    }

    /// Whether the vertex in `slot` is one that cannot be split: its star is not connected.
    #[inline]
    pub(crate) fn is_pinched(&self, slot: u32) -> bool {
        !self.pinched.is_empty() && self.pinched.binary_search(&slot).is_ok()
    }

    /// Whether update `u` has been applied before.
    #[inline]
    pub(crate) fn is_proven(&self, u: u32) -> bool {
        self.proven.has(u)
    }

    #[inline]
    pub(crate) fn set_proven(&mut self, u: u32) {
        self.proven.insert(u);
    }

    /// Updates from this one on are to be checked again: what was not known of when they were applied may have to come
    /// before them.
    pub(crate) fn forget_proven(&mut self, from: u32) {
        self.proven.truncate(from);
    }

    /// Forgets memory of vertices that are not in the mesh.
    pub(super) fn forget_vertices(&mut self, vertices: Range<u32>) {
        self.slot_of.forget(vertices);
    }

    /// Gives every tetrahedron a tag: `tags` says which.
    pub(crate) fn tag_all(&mut self, tags: impl IntoIterator<Item = u32>) {
        self.tags = vec![NONE; self.tets.len()];
        for (t, tag) in (0..self.tets.len() as u32).zip(tags) {
            self.set_tag(t, tag);
        }
    }

    /// Gives every tetrahedron a tag and says which of its faces go with it. Every vertex that updates insert must have a
    /// star whose tetrahedra hang together through faces.
    pub(super) fn mark_all(&mut self, marks: impl IntoIterator<Item = (u32, u8)>) {
        let (tags, inner): (Vec<u32>, Vec<u8>) = marks.into_iter().unzip();
        self.tag_all(tags);
        self.inner = inner;
        self.inner.resize(self.tets.len(), 0);
        self.whole_stars = true;
    }

    /// Which faces of tetrahedron `t` the update that removes it removes, too.
    #[inline]
    pub(super) fn inner(&self, t: u32) -> u8 {
        self.inner[t as usize]
    }

    /// Gives tetrahedron `t` a tag, and says which of its faces go with it.
    #[inline]
    pub(super) fn set_mark(&mut self, t: u32, tag: u32, inner: u8) {
        self.set_tag(t, tag);
        self.inner[t as usize] = inner;
    }

    /// Whether tetrahedra have tags.
    #[inline]
    fn is_tagged(&self) -> bool {
        !self.tags.is_empty()
    }

    /// What the MT knows tetrahedron `t` by.
    #[inline]
    pub(crate) fn tag(&self, t: u32) -> u32 {
        self.tags[t as usize]
    }

    /// Gives tetrahedron `t` a tag. Those of at least [`FIRST_ANONYMOUS_TAG`] are not looked for by
    /// [`CurrentMesh::tagged`].
    #[inline]
    pub(crate) fn set_tag(&mut self, t: u32, tag: u32) {
        let old = std::mem::replace(&mut self.tags[t as usize], tag);
        if self.place_of.get(old) == t {
            self.place_of.set(old, NONE);
        }
        if tag < FIRST_ANONYMOUS_TAG {
            self.place_of.set(tag, t);
        }
    }

    /// Gives tetrahedron `t` a tag that is not looked for, although it is below [`FIRST_ANONYMOUS_TAG`], in the place of one that is
    /// not.
    #[inline]
    pub(super) fn take_tag(&mut self, t: u32, tag: u32) {
        self.tags[t as usize] = tag;
    }

    /// The tetrahedron that got a tag last, as long as it is in the mesh and has it.
    #[inline]
    pub(crate) fn tagged(&self, tag: u32) -> Option<u32> {
        Some(self.place_of.get(tag)).filter(|&t| t != NONE)
    }

    /// Takes the tag of `from` over to `to`, a free slot.
    #[inline]
    fn move_tag(&mut self, from: u32, to: u32) {
        if self.is_tagged() {
            let tag = self.tags[from as usize];
            self.tags[to as usize] = tag;
            if self.whole_stars {
                self.inner[to as usize] = self.inner[from as usize];
            }
            if self.place_of.get(tag) == from {
                self.place_of.set(tag, to);
            }
        }
        if let Some(errors) = &mut self.tet_errors {
            errors.set(to, errors.get(from));
        }
    }

    /// How often the errors of the update that removes tetrahedron `t` can be quartered to bound its own, as far as is known.
    #[inline]
    pub(crate) fn quarterings(&self, t: u32) -> u8 {
        self.tet_errors.as_ref().map_or(0, |errors| errors.get(t))
    }

    /// Sets that, where it is kept.
    #[inline]
    pub(crate) fn set_quarterings(&mut self, t: u32, quarterings: u8) {
        if let Some(errors) = &mut self.tet_errors {
            errors.set(t, quarterings);
        }
    }

    /// Number of tetrahedra.
    pub fn tet_count(&self) -> usize {
        self.tets.len() - self.free_tets.len()
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.labels.len() - self.free_vertices.len()
    }

    /// Heap bytes of everything that the mesh holds: entries that are there, not what is reserved for more.
    pub fn bytes(&self) -> u64 {
        let vertices = size_of_val(&self.labels[..])
            + size_of_val(&self.positions[..])
            + size_of_val(&self.levels[..])
            + size_of_val(&self.incident[..])
            + size_of_val(&self.vertex_marks[..])
            + size_of_val(&self.free_vertices[..]);
        let tets = size_of_val(&self.tets[..])
            + size_of_val(&self.neighbors[..])
            + size_of_val(&self.tags[..])
            + size_of_val(&self.inner[..])
            + size_of_val(&self.marks[..])
            + size_of_val(&self.free_tets[..])
            + size_of_val(&self.touched[..]);
        let of_the_mt = self.slot_of.bytes()
            + self.place_of.bytes()
            + size_of_val(self.proven.words())
            + size_of_val(&self.pinched[..])
            + self.taken.as_ref().map_or(0, |taken| taken.bytes());
        let errors = self.tet_errors.as_ref().map_or(0, |errors| errors.bytes());
        let changes = self.changed_vertices.bytes() + self.changed_tets.bytes();
        let scratch = self.ring.as_ref().map_or(0, |ring| size_of_val(&**ring))
            + self.cavity.as_ref().map_or(0, |cavity| size_of_val(&**cavity))
            + self.scratch.as_ref().map_or(0, |scratch| size_of_val(&**scratch));
        (vertices + tets + of_the_mt + changes + scratch) as u64 + self.stars.bytes() + errors
    }

    /// Number of tetrahedron slots, holes included; see [`CurrentMesh::tet`].
    pub fn tet_slots(&self) -> usize {
        self.tets.len()
    }

    /// The vertex slots of tetrahedron `t`; none if the slot is free.
    #[inline]
    pub fn tet(&self, t: u32) -> Option<[u32; 4]> {
        self.tets.get(t as usize).copied().filter(|tet| tet[0] != NONE)
    }

    /// The tetrahedra as vertex slots; without holes after [`CurrentMesh::compact`].
    pub fn tets(&self) -> &[[u32; 4]] {
        &self.tets
    }

    /// For each tetrahedron the one across each face, [`NONE`] on the boundary.
    pub fn neighbors(&self) -> &[[u32; 4]] {
        &self.neighbors
    }

    /// Integer positions by slot.
    pub fn positions(&self) -> &[[i32; 3]] {
        &self.positions
    }

    /// Levels of all fields at the vertex in `slot`.
    #[inline]
    pub fn levels(&self, slot: u32) -> &[i32] {
        &self.levels[slot as usize * self.fields..][..self.fields]
    }

    /// Which vertex of the MT lives in `slot`.
    #[inline]
    pub fn vertex(&self, slot: u32) -> VertexId {
        VertexId(self.labels[slot as usize].vertex)
    }

    /// The slot of a vertex of the MT, if it is in the mesh.
    #[inline]
    pub fn slot(&self, vertex: VertexId) -> Option<u32> {
        Some(self.slot_of.get(vertex.0)).filter(|&s| s != NONE)
    }

    /// Moves the last entries into the holes that coarsening left, so that all arrays are packed.
    pub fn compact(&mut self) {
        while let Some(hole) = self.free_tets.pop() {
            self.fill_tet(hole);
        }
        // In edge-based MTs base vertices keep the first slots for good: a hole is never among them unless every
        // later slot is free too, so a vertex that moves is one whose star is whole.
        let mut moves = Vec::new();
        while let Some(hole) = self.free_vertices.pop() {
            match self.fill_vertex(hole) {
                Some([from, to]) if !self.is_tagged() || self.whole_stars => self.rename(from, to),
                moved => moves.extend(moved),
            }
        }
        self.rename_all(&moves);
        if let Some(errors) = &mut self.tet_errors {
            errors.truncate(self.tets.len());
        }
        self.changed_tets.truncate(self.tets.len());
        self.changed_vertices.truncate(self.labels.len());
    }

    fn fill_tet(&mut self, hole: u32) {
        while self.tets.last().is_some_and(|tet| tet[0] == NONE) {
            self.pop_tet();
        }
        let last = self.tets.len() as u32;
        if hole >= last {
            return;
        }
        let from = last - 1;
        let (tet, around) = (self.tets[from as usize], self.neighbors[from as usize]);
        self.tets[hole as usize] = tet;
        self.neighbors[hole as usize] = around;
        self.move_tag(from, hole);
        self.changed_tets.mark(hole);
        self.touched.push(hole);
        for n in around {
            if n != NONE {
                self.relink(n, from, hole);
            }
        }
        for v in tet {
            if self.incident[v as usize] == from {
                self.incident[v as usize] = hole;
            }
        }
        self.pop_tet();
    }

    fn pop_tet(&mut self) {
        self.tets.pop();
        self.tags.pop();
        self.inner.pop();
        self.neighbors.pop();
        self.marks.pop();
    }

    /// Moves the last vertex into a hole, and tells from where to where; its tetrahedra are the caller's to rename.
    fn fill_vertex(&mut self, hole: u32) -> Option<[u32; 2]> {
        while self.labels.last().is_some_and(|l| l.vertex == NONE) {
            self.pop_vertex();
        }
        let last = self.labels.len() as u32;
        if hole >= last {
            return None;
        }
        let from = last - 1;
        self.labels[hole as usize] = self.labels[from as usize];
        self.positions[hole as usize] = self.positions[from as usize];
        self.incident[hole as usize] = self.incident[from as usize];
        let fields = self.fields;
        self.levels.copy_within(from as usize * fields..(from as usize + 1) * fields, hole as usize * fields);
        self.slot_of.set(self.labels[hole as usize].vertex, hole);
        self.changed_vertices.mark(hole);
        self.pop_vertex();
        Some([from, hole])
    }

    fn pop_vertex(&mut self) {
        self.labels.pop();
        self.positions.pop();
        self.incident.pop();
        self.vertex_marks.pop();
        self.levels.truncate(self.labels.len() * self.fields);
    }

    /// Replaces vertex slots in all tetrahedra.
    fn rename_all(&mut self, moves: &[[u32; 2]]) {
        let Some(first) = moves.iter().map(|&[from, _]| from).min() else { return };
        let mut new = Vec::new();
        for &[from, to] in moves {
            let at = (from - first) as usize;
            if at >= new.len() {
                new.resize(at + 1, NONE);
            }
            new[at] = to;
        }
        for t in 0..self.tets.len() {
            for corner in 0..4 {
                let slot = self.tets[t][corner];
                let next = |slot: &u32| {
                    let to = slot.checked_sub(first).and_then(|at| new.get(at as usize)).copied();
                    to.filter(|&to| to != NONE)
                };
                // A vertex may have moved more than once.
                if let Some(to) = std::iter::successors(next(&slot), next).last() {
                    self.tets[t][corner] = to;
                    self.changed_tets.mark(t as u32);
                }
            }
        }
    }

    /// Replaces vertex slot `from` by `to`, where it is already, in its whole star, however large.
    fn rename(&mut self, from: u32, to: u32) {
        let mut stack = vec![self.incident[to as usize]];
        while let Some(t) = stack.pop() {
            let Some(corner) = self.tets[t as usize].iter().position(|&v| v == from) else { continue };
            self.tets[t as usize][corner] = to;
            self.changed_tets.mark(t);
            let around = self.neighbors[t as usize];
            stack.extend((0..4).filter(|&i| i != corner && around[i] != NONE).map(|i| around[i]));
        }
    }

    /// Makes neighbour `t` of `from` a neighbour of `to` instead.
    #[inline]
    pub(crate) fn relink(&mut self, t: u32, from: u32, to: u32) {
        let around = &mut self.neighbors[t as usize];
        // A choice for each, not a branch.
        *around = around.map(|n| if n == from { to } else { n });
        self.changed_tets.mark(t);
    }

    /// Collects the tetrahedra around the vertex in `slot` and marks them; `look` sees each and may stop it.
    #[inline]
    pub(crate) fn gather_star<T>(
        &mut self,
        slot: u32,
        star: &mut Star,
        mut look: impl FnMut(&[Labels], &[u32; 4]) -> Option<T>,
    ) -> Result<(), Gather<T>> {
        self.next_epoch();
        let first = self.incident[slot as usize];
        star.len = 1;
        star.tets[0] = first;
        self.marks[first as usize] = self.epoch << MARK_BITS;
        let mut next = 0;
        while next < star.len {
            let t = star.tets[next] as usize;
            let tet = self.tets[t];
            if let Some(found) = look(&self.labels, &tet) {
                return Err(Gather::Stopped(found));
            }
            let corner = (usize::from(tet[1] == slot))
                | (usize::from(tet[2] == slot) << 1)
                | (usize::from(tet[3] == slot) * 3);
            star.corner[next] = corner as u8;
            next += 1;
            let around = self.neighbors[t];
            for (i, &n) in around.iter().enumerate() {
                if i == corner || n == NONE || self.marks[n as usize] >> MARK_BITS == self.epoch {
                    continue;
                }
                if star.len == GATHERED {
                    // What stops the caller may be among those not looked at yet.
                    let rest = star.tets[next..].iter().chain([&n]);
                    let found = rest.map(|&t| self.tets[t as usize]).find_map(|tet| look(&self.labels, &tet));
                    return Err(found.map_or(Gather::TooLarge, Gather::Stopped));
                }
                self.marks[n as usize] = self.epoch << MARK_BITS | star.len as u32;
                star.tets[star.len] = n;
                star.len += 1;
            }
        }
        Ok(())
    }

    /// Collects the tetrahedra around the vertex in `slot` with their link, and marks them. Stops if an update before
    /// `update` splits a link vertex.
    #[inline]
    pub(super) fn gather_ring(&mut self, slot: u32, update: u32, ring: &mut Ring) -> Result<(), Gather<u32>> {
        self.next_epoch();
        let first = self.incident[slot as usize];
        let (tet, around) = (self.tets[first as usize], self.neighbors[first as usize]);
        let (mut len, mut queued, mut first_split) = (0, 1, NONE);
        ring.link_len = 0;
        // As if the first tetrahedron had been found through one of its faces.
        let centre = corner_of(&tet, slot);
        let [_, through, k, l] = TURN[4 * centre + (centre + 1) % 4].map(|corner| corner as usize & 3);
        let a = self.number(tet[k], ring, &mut first_split);
        let b = self.number(tet[l], ring, &mut first_split);
        self.marks[first as usize] = self.epoch << MARK_BITS;
        ring.tets[0] = first;
        ring.link_of[0] = a << 8 | b << 16;
        ring.beside[0] = self.follow(around[through], [first, 0], b << 8 | a << 16, ring, &mut queued);
        while len < queued {
            if queued as usize > MAX_STAR {
                return Err(Gather::TooLarge);
            }
            let place = len as usize % RING_CAPACITY;
            let t = ring.tets[place];
            let (tet, around) = (self.tets[t as usize], self.neighbors[t as usize]);
            let from = if len == 0 { through } else { corner_of(&around, ring.from[place]) };
            let turn = TURN[(4 * corner_of(&tet, slot) + from) % 16];
            let [_, own, k, l] = turn.map(|corner| corner as usize & 3);
            let x = self.number(tet[own], ring, &mut first_split);
            if first_split < update {
                return Err(Gather::Stopped(first_split));
            }
            let link = ring.link_of[place] | x;
            let beyond_k = self.follow(around[k], [t, len], x << 8 | link & 0xFF_0000, ring, &mut queued);
            let beyond_l = self.follow(around[l], [t, len], link & 0xFF00 | x << 16, ring, &mut queued);
            ring.turn[place] = turn;
            ring.link_of[place] = link;
            ring.beside[place] |= beyond_k << 8 | beyond_l << 16;
            len += 1;
        }
        ring.len = len as usize;
        Ok(())
    }

    /// The index of tetrahedron `n` in the ring, found through a face of `t` with the index `behind`; that index again
    /// if there is none.
    ///
    /// Whether it is new is a coin toss for the processor: the entry after the last one is written anyway, and counted if
    /// it was new. Lengths stay below the capacities, so the remainders change nothing.
    #[inline(always)]
    fn follow(
        &mut self,
        n: u32,
        [t, behind]: [u32; 2],
        shared: u32,
        ring: &mut Ring,
        queued: &mut u32,
    ) -> u32 {
        // Also NONE is beyond the array.
        let Some(old) = self.marks.get_mut(n as usize) else { return behind };
        let mark = self.epoch << MARK_BITS;
        let is_new = *old & !MARK_MASK != mark;
        let own = if is_new { mark | *queued } else { *old };
        *old = own;
        let place = *queued as usize % RING_CAPACITY;
        ring.tets[place] = n;
        ring.from[place] = t;
        ring.link_of[place] = shared;
        ring.beside[place] = behind;
        *queued += u32::from(is_new);
        own & MARK_MASK
    }

    /// The index of a link vertex in the ring, where it is put if it is new.
    #[inline(always)]
    fn number(&mut self, v: u32, ring: &mut Ring, first_split: &mut u32) -> u32 {
        let mark = self.epoch << MARK_BITS;
        let old = &mut self.vertex_marks[v as usize];
        let is_new = *old & !MARK_MASK != mark;
        let own = if is_new { mark | ring.link_len as u32 } else { *old };
        *old = own;
        let place = ring.link_len % LINK_CAPACITY;
        let labels = self.labels[v as usize];
        ring.link[place] = v;
        // The shift keeps the order.
        ring.numbers[place] = (labels.vertex ^ 1 << 31) as i32;
        ring.link_len += usize::from(is_new);
        *first_split = labels.split.min(*first_split);
        own & MARK_MASK
    }

    /// Collects the tetrahedra around the vertex in `slot`, as [`CurrentMesh::gather_ring`] does, and tells the largest
    /// number of a vertex of theirs. Stops at one that is larger than `largest`; where the star is too large, those that
    /// were found are searched all the same.
    #[inline]
    pub(super) fn gather_half(&mut self, slot: u32, largest: u32, half: &mut HalfStar) -> u32 {
        self.next_epoch();
        let first = self.incident[slot as usize];
        let (tet, around) = (self.tets[first as usize], self.neighbors[first as usize]);
        let mut newest = tet.iter().fold(0, |newest, &v| self.labels[v as usize].vertex.max(newest));
        self.marks[first as usize] = self.epoch << MARK_BITS;
        half.tets[0] = first;
        let (mut len, mut queued) = (1, 1);
        let centre = corner_of(&tet, slot);
        for k in [1, 2, 3] {
            self.follow_half(around[(centre + k) % 4], first, half, &mut queued);
        }
        while len < queued && queued <= GATHERED && newest <= largest {
            let place = len % HALF_CAPACITY;
            let t = half.tets[place];
            let (tet, around) = (self.tets[t as usize], self.neighbors[t as usize]);
            let from = corner_of(&around, half.from[place]);
            let turn = TURN[(4 * corner_of(&tet, slot) + from) % 16];
            let [_, own, k, l] = turn.map(|corner| corner as usize & 3);
            newest = self.labels[tet[own] as usize].vertex.max(newest);
            self.follow_half(around[k], t, half, &mut queued);
            self.follow_half(around[l], t, half, &mut queued);
            len += 1;
        }
        half.len = queued;
        if queued > GATHERED { newest.max(self.newest_of(half.tets())) } else { newest }
    }

    #[inline(always)]
    fn follow_half(&mut self, n: u32, t: u32, half: &mut HalfStar, queued: &mut usize) {
        // Also NONE is beyond the array.
        let Some(old) = self.marks.get_mut(n as usize) else { return };
        let is_new = *old >> MARK_BITS != self.epoch;
        *old = self.epoch << MARK_BITS;
        half.tets[*queued % HALF_CAPACITY] = n;
        half.from[*queued % HALF_CAPACITY] = t;
        *queued += usize::from(is_new);
    }

    /// The largest number of a vertex of these tetrahedra.
    #[cold]
    fn newest_of(&self, tets: &[u32]) -> u32 {
        let vertices = tets.iter().flat_map(|&t| self.tets[t as usize]);
        vertices.map(|v| self.labels[v as usize].vertex).max().unwrap_or(0)
    }

    /// The number that tetrahedron `t` has got since [`Self::next_epoch`]; if it has none it gets `number`, below
    /// [`GATHERED`].
    #[inline]
    pub(super) fn number_tet(&mut self, t: u32, number: u32) -> Option<u32> {
        let mark = self.epoch << MARK_BITS;
        let old = std::mem::replace(&mut self.marks[t as usize], mark | number);
        if old & !MARK_MASK != mark {
            return None;
        }
        self.marks[t as usize] = old;
        Some(old & MARK_MASK)
    }

    /// The number that tetrahedron `t` has got since [`Self::next_epoch`], if it has one.
    #[inline]
    pub(super) fn tet_number(&self, t: u32) -> Option<u32> {
        let mark = self.marks[t as usize];
        (mark >> MARK_BITS == self.epoch).then_some(mark & MARK_MASK)
    }

    /// The number that the vertex in `slot` has got since [`Self::next_epoch`]; if it has none it gets `number`, below
    /// [`GATHERED`].
    #[inline]
    pub(super) fn number_slot(&mut self, slot: u32, number: u32) -> Option<u32> {
        let mark = self.epoch << MARK_BITS;
        let old = std::mem::replace(&mut self.vertex_marks[slot as usize], mark | number);
        if old & !MARK_MASK != mark {
            return None;
        }
        self.vertex_marks[slot as usize] = old;
        Some(old & MARK_MASK)
    }

    /// Forgets all marks and numbers of tetrahedra and vertices.
    pub(super) fn next_epoch(&mut self) {
        self.epoch += 1;
        if self.epoch == EPOCHS {
            self.marks.fill(0);
            self.vertex_marks.fill(0);
            self.epoch = 1;
        }
    }

    /// Collects the tetrahedra with this tag that hang together with `first`, which has it, and their faces that none of
    /// them lies behind (tetrahedron, face, what does); starts a numbering of vertices. Returns how many there are of
    /// both; none if there are more than [`GATHERED`] tetrahedra.
    #[inline]
    pub(super) fn gather_tagged(
        &mut self,
        first: u32,
        tag: u32,
        tets: &mut [u32; GATHERED],
        bare: &mut [[u32; 3]; BARE],
    ) -> Option<(usize, usize)> {
        self.next_epoch();
        let mark = self.epoch << MARK_BITS;
        self.marks[first as usize] = mark;
        tets[0] = first;
        let (mut next, mut len, mut bare_len) = (0, 1, 0);
        // Which neighbours have the tag is a coin toss for the processor: the entries after the last one are written
        // anyway, and counted if they belong there. Lengths stay below the capacities, so the remainders change nothing.
        while next < len {
            let t = tets[next % GATHERED];
            next += 1;
            for (face, n) in (0..).zip(self.neighbors[t as usize]) {
                bare[bare_len % BARE] = [t, face, n];
                // Also NONE is beyond the array.
                let (Some(&own), Some(old)) = (self.tags.get(n as usize), self.marks.get_mut(n as usize))
                else {
                    bare_len += 1;
                    continue;
                };
                bare_len += usize::from(own != tag);
                let is_new = (own == tag) & (*old != mark);
                if len == GATHERED {
                    if is_new {
                        return None;
                    }
                    continue;
                }
                *old = if is_new { mark } else { *old };
                tets[len % GATHERED] = n;
                len += usize::from(is_new);
            }
        }
        Some((len, bare_len))
    }

    /// Which face of tetrahedron `t` its neighbour `towards` lies behind.
    #[inline]
    pub(super) fn side_towards(&self, t: u32, towards: u32) -> Option<u8> {
        let [a, b, c, d] = self.neighbors[t as usize].map(|n| u8::from(n == towards));
        (a | b | c | d != 0).then_some((b + 2 * c + 3 * d) & 3)
    }

    /// The number of a vertex, by index into `list`, where it is put if it has none yet. The list may be full for at most
    /// three vertices before that is noticed.
    #[inline]
    pub(super) fn number_vertex(
        &mut self,
        slot: u32,
        list: &mut [u32; LINK_CAPACITY],
        len: &mut usize,
    ) -> u8 {
        let mark = self.epoch << MARK_BITS;
        let old = &mut self.vertex_marks[slot as usize];
        let is_new = *old & !MARK_MASK != mark;
        let own = if is_new { mark | *len as u32 } else { *old };
        *old = own;
        list[*len % LINK_CAPACITY] = slot;
        *len += usize::from(is_new);
        (own & MARK_MASK) as u8
    }

    /// The number of a vertex, if it has one.
    #[inline]
    pub(super) fn vertex_number(&self, slot: u32) -> Option<u8> {
        let mark = self.vertex_marks[slot as usize];
        (mark >> MARK_BITS == self.epoch).then_some((mark & MARK_MASK) as u8)
    }

    /// The numbers of a tetrahedron's corners, if all have one.
    #[inline]
    pub(super) fn corner_numbers(&self, tet: &[u32; 4]) -> Option<[u8; 4]> {
        let marks = tet.map(|v| self.vertex_marks[v as usize]);
        let epoch = self.epoch << MARK_BITS;
        let differing = marks.iter().fold(0, |bits, mark| bits | (mark ^ epoch));
        (differing <= MARK_MASK).then_some(marks.map(|mark| (mark & MARK_MASK) as u8))
    }

    /// Free or new tetrahedron slots, to be filled by the caller.
    #[inline]
    pub(super) fn new_tets(&mut self, slots: &mut [u32]) {
        let reused = slots.len().min(self.free_tets.len());
        let (old, new) = slots.split_at_mut(reused);
        old.iter_mut()
            .zip(self.free_tets.drain(self.free_tets.len() - reused..))
            .for_each(|(t, free)| *t = free);
        let len = self.tets.len();
        let grown = len + new.len();
        new.iter_mut().zip(len as u32..).for_each(|(t, next)| *t = next);
        self.tets.resize(grown, [NONE; 4]);
        self.neighbors.resize(grown, [NONE; 4]);
        self.marks.resize(grown, 0);
        if self.is_tagged() {
            self.tags.resize(grown, NONE);
        }
        if self.whole_stars {
            self.inner.resize(grown, 0);
        }
        slots.iter().for_each(|&t| self.changed_tets.mark(t));
    }

    /// Lends the scratch space for insertions.
    pub(super) fn take_cavity(&mut self) -> Box<Cavity> {
        self.cavity.take().unwrap_or_default()
    }

    pub(super) fn put_back_cavity(&mut self, cavity: Box<Cavity>) {
        self.cavity = Some(cavity);
    }

    /// Lends the scratch space of half-edge insertions.
    pub(super) fn take_scratch(&mut self) -> Box<Scratch> {
        self.scratch.take().unwrap_or_default()
    }

    pub(super) fn put_back_scratch(&mut self, scratch: Box<Scratch>) {
        self.scratch = Some(scratch);
    }

    /// Makes `t` the tetrahedron that [`Self::tagged`] finds for its tag.
    #[inline]
    pub(super) fn place_tag(&mut self, t: u32) {
        let tag = self.tags[t as usize];
        if tag < FIRST_ANONYMOUS_TAG {
            self.place_of.set(tag, t);
        }
    }

    /// Lends the scratch space for splits.
    pub(super) fn take_ring(&mut self) -> Box<Ring> {
        self.ring.take().unwrap_or_default()
    }

    pub(super) fn put_back_ring(&mut self, ring: Box<Ring>) {
        self.ring = Some(ring);
    }

    /// A free or new tetrahedron slot, to be filled by the caller.
    #[inline]
    pub(crate) fn new_tet(&mut self) -> u32 {
        let t = self.free_tets.pop().unwrap_or_else(|| {
            self.tets.push([NONE; 4]);
            self.neighbors.push([NONE; 4]);
            self.marks.push(0);
            if self.is_tagged() {
                self.tags.push(NONE);
            }
            if self.whole_stars {
                self.inner.push(0);
            }
            self.tets.len() as u32 - 1
        });
        self.changed_tets.mark(t);
        t
    }

    pub(crate) fn free_tet(&mut self, t: u32) {
        self.tets[t as usize] = [NONE; 4];
        self.neighbors[t as usize] = [NONE; 4];
        if self.is_tagged() {
            self.set_tag(t, NONE);
        }
        self.free_tets.push(t);
    }

    /// A free or new vertex slot, to be filled by [`CurrentMesh::put_vertex`].
    #[inline]
    pub(crate) fn new_vertex(&mut self) -> u32 {
        self.free_vertices.pop().unwrap_or_else(|| {
            self.labels.push(Labels { vertex: NONE, split: NONE });
            self.positions.push([0; 3]);
            self.incident.push(NONE);
            self.vertex_marks.push(0);
            self.levels.resize(self.levels.len() + self.fields, 0);
            self.labels.len() as u32 - 1
        })
    }

    pub(crate) fn free_vertex(&mut self, slot: u32) {
        self.labels[slot as usize] = Labels { vertex: NONE, split: NONE };
        self.incident[slot as usize] = NONE;
        self.free_vertices.push(slot);
    }

    /// Takes the vertex in a slot, which no tetrahedron has any more, out of the mesh.
    pub(crate) fn remove_vertex(&mut self, slot: u32) {
        let vertex = self.labels[slot as usize].vertex;
        self.slot_of.set(vertex, NONE);
        self.free_vertex(slot);
    }

    /// Puts a vertex of the MT into a slot; its levels and incident tetrahedron are the caller's to set.
    #[inline]
    pub(crate) fn put_vertex(&mut self, slot: u32, labels: Labels, position: [i32; 3]) {
        let old = std::mem::replace(&mut self.labels[slot as usize], labels).vertex;
        if old != NONE {
            self.slot_of.set(old, NONE);
        }
        self.slot_of.set(labels.vertex, slot);
        self.positions[slot as usize] = position;
        self.changed_vertices.mark(slot);
    }

    #[inline]
    pub(crate) fn touch(&mut self, tets: &[u32]) {
        self.touched.extend_from_slice(tets);
    }

    /// Touches the tetrahedra around the vertex in `slot`, however many, as far as they hang together through faces.
    pub(super) fn touch_star(&mut self, slot: u32) {
        let mut touched = std::mem::take(&mut self.touched);
        self.list_star(slot, &mut touched);
        self.touched = touched;
    }

    /// Lists the tetrahedra around the vertex in `slot`, however many, as far as they hang together through faces.
    pub(super) fn list_star(&mut self, slot: u32, star: &mut Vec<u32>) {
        self.next_epoch();
        let first = self.incident[slot as usize];
        self.marks[first as usize] = self.epoch << MARK_BITS;
        let mut next = star.len();
        star.push(first);
        while let Some(&t) = star.get(next) {
            next += 1;
            let (corner, around) = (corner_of(&self.tets[t as usize], slot), self.neighbors[t as usize]);
            for (i, n) in around.into_iter().enumerate() {
                if i != corner && n != NONE && self.marks[n as usize] >> MARK_BITS != self.epoch {
                    self.marks[n as usize] = self.epoch << MARK_BITS;
                    star.push(n);
                }
            }
        }
    }

    /// Tetrahedra that updates changed since [`CurrentMesh::clear_touched`]; some may be gone.
    pub(crate) fn touched(&self) -> &[u32] {
        &self.touched
    }

    pub(crate) fn clear_touched(&mut self) {
        self.touched.clear();
    }

    #[inline]
    pub(crate) fn mark_tet(&mut self, t: u32) {
        self.changed_tets.mark(t);
    }

    /// Ranges of vertex slots and of tetrahedron slots that changed since the last call, in ascending order.
    /// Entries may have moved only inside these ranges; anything beyond the arrays' ends is gone.
    pub fn take_changes(&mut self) -> MeshChanges {
        MeshChanges {
            vertices: self.changed_vertices.take(self.labels.len()),
            tets: self.changed_tets.take(self.tets.len()),
        }
    }

    /// A hash of the mesh that depends neither on slots nor on the order of updates: equal sets of tetrahedra with
    /// equal vertices, positions and levels have equal hashes, on every platform.
    pub fn hash(&self) -> u64 {
        let vertices: Vec<u64> = (0..self.labels.len()).map(|slot| self.hash_vertex(slot)).collect();
        let tet_hash = |tet: &[u32; 4]| {
            let h = tet.map(|v| vertices[v as usize]);
            mix(h.iter().fold(0, |s, &x| u64::wrapping_add(s, x)) ^ mix(h[0] ^ h[1] ^ h[2] ^ h[3]))
        };
        self.tets.iter().filter(|tet| tet[0] != NONE).fold(0, |sum, tet| sum.wrapping_add(tet_hash(tet)))
    }

    fn hash_vertex(&self, slot: usize) -> u64 {
        let words = std::iter::once(self.labels[slot].vertex)
            .chain(self.positions[slot].map(|x| x as u32))
            .chain(self.levels(slot as u32).iter().map(|&q| q as u32));
        words.fold(0, |h, word| mix(h ^ u64::from(word)))
    }

    /// Checks every identity of the structure: orientation, symmetric adjacency, faces shared by at most two,
    /// labels, incident tetrahedra. For tests; takes time in proportion to the mesh.
    ///
    /// # Errors
    /// The first identity that does not hold, in words. Nothing that updates do leads there.
    pub fn check(&self) -> Result<(), String> {
        for (t, tet) in self.tets.iter().enumerate().filter(|(_, tet)| tet[0] != NONE) {
            self.check_tet(t, *tet)?;
        }
        let live: Vec<[u32; 4]> = self.tets.iter().filter(|tet| tet[0] != NONE).copied().collect();
        if live.len() != self.tet_count() {
            return Err(format!("{} tetrahedra live, {} counted", live.len(), self.tet_count()));
        }
        let matched = face_neighbors(&live).map_err(|e| e.to_string())?;
        let shared = |n: &[[u32; 4]]| n.iter().flatten().filter(|&&n| n != NONE).count();
        if shared(&matched) != shared(&self.neighbors) {
            return Err("two tetrahedra share a face but are not neighbours".into());
        }
        for (slot, labels) in self.labels.iter().enumerate().filter(|(_, l)| l.vertex != NONE) {
            if self.slot_of.get(labels.vertex) != slot as u32 {
                return Err(format!("vertex {} is not in its slot {slot}", labels.vertex));
            }
            let t = self.incident[slot];
            if self.tet(t).is_none_or(|tet| !tet.contains(&(slot as u32))) {
                return Err(format!("tetrahedron {t} does not have the vertex in slot {slot}"));
            }
        }
        Ok(())
    }

    fn check_tet(&self, t: usize, tet: [u32; 4]) -> Result<(), String> {
        if tet.iter().any(|&v| self.labels[v as usize].vertex == NONE) {
            return Err(format!("tetrahedron {t} has a vertex that is not in the mesh"));
        }
        let [a, b, c, d] = tet.map(|v| self.positions[v as usize]);
        if crate::geom::orient3d(a, b, c, d) <= 0 {
            return Err(format!("tetrahedron {t} is not positive"));
        }
        for (i, face) in FACES.iter().enumerate() {
            let n = self.neighbors[t][i];
            if n == NONE {
                continue;
            }
            let other = self.tet(n).ok_or(format!("tetrahedron {t} has a free slot as neighbour"))?;
            let shared = face.iter().all(|&j| other.contains(&tet[j]));
            let back = self.neighbors[n as usize].iter().filter(|&&m| m as usize == t).count();
            if !shared || back != 1 {
                return Err(format!("tetrahedra {t} and {n} are not neighbours of each other"));
            }
        }
        Ok(())
    }
}

/// Where a value is in an array that holds it once, without a branch.
#[inline(always)]
pub(crate) fn corner_of(array: &[u32; 4], value: u32) -> usize {
    usize::from(array[1] == value)
        | usize::from(array[2] == value) << 1
        | (usize::from(array[3] == value) * 3)
}

/// A finaliser that spreads every input bit over the word (the constants are those of SplitMix64).
#[inline]
pub(crate) fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let x = (x ^ x >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ x >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ x >> 31
}

/// Finds the neighbour across every face. Each face may be shared by two tetrahedra that lie on its two sides.
fn face_neighbors(tets: &[[u32; 4]]) -> Result<Vec<[u32; 4]>, BaseMeshError> {
    let faces = sorted_faces(tets).map_err(|_| BaseMeshError::Info("it has too many tetrahedra"))?;
    match_faces(tets, &faces, |group, folded| {
        let first = group.iter().find(|face| face.is_odd(tets)).unwrap_or(&group[0]);
        if folded || group.len() > 2 { Err(BaseMeshError::Face(first.tet())) } else { Ok(()) }
    })
}

/// What [`CurrentMesh::take_changes`] tells.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MeshChanges {
    /// Changed ranges of vertex slots.
    pub vertices: Vec<Range<u32>>,
    /// Changed ranges of tetrahedron slots.
    pub tets: Vec<Range<u32>>,
}

#[cfg(test)]
mod tests {
    use super::super::FieldInfo;
    use super::super::MtKind;
    use super::*;
    use crate::geom::Lattice;

    /// `n` tetrahedra around an edge from vertex 0 to vertex 1.
    fn wheel(n: u32) -> CurrentMesh {
        let field = FieldInfo {
            name: "f".into(),
            min: 0.0,
            max: 1.0,
            origin: 0.0,
            step: 1.0,
            bits: 1,
            ..FieldInfo::default()
        };
        let info = MtInfo {
            kind: MtKind::Edge,
            lattice: Lattice { origin: [0.0; 3], step: [1.0; 3], bits: 16 },
            fields: vec![field],
            vertices: 0,
            tetrahedra: 0,
            updates: 0,
            displacement_per_error: 1.0,
            quantization: 0.0,
        };
        let middle = 1 << 15;
        let mut positions = vec![[middle, middle, 0], [middle, middle, 100]];
        positions.extend(
            (0..n)
                .map(|i| {
                    let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
                    [angle.cos(), angle.sin()].map(|x| middle + (x * 30_000.0) as i32)
                })
                .map(|[x, y]| [x, y, 0]),
        );
        let tets = (0..n).map(|i| [0, 2 + i, 2 + (i + 1) % n, 1]).collect();
        let base = BaseMesh { values: vec![0; positions.len()], positions, tets };
        CurrentMesh::new(&info, &base).expect("a valid mesh")
    }

    #[test]
    fn a_star_too_large_to_gather_still_tells_what_was_looked_for() {
        let n = 200;
        let mut mesh = wheel(n);
        let start = mesh.incident[0];
        let distance = |t: u32| ((t + n - start) % n).min((start + n - t) % n);
        for rim in 0..n {
            let wanted = |_: &[Labels], tet: &[u32; 4]| tet.contains(&(2 + rim)).then_some(());
            let found = mesh.gather_star(0, &mut Star::default(), wanted);
            // 128 tetrahedra and the one too many are those up to 64 steps from the first.
            if [rim, (rim + n - 1) % n].iter().any(|&t| distance(t) <= 64) {
                assert!(matches!(found, Err(Gather::Stopped(()))), "{rim}");
            } else {
                assert!(matches!(found, Err(Gather::TooLarge)), "{rim}");
            }
        }
        let mut star = Star::default();
        assert!(wheel(128).gather_star(0, &mut star, |_, _| None::<()>).is_ok());
        assert_eq!(star.len, 128);
    }

    #[test]
    fn marks_of_long_ago_are_forgotten_when_the_epochs_start_again() {
        let mut mesh = wheel(20);
        for _ in 0..3 {
            let mut star = Star::default();
            assert!(mesh.gather_star(0, &mut star, |_, _| None::<()>).is_ok());
            assert_eq!((star.len, mesh.epoch), (20, 1));
            mesh.epoch = EPOCHS - 1;
        }
        let mut mesh = wheel(20);
        for _ in 0..3 {
            let mut ring = mesh.take_ring();
            assert!(mesh.gather_ring(0, 0, &mut ring).is_ok());
            assert_eq!((ring.len, ring.link_len, mesh.epoch), (20, 21, 1));
            mesh.put_back_ring(ring);
            mesh.epoch = EPOCHS - 1;
        }
    }
}

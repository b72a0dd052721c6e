//! The current mesh Σ_S: packed arrays with adjacency, edited in place by updates.
//!
//! Vertices and tetrahedra live in *slots*. Refinement appends slots and reuses free ones; coarsening frees slots;
//! [`CurrentMesh::compact`] moves the last entries into the holes, after which the arrays are without holes. Slots
//! changed since [`CurrentMesh::take_changes`] was last called are known by blocks, so that copies elsewhere (a GPU)
//! can be kept up to date at the cost of the change.
//!
//! Guarantees: after every operation [`CurrentMesh::check`] holds. Positions and field levels are integers, so the
//! mesh depends on the set of applied updates alone, not on their order or on the platform.

use super::base::{BaseMesh, BaseMeshError};
use super::paged_array::PagedArray;
use super::side_slots::SideSlots;
use super::tet::face_neighbors;
use crate::mesh::{BitSet, ChangedBlocks, FACES, NONE};
use crate::mt::{MtInfo, VertexId};
use std::any::Any;
use std::fmt;
use std::ops::Range;

/// Tags from here on are not looked for, unless a kind of MT says [otherwise](CurrentMesh::look_for_all_tags).
pub(crate) const FIRST_ANONYMOUS_TAG: u32 = 1 << 31;

/// What a kind of MT keeps with a mesh that its updates are applied to: scratch space, and memory of what was done.
pub(in crate::mt) trait KindState: Any + Copied + Send + Sync {
    /// Bytes of it.
    fn bytes(&self) -> u64;

    /// Whether it says nothing about the mesh, only about updates: then it holds when the mesh starts again.
    fn is_of_updates(&self) -> bool {
        false
    }
}

/// A copy of a state, for a copy of the mesh.
pub(in crate::mt) trait Copied {
    fn copy(&self) -> Box<dyn KindState>;
}

impl<T: KindState + Clone> Copied for T {
    fn copy(&self) -> Box<dyn KindState> {
        Box::new(self.clone())
    }
}

/// Without its content: whatever a trait object can do is compiled into every program.
impl fmt::Debug for dyn KindState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("KindState")
    }
}

impl Clone for Box<dyn KindState> {
    fn clone(&self) -> Self {
        (**self).copy()
    }
}

/// The result of [`CurrentMesh::take_changes`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MeshChanges {
    /// Changed ranges of vertex slots.
    pub vertices: Vec<Range<u32>>,
    /// Changed ranges of tetrahedron slots.
    pub tets: Vec<Range<u32>>,
}

impl MeshChanges {
    /// Every vertex has changed, no tetrahedron has.
    #[doc(hidden)]
    pub fn of_all_vertices(count: usize) -> Self {
        Self { vertices: std::iter::once(0..count as u32).collect(), tets: Vec::new() }
    }
}

/// The labels of the vertex in a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Labels {
    /// Which vertex of the MT it is; [`NONE`] in a free slot.
    pub vertex: u32,
    pub kind_word: KindWord,
}

/// A word that the kind of the MT keeps with each vertex of its meshes; each kind says what it means.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct KindWord(pub u32);

impl KindWord {
    /// For kinds that keep nothing, and for free slots.
    pub const NONE: Self = Self(NONE);
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
    pub(in crate::mt) slot_of: PagedArray<u32>,
    pub(crate) fields: usize,
    /// The MT's tag of each tetrahedron; empty for kinds of MT that need none.
    pub(in crate::mt) tags: Vec<u32>,
    /// Tags from here on are not looked for.
    pub(super) first_anonymous_tag: u32,
    /// A byte that the kind keeps for each tetrahedron; none unless it asked for them.
    pub(super) tet_bytes: Vec<u8>,
    pub(super) has_tet_bytes: bool,
    /// The region of each tetrahedron, kept in free slots, too; empty if the MT has no regions.
    pub(in crate::mt) regions: Vec<u16>,
    /// Where fields jump at interfaces.
    pub(super) sides: Option<Box<SideSlots>>,
    /// Whether every vertex that is not of the base mesh has a star whose tetrahedra hang together through faces.
    pub(in crate::mt) whole_stars: bool,
    /// For each tag a tetrahedron that has it, [`NONE`] if none does: the last that got it.
    pub(in crate::mt) place_of: PagedArray<u32>,
    free_vertices: Vec<u32>,
    pub(in crate::mt) free_tets: Vec<u32>,
    /// `epoch << MARK_BITS | index in the star` of the last star that each tetrahedron was in.
    pub(in crate::mt) marks: Vec<u32>,
    /// `epoch << MARK_BITS | index in the link` of the last link that each vertex was in.
    pub(in crate::mt) vertex_marks: Vec<u32>,
    pub(in crate::mt) epoch: u32,
    /// What the kind of the MT keeps with its meshes.
    kind_state: Option<Box<dyn KindState>>,
    pub(super) changed_vertices: ChangedBlocks,
    pub(super) changed_tets: ChangedBlocks,
    /// The tetrahedra of the stars that updates changed since the list was last cleared, and where others were moved;
    /// free slots among them.
    pub(in crate::mt) touched: Vec<u32>,
    /// Updates that have been applied before and so need not be checked again: their stars are always the same.
    proven: BitSet,
    /// Base vertices whose star is not connected through faces: they cannot be split.
    pinched: Vec<u32>,
}

/// Makes room for so many elements in a list, if there is memory for them.
fn make_room<T>(list: &mut Vec<T>, len: usize) {
    // Else the list grows as it must.
    _ = list.try_reserve_exact(len.saturating_sub(list.len()));
}

impl CurrentMesh {
    /// Makes room for the reference mesh, if there is memory for it: lists that grow by doubling are copied again and again, and take up
    /// to twice as much.
    pub(crate) fn make_room(&mut self, info: &MtInfo) {
        // What a file says of its counts does not size the lists: no update inserts more than this.
        let updates = info.updates as usize;
        let vertices = self.labels.len().saturating_add(updates);
        let tets = self.tets.len().saturating_add(updates.saturating_mul(super::limits::MAX_STAR));
        let tets = tets.min(usize::try_from(info.tetrahedra).unwrap_or(usize::MAX));
        self.make_room_for(vertices, tets);
    }

    /// [`CurrentMesh::make_room`] for so many vertices and tetrahedra.
    pub(crate) fn make_room_for(&mut self, vertices: usize, tets: usize) {
        // What an update inserts is there before all that it removes is gone.
        let tets = tets.saturating_add(super::limits::MAX_STAR);
        make_room(&mut self.labels, vertices);
        make_room(&mut self.positions, vertices);
        make_room(&mut self.levels, vertices.saturating_mul(self.fields));
        make_room(&mut self.incident, vertices);
        make_room(&mut self.vertex_marks, vertices);
        make_room(&mut self.tets, tets);
        make_room(&mut self.neighbors, tets);
        make_room(&mut self.tags, tets);
        make_room(&mut self.tet_bytes, tets);
        if !self.regions.is_empty() {
            make_room(&mut self.regions, tets);
        }
        make_room(&mut self.marks, tets);
    }

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
        let mut slot_of = PagedArray::new(NONE);
        (0..vertices as u32).for_each(|v| slot_of.set(v, v));
        let mut mesh = Self {
            labels: (0..vertices as u32).map(|vertex| Labels { vertex, kind_word: KindWord::NONE }).collect(),
            positions: base.positions.clone(),
            levels: base.values.clone(),
            incident,
            tets: base.tets.clone(),
            neighbors,
            slot_of,
            fields: info.fields.len(),
            tags: Vec::new(),
            first_anonymous_tag: FIRST_ANONYMOUS_TAG,
            tet_bytes: Vec::new(),
            has_tet_bytes: false,
            regions: Vec::new(),
            sides: None,
            whole_stars: false,
            place_of: PagedArray::new(NONE),
            free_vertices: Vec::new(),
            free_tets: Vec::new(),
            marks: vec![0; base.tets.len()],
            vertex_marks: vec![0; vertices],
            epoch: 0,
            kind_state: None,
            changed_vertices: ChangedBlocks::all(vertices),
            changed_tets: ChangedBlocks::all(base.tets.len()),
            touched: Vec::new(),
            proven: BitSet::default(),
            pinched: Vec::new(),
        };
        mesh.find_pinched();
        Ok(mesh)
    }

    /// Gives the vertices, which are in slots from 0 on, these numbers in the MT.
    pub(in crate::mt) fn name_vertices(&mut self, vertices: &[u32]) {
        self.slot_of = PagedArray::new(NONE);
        for (slot, &vertex) in (0..).zip(vertices) {
            self.labels[slot as usize].vertex = vertex;
            self.slot_of.set(vertex, slot);
        }
    }

    /// Becomes `start`, the base mesh of the same MT. What is known of updates is kept: those that have been applied before
    /// are applied more quickly.
    pub(crate) fn start_again(&mut self, start: Self) {
        let before = std::mem::replace(self, start);
        self.proven = before.proven;
        if let Some(state) = before.kind_state.filter(|state| state.is_of_updates()) {
            self.kind_state = Some(state);
        }
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

    /// Forgets memory of vertices that are not in the mesh.
    pub(in crate::mt) fn forget_vertices(&mut self, vertices: Range<u32>) {
        self.slot_of.forget(vertices);
    }

    /// Number of tetrahedra.
    pub fn tet_count(&self) -> usize {
        self.tets.len() - self.free_tets.len()
    }

    /// Number of points: a vertex is as many as it has values for regions.
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
            + size_of_val(&self.tet_bytes[..])
            + size_of_val(&self.regions[..])
            + size_of_val(&self.marks[..])
            + size_of_val(&self.free_tets[..])
            + size_of_val(&self.touched[..]);
        let of_the_mt = self.slot_of.bytes()
            + self.sides.as_ref().map_or(0, |sides| sides.bytes())
            + self.place_of.bytes()
            + size_of_val(self.proven.words())
            + size_of_val(&self.pinched[..]);
        let changes = self.changed_vertices.bytes() + self.changed_tets.bytes();
        let of_the_kind = self.kind_state.as_ref().map_or(0, |state| state.bytes());
        (vertices + tets + of_the_mt + changes) as u64 + of_the_kind
    }

    /// Lends what the kind of the MT keeps with this mesh; none if it is not there, or of another kind.
    pub(in crate::mt) fn take_kind_state<T: KindState>(&mut self) -> Option<Box<T>> {
        let state: Box<dyn Any> = self.kind_state.take()?;
        state.downcast().ok()
    }

    /// Lends it to `work`; a new one if it is not there, or of another kind.
    #[inline]
    pub(in crate::mt) fn with_kind_state<T: KindState + Default, R>(
        &mut self,
        work: impl FnOnce(&mut Self, &mut T) -> R,
    ) -> R {
        let mut state = self.take_kind_state::<T>().unwrap_or_default();
        let done = work(self, &mut state);
        self.put_back_kind_state(state);
        done
    }

    pub(in crate::mt) fn put_back_kind_state<T: KindState>(&mut self, state: Box<T>) {
        self.kind_state = Some(state);
    }

    /// Number of tetrahedron slots, holes included; see [`CurrentMesh::tet`].
    pub fn tet_slots(&self) -> usize {
        self.tets.len()
    }

    /// The vertex slots of tetrahedron `t`; none if the slot is free. Where fields jump at interfaces, those with the values in its region.
    #[inline]
    pub fn tet(&self, t: u32) -> Option<[u32; 4]> {
        let tet = self.tets.get(t as usize).copied().filter(|tet| tet[0] != NONE)?;
        Some(self.with_sides(t, tet))
    }

    /// The tetrahedra as vertex slots; without holes, and up to date, after [`CurrentMesh::compact`]. Where fields jump at interfaces, a
    /// vertex there has a slot for each region.
    pub fn tets(&self) -> &[[u32; 4]] {
        self.sides.as_ref().map_or(&self.tets, |sides| &sides.corners)
    }

    /// [`CurrentMesh::tets`] with one slot for each vertex: those on both sides of an interface share its vertices.
    pub fn joined_tets(&self) -> &[[u32; 4]] {
        &self.tets
    }

    /// For each tetrahedron the one across each face, [`NONE`] on the boundary.
    pub fn neighbors(&self) -> &[[u32; 4]] {
        &self.neighbors
    }

    /// The region of each tetrahedron, by slot, as an index into [`Regions::all`](crate::mt::Regions::all); empty if the MT has none.
    pub fn regions(&self) -> &[u16] {
        &self.regions
    }

    /// The region of tetrahedron `t`; 0 if the MT has none.
    #[inline]
    pub(crate) fn region(&self, t: u32) -> u16 {
        self.regions.get(t as usize).copied().unwrap_or(0)
    }

    /// The regions of some tetrahedra, ascending, each once; none if the MT has none.
    pub(crate) fn regions_of(&self, tets: &[u32]) -> Vec<u16> {
        let mut regions: Vec<u16> =
            tets.iter().filter_map(|&t| self.regions.get(t as usize).copied()).collect();
        regions.sort_unstable();
        regions.dedup();
        regions
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

    /// The newest vertex of tetrahedron `t`, which has the largest number.
    #[inline]
    pub(in crate::mt) fn newest_vertex(&self, t: u32) -> VertexId {
        let [a, b, c, d] = self.tets[t as usize].map(|slot| self.labels[slot as usize].vertex);
        VertexId(a.max(b).max(c.max(d)))
    }

    /// Whether `vertex` is in the mesh, and the newest one of some tetrahedron around it.
    #[inline]
    pub(in crate::mt) fn is_newest_nearby(&self, vertex: VertexId) -> bool {
        self.slot(vertex).is_some_and(|slot| self.newest_vertex(self.incident[slot as usize]) == vertex)
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
        self.changed_tets.truncate(self.tets.len());
        self.changed_vertices.truncate(self.labels.len());
        self.update_corners();
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
        self.tet_bytes.pop();
        self.regions.pop();
        self.neighbors.pop();
        self.marks.pop();
    }

    /// Moves the last vertex into a hole. Returns from where to where; the caller must rename it in its tetrahedra.
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
        self.changed_vertices.mark(hole);
        let is_side = self.is_side(hole);
        if !is_side {
            self.slot_of.set(self.labels[hole as usize].vertex, hole);
        }
        self.move_sides(from, hole);
        self.pop_vertex();
        (!is_side).then_some([from, hole])
    }

    fn pop_vertex(&mut self) {
        self.labels.pop();
        self.positions.pop();
        self.incident.pop();
        self.vertex_marks.pop();
        self.levels.truncate(self.labels.len() * self.fields);
        self.sides.iter_mut().for_each(|sides| sides.pop());
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

    /// Free or new tetrahedron slots, to be filled by the caller.
    #[inline]
    pub(in crate::mt) fn new_tets(&mut self, slots: &mut [u32]) {
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
        if self.has_tet_bytes {
            self.tet_bytes.resize(grown, 0);
        }
        if !self.regions.is_empty() {
            self.regions.resize(grown, 0);
        }
        slots.iter().for_each(|&t| self.changed_tets.mark(t));
    }

    /// A free or new tetrahedron slot, to be filled by the caller.
    #[inline]
    pub(crate) fn new_tet(&mut self) -> u32 {
        let mut slots = [NONE];
        self.new_tets(&mut slots);
        slots[0]
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
            self.labels.push(Labels { vertex: NONE, kind_word: KindWord::NONE });
            self.positions.push([0; 3]);
            self.incident.push(NONE);
            self.vertex_marks.push(0);
            self.levels.resize(self.levels.len() + self.fields, 0);
            self.sides.iter_mut().for_each(|sides| sides.push());
            self.labels.len() as u32 - 1
        })
    }

    pub(crate) fn free_vertex(&mut self, slot: u32) {
        self.labels[slot as usize] = Labels { vertex: NONE, kind_word: KindWord::NONE };
        self.incident[slot as usize] = NONE;
        self.free_vertices.push(slot);
    }

    /// Takes the vertex in a slot, which no tetrahedron has any more, out of the mesh.
    pub(crate) fn remove_vertex(&mut self, slot: u32) {
        let vertex = self.labels[slot as usize].vertex;
        self.remove_sides(slot);
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
        self.update_corners();
        MeshChanges {
            vertices: self.changed_vertices.take(self.labels.len()),
            tets: self.changed_tets.take(self.tets.len()),
        }
    }

    /// A hash of the mesh that depends neither on slots nor on the order of updates: equal sets of tetrahedra with
    /// equal vertices, positions, levels and regions have equal hashes, on every platform.
    pub fn hash(&self) -> u64 {
        let vertices: Vec<u64> = (0..self.labels.len()).map(|slot| self.hash_vertex(slot)).collect();
        let tet_hash = |tet: &[u32; 4]| {
            let h = tet.map(|v| vertices[v as usize]);
            mix(h.iter().fold(0, |s, &x| u64::wrapping_add(s, x)) ^ mix(h[0] ^ h[1] ^ h[2] ^ h[3]))
        };
        let live = (0..).zip(&self.tets).filter(|(_, tet)| tet[0] != NONE);
        live.fold(0, |sum, (t, tet)| {
            sum.wrapping_add(tet_hash(&self.with_sides(t, *tet)) ^ mix_region(self.region(t)))
        })
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
            if self.is_side(slot as u32) {
                self.check_side(slot as u32)?;
                continue;
            }
            if self.slot_of.get(labels.vertex) != slot as u32 {
                return Err(format!("vertex {} is not in its slot {slot}", labels.vertex));
            }
            let t = self.incident[slot];
            if self.tets.get(t as usize).is_none_or(|tet| !tet.contains(&(slot as u32))) {
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
            let other = self.tets.get(n as usize).filter(|other| other[0] != NONE);
            let other = other.ok_or_else(|| format!("tetrahedron {t} has a free slot as neighbour"))?;
            let shared = face.iter().all(|&j| other.contains(&tet[j]));
            let back = self.neighbors[n as usize].iter().filter(|&&m| m as usize == t).count();
            if !shared || back != 1 {
                return Err(format!("tetrahedra {t} and {n} are not neighbours of each other"));
            }
        }
        Ok(())
    }
}

/// What the region of a tetrahedron does to its hash: nothing without regions.
fn mix_region(region: u16) -> u64 {
    if region == 0 { 0 } else { mix(u64::from(region)) }
}

/// A finaliser that spreads every input bit over the word (the constants are those of SplitMix64).
#[inline]
#[doc(hidden)]
pub fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let x = (x ^ x >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ x >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ x >> 31
}

//! The compact edge-based Multi-Tessellation [§2.1, §4].
//!
//! An update is a vertex split; its inverse collapses an edge to its midpoint. Updates are kept in coarse-to-fine
//! order, which is the paper's vertex numbering turned round: the label of a vertex `v` is the update `s(v)` that
//! splits it (none for vertices of the reference mesh). Base vertices are numbered first; update `k` creates the
//! vertices `b + 2k` (the paper's `v'`) and `b + 2k + 1` (`v''`), so the forest of vertex trees needs one word per
//! vertex for the way down and one per update for the way up: 12 bytes per reference vertex, as in the paper.
//!
//! With `c(v)` the update that created `v` (none for base vertices), all of the partial order is in the labels:
//! a tetrahedron is created in refinement by the largest `c` of its vertices and removed by the smallest `s`. The
//! split of `v` is feasible iff every neighbour `w` has `s(w) > s(v)`; the collapse of update `k` is feasible iff
//! `v'` and `v''` are in the mesh and every other neighbour `w` of either has `c(w) < k`. Then the star of `v` is
//! the one of the moment it was created, in every consistent set: a mask over it in the order of its labels means
//! the same everywhere.

use crate::mesh::NONE;
use crate::mt::update_errors::Errors;
use crate::mt::{BaseMesh, ErrorCode, MtInfo, MtKind, PAGE_BITS, PageError, UpdateError, UpdateId, VertexId};
use std::ops::Range;

/// Largest number of tetrahedra around a vertex that an update splits.
pub const MAX_STAR: usize = 64;

/// Largest number of vertices around a vertex that an update splits.
pub const MAX_LINK: usize = 32;

/// Largest number of an edge of a link that an offset can be counted from: seven bits of an update's record name it. Links that
/// close up have at most 96 edges.
pub const MAX_EDGE: u8 = 127;

/// One update of an edge-based MT: how a vertex becomes two.
///
/// With `v` the position of the vertex, `D` the offset and `>>` a floor shift, the new vertices lie at
/// `v'' = v − (D >> 1)` and `v' = v'' + D`; the inverse is `v = v'' + (D >> 1)`. Field levels go the same way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VertexSplit<'a> {
    /// The vertex that is split.
    pub vertex: VertexId,
    /// `v' − v''` in lattice steps.
    pub offset: [i32; 3],
    /// In the form that files have, which edge of the link `offset` is counted from, 1 to [`MAX_EDGE`]; 0 for none. See
    /// [`EdgeMt::coded`].
    pub edge: u8,
    /// `v' − v''` in levels, field by field.
    pub field_offsets: &'a [i32],
    /// Bit `i` is 0 where tetrahedron `i` of the star goes to `v'`, 1 where it goes to `v''`. The star is in
    /// ascending order of the sorted vertex numbers of the faces opposite the vertex.
    pub mask: u64,
    /// Field by field, what bounds the error of every tetrahedron that the split removes, and of all updates that depend on
    /// this one.
    pub errors: &'a [ErrorCode],
}

/// A compact edge-based MT. With one field an update, and so a reference vertex, takes at most 36 bytes and 2 for the
/// error; the base mesh, which is small, comes on top.
///
/// It grows by [`push`](EdgeMt::push), coarse to fine; every prefix of an MT is an MT. Or else it comes and goes in pages of
/// updates, by [`insert_page`](EdgeMt::insert_page) and [`remove_page`](EdgeMt::remove_page): every set of pages that holds
/// with each page all those on which it depends is an MT, too.
#[derive(Clone, Debug, PartialEq)]
pub struct EdgeMt {
    info: MtInfo,
    base: BaseMesh,
    /// Whether masks and field offsets are told as what is wrong with guesses: see [`EdgeMt::coded`].
    is_coded: bool,
    /// `s(v)` for the vertices of the base mesh, [`WHOLE`] while nothing splits them.
    base_splits: Vec<i32>,
    /// The last one is here.
    pages: Vec<Option<Page>>,
    /// log2 of the updates of a page.
    page_bits: u32,
    record: Record,
    /// The end of the last page that is here.
    updates: u32,
    /// How many updates are here.
    present: u32,
    to_come: ErrorCode,
}

/// Updates that come and go together, each with all that belongs to it side by side.
#[derive(Clone, Debug, PartialEq)]
struct Page {
    words: Vec<i32>,
    errors: Errors,
}

/// What the words of an update are: the vertex that it splits, `s(v')`, `s(v'')`, two for the mask, the offset, and one for
/// the offset in each field.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Record {
    /// Words of the offset and the edge that it is counted from: 2 where they share them, 3 on fine lattices if there is no
    /// such edge, else 4.
    offset: usize,
    /// Bits of a component of the offset where components share words.
    component: u32,
    /// Words of an update.
    len: usize,
}

/// `s(v)` of a vertex that nothing splits.
const WHOLE: i32 = NONE as i32;

const VERTEX: usize = 0;
const SPLITS: usize = 1;
const MASK: usize = 3;
const OFFSET: usize = 5;

/// Pages have at most 2 to this power of updates.
const MAX_PAGE_BITS: u32 = 16;

impl Record {
    fn new(info: &MtInfo, is_coded: bool) -> Self {
        // Coded, seven bits are left for the edge.
        let component = if is_coded { 19 } else { 21 };
        let wide = if is_coded { 4 } else { 3 };
        // An offset has at most 2^bits, included, and a sign.
        let offset = if info.lattice.bits + 2 <= component { 2 } else { wide };
        Self { offset, component, len: OFFSET + offset + info.fields.len() }
    }

    /// Bytes of an update, its errors included.
    fn bytes(self, info: &MtInfo) -> u64 {
        let fields = info.fields.len();
        let errors = if fields == 1 { 1 } else { fields + 1 };
        (self.len * size_of::<i32>() + errors * size_of::<ErrorCode>()) as u64
    }

    fn push(self, words: &mut Vec<i32>, split: &VertexSplit<'_>) {
        let halves = |word: u64| [word as i32, (word >> 32) as i32];
        let (vertex, [low, high]) = (split.vertex.0 as i32, halves(split.mask));
        words.extend_from_slice(&[vertex, WHOLE, WHOLE, low, high]);
        let [x, y, z] = split.offset;
        match self.offset {
            2 => words.extend_from_slice(&halves(pack(split.offset, split.edge, self.component))),
            3 => words.extend_from_slice(&[x, y, z]),
            _ => words.extend_from_slice(&[x, y, z, i32::from(split.edge)]),
        }
        words.extend_from_slice(split.field_offsets);
    }

    /// The offset and the edge that it is counted from.
    #[inline]
    fn offset(self, words: &[i32]) -> ([i32; 3], u8) {
        let three = || [0, 1, 2].map(|axis| words[OFFSET + axis]);
        match self.offset {
            2 => unpack(two(words, OFFSET), self.component),
            3 => (three(), 0),
            _ => (three(), words[OFFSET + 3] as u8),
        }
    }
}

#[inline]
fn two(words: &[i32], at: usize) -> u64 {
    u64::from(words[at] as u32) | u64::from(words[at + 1] as u32) << 32
}

impl Page {
    /// Adds the next update, which has been checked.
    fn push(&mut self, record: Record, split: &VertexSplit<'_>) {
        let complete = self.errors.push(split.errors);
        assert!(complete, "each field has an error: that is checked");
        record.push(&mut self.words, split);
    }
}

impl EdgeMt {
    /// An MT without updates. `base` must fit `info`: see [`BaseMesh::check`](crate::mt::BaseMesh::check).
    pub fn new(info: MtInfo, base: BaseMesh) -> Self {
        Self::with_page_bits(info, base, PAGE_BITS)
    }

    /// [`EdgeMt::new`] with pages of `2^bits` updates, of `2^16` at most.
    pub fn with_page_bits(info: MtInfo, base: BaseMesh, bits: u32) -> Self {
        Self::empty(info, base, bits, false)
    }

    fn empty(mut info: MtInfo, base: BaseMesh, bits: u32, is_coded: bool) -> Self {
        info.kind = MtKind::Edge;
        Self {
            base_splits: vec![WHOLE; base.positions.len()],
            base,
            is_coded,
            pages: Vec::new(),
            page_bits: bits.min(MAX_PAGE_BITS),
            record: Record::new(&info, is_coded),
            updates: 0,
            present: 0,
            to_come: ErrorCode::MAX,
            info,
        }
    }

    /// [`EdgeMt::with_page_bits`] in the form that files have: what splits do is told by the star that they meet when they are
    /// applied. Offsets are what is to be added to the step along an edge of the link, if `edge` names one; those are
    /// counted from the one whose ends have the largest numbers, and taken in the direction in which the first coordinate that
    /// changes grows. Masks and field offsets are what is wrong with the guesses that the star allows: bit `i` of a mask says that
    /// the guess for the `i`-th tetrahedron is wrong, counted from the one whose side is the least certain.
    pub fn coded(info: MtInfo, base: BaseMesh, page_bits: u32) -> Self {
        Self::empty(info, base, page_bits, true)
    }

    /// Whether this is the form that files have.
    pub fn is_coded(&self) -> bool {
        self.is_coded
    }

    /// Adds the next update, behind all that are here.
    ///
    /// # Errors
    /// The split vertex must exist and be whole, offsets must fit the lattices, and each field has an error. What needs the
    /// mesh is checked when the update is applied; that errors do not grow along the partial order is the caller's to see
    /// to.
    pub fn push(&mut self, split: &VertexSplit<'_>) -> Result<UpdateId, UpdateError> {
        let update = self.updates;
        self.check(update, split)?;
        let vertex = split.vertex.0;
        match self.split_word(split.vertex) {
            Some(word) if *word == WHOLE => *word = update as i32,
            _ => return Err(UpdateError::Vertex { update, vertex }),
        }
        if update as usize >> self.page_bits == self.pages.len() {
            let page = self.new_page(update);
            self.pages.push(Some(page));
        }
        // The last page is here.
        if let Some(Some(page)) = self.pages.last_mut() {
            page.push(self.record, split);
        }
        self.updates += 1;
        self.present += 1;
        Ok(UpdateId(update))
    }

    /// What can be told of an update by itself.
    fn check(&self, update: u32, split: &VertexSplit<'_>) -> Result<(), UpdateError> {
        let fits = |offset: i32, bits: u32| offset.unsigned_abs() <= 1 << bits;
        // A guess may be as wrong as two offsets differ.
        let spare = u32::from(self.is_coded);
        let on_lattice = split.offset.iter().all(|&d| fits(d, self.info.lattice.bits))
            && split.field_offsets.len() == self.info.fields.len()
            && split
                .field_offsets
                .iter()
                .zip(&self.info.fields)
                .all(|(&d, field)| fits(d, field.bits + spare));
        if !on_lattice {
            return Err(UpdateError::OffLattice { update });
        }
        let most_edge = if self.is_coded { MAX_EDGE } else { 0 };
        if split.edge > most_edge {
            return Err(UpdateError::Edge { update });
        }
        if split.errors.len() == self.info.fields.len() { Ok(()) } else { Err(UpdateError::Error { update }) }
    }

    /// A page that begins with update `first`.
    fn new_page(&self, first: u32) -> Page {
        let most = self.info.updates.saturating_sub(first).min(1 << self.page_bits) as usize;
        Page {
            words: Vec::with_capacity(most * self.record.len),
            errors: Errors::with_capacity(self.info.fields.len(), most),
        }
    }

    /// Adds all updates of a page, of any that is not here. The pages on which it depends must be here; those that follow
    /// from the vertices that it splits are looked for, others are the caller's to know.
    ///
    /// # Errors
    /// If the page is not a whole one of this MT, is here already, depends on a page that is not, or has an update that
    /// [`EdgeMt::push`] would refuse. The MT is as it was then.
    pub fn insert_page(&mut self, page: u32, splits: &[VertexSplit<'_>]) -> Result<(), PageError> {
        let updates = self.page_updates(page);
        if updates.is_empty() {
            return Err(PageError::Beyond { page });
        }
        if self.pages.get(page as usize).is_some_and(Option::is_some) {
            return Err(PageError::Present { page });
        }
        if splits.len() != updates.len() {
            return Err(PageError::Length { page, expected: updates.len() as u32 });
        }
        let mut new = self.new_page(updates.start);
        for (update, split) in updates.clone().zip(splits) {
            self.check(update, split)?;
            self.check_vertex(page, update, split.vertex)?;
            new.push(self.record, split);
        }
        if page as usize >= self.pages.len() {
            self.pages.resize_with(page as usize + 1, || None);
        }
        self.pages[page as usize] = Some(new);
        self.present += updates.len() as u32;
        self.updates = self.updates.max(updates.end);
        for (k, (update, split)) in updates.zip(splits).enumerate() {
            match self.split_word(split.vertex) {
                Some(word) if *word == WHOLE => *word = update as i32,
                _ => {
                    self.drop_page(page, &splits[..k]);
                    return Err(UpdateError::Vertex { update, vertex: split.vertex.0 }.into());
                }
            }
        }
        Ok(())
    }

    /// Whether the vertex that an update of a new page splits is, or is going to be, there before it.
    fn check_vertex(&self, page: u32, update: u32, vertex: VertexId) -> Result<(), PageError> {
        let Some(creator) = self.created_by(vertex) else { return Ok(()) };
        let other = creator.0 >> self.page_bits;
        if creator.0 >= update {
            return Err(UpdateError::Vertex { update, vertex: vertex.0 }.into());
        }
        if other == page || self.has(creator) { Ok(()) } else { Err(PageError::Needs { page, other }) }
    }

    /// Takes the updates of a page away, none of which may be applied to a mesh that is still in use; that mesh must have
    /// been told before, by [`Front::prepare_eviction`](crate::refine::Front::prepare_eviction). What depends on the page must have gone before.
    ///
    /// # Errors
    /// If the page is not here, or another one that is splits a vertex of it. The MT is as it was then.
    pub fn remove_page(&mut self, page: u32) -> Result<(), PageError> {
        let Some(Some(leaving)) = self.pages.get(page as usize) else {
            return Err(PageError::Absent { page });
        };
        let splits = leaving.words.chunks(self.record.len).flat_map(|words| &words[SPLITS..MASK]);
        let mut others = splits.filter(|split| **split != WHOLE).map(|split| *split as u32 >> self.page_bits);
        if let Some(other) = others.find(|other| *other != page) {
            return Err(PageError::Needed { page, other });
        }
        let vertices = leaving.words.chunks(self.record.len).map(|words| VertexId(words[VERTEX] as u32));
        let vertices: Vec<VertexId> = vertices.collect();
        vertices.into_iter().for_each(|v| self.unsplit(v));
        self.forget_page(page);
        Ok(())
    }

    /// Takes a page away of which so many splits have been noted.
    fn drop_page(&mut self, page: u32, noted: &[VertexSplit<'_>]) {
        noted.iter().for_each(|split| self.unsplit(split.vertex));
        self.forget_page(page);
    }

    fn unsplit(&mut self, vertex: VertexId) {
        if let Some(word) = self.split_word(vertex) {
            *word = WHOLE;
        }
    }

    fn forget_page(&mut self, page: u32) {
        if let Some(gone) = self.pages[page as usize].take() {
            self.present -= (gone.words.len() / self.record.len) as u32;
        }
        while self.pages.last().is_some_and(Option::is_none) {
            self.pages.pop();
        }
        self.updates = match self.pages.last() {
            Some(Some(last)) => {
                let before = (self.pages.len() - 1) << self.page_bits;
                (before + last.words.len() / self.record.len) as u32
            }
            _ => 0,
        };
    }

    /// Whether update `u` is here.
    #[inline]
    pub fn has(&self, u: UpdateId) -> bool {
        !self.words(u).is_empty()
    }

    /// How many updates are here.
    pub fn present(&self) -> u32 {
        self.present
    }

    /// Whether the page is here.
    pub fn has_page(&self, page: u32) -> bool {
        self.pages.get(page as usize).is_some_and(Option::is_some)
    }

    /// The page that update `u` belongs to.
    pub(crate) fn page_of_update(&self, u: u32) -> u32 {
        u >> self.page_bits
    }

    /// The updates of page `page`; none if there is no such page.
    pub fn page_updates(&self, page: u32) -> Range<u32> {
        let first = u64::from(page) << self.page_bits;
        let end = u64::from(self.info.updates);
        first.min(end) as u32..(first + (1 << self.page_bits)).min(end) as u32
    }

    /// Tells that no update which is not here has a larger error than this; until then, any may have. Means nothing once
    /// all are here.
    pub fn set_to_come(&mut self, bound: ErrorCode) {
        self.to_come = if self.present == self.info.updates { ErrorCode::MAX } else { bound };
    }

    /// No update that is not here has a larger error.
    pub fn to_come(&self) -> ErrorCode {
        if self.present >= self.info.updates { ErrorCode::ZERO } else { self.to_come }
    }

    /// Bytes of the updates that are here.
    pub fn page_bytes(&self) -> u64 {
        u64::from(self.present) * self.record.bytes(&self.info)
    }

    /// Bytes that an update of an MT takes in the form that files have.
    pub fn update_bytes(info: &MtInfo) -> u64 {
        Record::new(info, true).bytes(info)
    }

    /// What is known of the MT as a whole.
    pub fn info(&self) -> &MtInfo {
        &self.info
    }

    /// The base mesh.
    pub fn base(&self) -> &BaseMesh {
        &self.base
    }

    /// Number of updates so far, those between them that are not here included.
    pub fn updates(&self) -> u32 {
        self.updates
    }

    /// Bytes of everything that the MT holds, base mesh and errors included.
    pub fn bytes(&self) -> u64 {
        let base = size_of_val(&self.base.positions[..])
            + size_of_val(&self.base.values[..])
            + size_of_val(&self.base.tets[..]);
        let order = size_of_val(&self.base_splits[..]) + size_of_val(&self.pages[..]);
        let pages = self.pages.iter().flatten();
        let nodes: usize = pages.map(|page| size_of_val(&page.words[..]) + page.errors.bytes()).sum();
        (base + order + nodes) as u64
    }

    #[inline]
    fn page_of(&self, u: u32) -> Option<&Page> {
        self.pages.get((u >> self.page_bits) as usize)?.as_ref()
    }

    /// The place of an update in its page.
    #[inline]
    fn place(&self, u: u32) -> usize {
        (u & ((1 << self.page_bits) - 1)) as usize
    }

    /// The words of an update; none if it is not here.
    #[inline]
    fn words(&self, u: UpdateId) -> &[i32] {
        let start = self.place(u.0) * self.record.len;
        let words = self.page_of(u.0).and_then(|page| page.words.get(start..start + self.record.len));
        words.unwrap_or_default()
    }

    /// Where it is noted what splits a vertex; none if what creates it is not here.
    fn split_word(&mut self, v: VertexId) -> Option<&mut i32> {
        let Some(i) = v.0.checked_sub(self.base_splits.len() as u32) else {
            return self.base_splits.get_mut(v.0 as usize);
        };
        let at = self.place(i / 2) * self.record.len + SPLITS + i as usize % 2;
        self.pages.get_mut(((i / 2) >> self.page_bits) as usize)?.as_mut()?.words.get_mut(at)
    }

    /// The error of update `u`, the largest one of all fields; [`ErrorCode::ZERO`] if it is not here.
    #[inline]
    pub fn error_of(&self, u: UpdateId) -> ErrorCode {
        self.page_of(u.0).map_or(ErrorCode::ZERO, |page| page.errors.largest(self.place(u.0)))
    }

    /// The error of update `u` in each field; nothing if it is not here.
    #[inline]
    pub fn errors_of(&self, u: UpdateId) -> &[ErrorCode] {
        self.page_of(u.0).map_or(&[], |page| page.errors.of(self.place(u.0)))
    }

    /// What update `u` does.
    ///
    /// # Panics
    /// If the MT has no update `u`, or not here.
    #[inline]
    pub fn split(&self, u: UpdateId) -> VertexSplit<'_> {
        let words = self.words(u);
        let (offset, edge) = self.record.offset(words);
        VertexSplit {
            vertex: VertexId(words[VERTEX] as u32),
            offset,
            edge,
            field_offsets: &words[OFFSET + self.record.offset..],
            mask: two(words, MASK),
            errors: self.errors_of(u),
        }
    }

    /// `s(v')` and `s(v'')` of the vertices that update `u`, which is here, creates.
    #[inline]
    pub(in crate::mt) fn splits_of_created(&self, u: UpdateId) -> [u32; 2] {
        let words = self.words(u);
        [words[SPLITS] as u32, words[SPLITS + 1] as u32]
    }

    /// The vertices `v'` and `v''` that update `u` creates.
    #[inline]
    pub fn created(&self, u: UpdateId) -> [VertexId; 2] {
        let first = self.base.positions.len() as u32 + 2 * u.0;
        [VertexId(first), VertexId(first + 1)]
    }

    /// `c(v)`: the update that creates `v`; none for a vertex of the base mesh.
    #[inline]
    pub fn created_by(&self, v: VertexId) -> Option<UpdateId> {
        v.0.checked_sub(self.base.positions.len() as u32).map(|i| UpdateId(i / 2))
    }

    /// `s(v)`: the update that splits `v`; none for a vertex of the reference mesh (as far as it is known).
    #[inline]
    pub fn split_by(&self, v: VertexId) -> Option<UpdateId> {
        let split = match v.0.checked_sub(self.base_splits.len() as u32) {
            None => self.base_splits.get(v.0 as usize),
            Some(i) => self.words(UpdateId(i / 2)).get(SPLITS + i as usize % 2),
        };
        split.filter(|&&s| s != WHOLE).map(|&s| UpdateId(s as u32))
    }
}

/// Three components of so many bits in one word, and the number of an edge above them.
fn pack(offset: [i32; 3], edge: u8, bits: u32) -> u64 {
    let mask = (1_u64 << bits) - 1;
    let [x, y, z] = offset.map(|d| d as u64 & mask);
    x | y << bits | z << (2 * bits) | u64::from(edge) << (3 * bits)
}

#[inline]
fn unpack(word: u64, bits: u32) -> ([i32; 3], u8) {
    // Shifted up to the top of the word and down again, each component brings its sign along.
    let offset = [2, 1, 0].map(|above| {
        let top = word << (64 - 3 * bits + above * bits);
        (top as i64 >> (64 - bits)) as i32
    });
    (offset, (word >> (3 * bits)) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_come_back_from_a_word() {
        for (bits, most_edges) in [(21, 0), (19, 127)] {
            for largest in [2, 1 << 8, 1_i32 << (bits - 2)] {
                let values = [-largest, 1 - largest, -1, 0, 1, largest - 1, largest];
                for (i, edge) in (0..343).zip((0..=most_edges).cycle()) {
                    let offset = [values[i % 7], values[i / 7 % 7], values[i / 49]];
                    assert_eq!(unpack(pack(offset, edge, bits), bits), (offset, edge));
                }
            }
        }
    }
}

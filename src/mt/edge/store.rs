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
//! the one of the moment it was created, in every consistent set.
//!
//! Offsets, sides and levels are stored as residuals against a prediction from that star, as in files: see
//! `mt/edge/predict.rs`. [`EdgeMtBuilder`](crate::mt::EdgeMtBuilder) makes them from plain vertex splits.

use crate::mesh::NONE;
use crate::mt::update_errors::Errors;
use crate::mt::{
    BaseMesh, ErrorCode, MtInfo, MtKind, MultiTessellation, UpdateError, UpdateId, UpdatePages, VertexId,
};
use std::borrow::Cow;

/// Largest number of an edge of a link that an offset can be counted from: seven bits of an update's record name it. Links that
/// close up have at most 96 edges.
pub const MAX_EDGE: u8 = 127;

/// A vertex split: how a vertex becomes two.
///
/// With `v` the position of the vertex, `D` the offset and `>>` a floor shift, the new vertices lie at
/// `v'' = v − (D >> 1)` and `v' = v'' + D`; the inverse is `v = v'' + (D >> 1)`. Field levels go the same way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VertexSplit<'a> {
    /// The vertex that is split.
    pub vertex: VertexId,
    /// `v' − v''` in lattice steps.
    pub offset: [i32; 3],
    /// `v' − v''` in levels, field by field.
    pub field_offsets: &'a [i32],
    /// Bit `i` is 0 where tetrahedron `i` of the star goes to `v'`, 1 where it goes to `v''`. The star is in
    /// ascending order of the sorted vertex numbers of the faces opposite the vertex.
    pub mask: u64,
    /// Field by field, what bounds the error of every tetrahedron that the split removes, and of all updates that depend on
    /// this one.
    pub errors: &'a [ErrorCode],
}

/// One update of an edge-based MT, as it is stored: a [`VertexSplit`] whose parts are residuals against the prediction from the
/// star.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EdgeUpdate<'a> {
    /// The vertex that is split.
    pub vertex: VertexId,
    /// What is added to the step along an edge of the link to get the offset, in lattice steps.
    pub offset_residual: [i32; 3],
    /// That edge, 1 to [`MAX_EDGE`]; 0 for none: `offset_residual` is the offset. Edges are counted from the one whose ends
    /// have the largest numbers, and taken in the direction in which the first coordinate that changes grows.
    pub edge: u8,
    /// What is added to the predicted offsets in levels, field by field.
    pub level_residuals: Cow<'a, [i32]>,
    /// Bit `i` is 1 where the predicted side of a tetrahedron is wrong: the `i`-th one, counted from the one whose side is the
    /// least certain.
    pub wrong_sides: u64,
    /// As [`VertexSplit::errors`].
    pub errors: &'a [ErrorCode],
}

/// A compact edge-based MT. With one field of 16 bits an update, and so a reference vertex, takes 32 bytes, on lattices of more
/// than 21 bits 36, and 2 for the error; the base mesh, which is small, comes on top.
///
/// It grows by [`push`](EdgeMt::push), coarse to fine; every prefix of an MT is an MT.
#[derive(Clone, Debug, PartialEq)]
pub struct EdgeMt {
    pub(in crate::mt) info: MtInfo,
    base: BaseMesh,
    /// `s(v)` for the vertices of the base mesh, [`WHOLE`] while nothing splits them.
    base_splits: Vec<i32>,
    /// The updates, each as a [`Record`] says, one after the other.
    words: Vec<i32>,
    errors: Errors,
    updates: u32,
    record: Record,
    /// By field; empty as long as nothing is known, and when all updates are here.
    pub(super) to_come: Vec<ErrorCode>,
    /// See [`UpdatePages::page_bits`].
    pub(super) page_bits: u32,
}

/// What the words of an update are: the vertex that it splits, `s(v')`, `s(v'')`, two for the mask, and as many as hold, bit by bit,
/// the components of the offset, the edge that it is counted from, and the offset in each field.
#[derive(Clone, Debug, PartialEq)]
struct Record {
    /// Bits of a component of an offset.
    component: u32,
    /// Bits of the offset in each field.
    levels: Vec<u32>,
    /// Words of an update.
    len: usize,
}

/// `s(v)` of a vertex that nothing splits.
const WHOLE: i32 = NONE as i32;

const VERTEX: usize = 0;
const SPLITS: usize = 1;
const MASK: usize = 3;
const PACKED: usize = 5;
/// Bits of the edge that an offset is counted from.
const EDGE_BITS: u32 = u8::BITS - MAX_EDGE.leading_zeros();

impl Record {
    fn new(info: &MtInfo) -> Self {
        // An offset has at most 2^bits, included, and a sign; that in a field at most twice as much.
        let component = info.lattice.bits + 2;
        let levels: Vec<u32> = info.fields.iter().map(|field| field.bits + 3).collect();
        let packed = 3 * component + EDGE_BITS + levels.iter().sum::<u32>();
        Self { component, levels, len: PACKED + packed.div_ceil(u32::BITS) as usize }
    }

    /// Bytes of an update, its errors included.
    #[cfg(test)]
    fn bytes(&self) -> u64 {
        let errors = if self.levels.len() == 1 { 1 } else { self.levels.len() + 1 };
        (self.len * size_of::<i32>() + errors * size_of::<ErrorCode>()) as u64
    }

    fn push(&self, words: &mut Vec<i32>, update: &EdgeUpdate<'_>) {
        let halves = |word: u64| [word as i32, (word >> 32) as i32];
        let (vertex, [low, high]) = (update.vertex.0 as i32, halves(update.wrong_sides));
        let first = words.len();
        words.extend_from_slice(&[vertex, WHOLE, WHOLE, low, high]);
        words.resize(first + self.len, 0);
        let packed = &mut words[first + PACKED..];
        let mut at = 0;
        let mut put = |number: i32, bits: u32| {
            let number = (number as u32 as u64 & ((1 << bits) - 1)) << (at % u32::BITS);
            let word = (at / u32::BITS) as usize;
            packed[word] |= number as i32;
            if let Some(next) = packed.get_mut(word + 1) {
                *next |= (number >> 32) as i32;
            }
            at += bits;
        };
        update.offset_residual.iter().for_each(|&d| put(d, self.component));
        put(i32::from(update.edge), EDGE_BITS);
        update.level_residuals.iter().zip(&self.levels).for_each(|(&d, &bits)| put(d, bits));
    }

    /// The residual of the offset and the edge that it is counted from.
    #[inline]
    fn offset(&self, words: &[i32]) -> ([i32; 3], u8) {
        let offset = [0, 1, 2].map(|axis| signed(words, axis * self.component, self.component));
        let edge = signed(words, 3 * self.component, EDGE_BITS) as u8 & MAX_EDGE;
        (offset, edge)
    }

    /// The residuals of the levels, field by field.
    #[inline]
    fn levels<'a>(&'a self, words: &'a [i32]) -> impl Iterator<Item = i32> + 'a {
        let first = 3 * self.component + EDGE_BITS;
        self.levels.iter().scan(first, |at, &bits| {
            let level = signed(words, *at, bits);
            *at += bits;
            Some(level)
        })
    }
}

/// A signed number of so many bits, 1 to 32, of the packed ones of an update, from bit `at` of these on.
#[inline]
fn signed(words: &[i32], at: u32, bits: u32) -> i32 {
    let word = PACKED + (at / u32::BITS) as usize;
    let (low, high) = (words[word] as u32, words.get(word + 1).map_or(0, |&high| high as u32));
    let both = (u64::from(low) | u64::from(high) << 32) >> (at % u32::BITS);
    // Shifted up to the top of the word and down again, it brings its sign along.
    ((both << (u64::BITS - bits)) as i64 >> (u64::BITS - bits)) as i32
}

#[inline]
fn two(words: &[i32], at: usize) -> u64 {
    u64::from(words[at] as u32) | u64::from(words[at + 1] as u32) << 32
}

impl EdgeMt {
    /// An MT without updates. `base` must fit `info`: see [`BaseMesh::check`](crate::mt::BaseMesh::check).
    pub fn new(mut info: MtInfo, base: BaseMesh) -> Self {
        info.kind = MtKind::Edge;
        Self {
            base_splits: vec![WHOLE; base.positions.len()],
            base,
            words: Vec::new(),
            errors: Errors::new(info.fields.len()),
            updates: 0,
            record: Record::new(&info),
            to_come: Vec::new(),
            page_bits: MtKind::Edge.usual_block_bits(),
            info,
        }
    }

    /// Notes how many updates a block of its file has: see [`UpdatePages::page_bits`].
    #[doc(hidden)]
    pub fn set_page_bits(&mut self, bits: u32) {
        self.page_bits = bits;
    }

    /// A bound of the errors of the updates that are not here yet, where one is known.
    fn unless_complete(&self, bound: Option<ErrorCode>) -> ErrorCode {
        if self.updates() >= self.info.updates { ErrorCode::ZERO } else { bound.unwrap_or(ErrorCode::MAX) }
    }

    /// Adds the next update, behind all that are here.
    ///
    /// # Errors
    /// The split vertex must exist and be whole, residuals must fit the lattices, and each field has an error. What needs the
    /// mesh is checked when the update is applied; that errors do not grow along the partial order is the caller's to see
    /// to.
    pub fn push(&mut self, new: &EdgeUpdate<'_>) -> Result<UpdateId, UpdateError> {
        let update = self.updates();
        self.check(update, new)?;
        let vertex = new.vertex.0;
        match self.split_word(new.vertex) {
            Some(word) if *word == WHOLE => *word = update as i32,
            _ => return Err(UpdateError::Vertex { update, vertex }),
        }
        let complete = self.errors.push(new.errors);
        assert!(complete, "each field has an error: that is checked");
        self.record.push(&mut self.words, new);
        self.updates += 1;
        Ok(UpdateId(update))
    }

    /// Checks what does not need the mesh.
    fn check(&self, update: u32, new: &EdgeUpdate<'_>) -> Result<(), UpdateError> {
        let fits = |residual: i32, bits: u32| residual.unsigned_abs() <= 1 << bits;
        let fields = &self.info.fields;
        // A prediction may be as wrong as two offsets differ.
        let levels = new.level_residuals.iter().zip(fields);
        let on_lattice = new.offset_residual.iter().all(|&d| fits(d, self.info.lattice.bits))
            && new.level_residuals.len() == fields.len()
            && levels.into_iter().all(|(&d, field)| fits(d, field.bits + 1));
        if !on_lattice {
            Err(UpdateError::OffLattice { update })
        } else if new.edge > MAX_EDGE {
            Err(UpdateError::Edge { update })
        } else if new.errors.len() != fields.len() {
            Err(UpdateError::Error { update })
        } else {
            Ok(())
        }
    }

    /// The words of an update; none if it is not here.
    #[inline]
    fn words(&self, u: UpdateId) -> &[i32] {
        let len = self.record.len;
        if self.has(u) { &self.words[u.0 as usize * len..][..len] } else { &[] }
    }

    /// Where it is noted what splits a vertex; none if what creates it is not here.
    fn split_word(&mut self, v: VertexId) -> Option<&mut i32> {
        let Some(i) = v.0.checked_sub(self.base_splits.len() as u32) else {
            return self.base_splits.get_mut(v.0 as usize);
        };
        let is_here = self.has(UpdateId(i / 2));
        let at = i as usize / 2 * self.record.len + SPLITS + i as usize % 2;
        if is_here { self.words.get_mut(at) } else { None }
    }

    /// Update `u` as it is stored.
    ///
    /// # Panics
    /// If the MT has no update `u`, or not here.
    pub fn update(&self, u: UpdateId) -> EdgeUpdate<'_> {
        EdgeUpdate { level_residuals: self.level_residuals(u).collect(), ..self.update_without_levels(u) }
    }

    /// [`Self::update`] but for the levels, which are left empty.
    #[inline]
    pub(crate) fn update_without_levels(&self, u: UpdateId) -> EdgeUpdate<'_> {
        let words = self.words(u);
        let (offset_residual, edge) = self.record.offset(words);
        EdgeUpdate {
            vertex: VertexId(words[VERTEX] as u32),
            offset_residual,
            edge,
            level_residuals: Cow::Borrowed(&[]),
            wrong_sides: two(words, MASK),
            errors: self.errors(u),
        }
    }

    /// The vertex that update `u`, which is here, splits.
    #[inline]
    pub(crate) fn split_vertex(&self, u: UpdateId) -> VertexId {
        VertexId(self.words(u)[VERTEX] as u32)
    }

    /// [`EdgeUpdate::level_residuals`] of update `u`, which is here.
    #[inline]
    pub(crate) fn level_residuals(&self, u: UpdateId) -> impl Iterator<Item = i32> + '_ {
        self.record.levels(self.words(u))
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

impl MultiTessellation for EdgeMt {
    fn info(&self) -> &MtInfo {
        &self.info
    }

    fn base(&self) -> &BaseMesh {
        &self.base
    }

    fn updates(&self) -> u32 {
        self.updates
    }

    #[inline]
    fn error(&self, u: UpdateId) -> ErrorCode {
        if self.has(u) { self.errors.largest(u.0 as usize) } else { ErrorCode::ZERO }
    }

    #[inline]
    fn errors(&self, u: UpdateId) -> &[ErrorCode] {
        if self.has(u) { self.errors.of(u.0 as usize) } else { &[] }
    }

    fn to_come(&self) -> ErrorCode {
        self.unless_complete(self.to_come.iter().copied().max())
    }

    fn to_come_in(&self, field: usize) -> ErrorCode {
        self.unless_complete(self.to_come.get(field).copied())
    }

    /// A split adds the tetrahedra of its fan.
    fn always_grows(&self) -> bool {
        true
    }

    fn bytes(&self) -> u64 {
        let updates = size_of_val(&self.words[..]) + self.errors.bytes();
        self.base.bytes() + (size_of_val(&self.base_splits[..]) + updates) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Lattice;
    use crate::mt::FieldInfo;

    fn info(bits: u32, fields: Vec<FieldInfo>) -> MtInfo {
        MtInfo {
            kind: MtKind::Edge,
            lattice: Lattice { origin: [0.0; 3], step: [1.0; 3], bits },
            fields,
            vertices: 1,
            tetrahedra: 1,
            updates: 1,
            displacement_per_error: 1.0,
            quantization: 0.0,
            bounds: None,
        }
    }

    /// All sizes of lattices, with the largest numbers of each, and some in between.
    #[test]
    fn what_is_packed_comes_back() {
        for (bits, fields) in (1..=30).flat_map(|bits| [1, 2, 7].map(|fields| (bits, fields))) {
            let of = |f: u32| FieldInfo { bits: 1 + (bits + 5 * f) % 24, ..FieldInfo::default() };
            let info = info(bits, (0..fields).map(of).collect());
            let record = Record::new(&info);
            let ends = |bits: u32, i: usize| {
                let largest = 1_i32 << bits;
                [-largest, 1 - largest, -1, 0, 1, largest - 1, largest][i % 7]
            };
            for (i, edge) in (0..343).zip((0..=MAX_EDGE).cycle()) {
                let offset_residual = [i, i / 7, i / 49].map(|i| ends(bits, i));
                let level = |(f, field): (usize, &FieldInfo)| ends(field.bits + 1, i + 3 * f);
                let levels: Vec<i32> = info.fields.iter().enumerate().map(level).collect();
                let update = EdgeUpdate {
                    vertex: VertexId(7),
                    offset_residual,
                    edge,
                    level_residuals: (&levels[..]).into(),
                    wrong_sides: u64::MAX - 5,
                    errors: &[],
                };
                let mut words = vec![-1; 3];
                record.push(&mut words, &update);
                let words = &words[3..];
                assert_eq!(words.len(), record.len);
                assert_eq!((words[VERTEX], two(words, MASK)), (7, u64::MAX - 5));
                assert_eq!(record.offset(words), (offset_residual, edge), "{bits} bits");
                assert!(record.levels(words).eq(levels.iter().copied()), "{bits} bits");
            }
        }
    }

    #[test]
    fn an_update_takes_at_most_38_bytes() {
        let field = FieldInfo { bits: 16, ..FieldInfo::default() };
        let bytes = |bits| Record::new(&info(bits, vec![field.clone()])).bytes();
        assert_eq!([16, 21, 22, 30].map(bytes), [34, 34, 38, 38]);
    }
}

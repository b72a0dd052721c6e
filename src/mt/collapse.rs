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

use super::BaseMesh;
use super::ErrorCode;
use super::MtInfo;
use super::MtKind;
use super::UpdateError;
use super::UpdateId;
use super::VertexId;
use super::errors::Errors;
use crate::geom::NARROW_BITS;
use crate::mesh::NONE;

/// Largest number of tetrahedra around a vertex that an update splits.
pub const MAX_STAR: usize = 64;

/// Largest number of vertices around a vertex that an update splits.
pub const MAX_LINK: usize = 32;

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
/// It grows by [`push`](EdgeMt::push), coarse to fine; every prefix of an MT is an MT.
#[derive(Clone, Debug, PartialEq)]
pub struct EdgeMt {
    info: MtInfo,
    base: BaseMesh,
    /// Whether masks and field offsets are told as what is wrong with guesses: see [`EdgeMt::coded`].
    is_coded: bool,
    /// `s(v)` for every vertex so far, [`NONE`] while nothing splits it.
    split_of: Vec<u32>,
    /// The vertex that each update splits.
    vertex_of: Vec<u32>,
    offsets: Offsets,
    /// One block of `fields` per update.
    field_offsets: Vec<i32>,
    masks: Vec<u64>,
    errors: Errors,
    to_come: ErrorCode,
}

impl EdgeMt {
    /// An MT without updates. `base` must fit `info`: see [`BaseMesh::check`](super::BaseMesh::check).
    pub fn new(mut info: MtInfo, base: BaseMesh) -> Self {
        info.kind = MtKind::Edge;
        let split_of = vec![NONE; base.positions.len()];
        let offsets = Offsets::new(info.lattice.bits);
        let errors = Errors::new(info.fields.len());
        Self {
            info,
            base,
            is_coded: false,
            split_of,
            vertex_of: Vec::new(),
            offsets,
            field_offsets: Vec::new(),
            masks: Vec::new(),
            errors,
            to_come: ErrorCode::MAX,
        }
    }

    /// [`EdgeMt::new`] in the form that files have: the masks and the field offsets of splits are not what they are, but
    /// what is wrong with the guesses that the star allows when the split is applied. Bit `i` of a mask then says that
    /// the guess for the `i`-th tetrahedron is wrong, counted from the one whose side is the least certain.
    pub fn coded(info: MtInfo, base: BaseMesh) -> Self {
        Self { is_coded: true, ..Self::new(info, base) }
    }

    /// Whether this is the form that files have.
    pub fn is_coded(&self) -> bool {
        self.is_coded
    }

    /// Adds the next update.
    ///
    /// # Errors
    /// The split vertex must exist and be whole, offsets must fit the lattices, and each field has an error. What needs the mesh is checked when
    /// the update is applied; that errors do not grow along the partial order is the caller's to see to.
    pub fn push(&mut self, split: &VertexSplit<'_>) -> Result<UpdateId, UpdateError> {
        let update = self.vertex_of.len() as u32;
        let vertex = split.vertex.0;
        if self.split_of.get(vertex as usize) != Some(&NONE) {
            return Err(UpdateError::Vertex { update, vertex });
        }
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
        if !self.errors.push(split.errors) {
            return Err(UpdateError::Error { update });
        }
        self.split_of[vertex as usize] = update;
        self.split_of.extend([NONE, NONE]);
        self.vertex_of.push(vertex);
        self.offsets.push(split.offset);
        self.field_offsets.extend_from_slice(split.field_offsets);
        self.masks.push(split.mask);
        Ok(UpdateId(update))
    }

    /// Tells that no update which is still to come has a larger error than this; until then, any may come. Means
    /// nothing once all are here.
    pub fn set_to_come(&mut self, bound: ErrorCode) {
        self.to_come = if self.updates() == self.info.updates { ErrorCode::MAX } else { bound };
    }

    /// No update that is not here has a larger error.
    pub fn to_come(&self) -> ErrorCode {
        if self.updates() >= self.info.updates { ErrorCode::ZERO } else { self.to_come }
    }

    /// What is known of the MT as a whole.
    pub fn info(&self) -> &MtInfo {
        &self.info
    }

    /// The base mesh.
    pub fn base(&self) -> &BaseMesh {
        &self.base
    }

    /// Number of updates so far.
    pub fn updates(&self) -> u32 {
        self.vertex_of.len() as u32
    }

    /// Bytes of everything that the MT holds, base mesh and errors included.
    pub fn bytes(&self) -> u64 {
        let base = size_of_val(&self.base.positions[..])
            + size_of_val(&self.base.values[..])
            + size_of_val(&self.base.tets[..]);
        let order = size_of_val(&self.split_of[..]) + size_of_val(&self.vertex_of[..]);
        let nodes = self.offsets.bytes()
            + size_of_val(&self.field_offsets[..])
            + size_of_val(&self.masks[..])
            + self.errors.bytes();
        (base + order + nodes) as u64
    }

    /// The error of update `u`: the largest one of all fields.
    #[inline]
    pub fn error_of(&self, u: UpdateId) -> ErrorCode {
        self.errors.largest(u.0 as usize)
    }

    /// The error of update `u` in each field.
    #[inline]
    pub fn errors_of(&self, u: UpdateId) -> &[ErrorCode] {
        self.errors.of(u.0 as usize)
    }

    /// What update `u` does.
    ///
    /// # Panics
    /// If the MT has no update `u`.
    #[inline]
    pub fn split(&self, u: UpdateId) -> VertexSplit<'_> {
        let (k, fields) = (u.0 as usize, self.info.fields.len());
        VertexSplit {
            vertex: VertexId(self.vertex_of[k]),
            offset: self.offsets.get(k),
            field_offsets: &self.field_offsets[k * fields..][..fields],
            mask: self.masks[k],
            errors: self.errors.of(k),
        }
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
        self.split_of.get(v.0 as usize).filter(|&&s| s != NONE).map(|&s| UpdateId(s))
    }
}

/// The offsets of all updates. On lattices of up to [`NARROW_BITS`] bits, three components of 21 bits share a word.
#[derive(Clone, Debug, PartialEq)]
enum Offsets {
    Narrow(Vec<u64>),
    Wide(Vec<[i32; 3]>),
}

/// Bits of a component in a shared word: `NARROW_BITS` and the sign.
const COMPONENT_BITS: u32 = NARROW_BITS + 1;

impl Offsets {
    fn new(lattice_bits: u32) -> Self {
        if lattice_bits < NARROW_BITS { Self::Narrow(Vec::new()) } else { Self::Wide(Vec::new()) }
    }

    fn push(&mut self, offset: [i32; 3]) {
        match self {
            Self::Narrow(words) => {
                let mask = (1_u64 << COMPONENT_BITS) - 1;
                let [x, y, z] = offset.map(|d| d as u64 & mask);
                words.push(x | y << COMPONENT_BITS | z << (2 * COMPONENT_BITS));
            }
            Self::Wide(offsets) => offsets.push(offset),
        }
    }

    #[inline]
    fn get(&self, k: usize) -> [i32; 3] {
        match self {
            // Shifted up to the top of the word and down again, each component brings its sign along.
            Self::Narrow(words) => [2, 1, 0].map(|above| {
                let top = words[k] << (64 - 3 * COMPONENT_BITS + above * COMPONENT_BITS);
                (top as i64 >> (64 - COMPONENT_BITS)) as i32
            }),
            Self::Wide(offsets) => offsets[k],
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Self::Narrow(words) => size_of_val(words.as_slice()),
            Self::Wide(offsets) => size_of_val(offsets.as_slice()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_come_back_from_either_form() {
        for bits in [1, 8, NARROW_BITS - 1, NARROW_BITS, 30] {
            let largest = 1_i32 << bits;
            let values = [-largest, 1 - largest, -1, 0, 1, largest - 1, largest];
            let mut offsets = Offsets::new(bits);
            let all: Vec<[i32; 3]> =
                (0..343).map(|i| [values[i % 7], values[i / 7 % 7], values[i / 49]]).collect();
            all.iter().for_each(|&offset| offsets.push(offset));
            all.iter().enumerate().for_each(|(k, &offset)| assert_eq!(offsets.get(k), offset));
        }
    }
}

//! The vertex-based Multi-Tessellation with the node code of the paper [§5].
//!
//! Partial order, vertices and their numbers are those of [`VertexMt`]; what a node says of T_u is the paper's:
//!
//! ```text
//! vertex u │ loops │ boundary face f_u        │ stream of T_u     │ removers of the star
//!          │       │ t_u    f_u in t_u   t_0  │                   │
//!          │       │ 5 bits   2 bits   5 bits │ 6 p − q + 1 bits  │ (not in the paper)
//! ```
//!
//! - **t_u** is a tetrahedron of the star that the first parent in the loop of u created, by its place in the canonical order
//!   of that star; in the loop of an update without parents, of the base mesh. The order of parents in a loop is free, so the one
//!   that created t_u comes first.
//! - **f_u** is a face of t_u, by the place of the vertex opposite it in the order of labels.
//! - **t_0** is the tetrahedron that has f_u when u is applied, by its place in the star of the new vertex.
//! - **the stream** is that of `tree_code.rs`.
//!
//! The paper gives the sum of 12 bits, and refers to another paper for its parts; these are ours. A vertex with 32 neighbours has up
//! to 60 tetrahedra around it, and five bits count to 31. But which face is f_u is free: one is taken whose two tetrahedra have
//! such places. With [`MostNeighbors::SixtyFour`] places have six bits, and f_u takes 14.
//!
//! **What a node cannot say** is in a list of exceptions, which are counted and measured: a face f_u for which there is no room;
//! faces on the boundary of the domain that are given up although the new vertex is in front of them; T_u where the stream
//! does not lead to it, as `rebuild.rs` explains.
//!
//! **Removers.** The paper chooses nodes to refine; requests of this crate choose tetrahedra, and ask each for the update that
//! removes it ([`ApplyUpdates::remover`](crate::mt::ApplyUpdates::remover)). The paper's node does not say that, so it is stored
//! behind the stream, as in [`VertexMt`], in as many bits. Updates are found and undone without it.

use crate::mt::vertex::bit_string::Bits;
use crate::mt::vertex::store::VertexMt;
use crate::mt::{BaseMesh, ErrorCode, MtInfo, MultiTessellation, UpdateId, VertexId};

/// How many neighbours a vertex should have at most when it is inserted. More are possible: what decides is that t_u and t_0 have
/// places that the bits for them can hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MostNeighbors {
    /// As in the paper: f_u takes 12 bits.
    #[default]
    ThirtyTwo,
    /// As in [`VertexMt`]: f_u takes 14 bits.
    SixtyFour,
}

impl MostNeighbors {
    /// Bits of a place in a star.
    pub(super) fn place_bits(self) -> u32 {
        match self {
            Self::ThirtyTwo => 5,
            Self::SixtyFour => 6,
        }
    }

    /// Bits that a boundary face f_u takes.
    pub fn face_bits(self) -> u32 {
        2 * self.place_bits() + SIDE_BITS
    }

    /// The number of neighbours.
    pub fn neighbors(self) -> u32 {
        1 << self.place_bits()
    }
}

/// Bits of the number of a face of a tetrahedron.
const SIDE_BITS: u32 = 2;

/// The boundary face f_u.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BoundaryFace {
    /// Whether t_u is a tetrahedron of the base mesh.
    pub of_base: bool,
    /// The number of t_u there, or its place in the star that the first parent made.
    pub tet: u32,
    /// The place of the vertex of t_u that f_u lies opposite, in the order of labels.
    pub side: u32,
    /// The place of t_0 in the star of the new vertex.
    pub star: u32,
}

impl BoundaryFace {
    /// Whether a node has room for it. Whether t_u is of the base mesh follows from the loop.
    pub fn fits(&self, limit: MostNeighbors, has_parents: bool) -> bool {
        let room = limit.neighbors();
        self.tet < room && self.star < room && self.of_base != has_parents
    }

    pub fn write(&self, limit: MostNeighbors, bits: &mut Bits) {
        bits.push(u64::from(self.tet), limit.place_bits());
        bits.push(u64::from(self.side), SIDE_BITS);
        bits.push(u64::from(self.star), limit.place_bits());
    }
}

/// What the node of an update cannot say.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Exception {
    pub update: u32,
    pub face: Option<BoundaryFace>,
    /// Which faces of T_u on the boundary of the domain are given up, in the order of their sorted labels.
    pub given_up: Option<Vec<bool>>,
    /// The apexes of the tetrahedra of T_u, in the order of the stream and by their numbers in Π_u.
    pub apexes: Option<Vec<u8>>,
}

impl Exception {
    pub fn is_needed(&self) -> bool {
        self.face.is_some() || self.given_up.is_some() || self.apexes.is_some()
    }

    fn bytes(&self) -> usize {
        let lists = [self.given_up.as_ref().map(Vec::len), self.apexes.as_ref().map(Vec::len)];
        size_of_val(self) + lists.into_iter().flatten().sum::<usize>()
    }
}

/// How many updates have parts that their nodes cannot say; some have several.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TreeExceptions {
    /// No boundary face has two tetrahedra with places that the bits for them can hold.
    pub faces: u32,
    /// Faces on the boundary of the domain are given up although the new vertex is in front of them.
    pub given_up: u32,
    /// The stream alone does not lead back to T_u.
    pub trees: u32,
}

/// A compact vertex-based MT whose nodes describe T_u as those of the paper do. It lives in memory: files have the nodes of
/// [`VertexMt`].
#[derive(Clone, Debug, PartialEq)]
pub struct VertexTreeMt {
    /// Vertices, loops and errors. What is behind the links of its nodes is read here, and there alone.
    pub(super) loops: VertexMt,
    pub(super) limit: MostNeighbors,
    /// Ascending by update.
    pub(super) exceptions: Vec<Exception>,
    pub(super) code_bits: u64,
    pub(super) remover_bits: u64,
}

impl VertexTreeMt {
    /// How many neighbours the nodes are made for.
    pub fn most_neighbors(&self) -> MostNeighbors {
        self.limit
    }

    /// Bits of all nodes for the boundary faces f_u and the streams of T_u: 12 (or 14) and 6 p − q + 1 for each, where T_u has p tetrahedra and q
    /// faces on its boundary. Without what fills up the last unit, and without exceptions.
    pub fn code_bits(&self) -> u64 {
        self.code_bits
    }

    /// Bits of all nodes for the removers of stars, which the paper's nodes do not have. [`VertexMt`] has as many, among its
    /// [`shape_bits`](VertexMt::shape_bits).
    pub fn remover_bits(&self) -> u64 {
        self.remover_bits
    }

    /// What the nodes cannot say.
    pub fn exceptions(&self) -> TreeExceptions {
        let mut counts = TreeExceptions::default();
        for exception in &self.exceptions {
            counts.faces += u32::from(exception.face.is_some());
            counts.given_up += u32::from(exception.given_up.is_some());
            counts.trees += u32::from(exception.apexes.is_some());
        }
        counts
    }

    /// Bytes of that, among those of the MT.
    pub fn exception_bytes(&self) -> u64 {
        self.exceptions.iter().map(Exception::bytes).sum::<usize>() as u64
    }

    /// The vertex that update `u` inserts.
    pub fn vertex(&self, u: UpdateId) -> VertexId {
        self.loops.vertex(u)
    }

    /// The parents of update `u` in the DAG; the one that created t_u comes first.
    pub fn parents(&self, u: UpdateId) -> impl Iterator<Item = UpdateId> {
        self.loops.parents(u)
    }

    pub(super) fn exception(&self, u: UpdateId) -> Option<&Exception> {
        let at = self.exceptions.binary_search_by_key(&u.0, |exception| exception.update).ok()?;
        self.exceptions.get(at)
    }

    /// Where the boundary face of a node starts.
    fn face_start(&self, u: UpdateId) -> u64 {
        self.loops.links_end(self.loops.node_start(u.0), self.loops.children(u))
    }

    pub(super) fn face(&self, u: UpdateId) -> BoundaryFace {
        if let Some(face) = self.exception(u).and_then(|exception| exception.face) {
            return face;
        }
        let (bits, width, start) = (&self.loops.nodes, self.limit.place_bits(), self.face_start(u));
        let side = start + u64::from(width);
        BoundaryFace {
            of_base: self.loops.parents(u).next().is_none(),
            tet: bits.get(start, width) as u32,
            side: bits.get(side, SIDE_BITS) as u32,
            star: bits.get(side + u64::from(SIDE_BITS), width) as u32,
        }
    }

    /// Where the stream of a node starts.
    pub(super) fn stream_start(&self, u: UpdateId) -> u64 {
        self.face_start(u) + u64::from(self.limit.face_bits())
    }
}

impl MultiTessellation for VertexTreeMt {
    fn info(&self) -> &MtInfo {
        self.loops.info()
    }

    fn base(&self) -> &BaseMesh {
        self.loops.base()
    }

    fn updates(&self) -> u32 {
        self.loops.updates()
    }

    fn always_grows(&self) -> bool {
        self.loops.always_grows()
    }

    fn error(&self, u: UpdateId) -> ErrorCode {
        self.loops.error(u)
    }

    fn errors(&self, u: UpdateId) -> &[ErrorCode] {
        self.loops.errors(u)
    }

    fn to_come(&self) -> ErrorCode {
        self.loops.to_come()
    }

    fn bytes(&self) -> u64 {
        self.loops.bytes() + self.exception_bytes()
    }
}

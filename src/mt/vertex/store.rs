//! The compact vertex-based Multi-Tessellation [§2.2, §5].
//!
//! An update inserts a vertex into a star-shaped polyhedron Π_u: the tetrahedra T_u in it are replaced by the star of the
//! vertex. Base vertices are numbered first and update `k` inserts vertex `b + k`, so a tetrahedron was created by its
//! vertex with the largest number.
//!
//! **The partial order** is kept in the loops of Klein and Gumhold [§5, Fig. 4]: the loop of an update is a cyclic list
//! of the update and its parents. A link has the next member and which of *its* links leads on; link 0 of an update is
//! that of its own loop, link `i` belongs to the loop of its `i`-th child. Following link 0 yields the parents, following
//! link `i` leads to the `i`-th child.
//!
//! **A node** holds the vertex and what takes the place of the paper's two tasks:
//! 1. *Find T_u in the current mesh.* Every tetrahedron has its remover from the moment it is created:
//!    the node that creates it stores, for each tetrahedron of its star in canonical order, which child removes it. T_u is
//!    then what is connected to any tetrahedron that `u` removes, and complete when its size is the stored one.
//!    No seed is stored: the last tetrahedron that `u` was found to remove is in T_u when all parents of `u` are applied.
//! 2. *Build T_u inside Π_u.* The faces of Π_u, and those that come up on the way, are closed one after the other in
//!    canonical order; the code names the fourth vertex of the tetrahedron behind each, among those of Π_u: by
//!    its number there, or by its place in the order in which spheres through the face reach them, in whichever way takes the
//!    fewest bits. When all of
//!    T_u meets in one vertex, as after a half-edge collapse, the code is that vertex.
//!
//! Where tetrahedra have errors of their own, the node that creates one stores with its remover how often the errors of
//! that update can be quartered to bound those of the tetrahedron.
//!
//! The canonical order of the star is that of the sorted vertex numbers of the faces opposite the new vertex. It is the
//! same in every consistent set, since the star at the moment of insertion is.

use super::bit_string::{Bits, width_of};
use super::growing::Growing;
use super::limits::{COUNT_BITS, MAX_INSERTED, MAX_REMOVED};
use crate::mesh::NONE;
use crate::mt::update_errors::Errors;
use crate::mt::{
    BaseMesh, ErrorCode, MAX_QUARTERINGS, MtInfo, MtKind, MultiTessellation, UpdateError, UpdateId, VertexId,
};

/// A member of a loop, and which of its links leads on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::mt) struct Link {
    pub node: u32,
    pub link: u32,
}

/// How wide the parts of a node are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::mt) struct Widths {
    pub position: u32,
    pub node: u32,
    pub link: u32,
    /// Position and levels together.
    pub vertex: u32,
}

/// A compact vertex-based MT.
///
/// It grows by [`push`](VertexMt::push), coarse to fine; every prefix of an MT is an MT.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexMt {
    pub(in crate::mt) info: MtInfo,
    pub(in crate::mt) base: BaseMesh,
    pub(in crate::mt) base_removers: Vec<u32>,
    /// The [quarterings](crate::mt::ApplyUpdates::quarterings) of each base tetrahedron, if tetrahedra have errors of
    /// their own: then nodes store those of the tetrahedra that they create.
    pub(in crate::mt) base_quarterings: Option<Vec<u8>>,
    /// The [fall](crate::mt::MultiTessellation::own_fall) of each update, then.
    pub(in crate::mt) own_falls: Vec<u8>,
    /// Whether every insertion inserts more tetrahedra than it removes.
    pub(in crate::mt) always_grows: bool,
    pub(in crate::mt) widths: Widths,
    /// All nodes, each padded to units of [`UNIT`] bits.
    pub(in crate::mt) nodes: Bits,
    /// Where each group of [`GROUP`] nodes starts, in bits.
    groups: Vec<u64>,
    /// Where each node starts in its group, in units.
    starts: Vec<u16>,
    errors: Errors,
    pub(super) to_come: ErrorCode,
    /// Bits of all nodes, padding included, but for vertices and links.
    shape_bits: u64,
    /// While the nodes have neither links nor removers: what is instead of them.
    pub(in crate::mt) growing: Option<Box<Growing>>,
    /// See [`UpdatePages::page_bits`](crate::mt::UpdatePages::page_bits).
    pub(super) page_bits: u32,
}

/// Nodes whose starts are relative to a common one: with at most 255 fields a node takes less than 2^14 bits.
const GROUP: usize = 16;
/// Nodes start at multiples of so many bits.
const UNIT: u64 = 4;

/// The bits of one node of a [`VertexMt`]: made by [`VertexMt::node`], stored by [`VertexMt::push`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NodeBits(pub(in crate::mt) Bits);

impl VertexMt {
    /// Notes how many updates a block of its file has: see [`UpdatePages::page_bits`](crate::mt::UpdatePages::page_bits).
    pub(crate) fn set_page_bits(&mut self, bits: u32) {
        self.page_bits = bits;
    }

    /// An MT without updates. `base` must fit `info`: see [`BaseMesh::check`]. `base_removers` has for each base
    /// tetrahedron which update removes it, [`u32::MAX`] if none does; `most_children` is the largest number of children
    /// that an update has, at most [`MAX_INSERTED`]; `always_grows` whether every insertion inserts more tetrahedra than
    /// it removes.
    ///
    /// # Errors
    /// If the removers are not as many as the base tetrahedra or name an update that `info` does not know.
    pub fn new(
        info: MtInfo,
        base: BaseMesh,
        base_removers: Vec<u32>,
        most_children: u32,
        always_grows: bool,
    ) -> Result<Self, UpdateError> {
        let known = |&u: &u32| u < info.updates || u == NONE;
        if base_removers.len() != base.tets.len()
            || !base_removers.iter().all(known)
            || most_children as usize > MAX_INSERTED
        {
            return Err(UpdateError::Cavity { update: 0 });
        }
        let errors = Errors::new(info.fields.len());
        let position = info.lattice.bits + 1;
        let levels: u32 = info.fields.iter().map(|field| field.bits).sum();
        let widths = Widths {
            position,
            node: width_of(info.updates.saturating_sub(1)).max(1),
            link: width_of(most_children).max(1),
            vertex: 3 * position + levels,
        };
        Ok(Self {
            info,
            base,
            base_removers,
            base_quarterings: None,
            own_falls: Vec::new(),
            always_grows,
            widths,
            nodes: Bits::default(),
            groups: Vec::new(),
            starts: Vec::new(),
            errors,
            to_come: ErrorCode::MAX,
            shape_bits: 0,
            growing: None,
            page_bits: MtKind::Vertex.usual_block_bits(),
        })
    }

    /// The MT, still without updates, with errors of tetrahedra: those of the base mesh are here, the nodes that are
    /// pushed have the others. See [`quarterings`](crate::mt::ApplyUpdates::quarterings).
    ///
    /// # Errors
    /// If there is not one number of at most [`MAX_QUARTERINGS`](crate::mt::MAX_QUARTERINGS) for each base tetrahedron, or there
    /// are updates.
    pub fn with_tet_errors(mut self, base: Vec<u8>) -> Result<Self, UpdateError> {
        let sound = base.len() == self.base.tets.len() && base.iter().all(|&q| q <= MAX_QUARTERINGS);
        if !sound || self.updates() > 0 {
            return Err(UpdateError::Error { update: 0 });
        }
        self.base_quarterings = Some(base);
        Ok(self)
    }

    /// Sets the fall of an update, where tetrahedra have errors of their own: see
    /// [`own_fall`](crate::mt::MultiTessellation::own_fall).
    pub fn set_own_fall(&mut self, u: UpdateId, fall: u8) {
        self.own_falls.get_mut(u.0 as usize).into_iter().for_each(|own| *own = fall);
    }

    /// The quarterings of the base tetrahedra; none if tetrahedra have no errors of their own.
    pub fn base_quarterings(&self) -> Option<&[u8]> {
        self.base_quarterings.as_deref()
    }

    /// Adds the next update.
    ///
    /// # Errors
    /// The node must be well formed, its vertex on the lattices, and its links within the MT; each field has an error. What needs the mesh is
    /// checked when the update is applied; that errors do not grow along the partial order is the caller's to see to.
    pub fn push(&mut self, node: &NodeBits, errors: &[ErrorCode]) -> Result<UpdateId, UpdateError> {
        let update = self.updates();
        let bits = &node.0;
        if update >= self.info.updates {
            return Err(UpdateError::Cavity { update });
        }
        let position = self.position_at(bits, 0);
        if !position.iter().all(|&x| 0 <= x && x <= 1 << self.info.lattice.bits) {
            return Err(UpdateError::OffLattice { update });
        }
        let children = self.children_at(bits, 0);
        let links_end = self.links_end(0, children);
        let sound = children as usize <= MAX_INSERTED
            && links_end + u64::from(COUNT_BITS) + 2 <= bits.len()
            && bits.len() < 1 << 15
            && (0..=children).all(|i| self.link_at(bits, 0, i).node < self.info.updates)
            && bits.get(links_end, COUNT_BITS) > 0
            && self.growing.is_none();
        if !sound {
            return Err(UpdateError::Cavity { update });
        }
        let start = self.nodes.len();
        self.store(bits, errors)?;
        self.shape_bits += self.nodes.len() - start - links_end;
        Ok(UpdateId(update))
    }

    /// Adds the bits of a node, and its errors.
    pub(in crate::mt) fn store(&mut self, bits: &Bits, errors: &[ErrorCode]) -> Result<(), UpdateError> {
        let (update, start) = (self.updates(), self.nodes.len());
        if self.starts.len().is_multiple_of(GROUP) {
            self.groups.push(start);
        }
        let group = self.groups[self.starts.len() / GROUP];
        // A group of nodes of 2^15 bits each is at most 2^17 units; only nodes with very many fields come near.
        let Ok(offset) = u16::try_from((start - group) / UNIT) else {
            return Err(UpdateError::Cavity { update });
        };
        if !self.errors.push(errors) {
            return Err(UpdateError::Error { update });
        }
        self.starts.push(offset);
        if self.base_quarterings.is_some() {
            self.own_falls.push(0);
        }
        self.nodes.extend(bits);
        self.nodes.pad(UNIT);
        Ok(())
    }

    /// The bits of update `u`, as [`VertexMt::push`] takes them, but for zeros at the end; of an MT that was read from a file once all
    /// of it is here.
    pub fn node(&self, u: UpdateId) -> NodeBits {
        let (mut at, end) = (self.node_start(u.0), self.node_end(u.0));
        let mut bits = Bits::default();
        while at < end {
            let width = (end - at).min(32) as u32;
            bits.push(self.nodes.get(at, width), width);
            at += u64::from(width);
        }
        NodeBits(bits)
    }

    /// Which update removes each base tetrahedron; [`u32::MAX`] if none does.
    pub fn base_removers(&self) -> &[u32] {
        &self.base_removers
    }

    /// The largest number of children that the nodes have room for.
    pub fn most_children(&self) -> u32 {
        ((1 << self.widths.link) - 1).min(MAX_INSERTED as u32)
    }

    /// Bits in all nodes that describe shapes: what a star is made of and removed by, T_u, and what fills up the last unit. The paper's tree of T_u
    /// and seed take 69 bits a node [§5].
    pub fn shape_bits(&self) -> u64 {
        self.shape_bits
    }

    /// The vertex that update `u` inserts.
    #[inline]
    pub fn vertex(&self, u: UpdateId) -> VertexId {
        VertexId(self.base.positions.len() as u32 + u.0)
    }

    /// The update that inserts `v`; none for a vertex of the base mesh.
    #[inline]
    pub fn inserted_by(&self, v: VertexId) -> Option<UpdateId> {
        v.0.checked_sub(self.base.positions.len() as u32).map(UpdateId)
    }

    /// The position of the vertex that update `u` inserts.
    #[inline]
    pub fn position(&self, u: UpdateId) -> [i32; 3] {
        self.position_at(&self.nodes, self.node_start(u.0))
    }

    /// The level of each field at the vertex that update `u` inserts.
    #[inline]
    pub fn levels(&self, u: UpdateId) -> impl Iterator<Item = i32> {
        let mut at = self.node_start(u.0) + u64::from(3 * self.widths.position);
        self.info.fields.iter().map(move |field| {
            let level = self.nodes.get(at, field.bits);
            at += u64::from(field.bits);
            level as i32
        })
    }

    /// The parents of update `u` in the DAG, as far as the loop is sound.
    pub fn parents(&self, u: UpdateId) -> impl Iterator<Item = UpdateId> {
        // The loop ends where it began; a parent that is not older is none.
        let parent = move |at: Link| Some(at).filter(|at| at.node < u.0);
        let on = move |at: &Link| parent(self.link(at.node, at.link));
        // An update removes at most as many tetrahedra as there are steps here; a loop that is longer is none.
        let first = if self.growing.is_none() { parent(self.link(u.0, 0)) } else { None };
        let members = std::iter::successors(first, on).take(MAX_REMOVED);
        let known = self.growing.as_ref().map_or(&[][..], |growing| growing.parents(u.0));
        known.iter().copied().chain(members.map(|at| at.node)).map(UpdateId)
    }

    /// Number of children of update `u`, also of those that have not arrived yet.
    #[inline]
    pub fn children(&self, u: UpdateId) -> u32 {
        if let Some(growing) = &self.growing {
            return growing.children(u.0).len() as u32;
        }
        self.children_at(&self.nodes, self.node_start(u.0))
    }

    /// The `i`-th child of update `u`, counted from 1; none while it has not arrived, and if the loop is not sound.
    #[inline]
    pub(in crate::mt) fn child(&self, u: UpdateId, i: u32) -> Option<UpdateId> {
        let mut at = Link { node: u.0, link: i };
        for _ in 0..=MAX_REMOVED {
            if at.node >= self.updates() {
                return None;
            }
            at = self.link(at.node, at.link);
            if at.link == 0 {
                return Some(UpdateId(at.node)).filter(|&child| u < child && child.0 < self.updates());
            }
        }
        None
    }

    #[inline]
    fn link(&self, node: u32, link: u32) -> Link {
        self.link_at(&self.nodes, self.node_start(node), link)
    }

    /// Where the node of an update starts.
    #[inline]
    pub(in crate::mt) fn node_start(&self, u: u32) -> u64 {
        self.groups[u as usize / GROUP] + UNIT * u64::from(self.starts[u as usize])
    }

    pub(in crate::mt) fn node_end(&self, u: u32) -> u64 {
        if u + 1 < self.updates() { self.node_start(u + 1) } else { self.nodes.len() }
    }

    fn position_at(&self, bits: &Bits, start: u64) -> [i32; 3] {
        let width = self.widths.position;
        [0, 1, 2].map(|axis| bits.get(start + u64::from(axis * width), width) as i32)
    }

    #[inline]
    fn children_at(&self, bits: &Bits, start: u64) -> u32 {
        bits.get(start + u64::from(self.widths.vertex), self.widths.link) as u32
    }

    #[inline]
    fn link_at(&self, bits: &Bits, start: u64, link: u32) -> Link {
        let Widths { node, link: width, vertex, .. } = self.widths;
        let at = start + u64::from(vertex + width) + u64::from(link) * u64::from(node + width);
        let both = bits.get(at, node + width);
        Link { node: (both & ((1 << node) - 1)) as u32, link: (both >> node) as u32 }
    }

    /// Where the shape of a node starts, which is behind its links.
    #[inline]
    pub(in crate::mt) fn links_end(&self, start: u64, children: u32) -> u64 {
        let Widths { node, link, vertex, .. } = self.widths;
        start + u64::from(vertex + link) + u64::from(children + 1) * u64::from(node + link)
    }
}

impl MultiTessellation for VertexMt {
    fn info(&self) -> &MtInfo {
        &self.info
    }

    fn base(&self) -> &BaseMesh {
        &self.base
    }

    fn updates(&self) -> u32 {
        self.starts.len() as u32
    }

    fn always_grows(&self) -> bool {
        self.always_grows
    }

    #[inline]
    fn error(&self, u: UpdateId) -> ErrorCode {
        self.errors.largest(u.0 as usize)
    }

    #[inline]
    fn errors(&self, u: UpdateId) -> &[ErrorCode] {
        self.errors.of(u.0 as usize)
    }

    fn has_tet_errors(&self) -> bool {
        self.base_quarterings.is_some()
    }

    fn own_fall(&self, u: UpdateId) -> u8 {
        self.own_falls.get(u.0 as usize).copied().unwrap_or(0)
    }

    fn to_come(&self) -> ErrorCode {
        if self.updates() >= self.info.updates { ErrorCode::ZERO } else { self.to_come }
    }

    fn bytes(&self) -> u64 {
        let base = size_of_val(&self.base_removers[..])
            + self.base_quarterings.as_ref().map_or(0, Vec::len)
            + self.own_falls.len();
        let nodes = self.nodes.bytes() + size_of_val(&self.groups[..]) + size_of_val(&self.starts[..]);
        let growing = self.growing.as_ref().map_or(0, |growing| growing.bytes());
        self.base.bytes() + (base + nodes + growing + self.errors.bytes()) as u64
    }
}

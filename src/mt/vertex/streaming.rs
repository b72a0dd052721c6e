//! A compact vertex-based MT that grows by what its updates remove, without knowledge of their children.
//!
//! Nodes name their children, which come later. So until all updates are here, parents, children and removers are kept
//! beside the nodes; then they move into them.

use super::bit_string::{Bits, width_of};
use super::growing::Growing;
use super::limits::MAX_REMOVED;
use crate::mesh::NONE;
use crate::mt::mesh::FIRST_ANONYMOUS_TAG;
use crate::mt::mesh::stars::GATHERED;
use crate::mt::{
    ApplyUpdates, BaseMesh, CurrentMesh, ErrorCode, MtInfo, MultiTessellation, NodeBits, UpdateError,
    UpdateId, VertexMt,
};

/// Children that a list has room for at first.
const USUAL_CHILDREN: usize = 8;

/// The next update of an MT that grows: the insertion of a vertex into a mesh with all updates so far.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Insertion<'a> {
    pub position: [i32; 3],
    pub levels: &'a [i32],
    /// The slots of the tetrahedra that are removed.
    pub removed: &'a [u32],
    /// Slot and face of those of their faces on the boundary that are given up.
    pub given_up: &'a [[u32; 2]],
    pub errors: &'a [ErrorCode],
    /// The quarterings of each removed tetrahedron; not looked at where tetrahedra have no errors of their own.
    pub quarterings: &'a [u8],
    /// The fall of the update, then.
    pub own_fall: u8,
}

impl VertexMt {
    /// An MT without updates that grows by [`VertexMt::insert_into`]. `base` must fit `info`.
    ///
    /// # Errors
    /// If the base mesh has too many tetrahedra.
    pub(crate) fn growing(
        info: MtInfo,
        base: BaseMesh,
        always_grows: bool,
        tet_errors: bool,
    ) -> Result<Self, UpdateError> {
        let tets = base.tets.len();
        let complete = info.updates == 0;
        let mut mt = Self::new(info, base, vec![NONE; tets], 0, always_grows)?;
        if tet_errors {
            mt = mt.with_tet_errors(vec![0; tets])?;
        }
        mt.growing = (!complete).then(Box::default);
        Ok(mt)
    }

    /// Adds the next update and applies it to `mesh`, which has all updates so far and started from this MT.
    ///
    /// # Errors
    /// If the update is not the insertion of a vertex into this mesh, or larger than a node can hold. Neither the MT nor the mesh
    /// can be used any further then.
    pub(crate) fn insert_into(
        &mut self,
        mesh: &mut CurrentMesh,
        new: &Insertion<'_>,
    ) -> Result<UpdateId, UpdateError> {
        let update = self.updates();
        let fits = (1..=MAX_REMOVED).contains(&new.removed.len());
        if self.growing.is_none() || update >= self.info.updates || !fits {
            return Err(UpdateError::Cavity { update });
        }
        if !self.info.holds(new.position, new.levels) {
            return Err(UpdateError::OffLattice { update });
        }
        mesh.with_kind_state(|mesh, cavity| self.insert_next(mesh, new, cavity))?;
        self.set_own_fall(UpdateId(update), new.own_fall);
        if self.updates() == self.info.updates {
            self.pack()?;
        }
        Ok(UpdateId(update))
    }

    /// Marks the removed tetrahedra as such, and returns the tags that they had. None if one of them was removed before.
    pub(in crate::mt) fn take_away(
        &self,
        mesh: &mut CurrentMesh,
        new: &Insertion<'_>,
        tags: &mut [u32; GATHERED],
    ) -> Option<()> {
        let update = self.updates();
        for (&t, &own) in new.removed.iter().zip(new.quarterings) {
            mesh.tet(t)?;
            mesh.set_tet_byte(t, own);
        }
        for (old, &t) in tags.iter_mut().zip(new.removed) {
            mesh.tet(t)?;
            *old = mesh.tag(t);
            if *old < FIRST_ANONYMOUS_TAG || *old == NONE {
                return None;
            }
            mesh.take_tag(t, update);
        }
        Some(())
    }

    /// Lists the update that was added last with its parents, given the tags of what it removes; and makes room for what will
    /// remove the `inserted` tetrahedra of its star.
    pub(in crate::mt) fn note_parents(
        &mut self,
        mesh: &CurrentMesh,
        new: &Insertion<'_>,
        tags: &[u32],
        inserted: usize,
    ) {
        let Some(mut growing) = self.growing.take() else { return };
        let u = self.updates() - 1;
        let first = growing.parents.len();
        let own = new.quarterings.iter().copied().chain(std::iter::repeat(0));
        for ((&t, tag), own) in new.removed.iter().zip(tags).zip(own) {
            let place = (tag & !FIRST_ANONYMOUS_TAG) as usize;
            let Some(UpdateId(parent)) = self.creator(mesh, t) else {
                self.base_removers[place] = u;
                if let Some(base) = &mut self.base_quarterings {
                    base[place] = own;
                }
                continue;
            };
            let children = &mut growing.children[parent as usize];
            if children.last() != Some(&u) {
                // Most have a few more than a new list has room for.
                children.reserve(USUAL_CHILDREN * usize::from(children.is_empty()));
                children.push(u);
                growing.parents.push(parent);
            }
            let child = children.len() as u8;
            let at = growing.removers_start(parent) + place;
            growing.removers[at] = child;
            if let Some(quarterings) = growing.quarterings.get_mut(at) {
                *quarterings = own;
            }
        }
        growing.parents[first..].sort_unstable();
        growing.parents_end.push(growing.parents.len() as u32);
        growing.children.push(Vec::new());
        growing.removers.resize(growing.removers.len() + inserted, 0);
        growing.removers_end.push(growing.removers.len() as u64);
        if self.base_quarterings.is_some() {
            growing.quarterings.resize(growing.removers.len(), 0);
        }
        self.growing = Some(growing);
    }

    /// Adds the bits of a node without links and removers.
    pub(in crate::mt) fn add_node(&mut self, bits: &Bits, errors: &[ErrorCode]) -> Result<(), UpdateError> {
        let before = self.nodes.len();
        self.store(bits, errors)?;
        let padding = self.nodes.len() - before - bits.len();
        if let Some(growing) = &mut self.growing {
            growing.padding.push(padding as u8);
        }
        Ok(())
    }

    /// Moves links and removers into the nodes, once all updates are here.
    fn pack(&mut self) -> Result<(), UpdateError> {
        let Some(growing) = self.growing.take() else { return Ok(()) };
        let most_children = growing.children.iter().map(Vec::len).max().unwrap_or(0) as u32;
        let (base, removers) = (std::mem::take(&mut self.base), std::mem::take(&mut self.base_removers));
        let mut packed = Self::new(self.info.clone(), base, removers, most_children, self.always_grows)?;
        packed.page_bits = self.page_bits;
        packed.base_quarterings = self.base_quarterings.take();
        let mut node = NodeBits::default();
        for u in 0..self.updates() {
            self.write_packed(&growing, &packed, u, &mut node.0);
            packed.push(&node, self.errors(UpdateId(u)))?;
        }
        packed.own_falls = std::mem::take(&mut self.own_falls);
        *self = packed;
        Ok(())
    }

    fn write_packed(&self, growing: &Growing, packed: &Self, u: u32, bits: &mut Bits) {
        bits.clear();
        let start = self.node_start(u);
        let end = self.node_end(u) - u64::from(growing.padding[u as usize]);
        let vertex_end = start + u64::from(self.widths.vertex);
        bits.copy(&self.nodes, start, vertex_end);
        let (widths, children) = (packed.widths, growing.children(u));
        bits.push(children.len() as u64, widths.link);
        let of_children = children.iter().map(|&child| {
            let at = growing.parents(child).partition_point(|&parent| parent < u);
            growing.next_in_loop(child, at + 1)
        });
        for [node, link] in std::iter::once(growing.next_in_loop(u, 0)).chain(of_children) {
            bits.push(u64::from(node) | u64::from(link) << widths.node, widths.node + widths.link);
        }
        let code = self.code_start(vertex_end);
        bits.copy(&self.nodes, vertex_end, code);
        let count = children.len() as u32;
        let (width, own) = (width_of(count), packed.quartering_bits(count));
        // Several at a time: together they have at most 45 bits.
        let mut place = 0;
        for removers in growing.removers(u).chunks(5).filter(|_| count > 0) {
            let (mut several, mut taken) = (0, 0);
            for &child in removers {
                let quarterings = u64::from(growing.quarterings(u, place));
                several |= (u64::from(child) | quarterings << width) << taken;
                taken += width + own;
                place += 1;
            }
            bits.push(several, taken);
        }
        bits.copy(&self.nodes, code, end);
    }
}

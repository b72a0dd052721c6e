//! Vertex split and edge collapse on the current mesh [§4]: the updates of the compact edge-based MT.
//!
//! ```text
//!        x                x            The star of v is parted by a fan of triangles (v, x, y). A split turns each
//!       /|\              /|\           fan triangle into a tetrahedron (v', v'', x, y); the tetrahedra of side 0
//!      / | \     u+     / | \          keep v's slot, which becomes v', those of side 1 get a new slot for v''.
//!     0  v  1    ->    0 v'-v'' 1      A collapse is the exact inverse.
//!      \ | /     <-     \ | /
//!       \|/      u−      \|/
//!        y                y
//! ```
//!
//! The word that the mesh keeps with a vertex ([`KindWord`]) is the update that splits it, none if nothing does (yet).

use super::predict::Link;
use super::star::{FAN_CAPACITY, HalfStar, RING_CAPACITY, Ring};
use crate::mesh::NONE;
use crate::mt::error::Result;
use crate::mt::mesh::current::{KindWord, Labels};
use crate::mt::mesh::stars::{GATHERED, Gather};
use crate::mt::mesh::tet::{TURN, corner_of};
use crate::mt::{
    Applied, ApplyUpdates, CurrentMesh, EdgeMt, EdgeUpdate, ErrorCode, LookAtTet, MAX_LINK,
    MultiTessellation, UpdateError, UpdateId, UpdatePages, VertexId,
};
use std::ops::Range;

/// How far apart the halves of a vertex are: as in [`VertexSplit`](crate::mt::VertexSplit).
struct Offsets<'a> {
    offset: [i32; 3],
    field_offsets: &'a [i32],
}

impl EdgeMt {
    /// Applies update `u` (`u+`, a vertex split) to `mesh`, which must not contain it yet.
    ///
    /// # Errors
    /// If the update does not fit the mesh, which only happens to a damaged MT, or if the mesh was not updated by
    /// [`UpdatePages::updates_arrived`]; the mesh is unchanged then.
    fn split(&self, mesh: &mut CurrentMesh, u: UpdateId, ring: &mut Ring) -> Result<Applied> {
        if !self.has(u) {
            return Err(UpdateError::Missing { update: u.0 });
        }
        let update = self.update_without_levels(u);
        let vertex = update.vertex;
        let Some(p) = mesh.slot(vertex) else {
            let error = UpdateError::Vertex { update: u.0, vertex: vertex.0 };
            return Ok(Applied::Blocked(self.created_by(vertex).ok_or(error)?));
        };
        if mesh.labels[p as usize].kind_word != KindWord(u.0) {
            // The labels of such a mesh do not show what is feasible.
            return Err(UpdateError::UnknownToMesh { update: u.0 });
        }
        let mut field_offsets = std::mem::take(&mut ring.field_offsets);
        field_offsets.clear();
        field_offsets.extend(self.level_residuals(u));
        let applied = self.split_ring(mesh, u, &update, p, ring, &mut field_offsets);
        ring.field_offsets = field_offsets;
        applied
    }

    fn split_ring(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        stored: &EdgeUpdate<'_>,
        p: u32,
        ring: &mut Ring,
        field_offsets: &mut [i32],
    ) -> Result<Applied> {
        let update = u.0;
        match mesh.gather_ring(p, update, ring) {
            Ok(()) => {}
            Err(Gather::TooLarge) => return Err(UpdateError::Star { update }),
            Err(Gather::Stopped(first)) => return Ok(Applied::Blocked(UpdateId(first))),
        }
        if ring.link_len > MAX_LINK || mesh.is_pinched(p) {
            return Err(UpdateError::Star { update });
        }
        let mut link = Link::new(ring, mesh, mesh.positions[p as usize]);
        let mut offset = stored.offset_residual;
        if stored.edge != 0 {
            let step = link.step(ring, stored.edge).ok_or(UpdateError::Edge { update })?;
            offset = [0, 1, 2].map(|k| step[k].saturating_add(offset[k]));
        }
        link.set_offset(ring, offset);
        link.guess_levels(ring, mesh, p, offset, &self.info().fields, |field, guess| {
            field_offsets[field] = field_offsets[field].saturating_add(guess);
        });
        let parted = link.part(ring, stored.wrong_sides);
        if !parted || !ring.find_fan() {
            return Err(UpdateError::Mask { update });
        }
        let split = &Offsets { offset, field_offsets };
        let halves = self.halve(mesh, u, split, p)?;
        if !mesh.is_proven(update) {
            if !ring.is_positive(mesh, halves, self.info().lattice.bits) {
                return Err(UpdateError::Inverted { update });
            }
            mesh.set_proven(update);
        }
        self.perform_split(mesh, u, split, p, ring, halves);
        Ok(Applied::Done)
    }

    /// Positions of `v'` and `v''`, checked against the lattices like the levels.
    fn halve(&self, mesh: &CurrentMesh, u: UpdateId, split: &Offsets<'_>, p: u32) -> Result<[[i32; 3]; 2]> {
        let off = UpdateError::OffLattice { update: u.0 };
        let largest = 1_i64 << self.info().lattice.bits;
        let mut positions = [[0; 3]; 2];
        let coordinates = mesh.positions[p as usize].into_iter().zip(split.offset);
        for (axis, (coordinate, offset)) in coordinates.enumerate() {
            let halves = half(coordinate, offset, largest);
            [positions[0][axis], positions[1][axis]] = halves.ok_or(off.clone())?;
        }
        let fields = self.info().fields.iter().zip(mesh.levels(p)).zip(split.field_offsets);
        for ((field, &level), &offset) in fields {
            half(level, offset, (1 << field.bits) - 1).ok_or(off.clone())?;
        }
        Ok(positions)
    }

    fn perform_split(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        split: &Offsets<'_>,
        p: u32,
        ring: &Ring,
        halves: [[i32; 3]; 2],
    ) {
        let q = mesh.new_vertex();
        self.put_halves(mesh, u, split, [p, q], halves);
        let mut created = [NONE; FAN_CAPACITY];
        mesh.new_tets(&mut created[..ring.fan_len]);
        for (triangle, &t) in ring.fan[..ring.fan_len].iter().zip(&created) {
            let i = triangle.near as usize % RING_CAPACITY;
            let (near, far) = (ring.tets[i], ring.tets[triangle.far as usize % RING_CAPACITY]);
            let centre = ring.turn[i][0] as usize & 3;
            let [j, k, l] = triangle.corners.map(|corner| corner as usize & 3);
            // v'' goes where v was and v' opposite the fan triangle: the mirror image of the near tetrahedron.
            let mut tet = mesh.tets[near as usize];
            (tet[centre], tet[j]) = (q, p);
            mesh.tets[t as usize] = tet;
            let [start, end] = triangle.ends.map(|x| x as usize % MAX_LINK);
            // The face opposite one link vertex holds the other.
            let mut around = [NONE; 4];
            (around[centre], around[j]) = (near, far);
            around[k] = created[ring.after[end] as usize % FAN_CAPACITY];
            around[l] = created[ring.before[start] as usize % FAN_CAPACITY];
            mesh.neighbors[t as usize] = around;
            mesh.neighbors[near as usize][j] = t;
            mesh.mark_tet(near);
            mesh.relink(far, near, t);
        }
        mesh.touch(&ring.tets[..ring.len]);
        mesh.touch(&created[..ring.fan_len]);
        mesh.incident[p as usize] = ring.tets[(!ring.sides).trailing_zeros() as usize % RING_CAPACITY];
        mesh.incident[q as usize] = ring.tets[ring.sides.trailing_zeros() as usize % RING_CAPACITY];
        let mut rest = ring.sides;
        while rest != 0 {
            let i = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            mesh.tets[ring.tets[i] as usize][ring.turn[i][0] as usize & 3] = q;
            mesh.mark_tet(ring.tets[i]);
        }
    }

    /// Puts `v'` and `v''` with their levels into the slots `[p, q]`; `p` holds `v` so far.
    #[inline]
    fn put_halves(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        split: &Offsets<'_>,
        [p, q]: [u32; 2],
        halves: [[i32; 3]; 2],
    ) {
        let (created, splits) = (self.created(u), self.splits_of_created(u));
        for (i, slot) in [p, q].into_iter().enumerate() {
            let labels = Labels { vertex: created[i].0, kind_word: KindWord(splits[i]) };
            mesh.put_vertex(slot, labels, halves[i]);
        }
        for (f, &offset) in split.field_offsets.iter().enumerate() {
            let [at_p, at_q] = [p, q].map(|slot| slot as usize * mesh.fields + f);
            mesh.levels[at_q] = mesh.levels[at_p] - (offset >> 1);
            mesh.levels[at_p] = mesh.levels[at_q] + offset;
        }
    }

    #[inline]
    fn labels(&self, vertex: VertexId) -> Labels {
        let kind_word = self.split_by(vertex).map_or(KindWord::NONE, |u| KindWord(u.0));
        Labels { vertex: vertex.0, kind_word }
    }

    /// Undoes update `u` (`u−`, an edge collapse) in `mesh`, which must contain it.
    ///
    /// # Errors
    /// Never for an update that was applied to this mesh by [`Self::split`].
    fn collapse(&self, mesh: &mut CurrentMesh, u: UpdateId, ring: &mut Ring) -> Result<Applied> {
        let [p, q] = match self.collapsible(mesh, u, ring)? {
            Ok(slots) => slots,
            Err(child) => return Ok(Applied::Blocked(child)),
        };
        let [near, far] = &ring.halves;
        mesh.touch(near.tets());
        mesh.touch(far.tets());
        let mut fan = [NONE; GATHERED];
        let mut fan_len = 0;
        for &t in far.tets() {
            let tet = mesh.tets[t as usize];
            // Which are of the fan is a coin toss for the processor.
            let at_both = tet.iter().fold(false, |found, &v| found | (v == p));
            mesh.tets[t as usize] = tet.map(|v| if (v == q) & !at_both { p } else { v });
            mesh.mark_tet(t);
            fan[fan_len % GATHERED] = t;
            fan_len += usize::from(at_both);
        }
        fan[..fan_len].iter().for_each(|&t| close_fan(mesh, t, [p, q]));
        for f in 0..mesh.fields {
            let [at_p, at_q] = [p, q].map(|slot| slot as usize * mesh.fields + f);
            mesh.levels[at_p] = midway(mesh.levels[at_p], mesh.levels[at_q]);
        }
        let position = middle(mesh, [p, q]);
        let far_vertex = mesh.labels[q as usize].vertex;
        mesh.slot_of.set(far_vertex, NONE);
        mesh.free_vertex(q);
        mesh.put_vertex(p, self.labels(self.split_vertex(u)), position);
        Ok(Applied::Done)
    }

    /// The slots of `v'` and `v''` if update `u` can be undone, with their stars in the ring; else a child that is in
    /// the way.
    fn collapsible(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        ring: &mut Ring,
    ) -> Result<Result<[u32; 2], UpdateId>> {
        let update = u.0;
        if !self.has(u) {
            return Err(UpdateError::Missing { update });
        }
        let mut slots = [NONE; 2];
        for (slot, vertex) in slots.iter_mut().zip(self.created(u)) {
            match (mesh.slot(vertex), self.split_by(vertex)) {
                (Some(s), _) => *slot = s,
                (None, Some(child)) => return Ok(Err(child)),
                (None, None) => return Err(UpdateError::Vertex { update, vertex: vertex.0 }),
            }
        }
        for (slot, half) in slots.into_iter().zip(&mut ring.halves) {
            // A vertex born after u next to v' or v'' was made by an update that depends on u.
            let own = self.created(u)[1].0;
            let newest = mesh.gather_half(slot, own, half);
            if newest > own {
                let child = self.created_by(VertexId(newest));
                return Ok(Err(child.ok_or(UpdateError::Vertex { update, vertex: newest })?));
            }
            if half.is_too_large() {
                return Err(UpdateError::Star { update });
            }
        }
        Ok(Ok(slots))
    }
}

/// Shows `look` the tetrahedra of two half stars as they were before their centres came apart, until it returns true.
fn look_at_halves(mesh: &CurrentMesh, [p, q]: [u32; 2], [near, far]: &[HalfStar; 2], look: LookAtTet<'_>) {
    let position = middle(mesh, [p, q]);
    for (half, centre, other) in [(near, p, q), (far, q, p)] {
        for tet in half.tets().iter().map(|&t| mesh.tets[t as usize]) {
            if tet.contains(&other) {
                continue;
            }
            let corners = tet.map(|v| if v == centre { position } else { mesh.positions[v as usize] });
            let levels = |field: usize| {
                let level = midway(mesh.levels(p)[field], mesh.levels(q)[field]);
                tet.map(|v| if v == centre { level } else { mesh.levels(v)[field] })
            };
            if look(&corners, &levels, 0, 0) {
                return;
            }
        }
    }
}

/// Where the vertex lies that became those in slots `[p, q]`.
#[inline]
fn middle(mesh: &CurrentMesh, [p, q]: [u32; 2]) -> [i32; 3] {
    let [a, b] = [p, q].map(|slot| mesh.positions[slot as usize]);
    [0, 1, 2].map(|k| midway(a[k], b[k]))
}

/// Removes fan tetrahedron `t`, which has both `v'` and `v''`, in slots `[p, q]`: its two neighbours at the fan
/// triangle become neighbours of each other.
#[inline]
fn close_fan(mesh: &mut CurrentMesh, t: u32, [p, q]: [u32; 2]) {
    let (tet, around) = (mesh.tets[t as usize], mesh.neighbors[t as usize]);
    let [i, j, k, l] = TURN[(4 * corner_of(&tet, p) + corner_of(&tet, q)) % 16].map(|c| c as usize & 3);
    let (far, near) = (around[i], around[j]);
    mesh.relink(far, t, near);
    mesh.relink(near, t, far);
    for v in [p, tet[k], tet[l]] {
        mesh.incident[v as usize] = near;
    }
    mesh.free_tet(t);
}

/// The level, or the coordinate, of `v` between those of `v'` and `v''`, which are not below 0.
#[inline]
fn midway(a: i32, b: i32) -> i32 {
    b + ((a - b) >> 1)
}

/// The two halves `[a, b]` of lattice value `v` under offset `d`: `b = v − (d >> 1)`, `a = b + d`, both in
/// `0 ..= largest`.
#[inline]
fn half(v: i32, d: i32, largest: i64) -> Option<[i32; 2]> {
    let b = i64::from(v) - i64::from(d >> 1);
    let a = b + i64::from(d);
    let holds = |x: i64| 0 <= x && x <= largest;
    (holds(a) && holds(b)).then_some([a as i32, b as i32])
}

impl UpdatePages for EdgeMt {
    fn page_bits(&self) -> u32 {
        self.page_bits
    }

    fn set_to_come(&mut self, bounds: &[ErrorCode]) {
        self.to_come.clear();
        if self.updates() < self.info.updates {
            self.to_come.extend_from_slice(bounds);
        }
    }

    fn page_inserted(&self, mesh: &mut CurrentMesh, updates: Range<u32>) {
        for u in updates.map(UpdateId).filter(|u| self.has(*u)) {
            if let Some(slot) = mesh.slot(self.split_vertex(u)) {
                mesh.labels[slot as usize].kind_word = KindWord(u.0);
                mesh.touch_star(slot);
            }
        }
    }
}

impl ApplyUpdates for EdgeMt {
    #[inline]
    fn remover(&self, mesh: &CurrentMesh, t: u32) -> Option<UpdateId> {
        let first = mesh.tets[t as usize].iter().map(|&v| mesh.labels[v as usize].kind_word.0).min();
        first.filter(|&s| s != NONE).map(UpdateId)
    }

    #[inline]
    fn creator(&self, mesh: &CurrentMesh, t: u32) -> Option<UpdateId> {
        mesh.tets[t as usize].iter().filter_map(|&v| self.created_by(mesh.vertex(v))).max()
    }

    fn find_removed(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Vec<u32>> {
        if !self.has(u) {
            return Err(UpdateError::Missing { update: u.0 });
        }
        mesh.find_star(u, self.split_vertex(u))
    }

    fn find_inserted(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Vec<u32>> {
        let [near, far] = self.created(u);
        let mut found = mesh.find_star(u, near)?;
        let of_far = mesh.find_star(u, far)?;
        let near = mesh.slot(near).unwrap_or(NONE);
        // Those at both ends are there already.
        found.extend(of_far.into_iter().filter(|&t| !mesh.tets[t as usize].contains(&near)));
        Ok(found)
    }

    #[inline]
    fn may_coarsen(&self, mesh: &CurrentMesh, u: UpdateId) -> bool {
        self.created(u).iter().all(|&v| mesh.slot(v).is_some())
    }

    fn refine(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied> {
        mesh.with_kind_state(|mesh, ring| self.split(mesh, u, ring))
    }

    fn coarsen(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied> {
        mesh.with_kind_state(|mesh, ring| self.collapse(mesh, u, ring))
    }

    fn look_at_removed(&self, mesh: &mut CurrentMesh, u: UpdateId, look: LookAtTet<'_>) -> Result<Applied> {
        mesh.with_kind_state(|mesh, ring| {
            let slots = match self.collapsible(mesh, u, ring)? {
                Ok(slots) => slots,
                Err(child) => return Ok(Applied::Blocked(child)),
            };
            look_at_halves(mesh, slots, &ring.halves, look);
            Ok(Applied::Done)
        })
    }

    fn site(&self, mesh: &CurrentMesh, u: UpdateId) -> [i32; 3] {
        // One of the vertices that the one to be split comes from, or of those that come from what it becomes.
        let (mut above, mut below) = (Some(u), Some(u));
        while above.is_some() || below.is_some() {
            let coarse = above.map(|u| self.split_vertex(u));
            let fine = below.map(|u| self.created(u)[0]);
            if let Some(slot) = [coarse, fine].into_iter().flatten().find_map(|v| mesh.slot(v)) {
                return mesh.positions[slot as usize];
            }
            // Numbers fall on the way up and rise on the way down.
            above = coarse.and_then(|v| self.created_by(v));
            below = fine.and_then(|v| self.split_by(v));
        }
        [0; 3]
    }
}

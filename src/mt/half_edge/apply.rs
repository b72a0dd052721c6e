//! Insertion and removal of vertices of a [`HalfEdgeMt`] on the current mesh.
//!
//! In the current mesh the tag of a tetrahedron is the update that removes it, and its inner faces are those that go with
//! it. Insertion keeps the slots of T_u, removal those of the star without the near vertex.

use super::new_star::{MOST, NEW};
use super::scratch::Scratch;
use super::star_code::{KnownStars, StarCode};
use super::store::{BaseMark, HalfEdgeMt, HalfEdgeUpdate};
use crate::geom::orient3d;
use crate::mesh::NONE;
use crate::mt::error::Result;
use crate::mt::mesh::KindState;
use crate::mt::mesh::current::{KindWord, Labels};
use crate::mt::mesh::stars::{Gather, Star};
use crate::mt::mesh::tet::corner_of;
use crate::mt::pages::Page;
use crate::mt::regions::further_regions;
use crate::mt::{
    Applied, ApplyUpdates, BaseMeshError, CurrentMesh, ErrorCode, LookAtTet, MultiTessellation, PageError,
    UpdateError, UpdateId, UpdatePages, VertexId,
};
use std::ops::Range;

/// What the current mesh carries for a half-edge MT.
#[derive(Clone, Debug, Default)]
struct State {
    scratch: Scratch,
    code: StarCode,
    known: KnownStars,
}

impl KindState for State {
    fn bytes(&self) -> u64 {
        size_of_val(self) as u64 + self.known.bytes()
    }

    fn is_of_updates(&self) -> bool {
        true
    }
}

/// How far to go to name an update that has to come first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Search {
    /// Around the near vertex.
    Nearby,
    /// Through all updates before, which takes as long as applying them.
    Everywhere,
}

impl HalfEdgeMt {
    /// Collects T_u, or returns what has to be applied first.
    fn collect_removed(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        search: Search,
        scratch: &mut Scratch,
    ) -> Result<Applied> {
        let update = u.0;
        let torn = UpdateError::Cavity { update };
        if !self.has(u) {
            return Err(UpdateError::Missing { update });
        }
        let near = self.near(u).ok_or(UpdateError::Missing { update })?;
        let Some(slot) = mesh.slot(near) else {
            let before = self.inserted_by(near).ok_or(torn)?;
            return Ok(Applied::Blocked(before));
        };
        if mesh.slot(self.vertex(u)).is_some() {
            return Err(torn);
        }
        let first = match mesh.tagged(update) {
            Some(t) => t,
            None => match self.find_tagged(mesh, u, slot, search)? {
                Ok(t) => t,
                Err(blocking) => return Ok(Applied::Blocked(blocking)),
            },
        };
        mesh.collect_tagged(update, slot, first, scratch)
    }

    /// A tetrahedron of T_u, if one is in the mesh; else what has to be applied before one can be.
    #[cold]
    fn find_tagged(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        slot: u32,
        search: Search,
    ) -> Result<Result<u32, UpdateId>> {
        let mut star = Vec::new();
        mesh.list_star(slot, &mut star);
        if let Some(&t) = star.iter().find(|&&t| mesh.tag(t) == u.0) {
            return Ok(Ok(t));
        }
        let torn = UpdateError::Cavity { update: u.0 };
        let near = self.near(u).ok_or(torn.clone())?;
        let child = self.children_of(near).iter().find(|child| child.update == u.0).ok_or(torn.clone())?;
        // T_u will hold the direction in which the new vertex lies, if the domain does: what does so now has to go first.
        let mut holding = star.into_iter().filter(|&t| mesh.holds(t, slot, child.offset));
        if let Some(t) = holding.find(|&t| mesh.tag(t) < u.0) {
            return Ok(Err(UpdateId(mesh.tag(t))));
        }
        match search {
            Search::Nearby => Err(UpdateError::Missing { update: u.0 }),
            Search::Everywhere => self.find_parent(mesh, u).map(Err),
        }
    }

    /// A parent of `u` that is not in the mesh, found by applying all updates before `u` to another one.
    fn find_parent(&self, mesh: &CurrentMesh, u: UpdateId) -> Result<UpdateId> {
        let torn = UpdateError::Cavity { update: u.0 };
        let mut other = self.start().map_err(|_| torn.clone())?;
        let mut state = Box::<State>::default();
        for before in (0..u.0).map(UpdateId) {
            self.insert(&mut other, before, Search::Nearby, &mut state)?;
            other.clear_touched();
        }
        let scratch = &mut state.scratch;
        self.collect_removed(&mut other, u, Search::Nearby, scratch)?;
        let removed = &scratch.slots[..scratch.removed_len];
        let mut parents = removed.iter().filter_map(|&t| self.creator(&other, t));
        parents.find(|&p| mesh.slot(self.vertex(p)).is_none()).ok_or(torn)
    }

    /// Positions and levels of the new vertex.
    fn place_vertex(&self, mesh: &CurrentMesh, u: UpdateId, scratch: &mut Scratch) -> Result<[i32; 3]> {
        let off = UpdateError::OffLattice { update: u.0 };
        let near = mesh.vertex(scratch.link[0]);
        let children = self.children_of(near);
        let at = children.binary_search_by_key(&u.0, |child| child.update).map_err(|_| off.clone())?;
        let centre = mesh.positions[scratch.link[0] as usize];
        let offset = children[at].offset;
        let position = [0, 1, 2].map(|k| centre[k].saturating_add(offset[k]));
        let HalfEdgeUpdate { level_residuals: residuals, side_residuals, .. } =
            self.update(u).ok_or(UpdateError::Missing { update: u.0 })?;
        scratch.place(mesh, position);
        scratch.add_residuals(mesh, residuals, side_residuals).ok_or(off.clone())?;
        let mut rows = scratch.levels.chunks(mesh.fields);
        if rows.all(|levels| self.info().holds(position, levels)) { Ok(position) } else { Err(off) }
    }

    /// Gets ready to insert the vertex of `u`: star, position and levels are in the scratch space then, but not yet what
    /// removes the star.
    fn prepare(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        search: Search,
        scratch: &mut Scratch,
    ) -> Result<Result<[i32; 3], UpdateId>> {
        if let Applied::Blocked(before) = self.collect_removed(mesh, u, search, scratch)? {
            return Ok(Err(before));
        }
        scratch.find_star(mesh).ok_or(UpdateError::Cavity { update: u.0 })?;
        let position = self.place_vertex(mesh, u, scratch)?;
        // Each time: what a damaged file says of removers may give an update another T_u when other pages are there.
        if !scratch.places.is_positive(&scratch.star[..scratch.star_len]) {
            return Err(UpdateError::Inverted { update: u.0 });
        }
        Ok(Ok(position))
    }

    fn insert(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        search: Search,
        state: &mut State,
    ) -> Result<Applied> {
        let State { scratch, code, known } = state;
        let position = match self.prepare(mesh, u, search, scratch)? {
            Ok(position) => position,
            Err(before) => return Ok(Applied::Blocked(before)),
        };
        scratch.hash_star(mesh, self.vertex(u).0);
        let found =
            if known.recall(u.0, scratch) { Some(()) } else { self.find_removers(mesh, u, scratch, code) };
        found.ok_or(UpdateError::Mask { update: u.0 })?;
        self.perform_insertion(mesh, u, position, scratch);
        Ok(Applied::Done)
    }

    /// A mesh to which updates can be applied, with what is known of its tetrahedra and, if the MT has regions, the region of each, and where
    /// fields jump the levels of its vertices in their further regions.
    pub(super) fn marked(
        &self,
        mut mesh: CurrentMesh,
        marks: &[BaseMark],
        regions: Option<(&[u16], &[i32])>,
    ) -> CurrentMesh {
        mesh.look_for_all_tags();
        mesh.tag_all(marks.iter().map(|mark| mark.remover));
        mesh.keep_tet_bytes(marks.iter().map(|mark| mark.inner).collect());
        mesh.whole_stars = true;
        if let Some((of_tets, levels)) = regions {
            mesh.regions = of_tets.to_vec();
            if let Some(jumps) = self.jumps() {
                mesh.keep_sides(jumps.to_vec());
                let further = further_regions(mesh.positions.len(), &mesh.tets, of_tets);
                let rows = levels.chunks(mesh.fields);
                let sides = further.into_iter().zip(rows);
                sides.for_each(|((v, region), levels)| mesh.add_side(v, region, levels));
                mesh.update_corners();
            }
        }
        mesh
    }

    pub(super) fn perform_insertion(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        position: [i32; 3],
        scratch: &mut Scratch,
    ) {
        let slot = mesh.new_vertex();
        mesh.put_vertex(slot, Labels { vertex: self.vertex(u).0, kind_word: KindWord::NONE }, position);
        let first = slot as usize * mesh.fields;
        let (own, sides) = scratch.levels.split_at(mesh.fields);
        mesh.levels[first..first + own.len()].copy_from_slice(own);
        for (&region, levels) in scratch.regions.iter().skip(1).zip(sides.chunks(mesh.fields)) {
            mesh.add_side(slot, region, levels);
        }
        let Scratch { slots, removed_len: moved, star, star_len: all, link, .. } = scratch;
        let (moved, all) = (*moved, *all);
        mesh.new_tets(&mut slots[moved..all]);
        link[usize::from(NEW)] = slot;
        mesh.forget_place(u.0);
        for (i, new) in star[..all].iter().enumerate() {
            let t = slots[i];
            let tet = new.corners.map(|corner| link[usize::from(corner)]);
            let mut around = new.across.map(|n| slots[usize::from(n)]);
            around[usize::from(new.own) & 3] = new.beyond;
            mesh.tets[t as usize] = tet;
            mesh.neighbors[t as usize] = around;
            if i >= moved {
                if new.beyond != NONE {
                    mesh.relink(new.beyond, new.source, t);
                }
                if let Some(&region) = mesh.regions.get(new.source as usize) {
                    mesh.regions[t as usize] = region;
                }
                tet.iter().for_each(|&v| mesh.incident[v as usize] = t);
            }
            mesh.set_new_tag(t, new.remover);
            mesh.set_tet_byte(t, new.inner);
            mesh.mark_tet(t);
        }
        mesh.incident[slot as usize] = slots[0];
        mesh.incident[link[0] as usize] = slots[moved];
        mesh.touch(&slots[..all]);
    }

    /// Collects the star of the vertex that `u` inserted. Tells its slot and that of the near vertex, or a child of `u` that
    /// has to go first.
    fn collect_inserted(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        star: &mut Star,
    ) -> Result<Result<[u32; 2], UpdateId>> {
        let vertex = self.vertex(u).0;
        let absent = UpdateError::Vertex { update: u.0, vertex };
        let slot = mesh.slot(VertexId(vertex)).ok_or(absent.clone())?;
        let younger = |labels: &[Labels], tet: &[u32; 4]| {
            tet.iter().map(|&v| labels[v as usize].vertex).find(|&v| v > vertex)
        };
        match mesh.gather_star(slot, star, younger) {
            Ok(()) => {}
            Err(Gather::TooLarge) => return Err(UpdateError::Star { update: u.0 }),
            Err(Gather::Stopped(v)) => return Ok(Err(self.inserted_by(VertexId(v)).ok_or(absent)?)),
        }
        let near = self.near(u).and_then(|near| mesh.slot(near)).ok_or(absent)?;
        Ok(Ok([slot, near]))
    }

    fn remove(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        State { scratch, known, .. }: &mut State,
    ) -> Result<Applied> {
        let star = &mut scratch.gathered;
        let [slot, near] = match self.collect_inserted(mesh, u, star)? {
            Ok(slots) => slots,
            Err(child) => return Ok(Applied::Blocked(child)),
        };
        known.keep(u.0, &star.tets[..star.len], mesh);
        let (mut gone, mut gone_len) = ([NONE; MOST], 0);
        for (&t, &at) in star.tets[..star.len].iter().zip(&star.corner) {
            let (mut tet, mut around) = (mesh.tets[t as usize], mesh.neighbors[t as usize]);
            if tet.contains(&near) {
                gone[gone_len] = t;
                gone_len += 1;
                continue;
            }
            let at = at as usize & 3;
            tet[at] = near;
            let mut inner = 0;
            for face in (0..4).filter(|&face| face != at) {
                let n = around[face];
                // A tetrahedron at the edge to the near vertex fills a gap; what lies beyond it is the neighbour again.
                let gap = if n == NONE { None } else { Some(mesh.tets[n as usize]) };
                match gap.filter(|gap| gap.contains(&near) && gap.contains(&slot)) {
                    Some(gap) => {
                        let beyond = mesh.neighbors[n as usize][corner_of(&gap, slot)];
                        around[face] = beyond;
                        if beyond != NONE {
                            mesh.relink(beyond, n, t);
                        }
                    }
                    None => inner |= 1 << face,
                }
            }
            mesh.tets[t as usize] = tet;
            mesh.neighbors[t as usize] = around;
            mesh.set_tag(t, u.0);
            mesh.set_tet_byte(t, inner);
            mesh.mark_tet(t);
            tet.iter().for_each(|&v| mesh.incident[v as usize] = t);
        }
        mesh.touch(&star.tets[..star.len]);
        gone[..gone_len].iter().for_each(|&t| mesh.free_tet(t));
        mesh.remove_vertex(slot);
        Ok(Applied::Done)
    }
}

impl CurrentMesh {
    /// Collects T_u from one of its tetrahedra on, given the slot of the near vertex, or returns what has to be applied first.
    pub(super) fn collect_tagged(
        &mut self,
        update: u32,
        slot: u32,
        first: u32,
        scratch: &mut Scratch,
    ) -> Result<Applied> {
        let torn = || UpdateError::Cavity { update };
        self.next_epoch();
        self.number_tet(first, 0);
        scratch.slots[0] = first;
        let (mut next, mut len) = (0, 1);
        while next < len {
            let t = scratch.slots[next % MOST];
            let (tet, around, inner) = (self.tets[t as usize], self.neighbors[t as usize], self.tet_byte(t));
            let at = corner_of(&tet, slot);
            if tet[at] != slot {
                return Err(torn());
            }
            let inner = inner & !(1 << at);
            for (face, n) in around.into_iter().enumerate() {
                // What goes and what is new is a coin toss for the processor: where nothing is to be done, it is done for `t` again.
                let goes = u32::from(inner >> face & 1 == 1 && n != NONE).wrapping_neg();
                let n = n & goes | t & !goes;
                let tag = self.tag(n);
                if tag != update {
                    if tag >= update {
                        return Err(torn());
                    }
                    self.place_tag(n);
                    return Ok(Applied::Blocked(UpdateId(tag)));
                }
                let is_new = self.number_tet(n, len as u32 % MOST as u32).is_none();
                if len == MOST && is_new {
                    return Err(torn());
                }
                scratch.slots[len % MOST] = if len == MOST { first } else { n };
                len += usize::from(is_new);
            }
            next += 1;
        }
        scratch.removed_len = len;
        scratch.link[0] = slot;
        Ok(Applied::Done)
    }

    /// Whether a direction from the corner in `slot` of tetrahedron `t` leads into it, or along a face.
    fn holds(&self, t: u32, slot: u32, direction: [i32; 3]) -> bool {
        let at = corner_of(&self.tets[t as usize], slot);
        let corners = self.tets[t as usize].map(|v| self.positions[v as usize]);
        let point = [0, 1, 2].map(|k| corners[at][k].saturating_add(direction[k]));
        let largest = 1 << crate::geom::WIDE_BITS;
        let inside = |face: usize| {
            let mut with = corners;
            with[face] = point;
            orient3d(with[0], with[1], with[2], with[3]) >= 0
        };
        point.iter().all(|x| (0..=largest).contains(x)) && (0..4).all(|face| face == at || inside(face))
    }
}

impl UpdatePages for HalfEdgeMt {
    #[inline]
    fn has(&self, u: UpdateId) -> bool {
        self.pages.has(u)
    }

    fn present(&self) -> u32 {
        self.pages.present()
    }

    fn set_to_come(&mut self, bounds: &[ErrorCode]) {
        self.pages.set_to_come(bounds);
    }

    fn page_bits(&self) -> u32 {
        self.pages.bits()
    }

    fn has_page(&self, page: u32) -> bool {
        self.pages.get(page).is_some()
    }

    fn page_bytes(&self) -> u64 {
        self.pages.bytes()
    }

    fn bytes_of_page(&self, page: u32) -> u64 {
        let likely = || self.pages.updates_of(page).len() as u64 * self.update_bytes();
        self.pages.get(page).map_or_else(likely, |page| page.bytes() as u64)
    }

    fn remove_page(&mut self, page: u32) -> Result<(), PageError> {
        let gone = self.pages.remove(page).ok_or(PageError::Absent { page })?;
        self.facts = None;
        self.forget_children(gone.children.items());
        Ok(())
    }

    fn update_bytes(&self) -> u64 {
        40 + 6 * self.info().fields.len() as u64
    }

    #[inline]
    fn awaited(&self, mesh: &CurrentMesh, t: u32) -> Option<UpdateId> {
        Some(UpdateId(mesh.tag(t))).filter(|&u| u.0 != NONE && !self.has(u))
    }

    fn awaited_errors(&self, mesh: &CurrentMesh, t: u32) -> Option<&[ErrorCode]> {
        match mesh.tag(t) {
            NONE => Some(&self.zeros),
            u if self.has(UpdateId(u)) => None,
            u => Some(self.bounds_of(UpdateId(u))),
        }
    }

    /// Tetrahedra know what removes them from the moment they are created: whoever waits for an update asks
    /// [`UpdatePages::awaited`].
    fn page_inserted(&self, _: &mut CurrentMesh, _: Range<u32>) {}

    fn page_evicted(&self, mesh: &mut CurrentMesh, updates: Range<u32>) {
        let vertices = updates.start..updates.end;
        let base = self.vertex(UpdateId(0)).0;
        mesh.forget_vertices(vertices.start + base..vertices.end + base);
        if let Some(mut state) = mesh.take_kind_state::<State>() {
            state.known.forget(updates);
            mesh.put_back_kind_state(state);
        }
    }
}

impl ApplyUpdates for HalfEdgeMt {
    fn start(&self) -> Result<CurrentMesh, BaseMeshError> {
        let mesh = CurrentMesh::new(self.info(), self.base())?;
        let regions = self.regions();
        Ok(self.marked(
            mesh,
            self.base_marks(),
            regions.map(|regions| (&regions.of_base[..], &regions.sides.levels[..])),
        ))
    }

    #[inline]
    fn remover(&self, mesh: &CurrentMesh, t: u32) -> Option<UpdateId> {
        Some(UpdateId(mesh.tag(t))).filter(|&u| self.has(u))
    }

    #[inline]
    fn start_at(&self, mesh: &mut CurrentMesh, t: u32) {
        mesh.place_tag(t);
    }

    #[inline]
    fn creator(&self, mesh: &CurrentMesh, t: u32) -> Option<UpdateId> {
        self.inserted_by(mesh.newest_vertex(t))
    }

    #[inline]
    fn may_coarsen(&self, mesh: &CurrentMesh, u: UpdateId) -> bool {
        mesh.is_newest_nearby(self.vertex(u))
    }

    fn refine(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied> {
        mesh.with_kind_state(|mesh, state| self.insert(mesh, u, Search::Everywhere, state))
    }

    fn refine_marked(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied> {
        mesh.with_kind_state(|mesh, state| self.insert(mesh, u, Search::Nearby, state))
    }

    fn coarsen(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied> {
        mesh.with_kind_state(|mesh, state| self.remove(mesh, u, state))
    }

    fn look_at_removed(&self, mesh: &mut CurrentMesh, u: UpdateId, look: LookAtTet<'_>) -> Result<Applied> {
        mesh.with_kind_state(|mesh, State { scratch: Scratch { gathered: star, .. }, .. }| {
            let [slot, near] = match self.collect_inserted(mesh, u, star)? {
                Ok(slots) => slots,
                Err(child) => return Ok(Applied::Blocked(child)),
            };
            for &t in &star.tets[..star.len] {
                let tet = mesh.tets[t as usize];
                if tet.contains(&near) {
                    continue;
                }
                let region = mesh.region(t);
                let tet = tet.map(|v| mesh.side(if v == slot { near } else { v }, region));
                let levels = |field: usize| tet.map(|v| mesh.levels(v)[field]);
                if look(&tet.map(|v| mesh.positions[v as usize]), &levels, 0, region) {
                    break;
                }
            }
            Ok(Applied::Done)
        })
    }

    fn find_removed(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Vec<u32>> {
        mesh.with_kind_state(|mesh, State { scratch, .. }| {
            match self.collect_removed(mesh, u, Search::Everywhere, scratch)? {
                Applied::Done => Ok(scratch.slots[..scratch.removed_len].to_vec()),
                Applied::Blocked(_) => Err(UpdateError::Error { update: u.0 }),
            }
        })
    }

    fn find_inserted(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Vec<u32>> {
        mesh.find_star(u, self.vertex(u))
    }
}

//! Vertex insertion and removal on the current mesh [§5]: the updates of the compact vertex-based MT.
//!
//! In the current mesh, the tag of a tetrahedron is the update that removes it. While that update has not arrived, the
//! tag is the number of that child of the tetrahedron's creator.

use super::bit_string::width_of;
use super::cavity::{Cavity, SLOTS, Wall};
use super::cavity_fill::{Across, Close, Face, turned};
use super::limits::{COUNT_BITS, MAX_AROUND, MAX_INSERTED};
use super::shape_code::{Code, write_given_up};
use super::sphere_order::Spheres;
use super::store::VertexMt;
use super::streaming::Insertion;
use super::tet_errors::{Packed, QUARTERING_BITS};
use crate::geom::{NARROW_BITS, orient3d};
use crate::mesh::NONE;
use crate::mt::error::Result;
use crate::mt::mesh::FIRST_ANONYMOUS_TAG;
use crate::mt::mesh::current::{KindWord, Labels};
use crate::mt::mesh::stars::{GATHERED, Gather};
use crate::mt::{
    Applied, ApplyUpdates, BaseMeshError, CurrentMesh, ErrorCode, LookAtTet, MultiTessellation, PagedArray,
    UpdateError, UpdateId, UpdatePages, VertexId,
};
use std::ops::Range;

/// To look around a vertex for what an update removes takes as much as to look at so many tetrahedra.
const SITE_COST: usize = 128;

/// Where the parts of a node's shape are.
#[derive(Clone, Copy, Debug)]
struct Shape {
    children: u32,
    removed: usize,
    boundary: bool,
    /// Where the bits are that say which boundary faces of T_u are given up, and how many.
    given_up: u64,
    given_up_len: u32,
    /// Where the removers of the star are, and how wide; each has the quarterings of its tetrahedron behind it.
    removers: u64,
    remover_width: u32,
    quartering_bits: u32,
}

impl Shape {
    /// Where the remover at a place of the star is.
    #[inline]
    fn remover(&self, place: u64) -> u64 {
        self.removers + place * u64::from(self.remover_width + self.quartering_bits)
    }

    /// Where the quarterings there are.
    #[inline]
    fn quarterings(&self, place: u64) -> u64 {
        self.remover(place) + u64::from(self.remover_width)
    }
}

impl VertexMt {
    #[inline]
    fn shape(&self, u: UpdateId) -> Shape {
        let start = self.node_start(u.0);
        // While the MT grows, links and removers are elsewhere.
        let (at, children) = match &self.growing {
            Some(_) => (start + u64::from(self.widths.vertex), 0),
            None => {
                let children = self.children(u);
                (self.links_end(start, children), children)
            }
        };
        let removed = self.nodes.get(at, COUNT_BITS) as usize;
        let boundary = self.nodes.get(at + u64::from(COUNT_BITS), 1) == 1;
        let mut at = at + u64::from(COUNT_BITS) + 1;
        let mut given_up_len = 0;
        if boundary {
            given_up_len = self.nodes.get(at, COUNT_BITS) as u32;
            at += u64::from(COUNT_BITS);
        }
        Shape {
            children,
            removed,
            boundary,
            given_up: at,
            given_up_len,
            removers: at + u64::from(given_up_len),
            remover_width: width_of(children),
            quartering_bits: self.quartering_bits(children),
        }
    }

    /// Bits of the quarterings of each tetrahedron that an update with so many children creates.
    #[inline]
    pub(in crate::mt) fn quartering_bits(&self, children: u32) -> u32 {
        if self.base_quarterings.is_some() && children > 0 { QUARTERING_BITS } else { 0 }
    }

    /// Collects T_u. Tells a parent that has to be applied first, if T_u is not complete.
    #[inline]
    fn gather_removed(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        removed: usize,
        cavity: &mut Cavity,
    ) -> Result<Applied> {
        let Cavity { tets, bare, .. } = cavity;
        let gathered = mesh.tagged(u.0).and_then(|first| mesh.gather_tagged(first, u.0, tets, bare));
        let (found, bare_len) = gathered.unwrap_or((0, 0));
        if found != removed {
            let missing = self.parents(u).find(|&p| mesh.slot(self.vertex(p)).is_none());
            return missing.map(Applied::Blocked).ok_or(UpdateError::Cavity { update: u.0 });
        }
        (cavity.tets_len, cavity.bare_len) = (removed, bare_len);
        Ok(Applied::Done)
    }

    fn insert(&self, mesh: &mut CurrentMesh, u: UpdateId, cavity: &mut Cavity) -> Result<Applied> {
        let torn = UpdateError::Cavity { update: u.0 };
        let shape = self.shape(u);
        if let blocked @ Applied::Blocked(_) = self.gather_removed(mesh, u, shape.removed, cavity)? {
            return Ok(blocked);
        }
        if mesh.slot(self.vertex(u)).is_some() {
            return Err(torn);
        }
        let count = shape.boundary.then_some(shape.given_up_len as usize);
        let mut is_given_up = |place: usize, _| self.nodes.get(shape.given_up + place as u64, 1) == 1;
        cavity.find_walls(mesh, count, &mut is_given_up).ok_or(torn.clone())?;
        let position = self.position(u);
        if !cavity.is_star_positive(mesh, position, self.info.lattice.bits <= NARROW_BITS) {
            return Err(UpdateError::Inverted { update: u.0 });
        }
        self.find_tags(mesh, u, &shape, cavity)?;
        self.perform_insertion(mesh, u, position, cavity);
        Ok(Applied::Done)
    }

    /// Finds which update removes each tetrahedron of the new star.
    #[inline]
    fn find_tags(&self, mesh: &CurrentMesh, u: UpdateId, shape: &Shape, cavity: &mut Cavity) -> Result<()> {
        let walls = cavity.walls_len;
        if shape.children == 0 && self.growing.is_none() {
            cavity.tags[..walls].fill(NONE);
            cavity.quarterings[..walls].fill(0);
            return Ok(());
        }
        cavity.order_link(mesh);
        cavity.order_walls();
        if let Some(growing) = &self.growing {
            for (tag, &place) in cavity.tags[..walls].iter_mut().zip(&cavity.places) {
                *tag = growing.remover(u.0, place as usize).unwrap_or(FIRST_ANONYMOUS_TAG | place as u32);
            }
            for (own, &place) in cavity.quarterings[..walls].iter_mut().zip(&cavity.places) {
                *own = growing.quarterings(u.0, place as usize);
            }
            return Ok(());
        }
        let complete = self.updates() == self.info.updates;
        let mut children = [NONE; MAX_INSERTED + 1];
        for i in 1..=shape.children.min(MAX_INSERTED as u32) {
            children[i as usize] = match self.child(u, i) {
                Some(child) => child.0,
                None if complete => return Err(UpdateError::Cavity { update: u.0 }),
                None => FIRST_ANONYMOUS_TAG,
            };
        }
        for (tag, &place) in cavity.tags[..walls].iter_mut().zip(&cavity.places) {
            let child = self.nodes.get(shape.remover(place as u64), shape.remover_width) as usize;
            let child = *children.get(child).ok_or(UpdateError::Cavity { update: u.0 })?;
            *tag = if child == FIRST_ANONYMOUS_TAG { child | place as u32 } else { child };
        }
        for (own, &place) in cavity.quarterings[..walls].iter_mut().zip(&cavity.places) {
            *own = self.nodes.get(shape.quarterings(place as u64), shape.quartering_bits) as u8;
        }
        Ok(())
    }

    /// The quarterings of the tetrahedron at a place of the star that update `u` makes.
    fn quarterings_at(&self, u: UpdateId, place: u32) -> u8 {
        if let Some(growing) = &self.growing {
            return growing.quarterings(u.0, place as usize);
        }
        let shape = self.shape(u);
        self.nodes.get(shape.quarterings(u64::from(place)), shape.quartering_bits) as u8
    }

    /// Keeps the quarterings of T_u with the vertex that takes its place.
    fn keep_quarterings(&self, mesh: &CurrentMesh, u: UpdateId, cavity: &mut Cavity) {
        let Some(replaced) = &mut cavity.replaced else { return };
        let by_labels = |&t: &u32| {
            let mut tet = mesh.tets[t as usize].map(|v| mesh.labels[v as usize].vertex);
            tet.sort_unstable();
            (tet, u32::from(mesh.tet_byte(t)))
        };
        let mut all: Vec<([u32; 4], u32)> = cavity.tets[..cavity.tets_len].iter().map(by_labels).collect();
        all.sort_unstable();
        let mut packed = Packed::default();
        all.iter().enumerate().for_each(|(place, (_, own))| packed.set(place, *own as u8));
        replaced.set(self.vertex(u).0, packed);
    }

    /// The quarterings of the tetrahedra of T_u that were built; none if they are not kept.
    fn kept_quarterings(&self, u: UpdateId, cavity: &Cavity) -> Option<[u8; GATHERED]> {
        let Cavity { fill, replaced, .. } = cavity;
        let packed = replaced.as_ref()?.get(self.vertex(u).0);
        // Numbers are in the order of labels.
        let sorted = |(i, tet): (usize, &[u8; 4])| {
            let mut tet = *tet;
            tet.sort_unstable();
            u64::from(u32::from_be_bytes(tet)) << 32 | i as u64
        };
        let mut all: Vec<u64> = fill.tets[..fill.len].iter().enumerate().map(sorted).collect();
        all.sort_unstable();
        let mut kept = [0; GATHERED];
        all.iter().enumerate().for_each(|(place, key)| kept[*key as usize % GATHERED] = packed.get(place));
        Some(kept)
    }

    /// The update that removes the tetrahedron at a place of the star that update `u` makes, if it is here.
    fn remover_at(&self, u: UpdateId, place: u32) -> Option<u32> {
        if let Some(growing) = &self.growing {
            return growing.remover(u.0, place as usize);
        }
        let shape = self.shape(u);
        let child = self.nodes.get(shape.remover(u64::from(place)), shape.remover_width) as u32;
        self.child(u, child).filter(|_| child > 0).map(|child| child.0)
    }

    /// Marks tetrahedra around the parents of new updates with these. False if others may be left, or to look at
    /// all would be quicker.
    fn mark_arrived_around(&self, mesh: &mut CurrentMesh, updates: &Range<u32>) -> bool {
        let Some(growing) = &self.growing else { return false };
        let of_base = self.base.tets.iter().zip(&self.base_removers).filter(|(_, u)| updates.contains(u));
        let mut sites: Vec<u32> = of_base.map(|(tet, _)| tet[0]).collect();
        let mut missing = sites.len();
        let mut parents: Vec<u32> = updates.clone().flat_map(|u| growing.parents(u)).copied().collect();
        parents.sort_unstable();
        parents.dedup();
        for p in parents {
            let VertexId(v) = self.vertex(UpdateId(p));
            if mesh.slot(VertexId(v)).is_some() {
                sites.push(v);
                missing += growing.count_removed(p, updates);
            }
        }
        if SITE_COST * sites.len() > mesh.tet_slots() {
            return false;
        }
        sites.sort_unstable();
        sites.dedup();
        let mut star = Vec::new();
        for slot in sites.into_iter().filter_map(|v| mesh.slot(VertexId(v))).collect::<Vec<u32>>() {
            star.clear();
            mesh.list_star(slot, &mut star);
            let found = star.iter().filter(|&&t| self.mark_arrived_at(mesh, t, updates)).count();
            missing = missing.saturating_sub(found);
        }
        // Else the tetrahedra around a vertex are not all connected, or some have been marked before.
        missing == 0
    }

    /// Lets the mesh know which update removes a tetrahedron, if it is here; touches it if it is one of `updates`. Tells whether that is
    /// news.
    fn mark_arrived_at(&self, mesh: &mut CurrentMesh, t: u32, updates: &Range<u32>) -> bool {
        let tag = mesh.tag(t);
        if tag == NONE || tag < FIRST_ANONYMOUS_TAG {
            if updates.contains(&tag) {
                mesh.touch(&[t]);
            }
            return false;
        }
        let place = tag & !FIRST_ANONYMOUS_TAG;
        let creator = self.creator(mesh, t);
        let remover = match creator {
            Some(u) => self.remover_at(u, place),
            None => self.base_removers().get(place as usize).copied().filter(|&u| u != NONE),
        };
        let Some(u) = remover else { return false };
        mesh.set_tag(t, u);
        if let Some(base) = &self.base_quarterings {
            let of_base = || base.get(place as usize).copied().unwrap_or(0);
            mesh.set_tet_byte(t, creator.map_or_else(of_base, |u| self.quarterings_at(u, place)));
        }
        mesh.touch(&[t]);
        updates.contains(&u)
    }

    /// Adds the insertion of a vertex as the next update and applies it; nothing is added if it cannot be applied.
    pub(super) fn insert_next(
        &mut self,
        mesh: &mut CurrentMesh,
        new: &Insertion<'_>,
        cavity: &mut Cavity,
    ) -> Result<()> {
        let u = UpdateId(self.updates());
        let torn = UpdateError::Cavity { update: u.0 };
        let on_boundary = self.open(mesh, new, cavity).ok_or(torn.clone())?;
        if !cavity.is_star_positive(mesh, new.position, self.info.lattice.bits <= NARROW_BITS) {
            return Err(UpdateError::Inverted { update: u.0 });
        }
        cavity.order_link(mesh);
        cavity.order_walls();
        cavity.write_shape(mesh, on_boundary).ok_or(torn)?;
        self.add_node(&cavity.bits, new.errors)?;
        self.note_parents(mesh, new, &cavity.removed_tags, cavity.walls_len);
        for (tag, &place) in cavity.tags[..cavity.walls_len].iter_mut().zip(&cavity.places) {
            *tag = FIRST_ANONYMOUS_TAG | place as u32;
        }
        cavity.quarterings[..cavity.walls_len].fill(0);
        self.perform_insertion(mesh, u, new.position, cavity);
        Ok(())
    }

    /// Finds the faces of Π_u for an update that is added, and writes all in front of the code of T_u. Tells whether faces on the boundary are
    /// given up. None if it is not a hole that a vertex could be inserted into.
    fn open(&self, mesh: &mut CurrentMesh, new: &Insertion<'_>, cavity: &mut Cavity) -> Option<bool> {
        self.take_away(mesh, new, &mut cavity.removed_tags)?;
        let update = self.updates();
        if mesh.slot(self.vertex(UpdateId(update))).is_some() {
            return None;
        }
        cavity.list_bare(mesh, new.removed, update);
        let on_boundary = !new.given_up.is_empty();
        let outer =
            cavity.bare[..cavity.bare_len].iter().filter(|[.., beyond]| on_boundary && *beyond == NONE);
        let outer = on_boundary.then(|| outer.count());
        let mut given_up = Vec::new();
        let mut is_given_up = |_: usize, face: [u32; 2]| {
            given_up.push(new.given_up.contains(&face));
            given_up.last() == Some(&true)
        };
        cavity.find_walls(mesh, outer, &mut is_given_up)?;
        let bits = &mut cavity.bits;
        bits.clear();
        new.position.iter().for_each(|&x| bits.push(x as u64, self.widths.position));
        for (&level, field) in new.levels.iter().zip(&self.info.fields) {
            bits.push(level as u64, field.bits);
        }
        write_given_up(bits, new.removed.len(), &given_up)?;
        Some(on_boundary)
    }

    /// Which faces of T_u on the boundary are given up, in the order of their sorted vertices; empty if none is.
    pub(crate) fn given_up(&self, u: UpdateId) -> Vec<bool> {
        let shape = self.shape(u);
        let count = if shape.boundary { u64::from(shape.given_up_len) } else { 0 };
        (0..count).map(|i| self.nodes.get(shape.given_up + i, 1) == 1).collect()
    }

    /// Where the code of T_u starts in a node without removers, given where its shape does.
    pub(in crate::mt) fn code_start(&self, shape_start: u64) -> u64 {
        let at = shape_start + u64::from(COUNT_BITS) + 1;
        if self.nodes.get(at - 1, 1) == 0 {
            return at;
        }
        at + u64::from(COUNT_BITS) + self.nodes.get(at, COUNT_BITS)
    }

    /// Puts the star of the vertex that `u` inserts in the place of T_u, once all of it is found.
    #[inline]
    pub(in crate::mt) fn perform_insertion(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        position: [i32; 3],
        cavity: &mut Cavity,
    ) {
        self.keep_quarterings(mesh, u, cavity);
        let slot = mesh.new_vertex();
        let labels = Labels { vertex: self.vertex(u).0, kind_word: KindWord(cavity.fingerprint.0) };
        mesh.put_vertex(slot, labels, position);
        let first = slot as usize * mesh.fields;
        for (f, level) in self.levels(u).enumerate() {
            mesh.levels[first + f] = level;
        }
        let (old, new) = (cavity.tets_len, cavity.walls_len);
        let mut slots = [NONE; SLOTS];
        let reused = old.min(new);
        slots[..reused].copy_from_slice(&cavity.tets[..reused]);
        mesh.new_tets(&mut slots[reused..new]);
        for (i, wall) in cavity.walls[..new].iter().enumerate() {
            let t = slots[i];
            let [a, b, c] = wall.corners.map(|x| cavity.link[x as usize % MAX_AROUND]);
            mesh.tets[t as usize] = [slot, a, b, c];
            let [_, b_side, c_side, d_side] = cavity.across[i].map(|j| slots[j as usize % SLOTS]);
            let around = [wall.beyond, b_side, c_side, d_side];
            mesh.neighbors[t as usize] = around;
            if wall.beyond != NONE {
                mesh.neighbors[wall.beyond as usize][wall.side as usize & 3] = t;
                mesh.mark_tet(wall.beyond);
            }
            mesh.set_tag(t, cavity.tags[i]);
            mesh.set_tet_byte(t, cavity.quarterings[i]);
            mesh.mark_tet(t);
            [a, b, c].iter().for_each(|&v| mesh.incident[v as usize] = t);
        }
        mesh.incident[slot as usize] = slots[0];
        for &t in &cavity.tets[reused..old] {
            mesh.free_tet(t);
        }
        mesh.touch(&cavity.tets[..old]);
        mesh.touch(&slots[reused..new]);
    }

    /// Collects the star of the vertex that `u` inserted and builds T_u from it, in numbers, by `build`, which finds link and walls in
    /// canonical order; the mesh stays as it is. Tells a child of `u` that has to go first, if there is one.
    #[inline]
    pub(in crate::mt) fn rebuild(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        cavity: &mut Cavity,
        build: impl FnOnce(&CurrentMesh, &mut Cavity) -> Option<()>,
    ) -> Result<Applied> {
        let vertex = self.vertex(u);
        let torn = UpdateError::Cavity { update: u.0 };
        let absent = UpdateError::Vertex { update: u.0, vertex: vertex.0 };
        let slot = mesh.slot(vertex).ok_or(absent.clone())?;
        let younger = |labels: &[Labels], tet: &[u32; 4]| {
            tet.iter().map(|&v| labels[v as usize].vertex).find(|&v| v > vertex.0)
        };
        match mesh.gather_star(slot, &mut cavity.star, younger) {
            Ok(()) => {}
            Err(Gather::TooLarge) => return Err(UpdateError::Star { update: u.0 }),
            Err(Gather::Stopped(v)) => {
                return self.inserted_by(VertexId(v)).map(Applied::Blocked).ok_or(absent);
            }
        }
        (cavity.walls_len, cavity.link_len) = (0, 0);
        for i in 0..cavity.star.len {
            let (t, corner) = (cavity.star.tets[i], cavity.star.corner[i] as usize);
            let beyond = mesh.neighbors[t as usize][corner];
            let side = if beyond == NONE { Some(0) } else { mesh.side_towards(beyond, t) };
            let tet = mesh.tets[t as usize];
            let added = side.and_then(|side| cavity.add_wall(mesh, &tet, corner, beyond, side));
            added.ok_or(torn.clone())?;
        }
        cavity.order_link(mesh);
        self.sort(cavity);
        build(mesh, cavity).ok_or(torn.clone())?;
        cavity.fingerprint_built(mesh);
        if KindWord(cavity.fingerprint.0) != mesh.labels[slot as usize].kind_word {
            return Err(torn);
        }
        // Other tetrahedra may have the same fingerprint by intent; none may be inside out.
        let at = |x: u8| mesh.positions[cavity.link[x as usize % MAX_AROUND] as usize];
        let positive = cavity.fill.tets[..cavity.fill.len].iter().all(|tet| {
            let [a, b, c, d] = tet.map(at);
            orient3d(a, b, c, d) > 0
        });
        if positive { Ok(Applied::Done) } else { Err(UpdateError::Inverted { update: u.0 }) }
    }

    /// Puts link and walls into canonical order.
    #[inline]
    fn sort(&self, cavity: &mut Cavity) {
        cavity.order_walls();
        let walls = cavity.walls;
        for (wall, &place) in walls[..cavity.walls_len].iter().zip(&cavity.places) {
            let corners = turned(wall.corners.map(|x| cavity.order[x as usize % MAX_AROUND] as u8));
            cavity.walls[place as usize % MAX_INSERTED] = Wall { corners, ..*wall };
        }
        let link = cavity.link;
        for (&v, &place) in link[..cavity.link_len].iter().zip(&cavity.order) {
            cavity.link[place as usize % MAX_AROUND] = v;
        }
    }

    /// Builds T_u from walls in canonical order.
    #[inline]
    fn build_removed(&self, mesh: &CurrentMesh, u: UpdateId, cavity: &mut Cavity) -> Option<()> {
        let shape = self.shape(u);
        let mut faces: [Face; MAX_INSERTED] = [[0; 3]; MAX_INSERTED];
        for (face, wall) in faces.iter_mut().zip(&cavity.walls[..cavity.walls_len]) {
            *face = wall.corners;
        }
        let vertices = cavity.link_len as u32;
        let at = shape.remover(cavity.walls_len as u64);
        let mut code = Code::new(at, vertices, shape.boundary);
        let apex = code.apex_of_all(&self.nodes);
        if apex.is_none() {
            code.read_apex_code(&self.nodes, || {
                let link = &cavity.link[..cavity.link_len];
                Spheres::of(link.iter().map(|&v| mesh.positions[v as usize]))
            });
        }
        let close = |face: Face, of_link: bool| match apex {
            Some(apex) if !of_link || face.contains(&apex) => Some(Close::Leave),
            Some(apex) => Some(Close::With(apex)),
            None => code.close(&self.nodes, face, of_link),
        };
        cavity.fill.build(&faces[..cavity.walls_len], !shape.boundary, close)?;
        (cavity.fill.len == shape.removed).then_some(())
    }

    /// Puts T_u, once it is built, in the place of the star of the vertex that `u` inserted. `tag_of` says which tag each tetrahedron
    /// gets.
    #[inline]
    pub(in crate::mt) fn perform_removal(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        cavity: &mut Cavity,
        tag_of: impl Fn(usize) -> u32,
    ) {
        let kept = self.kept_quarterings(u, cavity);
        let Cavity { fill, star, walls, link, .. } = cavity;
        let (old, new) = (star.len, fill.len);
        let mut slots = [NONE; GATHERED];
        let reused = old.min(new);
        slots[..reused].copy_from_slice(&star.tets[..reused]);
        mesh.touch(&star.tets[..old]);
        // Free what is left first: the vertex goes with it.
        star.tets[reused..old].iter().for_each(|&t| mesh.free_tet(t));
        slots[reused..new].iter_mut().for_each(|t| *t = mesh.new_tet());
        mesh.touch(&slots[reused..new]);
        if let Some(slot) = mesh.slot(self.vertex(u)) {
            mesh.remove_vertex(slot);
        }
        for i in 0..new {
            let t = slots[i];
            let tet = fill.tets[i].map(|x| link[x as usize % MAX_AROUND]);
            mesh.tets[t as usize] = tet;
            for (side, across) in fill.across[i].iter().enumerate() {
                mesh.neighbors[t as usize][side] = match *across {
                    Across::Nothing => NONE,
                    Across::Inside(j) => slots[j as usize],
                    Across::Outside(place) => {
                        let wall = walls[place as usize % MAX_INSERTED];
                        if wall.beyond != NONE {
                            mesh.neighbors[wall.beyond as usize][wall.side as usize & 3] = t;
                            mesh.mark_tet(wall.beyond);
                        }
                        wall.beyond
                    }
                };
            }
            mesh.set_tag(t, tag_of(i));
            if let Some(kept) = &kept {
                mesh.set_tet_byte(t, kept[i]);
            }
            mesh.mark_tet(t);
            tet.iter().for_each(|&v| mesh.incident[v as usize] = t);
        }
    }
}

/// Shows `look` the tetrahedra that were built, with their quarterings where these are kept, until it returns true.
pub(in crate::mt) fn show_built(
    mesh: &CurrentMesh,
    cavity: &Cavity,
    kept: Option<[u8; GATHERED]>,
    look: LookAtTet<'_>,
) {
    for (i, tet) in cavity.fill.tets[..cavity.fill.len].iter().enumerate() {
        let tet = tet.map(|x| cavity.link[x as usize % MAX_AROUND]);
        let levels = |field: usize| tet.map(|v| mesh.levels(v)[field]);
        let own = kept.map_or(0, |kept| kept[i]);
        if look(&tet.map(|v| mesh.positions[v as usize]), &levels, own, 0) {
            break;
        }
    }
}

impl UpdatePages for VertexMt {
    fn page_bits(&self) -> u32 {
        self.page_bits
    }

    fn set_to_come(&mut self, bounds: &[ErrorCode]) {
        let bound = bounds.iter().copied().max().filter(|_| self.updates() < self.info().updates);
        self.to_come = bound.unwrap_or(ErrorCode::MAX);
    }

    fn page_inserted(&self, mesh: &mut CurrentMesh, updates: Range<u32>) {
        let updates = updates.start..updates.end.min(self.updates());
        if updates.is_empty() {
            return;
        }
        if !self.mark_arrived_around(mesh, &updates) {
            (0..mesh.tet_slots() as u32).for_each(|t| _ = self.mark_arrived_at(mesh, t, &updates));
        }
    }
}

impl ApplyUpdates for VertexMt {
    fn start(&self) -> Result<CurrentMesh, BaseMeshError> {
        let mut mesh = CurrentMesh::new(self.info(), self.base())?;
        let anonymous = self.growing.is_some();
        mesh.tag_all(
            (0..)
                .zip(self.base_removers())
                .map(|(t, &u)| if anonymous && u == NONE { FIRST_ANONYMOUS_TAG | t } else { u }),
        );
        if let Some(quarterings) = &self.base_quarterings {
            mesh.keep_tet_bytes(quarterings.clone());
            let replaced = Some(PagedArray::new(Packed::default()));
            mesh.put_back_kind_state(Box::new(Cavity { replaced, ..Cavity::default() }));
        }
        Ok(mesh)
    }

    #[inline]
    fn quarterings(&self, mesh: &CurrentMesh, t: u32) -> u8 {
        mesh.tet_byte(t)
    }

    #[inline]
    fn remover(&self, mesh: &CurrentMesh, t: u32) -> Option<UpdateId> {
        Some(mesh.tag(t)).filter(|&u| u < self.updates()).map(UpdateId)
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
        mesh.with_kind_state(|mesh, cavity| self.insert(mesh, u, cavity))
    }

    fn coarsen(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied> {
        mesh.with_kind_state(|mesh, cavity| {
            let rebuilt = self.rebuild(mesh, u, cavity, |mesh, cavity| self.build_removed(mesh, u, cavity));
            if rebuilt == Ok(Applied::Done) {
                self.perform_removal(mesh, u, cavity, |_| u.0);
            }
            rebuilt
        })
    }

    fn look_at_removed(&self, mesh: &mut CurrentMesh, u: UpdateId, look: LookAtTet<'_>) -> Result<Applied> {
        mesh.with_kind_state(|mesh, cavity| {
            let rebuilt = self.rebuild(mesh, u, cavity, |mesh, cavity| self.build_removed(mesh, u, cavity));
            if rebuilt == Ok(Applied::Done) {
                show_built(mesh, cavity, self.kept_quarterings(u, cavity), look);
            }
            rebuilt
        })
    }

    fn find_removed(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Vec<u32>> {
        mesh.with_kind_state(|mesh, cavity| {
            let Applied::Done = self.gather_removed(mesh, u, self.shape(u).removed, cavity)? else {
                return Err(UpdateError::Error { update: u.0 });
            };
            Ok(cavity.tets[..cavity.tets_len].to_vec())
        })
    }

    fn find_inserted(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Vec<u32>> {
        mesh.find_star(u, self.vertex(u))
    }
}

//! Vertices with a value for each region: the points that a mesh has for them.
//!
//! Where fields jump at interfaces, a vertex at which several regions meet has a value for each of them. The updates of an MT know the vertex
//! alone: it is in the slot of its first region, the *main* one. For each further region there is another slot, with the same label and the same position:
//! a *side* of the vertex. What is handed out of a mesh has the sides as corners of the tetrahedra in their regions, so that each region has its own
//! values, and whoever reads the mesh needs to know nothing of it.
//!
//! ```text
//!      region 0 │ region 1            a: the main slot, with the value in region 0
//!               a ─ b                 b: a side of the same vertex, at the same place, with the value in region 1;
//!      ─────────│──────────              corner of the tetrahedra of region 1
//! ```

use super::current::{CurrentMesh, KindWord, Labels};
use super::side_slots::SideSlots;
use crate::mesh::NONE;

impl CurrentMesh {
    /// From now on vertices may have sides, in these fields.
    pub(in crate::mt) fn keep_sides(&mut self, jumps: Vec<bool>) {
        let next = vec![NONE; self.labels.len()];
        self.sides = Some(Box::new(SideSlots { jumps, next, corners: Vec::new() }));
    }

    /// For each field whether its values depend on the region; none if no vertex has sides.
    #[inline]
    pub(in crate::mt) fn jumps(&self) -> Option<&[bool]> {
        self.sides.as_ref().map(|sides| &sides.jumps[..])
    }

    /// The slot with the values in a region of the vertex in `slot`.
    #[inline]
    pub(crate) fn side(&self, slot: u32, region: u16) -> u32 {
        match &self.sides {
            None => slot,
            Some(_) => self.sides_of(slot).find(|&side| self.is_side_in(side, region)).unwrap_or(slot),
        }
    }

    fn is_side_in(&self, slot: u32, region: u16) -> bool {
        self.labels[slot as usize].kind_word == KindWord(u32::from(region))
    }

    /// The sides of the vertex in `slot` behind that.
    fn sides_of(&self, slot: u32) -> impl Iterator<Item = u32> {
        let next = |slot: u32| {
            let next = self.sides.as_ref().map_or(NONE, |sides| sides.next[slot as usize]);
            (next != NONE).then_some(next)
        };
        std::iter::successors(next(slot), move |&side| next(side))
    }

    /// Whether a slot has a side, not the main values of a vertex.
    #[inline]
    pub(super) fn is_side(&self, slot: u32) -> bool {
        self.sides.is_some() && self.labels[slot as usize].kind_word != KindWord::NONE
    }

    /// The corners of a tetrahedron, given its vertices, with sides where they have any in its region.
    #[inline]
    pub(super) fn with_sides(&self, t: u32, tet: [u32; 4]) -> [u32; 4] {
        match &self.sides {
            Some(_) if tet[0] != NONE => tet.map(|v| self.side(v, self.region(t))),
            _ => tet,
        }
    }

    /// Gives the vertex in `slot` a side: its levels in a region.
    pub(in crate::mt) fn add_side(&mut self, slot: u32, region: u16, levels: &[i32]) {
        let side = self.new_vertex();
        let vertex = self.labels[slot as usize].vertex;
        self.labels[side as usize] = Labels { vertex, kind_word: KindWord(u32::from(region)) };
        self.positions[side as usize] = self.positions[slot as usize];
        self.levels[side as usize * self.fields..][..levels.len()].copy_from_slice(levels);
        self.changed_vertices.mark(side);
        if let Some(sides) = &mut self.sides {
            sides.next[side as usize] = std::mem::replace(&mut sides.next[slot as usize], side);
        }
    }

    /// Takes the sides of the vertex in `slot` out of the mesh.
    pub(super) fn remove_sides(&mut self, slot: u32) {
        if self.sides.is_none() {
            return;
        }
        let all: Vec<u32> = self.sides_of(slot).collect();
        for slot in all.iter().copied().chain([slot]) {
            self.sides.iter_mut().for_each(|sides| sides.next[slot as usize] = NONE);
        }
        all.into_iter().for_each(|side| self.free_vertex(side));
    }

    /// What is in slot `from` has been moved to `to`.
    pub(super) fn move_sides(&mut self, from: u32, to: u32) {
        let Some(sides) = &mut self.sides else { return };
        let next = std::mem::replace(&mut sides.next[from as usize], NONE);
        sides.next[to as usize] = next;
        if !self.is_side(to) {
            return;
        }
        let main = self.slot_of.get(self.labels[to as usize].vertex);
        let before = std::iter::once(main).chain(self.sides_of(main));
        let before = before.take_while(|&slot| slot != from).last().unwrap_or(main);
        self.sides.iter_mut().for_each(|sides| sides.next[before as usize] = to);
        let mut star = Vec::new();
        self.list_star(main, &mut star);
        star.into_iter().for_each(|t| self.mark_tet(t));
    }

    /// Brings the tetrahedra that are handed out up to date where something has changed.
    pub(in crate::mt) fn update_corners(&mut self) {
        let Some(mut sides) = self.sides.take() else { return };
        let mut corners = std::mem::take(&mut sides.corners);
        self.sides = Some(sides);
        corners.resize(self.tets.len(), [NONE; 4]);
        for range in self.changed_tets.ranges(self.tets.len()) {
            for t in range {
                corners[t as usize] = self.with_sides(t, self.tets[t as usize]);
            }
        }
        self.sides.iter_mut().for_each(|sides| sides.corners = std::mem::take(&mut corners));
    }

    /// Checks the slot of a side: it is one of those of its vertex, and at its place.
    pub(super) fn check_side(&self, slot: u32) -> Result<(), String> {
        let vertex = self.labels[slot as usize].vertex;
        let main = self.slot_of.get(vertex);
        let is_known = main != NONE && self.sides_of(main).any(|side| side == slot);
        if !is_known || self.positions[main as usize] != self.positions[slot as usize] {
            return Err(format!("slot {slot} is no side of vertex {vertex}"));
        }
        Ok(())
    }
}

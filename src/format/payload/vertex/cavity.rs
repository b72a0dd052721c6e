//! What an insertion removes, found face by face from its first tetrahedron on.

use super::state::{State, View};
use crate::geom::{insphere, views_of_origin};
use crate::mesh::{FACES, NONE};
use crate::mt::{MAX_REMOVED, corner_of};

/// One bit for each.
#[inline]
pub(super) fn signs(all: [bool; 4]) -> u8 {
    (0..).zip(all).fold(0, |bits, (k, is_set)| bits | u8::from(is_set) << k)
}

/// The corners of a tetrahedron in the order of their vertices.
#[inline]
pub(super) fn by_vertex(tet: [u32; 4]) -> [usize; 4] {
    let mut keys = [0, 1, 2, 3].map(|k| u64::from(tet[k]) << 2 | k as u64);
    for [i, j] in [[0, 1], [2, 3], [0, 2], [1, 3], [1, 2]] {
        (keys[i], keys[j]) = (keys[i].min(keys[j]), keys[i].max(keys[j]));
    }
    keys.map(|key| (key & 3) as usize)
}

impl State {
    /// Finds what is removed, from its first tetrahedron on. What lies behind a face that the new vertex does not see has to
    /// be; `decide` is asked for the rest, with the context. With a vertex `fan`, all has it. Stops
    /// when there is too much.
    pub(super) fn grow<E>(
        &mut self,
        seed: u32,
        fan: Option<u32>,
        position: [i32; 3],
        decide: &mut dyn FnMut(u32, u32) -> Result<bool, E>,
    ) -> Result<(), E> {
        let [yes, no, never] = [1, 2, 3].map(|more| self.epoch + more);
        self.removed.clear();
        self.removed.push(seed);
        self.tet_marks[seed as usize] = yes;
        self.on_boundary = false;
        self.views.clear();
        self.views.push(self.view(seed, position));
        let mut next = 0;
        while let Some(&t) = self.removed.get(next).filter(|_| self.removed.len() <= MAX_REMOVED) {
            let view = self.views[next];
            next += 1;
            let (tet, around) = (self.mesh.tets()[t as usize], self.mesh.neighbors()[t as usize]);
            for k in by_vertex(tet) {
                let n = around[k];
                self.on_boundary |= n == NONE;
                // What lies opposite the vertex that all have does not have it.
                if fan == Some(tet[k]) {
                    continue;
                }
                let mark = self.tet_marks.get(n as usize).copied().unwrap_or(no);
                if (yes..=never).contains(&mark) {
                    continue;
                }
                let Some(beyond) = self.view_if(n, fan, position) else {
                    self.tet_marks[n as usize] = never;
                    continue;
                };
                let context = 2 * self.grow_context(n, beyond) + u32::from(view.sphere > 0);
                let is_removed = view.seen >> k & 1 == 0 || decide(n, context)?;
                self.tet_marks[n as usize] = if is_removed { yes } else { no };
                if is_removed {
                    self.removed.push(n);
                    self.views.push(beyond);
                }
            }
        }
        Ok(())
    }

    /// The view of a tetrahedron that may be removed: it has the vertex that all have, if there is one; the face opposite it must be
    /// seen then, unless it is on the boundary.
    #[inline]
    pub(super) fn view_if(&self, t: u32, fan: Option<u32>, position: [i32; 3]) -> Option<View> {
        let Some(fan) = fan else { return Some(self.view(t, position)) };
        let corner = corner_of(&self.mesh.tets()[t as usize], fan);
        let view = self.view(t, position);
        let is_open = self.mesh.neighbors()[t as usize][corner] == NONE || view.seen >> corner & 1 == 1;
        is_open.then_some(view)
    }

    #[inline]
    pub(super) fn view(&self, t: u32, position: [i32; 3]) -> View {
        let tet = self.mesh.tets()[t as usize];
        if self.narrow {
            let (inward, sphere) = views_of_origin(self.seen_from(tet, position));
            return View { seen: signs(inward.map(|volume| volume > 0)), sphere };
        }
        let [a, b, c, d] = tet.map(|v| self.mesh.positions()[v as usize]);
        let seen = signs(self.inward(tet, position).map(|volume| volume > 0.0));
        View { seen, sphere: insphere(a, b, c, d, position) }
    }

    /// Half the context of whether a tetrahedron is removed: 0 to 53.
    #[inline]
    pub(super) fn grow_context(&self, t: u32, view: View) -> u32 {
        let (mut removed, mut kept) = (0, 0);
        for n in self.mesh.neighbors()[t as usize] {
            let mark = self.tet_marks.get(n as usize).copied().unwrap_or(0);
            removed += u32::from(mark == self.epoch + 1);
            kept |= u32::from(mark == self.epoch + 2);
        }
        let hidden = 4 - view.seen.count_ones();
        let known = removed.clamp(1, 3) - 1;
        let shape = (view.sphere + 1) as u32 * 3 + known;
        (shape * 3 + hidden.clamp(1, 3) - 1) * 2 + kept
    }

    /// Finds the faces on the boundary that are given up: those that the new vertex does not see, and such as `decide` says, given
    /// their places by sorted vertices.
    pub(super) fn list_given_up<E>(
        &mut self,
        position: [i32; 3],
        decide: &mut dyn FnMut(usize) -> Result<bool, E>,
    ) -> Result<(), E> {
        self.given_up.clear();
        if !self.on_boundary {
            return Ok(());
        }
        let mut bare: Vec<([u32; 3], [u32; 2])> = Vec::new();
        for &t in &self.removed {
            let tet = self.mesh.tets()[t as usize];
            for (k, &n) in (0..).zip(&self.mesh.neighbors()[t as usize]) {
                if n == NONE {
                    let mut face = FACES[k as usize].map(|i| tet[i]);
                    face.sort_unstable();
                    bare.push((face, [t, k]));
                }
            }
        }
        bare.sort_unstable();
        for (place, (_, [t, k])) in bare.into_iter().enumerate() {
            if self.view(t, position).seen >> k & 1 == 0 || decide(place)? {
                self.given_up.push([t, k]);
            }
        }
        Ok(())
    }
}

//! What a vertex-based MT that grows keeps beside its nodes.

use std::ops::Range;

/// What is kept beside the nodes.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::mt) struct Growing {
    /// Where the parents of each update end.
    pub(super) parents_end: Vec<u32>,
    pub(super) parents: Vec<u32>,
    /// Ascending, since they come in that order.
    pub(super) children: Vec<Vec<u32>>,
    /// Where the removers of each update end.
    pub(super) removers_end: Vec<u64>,
    /// For each tetrahedron of a star, in canonical order, which child removes it, counted from 1; 0 while none does.
    pub(super) removers: Vec<u8>,
    /// For each of these tetrahedra its quarterings; nothing if tetrahedra have no errors of their own.
    pub(super) quarterings: Vec<u8>,
    /// Bits that each node was padded with.
    pub(super) padding: Vec<u8>,
}

impl Growing {
    pub fn parents(&self, u: u32) -> &[u32] {
        let start = u.checked_sub(1).map_or(0, |before| self.parents_end[before as usize]);
        &self.parents[start as usize..self.parents_end[u as usize] as usize]
    }

    pub fn children(&self, u: u32) -> &[u32] {
        &self.children[u as usize]
    }

    pub fn removers_start(&self, u: u32) -> usize {
        u.checked_sub(1).map_or(0, |before| self.removers_end[before as usize]) as usize
    }

    pub fn removers(&self, u: u32) -> &[u8] {
        &self.removers[self.removers_start(u)..self.removers_end[u as usize] as usize]
    }

    /// The update that removes the tetrahedron at a place of a star, if it is here.
    pub fn remover(&self, u: u32, place: usize) -> Option<u32> {
        let child = *self.removers(u).get(place)?;
        self.children(u).get(usize::from(child).checked_sub(1)?).copied()
    }

    /// How many tetrahedra of a star updates of a range remove.
    pub fn count_removed(&self, u: u32, updates: &Range<u32>) -> usize {
        let children = self.children(u);
        let remover = |&child: &u8| children.get(usize::from(child).checked_sub(1)?);
        self.removers(u).iter().filter_map(remover).filter(|u| updates.contains(u)).count()
    }

    /// The quarterings of the tetrahedron at a place of a star, as far as its remover is here.
    pub fn quarterings(&self, u: u32, place: usize) -> u8 {
        self.quarterings.get(self.removers_start(u) + place).copied().unwrap_or(0)
    }

    pub fn bytes(&self) -> usize {
        // There are as many parents as children.
        2 * size_of_val(&self.parents[..])
            + size_of_val(&self.parents_end[..])
            + size_of_val(&self.children[..])
            + size_of_val(&self.removers_end[..])
            + self.removers.len()
            + self.quarterings.len()
            + self.padding.len()
    }

    /// The member of the loop of `owner` behind the `at`-th one, where 0 is the owner and `i` its `i`-th parent; and which of its
    /// links leads on.
    pub fn next_in_loop(&self, owner: u32, at: usize) -> [u32; 2] {
        match self.parents(owner).get(at) {
            Some(&parent) => {
                let place = self.children(parent).partition_point(|&child| child < owner);
                [parent, 1 + place as u32]
            }
            None => [owner, 0],
        }
    }
}

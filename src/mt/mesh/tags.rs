//! Tags of tetrahedra: a number that the MT gives each, and a byte beside it, for kinds of MT that need them.

use super::current::CurrentMesh;
use crate::mesh::NONE;

impl CurrentMesh {
    /// Gives every tetrahedron a tag: `tags` says which.
    pub(crate) fn tag_all(&mut self, tags: impl IntoIterator<Item = u32>) {
        self.tags = vec![NONE; self.tets.len()];
        for (t, tag) in (0..self.tets.len() as u32).zip(tags) {
            self.set_tag(t, tag);
        }
    }

    /// From now on all tags but [`NONE`] are looked for.
    pub(in crate::mt) fn look_for_all_tags(&mut self) {
        self.first_anonymous_tag = NONE;
    }

    /// Keeps a byte for each tetrahedron from now on.
    pub(in crate::mt) fn keep_tet_bytes(&mut self, bytes: Vec<u8>) {
        self.tet_bytes = bytes;
        self.tet_bytes.resize(self.tets.len(), 0);
        self.has_tet_bytes = true;
    }

    /// The byte that is kept for tetrahedron `t`; 0 where none is.
    #[inline]
    pub(in crate::mt) fn tet_byte(&self, t: u32) -> u8 {
        self.tet_bytes.get(t as usize).copied().unwrap_or(0)
    }

    /// Sets the byte of tetrahedron `t`, if bytes are kept.
    #[inline]
    pub(in crate::mt) fn set_tet_byte(&mut self, t: u32, byte: u8) {
        if let Some(own) = self.tet_bytes.get_mut(t as usize) {
            *own = byte;
        }
    }

    /// Whether tetrahedra have tags.
    #[inline]
    pub(super) fn is_tagged(&self) -> bool {
        !self.tags.is_empty()
    }

    /// The MT's tag of tetrahedron `t`.
    #[inline]
    pub(crate) fn tag(&self, t: u32) -> u32 {
        self.tags[t as usize]
    }

    /// Gives tetrahedron `t` a tag. Those of at least [`FIRST_ANONYMOUS_TAG`](super::current::FIRST_ANONYMOUS_TAG) are, by default, not looked for by
    /// [`CurrentMesh::tagged`].
    #[inline]
    pub(crate) fn set_tag(&mut self, t: u32, tag: u32) {
        let old = std::mem::replace(&mut self.tags[t as usize], tag);
        if self.place_of.get(old) == t {
            self.place_of.set(old, NONE);
        }
        if tag < self.first_anonymous_tag {
            self.place_of.set(tag, t);
        }
    }

    /// Nothing is found for a tag any more.
    #[inline]
    pub(in crate::mt) fn forget_place(&mut self, tag: u32) {
        self.place_of.set(tag, NONE);
    }

    /// As [`Self::set_tag`], for a tetrahedron that is not found for its tag so far.
    #[inline]
    pub(in crate::mt) fn set_new_tag(&mut self, t: u32, tag: u32) {
        self.tags[t as usize] = tag;
        self.place_tag(t);
    }

    /// Gives tetrahedron `t` a tag that is not looked for, although it is below [`FIRST_ANONYMOUS_TAG`](super::current::FIRST_ANONYMOUS_TAG), in the place of one that is
    /// not.
    #[inline]
    pub(in crate::mt) fn take_tag(&mut self, t: u32, tag: u32) {
        self.tags[t as usize] = tag;
    }

    /// The tetrahedron that got a tag last, as long as it is in the mesh and has it.
    #[inline]
    pub(crate) fn tagged(&self, tag: u32) -> Option<u32> {
        Some(self.place_of.get(tag)).filter(|&t| t != NONE)
    }

    /// Takes the tag, the byte and the region of `from` over to `to`, a free slot.
    #[inline]
    pub(super) fn move_tag(&mut self, from: u32, to: u32) {
        if self.is_tagged() {
            let tag = self.tags[from as usize];
            self.tags[to as usize] = tag;
            if self.place_of.get(tag) == from {
                self.place_of.set(tag, to);
            }
        }
        if self.has_tet_bytes {
            self.tet_bytes[to as usize] = self.tet_bytes[from as usize];
        }
        if !self.regions.is_empty() {
            self.regions[to as usize] = self.regions[from as usize];
        }
    }

    /// Makes `t` the tetrahedron that [`Self::tagged`] finds for its tag.
    #[inline]
    pub(in crate::mt) fn place_tag(&mut self, t: u32) {
        let tag = self.tags[t as usize];
        if tag < self.first_anonymous_tag {
            self.place_of.set(tag, t);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::stars::tests::wheel;
    use super::*;
    use crate::mt::mesh::FIRST_ANONYMOUS_TAG;

    #[test]
    fn half_edge_mts_have_tags_for_all_updates() {
        let large = [0, FIRST_ANONYMOUS_TAG - 1, FIRST_ANONYMOUS_TAG, u32::MAX - 2, NONE];
        let mut mesh = wheel(5);
        mesh.tag_all(large);
        assert_eq!(large.map(|tag| mesh.tagged(tag)), [Some(0), Some(1), None, None, None]);
        let mut mesh = wheel(5);
        mesh.look_for_all_tags();
        mesh.tag_all(large);
        assert_eq!(large.map(|tag| mesh.tagged(tag)), [Some(0), Some(1), Some(2), Some(3), None]);
        mesh.set_tag(3, FIRST_ANONYMOUS_TAG + 1);
        assert_eq!([u32::MAX - 2, FIRST_ANONYMOUS_TAG + 1].map(|tag| mesh.tagged(tag)), [None, Some(3)]);
    }
}

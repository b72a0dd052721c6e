//! Building T_u inside the polyhedron Π_u, face by face, in canonical numbers.
//!
//! The vertices of Π_u are numbered in the order of their labels and its faces put in the order of their sorted numbers.
//! All faces are closed in turn: first those of Π_u, then those that come up on the way in the order in which they come
//! up. To close a face takes a tetrahedron behind it; whoever calls names its fourth vertex. Faces that another
//! tetrahedron has closed meanwhile are passed over.

use super::limits::{MAX_AROUND, MAX_INSERTED, MAX_REMOVED};
use crate::mesh::FACES;

/// Three vertices; in an order for which a tetrahedron `(x, face)` behind the face is positive, the least one first.
pub(in crate::mt) type Face = [u8; 3];

/// What lies across a face of a tetrahedron of T_u.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) enum Across {
    /// Nothing: the boundary of the domain.
    #[default]
    Nothing,
    /// A face of Π_u, by its place in canonical order.
    Outside(u8),
    /// Another tetrahedron of T_u.
    Inside(u8),
}

/// What the caller says of an open face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Close {
    /// The fourth vertex of the tetrahedron behind it.
    With(u8),
    /// Another tetrahedron closes it, or nothing does.
    Leave,
}

const OPEN_FACES: usize = MAX_INSERTED + 3 * MAX_REMOVED;
const PLACES: usize = 1024;

#[derive(Clone, Copy, Debug, Default)]
struct OpenFace {
    face: Face,
    closed: bool,
    /// The tetrahedron and face that it came up with; for a face of Π_u its place.
    tet: u8,
    side: u8,
}

/// Marks a face of Π_u among the open faces.
const OF_LINK: u8 = 4;

/// Scratch space, and the tetrahedra that were built last.
#[derive(Clone, Debug)]
pub(crate) struct CavityFill {
    open: [OpenFace; OPEN_FACES],
    open_len: usize,
    /// Open faces by their vertices: `epoch << 16 | index`.
    places: [u32; PLACES],
    epoch: u32,
    pub len: usize,
    /// The tetrahedra of T_u, positive.
    pub tets: [[u8; 4]; MAX_REMOVED],
    pub across: [[Across; 4]; MAX_REMOVED],
}

impl Default for CavityFill {
    fn default() -> Self {
        Self {
            open: [OpenFace::default(); OPEN_FACES],
            open_len: 0,
            places: [0; PLACES],
            epoch: 0,
            len: 0,
            tets: [[0; 4]; MAX_REMOVED],
            across: [[Across::Nothing; 4]; MAX_REMOVED],
        }
    }
}

/// Turns a face so that its least vertex comes first.
#[inline]
pub(in crate::mt) fn turned([a, b, c]: Face) -> Face {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// The sorted vertices of a turned face as one number.
#[inline]
fn key([a, b, c]: Face) -> u32 {
    u32::from(a) << 12 | u32::from(b.min(c)) << 6 | u32::from(b.max(c))
}

impl CavityFill {
    /// Builds tetrahedra behind `link`, the faces of Π_u in canonical order, turned. `close` says how to close each face;
    /// it gets whether the face is one of Π_u. None if the faces do not fit together: every face of Π_u must be
    /// closed, and with `whole` every other face as well.
    #[inline]
    pub fn build(
        &mut self,
        link: &[Face],
        whole: bool,
        mut close: impl FnMut(Face, bool) -> Option<Close>,
    ) -> Option<()> {
        self.start();
        for (i, &face) in link.iter().enumerate() {
            let slot = self.find(face);
            if self.is_taken(slot) || i >= MAX_INSERTED {
                return None;
            }
            self.add(slot, OpenFace { face, closed: false, tet: i as u8, side: OF_LINK });
        }
        let mut next = 0;
        while next < self.open_len {
            let OpenFace { face, closed, .. } = self.open[next];
            if !closed && let Close::With(x) = close(face, next < link.len())? {
                self.put(next, x)?;
            }
            next += 1;
        }
        let open = |range: &[OpenFace]| range.iter().any(|face| !face.closed);
        let missing = open(&self.open[..link.len()]) || whole && open(&self.open[link.len()..self.open_len]);
        (!missing && self.len > 0).then_some(())
    }

    fn start(&mut self) {
        self.len = 0;
        self.open_len = 0;
        self.epoch += 1;
        if self.epoch == 1 << 16 {
            self.places.fill(0);
            self.epoch = 1;
        }
    }

    /// Puts a tetrahedron with the fourth vertex `x` behind open face `at`.
    #[inline]
    fn put(&mut self, at: usize, x: u8) -> Option<()> {
        let [a, b, c] = self.open[at].face;
        if self.len == MAX_REMOVED || x == a || x == b || x == c || usize::from(x) >= MAX_AROUND {
            return None;
        }
        let t = self.len;
        self.len += 1;
        let tet = [x, a, b, c];
        self.tets[t] = tet;
        self.across[t] = [Across::Nothing; 4];
        self.connect(at, t, 0);
        // Face 0, opposite `x`, is the open face that was closed just now, and linked by `connect`; these are the others.
        for (side, face) in FACES.iter().enumerate().skip(1) {
            let own = turned(face.map(|k| tet[k]));
            let slot = self.find(own);
            if self.is_taken(slot) {
                let other = (self.places[slot] & 0xFFFF) as usize;
                // A third tetrahedron at a face, or two on the same side of it.
                if self.open[other].closed || self.open[other].face != own {
                    return None;
                }
                self.connect(other, t, side);
            } else {
                // From behind, the face goes round the other way.
                let [a, b, c] = own;
                let face = OpenFace { face: [a, c, b], closed: false, tet: t as u8, side: side as u8 };
                self.add(slot, face);
            }
        }
        Some(())
    }

    /// Closes open face `at` with face `side` of tetrahedron `t`.
    #[inline]
    fn connect(&mut self, at: usize, t: usize, side: usize) {
        let open = &mut self.open[at];
        open.closed = true;
        if open.side == OF_LINK {
            self.across[t][side] = Across::Outside(open.tet);
        } else {
            self.across[t][side] = Across::Inside(open.tet);
            self.across[open.tet as usize][open.side as usize] = Across::Inside(t as u8);
        }
    }

    #[inline]
    fn add(&mut self, slot: usize, face: OpenFace) {
        self.places[slot] = self.epoch << 16 | self.open_len as u32;
        self.open[self.open_len] = face;
        self.open_len += 1;
    }

    #[inline]
    fn is_taken(&self, slot: usize) -> bool {
        self.places[slot] >> 16 == self.epoch
    }

    /// The place of a face with these vertices, or the free one where it would go.
    #[inline]
    fn find(&self, face: Face) -> usize {
        let key = key(face);
        let mut slot = (key.wrapping_mul(0x9E37_79B1) >> 22) as usize;
        loop {
            let place = self.places[slot % PLACES];
            if place >> 16 != self.epoch || self.key_at(place) == key {
                return slot % PLACES;
            }
            slot += 1;
        }
    }

    #[inline]
    fn key_at(&self, place: u32) -> u32 {
        key(self.open[(place & 0xFFFF) as usize].face)
    }
}

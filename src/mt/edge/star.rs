//! The star of a vertex that is to be split, with its link numbered locally; the part of a split that looks but does
//! not change anything.
//!
//! A split puts v' and v'' in the place of the vertex c. The tetrahedra of its star go to either, by *sides*: 0 to v', 1 to v''. The faces
//! at c between the two sides are the *fan*; behind each, a tetrahedron with v' and v'' fills the gap. With triangles instead of
//! tetrahedra, where the fan is the edges c b and c d:
//!
//! ```text
//!     a ─────── b                  a ─────── b
//!     │ ╲  0  ╱ │                  │ ╲ 0  ╱╱ │        face opposite c   a b   a d   b e   d e
//!     │   ╲ ╱   │        u+        │   v' ╱  │        side               0     0     1     1
//!     │ 0  c  1 │      ─────▶      │ 0 │ ╲ 1 │        mask               bit 0 is that of a b, ...: 0b1100
//!     │   ╱ ╲   │                  │  ╱ v''  │
//!     │ ╱  1  ╲ │                  │ ╱╱ 1  ╲ │        new: v' v'' b and v' v'' d
//!     d ─────── e                  d ─────── e
//! ```
//!
//! A mask has the bits of the sides in canonical order: ascending by the sorted vertex numbers of the faces opposite c, here with a < b <
//! d < e. So it is the same in every consistent set, whatever the slots are. What must hold: the mask has no bits beyond the star, the fan
//! is one loop or one path ([`Ring::find_fan`]), and all tetrahedra are positive afterwards ([`Ring::is_positive`]).

use crate::geom::orient3d;
use crate::mesh::NONE;
use crate::mt::mesh::limits::{MAX_LINK, MAX_STAR};
use crate::mt::mesh::stars::{GATHERED, LINK_CAPACITY, MARK_BITS, MARK_MASK};
use crate::mt::mesh::tet::{TURN, corner_of};
use crate::mt::mesh::{CurrentMesh, Gather, KindState};
use crate::mt::ranks::rank;

/// "The fan ends here": no index of a fan triangle, but one of an array of [`FAN_CAPACITY`].
pub(in crate::mt) const NO_PARTNER: u8 = FAN_CAPACITY as u8 - 1;

/// One triangle of the fan that parts a star.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::mt) struct FanTriangle {
    /// The tetrahedra of sides 0 and 1, by index into the ring.
    pub near: u8,
    pub far: u8,
    /// In the tetrahedron of side 0, the face that is the fan triangle and the corners at its two link vertices, which
    /// follow each other as the triangles of the fan do.
    pub corners: [u8; 3],
    /// The two link vertices.
    pub ends: [u8; 2],
}

/// The most tetrahedra and link vertices that are numbered: a star that is too large to be split is known by then. A
/// link of triangles that hang together has at most two more vertices than triangles.
const _: () = assert!(LINK_CAPACITY >= 4 * MAX_LINK);

/// A star may be too large by two before that is noticed.
pub(in crate::mt) const RING_CAPACITY: usize = 2 * MAX_STAR;
/// A fan may be too long by three before that is noticed.
pub(in crate::mt) const FAN_CAPACITY: usize = 2 * MAX_LINK;

/// Scratch space for a split: a star and its link, the two sides and the fan between them; and for a collapse.
///
/// The link is a surface: each tetrahedron but the first was found through a face of the one before, and so shares two
/// link vertices with it. Seen from outside, its link triangle is `own`, the vertex that is not shared, and the two
/// shared ones in order; `turn` has the corners at the centre and at these three.
#[derive(Clone, Debug)]
pub(in crate::mt) struct Ring {
    pub len: usize,
    pub tets: [u32; RING_CAPACITY],
    /// The tetrahedron through which each was found.
    pub from: [u32; RING_CAPACITY],
    /// Which corners of each tetrahedron are the centre and the three link vertices.
    pub turn: [[u8; 4]; RING_CAPACITY],
    /// The link vertices of each tetrahedron, one a byte from the lowest.
    pub link_of: [u32; RING_CAPACITY],
    /// For each link vertex the tetrahedron across the face opposite to it, in the same form; where there is none, the
    /// tetrahedron itself.
    pub beside: [u32; RING_CAPACITY],
    pub link_len: usize,
    /// Slots of the link vertices.
    pub link: [u32; LINK_CAPACITY],
    /// Vertex numbers of the link vertices, as signed numbers of the same order: these compare in one instruction.
    pub numbers: [i32; LINK_CAPACITY],
    /// Bit `i` is the side of tetrahedron `i`.
    pub sides: u64,
    pub fan_len: usize,
    pub fan: [FanTriangle; FAN_CAPACITY],
    /// The fan triangle that ends at each link vertex, and that which begins there.
    pub before: [u8; MAX_LINK],
    pub after: [u8; MAX_LINK],
    /// The link vertices as seen from `v'` and from `v''`.
    seen: [[[f64; 3]; MAX_LINK]; 2],
    /// For a collapse: the stars of `v'` and `v''`.
    pub halves: [HalfStar; 2],
    /// Scratch space for the offsets of the fields.
    pub field_offsets: Vec<i32>,
}

impl KindState for Ring {
    fn bytes(&self) -> u64 {
        size_of_val(self) as u64
    }
}

impl Default for Ring {
    fn default() -> Self {
        Self {
            len: 0,
            tets: [0; RING_CAPACITY],
            from: [0; RING_CAPACITY],
            turn: [[0; 4]; RING_CAPACITY],
            link_of: [0; RING_CAPACITY],
            beside: [0; RING_CAPACITY],
            link_len: 0,
            link: [0; LINK_CAPACITY],
            numbers: [0; LINK_CAPACITY],
            sides: 0,
            fan_len: 0,
            fan: [FanTriangle::default(); FAN_CAPACITY],
            before: [0; MAX_LINK],
            after: [0; MAX_LINK],
            seen: [[[0.0; 3]; MAX_LINK]; 2],
            halves: [HalfStar::default(), HalfStar::default()],
            field_offsets: Vec::new(),
        }
    }
}

/// The tetrahedra around one of the two vertices of an edge that is to be collapsed.
#[derive(Clone, Debug)]
pub(in crate::mt) struct HalfStar {
    pub len: usize,
    pub tets: [u32; HALF_CAPACITY],
    /// The tetrahedron through which each was found.
    pub from: [u32; HALF_CAPACITY],
}

/// A star may be too large by three before that is noticed.
pub(in crate::mt) const HALF_CAPACITY: usize = 2 * GATHERED;

impl Default for HalfStar {
    fn default() -> Self {
        Self { len: 0, tets: [0; HALF_CAPACITY], from: [0; HALF_CAPACITY] }
    }
}

impl HalfStar {
    /// The tetrahedra that were gathered.
    #[inline]
    pub fn tets(&self) -> &[u32] {
        &self.tets[..self.len.min(HALF_CAPACITY)]
    }

    /// Whether there are more than [`GATHERED`].
    #[inline]
    pub fn is_too_large(&self) -> bool {
        self.len > GATHERED
    }
}

/// Three indices that share a word.
#[inline]
pub(in crate::mt) fn three(word: u32) -> [usize; 3] {
    [0, 8, 16].map(|shift| (word >> shift & 0xFF) as usize)
}

impl Ring {
    /// Parts the star by a mask in canonical order: ascending by the sorted vertex numbers of the opposite faces.
    /// False if the mask has bits beyond the star.
    #[inline]
    pub fn find_sides(&mut self, mask: u64) -> bool {
        if self.len < 64 && mask >> self.len != 0 {
            return false;
        }
        let mut numbers = [i32::MAX; MAX_LINK];
        numbers[..self.link_len].copy_from_slice(&self.numbers[..self.link_len]);
        let mut order = [0; MAX_LINK];
        rank(&numbers, self.link_len, &mut order);
        // Three ranks of five bits: as few as that, a whole star is ranked with a handful of vector instructions.
        let mut keys = [i16::MAX; MAX_STAR];
        for (key, &link) in keys.iter_mut().zip(&self.link_of[..self.len]) {
            let [a, b, c] = three(link).map(|x| order[x % MAX_LINK] as i16);
            let (low, high) = (a.min(b), a.max(b));
            let (least, most) = (low.min(c), high.max(c));
            *key = least << 10 | low.max(c.min(high)) << 5 | most;
        }
        let mut place = [0; MAX_STAR];
        rank(&keys, self.len, &mut place);
        self.sides =
            place[..self.len].iter().enumerate().fold(0, |s, (i, &r)| s | (mask >> (r & 63) & 1) << i);
        true
    }

    /// Finds the fan between the two sides, if it parts the star as a split must: its triangles follow each other
    /// around a closed loop of the link, or along one path. A path ends at the border of the link, since around an
    /// inner vertex of the link the sides change an even number of times. On its way it may touch the border: the
    /// fan tetrahedra hold the parts of that side together.
    ///
    /// Side 0 lies on the same hand of every step of that way. Where two steps leave from a link vertex, or two arrive,
    /// three triangles meet in an edge, or two whose tetrahedra would lie on the same side of the face between them
    /// (around an edge where the mesh is not a manifold).
    #[inline]
    pub fn find_fan(&mut self) -> bool {
        self.fan_len = 0;
        (self.before, self.after) = ([NO_PARTNER; MAX_LINK], [NO_PARTNER; MAX_LINK]);
        let (mut left, mut reached, mut twice) = (0_u32, 0_u32, 0_u32);
        let mut rest = !self.sides & u64::MAX >> (64 - self.len);
        while rest != 0 {
            let i = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            let beside = three(self.beside[i]);
            let ([_, j, k, l], [a, b, c]) = (self.turn[i], three(self.link_of[i]).map(|x| x as u8));
            // Whether a face is of the fan is a coin toss for the processor: the triangle after the last one is written
            // anyway, and counted if it belongs there.
            for (far, corners, ends) in [
                (beside[0], [j, k, l], [b, c]),
                (beside[1], [k, l, j], [c, a]),
                (beside[2], [l, j, k], [a, b]),
            ] {
                self.fan[self.fan_len % FAN_CAPACITY] =
                    FanTriangle { near: i as u8, far: far as u8, corners, ends };
                self.fan_len += (self.sides >> (far & 63) & 1) as usize;
            }
            if self.fan_len > MAX_LINK {
                return false;
            }
        }
        for (f, triangle) in (0..).zip(&self.fan[..self.fan_len]) {
            let [start, end] = triangle.ends.map(|x| x as usize % MAX_LINK);
            self.after[start] = f;
            self.before[end] = f;
            twice |= left & 1 << start | reached & 1 << end;
            left |= 1 << start;
            reached |= 1 << end;
        }
        let start = left & !reached;
        let first = if start == 0 { 0 } else { self.after[start.trailing_zeros() as usize] };
        twice == 0
            && (left ^ reached).count_ones() <= 2
            && self.fan_len > 0
            && self.walk(first) == self.fan_len
    }

    /// Number of triangles met when going along the fan from `start`: once around, or to the end.
    #[inline]
    fn walk(&self, start: u8) -> usize {
        let (mut at, mut count) = (start, 0);
        while count < self.fan_len {
            count += 1;
            at = self.after[self.fan[at as usize % FAN_CAPACITY].ends[1] as usize % MAX_LINK];
            if at == NO_PARTNER || at == start {
                break;
            }
        }
        count
    }

    /// Whether all tetrahedra after the split are positive, given the positions of `v'` and `v''`; exactly.
    #[inline]
    pub fn is_positive(&mut self, mesh: &CurrentMesh, halves: [[i32; 3]; 2], lattice_bits: u32) -> bool {
        let difference = |p: [i32; 3], q: [i32; 3]| [0, 1, 2].map(|k| f64::from(p[k] - q[k]));
        for (i, &v) in self.link[..self.link_len.min(MAX_LINK)].iter().enumerate() {
            let position = mesh.positions[v as usize];
            self.seen[0][i] = difference(position, halves[0]);
            self.seen[1][i] = difference(position, halves[1]);
        }
        let doubt = doubt(lattice_bits);
        let corner = |side: usize, x: usize| self.seen[side][x % MAX_LINK];
        // The centre followed by the opposite face, outward, is a positive order.
        let star = (0..self.len).all(|i| {
            let side = (self.sides >> i & 1) as usize;
            is_positive(three(self.link_of[i]).map(|x| corner(side, x)), doubt)
        });
        // v' sees v'' beyond the fan triangle, whose ends turn the other way round than in the tetrahedron of side 0.
        let across = difference(halves[1], halves[0]);
        star && self.fan[..self.fan_len].iter().all(|triangle| {
            let [a, b] = triangle.ends.map(|x| corner(0, x as usize));
            is_positive([across, b, a], doubt)
        })
    }
}

/// Below this, the sign of a determinant in floating-point numbers is in doubt. With differences `d` of `b` bits and
/// the unit `e = 2^-53`, an error is at most `32 e d^3`; up to 16 bits all that comes up is a whole number below 2^53.
fn doubt(lattice_bits: u32) -> f64 {
    if lattice_bits <= 16 { 0.0 } else { (1_u64 << (3 * lattice_bits - 48).min(63)) as f64 }
}

/// Whether three whole vectors are right-handed, exactly.
#[inline]
fn is_positive([u, v, w]: [[f64; 3]; 3], doubt: f64) -> bool {
    let determinant = (u[1] * v[2] - u[2] * v[1]) * w[0]
        + (u[2] * v[0] - u[0] * v[2]) * w[1]
        + (u[0] * v[1] - u[1] * v[0]) * w[2];
    determinant > doubt || determinant >= -doubt && is_positive_exactly([u, v, w])
}

#[cold]
fn is_positive_exactly(vectors: [[f64; 3]; 3]) -> bool {
    let [u, v, w] = vectors.map(|u| u.map(|x| x as i32));
    orient3d([0; 3], u, v, w) > 0
}

impl CurrentMesh {
    /// Collects the tetrahedra around the vertex in `slot` with their link, and marks them. Stops if an update before
    /// `update` splits a link vertex.
    #[inline]
    pub(in crate::mt) fn gather_ring(
        &mut self,
        slot: u32,
        update: u32,
        ring: &mut Ring,
    ) -> Result<(), Gather<u32>> {
        self.next_epoch();
        let first = self.incident[slot as usize];
        let (tet, around) = (self.tets[first as usize], self.neighbors[first as usize]);
        let (mut len, mut queued, mut first_split) = (0, 1, NONE);
        ring.link_len = 0;
        // As if the first tetrahedron had been found through one of its faces.
        let centre = corner_of(&tet, slot);
        let [_, through, k, l] = TURN[4 * centre + (centre + 1) % 4].map(|corner| corner as usize & 3);
        let a = self.number(tet[k], ring, &mut first_split);
        let b = self.number(tet[l], ring, &mut first_split);
        self.marks[first as usize] = self.epoch << MARK_BITS;
        ring.tets[0] = first;
        ring.link_of[0] = a << 8 | b << 16;
        ring.beside[0] = self.follow(around[through], [first, 0], b << 8 | a << 16, ring, &mut queued);
        while len < queued {
            if queued as usize > MAX_STAR {
                return Err(Gather::TooLarge);
            }
            let place = len as usize % RING_CAPACITY;
            let t = ring.tets[place];
            let (tet, around) = (self.tets[t as usize], self.neighbors[t as usize]);
            let from = if len == 0 { through } else { corner_of(&around, ring.from[place]) };
            let turn = TURN[(4 * corner_of(&tet, slot) + from) % 16];
            let [_, own, k, l] = turn.map(|corner| corner as usize & 3);
            let x = self.number(tet[own], ring, &mut first_split);
            if first_split < update {
                return Err(Gather::Stopped(first_split));
            }
            let link = ring.link_of[place] | x;
            let beyond_k = self.follow(around[k], [t, len], x << 8 | link & 0xFF_0000, ring, &mut queued);
            let beyond_l = self.follow(around[l], [t, len], link & 0xFF00 | x << 16, ring, &mut queued);
            ring.turn[place] = turn;
            ring.link_of[place] = link;
            ring.beside[place] |= beyond_k << 8 | beyond_l << 16;
            len += 1;
        }
        ring.len = len as usize;
        Ok(())
    }

    /// The index of tetrahedron `n` in the ring, found through a face of `t` with the index `behind`; that index again
    /// if there is none.
    ///
    /// Whether it is new is a coin toss for the processor: the entry after the last one is written anyway, and counted if
    /// it was new. Lengths stay below the capacities, so the remainders change nothing.
    #[inline(always)]
    fn follow(
        &mut self,
        n: u32,
        [t, behind]: [u32; 2],
        shared: u32,
        ring: &mut Ring,
        queued: &mut u32,
    ) -> u32 {
        // Also NONE is beyond the array.
        let Some(old) = self.marks.get_mut(n as usize) else { return behind };
        let mark = self.epoch << MARK_BITS;
        let is_new = *old & !MARK_MASK != mark;
        let own = if is_new { mark | *queued } else { *old };
        *old = own;
        let place = *queued as usize % RING_CAPACITY;
        ring.tets[place] = n;
        ring.from[place] = t;
        ring.link_of[place] = shared;
        ring.beside[place] = behind;
        *queued += u32::from(is_new);
        own & MARK_MASK
    }

    /// The index of a link vertex in the ring, where it is put if it is new.
    #[inline(always)]
    fn number(&mut self, v: u32, ring: &mut Ring, first_split: &mut u32) -> u32 {
        let mark = self.epoch << MARK_BITS;
        let old = &mut self.vertex_marks[v as usize];
        let is_new = *old & !MARK_MASK != mark;
        let own = if is_new { mark | ring.link_len as u32 } else { *old };
        *old = own;
        let place = ring.link_len % LINK_CAPACITY;
        let labels = self.labels[v as usize];
        ring.link[place] = v;
        // The shift keeps the order.
        ring.numbers[place] = (labels.vertex ^ 1 << 31) as i32;
        ring.link_len += usize::from(is_new);
        *first_split = labels.kind_word.0.min(*first_split);
        own & MARK_MASK
    }

    /// Collects the tetrahedra around the vertex in `slot`, as [`CurrentMesh::gather_ring`] does, and returns the largest
    /// number of a vertex of theirs. Stops at one that is larger than `largest`; where the star is too large, those that
    /// were found are searched all the same.
    #[inline]
    pub(in crate::mt) fn gather_half(&mut self, slot: u32, largest: u32, half: &mut HalfStar) -> u32 {
        self.next_epoch();
        let first = self.incident[slot as usize];
        let (tet, around) = (self.tets[first as usize], self.neighbors[first as usize]);
        let mut newest = tet.iter().fold(0, |newest, &v| self.labels[v as usize].vertex.max(newest));
        self.marks[first as usize] = self.epoch << MARK_BITS;
        half.tets[0] = first;
        let (mut len, mut queued) = (1, 1);
        let centre = corner_of(&tet, slot);
        for k in [1, 2, 3] {
            self.follow_half(around[(centre + k) % 4], first, half, &mut queued);
        }
        while len < queued && queued <= GATHERED && newest <= largest {
            let place = len % HALF_CAPACITY;
            let t = half.tets[place];
            let (tet, around) = (self.tets[t as usize], self.neighbors[t as usize]);
            let from = corner_of(&around, half.from[place]);
            let turn = TURN[(4 * corner_of(&tet, slot) + from) % 16];
            let [_, own, k, l] = turn.map(|corner| corner as usize & 3);
            newest = self.labels[tet[own] as usize].vertex.max(newest);
            self.follow_half(around[k], t, half, &mut queued);
            self.follow_half(around[l], t, half, &mut queued);
            len += 1;
        }
        half.len = queued;
        if queued > GATHERED { newest.max(self.newest_of(half.tets())) } else { newest }
    }

    #[inline(always)]
    fn follow_half(&mut self, n: u32, t: u32, half: &mut HalfStar, queued: &mut usize) {
        // Also NONE is beyond the array.
        let Some(old) = self.marks.get_mut(n as usize) else { return };
        let is_new = *old >> MARK_BITS != self.epoch;
        *old = self.epoch << MARK_BITS;
        half.tets[*queued % HALF_CAPACITY] = n;
        half.from[*queued % HALF_CAPACITY] = t;
        *queued += usize::from(is_new);
    }

    /// The largest number of a vertex of these tetrahedra.
    #[cold]
    fn newest_of(&self, tets: &[u32]) -> u32 {
        let vertices = tets.iter().flat_map(|&t| self.tets[t as usize]);
        vertices.map(|v| self.labels[v as usize].vertex).max().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mt::mesh::stars::EPOCHS;
    use crate::mt::mesh::stars::tests::wheel;

    #[test]
    fn marks_of_long_ago_are_forgotten_when_the_epochs_start_again() {
        let mut mesh = wheel(20);
        for _ in 0..3 {
            mesh.with_kind_state(|mesh, ring: &mut Ring| {
                assert!(mesh.gather_ring(0, 0, ring).is_ok());
                assert_eq!((ring.len, ring.link_len, mesh.epoch), (20, 21, 1));
            });
            mesh.epoch = EPOCHS - 1;
        }
    }

    #[test]
    fn orientations_are_exact_on_the_widest_lattices() {
        let plain = |[u, v, w]: [[i64; 3]; 3]| {
            let [u, v, w] = [u, v, w].map(|p| p.map(i128::from));
            (u[1] * v[2] - u[2] * v[1]) * w[0]
                + (u[2] * v[0] - u[0] * v[2]) * w[1]
                + (u[0] * v[1] - u[1] * v[0]) * w[2]
        };
        // Numbers of Fibonacci: `u` and `v` have a determinant of 1 in a plane, so that of all three is as large as `lift`.
        let (u, v) = ([102_334_155, 165_580_141, 123_456_789], [165_580_141, 267_914_296, -300_000_007]);
        for lift in -3..=3 {
            let w = [u[0] + v[0], u[1] + v[1], u[2] + v[2] + lift];
            for vectors in [[u, v, w], [v, u, w], [w, u, v], [w, v, u]] {
                let told = is_positive(vectors.map(|p| p.map(|x| x as f64)), doubt(crate::geom::WIDE_BITS));
                assert_eq!(told, plain(vectors) > 0, "{vectors:?}");
            }
        }
    }
}

//! Scratch space for insertions and removals: T_u and the star that an insertion makes.
//!
//! Every tetrahedron of T_u has the near vertex n. In the star that the insertion of v makes, each of them has v in its place, and takes its
//! slot; and behind each face of T_u that has n and does not go with the tetrahedron (that is no *inner* face), a tetrahedron with n and
//! v fills the gap. With triangles instead of tetrahedra, where the edge n b is an inner face and n a and n c are not:
//!
//! ```text
//!    T_u, around n            the star of v
//!
//!      a ───── b                a ───── b
//!      │  0  ╱ │                │ ╲ 0 ╱ │          0, 1   take the slots of T_u: they have v instead of n
//!      │   ╱   │      u+        │   v   │          2, 3   fill the gaps: they have n and v
//!      │ ╱  1  │    ─────▶      │2 ╱ ╲ 1│          link   n, a, b, c: the vertices of Π_u; n is the first
//!      n ───── c                │ ╱ 3 ╲ │
//!                               n ───── c
//! ```
//!
//! What must hold: no face that stays has tetrahedra of T_u on both sides; the gaps lie around the edge n v in one piece
//! ([`Scratch::close_ring`]); and all tetrahedra of the star are positive ([`Scratch::is_positive`]). The removal of v undoes this: what
//! has v and n goes, what has v alone gets n in its place.

use crate::geom::{NARROW_BITS, det_i64, orient3d};
use crate::mesh::FACES;
use crate::mt::CurrentMesh;
use crate::mt::mesh::stars::{GATHERED, Star};

/// Most tetrahedra of a star, and most vertices of its link.
pub(in crate::mt) const MOST: usize = GATHERED;

/// Stands for the new vertex among the corners of a [`NewTet`].
pub(in crate::mt) const NEW: u8 = 0xFF;

/// No tetrahedron of the new star.
pub(in crate::mt) const NO_ENTRY: u8 = 0xFF;

/// A tetrahedron of the star that an insertion makes.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::mt) struct NewTet {
    /// The corners by index into the link, [`NEW`] for the new vertex; positive.
    pub corners: [u8; 4],
    /// Across each face that has the new vertex, the tetrahedron of the star, [`NO_ENTRY`] at the boundary.
    pub across: [u8; 4],
    /// Which corner is the new vertex.
    pub own: u8,
    /// What lies across the face opposite the new vertex.
    pub beyond: u32,
    /// The slot of T_u that it takes, or along whose face it fills the gap.
    pub source: u32,
    /// The update that removes it.
    pub remover: u32,
    /// Which faces go with it.
    pub inner: u8,
}

/// Scratch space for insertions and removals.
#[derive(Clone, Debug)]
pub(in crate::mt) struct Scratch {
    /// T_u.
    pub removed: [u32; MOST],
    pub removed_len: usize,
    /// The star: first what takes the slots of T_u in its order, then what fills the gaps.
    pub star: [NewTet; MOST],
    pub star_len: usize,
    /// Slots of the vertices of Π_u; the near vertex is the first.
    pub link: [u32; MOST],
    pub link_len: usize,
    /// Around the edge from the near to the new vertex: a link vertex, a gap, and the corner of that opposite the face
    /// which has the vertex.
    pub ends: Vec<u32>,
    pub levels: Vec<i32>,
    pub gathered: Star,
    /// A hash of the label of each vertex of the link; then that of the new vertex.
    pub hashes: Vec<u64>,
    /// For each tetrahedron of the star, the sum of those of its corners.
    pub tet_hashes: Vec<u64>,
    /// The star in canonical order: hashes whose lowest bits are replaced by the place in the star.
    pub sorted: Vec<u64>,
}

impl Default for Scratch {
    fn default() -> Self {
        Self {
            removed: [0; MOST],
            removed_len: 0,
            star: [NewTet::default(); MOST],
            star_len: 0,
            link: [0; MOST],
            link_len: 0,
            ends: Vec::new(),
            levels: Vec::new(),
            gathered: Star::default(),
            hashes: Vec::new(),
            tet_hashes: Vec::new(),
            sorted: Vec::new(),
        }
    }
}

impl Scratch {
    /// The index of a vertex in the link, where it is put if it is new.
    #[inline]
    pub fn number(&mut self, mesh: &mut CurrentMesh, v: u32) -> Option<u8> {
        let next = self.link_len;
        if let Some(known) = mesh.number_slot(v, next as u32) {
            return Some(known as u8);
        }
        // One less than all numbers, so that a mark never overflows.
        *self.link.get_mut(next).filter(|_| next + 1 < MOST)? = v;
        self.link_len += 1;
        Some(next as u8)
    }

    /// Adds the tetrahedron that fills the gap behind a face of tetrahedron `t` of T_u, whose corner `at` is the near vertex.
    #[inline]
    pub fn add_gap(
        &mut self,
        of: u8,
        corners: &[u8; 4],
        [at, face]: [usize; 2],
        beyond: u32,
        t: u32,
    ) -> Option<u8> {
        let place = self.star_len;
        if place == MOST {
            return None;
        }
        let mut new = NewTet { corners: *corners, own: face as u8, beyond, source: t, ..NewTet::default() };
        new.corners[face] = NEW;
        new.across = [NO_ENTRY; 4];
        new.across[at] = of;
        for corner in (0..4).filter(|&k| k != at && k != face) {
            // The face opposite this corner has the other one.
            let other = 6 - at - face - corner;
            self.ends.push(u32::from_be_bytes([0, corners[other], place as u8, corner as u8]));
        }
        self.star[place] = new;
        self.star_len += 1;
        Some(place as u8)
    }

    /// Joins the tetrahedra that fill gaps. All have the edge from the near to the new vertex: they must close up around it, or run from
    /// boundary to boundary, in one piece.
    ///
    /// ```text
    ///   seen along that edge, +        each gap has two faces with the edge, each with one vertex of the link:
    ///                                  for both there is an entry in `ends`, which are sorted by these vertices
    ///       b            b
    ///     1 │ 2        1 │ 2           closed   a0 a1 │ b1 b2 │ c2 c3 │ d0 d3     each vertex twice
    ///   a ──+── c    a ──+── c         open     a1 │ b1 b2 │ c2                   but for two of them
    ///     0 │ 3
    ///       d
    /// ```
    ///
    /// Two gaps with an entry at the same vertex meet in the face there. With three at a vertex, more than two gaps would meet. With one,
    /// the face is of the boundary: there are none or two such ends. As every gap has two sides, the gaps then form circles, or one path
    /// and circles; that all are met on the way from one to the next shows that it is a single circle, or the path alone.
    pub fn close_ring(&mut self) -> Option<()> {
        let gaps = self.ends.len() / 2;
        if gaps == 0 {
            return None;
        }
        self.ends.sort_unstable();
        // From one end, or from anywhere, all must be met.
        let start = match self.join_gaps()? {
            (0, _) => parts(self.ends[0]).1,
            (2, lone) => lone?,
            _ => return None,
        };
        (self.met_from(start, gaps) == gaps).then_some(())
    }

    /// Joins the gaps that meet in a face, given the sorted ends. Returns how many ends are alone at their vertex, and the gap of the
    /// first of them; none if three are at one.
    #[inline]
    fn join_gaps(&mut self) -> Option<(usize, Option<u8>)> {
        let (mut alone, mut first, mut i) = (0, None, 0);
        while i < self.ends.len() {
            let (v, gap, corner) = parts(self.ends[i]);
            let next = self.ends.get(i + 1).map(|&end| parts(end)).filter(|next| next.0 == v);
            let Some((_, other, side)) = next else {
                alone += 1;
                first = first.or(Some(gap));
                i += 1;
                continue;
            };
            if self.ends.get(i + 2).is_some_and(|&third| parts(third).0 == v) {
                return None;
            }
            self.star[gap as usize % MOST].across[corner as usize & 3] = other;
            self.star[other as usize % MOST].across[side as usize & 3] = gap;
            i += 2;
        }
        Some((alone, first))
    }

    /// How many gaps are met from `start` on, each behind a face of the one before: once around, or to the end. No more than one above
    /// `most` are counted.
    #[inline]
    fn met_from(&self, start: u8, most: usize) -> usize {
        let (mut met, mut from, mut at) = (1, NO_ENTRY, start);
        while met <= most {
            let NewTet { corners, across, own, .. } = self.star[at as usize % MOST];
            // Opposite the new vertex is no gap, and opposite the near vertex (0) is what T_u left.
            let next = (0..4).filter(|&k| k != own as usize && corners[k] != 0).map(|k| across[k]);
            let Some(next) = next.filter(|&n| n != NO_ENTRY && n != from).min() else { break };
            if next == start {
                break;
            }
            (from, at) = (at, next);
            met += 1;
        }
        met
    }

    /// Hashes the labels of the star.
    pub fn hash_star(&mut self, mesh: &CurrentMesh, vertex: u32) {
        let Self { star, star_len, link, link_len, hashes, tet_hashes, .. } = self;
        let labels = link[..*link_len].iter().map(|&slot| mesh.vertex(slot).0).chain([vertex]);
        hash_labels(labels, &star[..*star_len], hashes, tet_hashes);
    }

    /// Puts the star, which has been hashed, into canonical order.
    pub fn sort_star(&mut self) {
        const PLACE: u64 = MOST as u64 - 1;
        self.sorted.clear();
        self.sorted.extend((0..).zip(&self.tet_hashes).map(|(i, hash)| hash & !PLACE | i));
        self.sorted.sort_unstable();
    }

    /// Whether all tetrahedra of the star are positive with the new vertex at `position`.
    pub fn is_positive(&self, mesh: &CurrentMesh, position: [i32; 3]) -> bool {
        let link = self.link[..self.link_len].iter().map(|&v| mesh.positions[v as usize]);
        is_positive(&self.star[..self.star_len], link, position)
    }

    /// Predicts the levels of a vertex at `position` from those around it.
    pub fn predict_levels(&mut self, mesh: &CurrentMesh, position: [i32; 3]) {
        self.levels.resize(mesh.fields, 0);
        let link = self.link[..self.link_len].iter();
        let link = link.map(|&v| (mesh.positions[v as usize], mesh.levels(v)));
        predict_levels(link, position, &mut self.levels);
    }
}

/// Hashes the labels of the vertices of a link, of which the new vertex comes last, and for each tetrahedron of the star the sum of those
/// of its corners.
pub(super) fn hash_labels(
    labels: impl Iterator<Item = u32>,
    star: &[NewTet],
    hashes: &mut Vec<u64>,
    tet_hashes: &mut Vec<u64>,
) {
    hashes.clear();
    hashes.extend(labels.map(spread));
    tet_hashes.clear();
    let hash = |corner: u8| hashes[usize::from(corner).min(hashes.len() - 1)];
    let sum = |new: &NewTet| new.corners.iter().fold(0, |sum: u64, &corner| sum.wrapping_add(hash(corner)));
    tet_hashes.extend(star.iter().map(sum));
}

/// Whether all tetrahedra of a star are positive with the new vertex at `position`, given those of its link.
pub(super) fn is_positive(star: &[NewTet], link: impl Iterator<Item = [i32; 3]>, position: [i32; 3]) -> bool {
    let (mut from, mut largest) = ([[0_i64; 3]; MOST], 0);
    for (from, p) in from.iter_mut().zip(link) {
        for k in 0..3 {
            from[k] = i64::from(p[k]) - i64::from(position[k]);
            largest |= from[k].unsigned_abs();
        }
    }
    let narrow = largest <= 1 << NARROW_BITS;
    star.iter().all(|new| {
        let [i, j, k] = FACES[new.own as usize & 3].map(|corner| new.corners[corner] as usize % MOST);
        if narrow {
            return det_i64(from[i], from[j], from[k]) > 0;
        }
        let at = |x: usize| [0, 1, 2].map(|k| (from[x][k] + i64::from(position[k])) as i32);
        orient3d(position, at(i), at(j), at(k)) > 0
    })
}

/// Predicts the levels of a vertex at `position` from positions and levels around it: means by inverse squared distance, in whole
/// numbers, so that the order of the link does not matter.
pub(super) fn predict_levels<'a>(
    link: impl Iterator<Item = ([i32; 3], &'a [i32])> + Clone,
    position: [i32; 3],
    levels: &mut [i32],
) {
    let largest = link.clone().map(|(p, _)| squared(p, position)).max().unwrap_or(1).max(1);
    for (field, level) in levels.iter_mut().enumerate() {
        let (mut total, mut sum) = (0_u128, 0_u128);
        for (p, levels) in link.clone() {
            let weight = weight(largest, squared(p, position));
            total += weight;
            // Levels are not negative.
            sum += weight * u128::from(levels[field].unsigned_abs());
        }
        *level = mean(sum, total.max(1)) as i32;
    }
}

/// The parts of an entry of [`Scratch::ends`].
#[inline]
fn parts(end: u32) -> (u8, u8, u8) {
    let [_, vertex, gap, corner] = end.to_be_bytes();
    (vertex, gap, corner)
}

/// The squared distance of two positions.
#[inline]
fn squared(p: [i32; 3], position: [i32; 3]) -> u64 {
    // Less than 2^62 each: positions are on lattices of at most 30 bits.
    (0..3).map(|k| u64::from(p[k].abs_diff(position[k]))).fold(0, |sum, d| sum.saturating_add(d * d))
}

#[inline]
fn weight(largest: u64, squared: u64) -> u128 {
    let squared = squared.max(1);
    // Short numbers divide many times as fast.
    if largest < 1 << (64 - WEIGHT_BITS) {
        u128::from((largest << WEIGHT_BITS) / squared)
    } else {
        (u128::from(largest) << WEIGHT_BITS) / u128::from(squared)
    }
}

/// The quotient, rounded.
#[inline]
fn mean(sum: u128, total: u128) -> u128 {
    match (u64::try_from(2 * sum + total), u64::try_from(2 * total)) {
        (Ok(sum), Ok(total)) => u128::from(sum / total),
        _ => (2 * sum + total) / (2 * total),
    }
}

/// Weights of the vertices around a new one have at least so many bits.
const WEIGHT_BITS: u32 = 8;

/// Spreads a label over the bits of a word (the constants are those of SplitMix64).
#[inline]
pub(in crate::mt) fn spread(label: u32) -> u64 {
    let x = u64::from(label).wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let x = (x ^ x >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ x >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ x >> 31
}

//! The star of a vertex that is to be split, with its link numbered locally; the part of a split that looks but does
//! not change anything.

use super::CurrentMesh;
use super::MAX_LINK;
use super::MAX_STAR;
use crate::mesh::FACES;
use std::iter::Sum;
use std::ops::{Add, Mul, Sub};

/// "The fan ends here."
pub(super) const NO_PARTNER: u8 = u8::MAX;

/// `REST[i][j]`: the two corners other than `i` and `j`, ascending.
pub(super) const REST: [[[u8; 2]; 4]; 4] = [
    [[0, 0], [2, 3], [1, 3], [1, 2]],
    [[2, 3], [0, 0], [0, 3], [0, 2]],
    [[1, 3], [0, 3], [0, 0], [0, 1]],
    [[1, 2], [0, 2], [0, 1], [0, 0]],
];

/// One triangle of the fan that parts a star, by indices into the ring.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FanTriangle {
    /// The tetrahedron of side 0.
    pub near: u8,
    /// Its face that is the fan triangle.
    pub face: u8,
    /// The tetrahedron of side 1.
    pub far: u8,
    /// At both link vertices, in the order of [`REST`], the triangle that shares the edge to it.
    pub partner: [u8; 2],
}

/// The most link vertices that are numbered: a star that is too large to be split is known by then. A link of at
/// most [`MAX_STAR`] triangles that hang together has two more vertices than triangles at most.
pub(super) const LINK_CAPACITY: usize = 4 * MAX_LINK;

/// Scratch space for a split: a star and its link, the two sides and the fan between them.
#[derive(Clone, Debug)]
pub(super) struct Ring {
    pub len: usize,
    pub tets: [u32; MAX_STAR],
    pub verts: [[u32; 4]; MAX_STAR],
    /// Which corner of each tetrahedron is the centre.
    pub corner: [u8; MAX_STAR],
    /// The link vertices of each tetrahedron; the centre's entry is unused.
    pub local: [[u8; 4]; MAX_STAR],
    pub link_len: usize,
    /// Slots of the link vertices.
    pub link: [u32; LINK_CAPACITY],
    /// Bit `i` is the side of tetrahedron `i`.
    pub sides: u64,
    pub fan_len: usize,
    pub fan: [FanTriangle; MAX_LINK],
}

impl Default for Ring {
    fn default() -> Self {
        Self {
            len: 0,
            tets: [0; MAX_STAR],
            verts: [[0; 4]; MAX_STAR],
            corner: [0; MAX_STAR],
            local: [[0; 4]; MAX_STAR],
            link_len: 0,
            link: [0; LINK_CAPACITY],
            sides: 0,
            fan_len: 0,
            fan: [FanTriangle::default(); MAX_LINK],
        }
    }
}

impl Ring {
    /// Parts the star by a mask in canonical order: ascending by the sorted vertex numbers of the opposite faces.
    /// False if the mask has bits beyond the star.
    #[inline]
    pub fn find_sides(&mut self, mesh: &CurrentMesh, mask: u64) -> bool {
        if self.len < 64 && mask >> self.len != 0 {
            return false;
        }
        let mut numbers = [i32::MAX; MAX_LINK];
        for (number, &v) in numbers.iter_mut().zip(&self.link[..self.link_len]) {
            // Signed numbers compare in one instruction; the shift keeps the order.
            *number = (mesh.labels[v as usize].vertex ^ 1 << 31) as i32;
        }
        let rank: [i32; MAX_LINK] = ranks(&numbers, self.link_len);
        // Three ranks of five bits: as few as that, a whole star is ranked with a handful of vector instructions.
        let mut keys = [i16::MAX; MAX_STAR];
        for (i, key) in keys[..self.len].iter_mut().enumerate() {
            let [j, k, l] = FACES[self.corner[i] as usize & 3];
            let [a, b, c] = [j, k, l].map(|k| rank[self.local[i][k & 3] as usize % MAX_LINK] as i16);
            let (low, high) = (a.min(b), a.max(b));
            let (least, most) = (low.min(c), high.max(c));
            *key = least << 10 | low.max(c.min(high)) << 5 | most;
        }
        let place: [i16; MAX_STAR] = ranks(&keys, self.len);
        self.sides =
            place[..self.len].iter().enumerate().fold(0, |s, (i, &r)| s | (mask >> (r & 63) & 1) << i);
        true
    }

    /// Finds the fan between the two sides, if it parts the star as a split must: its triangles follow each other
    /// around a closed loop of the link, or along one path. A path ends at the border of the link, since around an
    /// inner vertex of the link the sides change an even number of times. On its way it may touch the border: the
    /// fan tetrahedra hold the parts of that side together.
    #[inline]
    pub fn find_fan(&mut self, mesh: &CurrentMesh) -> bool {
        self.fan_len = 0;
        for i in (0..self.len).filter(|i| self.sides >> i & 1 == 0) {
            let around = mesh.neighbors[self.tets[i] as usize];
            for &j in &FACES[self.corner[i] as usize & 3] {
                let Some(n) = mesh.in_star(around[j]).filter(|n| self.sides >> n & 1 == 1) else { continue };
                let triangle =
                    FanTriangle { near: i as u8, face: j as u8, far: n as u8, partner: [NO_PARTNER; 2] };
                let Some(place) = self.fan.get_mut(self.fan_len) else { return false };
                *place = triangle;
                self.fan_len += 1;
            }
        }
        let Some(loose) = self.find_partners() else { return false };
        let start = match loose {
            0 => 0,
            2 => {
                let ends_here = |f: &FanTriangle| f.partner.contains(&NO_PARTNER);
                self.fan[..self.fan_len].iter().position(ends_here).unwrap_or(0)
            }
            _ => return false,
        };
        self.fan_len > 0 && self.walk(start) == self.fan_len
    }

    /// Finds, for both link vertices of every triangle, the other triangle there. Returns how many have none;
    /// nothing if three triangles meet in an edge, or two whose tetrahedra would lie on the same side of the face
    /// between them (around an edge where the mesh is not a manifold).
    #[inline]
    fn find_partners(&mut self) -> Option<usize> {
        let mut open = [NO_PARTNER; MAX_LINK];
        let mut parity = [0; MAX_LINK];
        let mut closed = 0_u32;
        let mut loose = 0;
        for f in 0..self.fan_len {
            let FanTriangle { near, face, .. } = self.fan[f];
            let (c, j) = (self.corner[near as usize] as usize, face as usize);
            let ends = REST[c][j];
            // Whether the corners (v'', v', first end, second end) are an odd permutation of the tetrahedron's.
            let odd = (c + j + usize::from(c < j)) & 1;
            for (side, end) in ends.into_iter().enumerate() {
                let x = self.local[near as usize][end as usize] as usize;
                if closed >> x & 1 == 1 || (open[x] != NO_PARTNER && parity[x] == odd ^ side) {
                    return None;
                }
                if open[x] == NO_PARTNER {
                    open[x] = (f * 2 + side) as u8;
                    parity[x] = odd ^ side;
                    loose += 1;
                } else {
                    let other = open[x] as usize;
                    self.fan[other / 2].partner[other % 2] = f as u8;
                    self.fan[f].partner[side] = (other / 2) as u8;
                    closed |= 1 << x;
                    loose -= 1;
                }
            }
        }
        Some(loose)
    }

    /// Number of triangles met when going along the fan from `start`: once around, or to the end.
    #[inline]
    fn walk(&self, start: usize) -> usize {
        let mut entered =
            usize::from(self.fan[start].partner[0] != NO_PARTNER && self.fan[start].partner[1] == NO_PARTNER);
        let (mut at, mut count) = (start, 0);
        while count < self.fan_len {
            count += 1;
            let next = self.fan[at].partner[1 - entered];
            if next == NO_PARTNER || next as usize == start {
                break;
            }
            entered = usize::from(self.fan[next as usize].partner[0] as usize != at);
            at = next as usize;
        }
        count
    }

    /// Whether all tetrahedra after the split are positive, given the positions of `v'` and `v''`; exactly.
    #[inline]
    pub fn is_positive<T: Exact>(&self, mesh: &CurrentMesh, halves: [[i32; 3]; 2]) -> bool {
        let difference = |p: [i32; 3], q: [i32; 3]| [0, 1, 2].map(|k| T::from(p[k] - q[k]));
        let mut relative = [[[T::from(0); 3]; MAX_LINK]; 2];
        for (i, &v) in self.link[..self.link_len].iter().enumerate() {
            let position = mesh.positions[v as usize];
            relative[0][i] = difference(position, halves[0]);
            relative[1][i] = difference(position, halves[1]);
        }
        // The centre followed by the opposite face, outward, is a positive order.
        let corners = |i: usize, side: usize| {
            FACES[self.corner[i] as usize & 3]
                .map(|k| relative[side & 1][self.local[i][k & 3] as usize % MAX_LINK])
        };
        let zero = T::from(0);
        let star = (0..self.len).all(|i| determinant(corners(i, (self.sides >> i & 1) as usize)) > zero);
        // With v'' in place of its outer corner, a near tetrahedron is the fan tetrahedron mirrored.
        let across = difference(halves[1], halves[0]);
        star && self.fan[..self.fan_len].iter().all(|triangle| {
            let i = triangle.near as usize;
            let mut mirrored = corners(i, 0);
            let face = FACES[self.corner[i] as usize];
            for (place, k) in mirrored.iter_mut().zip(face) {
                if k == triangle.face as usize {
                    *place = across;
                }
            }
            determinant(mirrored) < zero
        })
    }
}

/// For each of the first `len` keys, how many keys are smaller. Keys beyond `len` must be the largest there are.
/// Quadratic, but without a branch: for a few dozen keys that beats sorting. Counts are as wide as the keys, so that
/// whole vectors of comparisons are added up.
#[inline]
fn ranks<K: Copy + PartialOrd + From<bool> + Sum, const N: usize>(keys: &[K; N], len: usize) -> [K; N] {
    let mut ranks = [K::from(false); N];
    rank(keys, len, &mut ranks);
    ranks
}

/// [`ranks`] into an array that is there.
#[inline]
pub(super) fn rank<K: Copy + PartialOrd + From<bool> + Sum, const N: usize>(
    keys: &[K; N],
    len: usize,
    ranks: &mut [K; N],
) {
    let compared = &keys[..len.next_multiple_of(8).min(N)];
    for (rank, key) in ranks.iter_mut().zip(&keys[..len]) {
        *rank = compared.iter().map(|other| K::from(other < key)).sum();
    }
}

/// Integers that hold the determinants of a lattice: `i64` up to [`crate::geom::NARROW_BITS`], else `i128`.
pub(super) trait Exact:
    Copy + PartialOrd + From<i32> + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
}

impl Exact for i64 {}
impl Exact for i128 {}

#[inline]
fn determinant<T: Exact>([u, v, w]: [[T; 3]; 3]) -> T {
    (u[1] * v[2] - u[2] * v[1]) * w[0]
        + (u[2] * v[0] - u[0] * v[2]) * w[1]
        + (u[0] * v[1] - u[1] * v[0]) * w[2]
}

//! Where the vertices of a star lie around the new one, and what follows from that alone: whether its tetrahedra are positive, and the levels
//! that are predicted.

use super::new_star::{ByCorner, MOST, NewTet};
use crate::geom::{WIDE_BITS, orient3d};
use crate::mesh::FACES;
use crate::mt::mesh::tet::TURN;

/// The vertices of a star, seen from the new one.
#[derive(Clone, Debug)]
pub(in crate::mt) struct Places {
    /// From the new vertex to each, in lattice steps: whole numbers, which doubles hold exactly.
    pub from: ByCorner<[f64; 3]>,
    /// The squared lengths of these, for the vertices of the link.
    squared: [u64; MOST],
    link_len: usize,
    /// The position of the new vertex.
    position: [i32; 3],
    /// The bits of all components.
    bits: u64,
}

impl Default for Places {
    fn default() -> Self {
        Self { from: [[0.0; 3]; _], squared: [0; _], link_len: 0, position: [0; 3], bits: 0 }
    }
}

impl Places {
    /// Takes note of where the vertices of the link are, and the new one.
    pub fn set(&mut self, link: impl Iterator<Item = [i32; 3]>, position: [i32; 3]) {
        (self.link_len, self.bits, self.position) = (0, 0, position);
        for ((p, from), squared) in link.zip(&mut self.from).zip(&mut self.squared) {
            // Less than 2^62 each: positions are on lattices of at most 30 bits.
            *squared = 0;
            for k in 0..3 {
                let d = i64::from(p[k]) - i64::from(position[k]);
                from[k] = d as f64;
                self.bits |= d.unsigned_abs();
                *squared = squared.saturating_add(d.unsigned_abs() * d.unsigned_abs());
            }
            self.link_len += 1;
        }
    }

    /// Whether determinants of differences of vertices are exact in doubles. Components below 2^16 make minors below 2^33 and sums of three
    /// products below 2^51.
    #[inline]
    fn is_exact(&self) -> bool {
        self.bits < 1 << 15
    }

    /// The position of a vertex.
    #[inline]
    fn position_of(&self, corner: u8) -> [i32; 3] {
        let from = self.from[usize::from(corner)];
        [0, 1, 2].map(|k| (from[k] as i64 + i64::from(self.position[k])) as i32)
    }

    /// Whether all tetrahedra of the star are positive.
    pub fn is_positive(&self, star: &[NewTet]) -> bool {
        let is_exact = self.is_exact();
        star.iter().all(|new| {
            let face = FACES[new.own as usize & 3].map(|k| new.corners[k]);
            if is_exact {
                let [a, b, c] = face.map(|corner| self.from[usize::from(corner)]);
                return dot(cross(a, b), c) > 0.0;
            }
            let [a, b, c] = face.map(|corner| self.position_of(corner));
            orient3d(self.position, a, b, c) > 0
        })
    }

    /// Predicts the levels of the new vertex from those of the link: means by inverse squared distance, in whole numbers, so that the order
    /// of the link does not matter.
    pub fn predict_levels<'a>(&self, levels_at: impl Fn(usize) -> &'a [i32], levels: &mut [i32]) {
        for (field, level) in levels.iter_mut().enumerate() {
            *level = self.predict_level(|v| Some(levels_at(v)[field]));
        }
    }

    /// Predicts one of them, from those vertices of the link that have one.
    #[inline]
    pub fn predict_level(&self, level_at: impl Fn(usize) -> Option<i32>) -> i32 {
        let squared = &self.squared[..self.link_len];
        let largest = squared.iter().copied().max().unwrap_or(1).max(1);
        let (mut total, mut sum) = (0_u128, 0_u128);
        for (v, &squared) in squared.iter().enumerate() {
            let Some(level) = level_at(v) else { continue };
            let weight = weight(largest, squared);
            total += weight;
            // Levels are not negative.
            sum += weight * u128::from(level.unsigned_abs());
        }
        mean(sum, total.max(1)) as i32
    }

    /// The sine of the angle at which the end of a way from a corner of a tetrahedron lies over a face at that corner; none if it does not
    /// lie over it, or off every lattice.
    #[inline]
    pub fn elevation(&self, tet: &NewTet, [near, face]: [usize; 2], way: &Way) -> Option<f64> {
        let from = self.from[usize::from(tet.corners[near & 3])];
        let end = [0, 1, 2].map(|k| f64::from(self.position[k]) + from[k] + way.to[k]);
        if !end.iter().all(|x| (0.0..=f64::from(1_u32 << WIDE_BITS)).contains(x)) {
            return None;
        }
        // In this order the normal of the face points into the tetrahedron.
        let [_, _, i, j] = TURN[(4 * near + face) % 16].map(|k| tet.corners[k as usize & 3]);
        let edge = |corner: u8| minus(self.from[usize::from(corner)], from);
        let normal = cross(edge(i), edge(j));
        let height = dot(normal, way.to);
        let is_exact = self.is_exact() && way.squared < (1_u64 << 32) as f64;
        let is_over = if is_exact { height > 0.0 } else { self.is_over(tet, [near, face], way) };
        let lengths = (dot(normal, normal) * way.squared).sqrt();
        is_over.then(|| height.abs() / lengths.max(1e-300))
    }

    /// Whether the end of a way lies over a face, exactly.
    #[cold]
    fn is_over(&self, tet: &NewTet, [near, face]: [usize; 2], way: &Way) -> bool {
        let mut with = tet.corners.map(|corner| self.position_of(corner));
        let from = with[near];
        with[face] = [0, 1, 2].map(|k| (f64::from(from[k]) + way.to[k]) as i32);
        orient3d(with[0], with[1], with[2], with[3]) > 0
    }
}

/// From a vertex of a star to one that is to be inserted.
#[derive(Clone, Copy, Debug)]
pub(in crate::mt) struct Way {
    to: [f64; 3],
    /// The squared length.
    squared: f64,
}

impl Way {
    #[inline]
    pub fn new(offset: [i32; 3]) -> Self {
        let to = offset.map(f64::from);
        Self { to, squared: dot(to, to) }
    }

    /// How likely the update at its end removes a tetrahedron that no earlier one has removed, given the direction to the centre of this: with
    /// the cosine `c` between both, `(1 + c)² / ((1 + c)² + (1 − c)²)`, which is `1/2 + c / (1 + c²)`.
    #[inline]
    pub fn share(&self, centre: [f64; 3]) -> f64 {
        let (squares, product) = (dot(centre, centre) * self.squared, dot(centre, self.to));
        0.5 + squares.sqrt() * product / larger(squares + product * product, 1e-300)
    }
}

/// The larger one of two numbers: in one instruction, as neither is NaN.
#[inline]
pub(super) fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[inline]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline]
pub(super) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
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

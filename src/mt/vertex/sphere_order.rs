//! The vertices of Π_u in the order in which spheres through a face reach them.
//!
//! Behind a face of a Delaunay tetrahedralization lies the tetrahedron with the vertex that the sphere through the face reaches
//! first when it grows inwards. So the place of the fourth vertex in this order is mostly 0, whatever the insertion was made
//! by; where it is not, it is a small number. Spheres are compared by basic operations of `f64`, in the same order by whoever
//! writes a node and whoever reads it: rounding may change the order, but nowhere else than here.

use super::cavity_fill::Face;
use super::limits::MAX_AROUND;

/// Vertices whose distances are found together.
const GROUP: usize = 4;

/// The vertices of Π_u, seen from the first.
#[derive(Clone, Debug)]
pub(in crate::mt) struct Spheres {
    /// Along each axis.
    points: [[f64; MAX_AROUND]; 3],
    len: usize,
}

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(u: [f64; 3], v: [f64; 3]) -> [f64; 3] {
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

fn dot(u: [f64; 3], v: [f64; 3]) -> f64 {
    u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
}

impl Spheres {
    /// Given the vertices in canonical order.
    pub fn of(positions: impl Iterator<Item = [i32; 3]>) -> Self {
        let mut spheres = Self { points: [[0.0; MAX_AROUND]; 3], len: 0 };
        let mut first = None;
        for (i, position) in positions.take(MAX_AROUND).enumerate() {
            let first = *first.get_or_insert(position);
            for (k, points) in spheres.points.iter_mut().enumerate() {
                points[i] = f64::from(position[k]) - f64::from(first[k]);
            }
            spheres.len = i + 1;
        }
        spheres
    }

    /// How far the centre of the sphere through a face and each vertex lies behind the face, in a unit of the face's own;
    /// infinity for vertices that are not behind it. What comes behind the last vertex means nothing.
    #[inline]
    fn distances(&self, [a, b, c]: Face) -> [f64; MAX_AROUND] {
        let [xs, ys, zs] = &self.points;
        let [a, b, c] = [a, b, c].map(|x| usize::from(x) % MAX_AROUND).map(|x| [xs[x], ys[x], zs[x]]);
        let (u, v) = (difference(b, a), difference(c, a));
        let n = cross(u, v);
        let (across_v, across_u) = (cross(v, n), cross(n, u));
        let (uu, vv, nn) = (dot(u, u), dot(v, v), dot(n, n));
        let centre = [0, 1, 2].map(|k| uu * across_v[k] + vv * across_u[k]);
        let mut distances = [f64::INFINITY; MAX_AROUND];
        // Whole groups, and a choice for each vertex, not a branch.
        let len = self.len.next_multiple_of(GROUP).min(MAX_AROUND);
        let points = xs[..len].iter().zip(&ys[..len]).zip(&zs[..len]);
        for (distance, ((&x, &y), &z)) in distances[..len].iter_mut().zip(points) {
            let w = difference([x, y, z], a);
            let behind = -dot(w, n);
            let own = (dot(w, w) * nn - dot(w, centre)) / behind;
            *distance = if behind > 0.0 { own } else { f64::INFINITY };
        }
        distances
    }

    /// The place of vertex `x` in the order behind a face; none if it is not behind it.
    pub fn place(&self, face: Face, x: u8) -> Option<u32> {
        let distances = self.distances(face);
        let own = distances[usize::from(x) % MAX_AROUND];
        let is_before = |(y, &distance): (usize, &f64)| {
            u32::from((distance < own) | (distance == own) & (y < usize::from(x)))
        };
        (own < f64::INFINITY).then(|| distances[..self.len].iter().enumerate().map(is_before).sum())
    }

    /// The vertex at a place of that order.
    pub fn vertex(&self, face: Face, place: u32) -> Option<u8> {
        let mut distances = self.distances(face);
        let mut found = 0;
        for _ in 0..=place {
            // The first one of several.
            let (at, least) =
                distances[..self.len].iter().enumerate().fold((0, f64::INFINITY), |best, (at, &distance)| {
                    if distance < best.1 { (at, distance) } else { best }
                });
            if least == f64::INFINITY {
                return None;
            }
            distances[at] = f64::INFINITY;
            found = at;
        }
        Some(found as u8)
    }
}

/// How the apex of a face is coded: by its place in that order, or by the number of the vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::mt) enum ApexCode {
    /// The vertex, in as many bits as that takes.
    Vertex,
    /// So many ones as the place says, and a zero.
    Unary,
    /// Half of the place in the way of [`ApexCode::Unary`], and its last bit.
    Halves,
    /// A zero for place 0; else a one, and the place less 1 in the way of [`ApexCode::Halves`].
    Later,
}

impl ApexCode {
    /// All ways; a node stores the place here, in two bits.
    pub const ALL: [Self; 4] = [Self::Vertex, Self::Unary, Self::Halves, Self::Later];

    /// Bits and number of bits of a place, lowest first.
    pub fn code(self, place: u32) -> (u64, u32) {
        match self {
            Self::Vertex => (u64::from(place), 0),
            Self::Unary => ((1 << place.min(63)) - 1, place + 1),
            Self::Halves => {
                let (bits, width) = Self::Unary.code(place / 2);
                (bits | u64::from(place % 2) << width, width + 1)
            }
            Self::Later if place == 0 => (0, 1),
            Self::Later => {
                let (bits, width) = Self::Halves.code(place - 1);
                (bits << 1 | 1, width + 1)
            }
        }
    }

    /// Reads a place, bit by bit.
    pub fn read(self, bit: &mut dyn FnMut() -> bool) -> u32 {
        let unary = |bit: &mut dyn FnMut() -> bool| {
            let mut place = 0;
            while place < MAX_AROUND as u32 && bit() {
                place += 1;
            }
            place
        };
        match self {
            Self::Vertex => 0,
            Self::Unary => unary(bit),
            Self::Halves => 2 * unary(bit) + u32::from(bit()),
            Self::Later if !bit() => 0,
            Self::Later => 1 + 2 * unary(bit) + u32::from(bit()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{insphere, orient3d};

    #[test]
    fn the_first_vertex_has_no_other_in_its_sphere() {
        let mut x = 0x9E37_79B9_7F4A_7C15_u64;
        let mut next = || {
            x ^= x << 7;
            x ^= x >> 9;
            (x % 1000) as i32
        };
        for _ in 0..300 {
            let points: Vec<[i32; 3]> = (0..20).map(|_| [next(), next(), next()]).collect();
            let spheres = Spheres::of(points.iter().copied());
            let mut order = Vec::new();
            while let Some(v) = spheres.vertex([0, 1, 2], order.len() as u32) {
                assert_eq!(spheres.place([0, 1, 2], v), Some(order.len() as u32));
                order.push(v);
            }
            let at = |v: u8| points[usize::from(v)];
            let behind = (3..20).filter(|&v| orient3d(at(v), at(0), at(1), at(2)) > 0);
            assert_eq!(behind.count(), order.len());
            for (place, &v) in order.iter().enumerate() {
                let inside = order.iter().filter(|&&w| insphere(at(v), at(0), at(1), at(2), at(w)) > 0);
                assert!(inside.count() <= place);
            }
        }
    }

    #[test]
    fn places_come_back_however_they_are_coded() {
        for code in [ApexCode::Unary, ApexCode::Halves, ApexCode::Later] {
            for place in 0..60 {
                let (bits, width) = code.code(place);
                let mut at = 0;
                let mut bit = || {
                    at += 1;
                    bits >> (at - 1) & 1 == 1
                };
                assert_eq!(code.read(&mut bit), place);
                assert_eq!(at, width);
            }
        }
    }
}

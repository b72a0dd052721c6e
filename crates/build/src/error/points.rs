//! Points and the tetrahedra that contain them: barycentric coordinates, and lists of points for each tetrahedron.

use crate::change::work_mesh::keep;
use foldhash::HashMap;
use glam::{DMat3, DVec3};
use std::hash::Hash;
use tetralod::mesh::NONE;

/// Barycentric coordinates this far below zero are rounding errors of a point on a face.
pub(crate) const SLACK: f64 = 1e-9;

/// A reference point among those that are outside: its number, or where points are stored its name in the whole, with its region above.
pub(crate) type PointId = u64;

/// Disjoint lists of points, one for each tetrahedron.
pub(crate) struct Lists {
    first: Vec<u32>,
    next: Vec<u32>,
}

impl Lists {
    pub fn new(tets: usize, points: usize) -> Self {
        Self { first: vec![NONE; tets], next: vec![NONE; points] }
    }

    /// Makes room for the list of a tetrahedron.
    pub fn reserve(&mut self, t: u32) {
        if self.first.len() <= t as usize {
            self.first.resize(t as usize + 1, NONE);
        }
    }

    pub fn take(&mut self, t: u32) {
        self.first[t as usize] = NONE;
    }

    /// Keeps the lists of these tetrahedra, which ascend, under their places as numbers.
    pub fn renumber(&mut self, live: &[u32]) {
        keep(&mut self.first, live);
    }

    pub fn put(&mut self, t: u32, point: u32) {
        self.next[point as usize] = std::mem::replace(&mut self.first[t as usize], point);
    }

    pub fn iter(&self, t: u32) -> impl Iterator<Item = u32> {
        let step = |p: u32| (p != NONE).then_some(p);
        std::iter::successors(step(self.first[t as usize]), move |&p| step(self.next[p as usize]))
    }

    /// Writes the points of all of these tetrahedra, each with its tetrahedron's place among them, to `points`: first the first one of
    /// each list, then the second ones. So the memory delivers several at a time.
    pub fn gather(&self, tets: impl Iterator<Item = u32>, points: &mut Vec<(u32, u8)>) {
        points.clear();
        points.extend(tets.zip(0..).map(|(t, place)| (self.first[t as usize], place)));
        points.retain(|&(p, _)| p != NONE);
        let mut at = 0;
        while let Some(&(p, place)) = points.get(at) {
            let next = self.next[p as usize];
            if next != NONE {
                points.push((next, place));
            }
            at += 1;
        }
    }
}

/// Lists of points of which few tetrahedra have any: those without take no memory. Points are numbers, or names in the whole.
#[derive(Default)]
pub(crate) struct SparseLists<P = u32> {
    first: HashMap<u32, P>,
    next: HashMap<P, P>,
}

impl<P: Copy + Eq + Hash> SparseLists<P> {
    pub fn take(&mut self, t: u32) {
        self.first.remove(&t);
    }

    /// Keeps the lists of these tetrahedra, which ascend, under their places as numbers.
    pub fn renumber(&mut self, live: &[u32]) {
        let place = |t: u32| live.binary_search(&t).ok().map(|place| place as u32);
        self.first = self.first.iter().filter_map(|(&t, &point)| Some((place(t)?, point))).collect();
    }

    pub fn put(&mut self, t: u32, point: P) {
        match self.first.insert(t, point) {
            Some(next) => _ = self.next.insert(point, next),
            None => _ = self.next.remove(&point),
        }
    }

    pub fn iter(&self, t: u32) -> impl Iterator<Item = P> {
        std::iter::successors(self.first.get(&t).copied(), |p| self.next.get(p).copied())
    }
}

/// The matrix that makes `(λ_1, λ_2, λ_3)` of a point of its position relative to corner 0.
pub(crate) fn barycentric([a, b, c, d]: [DVec3; 4]) -> DMat3 {
    // Cells are positive on the lattice, so the matrix is regular.
    DMat3::from_cols(b - a, c - a, d - a).inverse()
}

/// The corners of the box around lattice points.
pub(crate) fn bounds(places: impl Iterator<Item = [i32; 3]>) -> [DVec3; 2] {
    let all = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    places.map(as_vec).fold(all, |[low, high], p| [low.min(p), high.max(p)])
}

pub(crate) fn as_vec(q: [i32; 3]) -> DVec3 {
    DVec3::from_array(q.map(f64::from))
}

/// Barycentric coordinates of a point just outside, moved inside.
pub(crate) fn clamped(lambda: DVec3) -> DVec3 {
    let inside = lambda.max(DVec3::ZERO);
    let sum = inside.element_sum();
    if sum > 1.0 { inside / sum } else { inside }
}

/// The square of a distance, in steps of the lattice.
pub(crate) fn squared_length(p: [i32; 3], q: [i32; 3]) -> f32 {
    (0..3).map(|i| (i64::from(p[i]) - i64::from(q[i])) as f32).map(|d| d * d).sum()
}

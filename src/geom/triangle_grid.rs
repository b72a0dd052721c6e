//! Triangles, found by place.

use super::{Groups, nearest_on_triangle};
use glam::DVec3;

/// Triangles sorted into the cells of a regular grid.
pub(crate) struct TriangleGrid {
    pub corners: Vec<[DVec3; 3]>,
    low: DVec3,
    side: f64,
    cells: [usize; 3],
    in_cell: Groups,
}

/// Most cells along an axis.
const MAX_CELLS: f64 = 128.0;

impl TriangleGrid {
    pub fn new(corners: Vec<[DVec3; 3]>) -> Self {
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        corners.iter().flatten().for_each(|p| (low, high) = (low.min(*p), high.max(*p)));
        let extent = (high - low).max(DVec3::ZERO);
        // About as many cells along an axis as there are triangles along it.
        let wanted = (corners.len() as f64 / 6.0).sqrt().clamp(1.0, MAX_CELLS);
        let side = (extent.max_element() / wanted).max(f64::MIN_POSITIVE);
        let cells = extent.to_array().map(|e| (e / side).clamp(0.0, MAX_CELLS) as usize + 1);
        let mut grid = Self { corners, low, side, cells, in_cell: Groups::default() };
        grid.in_cell = Groups::new(cells.iter().product(), |add| {
            for (i, [a, b, c]) in (0..).zip(&grid.corners) {
                grid.cells_between(a.min(*b).min(*c), a.max(*b).max(*c), |cell| {
                    add(cell, i);
                    false
                });
            }
        });
        grid
    }

    /// Visits the cells between two points until `visit` returns true; whether it did.
    fn cells_between(&self, low: DVec3, high: DVec3, mut visit: impl FnMut(usize) -> bool) -> bool {
        let along = |x: f64, axis: usize| {
            ((x - self.low[axis]) / self.side).clamp(0.0, (self.cells[axis] - 1) as f64) as usize
        };
        let range = |axis: usize| along(low[axis], axis)..=along(high[axis], axis);
        range(2)
            .any(|z| range(1).any(|y| range(0).any(|x| visit((z * self.cells[1] + y) * self.cells[0] + x))))
    }

    /// Whether one of the triangles comes within `radius` of `p`: one that does, or else none. `first` is tried before all others.
    #[cfg(feature = "build")]
    pub fn any_within(&self, p: DVec3, radius: f64, first: u32) -> Option<u32> {
        let is_near = |i: u32| {
            let corners = self.corners.get(i as usize);
            corners.is_some_and(|&corners| p.distance(nearest_on_triangle(p, corners)) <= radius)
        };
        if is_near(first) {
            return Some(first);
        }
        let (reach, mut found) = (DVec3::splat(radius), None);
        if !self.corners.is_empty() {
            self.cells_between(p - reach, p + reach, |cell| {
                found = self.in_cell.of(cell).iter().copied().find(|&i| is_near(i));
                found.is_some()
            });
        }
        found
    }

    /// Calls `visit` with each triangle that comes within `radius` of `p`, its nearest point and the distance; with
    /// some of them more than once.
    pub fn within(&self, p: DVec3, radius: f64, mut visit: impl FnMut(u32, DVec3, f64)) {
        if self.corners.is_empty() {
            return;
        }
        let reach = DVec3::splat(radius);
        self.cells_between(p - reach, p + reach, |cell| {
            for &i in self.in_cell.of(cell) {
                let q = nearest_on_triangle(p, self.corners[i as usize]);
                let distance = p.distance(q);
                if distance <= radius {
                    visit(i, q, distance);
                }
            }
            false
        });
    }

    /// Calls `visit` with the triangles that come within `most` of `p`, the nearest one first, each with its nearest point and the
    /// distance, until it returns true.
    #[cfg(feature = "build")]
    pub fn outwards(&self, p: DVec3, most: f64, mut visit: impl FnMut(u32, DVec3, f64) -> bool) {
        let most = most.min(self.whole(p));
        // In shells, each twice as wide as the one before.
        let (mut from, mut to) = (f64::NEG_INFINITY, self.side / 4.0);
        let mut shell = Vec::new();
        while from < most {
            let radius = to.min(most);
            shell.clear();
            self.within(p, radius, |i, q, distance| {
                if distance > from {
                    shell.push((distance, i, q));
                }
            });
            shell.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            shell.dedup_by_key(|&mut (_, i, _)| i);
            if shell.iter().any(|&(distance, i, q)| visit(i, q, distance)) {
                return;
            }
            (from, to) = (radius, 2.0 * to);
        }
    }

    /// No triangle is further than this from `p`.
    fn whole(&self, p: DVec3) -> f64 {
        self.side * (self.cells.iter().sum::<usize>() as f64 + 1.0) + p.distance(self.low)
    }

    /// The nearest of the triangles, of several the first, and its point nearest to `p`; none if there are no triangles.
    pub fn nearest(&self, p: DVec3) -> Option<(u32, DVec3)> {
        if self.corners.is_empty() {
            return None;
        }
        let whole = self.whole(p);
        let mut radius = self.side / 4.0;
        loop {
            let mut nearest: Option<(f64, u32, DVec3)> = None;
            self.within(p, radius, |i, q, _| {
                let square = p.distance_squared(q);
                if nearest.is_none_or(|(least, first, _)| square < least || square == least && i < first) {
                    nearest = Some((square, i, q));
                }
            });
            if nearest.is_some() || radius > whole {
                return nearest.map(|(_, i, q)| (i, q));
            }
            radius *= 2.0;
        }
    }
}

//! Triangles, found by place.

use super::{Groups, nearest_on_triangle};
use glam::DVec3;
use std::borrow::Cow;
use std::ops::RangeInclusive;

/// Triangles sorted into the cells of a regular grid.
#[doc(hidden)]
pub struct TriangleGrid {
    pub corners: Vec<[DVec3; 3]>,
    low: DVec3,
    side: f64,
    cells: [usize; 3],
    in_cell: Groups,
}

/// Most cells along an axis.
const MAX_CELLS: f64 = 128.0;

/// So much of a cell around it counts as inside, far more than the rounding of a place.
const MARGIN: f64 = 1.0 / 64.0;

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
            (0..).zip(&grid.corners).for_each(|(i, corners)| grid.cells_of(corners, |cell| add(cell, i)));
        });
        grid
    }

    /// Visits the cells that a triangle comes into, and some beside it: of a long one far fewer than its box has.
    fn cells_of(&self, triangle: &[DVec3; 3], mut visit: impl FnMut(usize)) {
        for z in self.range(triangle, 2) {
            let layer = self.part(triangle, 2, z);
            for y in self.range(&layer, 1) {
                let row = self.part(&layer, 1, y);
                self.range(&row, 0).for_each(|x| visit(self.number([x, y, z])));
            }
        }
    }

    /// The cells along an axis that some points are between.
    fn range(&self, points: &[DVec3], axis: usize) -> RangeInclusive<usize> {
        let along = points.iter().map(|p| p[axis]);
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        self.along(low, axis)..=self.along(high, axis)
    }

    /// The part of a polygon in the cells of this number along an axis, and a little more: all of it where it is hardly longer.
    fn part<'a>(&self, polygon: &'a [DVec3], axis: usize, cell: usize) -> Cow<'a, [DVec3]> {
        let range = self.range(polygon, axis);
        if range.end() - range.start() < 2 {
            return Cow::Borrowed(polygon);
        }
        let [low, high] =
            [cell as f64 - MARGIN, cell as f64 + 1.0 + MARGIN].map(|x| self.low[axis] + x * self.side);
        Cow::Owned(above(&above(polygon, axis, 1.0, low), axis, -1.0, -high))
    }

    fn along(&self, x: f64, axis: usize) -> usize {
        ((x - self.low[axis]) / self.side).clamp(0.0, (self.cells[axis] - 1) as f64) as usize
    }

    fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.cells[1] + y) * self.cells[0] + x
    }

    /// Visits the cells between two points until `visit` returns true; whether it did.
    fn cells_between(&self, low: DVec3, high: DVec3, mut visit: impl FnMut(usize) -> bool) -> bool {
        let range = |axis: usize| self.along(low[axis], axis)..=self.along(high[axis], axis);
        range(2).any(|z| range(1).any(|y| range(0).any(|x| visit(self.number([x, y, z])))))
    }

    /// Whether one of the triangles comes within `radius` of `p`: one that does, or else none. `first` is tried before all others.
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

/// The part of a polygon where a coordinate times `sign` is at least this.
fn above(polygon: &[DVec3], axis: usize, sign: f64, least: f64) -> Vec<DVec3> {
    let mut part = Vec::with_capacity(polygon.len() + 1);
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let [above_a, above_b] = [a, b].map(|p| sign * p[axis] - least);
        if above_a >= 0.0 {
            part.push(a);
        }
        if above_a * above_b < 0.0 {
            part.push(a + (b - a) * (above_a / (above_a - above_b)));
        }
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles from one point to a rim.
    fn fan(count: u32) -> Vec<[DVec3; 3]> {
        let rim = |i: u32| {
            let angle = f64::from(i) / f64::from(count) * std::f64::consts::TAU;
            DVec3::new(angle.cos(), angle.sin(), 0.1 * (3.0 * angle).sin())
        };
        (0..count).map(|i| [DVec3::Z, rim(i), rim(i + 1)]).collect()
    }

    #[test]
    fn the_nearest_of_long_triangles_is_found() {
        let triangles = fan(700);
        let grid = TriangleGrid::new(triangles.clone());
        for i in 0..1000_u32 {
            let at = |k: u32| f64::from(i * k % 211) / 105.0 - 1.0;
            let p = DVec3::new(at(7), at(13), at(29));
            let squares =
                triangles.iter().map(|&corners| p.distance_squared(nearest_on_triangle(p, corners)));
            let (least, _) =
                (0..).zip(squares).fold(
                    (0, f64::INFINITY),
                    |best: (u32, f64), (i, square)| {
                        if square < best.1 { (i, square) } else { best }
                    },
                );
            assert_eq!(grid.nearest(p).map(|(found, _)| found), Some(least), "{p}");
        }
    }

    #[test]
    fn long_triangles_are_in_few_cells() {
        let listed = |count: u32| {
            let grid = TriangleGrid::new(fan(count));
            grid.in_cell.of_all(0..grid.cells.iter().product()).len()
        };
        let [few, many] = [500, 8000].map(listed);
        // Along each there are four times as many cells.
        assert!(many < 16 * 6 * few, "{few}, {many}");
    }
}

//! Points on the lattice, found by place.

use super::Groups;
use std::ops::RangeInclusive;

/// Points on the lattice, sorted into the boxes of a regular grid.
#[doc(hidden)]
pub struct PointGrid {
    points: Vec<[i32; 3]>,
    low: [i32; 3],
    /// Edges of a box.
    side: [i64; 3],
    boxes: [usize; 3],
    in_box: Groups,
}

/// Points in a box, on average, if they were spread evenly.
const CROWD: f64 = 3.0;
/// Most boxes along an axis.
const MAX_BOXES: f64 = 128.0;

impl PointGrid {
    pub fn new(points: Vec<[i32; 3]>) -> Self {
        let low = [0, 1, 2].map(|i| points.iter().map(|p| p[i]).min().unwrap_or(0));
        let extent = [0, 1, 2]
            .map(|i| points.iter().map(|p| i64::from(p[i]) - i64::from(low[i])).max().unwrap_or(0) + 1);
        let volume: f64 = extent.iter().map(|&e| e as f64).product();
        let edge = (volume * CROWD / points.len().max(1) as f64).cbrt();
        let side =
            extent.map(|e| ((e as f64 / (e as f64 / edge).clamp(1.0, MAX_BOXES)).ceil() as i64).max(1));
        let boxes = [0, 1, 2].map(|i| (extent[i] / side[i]) as usize + 1);
        let mut grid = Self { points, low, side, boxes, in_box: Groups::default() };
        grid.in_box = Groups::new(boxes.iter().product(), |add| {
            (0..).zip(&grid.points).for_each(|(i, p)| add(grid.index(*p), i));
        });
        grid
    }

    pub fn points(&self) -> &[[i32; 3]] {
        &self.points
    }

    fn along(&self, axis: usize, x: i32) -> usize {
        let offset = i64::from(x) - i64::from(self.low[axis]);
        (offset.max(0) / self.side[axis]).min(self.boxes[axis] as i64 - 1) as usize
    }

    fn index(&self, p: [i32; 3]) -> usize {
        let [x, y, z] = [0, 1, 2].map(|axis| self.along(axis, p[axis]));
        (z * self.boxes[1] + y) * self.boxes[0] + x
    }

    /// The points at a position.
    pub fn at(&self, position: [i32; 3]) -> impl Iterator<Item = u32> {
        let nearby = self.in_box.of(self.index(position)).iter().copied();
        nearby.filter(move |&i| self.points[i as usize] == position)
    }

    /// Calls `visit` with all points that may be in a tetrahedron: those in its bounds and one step around, since a point may
    /// be half a step beside its place on the lattice.
    pub fn near_tet(&self, corners: &[[i32; 3]; 4], mut visit: impl FnMut(u32)) {
        let low = [0, 1, 2].map(|i| corners.iter().fold(i32::MAX, |m, q| m.min(q[i])).saturating_sub(1));
        let high = [0, 1, 2].map(|i| corners.iter().fold(i32::MIN, |m, q| m.max(q[i])).saturating_add(1));
        let range = |axis: usize| -> RangeInclusive<usize> {
            self.along(axis, low[axis])..=self.along(axis, high[axis])
        };
        let [xs, ys, zs] = [range(0), range(1), range(2)];
        for z in zs {
            for y in ys.clone() {
                let row = (z * self.boxes[1] + y) * self.boxes[0];
                for &i in self.in_box.of_all(row + xs.start()..row + xs.end() + 1) {
                    let p = self.points[i as usize];
                    if (0..3).all(|i| low[i] <= p[i] && p[i] <= high[i]) {
                        visit(i);
                    }
                }
            }
        }
    }
}

//! Triangles of a boundary, found by place.

use crate::geom::nearest_on_triangle;
use glam::DVec3;

/// Triangles sorted into the cells of a regular grid.
pub struct Triangles {
    pub corners: Vec<[DVec3; 3]>,
    low: DVec3,
    side: f64,
    cells: [usize; 3],
    /// Where the triangles of each cell start in `items`.
    starts: Vec<u32>,
    items: Vec<u32>,
}

/// Most cells along an axis.
const MAX_CELLS: f64 = 128.0;

impl Triangles {
    pub fn new(corners: Vec<[DVec3; 3]>) -> Self {
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        corners.iter().flatten().for_each(|p| (low, high) = (low.min(*p), high.max(*p)));
        let extent = (high - low).max(DVec3::ZERO);
        // About as many cells along an axis as there are triangles along it.
        let wanted = (corners.len() as f64 / 6.0).sqrt().clamp(1.0, MAX_CELLS);
        let side = (extent.max_element() / wanted).max(f64::MIN_POSITIVE);
        let cells = extent.to_array().map(|e| (e / side).clamp(0.0, MAX_CELLS) as usize + 1);
        let mut grid = Self { corners, low, side, cells, starts: Vec::new(), items: Vec::new() };
        grid.sort();
        grid
    }

    fn sort(&mut self) {
        let mut places: Vec<(u32, u32)> = Vec::new();
        for (i, [a, b, c]) in (0..).zip(&self.corners) {
            self.cells_between(a.min(*b).min(*c), a.max(*b).max(*c), |cell| places.push((cell as u32, i)));
        }
        places.sort_unstable();
        self.starts = vec![0; self.cells.iter().product::<usize>() + 1];
        places.iter().for_each(|&(cell, _)| self.starts[cell as usize + 1] += 1);
        (1..self.starts.len()).for_each(|i| self.starts[i] += self.starts[i - 1]);
        self.items = places.into_iter().map(|(_, i)| i).collect();
    }

    fn cells_between(&self, low: DVec3, high: DVec3, mut visit: impl FnMut(usize)) {
        let along = |x: f64, axis: usize| {
            ((x - self.low[axis]) / self.side).clamp(0.0, (self.cells[axis] - 1) as f64) as usize
        };
        let range = |axis: usize| along(low[axis], axis)..=along(high[axis], axis);
        for z in range(2) {
            for y in range(1) {
                range(0).for_each(|x| visit((z * self.cells[1] + y) * self.cells[0] + x));
            }
        }
    }

    /// Calls `visit` with each triangle that comes within `radius` of `p`, its nearest point and the distance; with
    /// some of them more than once.
    pub fn within(&self, p: DVec3, radius: f64, mut visit: impl FnMut(u32, DVec3, f64)) {
        if self.corners.is_empty() {
            return;
        }
        let reach = DVec3::splat(radius);
        self.cells_between(p - reach, p + reach, |cell| {
            for &i in &self.items[self.starts[cell] as usize..self.starts[cell + 1] as usize] {
                let q = nearest_on_triangle(p, self.corners[i as usize]);
                let distance = p.distance(q);
                if distance <= radius {
                    visit(i, q, distance);
                }
            }
        });
    }

    /// The distance of `p` from the nearest triangle; infinite if there is none.
    pub fn distance(&self, p: DVec3) -> f64 {
        let whole = self.side * (self.cells.iter().sum::<usize>() as f64 + 1.0) + p.distance(self.low);
        let mut radius = self.side / 4.0;
        loop {
            let mut nearest = f64::INFINITY;
            self.within(p, radius, |_, _, distance| nearest = nearest.min(distance));
            if nearest.is_finite() || radius > whole {
                return nearest;
            }
            radius *= 2.0;
        }
    }
}

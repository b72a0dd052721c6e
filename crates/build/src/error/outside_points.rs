//! Reference vertices outside of the tetrahedron in whose bucket they are.
//!
//! Such a vertex is in the bucket of the tetrahedron whose boundary triangle was nearest (see [`crate::error::cost`]). When
//! the boundary moves again, another tetrahedron may come to contain it. The vertex is then *foreign* there: the field
//! is compared at foreign vertices as at those in the bucket, so the error of every tetrahedron bounds the deviation at
//! all reference vertices inside. A foreign vertex also stays in its own bucket, for meshes without the other
//! tetrahedron.

use crate::error::points::SparseLists;
use crate::lattice::places::Places;
use glam::DVec3;
use std::ops::RangeInclusive;

/// The reference vertices outside of the tetrahedra in whose buckets they are.
pub(crate) struct OutsidePoints {
    /// What is known of each vertex: [`OUTSIDE`], [`FOREIGN`], [`KNOWN`].
    marks: Vec<u8>,
    /// The foreign vertices of each tetrahedron.
    foreign: SparseLists,
    grid: Grid,
    /// All that have ever been outside, by cell of the grid.
    cells: SparseLists,
    occupied: Occupied,
}

/// It is outside of the tetrahedron in whose bucket it is.
const OUTSIDE: u8 = 1;
/// It is foreign to some tetrahedron.
const FOREIGN: u8 = 2;
/// It is in a cell of the grid.
const KNOWN: u8 = 4;

/// A regular grid over all reference vertices.
struct Grid {
    places: Places,
    low: DVec3,
    /// Cells in a unit of length.
    density: DVec3,
    cells: usize,
}

/// The most cells along an axis.
const MOST_CELLS: usize = u128::BITS as usize;

/// Which cells of the grid have any: a long box may lie over very many without.
struct Occupied {
    /// Of each layer the rows, and of each row the cells.
    layers: Vec<u128>,
    rows: Vec<u128>,
}

impl OutsidePoints {
    /// Of a mesh with vertices at these places.
    pub fn new(places: Places) -> Self {
        let points = places.len();
        let grid = Grid::new(places);
        Self {
            marks: vec![0; points],
            foreign: SparseLists::default(),
            cells: SparseLists::default(),
            occupied: Occupied::new(grid.cells),
            grid,
        }
    }

    /// The vertices of other buckets that the replacement of these tetrahedra may contain: their foreign vertices and,
    /// if the boundary changes inside of the box `changed`, those in the box that no tetrahedron contains.
    pub fn candidates(
        &self,
        tets: impl Iterator<Item = u32>,
        changed: Option<[DVec3; 2]>,
    ) -> impl Iterator<Item = u32> {
        let foreign = tets.flat_map(|t| self.foreign.iter(t));
        foreign.chain(changed.into_iter().flat_map(|[low, high]| self.between(low, high)))
    }

    /// The vertices between two corners of a box that no tetrahedron contains.
    fn between(&self, low: DVec3, high: DVec3) -> impl Iterator<Item = u32> {
        let [from, to] = [low, high].map(|p| self.grid.cell(p));
        let all = self
            .occupied
            .between(from, to)
            .flat_map(|[x, y, z]| self.cells.iter(self.grid.number([x, y, z])));
        all.filter(move |&point| {
            let place = self.grid.places.at(point);
            let is_inside = place.cmpge(low).all() && place.cmple(high).all();
            is_inside && self.marks[point as usize] & (OUTSIDE | FOREIGN) == OUTSIDE
        })
    }

    /// The vertices that are foreign to a tetrahedron.
    pub fn foreign_to(&self, t: u32) -> impl Iterator<Item = u32> {
        self.foreign.iter(t)
    }

    /// Keeps those of these tetrahedra, which ascend, under their places as numbers.
    pub fn renumber(&mut self, live: &[u32]) {
        self.foreign.renumber(live);
    }

    /// Removes the foreign vertices of a tetrahedron, which may be a new one.
    pub fn clear(&mut self, t: u32) {
        self.foreign.iter(t).for_each(|point| self.marks[point as usize] &= !FOREIGN);
        self.foreign.take(t);
    }

    /// Records whether a vertex is outside of the tetrahedron in whose bucket it is now.
    pub fn set_outside(&mut self, point: u32, outside: bool) {
        let marks = &mut self.marks[point as usize];
        let before = *marks;
        *marks = if outside { before | OUTSIDE | KNOWN } else { before & !OUTSIDE };
        if outside && before & KNOWN == 0 {
            let cell = self.grid.cell(self.grid.places.at(point));
            self.cells.put(self.grid.number(cell), point);
            self.occupied.add(cell);
        }
    }

    /// Whether a vertex is known to be outside of the tetrahedron in whose bucket it is.
    pub fn is_outside(&self, point: u32) -> bool {
        self.marks[point as usize] & OUTSIDE != 0
    }

    /// Makes a vertex that is outside of its own tetrahedron foreign to another one, unless it already is to some.
    pub fn add_foreign(&mut self, t: u32, point: u32) {
        let marks = &mut self.marks[point as usize];
        if *marks & (OUTSIDE | FOREIGN) == OUTSIDE {
            *marks |= FOREIGN;
            self.foreign.put(t, point);
        }
    }
}

impl Grid {
    fn new(places: Places) -> Self {
        let low = places.iter().fold(DVec3::INFINITY, DVec3::min);
        let high = places.iter().fold(DVec3::NEG_INFINITY, DVec3::max);
        let cells = (1..MOST_CELLS).take_while(|n| n.pow(3) < places.len()).last().unwrap_or(1);
        let density = cells as f64 / (high - low).max(DVec3::splat(f64::MIN_POSITIVE));
        Self { places, low, density, cells }
    }

    /// The cell of a place, or the nearest one.
    fn cell(&self, place: DVec3) -> [usize; 3] {
        let last = (self.cells - 1) as f64;
        // Not a number where the domain has no extent.
        ((place - self.low) * self.density).to_array().map(|x| x.max(0.0).min(last) as usize)
    }

    /// The number of a cell.
    fn number(&self, [x, y, z]: [usize; 3]) -> u32 {
        ((x * self.cells + y) * self.cells + z) as u32
    }
}

impl Occupied {
    /// None of so many along each axis.
    fn new(cells: usize) -> Self {
        Self { layers: vec![0; cells], rows: vec![0; cells * cells] }
    }

    fn add(&mut self, [x, y, z]: [usize; 3]) {
        let row = x * self.layers.len() + y;
        self.layers[x] |= 1 << y;
        self.rows[row] |= 1 << z;
    }

    /// The cells between two cells, in order.
    fn between(&self, from: [usize; 3], to: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
        let layers =
            (from[0]..=to[0]).flat_map(move |x| bits(self.layers[x], from[1]..=to[1]).map(move |y| [x, y]));
        layers.flat_map(move |[x, y]| {
            bits(self.rows[x * self.layers.len() + y], from[2]..=to[2]).map(move |z| [x, y, z])
        })
    }
}

/// The places in this range of the bits that are set, ascending.
fn bits(set: u128, range: RangeInclusive<usize>) -> impl Iterator<Item = usize> {
    let mut left = set & u128::MAX >> (MOST_CELLS - 1 - range.end()) & u128::MAX << range.start();
    std::iter::from_fn(move || {
        let first = (left != 0).then(|| left.trailing_zeros() as usize)?;
        left &= left - 1;
        Some(first)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(outside_points: &OutsidePoints) -> Vec<u32> {
        let mut found: Vec<u32> = outside_points.between(DVec3::splat(0.5), DVec3::splat(3.5)).collect();
        found.sort_unstable();
        found
    }

    #[test]
    fn those_outside_are_found_until_they_are_guests() {
        let mut outside_points = OutsidePoints::new(Places::new(
            vec![[0; 3]; 40].into(),
            (0..40).map(|i| DVec3::splat(f64::from(i) * 0.25)),
        ));
        assert!(found(&outside_points).is_empty());
        (0..8).for_each(|point| outside_points.set_outside(point, true));
        assert_eq!(found(&outside_points), [2, 3, 4, 5, 6, 7]);
        outside_points.add_foreign(1, 4);
        outside_points.add_foreign(0, 4);
        outside_points.add_foreign(5, 30);
        assert_eq!(found(&outside_points), [2, 3, 5, 6, 7]);
        let foreign = |outside_points: &OutsidePoints, t: u32| {
            outside_points.candidates([t].into_iter(), None).collect::<Vec<u32>>()
        };
        assert_eq!((foreign(&outside_points, 0), foreign(&outside_points, 1)), (vec![], vec![4]));
        let whole = [DVec3::ZERO, DVec3::splat(9.0)];
        let mut candidates: Vec<u32> = outside_points.candidates([0, 1].into_iter(), Some(whole)).collect();
        candidates.sort_unstable();
        assert_eq!(candidates, [0, 1, 2, 3, 4, 5, 6, 7], "foreign and those outside, each once");
        outside_points.set_outside(6, false);
        outside_points.clear(1);
        outside_points.clear(7);
        assert_eq!(found(&outside_points), [2, 3, 4, 5, 7]);
        assert_eq!((foreign(&outside_points, 1), foreign(&outside_points, 7)), (vec![], vec![]));
    }
}

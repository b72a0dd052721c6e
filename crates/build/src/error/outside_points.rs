//! Reference vertices outside of the tetrahedron in whose bucket they are.
//!
//! Such a vertex is in the bucket of the tetrahedron whose boundary triangle was nearest (see [`crate::error::cost`]). When
//! the boundary moves again, another tetrahedron may come to contain it. The vertex is then *foreign* there: the field
//! is compared at foreign vertices as at those in the bucket, so the error of every tetrahedron bounds the deviation at
//! all reference vertices inside. A foreign vertex also stays in its own bucket, for meshes without the other
//! tetrahedron.

use crate::error::points::{PointId, SparseLists};
use crate::lattice::places::Places;
use foldhash::HashMap;
use glam::DVec3;
use std::ops::RangeInclusive;

/// The reference vertices outside of the tetrahedra in whose buckets they are.
pub(crate) struct OutsidePoints {
    /// All that have ever been outside.
    known: HashMap<PointId, Known>,
    /// The foreign vertices of each tetrahedron.
    foreign: SparseLists<PointId>,
    grid: Grid,
    /// Those that are known, by cell of the grid.
    cells: SparseLists<PointId>,
    occupied: Occupied,
}

/// A vertex that has been outside.
pub(crate) struct Known {
    place: DVec3,
    /// Where points are stored, its record.
    record: Box<[u8]>,
    /// Whether it is outside of the tetrahedron in whose bucket it is now.
    is_outside: bool,
    /// Whether it is foreign to some tetrahedron.
    is_foreign: bool,
}

impl Known {
    /// A vertex at a place.
    pub fn at(place: DVec3) -> Self {
        Self { place, record: [].into(), is_outside: false, is_foreign: false }
    }

    /// With its record.
    pub fn with(self, record: &[u8]) -> Self {
        Self { record: record.into(), ..self }
    }
}

/// A regular grid over the reference vertices.
struct Grid {
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
    /// Of a mesh with vertices at these places, and further ones between them.
    pub fn new(places: &Places) -> Self {
        let grid = Grid::new(places);
        Self {
            known: HashMap::default(),
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
    ) -> impl Iterator<Item = PointId> {
        let foreign = tets.flat_map(|t| self.foreign.iter(t));
        foreign.chain(changed.into_iter().flat_map(|[low, high]| self.between(low, high)))
    }

    /// The vertices between two corners of a box that no tetrahedron contains.
    fn between(&self, low: DVec3, high: DVec3) -> impl Iterator<Item = PointId> {
        let [from, to] = [low, high].map(|p| self.grid.cell(p));
        let all = self
            .occupied
            .between(from, to)
            .flat_map(|[x, y, z]| self.cells.iter(self.grid.number([x, y, z])));
        all.filter(move |point| {
            let is_free = |known: &Known| {
                let is_between = known.place.cmpge(low).all() && known.place.cmple(high).all();
                is_between && known.is_outside && !known.is_foreign
            };
            self.known.get(point).is_some_and(is_free)
        })
    }

    /// The record of a vertex that is known, where points are stored.
    pub fn record(&self, point: PointId) -> &[u8] {
        self.known.get(&point).map_or(&[], |known| &known.record)
    }

    /// The vertices that are foreign to a tetrahedron.
    pub fn foreign_to(&self, t: u32) -> impl Iterator<Item = PointId> {
        self.foreign.iter(t)
    }

    /// Keeps those of these tetrahedra, which ascend, under their places as numbers.
    pub fn renumber(&mut self, live: &[u32]) {
        self.foreign.renumber(live);
    }

    /// Removes the foreign vertices of a tetrahedron, which may be a new one.
    pub fn clear(&mut self, t: u32) {
        for point in self.foreign.iter(t) {
            self.known.entry(point).and_modify(|known| known.is_foreign = false);
        }
        self.foreign.take(t);
    }

    /// Notes whether a vertex is outside of the tetrahedron in whose bucket it is now, and what is known of it if it has never been before.
    pub fn set_outside(&mut self, point: PointId, outside: bool, known: impl FnOnce() -> Known) {
        if !outside {
            if !self.known.is_empty() {
                self.known.entry(point).and_modify(|known| known.is_outside = false);
            }
            return;
        }
        let known = self.known.entry(point).or_insert_with(|| {
            let known = known();
            let cell = self.grid.cell(known.place);
            self.cells.put(self.grid.number(cell), point);
            self.occupied.add(cell);
            known
        });
        known.is_outside = true;
    }

    /// Whether a vertex is known to be outside of the tetrahedron in whose bucket it is.
    #[cfg(test)]
    pub fn is_outside(&self, point: PointId) -> bool {
        self.known.get(&point).is_some_and(|known| known.is_outside)
    }

    /// Makes a vertex that is outside of its own tetrahedron foreign to another one, unless it already is to some.
    pub fn add_foreign(&mut self, t: u32, point: PointId) {
        if let Some(known) = self.known.get_mut(&point)
            && known.is_outside
            && !known.is_foreign
        {
            known.is_foreign = true;
            self.foreign.put(t, point);
        }
    }
}

impl Grid {
    fn new(places: &Places) -> Self {
        let low = places.iter().fold(DVec3::INFINITY, DVec3::min);
        let high = places.iter().fold(DVec3::NEG_INFINITY, DVec3::max);
        let cells = (1..MOST_CELLS).take_while(|n| n.pow(3) < places.len()).last().unwrap_or(1);
        let density = cells as f64 / (high - low).max(DVec3::splat(f64::MIN_POSITIVE));
        Self { low, density, cells }
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

    fn found(outside_points: &OutsidePoints) -> Vec<PointId> {
        let mut found: Vec<PointId> = outside_points.between(DVec3::splat(0.5), DVec3::splat(3.5)).collect();
        found.sort_unstable();
        found
    }

    #[test]
    fn those_outside_are_found_until_they_are_guests() {
        let places = Places::new(vec![[0; 3]; 40].into(), (0..40).map(|i| DVec3::splat(f64::from(i) * 0.25)));
        let mut outside_points = OutsidePoints::new(&places);
        let known = |point: PointId| Known::at(places.at(point as u32));
        assert!(found(&outside_points).is_empty());
        (0..8).for_each(|point| outside_points.set_outside(point, true, || known(point)));
        assert_eq!(found(&outside_points), [2, 3, 4, 5, 6, 7]);
        outside_points.add_foreign(1, 4);
        outside_points.add_foreign(0, 4);
        outside_points.add_foreign(5, 30);
        assert_eq!(found(&outside_points), [2, 3, 5, 6, 7]);
        let foreign = |outside_points: &OutsidePoints, t: u32| {
            outside_points.candidates([t].into_iter(), None).collect::<Vec<PointId>>()
        };
        assert_eq!((foreign(&outside_points, 0), foreign(&outside_points, 1)), (vec![], vec![4]));
        let whole = [DVec3::ZERO, DVec3::splat(9.0)];
        let mut candidates: Vec<PointId> =
            outside_points.candidates([0, 1].into_iter(), Some(whole)).collect();
        candidates.sort_unstable();
        assert_eq!(candidates, [0, 1, 2, 3, 4, 5, 6, 7], "foreign and those outside, each once");
        outside_points.set_outside(6, false, || known(6));
        outside_points.clear(1);
        outside_points.clear(7);
        assert_eq!(found(&outside_points), [2, 3, 4, 5, 7]);
        assert_eq!((foreign(&outside_points, 1), foreign(&outside_points, 7)), (vec![], vec![]));
    }
}

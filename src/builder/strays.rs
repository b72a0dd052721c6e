//! Reference vertices that a moved boundary has left outside.
//!
//! Such a vertex is in the bucket of the tetrahedron whose boundary triangle was nearest (see [`super::cost`]). When the boundary
//! moves again, another tetrahedron may come to contain it, of which its bucket knows nothing. It is then a *guest* there: the
//! field is compared at guests as it is at the vertices in the bucket, so the error of every tetrahedron bounds the deviation at all
//! reference vertices inside. Guests stay in their own bucket as well, for meshes in which that tetrahedron is all there is.

use super::cost::Lists;
use glam::DVec3;

/// Keeps track of reference vertices outside of the tetrahedron in whose bucket they are.
pub(super) struct Strays {
    /// Whether a vertex is outside of the tetrahedron in whose bucket it is.
    outside: Vec<bool>,
    /// Whether a vertex is a guest somewhere.
    visits: Vec<bool>,
    /// The guests of each tetrahedron.
    guests: Lists,
    grid: Grid,
    /// All that have ever been outside, by cell of the grid.
    cells: Lists,
    known: Vec<bool>,
}

/// A regular grid over all reference vertices.
struct Grid {
    places: Vec<DVec3>,
    low: DVec3,
    /// Cells in a unit of length.
    density: DVec3,
    cells: usize,
}

/// Most cells along an axis.
const MOST_CELLS: usize = 128;

impl Strays {
    /// Of a mesh with so many tetrahedra and vertices at these places.
    pub fn new(tets: usize, places: Vec<DVec3>) -> Self {
        let points = places.len();
        let grid = Grid::new(places);
        Self {
            outside: vec![false; points],
            visits: vec![false; points],
            guests: Lists::new(tets, points),
            cells: Lists::new(grid.cells.pow(3), points),
            known: vec![false; points],
            grid,
        }
    }

    /// The vertices that what replaces these tetrahedra may come to contain although they are in other buckets: the guests, and
    /// where the boundary changes inside of a box, those in the box that no tetrahedron contains. What is new inside is between the
    /// old boundary and the new one.
    pub fn met(
        &self,
        tets: impl Iterator<Item = u32>,
        changed: Option<[DVec3; 2]>,
    ) -> impl Iterator<Item = u32> {
        let guests = tets.flat_map(|t| self.guests.iter(t));
        guests.chain(changed.into_iter().flat_map(|[low, high]| self.between(low, high)))
    }

    /// The vertices between two corners of a box that no tetrahedron contains.
    fn between(&self, low: DVec3, high: DVec3) -> impl Iterator<Item = u32> {
        let [from, to] = [low, high].map(|p| self.grid.cell(p));
        let rows = (from[0]..=to[0]).flat_map(move |x| (from[1]..=to[1]).map(move |y| self.grid.row(x, y)));
        let cells = rows.flat_map(move |row| row + from[2]..=row + to[2]);
        let all = cells.flat_map(|cell| self.cells.iter(cell as u32));
        all.filter(move |&point| {
            let place = self.grid.places[point as usize];
            let is_inside = place.cmpge(low).all() && place.cmple(high).all();
            is_inside && self.outside[point as usize] && !self.visits[point as usize]
        })
    }

    /// Sends the guests of a tetrahedron away, which may be a new one.
    pub fn clear(&mut self, t: u32) {
        self.guests.reserve(t);
        self.guests.iter(t).for_each(|point| self.visits[point as usize] = false);
        self.guests.take(t);
    }

    /// Notes whether a vertex is outside of the tetrahedron in whose bucket it is now.
    pub fn set_outside(&mut self, point: u32, outside: bool) {
        self.outside[point as usize] = outside;
        if outside && !std::mem::replace(&mut self.known[point as usize], true) {
            let [x, y, z] = self.grid.cell(self.grid.places[point as usize]);
            self.cells.put((self.grid.row(x, y) + z) as u32, point);
        }
    }

    /// Whether a vertex is known to be outside of the tetrahedron in whose bucket it is.
    #[cfg(test)]
    pub fn is_outside(&self, point: u32) -> bool {
        self.outside[point as usize]
    }

    /// Makes a vertex that is outside of its own tetrahedron a guest of another one, unless it is one already.
    pub fn invite(&mut self, t: u32, point: u32) {
        if self.outside[point as usize] && !std::mem::replace(&mut self.visits[point as usize], true) {
            self.guests.put(t, point);
        }
    }
}

impl Grid {
    fn new(places: Vec<DVec3>) -> Self {
        let low = places.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = places.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
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

    /// The number of the first cell of a row.
    fn row(&self, x: usize, y: usize) -> usize {
        (x * self.cells + y) * self.cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(strays: &Strays) -> Vec<u32> {
        let mut found: Vec<u32> = strays.between(DVec3::splat(0.5), DVec3::splat(3.5)).collect();
        found.sort_unstable();
        found
    }

    #[test]
    fn those_outside_are_found_until_they_are_guests() {
        let mut strays = Strays::new(2, (0..40).map(|i| DVec3::splat(f64::from(i) * 0.25)).collect());
        assert!(found(&strays).is_empty());
        (0..8).for_each(|point| strays.set_outside(point, true));
        assert_eq!(found(&strays), [2, 3, 4, 5, 6, 7]);
        strays.invite(1, 4);
        strays.invite(0, 4);
        strays.invite(5, 30);
        assert_eq!(found(&strays), [2, 3, 5, 6, 7]);
        let guests = |strays: &Strays, t: u32| strays.met([t].into_iter(), None).collect::<Vec<u32>>();
        assert_eq!((guests(&strays, 0), guests(&strays, 1)), (vec![], vec![4]));
        let whole = [DVec3::ZERO, DVec3::splat(9.0)];
        let mut met: Vec<u32> = strays.met([0, 1].into_iter(), Some(whole)).collect();
        met.sort_unstable();
        assert_eq!(met, [0, 1, 2, 3, 4, 5, 6, 7], "guests and those outside, each once");
        strays.set_outside(6, false);
        strays.clear(1);
        strays.clear(7);
        assert_eq!(found(&strays), [2, 3, 4, 5, 7]);
        assert_eq!((guests(&strays, 1), guests(&strays, 7)), (vec![], vec![]));
    }
}

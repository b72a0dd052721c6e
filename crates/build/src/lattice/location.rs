//! Where the input's own points are in the reference mesh on its lattice.
//!
//! Cells may be thinner than the lattice moves points: a point then lies in a cell that does not even have it as a corner. Errors are
//! measured at the input's own points, so each point that the lattice has moved is in the bucket of such a cell from the start.

use crate::error::points::{SLACK, as_vec, barycentric};
use crate::lattice::places::Places;
use foldhash::HashSet;
use glam::DVec3;
use tetralod::mesh::{MeshError, NONE};

/// A point of the input, and the cell on the lattice that it lies in or is least outside of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Location {
    pub point: u32,
    pub tet: u32,
    /// Barycentric coordinates there, but for the first one.
    pub lambda: DVec3,
    pub outside: bool,
}

/// The locations of all points that the lattice has moved from `places` to `positions` and that are corners of a cell.
pub(crate) fn locations(
    tets: &[[u32; 4]],
    positions: &[[i32; 3]],
    places: &Places,
) -> Result<Vec<Location>, MeshError> {
    if !places.any_moved() {
        return Ok(Vec::new());
    }
    let mut search = Search::new(tets, positions, places)?;
    let points = (0..positions.len() as u32).filter(|&point| places.is_moved(point));
    let moved: Vec<u32> = points.filter(|&point| search.first[point as usize] != NONE).collect();
    Ok(moved.into_iter().map(|point| search.locate(point)).collect())
}

/// The locations of these points.
pub(crate) fn locations_of(
    tets: &[[u32; 4]],
    positions: &[[i32; 3]],
    places: &Places,
    points: impl Iterator<Item = u32>,
) -> Result<Vec<Location>, MeshError> {
    let mut search = Search::new(tets, positions, places)?;
    Ok(points.map(|point| search.locate(point)).collect())
}

/// The locations of points in a piece of a mesh: those that the piece alone tells, and the other points that the lattice moved. Those of
/// `is_shared` belong to other pieces, too.
pub(crate) fn locations_in_piece(
    tets: &[[u32; 4]],
    positions: &[[i32; 3]],
    places: &Places,
    is_shared: &[bool],
) -> Result<(Vec<Location>, Vec<u32>), MeshError> {
    if tets.is_empty() || !places.any_moved() {
        return Ok((Vec::new(), Vec::new()));
    }
    let mut search = Search::new(tets, positions, places)?;
    // Behind these faces there may be more.
    let is_open = |neighbors: &[[u32; 4]], t: u32| {
        (0..4).any(|i| {
            let across = neighbors[t as usize][i];
            let face = (0..4).filter(|&k| k != i).map(|k| tets[t as usize][k]);
            across == NONE && face.into_iter().all(|v| is_shared[v as usize])
        })
    };
    let (mut located, mut beyond) = (Vec::new(), Vec::new());
    for point in (0..positions.len() as u32).filter(|&point| places.is_moved(point)) {
        // What only other pieces use is theirs.
        if is_shared[point as usize] {
            beyond.push(point);
            continue;
        }
        let location = search.locate(point);
        // The search may go on behind each tetrahedron that it has found.
        if search.found.cells.iter().any(|&t| is_open(&search.neighbors, t)) {
            beyond.push(point);
        } else {
            located.push(location);
        }
    }
    Ok((located, beyond))
}

struct Search<'a> {
    tets: &'a [[u32; 4]],
    neighbors: Vec<[u32; 4]>,
    /// For each point the last one of the cells that have it as a corner; [`NONE`] without any.
    first: Vec<u32>,
    positions: &'a [[i32; 3]],
    places: &'a Places,
    found: Found,
}

/// The cells found so far.
#[derive(Default)]
struct Found {
    /// In the order of the search.
    cells: Vec<u32>,
    /// All of them, once they are [`MANY`].
    set: HashSet<u32>,
}

/// Fewer cells are looked through one by one.
const MANY: usize = 64;

impl Found {
    /// Begins anew with one cell.
    fn start(&mut self, first: u32) {
        if self.cells.len() >= MANY {
            self.set = HashSet::default();
        }
        self.cells.clear();
        self.cells.push(first);
    }

    /// Adds a cell unless it is there.
    fn add(&mut self, t: u32) {
        let is_known = if self.cells.len() < MANY { self.cells.contains(&t) } else { !self.set.insert(t) };
        if is_known {
            return;
        }
        self.cells.push(t);
        if self.cells.len() == MANY {
            self.set.extend(&self.cells);
        }
    }
}

impl<'a> Search<'a> {
    fn new(tets: &'a [[u32; 4]], positions: &'a [[i32; 3]], places: &'a Places) -> Result<Self, MeshError> {
        let neighbors = tetralod::mesh::neighbors(tets)?;
        let mut first = vec![NONE; positions.len()];
        for (t, tet) in (0..).zip(tets) {
            tet.iter().for_each(|&v| first[v as usize] = t);
        }
        Ok(Self { tets, neighbors, first, positions, places, found: Found::default() })
    }

    /// Searches the cells whose bounding boxes touch that of the point before and after rounding, starting at one that has it.
    fn locate(&mut self, point: u32) -> Location {
        let first = self.first[point as usize];
        let (place, rounded) = (self.places.at(point), as_vec(self.positions[point as usize]));
        let (low, high) = (place.min(rounded), place.max(rounded));
        self.found.start(first);
        let mut best = Location { point, tet: first, lambda: DVec3::ZERO, outside: true };
        let mut deepest = f64::NEG_INFINITY;
        let mut next = 0;
        while next < self.found.cells.len() {
            let t = self.found.cells[next];
            next += 1;
            let corners = self.tets[t as usize].map(|v| as_vec(self.positions[v as usize]));
            let lambda = barycentric(corners) * (place - corners[0]);
            let depth = lambda.min_element().min(1.0 - lambda.element_sum());
            if depth > deepest {
                deepest = depth;
                best = Location { tet: t, lambda, ..best };
            }
            if depth >= 0.0 {
                break;
            }
            for n in self.neighbors[t as usize].into_iter().filter(|&n| n != NONE) {
                let tet = self.tets[n as usize];
                let corners = tet.map(|v| as_vec(self.positions[v as usize]));
                let least = corners.into_iter().fold(DVec3::INFINITY, DVec3::min);
                let most = corners.into_iter().fold(DVec3::NEG_INFINITY, DVec3::max);
                let is_near = least.cmple(high).all() && most.cmpge(low).all();
                if is_near {
                    self.found.add(n);
                }
            }
        }
        Location { outside: deepest < -SLACK, ..best }
    }
}

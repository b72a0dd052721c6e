//! Which tetrahedron has which of the vertices of the reference mesh.

use crate::error::outside_points::{Known, OutsidePoints};
use crate::error::points::{Lists, SparseLists};
use crate::error::stored_points::StoredPoints;
use crate::lattice::location::Location;
use crate::lattice::quantize::Quantized;

/// The reference vertices that belong to each tetrahedron.
pub(crate) struct Buckets<'s> {
    /// Points of the reference mesh in the tetrahedron; none where they are stored instead.
    pub inside: Lists,
    pub stored: Option<StoredPoints<'s>>,
    /// Points of the reference boundary near its boundary faces.
    pub border: SparseLists,
    /// Points outside of the tetrahedron in whose bucket they are.
    pub outside_points: OutsidePoints,
}

impl<'s> Buckets<'s> {
    /// Of a mesh with so many tetrahedra.
    pub fn new(tets: usize, quantized: &Quantized) -> Self {
        let mut inside = Lists::new(tets, quantized.places.len());
        let mut outside_points = OutsidePoints::new(&quantized.places);
        for &Location { tet, point, outside, .. } in &quantized.locations {
            inside.put(tet, point);
            outside_points.set_outside(point.into(), outside, || Known::at(quantized.places.at(point)));
        }
        Self { inside, stored: None, border: SparseLists::default(), outside_points }
    }

    /// Of a mesh whose points are stored.
    pub fn of_stored(stored: StoredPoints<'s>, quantized: &Quantized) -> Self {
        let outside_points = OutsidePoints::new(&quantized.places);
        Self {
            inside: Lists::new(0, 0),
            stored: Some(stored),
            border: SparseLists::default(),
            outside_points,
        }
    }

    /// Keeps the buckets of these tetrahedra, which ascend, under their places as numbers. All others are empty.
    pub fn renumber(&mut self, live: &[u32]) {
        match &mut self.stored {
            Some(stored) => stored.renumber(live),
            None => self.inside.renumber(live),
        }
        self.border.renumber(live);
        self.outside_points.renumber(live);
    }

    /// Empties the buckets of a tetrahedron, which may be a new one.
    pub fn clear(&mut self, t: u32) {
        match &mut self.stored {
            Some(stored) => stored.clear(t),
            None => {
                self.inside.reserve(t);
                self.inside.take(t);
            }
        }
        self.border.take(t);
        self.outside_points.clear(t);
    }
}

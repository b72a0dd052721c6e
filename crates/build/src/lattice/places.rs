//! Where the points of the input are on the lattice, not rounded.

use crate::error::points::as_vec;
use glam::DVec3;
use std::sync::Arc;

/// The input's points in steps of the lattice. The lattice moves no point of a regular grid; they are not stored then.
#[derive(Clone)]
pub(crate) struct Places {
    rounded: Arc<[[i32; 3]]>,
    exact: Option<Arc<[DVec3]>>,
    /// The vertices of further points, which are behind all vertices.
    sides: Arc<[u32]>,
}

impl Places {
    /// The exact places of points that the lattice has put here.
    pub fn new(rounded: Arc<[[i32; 3]]>, exact: impl Iterator<Item = DVec3> + Clone) -> Self {
        let any_moved = exact.clone().zip(&*rounded).any(|(place, &q)| place != as_vec(q));
        let exact = any_moved.then(|| exact.collect());
        Self { rounded, exact, sides: [].into() }
    }

    /// With further points, at the places of these.
    pub fn with_sides(self, sides: impl Iterator<Item = u32>) -> Self {
        Self { sides: sides.collect(), ..self }
    }

    /// The vertex that a point is one of.
    #[inline]
    pub fn vertex(&self, point: u32) -> u32 {
        let side = (point as usize).checked_sub(self.rounded.len());
        side.map_or(point, |side| self.sides[side])
    }

    /// How many points there are.
    pub fn len(&self) -> usize {
        self.rounded.len() + self.sides.len()
    }

    /// Where a point is.
    #[inline]
    pub fn at(&self, point: u32) -> DVec3 {
        let point = self.vertex(point);
        self.exact
            .as_ref()
            .map_or_else(|| as_vec(self.rounded[point as usize]), |exact| exact[point as usize])
    }

    /// Whether the lattice has moved a point.
    #[inline]
    pub fn is_moved(&self, point: u32) -> bool {
        self.exact.as_ref().is_some_and(|exact| exact[point as usize] != as_vec(self.rounded[point as usize]))
    }

    /// Whether it has moved any.
    pub fn any_moved(&self) -> bool {
        self.exact.is_some()
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = DVec3> + Clone {
        (0..self.len() as u32).map(|point| self.at(point))
    }
}

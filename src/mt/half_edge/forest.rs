//! The forest of near vertices: which updates insert their vertices beside which vertex; and the names by which stars are sorted.

use super::store::ForestChild;
use foldhash::HashMap;

/// What coding stars takes to know of vertices: of all, or of those that a patch and its updates have.
#[doc(hidden)]
#[derive(Default)]
pub struct Forest {
    /// Where each vertex is in the lists below; none if that is its number.
    places: Option<HashMap<u32, u32>>,
    /// Numbers of the vertices in another order.
    names: Vec<u32>,
    /// Where the updates beside each begin, and one more.
    starts: Vec<u32>,
    children: Vec<ForestChild>,
}

impl Forest {
    /// Of all vertices, given the near vertex of each update, and how far from it each inserts its own.
    pub fn new(names: Vec<u32>, near: &[u32], offset: impl Fn(u32) -> [i32; 3]) -> Self {
        let mut starts = vec![0_u32; names.len() + 1];
        near.iter().for_each(|&v| starts[v as usize + 1] += 1);
        (0..names.len()).for_each(|v| starts[v + 1] += starts[v]);
        let mut next = starts.clone();
        let mut children = vec![ForestChild::default(); near.len()];
        for (update, &v) in (0..).zip(near) {
            let place = &mut next[v as usize];
            children[*place as usize] = ForestChild { update, offset: offset(update) };
            *place += 1;
        }
        Self { places: None, names, starts, children }
    }

    /// Of these vertices, given their names and the updates beside each, ascending: where these begin in `children`, and one more.
    pub fn of(vertices: &[u32], names: Vec<u32>, starts: Vec<u32>, children: Vec<ForestChild>) -> Self {
        let places = vertices.iter().copied().zip(0..).collect();
        Self { places: Some(places), names, starts, children }
    }

    #[inline]
    fn place(&self, vertex: u32) -> Option<usize> {
        let place = self.places.as_ref().map_or(Some(vertex), |places| places.get(&vertex).copied());
        place.map(|place| place as usize)
    }

    /// The updates whose near vertex is this one, ascending.
    pub(super) fn children(&self, vertex: u32) -> &[ForestChild] {
        let bound = |at: usize| self.starts.get(at).copied().unwrap_or(0) as usize;
        let range = self.place(vertex).map(|at| bound(at)..bound(at + 1));
        range.and_then(|range| self.children.get(range)).unwrap_or(&[])
    }

    /// The name of a vertex; that of no vertex if it has none.
    #[inline]
    pub(super) fn name(&self, vertex: u32) -> u32 {
        self.place(vertex).and_then(|at| self.names.get(at)).copied().unwrap_or(u32::MAX)
    }
}

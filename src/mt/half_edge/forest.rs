//! The forest of near vertices: which updates insert their vertices beside which vertex.

use super::store::ForestChild;

/// The updates by near vertex.
#[doc(hidden)]
pub struct Forest {
    /// Where those of each vertex begin, and one more.
    starts: Vec<u32>,
    children: Vec<ForestChild>,
    /// The near vertex of each update.
    near: Vec<u32>,
}

impl Forest {
    /// Of so many vertices, given the near vertex of each update, and how far from it each inserts its own.
    pub fn new(vertices: usize, near: Vec<u32>, offset: impl Fn(u32) -> [i32; 3]) -> Self {
        let mut starts = vec![0_u32; vertices + 1];
        near.iter().for_each(|&v| starts[v as usize + 1] += 1);
        (0..vertices).for_each(|v| starts[v + 1] += starts[v]);
        let mut next = starts.clone();
        let mut children = vec![ForestChild::default(); near.len()];
        for (update, &v) in (0..).zip(&near) {
            let place = &mut next[v as usize];
            children[*place as usize] = ForestChild { update, offset: offset(update) };
            *place += 1;
        }
        Self { starts, children, near }
    }

    /// The updates whose near vertex is this one, ascending.
    pub(super) fn children(&self, vertex: u32) -> &[ForestChild] {
        let [start, end] = [0, 1].map(|k| self.starts.get(vertex as usize + k).map_or(0, |&at| at as usize));
        self.children.get(start..end).unwrap_or(&[])
    }

    pub(super) fn near(&self, update: u32) -> Option<u32> {
        self.near.get(update as usize).copied()
    }

    /// How far from its near vertex an update inserts its own.
    pub(super) fn offset(&self, update: u32, near: u32) -> Option<[i32; 3]> {
        let children = self.children(near);
        let at = children.binary_search_by_key(&update, |child| child.update).ok()?;
        Some(children[at].offset)
    }
}

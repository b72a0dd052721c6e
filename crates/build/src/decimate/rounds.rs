//! The order of removals: vertices in levels of error, and in each level in rounds.
//!
//! In a round no removal may touch tetrahedra that another removal of the same round has made. That keeps chains of
//! dependent updates short, and the updates that a region needs near to it. All candidates of a round are evaluated
//! before any vertex is removed. No removal changes the star of another one, so the evaluations stay valid. Vertices
//! too near to a removal wait for the next round. A round that removes few vertices ends its level; waiting vertices
//! are evaluated again in the next level.

use std::mem;

/// A round that removes less than one in so many of the mesh's vertices ends its level.
const LITTLE: usize = 20;

/// A vertex of a later level, with the result of its last evaluation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Later {
    pub vertex: u32,
    /// The best of the neighbours that it could be moved to.
    pub end: u32,
    /// The version that its neighbourhood was in.
    pub version: u32,
}

/// The vertices to evaluate.
pub(crate) struct Rounds {
    level: u16,
    last_level: u16,
    /// The vertices of the next round, each once.
    waiting: Vec<u32>,
    waits: Vec<bool>,
    /// The vertices of later levels. If their neighbourhood has changed since, they are waiting, too.
    later: Vec<Vec<Later>>,
}

impl Rounds {
    /// No vertices yet, at `first_level`.
    pub fn new(first_level: u16, last_level: u16, vertices: usize) -> Self {
        let later = vec![Vec::new(); usize::from(last_level) + 1];
        Self { level: first_level, last_level, waiting: Vec::new(), waits: vec![false; vertices], later }
    }

    /// The current level.
    pub fn level(&self) -> u16 {
        self.level
    }

    /// Lets a vertex wait for the next round: it has not been evaluated, or its neighbourhood has changed.
    pub fn wait(&mut self, vertex: u32) {
        if !mem::replace(&mut self.waits[vertex as usize], true) {
            self.waiting.push(vertex);
        }
    }

    /// Whether a vertex waits. During a round: whether the round has changed its star.
    pub fn waits(&self, vertex: u32) -> bool {
        self.waits[vertex as usize]
    }

    /// Defers a vertex to a later level.
    pub fn put_off(&mut self, level: u16, later: Later) {
        self.later[usize::from(level)].push(later);
    }

    /// Starts a round: returns the waiting vertices, and those deferred to this level.
    pub fn start(&mut self) -> (Vec<u32>, Vec<Later>) {
        let waiting = mem::take(&mut self.waiting);
        waiting.iter().for_each(|&v| self.waits[v as usize] = false);
        (waiting, mem::take(&mut self.later[usize::from(self.level)]))
    }

    /// Ends a round; `left` vertices remain. False if no vertex can be removed any more.
    pub fn end(&mut self, removed: usize, left: usize) -> bool {
        let goes_on = !self.waiting.is_empty();
        if goes_on && (removed * LITTLE >= left + removed || self.level == self.last_level) {
            return true;
        }
        let above = usize::from(self.level) + 1;
        let next = if goes_on {
            Some(above)
        } else {
            (above..self.later.len()).find(|&l| !self.later[l].is_empty())
        };
        if let Some(level) = next {
            self.level = level as u16;
        }
        next.is_some()
    }
}

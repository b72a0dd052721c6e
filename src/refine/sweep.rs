//! The order of updates where it is free: by place, so that neighbouring updates follow each other.
//!
//! The mesh is a function of the set of updates, so any order that extends the partial order gives the same one.
//! Numbers follow falling error, which jumps all over the model. A window of updates, sorted by place, has better cache
//! locality. New slots then lie side by side, too.

use crate::geom::morton;
use crate::mt::{ApplyUpdates, CurrentMesh, UpdateId};

/// log2 of the cells along each axis by which updates are sorted.
const CELL_BITS: u32 = 4;
const CELLS: usize = 1 << (3 * CELL_BITS);

/// How many updates are sorted at a time. Large windows bring more neighbours together, and more updates that are
/// blocked by others; a small mesh is in the caches anyway.
pub(super) fn window_size(applied: u32) -> usize {
    (applied as usize / 8).max(256)
}

/// A window of updates, in the order of their cells; scratch space.
#[derive(Default)]
pub(super) struct Window {
    pub updates: Vec<UpdateId>,
    sorted: Vec<UpdateId>,
    cells: Vec<u16>,
    starts: Vec<u32>,
}

impl Window {
    /// Sorts the updates by their places; those of a cell stay in the order they are in.
    pub fn sort(&mut self, mt: &impl ApplyUpdates, mesh: &CurrentMesh) {
        let shift = mt.info().lattice.bits.saturating_sub(CELL_BITS);
        self.starts.clear();
        self.starts.resize(CELLS, 0);
        self.cells.clear();
        for &u in &self.updates {
            let cell = cell(mt.site(mesh, u), shift);
            self.cells.push(cell);
            self.starts[cell as usize] += 1;
        }
        let mut next = 0;
        self.starts.iter_mut().for_each(|start| next += std::mem::replace(start, next));
        self.sorted.clear();
        self.sorted.resize(self.updates.len(), UpdateId(0));
        for (&u, &cell) in self.updates.iter().zip(&self.cells) {
            let place = &mut self.starts[cell as usize];
            self.sorted[*place as usize] = u;
            *place += 1;
        }
        std::mem::swap(&mut self.updates, &mut self.sorted);
    }
}

/// The cell of a position, along a space-filling curve.
fn cell(position: [i32; 3], shift: u32) -> u16 {
    let largest = (1 << CELL_BITS) - 1;
    morton(position.map(|x| (x >> shift).clamp(0, largest) as u32)) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_has_its_own_number() {
        let mut seen = vec![false; CELLS];
        let steps = || 0..1 << CELL_BITS;
        for (x, y, z) in steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| (x, y, z)))) {
            let cell = cell([x << 6, y << 6, z << 6], 6) as usize;
            assert!(!std::mem::replace(&mut seen[cell], true));
        }
    }
}

//! Which values the field has in each block of tetrahedra: most blocks are passed over when an isovalue moves.

use crate::mesh::{BLOCK, NONE};
use crate::view::MeshView;

/// Per block of tetrahedra the smallest and the largest value.
#[derive(Clone, Debug)]
pub(super) struct BlockRanges(Vec<[f64; 2]>);

impl BlockRanges {
    pub fn new(mesh: &MeshView<'_>) -> Self {
        Self(mesh.tets.chunks(BLOCK).map(|block| range(block, mesh.field)).collect())
    }

    /// The blocks in which a tetrahedron can have points on both sides of `value`.
    pub fn blocks_at(&self, value: f64) -> impl Iterator<Item = usize> {
        let spans = move |range: &[f64; 2]| range[0] < value && range[1] >= value;
        self.0.iter().enumerate().filter(move |(_, range)| spans(range)).map(|(block, _)| block)
    }

    /// Whether `value` is in the ranges of so many blocks that selecting them is not worth while.
    pub fn is_passed_widely(&self, value: f64) -> bool {
        2 * self.blocks_at(value).count() > self.0.len()
    }

    /// Finds the values of the blocks of these tetrahedra, which are in ascending order and all that have changed.
    pub fn update(&mut self, mesh: &MeshView<'_>, tets: &[u32]) {
        self.0.resize(mesh.tets.len().div_ceil(BLOCK), [0.0; 2]);
        // The last block may have lost some.
        let short = mesh.tets.len() / BLOCK;
        let mut last = usize::MAX;
        for block in tets.iter().map(|t| *t as usize / BLOCK).chain((short < self.0.len()).then_some(short)) {
            if block != last {
                last = block;
                let end = mesh.tets.len().min((block + 1) * BLOCK);
                self.0[block] = range(&mesh.tets[block * BLOCK..end], mesh.field);
            }
        }
    }
}

/// The smallest and the largest value at the points of some tetrahedra. What is not a number is not smaller than
/// any isovalue, as if it were large.
fn range(tets: &[[u32; 4]], field: &[f64]) -> [f64; 2] {
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for point in tets.iter().filter(|tet| tet[0] != NONE).flatten() {
        let value = field[*point as usize];
        let [low, high] = &mut range;
        *low = if value < *low { value } else { *low };
        let value = if value.is_nan() { f64::INFINITY } else { value };
        *high = if value > *high { value } else { *high };
    }
    range
}

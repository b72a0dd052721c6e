//! Where meshes are cut: across the longest side, into two of about as many tetrahedra.

/// Bits of a place along an axis that tell where it may be cut.
pub(super) const CUT_BITS: u32 = 12;

/// By how many bits positions on a lattice, which go up to `2^bits`, are shifted to tell where they may be cut.
pub(super) fn shift(bits: u32) -> u32 {
    (bits + 1).saturating_sub(CUT_BITS)
}

/// How many tetrahedra of each part are at each place along each axis.
pub(super) struct Places(Vec<[Vec<u64>; 3]>);

impl Places {
    pub fn of(parts: usize) -> Self {
        Self(vec![[0, 1, 2].map(|_| vec![0; 1 << CUT_BITS]); parts])
    }

    /// Adds a tetrahedron of a part.
    pub fn add(&mut self, part: u16, place: [usize; 3]) {
        self.0[usize::from(part)].iter_mut().zip(place).for_each(|(counts, x)| counts[x] += 1);
    }

    /// The [best cut](best_cut) of each part.
    pub fn cuts(&self, step: [f64; 3]) -> Option<Vec<(usize, usize)>> {
        self.0.iter().map(|counts| best_cut(counts, step)).collect()
    }
}

/// The longest axis along which tetrahedra can be cut, and the first place behind the cut, given how many there are at each place along each
/// axis.
pub(super) fn best_cut(counts: &[Vec<u64>; 3], step: [f64; 3]) -> Option<(usize, usize)> {
    let length = |axis: usize| {
        let mut used = (0..).zip(&counts[axis]).filter(|(_, n)| **n > 0).map(|(x, _)| x);
        let first = used.next().unwrap_or(0_u32);
        f64::from(used.last().unwrap_or(first) - first) * step[axis]
    };
    let mut axes = [0, 1, 2];
    axes.sort_by(|&a, &b| length(b).total_cmp(&length(a)));
    axes.into_iter().find_map(|axis| Some((axis, half(&counts[axis])?)))
}

/// Where to cut so that both sides have about as many; none if one would have nothing.
fn half(counts: &[u64]) -> Option<usize> {
    let all: u64 = counts.iter().sum();
    let mut below = 0_u64;
    let mut best: Option<(u64, usize)> = None;
    for (x, &n) in counts.iter().enumerate() {
        let off = below.abs_diff(all - below);
        if below > 0 && below < all && best.is_none_or(|(least, _)| off < least) {
            best = Some((off, x));
        }
        below += n;
    }
    best.map(|(_, x)| x)
}

//! Where meshes are cut: across the longest side, into two of about as many tetrahedra.

/// Bits of a place along an axis that tell where it may be cut.
pub(super) const CUT_BITS: u32 = 12;

/// By how many bits positions on a lattice, which go up to `2^bits`, are shifted to tell where they may be cut.
pub(super) fn shift(bits: u32) -> u32 {
    (bits + 1).saturating_sub(CUT_BITS)
}

/// The longest axis along which tetrahedra can be cut, and the first place behind the cut, given their places along each axis: the least
/// and the largest, and how many there are at each.
pub(super) fn best_cut(
    spans: &[[usize; 2]; 3],
    counts: &[Vec<u32>; 3],
    step: [f64; 3],
) -> Option<(usize, usize)> {
    let length = |axis: usize| (spans[axis][1].saturating_sub(spans[axis][0])) as f64 * step[axis];
    let mut axes = [0, 1, 2];
    axes.sort_by(|&a, &b| length(b).total_cmp(&length(a)));
    axes.into_iter().find_map(|axis| Some((axis, half(&counts[axis])?)))
}

/// Where to cut so that both sides have about as many; none if one would have nothing.
fn half(counts: &[u32]) -> Option<usize> {
    let all: u64 = counts.iter().map(|&n| u64::from(n)).sum();
    let mut below = 0_u64;
    let mut best: Option<(u64, usize)> = None;
    for (x, &n) in counts.iter().enumerate() {
        let off = below.abs_diff(all - below);
        if below > 0 && below < all && best.is_none_or(|(least, _)| off < least) {
            best = Some((off, x));
        }
        below += u64::from(n);
    }
    best.map(|(_, x)| x)
}

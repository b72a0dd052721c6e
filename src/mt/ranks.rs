//! Ranks of a few keys, without branches.

use std::ops::AddAssign;

/// For each of the first `len` keys, how many keys are smaller. Keys beyond `len` must be the largest there are, and
/// their ranks mean nothing. Quadratic, but without a branch: for a few dozen keys that beats sorting. Eight keys at a
/// time are compared with one, and counts are as wide as the keys: whole vectors are added up.
#[inline]
pub(in crate::mt) fn rank<K: Copy + PartialOrd + From<bool> + AddAssign, const N: usize>(
    keys: &[K; N],
    len: usize,
    ranks: &mut [K; N],
) {
    const { assert!(N.is_multiple_of(LANES)) };
    let eights = keys.chunks_exact(LANES).take(len.div_ceil(LANES));
    for (ranks, lanes) in ranks.chunks_exact_mut(LANES).zip(eights) {
        let mut counts = [K::from(false); LANES];
        for key in &keys[..len] {
            for (count, other) in counts.iter_mut().zip(lanes) {
                *count += K::from(key < other);
            }
        }
        ranks.copy_from_slice(&counts);
    }
}

/// Keys that are compared at a time.
const LANES: usize = 8;

//! Work on all threads of rayon's current pool, where the feature `parallel` is; else on the caller's. Results never depend on how many
//! there are.

use std::ops::Range;

/// What `find` makes of each range of `share` items, the last of which may be shorter, in their order.
#[cfg(feature = "parallel")]
pub(crate) fn map<T: Send>(count: usize, share: usize, find: impl Fn(Range<usize>) -> T + Sync) -> Vec<T> {
    use rayon::prelude::*;
    (0..count.div_ceil(share)).into_par_iter().map(|at| find(range(count, share, at))).collect()
}

/// What `find` makes of each range of `share` items, the last of which may be shorter, in their order.
#[cfg(not(feature = "parallel"))]
pub(crate) fn map<T>(count: usize, share: usize, find: impl Fn(Range<usize>) -> T) -> Vec<T> {
    (0..count.div_ceil(share)).map(|at| find(range(count, share, at))).collect()
}

fn range(count: usize, share: usize, at: usize) -> Range<usize> {
    at * share..count.min((at + 1) * share)
}

/// The results of both, which may be found at the same time.
#[cfg(feature = "parallel")]
pub(crate) fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    rayon::join(a, b)
}

/// The results of both, which may be found at the same time.
#[cfg(not(feature = "parallel"))]
pub(crate) fn join<A, B>(a: impl FnOnce() -> A, b: impl FnOnce() -> B) -> (A, B) {
    (a(), b())
}

/// Changes each of a few items by itself.
#[cfg(feature = "parallel")]
pub(crate) fn change_each<T: Send>(items: &mut [T], change: impl Fn(&mut T) + Send + Sync) {
    use rayon::prelude::*;
    items.par_iter_mut().for_each(change);
}

/// Changes each of a few items by itself.
#[cfg(all(feature = "build", not(feature = "parallel")))]
pub(crate) fn change_each<T>(items: &mut [T], change: impl Fn(&mut T)) {
    items.iter_mut().for_each(change);
}

//! Work on all threads of rayon's current pool, where the feature `parallel` is; else on the caller's. Results never depend on how many
//! there are.

use std::ops::Range;

#[cfg(feature = "parallel")]
mod pool {
    use rayon::prelude::*;

    pub fn count() -> usize {
        rayon::current_num_threads()
    }

    pub fn own() -> usize {
        rayon::current_thread_index().unwrap_or(0)
    }

    pub fn map<T: Send>(count: usize, find: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        (0..count).into_par_iter().map(find).collect()
    }

    pub fn map_mut<A: Send, B: Sync, T: Send>(
        some: &mut [A],
        others: &[B],
        share: usize,
        change: impl Fn(&mut A, &B) -> T + Sync + Send,
    ) -> Vec<T> {
        some.par_iter_mut().zip(others).with_min_len(share).map(|(a, b)| change(a, b)).collect()
    }

    pub fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
        rayon::join(a, b)
    }
}

#[cfg(not(feature = "parallel"))]
mod pool {
    pub fn count() -> usize {
        1
    }

    pub fn own() -> usize {
        0
    }

    pub fn map<T>(count: usize, find: impl Fn(usize) -> T) -> Vec<T> {
        (0..count).map(find).collect()
    }

    pub fn map_mut<A, B, T>(
        some: &mut [A],
        others: &[B],
        _: usize,
        change: impl Fn(&mut A, &B) -> T,
    ) -> Vec<T> {
        some.iter_mut().zip(others).map(|(a, b)| change(a, b)).collect()
    }

    pub fn join<A, B>(a: impl FnOnce() -> A, b: impl FnOnce() -> B) -> (A, B) {
        (a(), b())
    }
}

/// How many threads there are.
pub fn count() -> usize {
    pool::count()
}

/// The number of the thread that asks, below [`count`]; 0 outside of the pool.
pub fn own() -> usize {
    pool::own()
}

/// What `find` makes of each range of `share` items, the last of which may be shorter, in their order.
pub fn map<T: Send>(count: usize, share: usize, find: impl Fn(Range<usize>) -> T + Sync + Send) -> Vec<T> {
    pool::map(count.div_ceil(share), |at| find(at * share..count.min((at + 1) * share)))
}

/// What `change` makes of each of `some` with the one of `others` at the same place, in their order; a thread takes `share` of them or more.
pub fn map_mut<A: Send, B: Sync, T: Send>(
    some: &mut [A],
    others: &[B],
    share: usize,
    change: impl Fn(&mut A, &B) -> T + Sync + Send,
) -> Vec<T> {
    pool::map_mut(some, others, share, change)
}

/// Changes each of a few items by itself.
pub fn change_each<T: Send>(items: &mut [T], change: impl Fn(&mut T) + Send + Sync) {
    let alone: Vec<()> = vec![(); items.len()];
    pool::map_mut(items, &alone, 1, |item, ()| change(item));
}

/// The results of both, which may be found at the same time.
pub fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    pool::join(a, b)
}

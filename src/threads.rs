//! Work on all threads of rayon's current pool, where the feature `parallel` is; else on the caller's. Results never depend on how many
//! there are.

#[cfg(feature = "parallel")]
use rayon::prelude::*;
use std::ops::Range;
#[cfg(feature = "parallel")]
use std::sync::mpsc;

/// The number of the thread that asks, 0 outside of the pool, and how many there are.
fn place() -> [usize; 2] {
    #[cfg(feature = "parallel")]
    let place = [rayon::current_thread_index().unwrap_or(0), rayon::current_num_threads()];
    #[cfg(not(feature = "parallel"))]
    let place = [0, 1];
    place
}

/// How many threads there are.
pub fn count() -> usize {
    place()[1]
}

/// Whether there is more than one: else work is done where it is asked for, without going from thread to thread.
#[cfg(feature = "parallel")]
fn is_parallel() -> bool {
    count() > 1
}

/// The number of the thread that asks, below [`count`]; 0 outside of the pool.
pub fn own() -> usize {
    place()[0]
}

/// What `find` makes of each range of `share` items, the last of which may be shorter, in their order.
pub fn map<T: Send>(count: usize, share: usize, find: impl Fn(Range<usize>) -> T + Sync + Send) -> Vec<T> {
    let shares = 0..count.div_ceil(share);
    let find = |at| find(at * share..count.min((at + 1) * share));
    #[cfg(feature = "parallel")]
    if is_parallel() {
        return shares.into_par_iter().map(find).collect();
    }
    shares.map(find).collect()
}

/// What `change` makes of each of `some` with the one of `others` at the same place, in their order; a thread takes `share` of them or more.
pub fn map_mut<A: Send, B: Sync, T: Send>(
    some: &mut [A],
    others: &[B],
    share: usize,
    change: impl Fn(&mut A, &B) -> T + Sync + Send,
) -> Vec<T> {
    #[cfg(feature = "parallel")]
    if is_parallel() {
        let pairs = some.par_iter_mut().zip(others).with_min_len(share);
        return pairs.map(|(a, b)| change(a, b)).collect();
    }
    let (pairs, _) = (some.iter_mut().zip(others), share);
    pairs.map(|(a, b)| change(a, b)).collect()
}

/// Changes each of a few items by itself.
pub fn change_each<T: Send>(items: &mut [T], change: impl Fn(&mut T) + Send + Sync) {
    let alone: Vec<()> = vec![(); items.len()];
    map_mut(items, &alone, 1, |item, ()| change(item));
}

/// The results of both, which may be found at the same time.
pub fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    #[cfg(feature = "parallel")]
    if is_parallel() {
        return rayon::join(a, b);
    }
    (a(), b())
}

/// What `work` makes, on a thread of the pool: it reaches the others sooner than the caller's does. What it asks is answered on the
/// caller's thread; with none if that has panicked.
pub fn inside<Q: Send, A: Send, T: Send>(
    work: impl FnOnce(&mut dyn FnMut(Q) -> Option<A>) -> T + Send,
    mut answer: impl FnMut(Q) -> A,
) -> Option<T> {
    #[cfg(feature = "parallel")]
    if is_parallel() && rayon::current_thread_index().is_none() {
        let ((ask, asked), (tell, told)) = (mpsc::channel(), mpsc::channel());
        let mut done = None;
        rayon::in_place_scope(|scope| {
            let done = &mut done;
            scope.spawn(move |_| {
                *done = Some(work(&mut |question| ask.send(question).ok().and_then(|()| told.recv().ok())));
            });
            // It ends when the work is done.
            asked.into_iter().for_each(|question| _ = tell.send(answer(question)));
        });
        return done;
    }
    Some(work(&mut |question| Some(answer(question))))
}

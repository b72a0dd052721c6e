//! The evaluation of many candidates that do not depend on each other, on all threads where there are several.
//!
//! There are two kinds of searches: one for each thread, which find the keys of candidates; and some for the removals that come next, which
//! keep what they find until the removal is carried out.

use super::candidate_queue::Key;
use super::gift_wrap::GiftWrap;
use super::removal::{RemovalSearch, State};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A candidate: the vertex to be removed, and the best neighbour to move it to, or [`NONE`](crate::mesh::NONE) if that is not known.
pub(super) type Removal = (u32, u32);

/// The results do not depend on how many threads there are.
pub(super) struct Searches {
    /// One for each thread.
    all: Vec<Mutex<RemovalSearch>>,
    /// Those of the removals that come next.
    pub ahead: Vec<RemovalSearch>,
}

/// So many removals for each thread are prepared at a time. With one thread none is prepared in vain.
const AHEAD: usize = 32;

impl Searches {
    /// For the threads of rayon's current pool.
    pub fn new(gift_wrap: Option<GiftWrap>) -> Self {
        #[cfg(feature = "parallel")]
        let threads = rayon::current_num_threads();
        #[cfg(not(feature = "parallel"))]
        let threads = 1;
        let search = || RemovalSearch::new(gift_wrap.clone());
        let ahead = if threads == 1 { 1 } else { threads * AHEAD };
        Self {
            all: (0..threads).map(|_| Mutex::new(search())).collect(),
            ahead: (0..ahead).map(|_| search()).collect(),
        }
    }

    /// Prepares the removals with these keys, no more than there are searches for. For each whether it is due.
    pub fn prepare(&mut self, state: &State<'_>, keys: &[Key], level: u16) -> Vec<bool> {
        let prepare = |(search, &key): (&mut RemovalSearch, &Key)| search.prepare(state, key, level);
        #[cfg(feature = "parallel")]
        {
            use rayon::prelude::*;
            self.ahead.par_iter_mut().zip(keys).with_min_len(AHEAD / 4).map(prepare).collect()
        }
        #[cfg(not(feature = "parallel"))]
        self.ahead.iter_mut().zip(keys).map(prepare).collect()
    }

    /// The search of this thread.
    fn own(&self) -> MutexGuard<'_, RemovalSearch> {
        #[cfg(feature = "parallel")]
        let thread = rayon::current_thread_index().unwrap_or(0);
        #[cfg(not(feature = "parallel"))]
        let thread = 0;
        // Each evaluation starts anew, also after one that was broken off.
        self.all[thread % self.all.len()].lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What [`RemovalSearch::at`] finds for each candidate, in their order.
    pub fn at(&self, state: &State<'_>, candidates: &[Removal], level: u16) -> Vec<Option<Key>> {
        let find = |&(vertex, end): &Removal| self.own().at(state, vertex, end, level);
        #[cfg(feature = "parallel")]
        {
            use rayon::prelude::*;
            candidates.par_iter().with_min_len(SHARE).map(find).collect()
        }
        #[cfg(not(feature = "parallel"))]
        candidates.iter().map(find).collect()
    }
}

/// A thread takes at least so many candidates at a time.
#[cfg(feature = "parallel")]
const SHARE: usize = 16;

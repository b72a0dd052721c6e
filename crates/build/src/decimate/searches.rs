//! The evaluation of many candidates that do not depend on each other, on all threads where there are several.
//!
//! There are two kinds of searches: one for each thread, which find the keys of candidates; and some for the removals that come next, which
//! keep what they find until the removal is carried out.

use crate::change::gift_wrap::GiftWrap;
use crate::decimate::candidate_queue::Key;
use crate::decimate::removal::{RemovalSearch, State};
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tetralod::threads;

/// A candidate: the vertex to be removed, and the best neighbour to move it to, or [`NONE`](tetralod::mesh::NONE) if that is not known.
pub(crate) type Removal = (u32, u32);

/// The results do not depend on how many threads there are.
pub(crate) struct Searches {
    /// One for each thread.
    all: Vec<Mutex<RemovalSearch>>,
    /// The searches of the removals that come next.
    pub ahead: Vec<RemovalSearch>,
}

/// So many removals for each thread are prepared at a time. With one thread none is prepared in vain.
const AHEAD: usize = 32;

/// But not more than have so many points in their holes, together: each keeps where all of them go.
const AHEAD_POINTS: usize = 1 << 17;

impl Searches {
    /// For the threads of rayon's current pool.
    pub fn new(gift_wrap: Option<GiftWrap>) -> Self {
        let threads = threads::count();
        let search = || RemovalSearch::new(gift_wrap.clone());
        let ahead = if threads == 1 { 1 } else { threads * AHEAD };
        Self {
            all: (0..threads).map(|_| Mutex::new(search())).collect(),
            ahead: (0..ahead).map(|_| search()).collect(),
        }
    }

    /// Prepares no more removals at a time from now on than is good where holes have so many points.
    pub fn limit(&mut self, points: usize) {
        let most = AHEAD_POINTS / points.max(1);
        self.ahead.truncate(most.max(self.all.len()));
    }

    /// Prepares the removals with these keys, no more than there are searches for. For each whether it is due.
    pub fn prepare(&mut self, state: &State<'_, '_>, keys: &[Key], level: u16) -> Vec<bool> {
        let prepare = |search: &mut RemovalSearch, &key: &Key| search.prepare(state, key, level);
        let share = (self.ahead.len() / (4 * self.all.len())).max(1);
        threads::map_mut(&mut self.ahead, keys, share, prepare)
    }

    /// The search of this thread.
    fn own(&self) -> MutexGuard<'_, RemovalSearch> {
        // Each evaluation starts anew, also after one that was broken off.
        self.all[threads::own() % self.all.len()].lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What [`RemovalSearch::at`] finds for each candidate, in their order.
    pub fn at(&self, state: &State<'_, '_>, candidates: &[Removal], level: u16) -> Vec<Option<Key>> {
        let find = |&(vertex, end): &Removal| self.own().at(state, vertex, end, level);
        let of_range = |range: Range<usize>| candidates[range].iter().map(find).collect::<Vec<_>>();
        threads::map(candidates.len(), SHARE, of_range).concat()
    }
}

/// A thread takes at least so many candidates at a time.
const SHARE: usize = 16;

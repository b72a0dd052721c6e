//! The queues of refinement under a budget: see [`Front::ranked_converge`](super::front::Front::ranked_converge).

use crate::mt::UpdateId;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The priority of an update: larger excess first, ties coarse to fine. Parents rank before their children.
pub(super) type Rank = (u64, Reverse<UpdateId>);

/// Excesses are not negative, so their bits compare as they do.
pub(super) fn rank(excess: f64, u: UpdateId) -> Rank {
    (excess.to_bits(), Reverse(u))
}

/// The two queues, kept between the steps to one goal.
#[derive(Clone, Debug, Default)]
pub(super) struct Ranked {
    pub state: State,
    /// Violating tetrahedra by the rank of the update that removes them.
    pub refinable: BinaryHeap<(Rank, u32)>,
    /// Applied updates that may be without applied children, least excess first.
    pub coarsenable: BinaryHeap<Reverse<Rank>>,
    /// Tetrahedra that packing the mesh has moved since the last step.
    pub moved: Vec<u32>,
    /// The least rank of a forced update.
    pub threshold: Option<Rank>,
    /// The updates applied since the threshold was reached; kept only with own errors.
    pub since: Vec<UpdateId>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum State {
    /// The queues are empty.
    #[default]
    Idle,
    /// They are in use.
    Running,
    /// Nothing violates the criterion.
    Satisfied,
    /// The budget allows no more.
    Limited,
}

impl Ranked {
    /// Empties the queues. Keeps whether the budget sufficed for the last request: that likely holds for the next one.
    pub fn clear(&mut self) {
        if self.state == State::Running {
            self.state = State::Idle;
        }
        self.refinable.clear();
        self.coarsenable.clear();
        self.moved.clear();
        self.threshold = None;
        self.since.clear();
    }

    /// An update of this rank is about to be forced.
    pub fn reach(&mut self, rank: Rank) {
        if self.threshold.is_none_or(|threshold| rank < threshold) {
            self.threshold = Some(rank);
            self.since.clear();
        }
    }

    /// An update has been applied.
    pub fn note_applied(&mut self, u: UpdateId) {
        if self.threshold.is_some() {
            self.since.push(u);
        }
    }

    /// Tetrahedra have moved to these slots.
    pub fn note_moved(&mut self, slots: &[u32]) {
        if self.is_running() {
            self.moved.extend_from_slice(slots);
        }
    }

    pub fn is_running(&self) -> bool {
        self.state == State::Running
    }

    /// Whether the budget sufficed for the last request, as far as is known.
    pub fn has_room(&self) -> bool {
        matches!(self.state, State::Idle | State::Satisfied)
    }

    pub fn bytes(&self) -> u64 {
        let refinable = self.refinable.len() * size_of::<(Rank, u32)>();
        (refinable + self.coarsenable.len() * size_of::<Rank>() + size_of_val(&self.since[..])) as u64
    }
}

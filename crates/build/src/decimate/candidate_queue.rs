//! The queue of candidates: by error level, then depth plus star size, then length.

use crate::Purpose;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use tetralod::mt::ErrorCode;

/// Candidates of similar error are ordered by depth of the partial order, size of the star and length of the edge.
/// Errors below this one count as equal; larger ones are grouped in levels.
const FINEST: f64 = 2e-4;

/// The levels of error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Levels {
    /// Bits of an error's code that do not count for its level.
    bits: u32,
}

impl Levels {
    /// Two for each power of two: each is about √2 wide.
    pub const HALVES: Self = Self { bits: 10 };
    /// Four for each power of two: each is about 2^¼ wide.
    pub const QUARTERS: Self = Self { bits: 9 };

    /// The levels for a purpose.
    pub fn of_purpose(purpose: Purpose) -> Self {
        match purpose {
            Purpose::Uniform => Self::QUARTERS,
            Purpose::Regions => Self::HALVES,
        }
    }

    /// The level of an error. Stored errors are logarithmic, so their codes are; no logarithm is taken, since the
    /// libraries of different platforms round it differently.
    pub fn of(self, error: f64) -> u16 {
        let code = ErrorCode::at_least(error).max(ErrorCode::at_least(FINEST));
        code.0 >> self.bits
    }

    /// The level of the largest errors.
    pub fn last(self) -> u16 {
        ErrorCode::MAX.0 >> self.bits
    }

    /// The largest error of a level; of the last one, any.
    pub fn largest(self, level: u16) -> f64 {
        let code = ErrorCode(level << self.bits | ((1 << self.bits) - 1));
        if code == ErrorCode::MAX { f64::INFINITY } else { code.error() }
    }
}

/// The order of candidates: error level, then depth plus star size, then length; ties by vertex numbers.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Key {
    /// From the top: 16 bits of error level, 16 of depth plus star size, 32 of length (squared, as a float); one word,
    /// so that the queue compares quickly.
    cost: u64,
    pub a: u32,
    pub b: u32,
}

impl Key {
    /// `second` is depth plus star size.
    pub fn new(level: u16, second: u32, length: f32, a: u32, b: u32) -> Self {
        let second = second.min(u32::from(u16::MAX));
        // Bits of floats that are not negative compare as the floats do.
        let cost = u64::from(level) << 48 | u64::from(second) << 32 | u64::from(length.to_bits());
        Self { cost, a, b }
    }

    pub fn level(self) -> u16 {
        (self.cost >> 48) as u16
    }

    /// What orders candidates within a level.
    pub fn second(self) -> u32 {
        (self.cost >> 32) as u32 & 0xffff
    }

    /// Level, depth and star size: these must be exact before the candidate is carried out.
    pub fn urgency(self) -> u32 {
        (self.cost >> 32) as u32
    }

    /// The same at another level.
    pub fn at_level(self, level: u16) -> Self {
        Self { cost: self.cost & ((1 << 48) - 1) | u64::from(level) << 48, ..self }
    }

    pub fn no_earlier_than(self, level: u16) -> Self {
        self.at_level(self.level().max(level))
    }
}

/// The candidates.
#[derive(Default)]
pub(crate) struct CandidateQueue {
    /// Candidates of the current level and of earlier ones.
    queue: BinaryHeap<Reverse<Key>>,
    level: u16,
    /// Candidates of later levels.
    later: Vec<Vec<Key>>,
}

impl CandidateQueue {
    /// The current level.
    pub fn level(&self) -> u16 {
        self.level
    }

    /// The next candidate of this level.
    pub fn pop(&mut self) -> Option<Key> {
        self.queue.pop().map(|Reverse(key)| key)
    }

    /// Adds a candidate to the queue, or to the list of its level if that is a later one. Most candidates are never
    /// reached at the level of their first prediction, so this keeps the queue short.
    pub fn push(&mut self, key: Key) {
        if key.level() <= self.level {
            self.queue.push(Reverse(key));
            return;
        }
        let level = usize::from(key.level());
        if level >= self.later.len() {
            self.later.resize_with(level + 1, Vec::new);
        }
        self.later[level].push(key);
    }

    /// Moves to the next level that has candidates; false if there is none.
    pub fn next_level(&mut self) -> bool {
        let first = usize::from(self.level) + 1;
        let next = (first..self.later.len()).find(|&level| !self.later[level].is_empty());
        if let Some(level) = next {
            self.level = level as u16;
            let keys = std::mem::take(&mut self.later[level]);
            self.queue = keys.into_iter().map(Reverse).collect();
        }
        next.is_some()
    }
}

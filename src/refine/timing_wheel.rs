//! The schedule of evaluations: an item is evaluated again when the criterion has moved far enough.
//!
//! A criterion moves by [`Criterion::distance`](super::Criterion::distance) from one request to the next; a verdict
//! holds until it has moved by the verdict's slack. Items are kept in wheels, one for each power of two of slack, with
//! slots an eighth of that wide. An item is evaluated again when the total movement of the criterion reaches the slot
//! in which its slack ends: never too late, at most an eighth of its slack too early, at constant cost. Deferred lists
//! of priorities in ROAM (Duchaineau et al. 1997) and timing wheels (Varghese and Lauck 1987) are the ideas behind
//! this.

use super::COMPONENTS;
use crate::mt::PagedArray;
use std::ops::Range;

/// The wheels cover slacks from 2^-24 to 2^4.
const WHEELS: i32 = 28;
/// The exponent of the first wheel.
const FIRST: i32 = -24;
/// log2 of the least number of slots from now to the end of a slack; the largest number is twice that.
const FINE: i32 = 3;
/// Slots of a wheel: more than any slack in it spans.
const SLOTS: usize = 4 << FINE;
/// Slots of a component.
const COMPONENT: usize = WHEELS as usize * SLOTS;
/// Due: in [`TimingWheels::open`].
const OPEN: u16 = u16::MAX - 1;
/// Not scheduled.
const NOWHERE: u16 = u16::MAX;

/// Items (tetrahedra or updates), by number, with the time of their next evaluation.
#[derive(Clone, Debug)]
pub(super) struct TimingWheels {
    /// The slot of each item, or [`OPEN`] or [`NOWHERE`].
    slot_of: PagedArray<u16>,
    /// The items in each slot of each wheel; entries may be outdated.
    slots: Vec<Vec<u32>>,
    /// The items that are due; entries may be outdated.
    open: Vec<u32>,
    /// The total movement of the criterion, by component.
    now: [f64; COMPONENTS],
}

impl Default for TimingWheels {
    fn default() -> Self {
        Self {
            slot_of: PagedArray::new(NOWHERE),
            slots: Vec::new(),
            open: Vec::new(),
            now: [0.0; COMPONENTS],
        }
    }
}

impl TimingWheels {
    /// Makes item `id` due.
    #[inline]
    pub fn open(&mut self, id: u32) {
        if self.slot_of.get(id) != OPEN {
            self.slot_of.set(id, OPEN);
            self.open.push(id);
        }
    }

    /// Removes and returns the next item that is due.
    #[inline]
    pub fn next(&mut self) -> Option<u32> {
        while let Some(id) = self.open.pop() {
            if self.slot_of.get(id) == OPEN {
                self.slot_of.set(id, NOWHERE);
                return Some(id);
            }
        }
        None
    }

    /// Sorts the due items by number, for locality in memory.
    pub fn sort(&mut self) {
        self.open.sort_unstable();
    }

    /// Whether no item is due.
    pub fn is_settled(&self) -> bool {
        self.open.is_empty()
    }

    /// Schedules item `id` for before this component has moved by more than `slack`.
    #[inline]
    pub fn defer(&mut self, id: u32, slack: f64, component: u8) {
        let slot = self.slot(slack, usize::from(component) % COMPONENTS);
        // The item is in this slot already.
        if self.slot_of.get(id) == slot {
            return;
        }
        self.slot_of.set(id, slot);
        if slot != NOWHERE {
            if self.slots.is_empty() {
                self.slots.resize(COMPONENTS * COMPONENT, Vec::new());
            }
            self.slots[slot as usize].push(id);
        }
    }

    /// The slot in which a slack that starts now ends.
    #[inline]
    fn slot(&self, slack: f64, component: usize) -> u16 {
        if slack == f64::INFINITY {
            return NOWHERE;
        }
        // NaN is due at the next movement.
        let slack = if slack.is_nan() { 0.0 } else { slack };
        let exponent = (slack.to_bits() >> 52 & 0x7ff) as i32 - 1023;
        let wheel = (exponent - FIRST).clamp(0, WHEELS - 1);
        let per_slot = power(FINE - FIRST - wheel);
        // A slack too large for the last wheel is put into that wheel.
        let now = self.now[component];
        let end = now + slack.min(power(FIRST + wheel + 1));
        let first = (now * per_slot) as u64;
        // A slack too small for the first wheel is put into its next slot.
        let slot = ((end * per_slot) as u64).max(first + 1);
        (component * COMPONENT + wheel as usize * SLOTS + slot as usize % SLOTS) as u16
    }

    /// Moves a component by `distance`, which is finite: items whose slack ends become due.
    pub fn advance(&mut self, distance: f64, component: u8) {
        let component = usize::from(component) % COMPONENTS;
        let (from, to) = (self.now[component], self.now[component] + distance);
        self.now[component] = to;
        if self.slots.is_empty() || distance <= 0.0 {
            return;
        }
        for wheel in 0..WHEELS {
            let per_slot = power(FINE - FIRST - wheel);
            let (first, last) = ((from * per_slot) as u64, (to * per_slot) as u64);
            // The next slot of the first wheel also has the smallest slacks.
            let last = if wheel == 0 { last.max(first + 1) } else { last };
            let passed = (last - first).min(SLOTS as u64);
            for slot in (0..passed).map(|i| (last - i) as usize % SLOTS) {
                self.flush(component * COMPONENT + wheel as usize * SLOTS + slot);
            }
        }
    }

    fn flush(&mut self, slot: usize) {
        let mut list = std::mem::take(&mut self.slots[slot]);
        for id in list.drain(..) {
            if self.slot_of.get(id) == slot as u16 {
                self.open(id);
            }
        }
        // Reuses its memory, unless it is large.
        if list.capacity() <= 1 << 12 {
            self.slots[slot] = list;
        }
    }

    /// Removes the items of a range of numbers.
    pub fn forget(&mut self, range: Range<u32>) {
        self.slot_of.forget(range);
    }

    /// Removes all items.
    pub fn clear(&mut self) {
        self.slot_of.clear();
        self.open.clear();
        self.slots.iter_mut().for_each(Vec::clear);
    }

    /// Bytes in use, without reserved capacity.
    pub fn bytes(&self) -> u64 {
        let lists: usize = self.slots.iter().chain([&self.open]).map(Vec::len).sum();
        (self.slot_of.bytes() + 4 * lists + size_of_val(&self.slots[..])) as u64
    }
}

/// 2 to the power of `exponent`.
fn power(exponent: i32) -> f64 {
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_looked_at_too_late_and_little_too_often() {
        let slacks: Vec<f64> = (0..2000).map(|i| f64::from(i * i) * 1e-6).collect();
        let mut waiting = TimingWheels::default();
        let mut since = vec![0.0; slacks.len()];
        let mut looks = vec![0; slacks.len()];
        slacks.iter().enumerate().for_each(|(id, &slack)| waiting.defer(id as u32, slack, 2));
        let mut now = 0.0;
        for step in 0..3000 {
            let next = now + 1e-3 + f64::from(step % 7) * 1e-4;
            // Whoever's slack ends on this step is judged on it.
            waiting.advance(next - now, 2);
            let mut seen = vec![false; slacks.len()];
            while let Some(id) = waiting.next() {
                seen[id as usize] = true;
                looks[id as usize] += 1;
                since[id as usize] = next;
                waiting.defer(id, slacks[id as usize], 2);
            }
            for id in 0..slacks.len() {
                assert!(seen[id] || next - since[id] <= slacks[id] + 1e-12, "{id} at {next}");
            }
            now = next;
        }
        for (&slack, &looks) in slacks.iter().zip(&looks) {
            let fewest = now / slack.max(1.3e-3);
            assert!(f64::from(looks) <= 1.3 * fewest + 2.0, "{looks} looks with a slack of {slack}");
        }
    }

    #[test]
    fn what_can_never_change_is_never_looked_at() {
        let mut waiting = TimingWheels::default();
        waiting.defer(3, f64::INFINITY, 0);
        waiting.defer(5, f64::NAN, 0);
        waiting.advance(1e-9, 1);
        assert!(waiting.is_settled(), "another component");
        waiting.advance(1e-9, 0);
        assert_eq!((waiting.next(), waiting.next()), (Some(5), None));
        waiting.advance(1e9, 0);
        assert!(waiting.is_settled());
    }
}

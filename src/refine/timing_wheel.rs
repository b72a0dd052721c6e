//! What has to be judged again, and when: tetrahedra and updates wait until the criterion has moved far enough.
//!
//! A criterion moves by [`Criterion::distance`](super::Criterion::distance) from one request to the next; a verdict holds
//! until it has moved by the verdict's slack. What waits is kept in wheels, one for each power of two of slack, whose slots
//! are an eighth of that wide: it is judged again when the way that the criterion has gone comes to the slot that its slack
//! ends in, so never too late and by at most an eighth of its slack too early, at a constant cost each time. Deferred lists of
//! priorities in ROAM (Duchaineau et al. 1997) and timing wheels (Varghese and Lauck 1987) are the ideas behind this.

use super::COMPONENTS;
use crate::mt::PagedArray;
use std::ops::Range;

/// Slacks from 2^-24 to 2^4 are told apart.
const WHEELS: i32 = 28;
/// The exponent of the first wheel.
const FIRST: i32 = -24;
/// log2 of how many slots a slack is from now, at least; at most it is twice that.
const FINE: i32 = 3;
/// Slots of a wheel: more than any slack in it can be away.
const SLOTS: usize = 4 << FINE;
/// Slots of a dial.
const COMPONENT: usize = WHEELS as usize * SLOTS;
/// To be judged: in [`TimingWheels::open`].
const OPEN: u16 = u16::MAX - 1;
/// Not waiting for anything.
const NOWHERE: u16 = u16::MAX;

/// Things, known by number, that wait to be judged again.
#[derive(Clone, Debug)]
pub(super) struct TimingWheels {
    /// The slot of each thing, or [`OPEN`] or [`NOWHERE`].
    slot_of: PagedArray<u16>,
    /// What waits in each slot of each wheel, with entries that have moved on since.
    slots: Vec<Vec<u32>>,
    /// What is to be judged now; here, too, entries may have moved on.
    open: Vec<u32>,
    /// How far the criterion has moved in all, by dial.
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
    /// Has thing `id` judged.
    #[inline]
    pub fn open(&mut self, id: u32) {
        if self.slot_of.get(id) != OPEN {
            self.slot_of.set(id, OPEN);
            self.open.push(id);
        }
    }

    /// The next thing to be judged, which is then in nobody's hands but the caller's.
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

    /// Brings what is to be judged into the order of its numbers: what was made together lies together in memory.
    pub fn sort(&mut self) {
        self.open.sort_unstable();
    }

    /// Whether nothing is to be judged.
    pub fn is_settled(&self) -> bool {
        self.open.is_empty()
    }

    /// Has thing `id` judged again before that has moved by more than `slack` which the dial stands for.
    #[inline]
    pub fn defer(&mut self, id: u32, slack: f64, component: u8) {
        let slot = self.slot(slack, usize::from(component) % COMPONENTS);
        // If it is there already, that is early enough.
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

    /// The slot in which a slack that begins now ends.
    #[inline]
    fn slot(&self, slack: f64, component: usize) -> u16 {
        if slack == f64::INFINITY {
            return NOWHERE;
        }
        // NaN must not wait long.
        let slack = if slack.is_nan() { 0.0 } else { slack };
        let exponent = (slack.to_bits() >> 52 & 0x7ff) as i32 - 1023;
        let wheel = (exponent - FIRST).clamp(0, WHEELS - 1);
        let per_slot = power(FINE - FIRST - wheel);
        // A slack that is too large for the last wheel ends in it all the same.
        let now = self.now[component];
        let end = now + slack.min(power(FIRST + wheel + 1));
        let first = (now * per_slot) as u64;
        // What is too small for the first wheel can end at any moment: that is the slot which begins next.
        let slot = ((end * per_slot) as u64).max(first + 1);
        (component * COMPONENT + wheel as usize * SLOTS + slot as usize % SLOTS) as u16
    }

    /// A dial moves on by `distance`, which is finite: what waits for less is to be judged.
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
            // In the first wheel the next slot has what could change at any moment.
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
        // Its memory is used again, unless it was much.
        if list.capacity() <= 1 << 12 {
            self.slots[slot] = list;
        }
    }

    /// Forgets things whose numbers are in a range.
    pub fn forget(&mut self, range: Range<u32>) {
        self.slot_of.forget(range);
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.slot_of.clear();
        self.open.clear();
        self.slots.iter_mut().for_each(Vec::clear);
    }

    /// Bytes of what there is, not of what is reserved for more.
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

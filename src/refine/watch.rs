//! What has to be judged again, and when: tetrahedra and updates wait until the criterion has moved far enough.
//!
//! A criterion moves by [`Criterion::distance`](super::Criterion::distance) from one request to the next; a verdict holds
//! until it has moved by the verdict's slack. What waits is kept by the power of two below its slack, and looked at again
//! whenever the way that the criterion has gone passes a multiple of that power: never too late, and after half the slack on
//! average. Deferred lists of priorities in ROAM (Duchaineau et al. 1997) are the idea behind this.

/// Slacks from 2^-24 to 2^3 are told apart.
const LEVELS: usize = 28;
/// The exponent of the first level.
const FIRST: i32 = -24;
/// To be judged: in [`Waiting::open`].
const OPEN: u8 = 254;
/// Not waiting for anything.
const NOWHERE: u8 = 255;

/// Things, known by number, that wait to be judged again.
#[derive(Clone, Debug, Default)]
pub(super) struct Waiting {
    /// The level of each thing, or [`OPEN`] or [`NOWHERE`].
    place: Vec<u8>,
    /// What waits in each level, with entries that have moved on since.
    levels: [Vec<u32>; LEVELS],
    /// What is to be judged now; here, too, entries may have moved on.
    open: Vec<u32>,
}

impl Waiting {
    /// Has thing `id` judged.
    #[inline]
    pub fn open(&mut self, id: u32) {
        if self.place.len() <= id as usize {
            self.place.resize(id as usize + 1, NOWHERE);
        }
        if self.place[id as usize] != OPEN {
            self.place[id as usize] = OPEN;
            self.open.push(id);
        }
    }

    /// The next thing to be judged, which is then in nobody's hands but the caller's.
    #[inline]
    pub fn next(&mut self) -> Option<u32> {
        while let Some(id) = self.open.pop() {
            if self.place[id as usize] == OPEN {
                self.place[id as usize] = NOWHERE;
                return Some(id);
            }
        }
        None
    }

    /// Whether nothing is to be judged.
    pub fn is_settled(&self) -> bool {
        self.open.is_empty()
    }

    /// Has thing `id`, whose place in nothing else, judged again when the criterion has moved by `slack`.
    #[inline]
    pub fn defer(&mut self, id: u32, slack: f64) {
        let level = level(slack);
        if self.place.len() <= id as usize {
            self.place.resize(id as usize + 1, NOWHERE);
        }
        let place = &mut self.place[id as usize];
        if *place == level {
            // It is in that list already, and so looked at early enough.
            return;
        }
        *place = level;
        if let Some(list) = self.levels.get_mut(level as usize) {
            list.push(id);
        }
    }

    /// The criterion moves on, from the place `from` on its way to `to`.
    pub fn advance(&mut self, from: f64, to: f64) {
        for level in 0..LEVELS {
            let width = power(FIRST + level as i32);
            // The first level has what could change at any moment.
            if (level == 0 && to > from) || (to / width).floor() > (from / width).floor() {
                self.flush(level);
            }
        }
    }

    fn flush(&mut self, level: usize) {
        let mut list = std::mem::take(&mut self.levels[level]);
        for id in list.drain(..) {
            if self.place[id as usize] == level as u8 {
                self.open(id);
            }
        }
        // Its memory is used again.
        self.levels[level] = list;
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.place.clear();
        self.open.clear();
        self.levels.iter_mut().for_each(Vec::clear);
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        let lists: usize = self.levels.iter().chain([&self.open]).map(Vec::capacity).sum();
        (self.place.capacity() + 4 * lists) as u64
    }
}

/// The level of a slack: the largest power of two that is not above it, by its exponent.
#[inline]
fn level(slack: f64) -> u8 {
    if slack == f64::INFINITY {
        return NOWHERE;
    }
    let exponent = (slack.to_bits() >> 52 & 0x7ff) as i32 - 1023;
    // The exponent of NaN is the largest, but it must not wait long.
    if slack.is_nan() { 0 } else { (exponent - FIRST).clamp(0, LEVELS as i32 - 1) as u8 }
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
        let mut waiting = Waiting::default();
        let mut since = vec![0.0; slacks.len()];
        let mut looks = vec![0; slacks.len()];
        slacks.iter().enumerate().for_each(|(id, &slack)| waiting.defer(id as u32, slack));
        let mut now = 0.0;
        for step in 0..3000 {
            let next = now + 1e-3 + f64::from(step % 7) * 1e-4;
            // Whoever's slack ends on this step is judged on it.
            waiting.advance(now, next);
            let mut seen = vec![false; slacks.len()];
            while let Some(id) = waiting.next() {
                seen[id as usize] = true;
                looks[id as usize] += 1;
                since[id as usize] = next;
                waiting.defer(id, slacks[id as usize]);
            }
            for id in 0..slacks.len() {
                assert!(seen[id] || next - since[id] < slacks[id], "{id} at {next}");
            }
            now = next;
        }
        for (&slack, &looks) in slacks.iter().zip(&looks) {
            let fewest = now / slack.max(1.3e-3);
            assert!(f64::from(looks) <= 4.0 * fewest + 2.0, "{looks} looks with a slack of {slack}");
        }
    }

    #[test]
    fn what_can_never_change_is_never_looked_at() {
        let mut waiting = Waiting::default();
        waiting.defer(3, f64::INFINITY);
        waiting.defer(5, f64::NAN);
        waiting.advance(0.0, 1e-9);
        assert_eq!((waiting.next(), waiting.next()), (Some(5), None));
        waiting.advance(1e-9, 1e9);
        assert!(waiting.is_settled());
    }
}

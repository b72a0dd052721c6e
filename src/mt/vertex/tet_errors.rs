//! Errors that tetrahedra have by themselves, as parts of those of the updates that remove them.
//!
//! An MT may tell of each update how far its errors are above those of what it removes, and of each tetrahedron how often the errors of the update that removes it can be quartered and still bound
//! its own; the second number is relative to the errors that the first one leaves. In the current mesh every tetrahedron has this number. When a vertex is inserted, the numbers of what gives way
//! stay with the vertex, in the order of the sorted labels of these tetrahedra, which is the same in every consistent set; when
//! the vertex is removed they come back.

use super::limits::MAX_REMOVED;
use crate::mt::MAX_QUARTERINGS;

/// Bits of such a number.
pub(in crate::mt) const QUARTERING_BITS: u32 = 2;

/// Words that hold the numbers of what an insertion removes.
const WORDS: usize = (2 * MAX_REMOVED).div_ceil(64);

/// The numbers of what an insertion removes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::mt) struct Packed([u64; WORDS]);

impl Packed {
    pub fn set(&mut self, place: usize, quarterings: u8) {
        self.0[place / 32 % WORDS] |= u64::from(quarterings & MAX_QUARTERINGS) << (2 * (place % 32));
    }

    pub fn get(&self, place: usize) -> u8 {
        (self.0[place / 32 % WORDS] >> (2 * (place % 32))) as u8 & MAX_QUARTERINGS
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mt::ErrorCode;

    #[test]
    fn all_numbers_of_the_largest_insertion_come_back() {
        let number = |place: usize| (place * 7 % 11 % 4) as u8;
        let mut packed = Packed::default();
        (0..MAX_REMOVED).for_each(|place| packed.set(place, number(place)));
        assert!((0..MAX_REMOVED).all(|place| packed.get(place) == number(place)));
    }

    #[test]
    fn a_quarter_is_a_quarter() {
        for code in (0..=u16::MAX).map(ErrorCode) {
            for times in 0..=MAX_QUARTERINGS {
                let part = code.lowered(0, times);
                let exact = code.error() / f64::from(1 << (2 * times));
                // Below the least error that has a code there is only that one.
                assert!(part.error() == exact || part == ErrorCode(1) && exact < part.error());
                assert_eq!(part == ErrorCode::ZERO, code == ErrorCode::ZERO);
            }
            for other in (0..=code.0).step_by(97).map(ErrorCode) {
                let fall = code.fall_to(other);
                assert!(code.lowered(fall, 0) >= other);
                assert!(fall == u8::MAX || other.0 <= 1 || code.lowered(fall + 1, 0) < other);
            }
        }
    }
}

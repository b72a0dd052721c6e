//! A string of bits: numbers of any width, one after the other.

/// Numbers of up to 64 bits, packed without gaps, least significant bit first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Bits {
    words: Vec<u64>,
    len: u64,
}

impl Bits {
    /// Bits that are in it.
    pub fn len(&self) -> u64 {
        self.len
    }

    pub fn clear(&mut self) {
        self.words.clear();
        self.len = 0;
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.words[..])
    }

    /// Appends the low `width` bits of `value`; `width` is at most 64.
    pub fn push(&mut self, value: u64, width: u32) {
        let value = value & low(width);
        let shift = (self.len % 64) as u32;
        if shift == 0 {
            self.words.push(value);
        } else if let Some(last) = self.words.last_mut() {
            *last |= value << shift;
            if shift + width > 64 {
                self.words.push(value >> (64 - shift));
            }
        }
        self.len += u64::from(width);
        if width == 0 && shift == 0 {
            self.words.pop();
        }
    }

    /// Appends all of another string.
    pub fn extend(&mut self, other: &Self) {
        let mut left = other.len;
        for &word in &other.words {
            let width = left.min(64) as u32;
            self.push(word, width);
            left -= u64::from(width);
        }
    }

    /// Appends the bits `start .. end` of another string.
    pub fn copy(&mut self, other: &Self, mut start: u64, end: u64) {
        while start < end {
            let width = (end - start).min(32) as u32;
            self.push(other.get(start, width), width);
            start += u64::from(width);
        }
    }

    /// Appends zeros until the length is a multiple of `unit`.
    pub fn pad(&mut self, unit: u64) {
        let missing = self.len.next_multiple_of(unit) - self.len;
        self.push(0, missing as u32);
    }

    /// The `width` bits at `at`, at most 57; zeros beyond the end.
    #[inline]
    pub fn get(&self, at: u64, width: u32) -> u64 {
        let (word, shift) = ((at / 64) as usize, (at % 64) as u32);
        let low_part = self.words.get(word).copied().unwrap_or(0) >> shift;
        // Shifted in two steps, since a shift by all 64 bits is not one.
        let high_part = (self.words.get(word + 1).copied().unwrap_or(0) << 1) << (63 - shift);
        (low_part | high_part) & low(width)
    }
}

/// The lowest `width` bits.
#[inline]
fn low(width: u32) -> u64 {
    if width >= 64 { u64::MAX } else { (1 << width) - 1 }
}

/// Bits of the numbers `0 ..= largest`.
#[inline]
pub(crate) fn width_of(largest: u32) -> u32 {
    u32::BITS - largest.leading_zeros()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_wherever_they_lie() {
        let mut bits = Bits::default();
        let mut places = Vec::new();
        let mut x = 0x9E37_79B9_7F4A_7C15_u64;
        for i in 0..2000 {
            x ^= x << 7;
            x ^= x >> 9;
            let width = i % 58;
            places.push((bits.len(), width, x & low(width)));
            bits.push(x, width);
        }
        assert!(places.iter().all(|&(at, width, value)| bits.get(at, width) == value));
        let mut twice = Bits::default();
        twice.push(5, 3);
        twice.extend(&bits);
        assert!(places.iter().all(|&(at, width, value)| twice.get(at + 3, width) == value));
        assert_eq!(bits.get(bits.len() + 1000, 30), 0);
        twice.pad(4);
        assert!(twice.len().is_multiple_of(4) && twice.len() - bits.len() < 8);
    }

    #[test]
    fn widths_are_the_least_that_do() {
        assert_eq!([0, 1, 2, 3, 4, 255, 256].map(width_of), [0, 1, 2, 2, 3, 8, 9]);
    }
}

//! An array of which parts are there: memory follows what is in use, not the largest index.

/// log2 of the entries of a part.
const PART_BITS: u32 = 11;
const PART: usize = 1 << PART_BITS;

/// Entries by number, most of which may be `none`.
#[derive(Clone, Debug)]
pub(crate) struct PagedArray<T> {
    parts: Vec<Option<Box<[T; PART]>>>,
    /// How many are there.
    held: usize,
    none: T,
}

impl<T: Copy + PartialEq> PagedArray<T> {
    pub fn new(none: T) -> Self {
        Self { parts: Vec::new(), held: 0, none }
    }

    #[inline]
    pub fn get(&self, i: u32) -> T {
        match self.parts.get((i >> PART_BITS) as usize) {
            Some(Some(part)) => part[i as usize % PART],
            _ => self.none,
        }
    }

    #[inline]
    pub fn set(&mut self, i: u32, value: T) {
        match self.parts.get_mut((i >> PART_BITS) as usize) {
            Some(Some(part)) => part[i as usize % PART] = value,
            _ => self.begin_part(i, value),
        }
    }

    #[cold]
    fn begin_part(&mut self, i: u32, value: T) {
        if value == self.none {
            return;
        }
        let at = (i >> PART_BITS) as usize;
        if at >= self.parts.len() {
            self.parts.resize(at + 1, None);
        }
        let mut part = Box::new([self.none; PART]);
        part[i as usize % PART] = value;
        self.parts[at] = Some(part);
        self.held += 1;
    }

    /// Forgets the entries of a range, and what memory that leaves without any.
    pub fn forget(&mut self, range: std::ops::Range<u32>) {
        if range.is_empty() {
            return;
        }
        let (first, last) = (range.start >> PART_BITS, (range.end - 1) >> PART_BITS);
        // Parts before that of the first entry, and behind that of the last, have none of the range: they keep what they hold.
        let parts = self.parts.iter_mut().enumerate().skip(first as usize);
        for (at, part) in parts.take((last - first + 1) as usize) {
            let Some(entries) = part else { continue };
            let place = |i: u32| (i as usize).saturating_sub(at * PART).min(PART);
            entries[place(range.start)..place(range.end)].fill(self.none);
            if entries.iter().all(|entry| *entry == self.none) {
                *part = None;
                self.held -= 1;
            }
        }
    }

    pub fn clear(&mut self) {
        self.parts.clear();
        self.held = 0;
    }

    pub fn bytes(&self) -> usize {
        self.held * size_of::<[T; PART]>() + size_of_val(&self.parts[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_put_is_there_until_it_is_forgotten() {
        let mut array = PagedArray::new(0_u32);
        let numbers = [0, 1, 2047, 2048, 5000, 40_000, 40_001, 1 << 31];
        numbers.iter().for_each(|&i| array.set(i, i + 7));
        array.set(3 << 20, 0);
        assert!(numbers.iter().all(|&i| array.get(i) == i + 7));
        assert_eq!([2, 2049, 3 << 20, u32::MAX].map(|i| array.get(i)), [0; 4]);
        let before = array.bytes();
        array.forget(1..40_001);
        assert_eq!(numbers.map(|i| array.get(i) != 0), [true, false, false, false, false, false, true, true]);
        assert_eq!(before - array.bytes(), 2 * size_of::<[u32; PART]>());
        array.clear();
        assert_eq!((array.get(0), array.bytes()), (0, 0));
    }
}

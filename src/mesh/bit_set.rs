//! A set of small numbers.

/// A set of small numbers, with one bit for each; it grows as needed.
#[derive(Clone, Debug, Default, PartialEq)]
#[doc(hidden)]
pub struct BitSet {
    words: Vec<u64>,
}

impl FromIterator<u32> for BitSet {
    fn from_iter<T: IntoIterator<Item = u32>>(numbers: T) -> Self {
        let mut set = Self::default();
        numbers.into_iter().for_each(|i| _ = set.insert(i));
        set
    }
}

impl BitSet {
    /// Puts `i` in; false if it was there.
    #[inline]
    pub fn insert(&mut self, i: u32) -> bool {
        let word = i as usize / 64;
        if word >= self.words.len() {
            self.words.resize(word + 1, 0);
        }
        let (word, bit) = (&mut self.words[word], 1 << (i % 64));
        let is_new = *word & bit == 0;
        *word |= bit;
        is_new
    }

    /// Takes `i` out.
    #[inline]
    pub fn remove(&mut self, i: u32) {
        if let Some(word) = self.words.get_mut(i as usize / 64) {
            *word &= !(1 << (i % 64));
        }
    }

    #[inline]
    pub fn has(&self, i: u32) -> bool {
        self.words.get(i as usize / 64).is_some_and(|word| word >> (i % 64) & 1 == 1)
    }

    /// Takes out all of `list`, which must hold at least what is in.
    pub fn clear_listed(&mut self, list: &[u32]) {
        list.iter().for_each(|i| self.words[*i as usize / 64] = 0);
    }

    /// Number `i` is bit `i % 64` of word `i / 64`.
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    /// Has words for the numbers below `len`, and at least one.
    pub fn resize(&mut self, len: u32) {
        self.words.resize(len.div_ceil(64).max(1) as usize, 0);
    }
}

//! Bytes by number, in order: few enough for a sorted list, which takes far less code than a tree.

/// Byte strings, each with a number of its own, in ascending order.
#[derive(Debug, Default)]
pub(super) struct Pieces(Vec<(u64, Vec<u8>)>);

impl Pieces {
    fn find(&self, number: u64) -> Result<usize, usize> {
        self.0.binary_search_by_key(&number, |(number, _)| *number)
    }

    pub fn has(&self, number: u64) -> bool {
        self.find(number).is_ok()
    }

    /// Adds `bytes`, in place of those of the same number.
    pub fn insert(&mut self, number: u64, bytes: Vec<u8>) {
        match self.find(number) {
            Ok(at) => self.0[at].1 = bytes,
            Err(at) => self.0.insert(at, (number, bytes)),
        }
    }

    /// Takes out the bytes of a number.
    pub fn remove(&mut self, number: u64) -> Option<Vec<u8>> {
        self.find(number).ok().map(|at| self.0.remove(at).1)
    }

    /// Keeps those whose number is good.
    pub fn retain(&mut self, is_good: impl Fn(u64) -> bool) {
        self.0.retain(|(number, _)| is_good(*number));
    }

    pub fn len(&self) -> usize {
        self.0.len()
    }

    pub fn numbers(&self) -> impl Iterator<Item = u64> {
        self.0.iter().map(|(number, _)| *number)
    }

    /// How many bytes there are in all.
    pub fn bytes(&self) -> u64 {
        self.0.iter().map(|(_, bytes)| bytes.len() as u64).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_found_by_number_and_stay_in_order() {
        let mut pieces = Pieces::default();
        for number in [5, 1, 9, 3, 1] {
            pieces.insert(number, vec![number as u8; number as usize]);
        }
        assert!(pieces.numbers().eq([1, 3, 5, 9]));
        assert_eq!((pieces.len(), pieces.bytes()), (4, 18));
        assert!(pieces.has(3) && !pieces.has(4));
        assert_eq!((pieces.remove(3), pieces.remove(4)), (Some(vec![3; 3]), None));
        pieces.retain(|number| number > 4);
        assert!(pieces.numbers().eq([5, 9]));
    }
}

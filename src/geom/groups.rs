//! Numbers sorted into numbered groups.

use std::ops::Range;

/// Numbers sorted into groups `0..count`, in one array; each group keeps the order in which its numbers came.
#[derive(Clone, Debug, Default)]
#[doc(hidden)]
pub struct Groups {
    /// Where each group starts in `items`, and the end of the last one.
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Groups {
    /// Sorts what `list` lists: groups, each with a number that is in it. It is called twice.
    pub fn new(count: usize, list: impl Fn(&mut dyn FnMut(usize, u32))) -> Self {
        let mut starts = vec![0_u32; count + 1];
        list(&mut |group, _| starts[group + 1] += 1);
        (1..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
        let mut next = starts.clone();
        let mut items = vec![0; starts[count] as usize];
        list(&mut |group, item| {
            items[next[group] as usize] = item;
            next[group] += 1;
        });
        Self { starts, items }
    }

    /// The numbers in a group.
    #[inline]
    pub fn of(&self, group: usize) -> &[u32] {
        self.of_all(group..group + 1)
    }

    /// The numbers in several groups, one after the other.
    #[inline]
    pub fn of_all(&self, groups: Range<usize>) -> &[u32] {
        &self.items[self.starts[groups.start] as usize..self.starts[groups.end] as usize]
    }
}

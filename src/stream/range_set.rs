//! Sets of bytes of a file, as ranges.

use std::ops::Range;

/// Ranges in order, none empty, with something between any two.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RangeSet {
    ranges: Vec<Range<u64>>,
}

impl RangeSet {
    /// The union of `ranges`, in any order.
    pub fn of(mut ranges: Vec<Range<u64>>) -> Self {
        ranges.retain(|range| range.start < range.end);
        ranges.sort_unstable_by_key(|range| range.start);
        // Each is taken into the one before, as far as that has come, if they touch.
        ranges.dedup_by(|next, last| {
            let touches = next.start <= last.end;
            if touches {
                last.end = last.end.max(next.end);
            }
            touches
        });
        Self { ranges }
    }

    /// Takes the bytes of `range` in.
    pub fn insert(&mut self, range: &Range<u64>) {
        if range.start >= range.end {
            return;
        }
        let first = self.ranges.partition_point(|found| found.end < range.start);
        let behind = self.ranges.partition_point(|found| found.start <= range.end);
        let meets = self.ranges[first..behind].iter();
        let whole =
            meets.fold(range.clone(), |all, found| all.start.min(found.start)..all.end.max(found.end));
        self.ranges.splice(first..behind, [whole]);
    }

    /// How many bytes are in it.
    pub fn len(&self) -> u64 {
        self.ranges.iter().map(|range| range.end - range.start).sum()
    }

    /// Takes the bytes of `range` out.
    pub fn remove(&mut self, range: &Range<u64>) {
        if range.start >= range.end {
            return;
        }
        let from = self.ranges.partition_point(|found| found.end <= range.start);
        let to = self.ranges.partition_point(|found| found.start < range.end);
        if from >= to {
            return;
        }
        let before = self.ranges[from].start..range.start;
        let after = range.end..self.ranges[to - 1].end;
        self.ranges.splice(from..to, [before, after].into_iter().filter(|rest| rest.start < rest.end));
    }

    /// Whether all bytes of `range` are in it.
    pub fn contains(&self, range: &Range<u64>) -> bool {
        range.start >= range.end || self.first_in(range).as_ref() == Some(range)
    }

    /// The first run of bytes that are in the set and in `range`.
    pub fn first_in(&self, range: &Range<u64>) -> Option<Range<u64>> {
        let found = self.ranges.get(self.ranges.partition_point(|found| found.end <= range.start))?;
        let part = found.start.max(range.start)..found.end.min(range.end);
        (part.start < part.end).then_some(part)
    }

    /// The last run of bytes that are in the set and in `range`.
    pub fn last_in(&self, range: &Range<u64>) -> Option<Range<u64>> {
        let found =
            self.ranges.get(self.ranges.partition_point(|found| found.start < range.end).checked_sub(1)?)?;
        let part = found.start.max(range.start)..found.end.min(range.end);
        (part.start < part.end).then_some(part)
    }

    /// From the first to behind the last byte.
    pub fn hull(&self) -> Option<Range<u64>> {
        Some(self.ranges.first()?.start..self.ranges.last()?.end)
    }

    /// The ranges, in order.
    pub fn iter(&self) -> std::slice::Iter<'_, Range<u64>> {
        self.ranges.iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn members(set: &RangeSet) -> Vec<u64> {
        set.iter().flat_map(Clone::clone).collect()
    }

    #[test]
    fn sets_of_up_to_three_ranges_agree_with_sets_of_numbers() {
        let ranges: Vec<Range<u64>> = (0..6).flat_map(|a| (a..6).map(move |b| a..b)).collect();
        for a in &ranges {
            for b in &ranges {
                let both = RangeSet::of(vec![a.clone(), b.clone()]);
                let expected: Vec<u64> = (0..6).filter(|x| a.contains(x) || b.contains(x)).collect();
                assert_eq!(members(&both), expected, "{a:?} and {b:?}");
                let hull = expected.first().map(|first| *first..expected[expected.len() - 1] + 1);
                assert_eq!(both.hull(), hull);
                assert!(both.iter().zip(both.iter().skip(1)).all(|(x, y)| x.end < y.start));
                for c in &ranges {
                    let three = RangeSet::of(vec![c.clone(), a.clone(), b.clone()]);
                    let any = |x: &u64| [a, b, c].iter().any(|range| range.contains(x));
                    assert_eq!(members(&three), (0..6).filter(any).collect::<Vec<_>>());
                    let mut less = both.clone();
                    less.remove(c);
                    let left: Vec<u64> = expected.iter().copied().filter(|x| !c.contains(x)).collect();
                    assert_eq!(members(&less), left, "{both:?} without {c:?}");
                    let inside: Vec<u64> = expected.iter().copied().filter(|x| c.contains(x)).collect();
                    assert_eq!(both.contains(c), inside.len() == c.clone().count());
                    let first = both.first_in(c);
                    assert_eq!(first.as_ref().map(|run| run.start), inside.first().copied());
                    assert!(first.is_none_or(
                        |run| run.clone().all(|x| inside.contains(&x)) && !inside.contains(&run.end)
                    ));
                }
            }
        }
    }
}

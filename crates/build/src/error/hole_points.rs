//! The stored points of a hole, in the order in which errors are looked at.
//!
//! First comes the last one of the bucket of each tetrahedron of the star, then the one before, and so on: as in
//! [`Lists::gather`](crate::error::points::Lists::gather). What put a filling beyond its limit changes places with the first one. Of large
//! buckets some are in memory at a time.

use crate::error::stored_points::StoredPoints;
use std::borrow::Borrow;
use std::ops::{ControlFlow, Range, RangeInclusive};

/// So many records are in memory at a time, or one of each bucket: few at first, for most fillings are given up early; behind them as many
/// as have been looked at, which takes few calls of the scratch.
const AT_A_TIME: RangeInclusive<u64> = 1 << 10..=1 << 14;

/// A place in the order and what is there: the tetrahedron of the star, and the record.
pub(crate) type Place = (u64, u8, Vec<u8>);

/// The stored points of the hole that is evaluated.
#[derive(Clone, Debug, Default)]
pub(crate) struct HolePoints {
    /// How many each tetrahedron of the star has.
    counts: Vec<u64>,
    /// The rounds that are in memory, the records of each tetrahedron in the order in which they were put, and where these begin.
    rounds: Range<u64>,
    records: Vec<u8>,
    starts: Vec<usize>,
    /// The places at which others are than from the start.
    pub exchanged: Vec<Place>,
    /// Scratch space: the tetrahedra that have points left.
    left: Vec<u8>,
}

impl HolePoints {
    /// Begins with the buckets of these tetrahedra.
    pub fn start(&mut self, tets: impl Iterator<Item = u32>, stored: &StoredPoints<'_>) {
        self.counts.clear();
        self.counts.extend(tets.map(|t| stored.count(t)));
        self.rounds = 0..0;
        self.exchanged.clear();
    }

    /// Visits all points, given the tetrahedra, in their order but for what is at other places: the tetrahedron's place in the star, and the
    /// record. Returns where that broke off.
    pub fn visit<'s, S: Borrow<StoredPoints<'s>>>(
        &mut self,
        tets: impl Iterator<Item = u32> + Clone,
        stored: &mut S,
        exchanged: &[Place],
        mut visit: impl FnMut(&mut S, u8, &[u8]) -> ControlFlow<()>,
    ) -> ControlFlow<Place> {
        let (mut place, mut round) = (0, 0);
        let mut exchanged = exchanged.iter().peekable();
        let most = self.counts.iter().copied().max().unwrap_or(0);
        let record = (*stored).borrow().layout.len();
        while round < most {
            if !self.rounds.contains(&round) {
                self.load(round, tets.clone(), (*stored).borrow());
            }
            let Self { counts, rounds, records, starts, left, .. } = self;
            left.clear();
            left.extend((0..counts.len() as u8).filter(|&i| counts[usize::from(i)] > round));
            // Until then all of them have points.
            let least = left.iter().map(|&i| counts[usize::from(i)]).min().unwrap_or(most);
            let end = least.min(rounds.end);
            for round in round..end {
                for &i in &*left {
                    let own = &counts[usize::from(i)];
                    // The last one first.
                    let behind = own.min(&rounds.end) - 1 - round;
                    let at = starts[usize::from(i)] + behind as usize * record;
                    let (tet, bytes) = match exchanged.next_if(|(other, ..)| *other == place) {
                        Some((_, tet, bytes)) => (*tet, &bytes[..]),
                        None => (i, &records[at..at + record]),
                    };
                    if visit(stored, tet, bytes).is_break() {
                        return ControlFlow::Break((place, tet, bytes.to_vec()));
                    }
                    place += 1;
                }
            }
            round = end;
        }
        ControlFlow::Continue(())
    }

    /// Reads the rounds from one on.
    fn load(&mut self, from: u64, tets: impl Iterator<Item = u32>, stored: &StoredPoints<'_>) {
        let with_points = self.counts.iter().filter(|&&count| count > from).count() as u64;
        let records = (from * with_points).clamp(*AT_A_TIME.start(), *AT_A_TIME.end());
        self.rounds = from..from + (records / with_points.max(1)).max(1);
        self.records.clear();
        self.starts.clear();
        for (t, &count) in tets.zip(&self.counts) {
            self.starts.push(self.records.len());
            let [first, end] = [self.rounds.end, from].map(|round| count.saturating_sub(round));
            stored.copy(t, first..end, &mut self.records);
        }
    }

    /// Has this point change places with the first one.
    pub fn exchange(
        &mut self,
        found: Place,
        tets: impl Iterator<Item = u32> + Clone,
        mut stored: &StoredPoints<'_>,
    ) {
        if found.0 == 0 {
            return;
        }
        let mut first = None;
        let exchanged = std::mem::take(&mut self.exchanged);
        _ = self.visit(tets, &mut stored, &exchanged, |_, tet, bytes| {
            first = Some((tet, bytes.to_vec()));
            ControlFlow::Break(())
        });
        self.exchanged = exchanged;
        let Some((tet, bytes)) = first else { return };
        self.set(0, found.1, found.2);
        self.set(found.0, tet, bytes);
    }

    /// Sets what is at a place of the order.
    fn set(&mut self, place: u64, tet: u8, bytes: Vec<u8>) {
        match self.exchanged.binary_search_by_key(&place, |(other, ..)| *other) {
            Ok(at) => self.exchanged[at] = (place, tet, bytes),
            Err(at) => self.exchanged.insert(at, (place, tet, bytes)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::points::Lists;
    use crate::error::stored_points::{RecordLayout, StoredPoint};
    use crate::scratch::{InMemory, Scratch};

    const LAYOUT: RecordLayout = RecordLayout { fields: 1, jumps: false, moved: false };

    fn record(name: u32) -> Vec<u8> {
        let mut record = vec![0; LAYOUT.len()];
        record[..4].copy_from_slice(&name.to_le_bytes());
        record
    }

    fn name(record: &[u8]) -> u32 {
        StoredPoint::new(record, LAYOUT).name()
    }

    /// The names in the order of a hole, up to this place of it, and what is there.
    fn visited(
        points: &mut HolePoints,
        tets: &[u32],
        mut stored: &StoredPoints<'_>,
        until: usize,
    ) -> (Vec<(u32, u8)>, Option<Place>) {
        let mut found = Vec::new();
        let exchanged = points.exchanged.clone();
        let broken = points.visit(tets.iter().copied(), &mut stored, &exchanged, |_, tet, record| {
            found.push((name(record), tet));
            if found.len() > until { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        (found, broken.break_value())
    }

    #[test]
    fn stored_points_come_in_the_order_of_lists_wherever_they_are() {
        for scratch in [InMemory::default(), InMemory::at_once()] {
            let mut stored = StoredPoints::new(LAYOUT, 5, &scratch, "points".to_owned());
            let counts = [3, 0, 40_000, 11, 5000];
            let mut lists = Lists::new(5, 50_000);
            let mut next = 0;
            for (t, count) in (0..).zip(counts) {
                let (mut records, mut extents) = (Vec::new(), Vec::new());
                for point in next..next + count {
                    lists.put(t, point);
                    records.extend(record(point));
                }
                next += count;
                stored.store(&records, &mut extents);
                stored.put(t, extents);
            }
            let tets = [4, 0, 2, 1, 3];
            let mut expected = Vec::new();
            lists.gather(tets.iter().copied(), &mut expected);
            let mut points = HolePoints::default();
            points.start(tets.iter().copied(), &stored);
            assert_eq!(visited(&mut points, &tets, &stored, usize::MAX).0, expected);
            // As the points of lists that put a filling beyond its limit.
            for at in [7, 0, 7, 20_000, 3, 20_000] {
                let (found, place) = visited(&mut points, &tets, &stored, at);
                assert_eq!(found, expected[..=at]);
                points.exchange(place.expect("a place"), tets.iter().copied(), &stored);
                expected.swap(0, at);
                assert_eq!(visited(&mut points, &tets, &stored, usize::MAX).0, expected);
            }
        }
    }

    #[test]
    fn buckets_that_change_keep_what_is_theirs_in_a_bounded_scratch() {
        let scratch = InMemory::at_once();
        let mut all = StoredPoints::new(LAYOUT, 0, &scratch, "all".to_owned());
        for piece in 0..3 {
            let mut own = StoredPoints::new(LAYOUT, 100, &scratch, format!("piece-{piece}"));
            for t in 0..100 {
                let (mut records, mut extents) = (Vec::new(), Vec::new());
                (0..500).for_each(|point| records.extend(record(piece * 100_000 + t * 1000 + point)));
                own.store(&records, &mut extents);
                own.put(t, extents);
            }
            all.append(own);
        }
        let names = |all: &StoredPoints<'_>, t: u32| -> Vec<u32> {
            let mut records = Vec::new();
            all.copy(t, 0..all.count(t), &mut records);
            records.chunks(LAYOUT.len()).map(name).collect()
        };
        let mut expected: Vec<Vec<u32>> = (0..300).map(|t| names(&all, t)).collect();
        assert_eq!(expected[117][..3], [117_000, 117_001, 117_002]);
        for round in 0..40 {
            // Two buckets exchange what they have, turned round.
            for t in (0..300).filter(|t| t % 3 == round % 3 && t + 1 < 300) {
                let (mut one, mut other) = (expected[t].clone(), expected[t + 1].clone());
                one.reverse();
                other.reverse();
                let store = |all: &mut StoredPoints<'_>, names: &[u32]| {
                    let (mut records, mut extents) = (Vec::new(), Vec::new());
                    names.iter().for_each(|&name| records.extend(record(name)));
                    all.store(&records, &mut extents);
                    extents
                };
                let new = [store(&mut all, &other), store(&mut all, &one)];
                for (t, extents) in (t as u32..).zip(new) {
                    all.clear(t);
                    all.put(t, extents);
                }
                (expected[t], expected[t + 1]) = (other, one);
            }
            all.tidy();
        }
        assert!((0..300).all(|t| names(&all, t) == expected[t as usize]));
        let live: Vec<u32> = (0..300).filter(|t| t % 7 == 2).collect();
        (0..300).filter(|t| t % 7 != 2).for_each(|t| all.clear(t));
        all.renumber(&live);
        assert!((0..).zip(&live).all(|(now, &t)| names(&all, now) == expected[t as usize]));
        all.failure.take().expect("a scratch that has not failed");
        let bytes = |name: &str| scratch.read(name).map_or(0, |bytes| bytes.len());
        let of_all = 300 * 500 * LAYOUT.len();
        assert!(bytes("all") < 3 * of_all, "{} of {of_all}", bytes("all"));
        drop(all);
        assert_eq!(scratch.names(), [""; 0]);
    }

    #[test]
    fn a_scratch_that_fails_is_told_and_no_panic() {
        let scratch = InMemory::at_once();
        let mut stored = StoredPoints::new(LAYOUT, 1, &scratch, "points".to_owned());
        let (mut records, mut extents) = (Vec::new(), Vec::new());
        (0..20_000).for_each(|point| records.extend(record(point)));
        stored.store(&records, &mut extents);
        stored.put(0, extents);
        scratch.remove("points").expect("what was there");
        let mut read = Vec::new();
        stored.copy(0, 0..20_000, &mut read);
        assert_eq!(read.len(), records.len());
        assert!(stored.failure.is_set() && stored.failure.take().is_err());
    }
}

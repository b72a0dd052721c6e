//! What a reader of the mesh has not seen yet.

use crate::mt::MeshChanges;
use std::ops::Range;

/// What has changed since the last call, so that callers need not look at everything.
#[derive(Debug, Default)]
#[doc(hidden)]
pub struct Behind {
    /// Kept from the first time on.
    since: Option<MeshChanges>,
}

impl Behind {
    /// More has changed; `all` if every point has.
    pub fn add(&mut self, changes: &MeshChanges, all: bool) {
        let Some(since) = &mut self.since else { return };
        join(&mut since.tets, &changes.tets);
        if all {
            since.vertices.clear();
            since.vertices.push(0..u32::MAX);
        } else {
            join(&mut since.vertices, &changes.vertices);
        }
    }

    /// What has changed in a mesh of so many points and tetrahedra; the first time, everything.
    pub fn take(&mut self, points: usize, tets: usize) -> MeshChanges {
        let mut all = MeshChanges::default();
        all.vertices.push(0..u32::MAX);
        all.tets.push(0..u32::MAX);
        let mut changes = self.since.replace(MeshChanges::default()).unwrap_or(all);
        clip(&mut changes.vertices, points as u32);
        clip(&mut changes.tets, tets as u32);
        changes
    }
}

/// Adds the ranges `more` to `ranges`; both are in ascending order, and so is what comes out.
pub(super) fn join(ranges: &mut Vec<Range<u32>>, more: &[Range<u32>]) {
    let mut old = std::mem::take(ranges).into_iter().peekable();
    let mut new = more.iter().cloned().peekable();
    loop {
        let from_old = match (old.peek(), new.peek()) {
            (Some(a), Some(b)) => a.start <= b.start,
            (a, _) => a.is_some(),
        };
        let Some(next) = (if from_old { old.next() } else { new.next() }) else { return };
        match ranges.last_mut() {
            Some(last) if next.start <= last.end => last.end = last.end.max(next.end),
            _ => ranges.push(next),
        }
    }
}

/// Takes away what is beyond `len`.
fn clip(ranges: &mut Vec<Range<u32>>, len: u32) {
    ranges.retain(|range| range.start < len);
    if let Some(last) = ranges.last_mut() {
        last.end = last.end.min(len);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOST: u32 = 6;

    /// The numbers of a set of bits, as ranges.
    fn ranges(bits: u32) -> Vec<Range<u32>> {
        let mut ranges: Vec<Range<u32>> = Vec::new();
        for i in (0..MOST).filter(|i| bits >> i & 1 == 1) {
            match ranges.last_mut() {
                Some(last) if last.end == i => last.end += 1,
                _ => ranges.push(i..i + 1),
            }
        }
        ranges
    }

    #[test]
    fn what_several_changes_have_in_all_is_taken_once() {
        let change = |bits: u32| MeshChanges { vertices: ranges(bits), tets: ranges(bits) };
        for (a, b) in (0..1 << MOST).flat_map(|a| (0..1 << MOST).map(move |b| (a, b))) {
            let mut behind = Behind::default();
            assert_eq!(
                behind.take(4, 5),
                MeshChanges { vertices: ranges(0b1111), tets: ranges(0b11111) },
                "everything"
            );
            behind.add(&change(a), false);
            behind.add(&change(b), false);
            // A mesh of four points and all tetrahedra.
            let both = MeshChanges { vertices: ranges((a | b) & 0b1111), tets: ranges(a | b) };
            assert_eq!(behind.take(4, MOST as usize), both, "{a:b} and {b:b}");
            assert_eq!(behind.take(4, MOST as usize), MeshChanges::default(), "it is taken");
        }
    }
}

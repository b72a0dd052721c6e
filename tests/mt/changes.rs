//! Promise: a copy of the current mesh that is kept up to date by the changed ranges alone holds the same after every
//! compaction, for MTs of every kind.

use crate::support::builder::build;
use crate::support::compare::{Snapshot, snapshot};
use crate::support::conformance::{DELAUNAY, EDGE, HALF_EDGE, INSERTED, PAGED, Subject, inputs};
use crate::support::random::Random;
use crate::support::strategies::{config, plan};
use proptest::prelude::*;
use std::ops::Range;
use tetralod::mt::{Applied, ApplyUpdates, UpdateId};

/// Few updates between the copies, many blocks of entries: nothing is told by accident.
fn changes_tell_everything(mt: &impl ApplyUpdates, random: &mut Random) {
    let mut mesh = mt.start().expect("a valid base mesh");
    mt.updates_arrived(&mut mesh, 0);
    let mut set = vec![false; mt.updates() as usize];
    let mut copy = snapshot_of_nothing(&snapshot(&mesh));
    let (n, fields) = (set.len(), mt.info().fields.len());
    for u in (0..mt.updates()).filter(|u| u % 50 != 49).map(UpdateId) {
        set[u.0 as usize] = mt.refine(&mut mesh, u).expect("a valid MT") == Applied::Done;
    }
    for round in 0..300 {
        let refining = round / 20 % 2 == 1;
        for _ in 0..if n == 0 { 0 } else { 1 + random.below(6) } {
            let at = random.below(n);
            let u = UpdateId(at as u32);
            if set[at] != refining {
                let applied = if refining { mt.refine(&mut mesh, u) } else { mt.coarsen(&mut mesh, u) };
                set[at] ^= applied.expect("a valid MT") == Applied::Done;
            }
        }
        mesh.compact();
        let changes = mesh.take_changes();
        let now = snapshot(&mesh);
        replay(&mut copy.vertices, &now.vertices, &changes.vertices, 1);
        replay(&mut copy.positions, &now.positions, &changes.vertices, 1);
        replay(&mut copy.levels, &now.levels, &changes.vertices, fields);
        replay(&mut copy.tets, &now.tets, &changes.tets, 1);
        replay(&mut copy.neighbors, &now.neighbors, &changes.tets, 1);
        copy.counts = now.counts;
        assert_eq!(copy, now);
        let nothing = mesh.take_changes();
        assert!(nothing.vertices.is_empty() && nothing.tets.is_empty());
    }
}

proptest! {
    #![proptest_config(config(24, 2))]

    #[test]
    fn of_random_splits(plan in plan(6, 2, 0..2000), seed in any::<u64>()) {
        changes_tell_everything(&build(plan).edge_mt(), &mut Random(seed));
    }
}

#[test]
fn of_every_kind() {
    for how in [EDGE, HALF_EDGE, DELAUNAY, INSERTED, PAGED] {
        for (seed, input) in (70..).zip(inputs()) {
            let Some(subject) = Subject::new(how, input) else { continue };
            changes_tell_everything(&subject.mt, &mut Random::new(seed));
            changes_tell_everything(&subject.explicit, &mut Random::new(seed));
        }
    }
}

fn snapshot_of_nothing(now: &Snapshot) -> Snapshot {
    let mut none = now.clone();
    none.vertices.fill(u32::MAX);
    none.positions.fill([-1; 3]);
    none.levels.fill(-1);
    none.tets.fill([u32::MAX; 4]);
    none.neighbors.fill([7; 4]);
    none
}

/// Brings `copy` up to date with `now` by what lies in the changed ranges.
fn replay<T: Clone + Default>(copy: &mut Vec<T>, now: &[T], ranges: &[Range<u32>], width: usize) {
    copy.resize(now.len(), T::default());
    for range in ranges {
        let entries = range.start as usize * width..range.end as usize * width;
        copy[entries.clone()].clone_from_slice(&now[entries]);
    }
}

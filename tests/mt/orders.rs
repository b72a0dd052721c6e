//! Random MTs, their updates applied in every kind of order: the compact MT must give the oracle's mesh each time.

use crate::support::builder::{Built, Plan, build};
use crate::support::compare::{assert_same, fresh_mesh, snapshot};
use crate::support::domains::Domain;
use crate::support::random::Random;
use crate::support::strategies::{config, plan};
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::collections::BTreeSet;
use tetralod::mt::Applied;
use tetralod::mt::CurrentMesh;
use tetralod::mt::EdgeMt;
use tetralod::mt::MultiTessellation;
use tetralod::mt::UpdateId;

/// The mesh, the set it shows, and the oracle's idea of it.
struct Walk<'a> {
    built: &'a Built,
    mt: EdgeMt,
    mesh: CurrentMesh,
    set: Vec<bool>,
    live: BTreeSet<[u32; 4]>,
}

impl<'a> Walk<'a> {
    fn new(built: &'a Built) -> Self {
        let mt = built.edge_mt();
        let (mesh, set) = (fresh_mesh(&mt), vec![false; built.splits.len()]);
        Self { built, mt, mesh, set, live: built.oracle.base_set() }
    }

    /// Tries `u+` or `u−`, whichever there is to try, and asserts that it happens exactly if the DAG allows it.
    fn step(&mut self, u: u32) {
        let oracle = &self.built.oracle;
        let undo = self.set[u as usize];
        let feasible = oracle.is_feasible(&self.set, u);
        let applied = if undo {
            self.mt.coarsen(&mut self.mesh, UpdateId(u))
        } else {
            self.mt.refine(&mut self.mesh, UpdateId(u))
        };
        match applied.expect("a valid MT") {
            Applied::Done => {
                assert!(feasible, "{u} was applied though the DAG forbids it");
                if undo {
                    oracle.coarsen(&mut self.live, u)
                } else {
                    oracle.refine(&mut self.live, u)
                }
                self.set[u as usize] = !undo;
            }
            Applied::Blocked(other) => {
                assert!(!feasible, "{u} was blocked by {other:?} though the DAG allows it");
                assert_eq!(self.set[other.0 as usize], undo, "{other:?} is not in the way of {u}");
                let (above, below) = if undo { (u, other.0) } else { (other.0, u) };
                assert!(
                    oracle.ancestors[below as usize].contains(&above),
                    "{other:?} has nothing to do with {u}"
                );
            }
        }
        if self.mt.may_coarsen(&self.mesh, UpdateId(u)) {
            assert!(self.set[u as usize]);
        }
    }

    fn assert_same(&self) {
        assert_same(&self.mesh, self.built, &self.live);
    }
}

proptest! {
    #![proptest_config(config(60, 1))]

    /// All splits in label order make the reference mesh, all collapses in reverse the base mesh.
    #[test]
    fn straight_down_and_up_again(plan in plan(6, 2, 0..200)) {
        let built = build(plan);
        let mut walk = Walk::new(&built);
        let start = walk.mesh.hash();
        walk.assert_same();
        for u in 0..built.splits.len() as u32 {
            walk.step(u);
            prop_assert!(walk.set[u as usize]);
            walk.assert_same();
        }
        prop_assert_eq!(walk.mesh.tet_count(), built.info.tetrahedra as usize);
        prop_assert_eq!(walk.mesh.vertex_count(), built.info.vertices as usize);
        for u in (0..built.splits.len() as u32).rev() {
            walk.step(u);
            prop_assert!(!walk.set[u as usize]);
            walk.assert_same();
        }
        prop_assert_eq!(walk.mesh.hash(), start);
        walk.mesh.compact();
        walk.assert_same();
    }

    /// Random interleaved splits and collapses: after every step the mesh is the oracle's, feasibility by labels is
    /// feasibility in the DAG, and the hash depends on the set alone.
    #[test]
    fn small_meshes_at_random(plan in plan(6, 2, 0..14), steps in 0_usize..600, seed in any::<u64>()) {
        let built = build(plan);
        prop_assume!(!built.splits.is_empty());
        let mut walk = Walk::new(&built);
        let mut random = Random(seed);
        let mut hashes = BTreeMap::from([(walk.set.clone(), walk.mesh.hash())]);
        for _ in 0..steps {
            walk.step(random.below(built.splits.len()) as u32);
            if random.once_in(7) {
                walk.mesh.compact();
                prop_assert!(walk.mesh.tets().iter().flatten().all(|&v| v != u32::MAX));
            }
            walk.assert_same();
            let hash = walk.mesh.hash();
            prop_assert_eq!(*hashes.entry(walk.set.clone()).or_insert(hash), hash);
        }
        let different: BTreeSet<u64> = hashes.values().copied().collect();
        prop_assert_eq!(different.len(), hashes.len(), "two sets have the same hash");
    }
}

proptest! {
    #![proptest_config(config(24, 2))]

    /// The same on larger meshes with phases that mostly refine or mostly coarsen, compared every now and then.
    #[test]
    fn large_meshes_in_waves(plan in plan(6, 2, 100..1000), seed in any::<u64>()) {
        let built = build(plan);
        prop_assume!(!built.splits.is_empty());
        let mut walk = Walk::new(&built);
        let mut random = Random(seed);
        let mut refining = true;
        for step in 0..4000 {
            if random.once_in(200) {
                refining = !refining;
            }
            let u = random.below(built.splits.len()) as u32;
            if walk.set[u as usize] != refining || random.once_in(8) {
                walk.step(u);
            }
            if random.once_in(60) {
                walk.mesh.compact();
            }
            if step % 80 == 79 {
                walk.assert_same();
            }
        }
        // The same set reached straight down has the same hash.
        let mut straight = Walk::new(&built);
        (0..walk.set.len()).filter(|&u| walk.set[u]).for_each(|u| straight.step(u as u32));
        prop_assert_eq!(straight.mesh.hash(), walk.mesh.hash());
        straight.assert_same();
    }

    /// A copy that is kept up to date by the changed ranges alone holds the same after every compaction. Few updates
    /// between the copies, many blocks of entries: nothing is told by accident.
    #[test]
    fn changes_tell_everything(plan in plan(6, 2, 0..2000), seed in any::<u64>()) {
        let built = build(plan);
        let mut walk = Walk::new(&built);
        let mut random = Random(seed);
        let mut copy = snapshot_of_nothing(&snapshot(&walk.mesh));
        let n = built.splits.len();
        (0..n as u32).filter(|u| u % 50 != 49).for_each(|u| walk.step(u));
        for round in 0..300 {
            let refining = round / 20 % 2 == 1;
            for _ in 0..if n == 0 { 0 } else { 1 + random.below(6) } {
                let u = random.below(n) as u32;
                if walk.set[u as usize] != refining {
                    walk.step(u);
                }
            }
            walk.mesh.compact();
            let changes = walk.mesh.take_changes();
            let (now, fields) = (snapshot(&walk.mesh), built.info.fields.len());
            replay(&mut copy.vertices, &now.vertices, &changes.vertices, 1);
            replay(&mut copy.positions, &now.positions, &changes.vertices, 1);
            replay(&mut copy.levels, &now.levels, &changes.vertices, fields);
            replay(&mut copy.tets, &now.tets, &changes.tets, 1);
            replay(&mut copy.neighbors, &now.neighbors, &changes.tets, 1);
            copy.counts = now.counts;
            prop_assert_eq!(&copy, &now);
            let nothing = walk.mesh.take_changes();
            prop_assert!(nothing.vertices.is_empty() && nothing.tets.is_empty());
        }
    }

    /// Updates that arrive one by one, with refinement in between, end in the same meshes.
    #[test]
    fn streamed_updates_are_the_same_updates(plan in plan(6, 2, 0..300), seed in any::<u64>()) {
        let built = build(plan);
        let mut random = Random(seed);
        let mut mt = EdgeMt::new(built.info.clone(), built.base.clone());
        let mut mesh = CurrentMesh::new(mt.info(), mt.base()).expect("a valid base mesh");
        let mut set: Vec<bool> = Vec::new();
        let mut known = 0;
        for split in &built.splits {
            mt.push(&split.as_update()).expect("a valid update");
            if random.once_in(3) {
                continue;
            }
            mt.announce(&mut mesh, known);
            known = mt.updates();
            set.resize(known as usize, false);
            for _ in 0..random.below(8) {
                let u = random.below(set.len());
                let feasible = built.oracle.parents[u].iter().all(|&p| set[p as usize]);
                let free = built.oracle.children[u].iter().all(|&c| !set.get(c as usize).is_some_and(|&s| s));
                let (applied, wanted) = if set[u] {
                    (mt.coarsen(&mut mesh, UpdateId(u as u32)), free)
                } else {
                    (mt.refine(&mut mesh, UpdateId(u as u32)), feasible)
                };
                prop_assert_eq!(applied == Ok(Applied::Done), wanted);
                set[u] ^= wanted;
            }
            if random.once_in(5) {
                mesh.compact();
            }
        }
        mt.announce(&mut mesh, known);
        set.resize(built.splits.len(), false);
        assert_same(&mesh, &built, &built.oracle.extract(&set));
        prop_assert_eq!(&mt, &built.edge_mt());
        // What is missing can still be applied, in label order.
        for u in (0..set.len()).filter(|&u| !set[u]) {
            prop_assert_eq!(mt.refine(&mut mesh, UpdateId(u as u32)), Ok(Applied::Done));
        }
        assert_same(&mesh, &built, &built.oracle.extract(&vec![true; set.len()]));
    }
}

fn snapshot_of_nothing(now: &crate::support::compare::Snapshot) -> crate::support::compare::Snapshot {
    let mut none = now.clone();
    none.vertices.fill(u32::MAX);
    none.positions.fill([-1; 3]);
    none.levels.fill(-1);
    none.tets.fill([u32::MAX; 4]);
    none.neighbors.fill([7; 4]);
    none
}

/// Brings `copy` up to date with `now` by what lies in the changed ranges.
fn replay<T: Clone + Default>(copy: &mut Vec<T>, now: &[T], ranges: &[std::ops::Range<u32>], width: usize) {
    copy.resize(now.len(), T::default());
    for range in ranges {
        let entries = range.start as usize * width..range.end as usize * width;
        copy[entries.clone()].clone_from_slice(&now[entries]);
    }
}

/// Every consistent set of some tiny MTs is reached, through every feasible update of every set.
#[test]
fn every_consistent_set_of_tiny_mts() {
    let mut dependent = 0;
    for seed in 0..24 {
        let domain =
            [Domain::Cube(1), Domain::Cube(2), Domain::Ell(1), Domain::Ring, Domain::TwoComponents(1)];
        let plan = Plan { domain: domain[seed as usize % 5], seed, fields: 1, updates: 9 };
        let built = build(plan);
        dependent += built.oracle.parents.iter().filter(|p| !p.is_empty()).count();
        let n = built.splits.len();
        let members = |bits: u32| (0..n).map(|u| bits >> u & 1 == 1).collect::<Vec<bool>>();
        let consistent: BTreeSet<u32> =
            (0..1_u32 << n).filter(|&bits| built.oracle.is_consistent(&members(bits))).collect();
        let mut reached = BTreeMap::from([(0_u32, Walk::new(&built).mesh)]);
        let mut todo = vec![0_u32];
        while let Some(bits) = todo.pop() {
            let set = members(bits);
            let live = built.oracle.extract(&set);
            assert_same(&reached[&bits], &built, &live);
            for u in 0..n as u32 {
                let (mt, mesh) = (built.edge_mt(), reached[&bits].clone());
                let mut walk = Walk { built: &built, mt, mesh, set: set.clone(), live: live.clone() };
                walk.step(u);
                let next = (0..n).fold(0, |bits, u| bits | u32::from(walk.set[u]) << u);
                let known = reached.entry(next).or_insert_with(|| {
                    todo.push(next);
                    walk.mesh.clone()
                });
                assert_eq!(known.hash(), walk.mesh.hash());
            }
        }
        let found: BTreeSet<u32> = reached.keys().copied().collect();
        assert_eq!(found, consistent);
    }
    assert!(dependent > 50, "the tiny MTs have hardly any dependencies: {dependent}");
}

/// The label facts that everything rests on: a tetrahedron is created by the largest `c` of its vertices and
/// removed by the smallest `s`.
#[test]
fn labels_tell_creators_and_removers() {
    for seed in 0..12 {
        let domain =
            [Domain::Cube(3), Domain::Ell(2), Domain::Ring, Domain::TwoComponents(2)][seed as usize % 4];
        let built = build(Plan { domain, seed, fields: 1, updates: 1000 });
        assert!(built.splits.len() > 8, "seed {seed}: {}", built.splits.len());
        let mt = built.edge_mt();
        let base = built.oracle.base.iter().copied();
        let all = base.chain(built.oracle.nodes.iter().flat_map(|n| n.inserted.iter().copied()));
        for tet in all.map(crate::support::oracle::sorted) {
            let labels = tet.map(tetralod::mt::VertexId);
            let creator = labels.iter().filter_map(|&v| mt.created_by(v)).max().map(|u| u.0);
            let remover = labels.iter().filter_map(|&v| mt.split_by(v)).min().map(|u| u.0);
            assert_eq!(creator, built.oracle.creator.get(&tet).copied());
            assert_eq!(remover, built.oracle.remover.get(&tet).copied());
        }
    }
}

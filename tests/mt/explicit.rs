//! The explicit MT, made from the compact one by replaying it, against the records of the random builder.

use crate::support::builder::{Built, Plan, build};
use crate::support::domains::{Domain, volume6};
use crate::support::oracle::sorted;
use crate::support::random::Random;
use crate::support::strategies::{config, plan};
use proptest::prelude::*;
use std::collections::BTreeSet;
use tetralod::mt::{ExplicitMt, MultiTessellation, UpdateId, VertexId, stats};

fn explicit(built: &Built) -> ExplicitMt {
    ExplicitMt::of(&built.edge_mt()).expect("a valid MT")
}

fn as_sets<'a>(tets: impl IntoIterator<Item = &'a [u32; 4]>) -> BTreeSet<[u32; 4]> {
    tets.into_iter().map(|t| sorted(*t)).collect()
}

/// The longest chain of updates that depend on each other.
fn depth(built: &Built) -> u32 {
    let mut depths: Vec<u32> = Vec::new();
    for parents in &built.oracle.parents {
        depths.push(1 + parents.iter().map(|&p| depths[p as usize]).max().unwrap_or(0));
    }
    depths.into_iter().max().unwrap_or(0)
}

proptest! {
    #![proptest_config(config(40, 3))]

    /// Vertices, tetrahedra, updates and arcs are those that the builder recorded.
    #[test]
    fn is_what_the_builder_recorded(plan in plan(4, 3, 0..400)) {
        let built = build(plan);
        let (oracle, explicit) = (&built.oracle, explicit(&built));
        prop_assert_eq!(explicit.check(), Ok(()));
        prop_assert_eq!(explicit.vertices() as usize, oracle.positions.len());
        for v in 0..explicit.vertices() {
            prop_assert_eq!(explicit.position(VertexId(v)), oracle.positions[v as usize]);
            prop_assert_eq!(explicit.levels(VertexId(v)), &oracle.levels[v as usize][..]);
        }
        let tets = explicit.tets();
        prop_assert!(tets.iter().all(|t| volume6(t.map(|v| oracle.positions[v as usize])) > 0));
        let slice = |range: std::ops::Range<u32>| &tets[range.start as usize..range.end as usize];
        prop_assert_eq!(as_sets(slice(explicit.base_tets())), oracle.base_set());
        prop_assert_eq!(explicit.updates(), oracle.updates());
        let mut end = explicit.base_tets().end;
        for u in 0..explicit.updates() {
            let (id, node) = (UpdateId(u), &oracle.nodes[u as usize]);
            prop_assert_eq!(explicit.inserted(id).start, end);
            end = explicit.inserted(id).end;
            prop_assert_eq!(explicit.inserted(id).len(), node.inserted.len());
            prop_assert_eq!(as_sets(slice(explicit.inserted(id))), as_sets(&node.inserted));
            let removed = explicit.removed(id).iter().map(|&t| &tets[t as usize]);
            prop_assert_eq!(as_sets(removed), as_sets(&node.removed));
            prop_assert!(explicit.removed(id).iter().all(|&t| explicit.removed_by(t) == Some(id)));
            let set = |row: &[u32]| row.iter().copied().collect::<BTreeSet<u32>>();
            prop_assert_eq!(&set(explicit.parents(id)), &oracle.parents[u as usize]);
            prop_assert_eq!(explicit.parents(id).len(), oracle.parents[u as usize].len());
            prop_assert_eq!(&set(&explicit.children(id)), &oracle.children[u as usize]);
            prop_assert_eq!(explicit.children(id).len(), oracle.children[u as usize].len());
            prop_assert_eq!(explicit.error(id).0, oracle.errors[u as usize]);
            prop_assert!(explicit.inserted(id).all(|t| explicit.inserted_by(t) == Some(id)));
        }
        prop_assert!(explicit.base_tets().all(|t| explicit.inserted_by(t).is_none()));
        let removed = (0..tets.len() as u32).filter(|&t| explicit.removed_by(t).is_some());
        prop_assert_eq!(removed.count(), oracle.remover.len());
        prop_assert_eq!(end as usize, tets.len());
    }

    /// Σ_S, consistency and feasibility are the oracle's, for random walks over sets, and for random sets.
    #[test]
    fn extracts_what_the_oracle_extracts(plan in plan(4, 3, 1..60), seed in any::<u64>()) {
        let built = build(plan);
        let (oracle, explicit) = (&built.oracle, explicit(&built));
        let mut random = Random(seed);
        let mut set = vec![false; built.splits.len()];
        for _ in 0..if set.is_empty() { 0 } else { 200 } {
            let u = random.below(set.len()) as u32;
            let feasible = oracle.is_feasible(&set, u);
            prop_assert_eq!(explicit.is_feasible(&set, UpdateId(u)), feasible);
            set[u as usize] ^= feasible;
            prop_assert!(explicit.is_consistent(&set));
            let found = explicit.extract(&set).expect("a consistent set");
            let found: Vec<_> = found.iter().map(|&t| explicit.tets()[t as usize]).collect();
            let live = oracle.extract(&set);
            prop_assert_eq!(found.len(), live.len());
            prop_assert_eq!(as_sets(&found), live);
            let any: Vec<bool> = set.iter().map(|&s| s ^ random.once_in(9)).collect();
            prop_assert_eq!(explicit.is_consistent(&any), oracle.is_consistent(&any));
            prop_assert_eq!(explicit.extract(&any).is_some(), oracle.is_consistent(&any));
        }
    }

    /// The numbers of `stats` are those counted from the records.
    #[test]
    fn stats_count_the_records(plan in plan(4, 3, 0..400)) {
        let built = build(plan);
        let (oracle, mt) = (&built.oracle, built.edge_mt());
        let found = stats(&mt).expect("a valid MT");
        let n = oracle.nodes.len();
        prop_assert_eq!(found.updates as usize, n);
        prop_assert_eq!(found.vertices, built.info.vertices);
        prop_assert_eq!(u64::from(found.tetrahedra), built.info.tetrahedra);
        prop_assert_eq!(found.mt_vertices as usize, oracle.positions.len());
        let arcs: usize = oracle.parents.iter().map(BTreeSet::len).sum();
        prop_assert_eq!(found.arcs, arcs as u64);
        prop_assert_eq!(found.depth, depth(&built));
        prop_assert_eq!(found.max_parents as usize, oracle.parents.iter().map(BTreeSet::len).max().unwrap_or(0));
        let (removed, inserted): (Vec<usize>, Vec<usize>) =
            oracle.nodes.iter().map(|node| (node.removed.len(), node.inserted.len())).unzip();
        prop_assert_eq!(found.removed, removed.iter().sum::<usize>() as u64);
        prop_assert_eq!(found.inserted, inserted.iter().sum::<usize>() as u64);
        prop_assert_eq!(found.max_removed as usize, removed.iter().copied().max().unwrap_or(0));
        prop_assert_eq!(found.max_inserted as usize, inserted.iter().copied().max().unwrap_or(0));
        let tets = oracle.base.len() + inserted.iter().sum::<usize>();
        prop_assert_eq!(found.mt_tetrahedra, tets as u64);
        if n > 0 {
            prop_assert_eq!(found.inserted_per_update(), found.inserted as f64 / n as f64);
        }

        let fields = built.info.fields.len();
        let vertex = 4 * (3 + fields);
        // One counter each and one list each of parents, children, removed; a counter and an index for inserted.
        let nodes = n * (1 + 1 + 1 + 1 + 4) + 4 * (2 * arcs + removed.iter().sum::<usize>());
        let explicit_bytes = oracle.positions.len() * vertex + 16 * tets + nodes;
        prop_assert_eq!(found.explicit_bytes, explicit_bytes as u64);
        prop_assert_eq!(explicit(&built).paper_bytes(), explicit_bytes as u64);
        let (v, t) = (built.info.vertices as usize, built.info.tetrahedra as usize);
        prop_assert_eq!(found.indexed_bytes, (v * vertex + 16 * t) as u64);
        prop_assert_eq!(found.adjacency_bytes, (v * vertex + 32 * t) as u64);
        // Forest, numbering and mask: five words an update; with them, bit by bit, the offset, the edge that it is counted from and the
        // field offsets; and errors.
        let (b, base_tets) = (built.base.positions.len(), built.base.tets.len());
        let errors = if fields == 1 { 2 } else { 2 * (fields + 1) };
        let bits = 3 * (built.info.lattice.bits + 2) + 7 + built.info.fields.iter().map(|f| f.bits + 3).sum::<u32>();
        let words = 5 + bits.div_ceil(32) as usize;
        let compact = b * (vertex + 4) + 16 * base_tets + n * (4 * words + errors);
        // And an entry for each page, of 1024 updates at most.
        let pages = mt.bytes() - compact as u64;
        prop_assert!(pages <= 64 * n.div_ceil(1024) as u64, "{pages}");
        prop_assert_eq!(found.compact_bytes, mt.bytes());
    }

    /// What the structure really holds is within the paper's estimate [§3], by all vertices and tetrahedra of the MT;
    /// the base mesh, which is small, is held twice.
    #[test]
    fn explicit_bytes_are_within_the_estimate(plan in plan(5, 2, 0..300)) {
        let mt = explicit(&build(Plan { fields: 1, ..plan }));
        let base = mt.base();
        let twice = 16 * (base.positions.len() + base.tets.len());
        let estimate = 24 * mt.vertices() as usize + 28 * mt.tets().len();
        prop_assert!(mt.bytes() as usize <= estimate + twice + 12);
    }
}

/// The random builder makes MTs worth testing: deep, with many arcs, and with cases that are easy to get wrong.
#[test]
fn random_mts_are_worth_testing() {
    let built = build(Plan { domain: Domain::Cube(5), seed: 5, fields: 1, updates: 10_000 });
    let found = stats(&built.edge_mt()).expect("a valid MT");
    assert!(found.updates > 120, "{found:?}");
    assert!(found.depth > 20, "{found:?}");
    assert!(found.arcs_per_update() > 3.0, "{found:?}");
    assert!(found.max_removed > 30 && found.max_inserted > 40, "{found:?}");
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
        for tet in all.map(sorted) {
            let labels = tet.map(VertexId);
            let creator = labels.iter().filter_map(|&v| mt.created_by(v)).max().map(|u| u.0);
            let remover = labels.iter().filter_map(|&v| mt.split_by(v)).min().map(|u| u.0);
            assert_eq!(creator, built.oracle.creator.get(&tet).copied());
            assert_eq!(remover, built.oracle.remover.get(&tet).copied());
        }
    }
}

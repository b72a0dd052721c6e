//! MTs as the real builder makes them, spelled out: random walks over consistent sets against the explicit MT.

use crate::support::compare::{fresh_mesh, live_tets};
use crate::support::domains::Domain;
use crate::support::oracle::sorted;
use crate::support::random::Random;
use std::collections::BTreeSet;
use std::ops::ControlFlow;
use tetralod::build::BuildConfig;
use tetralod::build::edge_mt;
use tetralod::mesh::Field;
use tetralod::mesh::TetMesh;
use tetralod::mt::Applied;
use tetralod::mt::ExplicitMt;
use tetralod::mt::MtKind;
use tetralod::mt::MultiTessellation;
use tetralod::mt::UpdateId;
use tetralod::mt::stats;

fn mesh(domain: Domain, random: &mut Random) -> TetMesh {
    let plain = domain.mesh(random);
    let positions: Vec<[f64; 3]> = plain.positions.iter().map(|p| p.map(f64::from)).collect();
    let values = positions.iter().map(|[x, y, z]| (x / 200.0).sin() + y * z / 1e6).collect();
    TetMesh { positions, fields: vec![Field::new("f", values)], tets: plain.tets, ..TetMesh::default() }
}

#[test]
fn built_mts_refine_and_coarsen_as_their_explicit_twins() {
    let domains =
        [Domain::Cube(7), Domain::Ell(3), Domain::Ring, Domain::TwoComponents(3), Domain::SingleTet];
    let mut updates = 0;
    for (seed, domain) in (0..).zip(domains) {
        let mut random = Random(seed);
        let input = mesh(domain, &mut random);
        let built = edge_mt(&input, &BuildConfig::of(MtKind::Edge), &mut |_| ControlFlow::Continue(()))
            .expect("a build");
        let mt = built.mt;
        let explicit = ExplicitMt::of(&mt).expect("a valid MT");
        assert_eq!(explicit.check(), Ok(()), "{domain:?}");
        let found = stats(&mt).expect("a valid MT");
        assert_eq!(found.depth, built.summary.depth, "{domain:?}");
        assert_eq!(found.explicit_bytes, explicit.bytes());
        assert_eq!(
            (found.vertices as usize, found.tetrahedra as usize),
            (input.positions.len(), input.tets.len())
        );
        let n = mt.updates() as usize;
        updates += n;
        let (mut current, mut set) = (fresh_mesh(&mt), vec![false; n]);
        for step in 0..if n == 0 { 0 } else { 6000 } {
            let u = random.below(n);
            let id = UpdateId(u as u32);
            let feasible = explicit.is_feasible(&set, id);
            let applied = if set[u] { mt.coarsen(&mut current, id) } else { mt.refine(&mut current, id) };
            assert_eq!(applied.map(|a| a == Applied::Done), Ok(feasible), "{domain:?} update {u}");
            set[u] ^= feasible;
            if step % 500 == 499 {
                assert_eq!(current.check(), Ok(()));
                let wanted = explicit.extract(&set).expect("a consistent set");
                let wanted: BTreeSet<_> =
                    wanted.iter().map(|&t| sorted(explicit.tets()[t as usize])).collect();
                let live: BTreeSet<_> = live_tets(&current).into_iter().map(sorted).collect();
                assert_eq!(live, wanted, "{domain:?}");
            }
        }
    }
    assert!(updates > 500, "the builder made {updates} updates only");
}

//! How the property tests draw their cases.

use super::builder::Plan;
use super::domains::Domain;
use super::random;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::ops::Range;

/// So many cases, the same ones on every run with the same `TETRALOD_SEED`.
pub fn config(cases: u32, seed: u64) -> ProptestConfig {
    ProptestConfig {
        cases,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(random::seed(seed)),
        ..ProptestConfig::default()
    }
}

/// Random MTs in all domains: cubes of up to `cells` cells a side, up to `components` components.
pub fn plan(cells: usize, components: usize, updates: Range<usize>) -> impl Strategy<Value = Plan> {
    let domain = prop_oneof![
        Just(Domain::SingleTet),
        (1..=cells).prop_map(Domain::Cube),
        (1_usize..=2).prop_map(Domain::Ell),
        (1..=components).prop_map(Domain::TwoComponents),
        Just(Domain::Ring),
    ];
    (domain, any::<u64>(), 1_usize..=3, updates).prop_map(|(domain, seed, fields, updates)| Plan {
        domain,
        seed,
        fields,
        updates,
    })
}

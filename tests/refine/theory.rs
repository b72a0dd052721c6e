//! Promise: whatever was asked for before, a request is answered with the smallest consistent set that satisfies it,
//! as the explicit MT tells it by plain closure.

use crate::subjects::{SUBJECTS, Subject, applied, sorted, tets};
use crate::support::meshes::prefix;
use crate::support::strategies::config;
use proptest::prelude::*;
use std::collections::BTreeSet;
use tetralod::geom::Bounds;
use tetralod::mt::{ErrorCode, MultiTessellation};
use tetralod::refine::{Budget, Front, LodCriterion, Need, Region, Request};
use tetralod_build::measure::{Part, Reference, deviation};

/// A request in fractions of the subject's bounds and ranges.
#[derive(Clone, Debug)]
struct Wish {
    error: f64,
    roi: Option<[[f64; 2]; 3]>,
    isovalues: Vec<f64>,
    field: usize,
    budget: Option<f64>,
}

impl Wish {
    fn of(&self, subject: &Subject) -> Request {
        let bounds = Bounds::of(&subject.input.positions);
        let info = subject.mt.info();
        let field = self.field % info.fields.len();
        let at = |axis: usize, part: f64| bounds.min[axis] + part * bounds.extent()[axis];
        let roi = self.roi.map(|roi| Bounds {
            min: [0, 1, 2].map(|i| at(i, roi[i][0].min(roi[i][1]))),
            max: [0, 1, 2].map(|i| at(i, roi[i][0].max(roi[i][1]))),
        });
        let value = |part: &f64| info.fields[field].min + part * info.fields[field].range();
        let max_tets = self.budget.map(|part| (part * info.tetrahedra as f64) as u32);
        let isovalues: Vec<f64> = self.isovalues.iter().map(value).collect();
        let need = Need::within(self.error).limited(roi.map(Region::Box), field, &isovalues);
        Request { needs: vec![need], budget: Budget { tets: max_tets, ..Budget::default() } }
    }
}

fn wish(budget: bool) -> impl Strategy<Value = Wish> {
    let error = prop_oneof![Just(0.0), Just(0.001), Just(0.01), Just(0.05), 0.0..0.3, Just(f64::INFINITY)];
    let side = || [-0.1..1.1, -0.1..1.1];
    let roi = prop::option::of([side(), side(), side()]);
    let isovalues = prop::collection::vec(-0.05..1.05, 0..3);
    let budget = if budget { (0.0..1.1).prop_map(Some).boxed() } else { Just(None).boxed() };
    (error, roi, isovalues, 0_usize..2, budget).prop_map(|(error, roi, isovalues, field, budget)| Wish {
        error,
        roi,
        isovalues,
        field,
        budget,
    })
}

proptest! {
    #![proptest_config(config(600, 99))]

    /// One front is asked for one thing after the other: each answer is the closure, and what the oracle extracts.
    #[test]
    fn any_sequence_of_requests_is_answered_with_the_closure(
        subject in 0_usize..4,
        wishes in prop::collection::vec(wish(false), 1..8),
    ) {
        let subject = &SUBJECTS[subject];
        let mut front = subject.fresh();
        for wish in wishes {
            let request = wish.of(subject);
            let outcome = subject.satisfy(&mut front, &request);
            let wanted = subject.closure(&LodCriterion::new(subject.mt.info(), &request));
            prop_assert_eq!(&applied(&front, &subject.mt), &wanted, "{:?}", request);
            let live = subject.explicit.extract(&wanted).expect("a consistent set");
            let live: BTreeSet<_> = live.iter().map(|&t| sorted(subject.explicit.tets()[t as usize])).collect();
            prop_assert_eq!(tets(front.mesh()), live);
            prop_assert_eq!(front.mesh().check(), Ok(()));
            prop_assert!(outcome.satisfied && outcome.error.error() <= request.needs[0].error);
            let mut other = subject.fresh();
            subject.satisfy(&mut other, &request);
            prop_assert_eq!(other.mesh().hash(), front.mesh().hash());
        }
    }

    /// With budgets in between, the same request still gives the same mesh, within the budget.
    #[test]
    fn budgets_are_kept_and_forget_the_past(
        subject in 0_usize..4,
        wishes in prop::collection::vec((wish(true), wish(false)), 1..5),
    ) {
        let subject = &SUBJECTS[subject];
        let mut front = subject.fresh();
        let least = subject.mt.base().tets.len();
        for wish in wishes.into_iter().flat_map(|(a, b)| [a, b]) {
            let request = wish.of(subject);
            let outcome = subject.satisfy(&mut front, &request);
            let mut other = subject.fresh();
            let alone = subject.satisfy(&mut other, &request);
            prop_assert_eq!(applied(&front, &subject.mt), applied(&other, &subject.mt), "{:?}", request);
            prop_assert_eq!((outcome.error, outcome.satisfied), (alone.error, alone.satisfied));
            prop_assert_eq!(front.mesh().check(), Ok(()));
            prop_assert_eq!(outcome.satisfied, outcome.error.error() <= request.needs[0].error);
            let unlimited = subject.closure(&LodCriterion::new(subject.mt.info(), &request));
            let set = applied(&front, &subject.mt);
            prop_assert!(set.iter().zip(&unlimited).all(|(s, u)| *u || !s), "more than was asked for");
            let needed = subject.explicit.extract(&unlimited).expect("a consistent set").len();
            match request.budget.tets.map(|b| b as usize) {
                Some(budget) if budget < needed => {
                    prop_assert!(front.mesh().tet_count() <= budget.max(least));
                }
                _ => prop_assert_eq!(set, unlimited, "there was room for everything"),
            }
        }
    }
}

proptest! {
    #![proptest_config(config(100, 99))]

    /// While updates arrive, what is there is a valid MT: the closure in it, true bounds, and no claim to be done
    /// where data is missing.
    #[test]
    fn prefixes_keep_the_promises(
        subject in 0_usize..4,
        arrived in prop::collection::vec(0.0..1.0, 1..4),
        wishes in prop::collection::vec(wish(false), 3),
    ) {
        let subject = &SUBJECTS[subject];
        let mut arrived: Vec<u32> = arrived.iter().map(|x| (x * f64::from(subject.mt.updates())) as u32).collect();
        arrived.sort_unstable();
        let mut front = subject.fresh_base();
        for (updates, wish) in arrived.into_iter().zip(wishes) {
            let part = Subject::of(subject.input.clone(), prefix(&subject.mt, updates));
            let request = wish.of(subject);
            let outcome = part.satisfy(&mut front, &request);
            let criterion = LodCriterion::new(part.mt.info(), &request);
            prop_assert_eq!(&applied(&front, &part.mt), &part.closure(&criterion));
            prop_assert_eq!(front.mesh().check(), Ok(()));
            let whole = subject.closure(&criterion);
            // Those that have not arrived are behind the ones that have.
            let missing = whole.iter().skip(updates as usize).any(|&s| s);
            prop_assert!(!(outcome.satisfied && missing), "satisfied with {updates} updates: {request:?}");
            prop_assert_eq!(outcome.satisfied, outcome.error.error() <= request.needs[0].error);
            let everywhere = Request::within(request.needs[0].error);
            let outcome = part.satisfy(&mut front, &everywhere);
            within_bound(subject, &front, outcome.error);
        }
    }
}

impl Subject {
    /// The base mesh, before any update has arrived.
    fn fresh_base(&self) -> Front {
        Front::new(&prefix(&self.mt, 0)).expect("a valid base mesh")
    }
}

/// Asserts that the field is within the bound at every reference vertex.
fn within_bound(subject: &Subject, front: &Front, bound: ErrorCode) {
    let info = subject.mt.info();
    for (f, field) in info.fields.iter().enumerate() {
        let reference = Reference {
            positions: &subject.input.positions,
            values: &subject.input.fields[f].values,
            field: f,
            regions: &[],
        };
        let found = deviation(info, front.mesh(), &reference, &Part::default());
        // What the lattices round off is the least that there can be.
        let allowed = bound.error().max(info.floor(f)) * field.range() * (1.0 + 1e-9);
        assert!(found.field <= allowed, "{}: {} of {allowed}", field.name, found.field);
        assert_eq!(found.vertices, subject.input.positions.len() as u64);
    }
}

#[test]
fn the_bounds_are_true_and_not_far_off() {
    for subject in SUBJECTS.iter() {
        let mut front = subject.fresh();
        for error in [0.0, 0.0001, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, f64::INFINITY] {
            let outcome = subject.satisfy(&mut front, &Request::within(error));
            assert!(outcome.satisfied);
            within_bound(subject, &front, outcome.error);
        }
    }
}

#[test]
fn a_box_costs_less_than_everything() {
    let subject = &SUBJECTS[0];
    let mut front = subject.fresh();
    subject.satisfy(&mut front, &Request::within(0.0));
    let all = front.mesh().tet_count();
    assert_eq!(all, subject.input.tets.len());
    let roi = Bounds { min: [0.0; 3], max: [0.1; 3] };
    subject.satisfy(&mut front, &Need::within(0.0).inside(roi).into());
    let some = front.mesh().tet_count();
    assert!(some < all * 9 / 10, "{some} of {all}");
    let outside = Bounds { min: [5.0; 3], max: [6.0; 3] };
    let outcome = subject.satisfy(&mut front, &Need::within(0.0).inside(outside).into());
    assert_eq!((front.applied_count(), outcome.error, outcome.satisfied), (0, ErrorCode::ZERO, true));
}

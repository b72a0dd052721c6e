//! Promise: any order of the updates that extends the partial order will do, whatever the errors are along the numbers. And
//! whatever the errors are, refinement ends with a valid mesh.

use crate::random_orders::{random_order, reordered};
use crate::subjects::{SUBJECTS, Subject, applied, tets};
use crate::support::random::Random;
use std::collections::BTreeSet;
use tetralod::geom::Bounds;
use tetralod::mt::{EdgeMt, EdgeUpdate, ErrorCode, MultiTessellation, UpdateId};
use tetralod::refine::{LodCriterion, Need, Request};

fn requests(subject: &Subject, random: &mut Random) -> Vec<Request> {
    let bounds = Bounds::of(&subject.input.positions);
    let field = &subject.mt.info().fields[0];
    let mut part = || random.below(1000) as f64 / 1000.0;
    let mut all = Vec::new();
    for _ in 0..6 {
        let error = part() * part() * part();
        let [a, b] = [(); 2].map(|()| [0, 1, 2].map(|i| bounds.min[i] + part() * bounds.extent()[i]));
        let roi = Bounds { min: [0, 1, 2].map(|i| a[i].min(b[i])), max: [0, 1, 2].map(|i| a[i].max(b[i])) };
        let value = field.min + part() * field.range();
        all.push(Request::within(error));
        all.push(Need::within(error).inside(roi).into());
        all.push(Need::within(error).around(0, &[value]).into());
    }
    random.shuffle(&mut all);
    all
}

/// The tetrahedra of the current mesh, by the positions of their corners.
fn places(mesh: &tetralod::mt::CurrentMesh) -> BTreeSet<[[i32; 3]; 4]> {
    let place = |tet: &[u32; 4]| {
        let mut corners = tet.map(|slot| mesh.positions()[slot as usize]);
        corners.sort_unstable();
        corners
    };
    mesh.tets().iter().map(place).collect()
}

#[test]
fn the_order_of_the_updates_does_not_show_in_any_mesh() {
    let mut random = Random::new(5);
    for subject in SUBJECTS.iter() {
        let order = random_order(&subject.explicit, |n| random.below(n));
        let other = reordered(subject, &order);
        assert!(
            (1..other.mt.updates()).any(|u| other.mt.error(UpdateId(u)) > other.mt.error(UpdateId(u - 1)))
        );
        let (mut front, mut other_front) = (subject.fresh(), other.fresh());
        for request in requests(subject, &mut random) {
            let outcome = subject.satisfy(&mut front, &request);
            let other_outcome = other.satisfy(&mut other_front, &request);
            assert_eq!(places(front.mesh()), places(other_front.mesh()), "{request:?}");
            assert_eq!((outcome.error, outcome.satisfied), (other_outcome.error, other_outcome.satisfied));
            let closure = other.closure(&LodCriterion::new(other.mt.info(), &request));
            assert_eq!(applied(&other_front, &other.mt), closure, "{request:?}");
        }
    }
}

/// The same MT with errors by anybody's whim.
fn with_errors(mt: &EdgeMt, error: &mut dyn FnMut(UpdateId) -> ErrorCode) -> EdgeMt {
    let mut other = EdgeMt::new(mt.info().clone(), mt.base().clone());
    for u in (0..mt.updates()).map(UpdateId) {
        let errors = vec![error(u); mt.info().fields.len()];
        other.push(&EdgeUpdate { errors: &errors, ..mt.update(u) }).expect("errors are not looked at");
    }
    other
}

#[test]
fn refinement_ends_whatever_the_errors_are() {
    let mut random = Random::new(6);
    for subject in SUBJECTS.iter() {
        let mt = with_errors(&subject.mt, &mut |_| ErrorCode(random.below(40_000) as u16));
        let hostile = Subject::of(subject.input.clone(), mt);
        let mut front = hostile.fresh();
        for request in requests(subject, &mut random) {
            let outcome = hostile.satisfy(&mut front, &request);
            assert!(outcome.done);
            front.mesh().check().expect("a valid mesh");
            let set = applied(&front, &hostile.mt);
            assert!(hostile.explicit.is_consistent(&set));
            let criterion = LodCriterion::new(hostile.mt.info(), &request);
            if request.needs[0].part == tetralod::refine::Part::Everywhere {
                // What is asked for by its error alone, and what that depends on.
                let tolerance = ErrorCode::at_most(request.needs[0].error);
                let mut wanted: Vec<bool> =
                    (0..set.len()).map(|u| hostile.mt.error(UpdateId(u as u32)) > tolerance).collect();
                for u in (0..set.len()).rev().filter(|&u| wanted[u]).collect::<Vec<_>>() {
                    mark_parents(&hostile, u as u32, &mut wanted);
                }
                assert_eq!(set, wanted, "{request:?}");
            } else {
                let live = hostile.explicit.extract(&set).expect("a consistent set");
                assert_eq!(live.len(), tets(front.mesh()).len());
                assert_eq!(front.largest_violation(&hostile.mt, &criterion).1, 1.0, "{request:?}");
            }
            let again = hostile.satisfy(&mut front, &request);
            assert_eq!(again.refined + again.coarsened, 0);
        }
    }
}

fn mark_parents(subject: &Subject, u: u32, wanted: &mut [bool]) {
    for &parent in subject.explicit.parents(UpdateId(u)) {
        if !std::mem::replace(&mut wanted[parent as usize], true) {
            mark_parents(subject, parent, wanted);
        }
    }
}

//! Promise: a mesh within a budget has no more of anything than that allows, unless it is the base mesh, and the least error of all
//! meshes that fit. Sizes are counted and limits compared here, from the lists of the explicit MT.

use crate::support::conformance::{DELAUNAY, EDGE, HALF_EDGE, PAGED, Subject, inputs};
use std::cmp::Reverse;
use std::collections::BTreeSet;
use tetralod::mt::{ErrorCode, MultiTessellation, UpdateId};
use tetralod::refine::{Budget, Front, LodCriterion, Request};

/// The mesh of all updates with larger errors than this.
#[derive(Clone, Copy, Debug)]
struct Stage {
    error: ErrorCode,
    tets: usize,
    vertices: usize,
}

#[derive(Clone, Copy, Debug)]
enum Limit {
    Tets(usize),
    Vertices(usize),
    Bytes(usize),
}

/// Four corners and four neighbours of four bytes; three coordinates and a value.
fn bytes(tets: usize, vertices: usize) -> usize {
    tets * (4 + 4) * 4 + vertices * (3 + 1) * 4
}

impl Limit {
    fn allows(self, tets: usize, vertices: usize) -> bool {
        match self {
            Self::Tets(most) => tets <= most,
            Self::Vertices(most) => vertices <= most,
            Self::Bytes(most) => bytes(tets, vertices) <= most,
        }
    }

    fn budget(self) -> Budget {
        match self {
            Self::Tets(most) => Budget { tets: Some(most as u32), ..Budget::default() },
            Self::Vertices(most) => Budget { vertices: Some(most as u32), ..Budget::default() },
            Self::Bytes(most) => Budget { bytes: Some(most as u64), ..Budget::default() },
        }
    }
}

/// Coarse to fine, from the base mesh to the reference mesh. Errors do not grow along the partial order, so each is one of the MT.
fn stages(subject: &Subject) -> Vec<Stage> {
    let explicit = &subject.explicit;
    let mut updates: Vec<UpdateId> = (0..explicit.updates()).map(UpdateId).collect();
    updates.sort_by_key(|&u| Reverse(explicit.error(u)));
    let base = subject.mt.base();
    let (mut tets, mut vertices) = (base.tets.len(), base.positions.len());
    let mut stages = Vec::new();
    for same in updates.chunk_by(|&a, &b| explicit.error(a) == explicit.error(b)) {
        stages.push(Stage { error: explicit.error(same[0]), tets, vertices });
        for &u in same {
            tets = tets + explicit.inserted(u).len() - explicit.removed(u).len();
            // A split makes two vertices of one, an insertion adds one.
            vertices += 1;
        }
    }
    stages.push(Stage { error: ErrorCode::ZERO, tets, vertices });
    assert_eq!([tets, vertices], [subject.input.mesh.tets.len(), subject.input.mesh.positions.len()]);
    stages
}

/// Limits that a stage just fits, and that it does not.
fn limits(stage: &Stage) -> [Limit; 6] {
    let &Stage { tets, vertices, .. } = stage;
    let all = bytes(tets, vertices);
    [
        Limit::Tets(tets),
        Limit::Tets(tets - 1),
        Limit::Vertices(vertices),
        Limit::Vertices(vertices - 1),
        Limit::Bytes(all),
        Limit::Bytes(all - 1),
    ]
}

#[test]
fn the_least_error_that_fits_is_reached_and_no_limit_exceeded() {
    for how in [EDGE, HALF_EDGE, DELAUNAY, PAGED] {
        for input in inputs() {
            let Some(subject) = Subject::new(how, input) else { continue };
            assert!(
                subject.mt.always_grows(),
                "else a budget may fit several stages with others between them"
            );
            let stages = stages(&subject);
            for stage in stages.iter().step_by(stages.len() / 6 + 1) {
                for limit in limits(stage) {
                    for tolerance in [ErrorCode::ZERO, stages[stages.len() / 2].error] {
                        check(&subject, &stages, limit, tolerance);
                    }
                }
            }
        }
    }
}

fn check(subject: &Subject, stages: &[Stage], limit: Limit, tolerance: ErrorCode) {
    let mt = &subject.mt;
    let request = Request { budget: limit.budget(), ..Request::within(tolerance.error()) };
    let mut front = Front::new(mt).expect("a valid base mesh");
    let criterion = LodCriterion::new(mt.info(), &request);
    let outcome = front.satisfy(mt, &criterion, request.budget).expect("a valid MT");
    let tets = front.mesh().tets();
    let vertices: BTreeSet<u32> = tets.iter().flatten().copied().collect();
    let what = format!("{}, {limit:?}, {tolerance:?}", subject.input.name);
    let is_base = front.applied_count() == 0;
    assert!(is_base || limit.allows(tets.len(), vertices.len()), "{what}: {} {}", tets.len(), vertices.len());
    let fits = |stage: &&Stage| limit.allows(stage.tets, stage.vertices);
    let best = stages.iter().rev().find(fits).unwrap_or(&stages[0]).error;
    let left = (0..mt.updates()).map(UpdateId).filter(|&u| !front.contains(u)).map(|u| mt.error(u)).max();
    assert_eq!(outcome.satisfied, best <= tolerance, "{what}");
    if outcome.satisfied {
        let wanted = stages.iter().find(|stage| stage.error <= tolerance).expect("the last one");
        assert_eq!([tets.len(), vertices.len()], [wanted.tets, wanted.vertices], "{what}");
    } else {
        assert_eq!([left, Some(outcome.error)], [Some(best); 2], "{what}");
    }
}

//! Promise: an MT of any kind is a Multi-Tessellation. One suite for all of them: whatever is done to a current mesh, in
//! any order, it is Σ_S as the DAG tells it, and it is within the error that S promises.

use crate::support::conformance::{
    Corners, DELAUNAY, EDGE, HALF_EDGE, How, INSERTED, Input, PAGED, Subject, deviation, empty, grow,
    in_order, inputs, random_input,
};
use crate::support::domains::Domain;
use crate::support::meshes::{blocks, hilly};
use crate::support::random::Random;
use crate::support::strategies::config;
use proptest::prelude::*;
use std::collections::{HashMap, HashSet};
use tetralod::geom::Bounds;
use tetralod::mt::{
    Applied, ApplyUpdates, CurrentMesh, ErrorCode, ExplicitMt, MostNeighbors, Mt, MultiTessellation,
    UpdateId, UpdatePages, VertexTreeMt, stats,
};
use tetralod::refine::{Budget, Front, LodCriterion, Need, Outcome, Region, Request};

macro_rules! conformance {
    ($($name:ident: $how:expr,)*) => {$(
        mod $name {
            use super::*;

            #[test]
            fn any_order_of_updates_makes_the_mesh_of_the_set() {
                any_order($how, as_built);
            }

            #[test]
            fn small_mts_in_every_consistent_set() {
                every_consistent_set($how, as_built);
            }

            #[test]
            fn requests_have_the_answer_of_the_explicit_mt() {
                requests($how, as_built);
            }

            #[test]
            fn updates_may_arrive_at_any_time() {
                arrivals($how);
            }

            #[test]
            fn every_set_is_within_the_error_that_it_promises() {
                errors($how);
            }

            proptest! {
                #![proptest_config(config(12, 7))]

                #[test]
                fn random_fields_on_random_domains(
                    domain in domain($how),
                    seed in any::<u64>(),
                    fields in 1_usize..4,
                ) {
                    random_mt($how, domain, seed, fields);
                }
            }
        }
    )*};
}

conformance! {
    edge: EDGE,
    vertex_by_half_edges: HALF_EDGE,
    vertex_by_delaunay_removal: DELAUNAY,
    vertex_by_delaunay_insertion: INSERTED,
    half_edge_in_pages: PAGED,
}

/// The same of structures that are made of an explicit MT and live in memory alone, so that nothing arrives.
macro_rules! conformance_in_memory {
    ($($name:ident: $how:expr, $structure:expr,)*) => {$(
        mod $name {
            use super::*;

            #[test]
            fn any_order_of_updates_makes_the_mesh_of_the_set() {
                any_order($how, $structure);
            }

            #[test]
            fn small_mts_in_every_consistent_set() {
                every_consistent_set($how, $structure);
            }

            #[test]
            fn requests_have_the_answer_of_the_explicit_mt() {
                requests($how, $structure);
            }

            proptest! {
                #![proptest_config(config(12, 7))]

                #[test]
                fn random_domains(domain in domain($how), seed in any::<u64>(), fields in 1_usize..4) {
                    let mut random = Random(seed);
                    let subject = Subject::new($how, random_input(domain, fields, &mut random));
                    let subject = subject.expect("a domain that suits the builder");
                    let mut walk = Walk::new(&subject, $structure(&subject));
                    walk.wander(150, &mut random);
                    walk.assert_hash_of_the_set();
                    walk.go_back(&mut random);
                }
            }
        }
    )*};
}

conformance_in_memory! {
    explicit_of_edge: EDGE, explicit,
    explicit_of_vertex: HALF_EDGE, explicit,
    trees_by_half_edges: HALF_EDGE, narrow_trees,
    trees_by_half_edges_for_64_neighbors: HALF_EDGE, wide_trees,
    trees_by_delaunay_removal: DELAUNAY, narrow_trees,
    trees_by_delaunay_insertion: INSERTED, narrow_trees,
    trees_by_delaunay_insertion_for_64_neighbors: INSERTED, wide_trees,
}

/// The structure that the builder made.
fn as_built(subject: &Subject) -> Mt {
    subject.mt.clone()
}

fn explicit(subject: &Subject) -> ExplicitMt {
    subject.explicit.clone()
}

/// The paper's node code, with 12 bits for a boundary face.
fn narrow_trees(subject: &Subject) -> VertexTreeMt {
    trees(subject, MostNeighbors::ThirtyTwo)
}

/// And with 14.
fn wide_trees(subject: &Subject) -> VertexTreeMt {
    trees(subject, MostNeighbors::SixtyFour)
}

fn trees(subject: &Subject, limit: MostNeighbors) -> VertexTreeMt {
    let trees = VertexTreeMt::from_explicit(&subject.explicit, limit).expect("an MT of insertions");
    let Ok(spelled) = ExplicitMt::of(&trees) else { panic!("not an MT: {}", subject.input.name) };
    assert!(trees.updates() == 0 || spelled == subject.explicit, "{}", subject.input.name);
    trees
}

fn domain(how: How) -> BoxedStrategy<Domain> {
    let convex = prop_oneof![1 => Just(Domain::SingleTet), 4 => (1_usize..=4).prop_map(Domain::Cube)];
    if !how.method.keeps_the_mesh() {
        return convex.boxed();
    }
    let other = prop_oneof![
        (1_usize..=2).prop_map(Domain::Ell),
        (1_usize..=2).prop_map(Domain::TwoComponents),
        Just(Domain::Ring),
    ];
    prop_oneof![convex, other].boxed()
}

fn subjects(how: How) -> impl Iterator<Item = Subject> {
    let subjects: Vec<Subject> = inputs().into_iter().filter_map(|input| Subject::new(how, input)).collect();
    assert!(subjects.len() >= 2);
    subjects.into_iter()
}

/// A mesh on its way through consistent sets of an MT that may still be arriving.
#[derive(Clone)]
struct Walk<'a, M> {
    subject: &'a Subject,
    mt: M,
    mesh: CurrentMesh,
    set: Vec<bool>,
    done: usize,
    blocked: usize,
    /// How many random steps there are from one comparison to the next.
    compare_every: usize,
}

impl<'a, M: ApplyUpdates + Clone> Walk<'a, M> {
    fn new(subject: &'a Subject, mt: M) -> Self {
        let mut mesh = mt.start().expect("a valid base mesh");
        mt.updates_arrived(&mut mesh, 0);
        let set = vec![false; subject.explicit.updates() as usize];
        Self { subject, mt, mesh, set, done: 0, blocked: 0, compare_every: 1 }
    }

    /// Tries to put `u` in or to take it out; that works when the set stays consistent. Who is said to be in the way
    /// is: not yet there though `u` depends on it, or still there though it depends on `u`.
    fn toggle(&mut self, u: u32) -> Applied {
        let Self { subject, mt, mesh, set, .. } = self;
        let (at, id) = (u as usize, UpdateId(u));
        let undo = set[at];
        let feasible = subject.explicit.is_feasible(set, id);
        let before = mesh.hash();
        if undo {
            let (mut seen, fields): (Vec<Corners>, _) = (Vec::new(), mt.info().fields.len());
            let looked = mt.look_at_removed(mesh, id, &mut |corners, levels, _, _| {
                let levels: Vec<[i32; 4]> = (0..fields).map(levels).collect();
                seen.push([0, 1, 2, 3].map(|i| (corners[i], levels.iter().map(|field| field[i]).collect())));
                false
            });
            assert_eq!(looked.expect("a valid MT") == Applied::Done, feasible);
            assert!(!feasible || in_order(seen) == subject.removed_by(id), "what {u} removes is shown");
            assert!(mt.may_coarsen(mesh, id) || !feasible);
        } else {
            assert!(!mt.may_coarsen(mesh, id));
        }
        assert_eq!(mesh.hash(), before);
        let applied = if undo { mt.coarsen(mesh, id) } else { mt.refine(mesh, id) };
        let applied = applied.expect("a valid MT");
        assert_eq!(applied == Applied::Done, feasible, "update {u}");
        match applied {
            Applied::Done => {
                set[at] = !undo;
                self.done += 1;
            }
            Applied::Blocked(UpdateId(other)) => {
                let [lower, upper] = if undo { [u, other] } else { [other, u] };
                assert!(subject.ancestors[upper as usize].contains(&lower), "{other} is nothing to {u}");
                assert_eq!(set[other as usize], undo, "{other} is not in the way of {u}");
                assert_eq!(mesh.hash(), before);
                self.blocked += 1;
            }
        }
        applied
    }

    fn assert_same(&self) {
        self.subject.assert_is(&self.mt, &self.mesh, &self.set);
    }

    /// Puts `u` in with all that it takes, which is what it depends on and nothing else.
    fn force(&mut self, u: u32) {
        let mut wanted = self.set.clone();
        wanted[u as usize] = true;
        self.subject.ancestors[u as usize].iter().for_each(|&p| wanted[p as usize] = true);
        let mut stack = vec![u];
        while let Some(&top) = stack.last() {
            match self.toggle(top) {
                Applied::Done => drop(stack.pop()),
                Applied::Blocked(parent) => stack.push(parent.0),
            }
        }
        assert_eq!(self.set, wanted);
    }

    /// Random steps, more of them one way for a while, then more of them the other way.
    fn wander(&mut self, steps: usize, random: &mut Random) {
        let mut refining = true;
        for step in 1..=steps {
            let known = self.mt.updates();
            if random.once_in(60) || known == 0 {
                refining = !refining;
            }
            if known == 0 {
                continue;
            }
            let u = random.below(known as usize) as u32;
            if self.set[u as usize] == refining && !random.once_in(6) {
                continue;
            }
            if !self.set[u as usize] && random.once_in(8) {
                self.force(u);
            } else {
                self.toggle(u);
            }
            if random.once_in(15) {
                self.mesh.compact();
                assert!(self.mesh.tets().iter().flatten().all(|&v| v != u32::MAX), "nothing is left out");
            }
            if step % self.compare_every == 0 {
                self.assert_same();
            }
        }
    }

    /// The same set reached straight down has the same hash.
    fn assert_hash_of_the_set(&self) {
        let mut straight = Walk::new(self.subject, self.mt.clone());
        for u in (0..self.mt.updates()).filter(|&u| self.set[u as usize]) {
            assert_eq!(straight.toggle(u), Applied::Done);
        }
        straight.assert_same();
        assert_eq!(straight.mesh.hash(), self.mesh.hash());
    }

    /// Back to the base mesh, in any order that works.
    fn go_back(&mut self, random: &mut Random) {
        let mut left: Vec<u32> = (0..self.mt.updates()).filter(|&u| self.set[u as usize]).collect();
        while !left.is_empty() {
            random.shuffle(&mut left);
            left.retain(|&u| self.toggle(u) != Applied::Done);
        }
        self.mesh.compact();
        self.assert_same();
        let base = self.mt.start().expect("a valid base mesh");
        assert_eq!(self.mesh.hash(), base.hash());
    }
}

fn any_order<M: ApplyUpdates + Clone>(how: How, structure: impl Fn(&Subject) -> M) {
    let (mut done, mut blocked) = (0, 0);
    for (seed, subject) in (0..).zip(subjects(how)) {
        assert_eq!(subject.explicit.check(), Ok(()), "{}", subject.input.name);
        let mut random = Random::new(seed);
        let mut walk = Walk::new(&subject, structure(&subject));
        walk.wander(400, &mut random);
        walk.go_back(&mut random);
        (done, blocked) = (done + walk.done, blocked + walk.blocked);
    }
    assert!(done > 300 && blocked > 100, "{done} done, {blocked} blocked");
}

/// The last updates of small MTs, or all of them, so few that every consistent set can be visited: from each, every one
/// of them is tried.
fn every_consistent_set<M: ApplyUpdates + Clone>(how: How, structure: impl Fn(&Subject) -> M) {
    let (mut sets, mut whole) = (0, 0);
    let cells = [[2, 1, 1], [2, 2, 1], [2, 2, 2], [9, 1, 1], [5, 5, 4], [4, 3, 3], [6, 4, 2], [3, 3, 5]];
    for (cells, seed) in cells.into_iter().zip(0..) {
        let waves: fn([f64; 3]) -> f64 = |p| (5.0 * p[0] + 3.0 * p[1]).sin() + p[2] * p[1];
        let mesh = blocks(cells, &[waves, hilly], |_| true);
        let input = Input { name: "a few cells", mesh, position_bits: None, flat: true, convex: true };
        let subject = Subject::new(how, input).expect("a convex mesh");
        let updates = subject.explicit.updates();
        let first = updates - updates.min(10);
        whole += u32::from(first == 0);
        sets += visit_all(&subject, structure(&subject), first, &mut Random::new(seed));
    }
    assert!(sets > 150 && whole > 0, "{sets} sets of {whole} whole MTs");
}

/// Visits every consistent set that holds all updates before `first`, tries everything from there, and counts them.
fn visit_all<M: ApplyUpdates + Clone>(subject: &Subject, mt: M, first: u32, random: &mut Random) -> usize {
    let updates = subject.explicit.updates();
    let mut start = Walk::new(subject, mt);
    (0..first).for_each(|u| assert_eq!(start.toggle(u), Applied::Done));
    let mut seen = HashMap::from([(0_u32, start.mesh.hash())]);
    let mut stack = vec![start];
    while let Some(walk) = stack.pop() {
        walk.assert_same();
        for u in first..updates {
            let mut next = walk.clone();
            if next.toggle(u) != Applied::Done {
                continue;
            }
            if random.once_in(3) {
                next.mesh.compact();
            }
            let set = (first..updates).fold(0, |set, u| set << 1 | u32::from(next.set[u as usize]));
            let hash = next.mesh.hash();
            let known = *seen.entry(set).or_insert_with(|| {
                stack.push(next);
                hash
            });
            assert_eq!(known, hash, "whatever the order was, the set makes the mesh");
        }
    }
    let consistent = (0..1_u32 << (updates - first)).filter(|set| {
        let is_in = |u: u32| u < first || set >> (u - first) & 1 == 1;
        subject.explicit.is_consistent(&(0..updates).map(is_in).collect::<Vec<_>>())
    });
    assert_eq!(seen.len(), consistent.count(), "all of them are reached, and no other");
    let different: HashSet<u64> = seen.values().copied().collect();
    assert_eq!(different.len(), seen.len(), "two sets have the same hash");
    seen.len()
}

fn satisfy(front: &mut Front, mt: &impl ApplyUpdates, request: &Request) -> Outcome {
    let criterion = LodCriterion::new(mt.info(), request);
    front.satisfy(mt, &criterion, request.budget).expect("a valid MT")
}

/// Any request that makes sense for the subject.
fn random_request(subject: &Subject, random: &mut Random) -> Request {
    let mut part = |from: f64, to: f64| from + (to - from) * f64::from(random.between(0, 1000)) / 1000.0;
    let info = subject.mt.info();
    let bounds = Bounds::of(&subject.input.mesh.positions);
    let [min, max] = [[0; 3].map(|_| part(-0.1, 0.7)), [0; 3].map(|_| part(0.1, 0.5))];
    let at = |axis: usize, x: f64| bounds.min[axis] + x * bounds.extent()[axis];
    let roi =
        Bounds { min: [0, 1, 2].map(|i| at(i, min[i])), max: [0, 1, 2].map(|i| at(i, min[i] + max[i])) };
    let field = (part(0.0, 0.999) * info.fields.len() as f64) as usize;
    let isovalue = info.fields[field].min + part(0.0, 1.0) * info.fields[field].range();
    let budget = (part(0.0, 1.1) * info.tetrahedra as f64) as u32;
    let error = [0.0, 0.002, 0.02, 0.1, 0.3, f64::INFINITY][random.below(6)];
    let roi = random.once_in(2).then_some(Region::Box(roi));
    let isovalues = if random.once_in(2) { vec![isovalue] } else { Vec::new() };
    let tets = random.once_in(4).then_some(budget);
    Request {
        needs: vec![Need::within(error).limited(roi, field, &isovalues)],
        budget: Budget { tets, ..Budget::default() },
    }
}

fn requests<M: ApplyUpdates>(how: How, structure: impl Fn(&Subject) -> M) {
    for (seed, subject) in (50..).zip(subjects(how)) {
        let mut random = Random::new(seed);
        let mt = structure(&subject);
        let mut front = Front::new(&mt).expect("a valid base mesh");
        let mut spelled = Front::new(&subject.explicit).expect("a valid base mesh");
        let base = front.mesh().hash();
        for _ in 0..60 {
            let request = random_request(&subject, &mut random);
            let outcome = satisfy(&mut front, &mt, &request);
            // How much had to be looked at is each structure's own affair.
            let judged = outcome.judged;
            let other = Outcome { judged, ..satisfy(&mut spelled, &subject.explicit, &request) };
            assert_eq!(other, outcome, "{request:?}");
            let set: Vec<bool> = (0..mt.updates()).map(|u| front.contains(UpdateId(u))).collect();
            assert!((0..mt.updates()).all(|u| spelled.contains(UpdateId(u)) == set[u as usize]));
            subject.assert_is(&mt, front.mesh(), &set);
            assert_eq!(front.mesh().hash(), spelled.mesh().hash());
            let mut fresh = Front::new(&mt).expect("a valid base mesh");
            let alone = satisfy(&mut fresh, &mt, &request);
            assert_eq!((alone.error, alone.satisfied), (outcome.error, outcome.satisfied));
            assert_eq!(fresh.mesh().hash(), front.mesh().hash(), "what was asked before shows: {request:?}");
        }
        satisfy(&mut front, &mt, &Request::within(f64::INFINITY));
        assert_eq!(front.mesh().hash(), base);
        satisfy(&mut front, &mt, &Request::within(0.0));
        assert_eq!(front.mesh().tet_count(), mt.info().tetrahedra as usize);
        assert_eq!(front.mesh().vertex_count(), mt.info().vertices as usize);
    }
}

fn arrivals(how: How) {
    for (seed, subject) in (90..).zip(subjects(how)) {
        arrive(&subject, 1, &mut Random::new(seed));
    }
}

fn arrive(subject: &Subject, compare_every: usize, random: &mut Random) {
    let mut walk = Walk { compare_every, ..Walk::new(subject, empty(&subject.mt)) };
    let mut front = Front::new(&walk.mt).expect("a valid base mesh");
    let whole = subject.mt.updates();
    while walk.mt.updates() < whole {
        let known = walk.mt.updates();
        let most = if random.once_in(4) { 60 } else { 9 };
        (0..random.below(most).min((whole - known) as usize)).for_each(|_| grow(&mut walk.mt, &subject.mt));
        walk.mt.updates_arrived(&mut walk.mesh, known);
        walk.assert_same();
        walk.wander(12, random);
        let request = random_request(subject, random);
        satisfy(&mut front, &walk.mt, &request);
        let set: Vec<bool> =
            (0..whole).map(|u| u < walk.mt.updates() && front.contains(UpdateId(u))).collect();
        subject.assert_is(&walk.mt, front.mesh(), &set);
    }
    assert_eq!(walk.mt, subject.mt);
    let outcome = satisfy(&mut front, &walk.mt, &Request::within(0.0));
    assert!(outcome.satisfied);
    subject.assert_is(&subject.mt, front.mesh(), &vec![true; whole as usize]);
    walk.go_back(random);
}

fn random_mt(how: How, domain: Domain, seed: u64, fields: usize) {
    let mut random = Random(seed);
    let input = random_input(domain, fields, &mut random);
    let subject = Subject::new(how, input).expect("a domain that suits the builder");
    assert_eq!(subject.explicit.check(), Ok(()));
    let mut walk = Walk::new(&subject, subject.mt.clone());
    walk.wander(150, &mut random);
    walk.assert_hash_of_the_set();
    walk.go_back(&mut random);
    assert_eq!(by_the_explicit(&subject.mt), subject.mt);
    within_errors(&subject, 3, &mut random);
}

/// The same MT by way of the explicit one.
fn by_the_explicit(mt: &Mt) -> Mt {
    let explicit = ExplicitMt::of(mt).expect("any MT can be spelled out");
    assert_eq!(ExplicitMt::of(&explicit).as_ref(), Ok(&explicit));
    let [compact, spelled] = [stats(mt), stats(&explicit)].map(|found| found.expect("a valid MT"));
    assert_eq!(compact.explicit_bytes, spelled.explicit_bytes);
    assert_eq!((compact.arcs, compact.depth, compact.bounds), (spelled.arcs, spelled.depth, spelled.bounds));
    explicit.compact(mt.info().kind).expect("it was one")
}

fn errors(how: How) {
    let mut random = Random::new(3);
    for subject in subjects(how) {
        within_errors(&subject, 12, &mut random);
    }
}

/// The strong promise: in *every* consistent set that holds all updates of a larger error than ε, whatever else is in it,
/// all reference vertices are within ε.
fn within_errors(subject: &Subject, sets: usize, random: &mut Random) {
    let updates = subject.explicit.updates();
    let error = |u: u32| subject.explicit.error(UpdateId(u));
    let mut walk = Walk::new(subject, subject.mt.clone());
    for _ in 0..sets {
        let epsilon = match updates {
            0 => ErrorCode::ZERO,
            n => error(random.below(n as usize) as u32),
        };
        let share = 1 + random.below(30);
        let wanted = (0..updates).filter(|&u| error(u) > epsilon || random.once_in(share));
        let wanted = subject.closure(wanted.collect::<Vec<_>>());
        for u in (0..updates).rev().filter(|&u| !wanted[u as usize]) {
            if walk.set[u as usize] {
                assert_eq!(walk.toggle(u), Applied::Done);
            }
        }
        for u in (0..updates).filter(|&u| wanted[u as usize]) {
            if !walk.set[u as usize] {
                assert_eq!(walk.toggle(u), Applied::Done);
            }
        }
        walk.assert_same();
        deviation::assert_within(&subject.input.mesh, &walk.mt, &walk.mesh, epsilon.error());
    }
}

/// Where the boundary is curved, or a corner is cut, a vertex comes to lie outside what was there: faces of the boundary
/// are given up. The suite above would be worth little if such updates did not occur in it.
#[test]
fn insertions_that_move_the_boundary_occur_and_are_undone_exactly() {
    for (how, least) in [(HALF_EDGE, 30), (PAGED, 30), (DELAUNAY, 5)] {
        let mut moving = 0;
        for subject in subjects(how).filter(|subject| !subject.input.flat) {
            let mut walk = Walk::new(&subject, subject.mt.clone());
            for u in (0..subject.mt.updates()).map(UpdateId) {
                let before = walk.mesh.hash();
                assert_eq!(walk.toggle(u.0), Applied::Done);
                if !subject.given_up(u).is_empty() {
                    moving += 1;
                    let with = walk.mesh.hash();
                    assert_eq!(walk.toggle(u.0), Applied::Done);
                    assert_eq!((walk.mesh.check(), walk.mesh.hash()), (Ok(()), before));
                    assert_eq!(walk.toggle(u.0), Applied::Done);
                    assert_eq!((walk.mesh.check(), walk.mesh.hash()), (Ok(()), with));
                }
            }
        }
        assert!(moving >= least, "{how:?}: {moving}");
    }
}

/// Of a domain each, larger than what is compared after every step.
#[test]
fn larger_mts_in_waves() {
    let domains =
        [Domain::Cube(7), Domain::Ell(3), Domain::Ring, Domain::TwoComponents(3), Domain::SingleTet];
    for how in [EDGE, HALF_EDGE, PAGED] {
        let mut updates = 0;
        for (seed, domain) in (0..).zip(domains) {
            let mut random = Random::new(seed);
            let subject = Subject::new(how, random_input(domain, 1, &mut random)).expect("any domain");
            assert_eq!(subject.explicit.check(), Ok(()), "{domain:?}");
            assert_eq!(
                stats(&subject.mt).map(|found| found.explicit_bytes),
                Ok(subject.explicit.paper_bytes())
            );
            updates += subject.mt.updates();
            let mut walk = Walk { compare_every: 500, ..Walk::new(&subject, subject.mt.clone()) };
            walk.wander(6000, &mut random);
            walk.assert_same();
        }
        assert!(updates > 500, "{how:?}: the builder made {updates} updates only");
    }
}

/// MTs that no builder of the library has made, of random splits; `explicit` compares what they are made of. As they are, and spelled
/// out.
mod random_splits {
    use super::*;
    use crate::support::builder::{Plan, build};
    use crate::support::strategies::plan;
    use tetralod::mesh::TetMesh;

    fn subject(plan: Plan) -> Subject {
        let mesh = TetMesh::default();
        let input = Input { name: "random splits", mesh, position_bits: None, flat: false, convex: false };
        Subject::of(input, build(plan).edge_mt().into())
    }

    fn down_and_up<M: ApplyUpdates + Clone>(subject: &Subject, mt: M) {
        let updates = mt.updates();
        let mut walk = Walk::new(subject, mt);
        let start = walk.mesh.hash();
        walk.assert_same();
        for u in 0..updates {
            assert_eq!(walk.toggle(u), Applied::Done);
            walk.assert_same();
        }
        assert_eq!(walk.mesh.tet_count(), subject.mt.info().tetrahedra as usize);
        assert_eq!(walk.mesh.vertex_count(), subject.mt.info().vertices as usize);
        for u in (0..updates).rev() {
            assert_eq!(walk.toggle(u), Applied::Done);
            walk.assert_same();
        }
        assert_eq!(walk.mesh.hash(), start);
        walk.mesh.compact();
        walk.assert_same();
    }

    fn at_random<M: ApplyUpdates + Clone>(subject: &Subject, mt: M, steps: usize, mut random: Random) {
        let mut walk = Walk::new(subject, mt);
        let mut hashes = HashMap::from([(walk.set.clone(), walk.mesh.hash())]);
        for _ in 0..if walk.set.is_empty() { 0 } else { steps } {
            walk.toggle(random.below(walk.set.len()) as u32);
            if random.once_in(7) {
                walk.mesh.compact();
            }
            walk.assert_same();
            let hash = walk.mesh.hash();
            assert_eq!(*hashes.entry(walk.set.clone()).or_insert(hash), hash);
        }
        let different: HashSet<u64> = hashes.values().copied().collect();
        assert_eq!(different.len(), hashes.len(), "two sets have the same hash");
    }

    fn in_waves<M: ApplyUpdates + Clone>(subject: &Subject, mt: M, mut random: Random) {
        let mut walk = Walk { compare_every: 80, ..Walk::new(subject, mt) };
        walk.wander(4000, &mut random);
        walk.assert_hash_of_the_set();
    }

    proptest! {
        #![proptest_config(config(60, 1))]

        /// All updates in their order make the reference mesh, undone from the last one on the base mesh.
        #[test]
        fn straight_down_and_up_again(plan in plan(6, 2, 0..200)) {
            let subject = subject(plan);
            down_and_up(&subject, subject.mt.clone());
            down_and_up(&subject, subject.explicit.clone());
        }

        /// The hash depends on the set alone, and tells sets apart.
        #[test]
        fn small_meshes_at_random(plan in plan(6, 2, 0..14), steps in 0_usize..600, seed in any::<u64>()) {
            let subject = subject(plan);
            at_random(&subject, subject.mt.clone(), steps, Random(seed));
            at_random(&subject, subject.explicit.clone(), steps, Random(seed));
        }
    }

    proptest! {
        #![proptest_config(config(24, 2))]

        #[test]
        fn large_meshes_in_waves(plan in plan(6, 2, 100..1000), seed in any::<u64>()) {
            let subject = subject(plan);
            in_waves(&subject, subject.mt.clone(), Random(seed));
            in_waves(&subject, subject.explicit.clone(), Random(seed));
        }

        #[test]
        fn they_may_arrive_at_any_time(plan in plan(6, 2, 0..300), seed in any::<u64>()) {
            arrive(&subject(plan), 12, &mut Random(seed));
        }

        /// Spelled out and made compact again, an MT is what it was.
        #[test]
        fn the_explicit_mt_holds_the_same(plan in plan(5, 2, 0..300)) {
            let edge = subject(plan).mt;
            prop_assert_eq!(by_the_explicit(&edge), edge);
        }
    }

    #[test]
    fn every_consistent_set_of_tiny_mts() {
        let domains =
            [Domain::Cube(1), Domain::Cube(2), Domain::Ell(1), Domain::Ring, Domain::TwoComponents(1)];
        let mut dependent = 0;
        for seed in 0..24 {
            let plan = Plan {
                domain: domains[seed as usize % 5],
                seed: crate::support::random::seed(seed),
                fields: 1,
                updates: 9,
            };
            let subject = subject(plan);
            dependent += subject.ancestors.iter().filter(|above| !above.is_empty()).count();
            visit_all(&subject, subject.mt.clone(), 0, &mut Random(seed));
            visit_all(&subject, subject.explicit.clone(), 0, &mut Random(seed));
        }
        assert!(dependent > 50, "the tiny MTs have hardly any dependencies: {dependent}");
    }
}

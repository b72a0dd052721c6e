//! Promise: pages of updates come and go in any order that keeps what they depend on; the mesh is always that which a fresh
//! start with the pages that are here leads to, and memory follows them.

use crate::random_orders::{random_order, reordered};
use crate::subjects::{SUBJECTS, Subject, applied};
use crate::support::random::Random;
use std::collections::BTreeSet;
use tetralod::geom::Bounds;
use tetralod::mt::{
    ApplyUpdates, EdgeMt, EdgeUpdate, ErrorCode, MultiTessellation, PageError, UpdateError, UpdateId,
    UpdatePages, VertexId,
};
use tetralod::refine::{Budget, Criterion, Front, LodCriterion, Need, Request, TetData};

/// A subject in pages, with what each depends on.
struct Paged<'a> {
    subject: &'a Subject,
    bits: u32,
    /// For each page the pages that it depends on.
    above: Vec<BTreeSet<u32>>,
    mt: EdgeMt,
}

impl<'a> Paged<'a> {
    fn new(subject: &'a Subject, bits: u32) -> Self {
        let pages = (subject.mt.updates() as usize).div_ceil(1 << bits);
        let mut above = vec![BTreeSet::new(); pages];
        for u in 0..subject.mt.updates() {
            let page = u >> bits;
            let parents = subject.explicit.parents(UpdateId(u)).iter().map(|p| p >> bits);
            above[page as usize].extend(parents.filter(|p| *p != page));
        }
        let mt = EdgeMt::with_page_bits(subject.mt.info().clone(), subject.mt.base().clone(), bits);
        Self { subject, bits, above, mt }
    }

    fn splits(&self, page: u32) -> Vec<EdgeUpdate<'a>> {
        let updates = self.mt.page_updates(page);
        updates.map(|u| self.subject.mt.update(UpdateId(u))).collect()
    }

    fn has(&self, page: u32) -> bool {
        self.mt.has_page(page)
    }

    fn may_come(&self, page: u32) -> bool {
        !self.has(page) && self.above[page as usize].iter().all(|&p| self.has(p))
    }

    fn may_go(&self, page: u32) -> bool {
        self.has(page) && !(0..).zip(&self.above).any(|(p, above)| self.has(p) && above.contains(&page))
    }

    fn pages(&self) -> u32 {
        self.above.len() as u32
    }

    fn insert(&mut self, front: &mut Front, page: u32) {
        self.mt.insert_page(page, &self.splits(page)).expect("what it depends on is here");
        front.page_inserted(&self.mt, page);
    }

    /// Whether the page was let go.
    fn remove(&mut self, front: &mut Front, page: u32) -> bool {
        let gone = front.prepare_eviction(&self.mt, page);
        if gone {
            self.mt.remove_page(page).expect("nothing depends on it");
        }
        gone
    }
}

fn request(subject: &Subject, random: &mut Random) -> Request {
    let bounds = Bounds::of(&subject.input.positions);
    let info = subject.mt.info();
    let field = random.below(info.fields.len());
    let mut part = || random.below(1000) as f64 / 1000.0;
    let need = Need::within(0.3 * part() * part() * part());
    let [a, b] = [(); 2].map(|()| [0, 1, 2].map(|i| bounds.min[i] + part() * bounds.extent()[i]));
    let roi = Bounds { min: [0, 1, 2].map(|i| a[i].min(b[i])), max: [0, 1, 2].map(|i| a[i].max(b[i])) };
    let value = info.fields[field].min + part() * info.fields[field].range();
    match random.below(6) {
        0 => need.into(),
        1 => need.of_field(field).into(),
        2 => need.around(field, &[value]).into(),
        3 => Request::from(need).at_most(random.below(info.tetrahedra as usize) as u32),
        _ => need.inside(roi).into(),
    }
}

/// Whether a tetrahedron of the mesh that nothing here removes could violate the criterion, as far as anybody can tell.
fn is_missing(paged: &Paged<'_>, set: &[bool], criterion: &LodCriterion) -> bool {
    let explicit = &paged.subject.explicit;
    let errors = vec![ErrorCode::MAX; explicit.fields()];
    let live = explicit.extract(set).expect("a consistent set");
    let unknown = |t: &u32| paged.subject.remover(*t).is_none_or(|u| !paged.mt.has(u));
    paged.mt.present() < paged.mt.info().updates
        && live.into_iter().filter(unknown).any(|t| {
            let tet = explicit.tets()[t as usize].map(VertexId);
            let corners = tet.map(|v| explicit.position(v));
            let levels = |field: usize| tet.map(|v| explicit.levels(v)[field]);
            let update = UpdateId(explicit.updates());
            let error = ErrorCode::MAX;
            criterion
                .judge(&TetData { corners: &corners, levels: &levels, error, errors: &errors, update })
                .violates()
        })
}

fn check(paged: &Paged<'_>, front: &mut Front, request: &Request) {
    let mt = &paged.mt;
    let criterion = LodCriterion::new(mt.info(), request);
    let outcome = front.satisfy(mt, &criterion, request.budget).expect("a sound MT");
    let mut fresh = Front::new(mt).expect("a valid base mesh");
    let again = fresh.satisfy(mt, &criterion, request.budget).expect("a sound MT");
    let set = applied(front, &paged.subject.mt);
    assert_eq!(set, applied(&fresh, &paged.subject.mt), "{request:?}");
    assert_eq!(front.mesh().hash(), fresh.mesh().hash());
    let answer = |o: &tetralod::refine::Outcome| (o.done, o.error, o.excess, o.satisfied, o.missing);
    assert_eq!(answer(&outcome), answer(&again), "{request:?}");
    if request.budget.is_unlimited() {
        assert_eq!(set, paged.subject.closure_among(&criterion, |u| mt.has(u)), "{request:?}");
        assert_eq!(outcome.missing, is_missing(paged, &set, &criterion), "{request:?}");
        assert_eq!(outcome.satisfied, !outcome.missing);
    }
}

fn explore(subject: &Subject, bits: u32, random: &mut Random) {
    let mut paged = Paged::new(subject, bits);
    let mut front = Front::new(&paged.mt).expect("a valid base mesh");
    let mut now = Request::within(0.0);
    check(&paged, &mut front, &now);
    let (mut kept, mut gone) = (0, 0);
    for step in 0..120 {
        // More come than go at first, and the other way round later.
        let leaving = random.below(120) < step;
        for _ in 0..1 + random.below(4) {
            let may = |p: &u32| if leaving { paged.may_go(*p) } else { paged.may_come(*p) };
            let choice: Vec<u32> = (0..paged.pages()).filter(may).collect();
            let Some(&page) = choice.get(random.below(choice.len().max(1))) else { continue };
            if leaving {
                *(if paged.remove(&mut front, page) { &mut gone } else { &mut kept }) += 1;
            } else {
                paged.insert(&mut front, page);
            }
        }
        if random.below(3) == 0 {
            now = request(subject, random);
        }
        // Pages may come and go while the front is on its way.
        front.request(&paged.mt, std::sync::Arc::new(LodCriterion::new(paged.mt.info(), &now)), now.budget);
        let most = random.below(20) as u64;
        front.step(&paged.mt, &mut |done| done.refined + done.coarsened < most).expect("a sound MT");
        front.mesh().check().expect("a valid mesh");
        if random.below(3) > 0 {
            check(&paged, &mut front, &now);
        }
    }
    assert!(gone > 5 && kept > 5, "{gone} {kept}");
    // All the way up, and down again.
    while let Some(page) = (0..paged.pages()).find(|&p| paged.may_come(p)) {
        paged.insert(&mut front, page);
    }
    check(&paged, &mut front, &Request::within(0.0));
    assert_eq!(front.applied_count(), subject.mt.updates());
    let full = (paged.mt.bytes(), front.mesh().bytes());
    check(&paged, &mut front, &Request::within(f64::INFINITY));
    while let Some(page) = (0..paged.pages()).find(|&p| paged.may_go(p)) {
        assert!(paged.remove(&mut front, page), "nothing is applied");
    }
    check(&paged, &mut front, &Request::within(0.0));
    let empty = (paged.mt.bytes(), front.mesh().bytes());
    assert_eq!((paged.mt.present(), paged.mt.updates()), (0, 0));
    let start = EdgeMt::with_page_bits(paged.mt.info().clone(), paged.mt.base().clone(), bits);
    // Nothing is left of the pages.
    assert!(empty.0 == start.bytes() && empty.0 < full.0 && empty.1 < full.1, "{empty:?} of {full:?}");
    assert_eq!(paged.mt, start);
    assert_eq!(paged.bits, bits);
}

#[test]
fn pages_come_and_go_in_any_order() {
    let mut random = Random::new(9);
    for (i, subject) in SUBJECTS.iter().enumerate() {
        explore(subject, 2 + i as u32 % 3, &mut random);
    }
}

#[test]
fn pages_of_updates_in_another_order_come_and_go() {
    let mut random = Random::new(10);
    for subject in SUBJECTS.iter() {
        let order = random_order(&subject.explicit, |n| random.below(n));
        explore(&reordered(subject, &order), 3, &mut random);
    }
}

#[test]
fn a_paged_mt_is_the_one_that_was_pushed() {
    for subject in SUBJECTS.iter() {
        let mut paged = Paged::new(subject, 10);
        let mut front = Front::new(&paged.mt).expect("a valid base mesh");
        (0..paged.pages()).for_each(|page| paged.insert(&mut front, page));
        assert_eq!(paged.mt, subject.mt.in_pages(10).expect("a complete MT"));
    }
}

#[test]
fn what_cannot_come_or_go_changes_nothing() {
    let subject = &SUBJECTS[0];
    let mut paged = Paged::new(subject, 4);
    let empty = paged.mt.clone();
    let split_elsewhere = |page: &u32| {
        let by_vertex = |split: &EdgeUpdate<'_>| subject.mt.created_by(split.vertex).map(|u| u.0 >> 4);
        paged.splits(*page).iter().filter_map(by_vertex).any(|other| other != *page)
    };
    let page = (0..paged.pages()).find(split_elsewhere).expect("not all splits are of base vertices");
    let last = paged.pages();
    let splits = paged.splits(page);
    assert!(
        matches!(paged.mt.insert_page(page, &splits), Err(PageError::Needs { page: p, .. }) if p == page)
    );
    assert_eq!(paged.mt.insert_page(last, &splits), Err(PageError::Beyond { page: last }));
    assert_eq!(paged.mt.insert_page(0, &splits[1..]), Err(PageError::Length { page: 0, expected: 16 }));
    assert_eq!(paged.mt.remove_page(0), Err(PageError::Absent { page: 0 }));
    // A vertex that two updates split, or that comes later.
    let mut twice = paged.splits(0);
    twice[9].vertex = twice[3].vertex;
    let vertex = twice[9].vertex.0;
    assert_eq!(paged.mt.insert_page(0, &twice), Err(UpdateError::Vertex { update: 9, vertex }.into()));
    twice[9].vertex = paged.mt.created(UpdateId(9))[0];
    let vertex = twice[9].vertex.0;
    assert_eq!(paged.mt.insert_page(0, &twice), Err(UpdateError::Vertex { update: 9, vertex }.into()));
    let mut off = paged.splits(0);
    off[15].offset_residual = [i32::MIN; 3];
    assert_eq!(paged.mt.insert_page(0, &off), Err(UpdateError::OffLattice { update: 15 }.into()));
    assert_eq!(paged.mt, empty);

    let mut front = Front::new(&paged.mt).expect("a valid base mesh");
    while !paged.has(page) {
        let next = (0..paged.pages()).find(|&p| paged.may_come(p)).expect("all can come");
        paged.insert(&mut front, next);
    }
    let before = paged.mt.clone();
    assert_eq!(paged.mt.insert_page(page, &splits), Err(PageError::Present { page }));
    let needed =
        (0..page).find(|&p| matches!(paged.mt.clone().remove_page(p), Err(PageError::Needed { .. })));
    assert!(needed.is_some());
    assert_eq!(paged.mt, before);
    let all = LodCriterion::new(paged.mt.info(), &Request::within(0.0));
    front.satisfy(&paged.mt, &all, Budget::default()).expect("a sound MT");
    assert!((0..=page).filter(|&p| paged.has(p)).all(|p| !front.prepare_eviction(&paged.mt, p)));
    let mut mesh = front.mesh().clone();
    let absent = UpdateId(16 * (last - 1));
    assert!(!paged.mt.has(absent));
    assert_eq!(paged.mt.refine(&mut mesh, absent), Err(UpdateError::Missing { update: absent.0 }));
    assert_eq!(paged.mt.coarsen(&mut mesh, absent), Err(UpdateError::Missing { update: absent.0 }));
    assert_eq!((paged.mt.error(absent), paged.mt.errors(absent)), (ErrorCode::ZERO, &[][..]));
}

//! Promise: pages of a half-edge MT come and go in any order, without those that they depend on. The mesh of a request is
//! the least consistent set that satisfies it among the updates that are here with all that they depend on, whatever was
//! here and asked for before; and the front names the pages that it lacks.

use crate::support::conformance::{Input, PAGED, Subject, inputs};
use crate::support::meshes::{blocks, hilly};
use crate::support::random::Random;
use std::collections::BTreeSet;
use std::sync::Arc;
use tetralod::geom::Bounds;
use tetralod::mt::{
    ApplyUpdates, ForestChild, HalfEdgeMt, HalfEdgeUpdate, Mt, MultiTessellation, PageError, UpdateId,
    UpdatePages, VertexId,
};
use tetralod::refine::{Budget, Criterion, Front, LodCriterion, Need, Part, Request, TetData, Values};

struct Paged {
    subject: Subject,
    whole: HalfEdgeMt,
    mt: HalfEdgeMt,
}

impl Paged {
    fn new(subject: Subject, bits: u32) -> Self {
        let Mt::HalfEdge(whole) = &subject.mt else { panic!("another kind") };
        let whole = whole.in_pages(bits).expect("a whole MT");
        let base = whole.base().clone();
        let children: Vec<Vec<ForestChild>> =
            (0..base.positions.len() as u32).map(|v| whole.children_of(VertexId(v)).to_vec()).collect();
        let marks = whole.base_marks().to_vec();
        let mt = HalfEdgeMt::new(whole.info().clone(), base, marks, &children, bits).expect("a base mesh");
        Self { subject, whole, mt }
    }

    fn pages(&self) -> u32 {
        self.whole.info().updates.div_ceil(1 << self.whole.page_bits())
    }

    fn records(&self, page: u32) -> Vec<HalfEdgeUpdate<'_>> {
        let updates = self.whole.page_updates(page);
        updates.map(|u| self.whole.update(UpdateId(u)).expect("a whole MT")).collect()
    }

    fn insert(&mut self, front: &mut Front, page: u32) {
        let updates = self.whole.page_updates(page);
        let records: Vec<_> = updates.map(|u| self.whole.update(UpdateId(u)).expect("a whole MT")).collect();
        self.mt.insert_page(page, &records).expect("it is not here");
        front.page_inserted(&self.mt, page);
    }

    /// The updates that are here with all that they depend on.
    fn available(&self) -> Vec<bool> {
        let here = |u: u32| self.mt.has(UpdateId(u));
        let all = 0..self.whole.info().updates;
        all.map(|u| here(u) && self.subject.ancestors[u as usize].iter().all(|&p| here(p))).collect()
    }

    /// The updates that remove a tetrahedron which violates the criterion, among those with a bit.
    fn asked(&self, criterion: &LodCriterion, among: &[bool]) -> Vec<u32> {
        let explicit = &self.subject.explicit;
        let asks = |u: u32| {
            let update = UpdateId(u);
            let (error, errors) = (explicit.error(update), explicit.errors(update));
            explicit.removed(update).iter().any(|&t| {
                let tet = explicit.tets()[t as usize].map(VertexId);
                let corners = tet.map(|v| explicit.position(v));
                let levels = |field: usize| tet.map(|v| explicit.levels(v)[field]);
                let look = TetData { corners: &corners, levels: &levels, error, errors, update, region: 0 };
                criterion.judge(&look).violates()
            })
        };
        (0..explicit.updates()).filter(|&u| among[u as usize] && asks(u)).collect()
    }

    fn check(&self, front: &mut Front, request: &Request) {
        let criterion = LodCriterion::new(self.mt.info(), request);
        let outcome = front.satisfy(&self.mt, &criterion, Budget::default()).expect("a sound MT");
        let wanted = self.subject.closure(self.asked(&criterion, &self.available()));
        let found: Vec<bool> = (0..self.whole.info().updates).map(|u| front.contains(UpdateId(u))).collect();
        assert_eq!(found, wanted, "{request:?}");
        front.mesh().check().expect("a valid mesh");
        let held: u64 = (0..self.pages())
            .filter(|&page| self.mt.has_page(page))
            .map(|page| self.mt.bytes_of_page(page))
            .sum();
        assert_eq!(held, self.mt.page_bytes());
        let lacks = self.asked(&criterion, &vec![true; found.len()]).iter().any(|&u| !found[u as usize]);
        assert!(outcome.missing || !lacks, "{request:?}");
        // What is demanded is not here, and what is lacking is found by what is demanded again and again.
        if self.mt.info().fields.len() == 1 {
            let bits = self.mt.page_bits();
            let demanded = front.demanded_pages(&self.mt, &criterion, |u| u.0 >> bits);
            assert!(demanded.iter().all(|&(page, _)| !self.mt.has_page(page)));
            assert!(!lacks || !demanded.is_empty(), "{request:?}");
        }
    }
}

fn request(subject: &Subject, random: &mut Random) -> Request {
    let bounds = Bounds::of(&subject.input.mesh.positions);
    let info = subject.mt.info();
    let field = random.below(info.fields.len());
    let mut part = || random.below(1000) as f64 / 1000.0;
    let need = Need::within(0.3 * part() * part() * part());
    let [a, b] = [(); 2].map(|()| [0, 1, 2].map(|i| bounds.min[i] + part() * bounds.extent()[i]));
    let roi = Bounds { min: [0, 1, 2].map(|i| a[i].min(b[i])), max: [0, 1, 2].map(|i| a[i].max(b[i])) };
    let value = info.fields[field].min + part() * info.fields[field].range();
    match random.below(5) {
        0 => need.into(),
        1 => need.of_field(field).into(),
        2 => need.around(field, &[value]).into(),
        _ => need.inside(roi).into(),
    }
}

fn explore(mut paged: Paged, random: &mut Random) {
    let mut front = Front::new(&paged.mt).expect("a valid base mesh");
    let mut now = Request::within(0.0);
    paged.check(&mut front, &now);
    for step in 0..80 {
        // More come than go at first, and the other way round later.
        let leaving = random.below(80) < step;
        for _ in 0..1 + random.below(3) {
            let choice: Vec<u32> = (0..paged.pages()).filter(|&p| paged.mt.has_page(p) == leaving).collect();
            let Some(&page) = choice.get(random.below(choice.len().max(1))) else { continue };
            if !leaving {
                paged.insert(&mut front, page);
            } else if front.prepare_eviction(&paged.mt, page) {
                paged.mt.remove_page(page).expect("it is here");
            }
        }
        if random.below(3) == 0 {
            now = request(&paged.subject, random);
        }
        // Pages may come and go while the front is on its way.
        front.request(&paged.mt, Arc::new(LodCriterion::new(paged.mt.info(), &now)), now.budget);
        let most = random.below(20) as u64;
        front.step(&paged.mt, &mut |done| done.refined + done.coarsened < most).expect("a sound MT");
        front.mesh().check().expect("a valid mesh");
        if random.below(3) > 0 {
            paged.check(&mut front, &now);
        }
    }
}

#[test]
fn pages_come_and_go_in_any_order() {
    let mut random = Random::new(17);
    for (i, input) in inputs().into_iter().enumerate() {
        let subject = Subject::new(PAGED, input).expect("decimation takes every mesh");
        explore(Paged::new(subject, 2 + i as u32 % 3), &mut random);
    }
}

/// What the front demands is fetched again and again: that ends at the mesh of the whole MT, with no page that nothing of the
/// request is in.
#[test]
fn demanded_pages_are_enough_and_all_in_use() {
    let mut random = Random::new(18);
    for input in inputs() {
        let subject = Subject::new(PAGED, input).expect("decimation takes every mesh");
        let mut paged = Paged::new(subject, 2);
        let bits = paged.mt.page_bits();
        // What an index tells of errors.
        let fields = paged.mt.info().fields.len();
        let bounds = (0..paged.pages()).flat_map(|page| {
            let updates = paged.whole.page_updates(page);
            let whole = &paged.whole;
            (0..fields)
                .map(move |f| updates.clone().map(|u| whole.errors(UpdateId(u))[f]).max().expect("an update"))
        });
        let bounds = bounds.collect();
        paged.mt.set_page_bounds(0, bounds);
        for _ in 0..6 {
            let request = request(&paged.subject, &mut random);
            let criterion = LodCriterion::new(paged.mt.info(), &request);
            let mut front = Front::new(&paged.mt).expect("a valid base mesh");
            if criterion.uniform().is_some() {
                continue;
            }
            loop {
                front.satisfy(&paged.mt, &criterion, Budget::default()).expect("a sound MT");
                let demanded = front.demanded_pages(&paged.mt, &criterion, |u| u.0 >> bits);
                if demanded.is_empty() {
                    break;
                }
                demanded.into_iter().for_each(|(page, _)| paged.insert(&mut front, page));
            }
            let all = vec![true; paged.whole.info().updates as usize];
            let wanted = paged.subject.closure(paged.asked(&criterion, &all));
            let found: Vec<bool> = (0..wanted.len() as u32).map(|u| front.contains(UpdateId(u))).collect();
            assert_eq!(found, wanted, "{request:?}");
            let in_use: BTreeSet<u32> =
                (0..wanted.len() as u32).filter(|&u| wanted[u as usize]).map(|u| u >> bits).collect();
            let here: BTreeSet<u32> = (0..paged.pages()).filter(|&page| paged.mt.has_page(page)).collect();
            assert!(in_use.is_subset(&here));
            front
                .satisfy(
                    &paged.mt,
                    &LodCriterion::new(paged.mt.info(), &Request::within(f64::INFINITY)),
                    Budget::default(),
                )
                .expect("a sound MT");
            for page in here {
                assert!(front.prepare_eviction(&paged.mt, page), "nothing is applied");
                paged.mt.remove_page(page).expect("it is here");
            }
        }
    }
}

#[test]
fn what_cannot_come_or_go_changes_nothing() {
    let input = inputs().remove(0);
    let mut paged = Paged::new(Subject::new(PAGED, input).expect("a cube"), 3);
    let empty = paged.mt.clone();
    let last = paged.pages();
    let records: Vec<HalfEdgeUpdate<'_>> = paged.records(1);
    let whole = paged.whole.clone();
    let records_of = |page: u32| -> Vec<HalfEdgeUpdate<'_>> {
        whole.page_updates(page).map(|u| whole.update(UpdateId(u)).expect("a whole MT")).collect()
    };
    assert_eq!(records, records_of(1));
    let records = records_of(1);
    assert_eq!(paged.mt.insert_page(last, &records), Err(PageError::Beyond { page: last }));
    let expected = records.len() as u32;
    assert_eq!(paged.mt.insert_page(1, &records[1..]), Err(PageError::Length { page: 1, expected }));
    assert_eq!(paged.mt.remove_page(1), Err(PageError::Absent { page: 1 }));
    let early = [ForestChild { update: 0, offset: [0; 3] }];
    let mut wrong = records.clone();
    wrong[2].children = &early;
    assert!(
        matches!(paged.mt.insert_page(1, &wrong), Err(PageError::Update(_))),
        "a child before its parent"
    );
    let far = [ForestChild { update: whole.info().updates - 1, offset: [i32::MIN; 3] }];
    wrong[2].children = &far;
    assert!(matches!(paged.mt.insert_page(1, &wrong), Err(PageError::Update(_))), "off the lattice");
    assert_eq!(paged.mt, empty);
    paged.mt.insert_page(1, &records).expect("a page");
    assert_eq!(paged.mt.insert_page(1, &records), Err(PageError::Present { page: 1 }));
    let mut mesh = paged.mt.start().expect("a base mesh");
    let absent = UpdateId(0);
    let refused = paged.mt.refine(&mut mesh, absent);
    assert!(matches!(refused, Err(tetralod::mt::UpdateError::Missing { update: 0 })), "{refused:?}");
    paged.mt.remove_page(1).expect("it is here");
    assert_eq!(paged.mt, empty);
}

/// Steps fill the holes of the mesh, also while updates are waiting that were asked for before.
#[test]
fn small_steps_end_where_a_large_one_does() {
    let mut random = Random::new(19);
    // Holes in it keep the base mesh large.
    let porous = |c: [u32; 3]| c.iter().any(|x| x % 2 == 0);
    let mesh = blocks([9, 9, 5], &[hilly], porous);
    let large = Input { name: "a porous block", mesh, position_bits: None, flat: true, convex: false };
    for input in inputs().into_iter().chain([large]) {
        let subject = Subject::new(PAGED, input).expect("decimation takes every mesh");
        let mt = &subject.mt;
        let mut front = Front::new(mt).expect("a valid base mesh");
        for _ in 0..60 {
            let mut request = request(&subject, &mut random);
            if let (Part::Region(region), 0) = (&request.needs[0].part, random.below(4)) {
                // A region and values together are answered from the base mesh.
                let field = random.below(mt.info().fields.len());
                let info = &mt.info().fields[field];
                let value = info.min + random.below(1000) as f64 / 1000.0 * info.range();
                let values = Values { field, ranges: vec![[value, info.max]] };
                request.needs[0].part = Part::Both(region.clone(), values);
            }
            let criterion = Arc::new(LodCriterion::new(mt.info(), &request));
            let tets = mt.info().tetrahedra as u32;
            // Room for all, for all but little, or for a part.
            let budget = match random.below(6) {
                0 => Budget::default(),
                1..5 => Budget { tets: Some(2 * tets), ..Budget::default() },
                _ => Budget { tets: Some(random.below(tets as usize) as u32), ..Budget::default() },
            };
            front.request(mt, criterion.clone(), budget);
            let most = 1 + random.below(12) as u64;
            // Some are given up on the way.
            let mut left = if random.below(3) == 0 { random.below(8) } else { usize::MAX };
            while left > 0 {
                let outcome = front.step(mt, &mut |done| done.refined + done.coarsened < most);
                front.mesh().check().expect("a valid mesh");
                if outcome.expect("a sound MT").done {
                    break;
                }
                left -= 1;
            }
            if left > 0 {
                let mut alone = Front::new(mt).expect("a valid base mesh");
                alone.satisfy(mt, &*criterion, budget).expect("a sound MT");
                assert_eq!(front.mesh().hash(), alone.mesh().hash(), "{request:?} {budget:?}");
            }
        }
    }
}

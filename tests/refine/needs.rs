//! Promise: every kind of need, alone and in unions, asked for at once or in steps, from nothing or from a mesh for a similar
//! request, within a budget or without, is answered with the smallest consistent set that satisfies it.

use crate::subjects::{SUBJECTS, Subject, applied};
use crate::support::strategies::config;
use proptest::prelude::*;
use std::sync::Arc;
use tetralod::geom::{Bounds, Camera};
use tetralod::mt::{ErrorCode, MultiTessellation, UpdateId};
use tetralod::refine::{
    ANY, Budget, Criterion, Custom, Front, LodCriterion, Need, Region, Request, TetData, Transfer, Verdict,
    View,
};

/// A need by numbers from 0 to 1, so that it can be moved a little.
#[derive(Clone, Debug)]
struct Wish {
    kind: usize,
    error: f64,
    numbers: [f64; 10],
}

impl Wish {
    /// All numbers moved by up to `step`.
    fn moved(&self, by: &[f64], step: f64) -> Self {
        let mut wish = self.clone();
        wish.numbers.iter_mut().zip(by).for_each(|(x, d)| *x += step * (2.0 * d - 1.0));
        if by[0] < 0.3 {
            wish.error *= 1.0 + step * by[1];
        }
        wish
    }

    fn need(&self, subject: &Subject) -> Need {
        let bounds = Bounds::of(&subject.input.positions);
        let info = subject.mt.info();
        let n = self.numbers;
        let place = |x: f64, axis: usize| bounds.min[axis] + (1.4 * x - 0.2) * bounds.extent()[axis];
        let point = |i: usize| [place(n[i], 0), place(n[i + 1], 1), place(n[i + 2], 2)];
        let vector = |i: usize| [n[i] - 0.52, n[i + 1] - 0.47, n[i + 2] - 0.51];
        let size = bounds.diagonal();
        let need = Need::within(self.error);
        let along = |normal: [f64; 3], p: [f64; 3]| (0..3).map(|i| normal[i] * p[i]).sum();
        match self.kind {
            0 => need,
            1 => {
                let (a, b) = (point(0), point(3));
                let min = [0, 1, 2].map(|i| f64::min(a[i], b[i]));
                need.inside(Bounds { min, max: [0, 1, 2].map(|i| f64::max(a[i], b[i])) })
            }
            2 => {
                let u = glam::DVec3::from(vector(3));
                let v = u.any_orthonormal_vector();
                let w = u.normalize().cross(v);
                let halves = [
                    u * size * 0.3,
                    v * size * (0.02 + 0.2 * n[6].abs()),
                    w * size * (0.05 + 0.3 * n[7].abs()),
                ];
                need.inside(Region::OrientedBox { centre: point(0), halves: halves.map(Into::into) })
            }
            3 => need.inside(Region::Sphere { centre: point(0), radius: 0.4 * size * n[3].abs() }),
            4 => need.inside(Region::HalfSpace { normal: vector(3), offset: along(vector(3), point(0)) }),
            5 => {
                let offset = along(vector(3), point(0));
                need.inside(Region::Slab {
                    normal: vector(3),
                    offset,
                    thickness: (0.2 * size * n[6]).max(0.0),
                })
            }
            6 => {
                let plane = |i: usize, s: f64| {
                    let normal = vector(i).map(|x| s * x);
                    [normal[0], normal[1], normal[2], along(normal, point(0)) + 0.1 * size]
                };
                need.inside(Region::Convex(vec![plane(3, 1.0), plane(4, -1.0), plane(5, 0.7), plane(6, 1.3)]))
            }
            7 => {
                let field = &info.fields[0];
                need.around(0, &[field.min + n[0] * field.range(), field.min + n[1] * field.range()])
            }
            8 => {
                let f = info.fields.len() - 1;
                let field = &info.fields[f];
                let low = field.min + n[0] * field.range();
                need.between(f, vec![[low, low + 0.3 * n[1].abs() * field.range()]])
            }
            9 => {
                let mut camera = Camera::home(&bounds, 1.5);
                camera.orbit(6.0 * n[0], n[1]);
                camera.zoom(0.05 + n[2].abs());
                camera.pan(n[3] - 0.5, n[4] - 0.5);
                let matrix = camera.view_projection(1.5).to_cols_array().map(f64::from);
                Need::seen(View { matrix, viewport: [600.0, 400.0] }, 400.0 * self.error)
            }
            10 => {
                // Parallel: a rotation scaled to the size of the model.
                let rotation = glam::DMat4::from_euler(glam::EulerRot::XYZ, 6.0 * n[0], n[1], n[2]);
                let centre = glam::DVec3::from(point(3));
                let scaled = glam::DMat4::from_scale(glam::DVec3::splat(3.0 / size));
                let matrix = (scaled * rotation * glam::DMat4::from_translation(-centre)).to_cols_array();
                Need::seen(View { matrix, viewport: [500.0, 500.0] }, 400.0 * self.error)
            }
            _ => {
                let field = &info.fields[0];
                let at = |x: f64| field.min + x * field.range();
                let colour = [n[1], n[2], n[3], n[4]].map(|x: f64| x.clamp(0.0, 1.0));
                let clear = [0.2, 0.4, 0.6, 0.0];
                let middle = 0.1 + 0.8 * n[0].clamp(0.0, 1.0);
                let points =
                    vec![(at(middle - 0.1), clear), (at(middle), colour), (at(middle + 0.05), clear)];
                Need::shown(Transfer { field: 0, points, unit_length: 1.0 }, self.error)
            }
        }
    }
}

const KINDS: usize = 12;

fn wish() -> impl Strategy<Value = Wish> {
    let error = prop_oneof![Just(0.0), Just(0.002), 0.0..0.1, 0.0..0.6];
    let numbers = prop::array::uniform10(0.0..1.0);
    (0..KINDS, error, numbers).prop_map(|(kind, error, numbers)| Wish { kind, error, numbers })
}

fn request(subject: &Subject, wishes: &[Wish]) -> Request {
    Request { needs: wishes.iter().map(|wish| wish.need(subject)).collect(), budget: Budget::default() }
}

/// Excesses of all tetrahedra that `front` has.
fn largest_excess(subject: &Subject, front: &Front, criterion: &LodCriterion) -> f64 {
    front.largest_violation(&subject.mt, criterion).1
}

proptest! {
    #![proptest_config(config(250, 4))]

    /// A walk of requests that jump or move a little, each answered in random steps.
    #[test]
    fn unions_of_needs_are_answered_with_the_closure_from_anywhere(
        subject in 0_usize..4,
        first in prop::collection::vec(wish(), 1..4),
        moves in prop::collection::vec((prop::collection::vec(0.0..1.0_f64, 12), 0..4_usize, 1..40_u64), 1..9),
    ) {
        let subject = &SUBJECTS[subject];
        let mut front = subject.fresh();
        let mut wishes = first;
        for (by, how, updates) in moves {
            let step = [0.0, 0.003, 0.03, 0.5][how];
            wishes.iter_mut().for_each(|wish| *wish = wish.moved(&by, step));
            let request = request(subject, &wishes);
            prop_assert_eq!(request.check(subject.mt.info()), Ok(()));
            let criterion = LodCriterion::new(subject.mt.info(), &request);
            front.request(&subject.mt, Arc::new(criterion.clone()), request.budget);
            let outcome = loop {
                let mut left = updates;
                let mut go_on = |_: &_| { left -= 1; left > 0 };
                let outcome = front.step(&subject.mt, &mut go_on).expect("a valid MT");
                prop_assert_eq!(front.mesh().check(), Ok(()));
                prop_assert_eq!(front.mesh().tet_slots(), front.mesh().tet_count(), "packed");
                if outcome.done {
                    break outcome;
                }
            };
            prop_assert!(outcome.satisfied && outcome.excess <= 1.0);
            let wanted = subject.closure(&criterion);
            prop_assert_eq!(&applied(&front, &subject.mt), &wanted, "{:?}", request);
            let mut alone = subject.fresh();
            subject.satisfy(&mut alone, &request);
            prop_assert_eq!(alone.mesh().hash(), front.mesh().hash());
            // Asking again changes nothing.
            let again = subject.satisfy(&mut front, &request);
            prop_assert_eq!((again.refined, again.coarsened, again.done), (0, 0, true));
        }
    }

    /// Budgets of any sort: kept after every step, the best that fits, the same from anywhere, never worse when larger.
    #[test]
    fn budgets_are_kept_and_used_well(
        subject in 0_usize..4,
        first in prop::collection::vec(wish(), 1..3),
        moves in prop::collection::vec((prop::collection::vec(0.0..1.0_f64, 12), 0.0..1.2_f64, 0..3_usize, 1..30_u64), 1..5),
    ) {
        let subject = &SUBJECTS[subject];
        let mut front = subject.fresh();
        let [base_vertices, base_tets] = [subject.mt.base().positions.len(), subject.mt.base().tets.len()];
        let mut wishes = first;
        for (by, part, sort, updates) in moves {
            wishes.iter_mut().for_each(|wish| *wish = wish.moved(&by, 0.1));
            let info = subject.mt.info();
            let of = |all: u64| (part * all as f64) as u32;
            let budget = match sort {
                0 => Budget { tets: Some(of(info.tetrahedra)), ..Budget::default() },
                1 => Budget { vertices: Some(of(info.vertices.into())), ..Budget::default() },
                _ => Budget { bytes: Some(u64::from(of(info.tetrahedra)) * 40), ..Budget::default() },
            };
            let request = Request { budget, ..request(subject, &wishes) };
            let criterion = LodCriterion::new(info, &request);
            front.request(&subject.mt, Arc::new(criterion.clone()), budget);
            let outcome = loop {
                let mut left = updates;
                let outcome = front.step(&subject.mt, &mut |_| { left -= 1; left > 0 }).expect("a valid MT");
                let mesh = front.mesh();
                let fits = budget.holds(mesh.vertex_count(), mesh.tet_count());
                prop_assert!(fits || (mesh.vertex_count(), mesh.tet_count()) == (base_vertices, base_tets));
                prop_assert_eq!(mesh.check(), Ok(()));
                if outcome.done {
                    break outcome;
                }
            };
            let largest = largest_excess(subject, &front, &criterion);
            prop_assert!((largest <= 1.0) == outcome.satisfied && largest <= outcome.excess, "{} {:?}", largest, outcome);
            let mut alone = subject.fresh();
            subject.satisfy(&mut alone, &request);
            prop_assert_eq!(applied(&alone, &subject.mt), applied(&front, &subject.mt), "{:?}", request);
            let again = subject.satisfy(&mut front, &request);
            prop_assert_eq!((again.refined, again.coarsened, again.excess), (0, 0, outcome.excess));
            // A little more room is never worse.
            let more = Budget {
                tets: budget.tets.map(|b| b + 20),
                vertices: budget.vertices.map(|b| b + 4),
                bytes: budget.bytes.map(|b| b + 800),
            };
            let better = subject.satisfy(&mut alone, &Request { budget: more, ..request });
            prop_assert!(better.excess <= outcome.excess);
            // The best there is: whatever has a smaller excess does not fit. Those are the sets that hold all that exceeds less.
            if !outcome.satisfied {
                let best = LodScaled { criterion, by: outcome.excess };
                let set = subject.closure(&best);
                let live = subject.explicit.extract(&set).expect("a consistent set").len();
                let vertices = base_vertices + set.iter().filter(|&&s| s).count();
                prop_assert!(!budget.holds(vertices, live), "{} tetrahedra would do for an excess below {}", live, outcome.excess);
            }
        }
    }
}

/// A criterion whose violations are those of another one that exceed at least so much.
#[derive(Clone, Debug)]
struct LodScaled {
    criterion: LodCriterion,
    by: f64,
}

impl Criterion for LodScaled {
    fn judge(&self, tet: &TetData<'_>) -> Verdict {
        let verdict = self.criterion.rank(tet);
        Verdict { excess: if verdict.excess >= self.by { 2.0 } else { 0.0 }, slack: 0.0, component: ANY }
    }
}

/// Some tetrahedron of the lattice.
fn tetrahedron(subject: &Subject, numbers: &[f64]) -> [[i32; 3]; 4] {
    let largest = f64::from(1_u32 << subject.mt.info().lattice.bits);
    let centre = [numbers[0], numbers[1], numbers[2]];
    let size = numbers[3] * numbers[3];
    [0, 1, 2, 3].map(|c| {
        [0, 1, 2].map(|i| {
            let x = centre[i] + size * (numbers[4 + 3 * c + i] - 0.5);
            (x.clamp(0.0, 1.0) * largest) as i32
        })
    })
}

proptest! {
    #![proptest_config(config(6000, 4))]

    /// As long as the criterion has moved by less than a verdict's slack, the verdict stands.
    #[test]
    fn slack_is_never_too_large(
        subject in 0_usize..4,
        wishes in prop::collection::vec(wish(), 1..3),
        by in prop::collection::vec(0.0..1.0_f64, 12),
        how in 0..5_usize,
        numbers in prop::collection::vec(0.0..1.0_f64, 16),
        levels in prop::array::uniform4(0.0..1.0_f64),
        error in 0.0..0.3_f64,
    ) {
        let subject = &SUBJECTS[subject];
        let info = subject.mt.info();
        let criterion = |wishes: &[Wish]| LodCriterion::new(info, &request(subject, wishes));
        let before = criterion(&wishes);
        let step = [0.0003, 0.003, 0.01, 0.05, 0.2][how];
        let moved: Vec<Wish> = wishes.iter().map(|wish| wish.moved(&by, step)).collect();
        let after = criterion(&moved);
        let corners = tetrahedron(subject, &numbers);
        let level = |f: usize| levels.map(|x| (x * f64::from((1 << info.fields[f].bits) - 1)) as i32);
        let error = ErrorCode::at_least(error * error);
        let errors = &[error; 3];
        let look = TetData { corners: &corners, levels: &level, error, errors, update: UpdateId(3), region: 0 };
        let [old, new] = [&before, &after].map(|criterion| criterion.judge(&look));
        let distance = after.component_distance(&before, old.component);
        prop_assert!(distance <= after.distance(&before));
        prop_assert!(old.violates() == new.violates() || old.slack <= distance, "{:?} {:?} {}", old, new, distance);
        prop_assert_eq!(old.violates(), before.rank(&look).violates());
        prop_assert_eq!(before.distance(&before), 0.0);
    }
}

#[test]
fn closures_join_other_needs_and_are_answered_whatever_they_say() {
    for (seed, subject) in SUBJECTS.iter().enumerate() {
        let mut front = subject.fresh();
        for round in 0..12_i32 {
            let modulus = 3 + (seed as i32 + round) % 5;
            // Not monotone at all: by remainders.
            let custom = Custom::new(move |tet| {
                let sum: i32 = tet.corners.iter().map(|corner| corner[0]).sum();
                if sum % modulus == 0 { tet.error.error() / 0.01 } else { 0.0 }
            });
            let request = Request::within(0.2);
            let criterion = LodCriterion::new(subject.mt.info(), &request).and(Arc::new(custom));
            let outcome = front.satisfy(&subject.mt, &criterion, Budget::default()).expect("a valid MT");
            assert!(outcome.satisfied);
            assert_eq!(applied(&front, &subject.mt), subject.closure(&criterion));
            // A monotone one moves from the mesh that is there.
            let limit = 1 << (subject.mt.info().lattice.bits - 1);
            let left = Custom::monotone(move |tet| {
                if tet.corners.iter().any(|c| c[0] <= limit + round * 500) {
                    tet.error.error() / 0.005
                } else {
                    0.0
                }
            });
            let criterion = LodCriterion::new(subject.mt.info(), &request).and(Arc::new(left));
            front.satisfy(&subject.mt, &criterion, Budget::default()).expect("a valid MT");
            assert_eq!(largest_excess(subject, &front, &criterion), 1.0);
        }
    }
}

#[test]
fn requests_without_sense_are_named() {
    let info = SUBJECTS[0].mt.info();
    let fine = View { matrix: glam::DMat4::IDENTITY.to_cols_array(), viewport: [10.0, 10.0] };
    let transfer = |points: Vec<(f64, [f64; 4])>| Transfer { field: 0, points, unit_length: 1.0 };
    let wrong = [
        Need::within(f64::NAN),
        Need::within(-1.0),
        Need::within(0.0).inside(Bounds { min: [1.0; 3], max: [0.0; 3] }),
        Need::within(0.0).inside(Region::Sphere { centre: [0.0; 3], radius: f64::NAN }),
        Need::within(0.0).inside(Region::HalfSpace { normal: [0.0; 3], offset: 1.0 }),
        Need::within(0.0).inside(Region::Slab { normal: [1.0; 3], offset: 1.0, thickness: -1.0 }),
        Need::within(0.0).inside(Region::OrientedBox { centre: [0.0; 3], halves: [[0.0; 3]; 3] }),
        Need::within(0.0).inside(Region::Convex(vec![[1.0, 0.0, 0.0, 1.0]; 17])),
        Need::within(0.0).between(0, vec![[2.0, 1.0]]),
        Need::within(0.0).around(9, &[0.0]),
        Need::seen(View { matrix: [0.0; 16], ..fine }, 1.0),
        Need::seen(View { matrix: [f64::NAN; 16], ..fine }, 1.0),
        Need::seen(View { viewport: [0.0, 10.0], ..fine }, 1.0),
        Need::shown(transfer(Vec::new()), 0.1),
        Need::shown(transfer(vec![(1.0, [0.0; 4]), (0.0, [0.0; 4])]), 0.1),
        Need::shown(transfer(vec![(1.0, [2.0; 4])]), 0.1),
        Need::shown(Transfer { unit_length: 0.0, ..transfer(vec![(1.0, [0.0; 4])]) }, 0.1),
    ];
    for need in wrong {
        let request = Request::within(0.1).and(need.clone());
        let error = request.check(info).expect_err("no sense");
        assert!(!error.to_string().is_empty(), "{need:?}");
    }
    assert_eq!(Request::from(Need::seen(fine, 1.0)).check(info), Ok(()));
    assert_eq!(
        Request::from(Need::within(0.0).inside(Bounds { min: [f64::NEG_INFINITY; 3], max: [0.5; 3] }))
            .check(info),
        Ok(())
    );
}

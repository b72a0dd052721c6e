//! MTs in which tetrahedra have errors of their own: these hold, and a request gives the least set of updates that it leads to
//! from the base mesh, whatever was asked for before.

use crate::support::meshes::{cube, hilly, linear};
use crate::support::random::Random;
use std::collections::BTreeSet;
use std::sync::{Arc, LazyLock};
use tetralod::format::{Decoder, EncodeOptions, encode};
use tetralod::geom::{Bounds, orient3d};
use tetralod::mesh::{Field, TetMesh};
use tetralod::mt::{
    ApplyUpdates, CurrentMesh, ErrorCode, ExplicitMt, Mt, MtKind, MultiTessellation, UpdateId, VertexId,
};
use tetralod::refine::{Criterion, Front, LodCriterion, Need, Region, Request, TetData};
use tetralod_build::verify;
use tetralod_build::verify::Reference;
use tetralod_build::{BuildConfig, BuildCriterion, BuildResult, Construction, Method, build};

fn config(mesh: &TetMesh, kind: MtKind, tet_errors: bool) -> BuildConfig {
    let plain = Construction::new(kind, Method::Insert, BuildCriterion::Delaunay).expect("they go together");
    BuildConfig {
        construction: if tet_errors { plain.with_tet_errors().expect("they go together") } else { plain },
        fields: mesh.fields.iter().map(|field| field.name.clone()).collect(),
        ..BuildConfig::of(MtKind::Edge)
    }
}

fn built(mesh: &TetMesh, kind: MtKind, tet_errors: bool) -> BuildResult {
    build(mesh, &config(mesh, kind, tet_errors)).expect("a sound mesh")
}

/// An input with its MT, spelled out as well.
struct Subject {
    name: &'static str,
    input: TetMesh,
    vertex: Mt,
    explicit: ExplicitMt,
    /// The MT's vertex for each point of the input.
    vertices: Vec<VertexId>,
}

impl Subject {
    fn new(name: &'static str, input: TetMesh) -> Self {
        let BuildResult { mt: vertex, vertices, .. } = built(&input, MtKind::Vertex, true);
        let explicit = ExplicitMt::of(&vertex).unwrap();
        Self { name, input, vertex, explicit, vertices }
    }

    /// The errors of tetrahedron `t`, which `u` removes: the largest and those by field.
    fn errors(&self, t: u32, u: UpdateId) -> (ErrorCode, Vec<ErrorCode>) {
        let (fall, own) = (self.explicit.own_fall(u), self.explicit.quarterings_of(t));
        let errors: Vec<ErrorCode> = self.lowered(u, fall, own);
        (errors.iter().copied().max().expect("a field"), errors)
    }

    /// The errors of `u` lowered, but no further than to what rounding can amount to.
    fn lowered(&self, u: UpdateId, fall: u8, quarterings: u8) -> Vec<ErrorCode> {
        let least = |f: usize| ErrorCode::at_least(2.0 * self.explicit.info().floor(f));
        let lowered = |(f, &error): (usize, &ErrorCode)| {
            let below = 64 * u16::from(fall) + 4096 * u16::from(quarterings);
            ErrorCode(error.0.saturating_sub(below).max(1)).max(least(f).min(error))
        };
        self.explicit.errors(u).iter().enumerate().map(lowered).collect()
    }

    fn violates(&self, criterion: &impl Criterion, t: u32) -> Option<u32> {
        let update = self.explicit.removed_by(t)?;
        let (error, errors) = self.errors(t, update);
        let tet = self.explicit.tets()[t as usize].map(VertexId);
        let corners = tet.map(|v| self.explicit.position(v));
        let levels = |field: usize| tet.map(|v| self.explicit.levels(v)[field]);
        let look = TetData { corners: &corners, levels: &levels, error, errors: &errors, update, region: 0 };
        criterion.judge(&look).violates().then_some(update.0)
    }

    /// The least set that holds the remover of every violating tetrahedron of the base mesh or of one of its updates, and the
    /// parents of all; of the first `here` updates. Nothing is ever taken out of it.
    fn closure(&self, criterion: &impl Criterion, here: u32) -> Vec<bool> {
        let mut set = vec![false; self.explicit.updates() as usize];
        let mut tets: Vec<u32> = self.explicit.base_tets().collect();
        while let Some(t) = tets.pop() {
            let mut todo: Vec<u32> = self.violates(criterion, t).filter(|&u| u < here).into_iter().collect();
            while let Some(u) = todo.pop() {
                if !std::mem::replace(&mut set[u as usize], true) {
                    tets.extend(self.explicit.inserted(UpdateId(u)));
                    todo.extend(self.explicit.parents(UpdateId(u)));
                }
            }
        }
        set
    }

    fn requests(&self) -> Vec<Request> {
        let bounds = Bounds::of(&self.input.positions);
        let extent = bounds.extent();
        let part = |low: f64, high: f64| {
            let at = |x: f64| [0, 1, 2].map(|k| bounds.min[k] + x * extent[k]);
            Bounds { min: at(low), max: at(high) }
        };
        let mut all = Vec::new();
        for error in [0.0, 0.002, 0.01, 0.03, 0.1, 0.3] {
            all.push(Need::within(error).into());
            all.push(Need::within(error).inside(part(0.1, 0.4)).into());
            all.push(Need::within(error).inside(part(0.6, 0.65)).into());
            for (f, field) in self.explicit.info().fields.iter().enumerate() {
                let value = field.min + 0.6 * field.range();
                all.push(Need::within(error).around(f, &[value]).into());
                all.push(Need::within(error).around(f, &[value]).inside(part(0.3, 0.8)).into());
            }
            let sphere = Region::Sphere { centre: part(0.5, 1.0).min, radius: 0.2 * extent[0] };
            all.push(Need::within(error).inside(sphere).into());
        }
        all
    }
}

/// Points that look random, two fields, and no tetrahedra.
fn scattered() -> TetMesh {
    let mut random = Random::new(11);
    let mut places = BTreeSet::new();
    while places.len() < 700 {
        places.insert([0; 3].map(|_| (random.bits() % 60) as u32));
    }
    let positions: Vec<[f64; 3]> = places.iter().map(|p| p.map(f64::from)).collect();
    let bumps = positions.iter().map(|p| p.iter().map(|x| (x * 0.15).sin()).sum()).collect();
    let ridge = positions.iter().map(|p| 1.0 / (1.0 + (p[0] - 0.7 * p[1]).powi(2))).collect();
    let fields = vec![Field::new("bumps", bumps), Field::new("ridge", ridge)];
    TetMesh { positions, fields, ..TetMesh::default() }
}

static SUBJECTS: LazyLock<Vec<Subject>> = LazyLock::new(|| {
    vec![
        Subject::new("bucky", tetralod_io::generate::bucky(13).expect("a size that is allowed")),
        Subject::new("hills", cube(8, &[hilly, linear])),
        Subject::new("scattered points", scattered()),
    ]
});

fn applied(front: &Front, updates: u32) -> Vec<bool> {
    (0..updates).map(|u| front.contains(UpdateId(u))).collect()
}

/// A mesh by its tetrahedra, each with its errors.
fn seen(mt: &impl ApplyUpdates, mesh: &CurrentMesh) -> BTreeSet<([u32; 4], Option<u32>, u8)> {
    let tets = (0..).zip(mesh.tets()).map(|(t, tet)| {
        let mut tet = tet.map(|slot| mesh.vertex(slot).0);
        tet.sort_unstable();
        (tet, mt.remover(mesh, t).map(|u| u.0), mt.quarterings(mesh, t))
    });
    tets.collect()
}

/// The largest error of a tetrahedron in each field at all points of the reference in it, found by going through all of them.
fn plain_errors(subject: &Subject, tet: [VertexId; 4]) -> Vec<f64> {
    let mt = &subject.explicit;
    let corners = tet.map(|v| mt.position(v));
    let mut largest = vec![0.0_f64; mt.fields()];
    for (point, &v) in subject.vertices.iter().enumerate() {
        let parts = [0, 1, 2, 3].map(|k| {
            let mut corners = corners;
            corners[k] = mt.position(v);
            let [a, b, c, d] = corners;
            orient3d(a, b, c, d)
        });
        if parts.iter().any(|&part| part < 0) {
            continue;
        }
        let whole = parts.iter().sum::<i128>() as f64;
        for (f, field) in mt.info().fields.iter().enumerate() {
            let level = |k: usize| f64::from(mt.levels(tet[k])[f]);
            let there: f64 = (0..4).map(|k| parts[k] as f64 / whole * level(k)).sum();
            let true_one = (subject.input.fields[f].values[point] - field.origin) / field.step;
            largest[f] = largest[f].max((there - true_one).abs() * field.step / field.range());
        }
    }
    largest
}

#[test]
fn own_errors_bound_every_tetrahedron() {
    for subject in SUBJECTS.iter() {
        let mt = &subject.explicit;
        let (mut smaller, mut all) = (0, 0);
        for t in 0..mt.tets().len() as u32 {
            let Some(u) = mt.removed_by(t) else { continue };
            let found = plain_errors(subject, mt.tets()[t as usize].map(VertexId));
            let (_, own) = subject.errors(t, u);
            for (found, own) in found.iter().zip(own) {
                assert!(*found <= own.error() * (1.0 + 1e-9) + 1e-12, "{}: {found} {own:?}", subject.name);
            }
            all += 1;
            smaller += u32::from(mt.quarterings_of(t) > 0);
        }
        assert!(8 * smaller > all, "{}: of {all} tetrahedra {smaller} have smaller errors", subject.name);
    }
}

/// No number could be larger: the next one does not bound the error, or there is none.
#[test]
fn own_errors_are_as_small_as_two_bits_tell() {
    for subject in SUBJECTS.iter() {
        let mt = &subject.explicit;
        for t in (0..mt.tets().len() as u32).filter(|t| t % 5 == 0) {
            let (Some(u), own) = (mt.removed_by(t), mt.quarterings_of(t)) else { continue };
            if own == tetralod::mt::MAX_QUARTERINGS {
                continue;
            }
            let found = plain_errors(subject, mt.tets()[t as usize].map(VertexId));
            let next = subject.lowered(u, mt.own_fall(u), own + 1);
            let fits =
                found.iter().zip(next).all(|(found, next)| found * (1.0 + 1e-9) + 1e-12 <= next.error());
            assert!(!fits, "{}: tetrahedron {t} has {own}, {found:?}", subject.name);
        }
    }
}

#[test]
fn a_request_gives_the_least_set_whatever_was_asked_for_before() {
    for subject in SUBJECTS.iter() {
        let requests = subject.requests();
        let info = subject.vertex.info();
        let updates = subject.explicit.updates();
        let mut vertex = Front::new(&subject.vertex).unwrap();
        let mut spelled = Front::new(&subject.explicit).unwrap();
        let mut random = Random::new(3);
        let mut sizes = BTreeSet::new();
        for step in 0..150 {
            let request = &requests[random.bits() as usize % requests.len()];
            let criterion = LodCriterion::new(info, request);
            let wanted = subject.closure(&criterion, updates);
            // At times in several steps, or broken off by another request.
            if step % 3 == 1 {
                vertex.request(&subject.vertex, Arc::new(criterion.clone()), request.budget);
                let most = random.bits() % 40;
                vertex.step(&subject.vertex, &mut |done| done.refined + done.coarsened < most).unwrap();
            }
            if step % 6 == 1 {
                continue;
            }
            let outcome = vertex.satisfy(&subject.vertex, &criterion, request.budget).unwrap();
            assert!(outcome.done && outcome.satisfied && outcome.excess <= 1.0);
            assert_eq!(applied(&vertex, updates), wanted, "{}, {request:?}", subject.name);
            spelled.satisfy(&subject.explicit, &criterion, request.budget).unwrap();
            assert_eq!(applied(&spelled, updates), wanted, "{}, {request:?}", subject.name);
            assert_eq!(seen(&subject.vertex, vertex.mesh()), seen(&subject.explicit, spelled.mesh()));
            vertex.mesh().check().unwrap();
            sizes.insert(vertex.mesh().tet_count());
        }
        assert!(sizes.len() > 20);
    }
}

#[test]
fn error_zero_is_the_reference_mesh() {
    for subject in SUBJECTS.iter() {
        let criterion = LodCriterion::new(subject.vertex.info(), &Request::within(0.0));
        let set = subject.closure(&criterion, subject.explicit.updates());
        assert!(set.iter().all(|&there| there));
    }
}

#[test]
fn budgets_leave_no_memory_of_what_was_before() {
    for subject in SUBJECTS.iter() {
        let mt = &subject.vertex;
        let all = mt.info().tetrahedra as u32;
        let requests: Vec<Request> = (subject.requests().into_iter().enumerate())
            .map(|(i, request)| request.at_most(all / (2 + i as u32 % 9)))
            .collect();
        let mut front = Front::new(mt).unwrap();
        for request in requests.iter().chain(requests.iter().rev()).step_by(3) {
            let criterion = LodCriterion::new(mt.info(), request);
            front.satisfy(mt, &criterion, request.budget).unwrap();
            let mut fresh = Front::new(mt).unwrap();
            fresh.satisfy(mt, &criterion, request.budget).unwrap();
            assert_eq!(seen(mt, front.mesh()), seen(mt, fresh.mesh()), "{}, {request:?}", subject.name);
            assert!(front.mesh().tet_count() <= request.budget.tets.unwrap_or(all) as usize);
        }
    }
}

/// Errors stay with their tetrahedra through any sequence of updates forwards and backwards.
#[test]
fn errors_come_back_with_the_tetrahedra() {
    for subject in SUBJECTS.iter() {
        let (mt, explicit) = (&subject.vertex, &subject.explicit);
        let mut meshes = (mt.start().unwrap(), explicit.start().unwrap());
        let updates = u64::from(mt.updates());
        let mut random = Random::new(5);
        let mut set = vec![false; updates as usize];
        for step in 0..6000 {
            // Coarse updates first, so that many can be applied.
            let u = UpdateId((random.bits() % updates.min(8 + step)) as u32);
            if explicit.is_feasible(&set, u) {
                let undo = set[u.0 as usize];
                set[u.0 as usize] = !undo;
                if undo {
                    mt.coarsen(&mut meshes.0, u).unwrap();
                    explicit.coarsen(&mut meshes.1, u).unwrap();
                } else {
                    mt.refine(&mut meshes.0, u).unwrap();
                    explicit.refine(&mut meshes.1, u).unwrap();
                }
            }
            if step % 500 == 0 {
                meshes.0.compact();
                meshes.1.compact();
                assert_eq!(seen(mt, &meshes.0), seen(explicit, &meshes.1));
            }
        }
    }
}

#[test]
fn all_kinds_hold_the_same_and_files_keep_it() {
    for subject in SUBJECTS.iter() {
        assert!(subject.vertex.has_tet_errors() && subject.explicit.has_tet_errors());
        assert!(subject.explicit.compact(MtKind::Vertex).unwrap() == subject.vertex);
        let mt = subject.vertex.in_pages(7).unwrap();
        let bytes = encode(&mt, &EncodeOptions::default()).unwrap();
        let mut decoder = Decoder::default();
        for piece in bytes.chunks(777) {
            decoder.feed(piece).unwrap();
        }
        decoder.finish().unwrap();
        assert!(decoder.mt() == Some(&mt));
    }
}

/// While a file arrives, the mesh is the least one of what is here.
#[test]
fn what_has_arrived_gives_the_least_set_of_its_own() {
    let subject = &SUBJECTS[0];
    let mt = subject.vertex.in_pages(6).unwrap();
    let bytes = encode(&mt, &EncodeOptions::default()).unwrap();
    let request = Request::within(0.01);
    let criterion = LodCriterion::new(mt.info(), &request);
    let mut decoder = Decoder::default();
    let mut front: Option<Front> = None;
    let mut stages = BTreeSet::new();
    for piece in bytes.chunks(400) {
        decoder.feed(piece).unwrap();
        let Some(part) = decoder.mt() else { continue };
        let front = front.get_or_insert_with(|| Front::new(part).unwrap());
        front.satisfy(part, &criterion, request.budget).unwrap();
        let wanted = subject.closure(&criterion, part.updates());
        assert_eq!(applied(front, mt.updates()), wanted);
        stages.insert(part.updates());
    }
    assert!(stages.len() > 10);
}

#[test]
fn files_without_them_are_as_they_were_and_take_more_tetrahedra() {
    let subject = &SUBJECTS[0];
    let plain = built(&subject.input, MtKind::Vertex, false).mt;
    assert!(!plain.has_tet_errors());
    let tets = |mt: &Mt, error: f64| {
        let mut front = Front::new(mt).unwrap();
        let request = Request::within(error);
        front.satisfy(mt, &LodCriterion::new(mt.info(), &request), request.budget).unwrap();
        front.mesh().tet_count()
    };
    let errors = [0.001, 0.01, 0.03, 0.1, 0.2];
    let sizes = errors.map(|error| [tets(&subject.vertex, error), tets(&plain, error)]);
    assert!(sizes.iter().all(|[own, plain]| own <= plain) && sizes.iter().any(|[own, plain]| own < plain));
    let bytes = encode(&plain, &EncodeOptions::default()).unwrap();
    // The flags of the header.
    assert_eq!(bytes[12..16], [0; 4]);
    assert!(bytes.len() < encode(&subject.vertex, &EncodeOptions::default()).unwrap().len());
}

#[test]
fn every_promise_is_kept() {
    for subject in SUBJECTS.iter() {
        let report = verify::run(&subject.vertex, &subject.input, Reference::Points, &mut |_, _| {});
        assert!(report.valid, "{}: {:#?}", subject.name, report.failures);
    }
}

#[test]
fn other_methods_refuse() {
    for (kind, method) in [(MtKind::Vertex, Method::Decimate), (MtKind::Edge, Method::Collapse)] {
        let plain = Construction::new(kind, method, BuildCriterion::HalfEdge).expect("they go together");
        let error = plain.with_tet_errors().unwrap_err();
        assert!(error.to_string().contains("method insert"), "{error}");
    }
}

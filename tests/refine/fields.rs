//! Promise: each field has errors of its own; a need that names a field is met by the smallest mesh for that field, and what
//! it promises holds.

use crate::subjects::{SUBJECTS, applied};
use crate::support::meshes::{cube, hilly};
use tetralod::geom::Bounds;
use tetralod::mt::{EdgeMt, MtKind, MultiTessellation, UpdateId};
use tetralod::refine::{LodCriterion, Need, Request, RequestError};
use tetralod_build::verify;
use tetralod_build::{BuildConfig, BuildCriterion, Construction, Method, build};

#[test]
fn the_largest_error_is_that_of_some_field() {
    for subject in SUBJECTS.iter() {
        let fields = subject.mt.info().fields.len();
        for u in (0..subject.mt.updates()).map(UpdateId) {
            let errors = MultiTessellation::errors(&subject.mt, u);
            assert_eq!((errors.len(), errors.iter().max()), (fields, Some(&subject.mt.error(u))));
        }
        assert_eq!(subject.explicit.check(), Ok(()));
    }
}

#[test]
fn needs_of_a_field_are_answered_by_the_closure_of_its_errors() {
    let mut fewer = 0;
    for subject in SUBJECTS.iter().filter(|subject| subject.mt.info().fields.len() > 1) {
        let mut front = subject.fresh();
        let bounds = Bounds::of(&subject.input.positions);
        let corner =
            Bounds { min: bounds.min, max: [0, 1, 2].map(|i| 0.6 * bounds.max[i] + 0.4 * bounds.min[i]) };
        for field in [1, 0] {
            let info = &subject.mt.info().fields[field];
            let value = info.min + 0.4 * info.range();
            for error in [0.05, 0.001, 0.02, 0.0] {
                let need = Need::within(error);
                let wide: Request = need.clone().into();
                let all = subject.satisfy(&mut front, &wide);
                let tets = front.mesh().tet_count();
                let only = need.of_field(field);
                let other = 1 - field;
                let requests: [Request; 5] = [
                    only.clone().into(),
                    only.clone().inside(corner).into(),
                    only.clone().around(field, &[value]).into(),
                    only.clone().around(other, &[subject.mt.info().fields[other].min]).into(),
                    Request::from(only.clone()).and(Need::within(0.1).of_field(other)),
                ];
                for request in &requests {
                    let outcome = subject.satisfy(&mut front, request);
                    let closure = subject.closure(&LodCriterion::new(subject.mt.info(), request));
                    assert_eq!(applied(&front, &subject.mt), closure, "{request:?}");
                    assert!(outcome.satisfied && all.satisfied);
                }
                subject.satisfy(&mut front, &requests[0]);
                fewer += usize::from(front.mesh().tet_count() < tets);
                assert!(front.mesh().tet_count() <= tets);
            }
        }
    }
    assert!(fewer > 4, "{fewer}");
}

#[test]
fn what_is_promised_of_a_field_holds_for_every_builder() {
    let steep = |p: [f64; 3]| (5.0 * p[0]).sin() * p[2] + p[1];
    let input = cube(5, &[hilly, steep]);
    let names: Vec<String> = input.fields.iter().map(|field| field.name.clone()).collect();
    for (kind, method) in [
        (MtKind::Edge, Method::Collapse),
        (MtKind::Vertex, Method::Decimate),
        (MtKind::Vertex, Method::Insert),
    ] {
        let criterion =
            if method == Method::Insert { BuildCriterion::Delaunay } else { BuildCriterion::HalfEdge };
        let fields = names.clone();
        let construction = Construction::new(kind, method, criterion).expect("they go together");
        let config = BuildConfig { construction, fields, ..BuildConfig::of(MtKind::Edge) };
        let mt = build(&input, &config).expect("a good mesh").mt;
        let reference = match method {
            Method::Insert => verify::Reference::Points,
            _ => verify::Reference::Mesh,
        };
        let report = verify::run(&mt, &input, reference, &mut |_, _| {});
        assert!(report.valid, "{kind:?} {method:?}: {:#?}", report.failures);
    }
}

#[test]
fn a_field_that_is_not_there_is_refused() {
    let mt: &EdgeMt = &SUBJECTS[0].mt;
    let refused = |need: Need| Request::from(need).check(mt.info());
    assert_eq!(refused(Need::within(0.1).of_field(2)), Err(RequestError::Field { index: 2, fields: 2 }));
    assert_eq!(
        refused(Need::within(0.1).around(0, &[0.0]).of_field(7)),
        Err(RequestError::Field { index: 7, fields: 2 })
    );
    assert_eq!(refused(Need::within(0.1).of_field(1)), Ok(()));
}

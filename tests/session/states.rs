//! Promise: a session turns bytes into meshes while they arrive, and says what it cannot do.

use crate::support::files::{assemble, sections, small_info};
use tetralod::format::{EncodeOptions, FormatError, encode};
use tetralod::geom::{Bounds, Lattice};
use tetralod::mt::{
    BaseMesh, EdgeMt, EdgeMtBuilder, ErrorCode, FieldInfo, MtInfo, MtKind, MultiTessellation, UpdateError,
    VertexId, VertexSplit,
};
use tetralod::refine::{Need, Request, RequestError};
use tetralod::session::{Session, SessionError};

fn field(name: &str) -> FieldInfo {
    FieldInfo {
        name: name.to_owned(),
        min: 0.0,
        max: 100.0,
        origin: 0.0,
        step: 1.0,
        bits: 8,
        ..FieldInfo::default()
    }
}

/// Two tetrahedra above and below a triangle. The first update splits a corner of the triangle upwards and
/// downwards, the second, which depends on it, another one.
fn two_splits(last_mask: u64) -> Result<EdgeMt, UpdateError> {
    let lattice = Lattice { origin: [-1.0; 3], step: [0.5; 3], bits: 6 };
    let small = small_info(MtKind::Edge, 6, vec![field("p"), field("q")], [7, 4, 2]);
    let info = MtInfo { lattice, displacement_per_error: 1.0, ..small };
    let base = BaseMesh {
        positions: vec![[8, 8, 8], [16, 8, 8], [8, 16, 8], [8, 8, 16], [8, 8, 0]],
        values: [10, 20, 30, 80, 90].into_iter().flat_map(|q| [q, 100 - q]).collect(),
        tets: vec![[0, 1, 2, 3], [0, 2, 1, 4]],
    };
    let mut builder = EdgeMtBuilder::new(info, base).expect("a valid base mesh");
    for (vertex, mask, error) in [(0, 0b10, 3000), (1, last_mask, 2000)] {
        let (vertex, errors) = (VertexId(vertex), &[ErrorCode(error); 2]);
        builder.push(&VertexSplit { vertex, offset: [0, 0, 2], field_offsets: &[6, -6], mask, errors })?;
    }
    Ok(builder.finish())
}

fn bytes() -> Vec<u8> {
    let mt = two_splits(0b10).expect("both updates fit");
    encode(&mt.into(), &EncodeOptions::default()).expect("the MT is complete")
}

fn opened() -> Session {
    let mut session = Session::new();
    session.feed(&bytes()).expect("a good file");
    session.finish().expect("a whole file");
    session
}

fn uniform(error: f64) -> Request {
    Request::within(error)
}

#[test]
fn refinement_gives_the_reference_mesh_and_coarsening_the_base_mesh_again() {
    let mut session = opened();
    let base = session.hash();
    let fine = session.refine(&uniform(0.0)).expect("a plain request");
    assert_eq!((fine.vertices, fine.tetrahedra, fine.applied, fine.refined), (7, 4, 2, 2));
    assert!(fine.satisfied && fine.error_bound == 0.0);
    assert_ne!(session.hash(), base);
    session.mesh().expect("it is open").check().expect("a valid mesh");
    let coarse = session.refine(&uniform(1.0)).expect("a plain request");
    assert_eq!((coarse.vertices, coarse.tetrahedra, coarse.applied, coarse.coarsened), (5, 2, 0, 2));
    assert_eq!(coarse.error_bound, ErrorCode(3000).error());
    assert_eq!(session.hash(), base);
}

#[test]
fn the_view_follows_the_mesh_and_the_field() {
    let mut session = opened();
    let points = |session: &mut Session| {
        let view = session.view();
        assert_eq!(view.tets.len(), view.neighbors.len());
        let mut points: Vec<_> =
            view.positions.iter().zip(view.field).map(|(p, v)| (p.map(|x| x as i32), *v as i32)).collect();
        points.sort_unstable();
        points
    };
    assert_eq!(points(&mut session)[1], ([3, 3, 3], 10));
    session.refine(&uniform(0.0)).expect("a plain request");
    let [below, above] = [1, 2].map(|i| points(&mut session)[i]);
    // Lattice points (8, 8, 7) and (8, 8, 9) at half a unit each, cut to whole numbers.
    assert_eq!([below, above], [([3, 3, 2], 7), ([3, 3, 3], 13)]);
    session.set_field(1).expect("there are two");
    assert_eq!(points(&mut session)[1..3], [([3, 3, 2], 93), ([3, 3, 3], 87)]);
    session.refine(&uniform(1.0)).expect("a plain request");
    assert_eq!(points(&mut session)[1], ([3, 3, 3], 90));
}

#[test]
fn what_has_arrived_is_usable_and_bounded() {
    let bytes = bytes();
    let mut session = Session::new();
    assert_eq!(session.refine(&uniform(0.0)), Err(SessionError::NotReady));
    assert_eq!(session.isosurface(0.0).err(), Some(SessionError::NotReady));
    assert_eq!(session.set_field(0), Err(SessionError::NotReady));
    assert!(session.view().tets.is_empty() && session.info().is_none() && session.hash() == 0);
    let mut seen = Vec::new();
    for byte in &bytes {
        let progress = session.feed(&[*byte]).expect("a good file");
        assert_eq!(progress, session.progress());
        assert_eq!(progress.ready, session.info().is_some());
        if progress.ready {
            let stats = session.refine(&uniform(0.0)).expect("a plain request");
            assert_eq!(stats.satisfied, progress.updates == 2);
            assert_eq!(stats.applied, progress.updates);
            seen.push(stats.tetrahedra);
        }
    }
    seen.dedup();
    assert_eq!(seen, [2, 4], "both updates are in one block");
    assert!(session.progress().complete);
}

#[test]
fn surfaces_come_from_the_current_mesh() {
    let mut session = opened();
    let coarse = session.isosurface(50.0).expect("a value in the range").indices.len();
    session.refine(&uniform(0.0)).expect("a plain request");
    let fine = session.isosurface(50.0).expect("a value in the range").indices.len();
    assert!(coarse > 0 && fine > 0);
    assert_eq!(session.isosurface(1e9).expect("a value out of the range").indices.len(), 0);
    assert!(matches!(session.isosurface(f64::NAN), Err(SessionError::Isovalue)));
}

#[test]
fn requests_without_sense_are_refused() {
    let mut session = opened();
    let side = Bounds { min: [1.0, 0.0, 0.0], max: [0.0, 1.0, 1.0] };
    let nan = Bounds { min: [0.0; 3], max: [1.0, f64::NAN, 1.0] };
    let requests = [
        uniform(f64::NAN),
        uniform(-0.1),
        Need::within(0.0).inside(side).into(),
        Need::within(0.0).inside(nan).into(),
        Need::within(0.0).around(0, &[f64::INFINITY]).into(),
    ];
    for request in requests {
        assert!(matches!(session.refine(&request), Err(SessionError::Request(_))), "{request:?}");
    }
    let field = Need::within(0.0).around(2, &[0.5]).into();
    assert_eq!(
        session.refine(&field),
        Err(SessionError::Request(RequestError::Field { index: 2, fields: 2 }))
    );
    assert_eq!(session.set_field(2), Err(SessionError::Request(RequestError::Field { index: 2, fields: 2 })));
}

/// The file with one bit of the first section of a kind flipped, and all checksums as if that were right.
fn flipped(file: &[u8], kind: &[u8; 4], bit: usize) -> Option<Vec<u8>> {
    let mut parts = sections(file);
    let (_, payload) = parts.iter_mut().find(|(other, _)| other == kind)?;
    *payload.get_mut(bit / 8)? ^= 1 << (bit % 8);
    Some(assemble(&parts, 2))
}

#[test]
fn damage_that_only_shows_in_the_mesh_leaves_a_valid_mesh() {
    assert_eq!(two_splits(0b111), Err(UpdateError::Mask { update: 1 }), "a mask that parts nothing");
    let file = bytes();
    assert_eq!(flipped(&file, b"UPDT", 0).map(|bytes| bytes.len()), Some(file.len()));
    let mut found = 0;
    let kinds = [b"MODL", b"UPDT", b"FLDB"];
    let file = &file;
    for damaged in kinds.into_iter().flat_map(|kind| (0..).map_while(move |bit| flipped(file, kind, bit))) {
        let mut session = Session::new();
        if session.feed(&damaged).is_err() {
            continue;
        }
        let Err(error) = session.refine(&uniform(0.0)) else { continue };
        assert!(matches!(error, SessionError::Format(FormatError::Update(_))), "{error:?}");
        session.mesh().expect("it is open").check().expect("a valid mesh");
        let stats = session.refine(&uniform(1.0)).expect("the base mesh is sound");
        assert_eq!(stats.tetrahedra, 2);
        found += 1;
    }
    assert!(found > 0, "some damage is not in the bytes");
}

#[test]
fn a_base_mesh_that_is_no_mesh_is_refused_for_good() {
    let good = two_splits(0b10).expect("both updates fit");
    let mut base = good.base().clone();
    base.tets.push([0, 1, 2, 3]);
    let info = MtInfo { vertices: 5, updates: 0, ..good.info().clone() };
    let refused = encode(&EdgeMt::new(info, base).into(), &EncodeOptions::default());
    assert!(refused.is_err(), "the same tetrahedron twice");
    let (file, mut found) = (bytes(), 0);
    for bit in 0.. {
        let Some(damaged) = flipped(&file, b"BASE", bit) else { break };
        let mut session = Session::new();
        let Err(error @ FormatError::Base(_)) = session.feed(&damaged) else { continue };
        assert_eq!(session.feed(&[]), Err(error.clone()));
        assert_eq!(session.finish(), Err(error));
        assert!(session.info().is_none() && !session.progress().complete);
        found += 1;
    }
    assert!(found > 0, "some damage makes another mesh");
}

//! Promise: a session has the meshes of the updates in its file, also while it arrives: those that the explicit structure with the
//! same updates has. (Half-edge MTs, which may come in any order, are compared with it in `tests/mt/half_edge_pages.rs`.)

use crate::support::files::sections;
use crate::support::meshes::{bent, built, cube, hilly, linear};
use crate::support::requests::requests;
use crate::support::strategies::config;
use proptest::prelude::*;
use tetralod::format::{EncodeOptions, encode};
use tetralod::mesh::TetMesh;
use tetralod::mt::{
    ExplicitMt, ExplicitUpdate, Mt, MtKind, MultiTessellation, UpdateId, UpdatePages, VertexId,
};
use tetralod::refine::{Front, LodCriterion, Request};
use tetralod::session::Session;
use tetralod_build::verify::{self, Reference};
use tetralod_build::{BuildConfig, build};

/// An MT of a kind with all fields of the mesh.
fn made(mesh: &TetMesh, kind: MtKind) -> Mt {
    let config = BuildConfig { all_fields: true, ..BuildConfig::of(kind) };
    build(mesh, &config).expect("a valid mesh").mt
}

fn bytes_of(mt: &Mt) -> Vec<u8> {
    encode(mt, &EncodeOptions::default()).expect("a complete MT")
}

/// Where each section of a file ends; the sections of a block are taken together.
fn ends(bytes: &[u8]) -> Vec<usize> {
    let sections = sections(bytes);
    let mut end = 32;
    let mut ends = Vec::new();
    for (at, (_, payload)) in sections.iter().enumerate() {
        end += 12 + payload.len();
        if sections.get(at + 1).is_none_or(|(next, _)| next != b"FLDU") {
            ends.push(end);
        }
    }
    ends.into_iter().chain([bytes.len()]).collect()
}

/// Adds the next update of the whole MT to a part of it.
fn grow(part: &mut ExplicitMt, whole: &ExplicitMt) {
    let u = UpdateId(part.updates());
    let created = whole.created(u).map(VertexId);
    let positions: Vec<[i32; 3]> = created.clone().map(|v| whole.position(v)).collect();
    let levels: Vec<i32> = created.flat_map(|v| whole.levels(v).to_vec()).collect();
    let inserted = whole.inserted(u);
    let update = ExplicitUpdate {
        positions: &positions,
        levels: &levels,
        removed: whole.removed(u),
        inserted: &whole.tets()[inserted.start as usize..inserted.end as usize],
        errors: whole.errors(u),
    };
    assert_eq!(part.push(&update), Ok(u));
}

/// Feeds a file section by section, each in pieces, and makes requests in between.
fn streamed(mt: &Mt, piece: usize, order: &[prop::sample::Index]) {
    let bytes = bytes_of(mt);
    let whole = ExplicitMt::of(mt).expect("any MT can be spelled out");
    let mut part = ExplicitMt::new(whole.info().clone(), whole.base().clone());
    let mut front = Front::new(&part).expect("a valid base mesh");
    let (mut session, mut order, mut start) = (Session::new(), order.iter().cycle(), 0);
    for end in ends(&bytes) {
        for piece in bytes[start..end].chunks(piece) {
            session.feed(piece).expect("a good file");
        }
        start = end;
        let Some(here) = session.mt().map(UpdatePages::present) else { continue };
        (part.updates()..here).for_each(|_| grow(&mut part, &whole));
        for _ in 0..3 {
            let request = &requests()[order.next().expect("it cycles").index(7)];
            let stats = session.refine(request).expect("a good request");
            let criterion = LodCriterion::new(part.info(), request);
            front.satisfy(&part, &criterion, request.budget).expect("a valid MT");
            assert_eq!(session.hash(), front.mesh().hash(), "{request:?}");
            assert_eq!(stats.tetrahedra as usize, front.mesh().tet_count(), "{request:?}");
            assert_eq!(session.view().tets.len(), front.mesh().tet_count(), "{request:?}");
            session.mesh().expect("it is open").check().expect("a valid mesh");
        }
    }
    session.finish().expect("a whole file");
    assert_eq!(part.updates(), whole.updates());
    session.refine(&Request::within(0.0)).expect("a good request");
    assert!(!session.isosurface(0.3).expect("it is open").indices.is_empty());
}

proptest! {
    #![proptest_config(config(6, 53))]

    #[test]
    fn meshes_are_those_of_the_explicit_structure_at_every_moment(
        piece in 1..5000_usize,
        order in prop::collection::vec(any::<prop::sample::Index>(), 20),
    ) {
        for mesh in [cube(11, &[hilly, linear]), bent(11)] {
            for kind in [MtKind::Edge, MtKind::Vertex] {
                streamed(&made(&mesh, kind), piece, &order);
            }
        }
    }
}

#[test]
fn converted_to_and_fro_the_file_is_the_same() {
    for mesh in [cube(8, &[hilly, linear]), bent(9)] {
        for (kind, other) in [(MtKind::Vertex, MtKind::HalfEdge), (MtKind::HalfEdge, MtKind::Vertex)] {
            let mt = made(&mesh, kind);
            let back = mt.convert(other).and_then(|mt| mt.convert(kind)).expect("the same updates");
            assert_eq!(bytes_of(&back), bytes_of(&mt), "{}", kind.name());
        }
    }
}

#[test]
fn an_explicit_mt_keeps_every_promise() {
    let mesh = bent(6);
    let spelled = ExplicitMt::of(&built(&mesh).mt).expect("any MT can be spelled out");
    let report = verify::run(&spelled, &mesh, Reference::Mesh, &mut |_, _| {});
    assert!(report.valid && report.queries > 40, "{:#?}", report.failures);
    // The reference mesh has the points of the input, too.
    let report = verify::run(&spelled, &mesh, Reference::Points, &mut |_, _| {});
    assert!(report.valid && report.queries > 40, "{:#?}", report.failures);
    let points = TetMesh { tets: Vec::new(), ..mesh.clone() };
    let report = verify::run(&spelled, &points, Reference::Points, &mut |_, _| {});
    assert!(report.valid && report.queries > 40, "{:#?}", report.failures);
    let mut moved = points.clone();
    moved.positions[7][0] += 0.1;
    let report = verify::run(&spelled, &moved, Reference::Points, &mut |_, _| {});
    assert!(!report.valid && report.failures[0].contains("points of the input"), "{:#?}", report.failures);
    let mut less = mesh.clone();
    less.tets.pop();
    let report = verify::run(&spelled, &less, Reference::Points, &mut |_, _| {});
    assert!(!report.valid && report.failures[0].contains("volume"), "{:#?}", report.failures);
}

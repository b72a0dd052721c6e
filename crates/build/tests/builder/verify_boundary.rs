//! Promise: the boundary is within its bound at the places that the documentation names, between vertices too; and verification looks there.

use crate::support::meshes::sheet;
use tetralod::mesh::TetMesh;
use tetralod::mt::{
    ApplyUpdates, ErrorCode, ExplicitMt, ExplicitUpdate, Mt, MtKind, MultiTessellation, UpdateId, VertexId,
};
use tetralod::refine::Request;
use tetralod_build::verify::{self, Reference, VerifyReport};
use tetralod_build::{BuildConfig, build};

fn built(mesh: &TetMesh, kind: MtKind) -> Mt {
    let config = BuildConfig { fields: vec!["f0".into()], ..BuildConfig::of(kind) };
    build(mesh, &config).expect("a mesh to build on").mt
}

fn verified(mt: &impl ApplyUpdates, mesh: &TetMesh) -> VerifyReport {
    let requests = [0.3, 0.1, 0.03, 0.01].map(Request::within);
    verify::run_requests(mt, mesh, Reference::Mesh, &requests, &mut |_, _| {})
}

/// The same updates, with errors that are this many times smaller.
fn lowered(mt: &impl ApplyUpdates, times: f64) -> ExplicitMt {
    let explicit = ExplicitMt::of(mt).expect("a sound MT");
    let mut other = ExplicitMt::new(explicit.info().clone(), explicit.base().clone());
    for u in (0..explicit.updates()).map(UpdateId) {
        let created: Vec<VertexId> = explicit.created(u).map(VertexId).collect();
        let positions: Vec<[i32; 3]> = created.iter().map(|&v| explicit.position(v)).collect();
        let levels: Vec<i32> = created.iter().flat_map(|&v| explicit.levels(v)).copied().collect();
        let inserted = explicit.inserted(u);
        let lower = |code: &ErrorCode| ErrorCode::at_least(code.error() / times);
        let errors: Vec<ErrorCode> = explicit.errors(u).iter().map(lower).collect();
        let update = ExplicitUpdate {
            positions: &positions,
            levels: &levels,
            removed: explicit.removed(u),
            inserted: &explicit.tets()[inserted.start as usize..inserted.end as usize],
            errors: &errors,
        };
        other.push(&update).expect("the same update");
    }
    other
}

/// When the edge kind bounded the boundary at vertices alone, the thicker one was 1.3 times too far away between them.
#[test]
fn faces_of_thin_bodies_keep_to_the_bound() {
    for (thickness, kind) in
        [(0.01, MtKind::HalfEdge), (0.01, MtKind::Edge), (0.3, MtKind::HalfEdge), (0.3, MtKind::Edge)]
    {
        let mesh = sheet(thickness);
        let report = verified(&built(&mesh, kind), &mesh);
        assert!(report.valid, "{thickness}, {}: {:#?}", kind.name(), report.failures);
        assert!(report.worst_error_ratio > 0.5, "the boundary moves: {}", report.worst_error_ratio);
    }
}

/// Vertices of half-edge MTs are those of the input: only between them the extracted boundary can be too far away.
#[test]
fn faces_that_are_too_far_away_are_found_between_vertices() {
    let mesh = sheet(0.01);
    for kind in [MtKind::HalfEdge, MtKind::Edge] {
        let report = verified(&lowered(&built(&mesh, kind), 30.0), &mesh);
        let found = |words: &str| report.failures.iter().any(|failure| failure.contains(words));
        assert!(found("middle of the extracted boundary"), "{}: {:#?}", kind.name(), report.failures);
    }
}

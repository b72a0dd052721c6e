//! Promise: a session does the same with an MT of any kind that holds the same updates, also while it arrives.

use crate::support::files::sections;
use crate::support::meshes::{bent, built, cube, hilly, linear};
use crate::support::requests::requests;
use crate::support::strategies::config;
use proptest::prelude::*;
use tetralod::format::{EncodeOptions, encode};
use tetralod::mesh::TetMesh;
use tetralod::mt::{Mt, MtKind, MultiTessellation};
use tetralod::refine::Request;
use tetralod::session::Session;
use tetralod_build::verify::{self, Reference};

/// The MT as it was built, and spelled out.
fn both(mesh: &TetMesh) -> [Mt; 2] {
    let edge = Mt::from(built(mesh).mt);
    let spelled = edge.convert(MtKind::Explicit).expect("any MT can be spelled out");
    [edge, spelled]
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

/// Feeds both files section by section, each in pieces, and makes requests in between.
fn streamed(files: &[Vec<u8>; 2], piece: usize, order: &[prop::sample::Index]) {
    let mut order = order.iter().cycle();
    let mut sessions = [Session::new(), Session::new()];
    let [of_edge, of_spelled] = files.each_ref().map(|bytes| ends(bytes));
    assert_eq!(of_edge.len(), of_spelled.len(), "as many blocks");
    let mut starts = [0, 0];
    for ends in of_edge.into_iter().zip(of_spelled).map(<[usize; 2]>::from) {
        for (i, end) in ends.into_iter().enumerate() {
            for piece in files[i][starts[i]..end].chunks(piece) {
                sessions[i].feed(piece).expect("a good file");
            }
            starts[i] = end;
        }
        if sessions[0].info().is_none() {
            continue;
        }
        for _ in 0..3 {
            let request = &requests()[order.next().expect("it cycles").index(7)];
            let [mut edge, spelled] = sessions.each_mut().map(|s| s.refine(request).expect("a good request"));
            // How much had to be looked at is each structure's own affair.
            edge.judged = spelled.judged;
            assert_eq!(edge, spelled, "{request:?}");
            let [edge, spelled] = sessions.each_mut().map(|s| (s.hash(), s.view().tets.len()));
            assert_eq!(edge, spelled, "{request:?}");
            sessions.iter().for_each(|s| s.mesh().expect("it is open").check().expect("a valid mesh"));
        }
    }
    assert!(sessions.iter_mut().all(|s| s.finish().is_ok()));
    let surfaces = sessions.each_mut().map(|s| {
        s.refine(&Request::within(0.0)).expect("a good request");
        s.isosurface(0.3).expect("it is open").indices.len()
    });
    assert_eq!(surfaces[0], surfaces[1]);
}

proptest! {
    #![proptest_config(config(6, 53))]

    #[test]
    fn meshes_are_the_same_at_every_moment(
        piece in 1..5000_usize,
        order in prop::collection::vec(any::<prop::sample::Index>(), 20),
    ) {
        for mesh in [cube(11, &[hilly, linear]), bent(11)] {
            streamed(&both(&mesh).each_ref().map(bytes_of), piece, &order);
        }
    }
}

#[test]
fn converted_to_and_fro_the_file_is_the_same() {
    for mesh in [cube(8, &[hilly, linear]), bent(9)] {
        let [edge, spelled] = both(&mesh);
        let back = spelled.convert(MtKind::Edge).expect("it was one");
        assert_eq!(bytes_of(&back), bytes_of(&edge));
    }
}

#[test]
fn an_explicit_mt_keeps_every_promise() {
    let mesh = bent(6);
    let [_, spelled] = both(&mesh);
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
    assert_eq!(spelled.info().kind, MtKind::Explicit);
}

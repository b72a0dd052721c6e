//! Promise: a file states the box around its reference mesh, exactly; where it does not, a reader takes one that is a little larger,
//! or, where the file has no index, that of the lattice.

use crate::reader;
use crate::support::files::{assemble, decode, in_blocks, sections};
use crate::support::meshes::{bent, blocks, hilly};
use tetralod::format::{Decoder, EncodeOptions, FormatError, encode};
use tetralod::geom::{Bounds, lattice_box};
use tetralod::mesh::TetMesh;
use tetralod::mt::{Mt, MtKind, MultiTessellation, stats};
use tetralod_build::{BuildConfig, build};

fn decoder(bytes: &[u8]) -> Decoder {
    let mut decoder = Decoder::default();
    decoder.feed(bytes).expect("a sound file");
    decoder
}

fn built(mesh: &TetMesh, kind: MtKind) -> Mt {
    build(mesh, &BuildConfig::of(kind)).expect("a valid mesh").mt
}

fn written(mt: &Mt) -> Vec<u8> {
    let options = EncodeOptions { histograms: true, ..EncodeOptions::default() };
    encode(&in_blocks(mt, 5), &options).expect("a complete MT")
}

/// A curved mesh, and one that fills a part of its lattice.
fn meshes() -> [TetMesh; 2] {
    [bent(5), blocks([7, 4, 2], &[hilly], |c| c[0] > 1 || c[1] < 2)]
}

/// The same file without the section.
fn without(bytes: &[u8], updates: u32) -> Vec<u8> {
    let mut sections = sections(bytes);
    let before = sections.len();
    sections.retain(|(kind, _)| kind != b"bbox");
    assert_eq!(sections.len() + 1, before);
    assemble(&sections, updates)
}

#[test]
fn it_is_that_of_the_reference_mesh_for_all_kinds() {
    for (mesh, kind) in meshes().iter().flat_map(|mesh| MtKind::ALL.map(|kind| (mesh, kind))) {
        let mt = built(mesh, kind);
        let found = stats(&mt).expect("a sound MT").bounds;
        assert_eq!(mt.info().bounds, Some(found), "{}", kind.name());
        let bytes = written(&mt);
        assert_eq!(reader::open(&bytes).0.bounds, Some(found), "{}", kind.name());
        let decoder = decoder(&bytes);
        assert_eq!(decoder.info().and_then(|info| info.bounds), Some(found));
        let [min, max] = found.map(|corner| mt.info().lattice.point(corner));
        assert_eq!(decoder.bounds(), Some(Bounds { min, max }));
        // By as much as the lattice moves points, it is that of the input.
        let input = Bounds::of(&mesh.positions);
        let apart = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max);
        let most = mt.info().quantization;
        assert!(apart(min, input.min) <= most && apart(max, input.max) <= most, "{}", kind.name());
    }
}

#[test]
fn a_file_without_it_has_a_box_that_is_a_little_larger() {
    for (mesh, kind) in meshes().iter().flat_map(|mesh| MtKind::ALL.map(|kind| (mesh, kind))) {
        let mt = built(mesh, kind);
        let updates = mt.updates();
        let exact = decoder(&written(&mt)).bounds().expect("a box");
        let bytes = without(&written(&mt), updates);
        let found = decoder(&bytes).bounds().expect("a box");
        let lattice = mt.info().lattice;
        for k in 0..3 {
            let slack = lattice.step[k] * f64::from(1 << lattice.bits) / 256.0;
            assert!(found.min[k] <= exact.min[k] && exact.max[k] <= found.max[k], "{}", kind.name());
            if kind.is_paged() {
                assert!(exact.min[k] - found.min[k] <= slack && found.max[k] - exact.max[k] <= slack);
            } else {
                let [low, high] = [0, 1 << lattice.bits].map(|x| lattice.point([x; 3])[k]);
                assert_eq!([found.min[k], found.max[k]], [low, high]);
            }
        }
        // It can be found, and is written then.
        let mut again = decode(&bytes).expect("a good file");
        assert_eq!(again.info().bounds, None);
        let unstated = encode(&again, &EncodeOptions::default()).expect("a sound MT");
        assert!(sections(&unstated).iter().all(|(kind, _)| kind != b"bbox"));
        again.find_bounds().expect("a sound MT");
        assert_eq!(again.info().bounds, mt.info().bounds);
        assert!(written(&again) == written(&mt));
    }
}

#[test]
fn it_is_there_before_the_first_block() {
    let mt = built(&meshes()[0], MtKind::HalfEdge);
    let bytes = written(&mt);
    let mut decoder = Decoder::default();
    let mut at = 0;
    while decoder.mt().is_none() {
        assert_eq!(decoder.bounds(), None);
        decoder.feed(&bytes[at..=at]).expect("a good file");
        at += 1;
    }
    assert_eq!(decoder.bounds(), mt.info().model_bounds());
    let low = lattice_box(mt.base().positions.iter().copied()).expect("a base mesh");
    let all = mt.info().bounds.expect("it was built");
    assert!((0..3).all(|k| all[0][k] <= low[0][k] && low[1][k] <= all[1][k]));
}

#[test]
fn what_is_no_such_box_is_refused() {
    let mt = built(&meshes()[0], MtKind::Edge);
    let bytes = written(&mt);
    let good = sections(&bytes);
    let at = good.iter().position(|(kind, _)| kind == b"bbox").expect("the section");
    let refused = |payload: Vec<u8>| {
        let mut sections = good.clone();
        sections[at].1 = payload;
        match decode(&assemble(&sections, mt.updates())) {
            Ok(_) => false,
            Err(FormatError::Corrupt { .. } | FormatError::Truncated { .. } | FormatError::Base(_)) => true,
            Err(error) => panic!("{error:?}"),
        }
    };
    assert!(!refused(good[at].1.clone()));
    assert!(refused(vec![]), "empty");
    assert!(refused(good[at].1[..good[at].1.len() - 1].to_vec()), "too short");
    assert!(refused([good[at].1.clone(), vec![0]].concat()), "too long");
    assert!(refused(vec![0; 6]), "a point, in which the base mesh is not");
    let wide = [0xFF, 0xFF, 0xFF, 0xFF, 0x0F];
    assert!(refused([[0].as_slice(), &wide, &[0], &wide, &[0], &wide].concat()), "beyond the lattice");
    assert!(refused([wide.as_slice(), &wide, &wide, &wide, &wide, &wide].concat()), "beyond 32 bits");
    for place in (0..=good.len()).filter(|place| !(at..=at + 1).contains(place)) {
        let mut sections = good.clone();
        let section = sections.remove(at);
        sections.insert(place.min(sections.len()), section);
        assert!(decode(&assemble(&sections, mt.updates())).is_err(), "at {place}");
    }
    let mut twice = good.clone();
    twice.insert(at, good[at].clone());
    assert!(decode(&assemble(&twice, mt.updates())).is_err());
}

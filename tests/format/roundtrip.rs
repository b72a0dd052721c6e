//! Promise: what is decoded is what was encoded, and the same MT gives the same bytes.

use crate::support::files::{
    assert_same, bytes_in_blocks, bytes_of, coded, decode, encoded, in_blocks, inserted, options, planned,
    sample, samples,
};
use crate::support::strategies::{config, plan};
use proptest::prelude::*;
use tetralod::format::{Decoder, EncodeError, EncodeOptions, encode_to};
use tetralod::geom::WIDE_BITS;
use tetralod::mt::{
    ApplyUpdates, EdgeMt, EdgeUpdate, ExplicitMt, Mt, MtKind, MultiTessellation, UpdateError, UpdateId,
    UpdatePages,
};
use tetralod_build::{BuildConfig, build};
use tetralod_io::generate;

/// The file of an MT gives an MT of the same updates, and that the same file.
fn comes_back(mt: &Mt, block_bits: u32) {
    let bytes = bytes_in_blocks(mt, block_bits);
    let found = decode(&bytes).expect("a good file");
    assert_same(mt, &found);
    assert!(bytes_in_blocks(mt, block_bits) == bytes, "other bytes for the same MT");
    assert!(bytes_in_blocks(&found, block_bits) == bytes, "other bytes for what was read");
    let paged = mt.in_pages(block_bits).expect("a complete MT");
    assert!(found == paged, "it comes back as it was");
}

proptest! {
    #![proptest_config(config(48, 23))]

    #[test]
    fn any_mt_comes_back(plan in plan(4, 2, 0..80), block_bits in 4..8_u32) {
        comes_back(&Mt::from(planned(plan)), block_bits);
    }

    #[test]
    fn any_insertions_come_back(tets in 1..4_u32, fields in 1..=3_usize, updates in 0..200_usize) {
        comes_back(&inserted(tets, fields, updates), 4);
    }
}

#[test]
fn blocks_of_all_sizes_come_back() {
    for updates in [0, 1, 15, 16, 17, 48, 255, 256, 257] {
        for mt in samples(2, updates) {
            [4, 8, 16].iter().for_each(|&bits| comes_back(&mt, bits));
        }
    }
}

#[test]
fn splits_come_back_from_a_file_as_they_were() {
    let mt = sample(3, 600);
    let spelled = ExplicitMt::of(&coded(&mt)).expect("a valid MT");
    assert!(spelled.compact(MtKind::Edge) == Ok(mt));
}

#[test]
fn description_metadata_and_size_come_back() {
    samples(3, 600).iter().for_each(all_comes_back);
}

fn all_comes_back(mt: &Mt) {
    let bytes = bytes_of(mt);
    let mut decoder = Decoder::default();
    let progress = decoder.feed(&bytes).expect("a good file");
    assert_eq!(decoder.info(), Some(mt.info()));
    assert_eq!(decoder.mt().map(|mt| mt.info()), Some(mt.info()));
    assert_eq!(decoder.wanted_fields(), [0, 1, 2]);
    assert!(decoder.metadata().iter().cloned().eq(options().metadata));
    assert!(progress.ready && progress.complete);
    assert_eq!((progress.bytes, progress.updates), (bytes.len() as u64, 600));
    assert_eq!(progress.total, Some(bytes.len() as u64));
}

#[test]
fn a_writer_gets_the_same_bytes() {
    for mt in samples(1, 600) {
        let mut written = Vec::new();
        let paged = in_blocks(&mt, 8);
        let size = encode_to(&paged, &options(), &mut written).expect("a vector takes everything");
        assert_eq!(size, written.len() as u64);
        assert_eq!(written, bytes_of(&mt));
    }
}

#[test]
fn what_could_not_be_read_back_is_not_written() {
    let plain = EncodeOptions::default();
    let Mt::Edge(whole) = sample(1, 5) else { panic!("edge-based") };
    let part = EdgeMt::new(whole.info().clone(), whole.base().clone());
    let incomplete = encoded(&part, &plain);
    assert!(matches!(incomplete, Err(EncodeError::Incomplete { updates: 0, expected: 5 })));

    let mut miscounted = whole.info().clone();
    miscounted.updates = 0;
    let miscounted = EdgeMt::new(miscounted, whole.base().clone());
    assert!(matches!(encoded(&miscounted, &plain), Err(EncodeError::Base(_))));

    let metadata = [("key".to_owned(), "x".repeat(70_000))].into();
    let wordy = EncodeOptions { metadata, ..plain.clone() };
    assert!(matches!(encoded(&whole, &wordy), Err(EncodeError::TooLong { .. })));

    for page_bits in [0, 3, 17, 32, u32::MAX] {
        let odd = inserted(1, 1, 5).in_pages(page_bits).expect("a complete MT");
        assert!(matches!(encoded(&odd, &plain), Err(EncodeError::Blocks { bits }) if bits == page_bits));
    }
    let small = Mt::from(whole.clone()).in_pages(3).expect("a complete MT");
    assert!(matches!(encoded(&small, &plain), Err(EncodeError::Blocks { bits: 3 })));

    // Updates that no mesh takes: all goes to one side, and more than there is.
    let mut damaged = EdgeMt::new(whole.info().clone(), whole.base().clone());
    for u in (0..whole.updates()).map(UpdateId) {
        let update = EdgeUpdate { wrong_sides: u64::MAX, ..whole.update(u) };
        damaged.push(&update).expect("only a mesh can tell");
    }
    let refused = encoded(&damaged, &plain);
    assert!(matches!(refused, Err(EncodeError::Update(_))), "{refused:?}");
}

#[test]
fn offsets_come_back_on_lattices_of_all_widths() {
    for bits in [8, 12, 16, 17, 18, 19, 20, 24, WIDE_BITS] {
        let config = BuildConfig { position_bits: Some(bits), ..BuildConfig::of(MtKind::Edge) };
        let mesh = generate::bucky(6).expect("a small size");
        let built = build(&mesh, &config).expect("an MT");
        let mt = built.mt;
        comes_back(&mt, 5);
        let Mt::Edge(coded) = coded(&mt) else { panic!("edge-based") };
        let edges = (0..coded.updates()).filter(|&u| coded.update(UpdateId(u)).edge != 0).count();
        assert!(0 < edges && edges < coded.updates() as usize, "{edges} offsets are told by edges");
    }
}

#[test]
fn offsets_are_not_counted_from_edges_that_are_not_there() {
    let Mt::Edge(mt) = sample(1, 40) else { panic!("edge-based") };
    let copy = |count: u32, edge: u8| {
        let mut to = EdgeMt::new(mt.info().clone(), mt.base().clone());
        for u in (0..count - 1).map(UpdateId) {
            to.push(&mt.update(u)).expect("an update of the MT");
        }
        let last = mt.update(UpdateId(count - 1));
        to.push(&EdgeUpdate { edge, ..last }).map(|_| to)
    };
    assert_eq!(copy(3, 128), Err(UpdateError::Edge { update: 2 }));
    // How many edges there are only the mesh can tell.
    let far = copy(1, 127).expect("seven bits");
    let mut mesh = far.start().expect("a base mesh");
    far.updates_arrived(&mut mesh, 0);
    let tets = mesh.tets().to_vec();
    assert_eq!(far.refine(&mut mesh, UpdateId(0)), Err(UpdateError::Edge { update: 0 }));
    assert_eq!(mesh.tets(), tets, "the mesh is as it was");
}

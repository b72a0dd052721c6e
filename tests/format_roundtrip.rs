//! Promise: what is decoded is what was encoded, and the same MT gives the same bytes.

mod format_support;

use format_support::{Draft, build, bytes_of, decode, options, sample, samples};
use proptest::prelude::*;
use tetralod::format::{BLOCK_UPDATES, Decoder, EncodeError, EncodeOptions, encode, encode_to};
use tetralod::mt::{EdgeMt, ExplicitMt, Mt, MtInfo, MultiTessellation};

fn draft() -> impl Strategy<Value = Draft> {
    let offset = prop_oneof![-3..=3_i32, -(1 << 20)..=(1 << 20_i32)];
    let level = prop_oneof![-3..=3_i32, -4096..=4096_i32];
    (
        prop::array::uniform3(offset),
        any::<u32>(),
        prop_oneof![any::<u64>(), 0..256_u64],
        any::<u16>(),
        prop::collection::vec(level, 3),
    )
}

proptest! {
    #[test]
    fn any_mt_comes_back(
        tets in 1..6_u32,
        fields in 1..4_usize,
        drafts in prop::collection::vec(draft(), 0..700),
    ) {
        let mt = build(tets, fields, &drafts);
        let bytes = bytes_of(&mt);
        prop_assert_eq!(decode(&bytes), Ok(mt.clone()));
        prop_assert_eq!(bytes_of(&mt), bytes);
    }
}

#[test]
fn blocks_of_all_sizes_come_back() {
    let block = BLOCK_UPDATES as usize;
    for updates in [0, 1, block - 1, block, block + 1, 3 * block] {
        for mt in samples(3, 2, updates) {
            assert_eq!(decode(&bytes_of(&mt)), Ok(mt), "{updates} updates");
        }
    }
}

#[test]
fn description_metadata_and_size_come_back() {
    samples(2, 3, 600).iter().for_each(all_comes_back);
}

fn all_comes_back(mt: &Mt) {
    let bytes = bytes_of(mt);
    let mut decoder = Decoder::default();
    let progress = decoder.feed(&bytes).expect("a good file");
    assert_eq!(decoder.info(), Some(mt.info()));
    assert!(decoder.metadata().iter().cloned().eq(options().metadata));
    assert!(progress.ready && progress.complete);
    assert_eq!((progress.bytes, progress.updates), (bytes.len() as u64, 600));
    assert_eq!(progress.total, Some(bytes.len() as u64));
}

#[test]
fn a_writer_gets_the_same_bytes() {
    for mt in samples(2, 1, 600) {
        let mut written = Vec::new();
        let size = encode_to(&mt, &options(), &mut written).expect("a vector takes everything");
        assert_eq!(size, written.len() as u64);
        assert_eq!(written, bytes_of(&mt));
    }
}

#[test]
fn what_could_not_be_read_back_is_not_written() {
    let whole = sample(1, 1, 5);
    let part = EdgeMt::new(whole.info().clone(), whole.base().clone());
    let incomplete = encode(&part, &EncodeOptions::default());
    assert!(matches!(incomplete, Err(EncodeError::Incomplete { updates: 0, expected: 5 })));

    let mut miscounted = whole.info().clone();
    miscounted.updates = 0;
    let miscounted = EdgeMt::new(miscounted, whole.base().clone());
    assert!(matches!(encode(&miscounted, &EncodeOptions::default()), Err(EncodeError::Base(_))));

    let [_, spelled, _] = samples(1, 1, 5);
    let other = MtInfo { updates: 0, ..spelled.info().clone() };
    let other = ExplicitMt::new(other, spelled.base().clone());
    assert!(matches!(encode(&other, &EncodeOptions::default()), Err(EncodeError::Base(_))));

    let metadata = [("key".to_owned(), "x".repeat(70_000))].into();
    assert!(matches!(encode(&whole, &EncodeOptions { metadata }), Err(EncodeError::TooLong { .. })));
}

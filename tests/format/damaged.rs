//! Promise: damage is detected, whatever it is; nothing panics, hangs, or takes memory that the bytes do not back.

use crate::support::files::{
    assemble, bytes_in_blocks, bytes_of, decode, half_edge, header, inserted, is_prefix, overwrite, sample,
    samples, sections, within,
};
use crate::support::strategies::config;
use proptest::prelude::*;
use std::collections::BTreeSet;
use tetralod::format::{Decoder, EncodeError, EncodeOptions, FormatError, Limits, encode};
use tetralod::mt::{BaseMeshError, Mt, MultiTessellation, UpdatePages};

#[test]
fn every_flipped_bit_is_detected_and_what_came_before_is_intact() {
    samples(1, 24).iter().for_each(every_flip_is_detected);
}

fn every_flip_is_detected(mt: &Mt) {
    let bytes = bytes_in_blocks(mt, 4);
    let whole = decode(&bytes).expect("a good file");
    for bit in 0..8 * bytes.len() {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        let mut decoder = Decoder::default();
        let fed = decoder.feed(&damaged);
        let finished = decoder.finish();
        let error = fed.err().or(finished.err()).unwrap_or_else(|| panic!("bit {bit} went unnoticed"));
        assert!(
            matches!(error, FormatError::NotMt | FormatError::Corrupt { .. } | FormatError::Truncated { .. }),
            "bit {bit}: {error:?}"
        );
        assert!(decoder.mt().is_none_or(|part| is_prefix(part, &whole)), "bit {bit}");
    }
}

#[test]
fn an_error_stays_and_the_mt_too() {
    samples(1, 700).iter().for_each(error_stays);
}

fn error_stays(mt: &Mt) {
    let mut bytes = bytes_in_blocks(mt, 4);
    let place = bytes.len() * 3 / 4;
    bytes[place] ^= 1;
    let mut decoder = Decoder::default();
    let error = decoder.feed(&bytes).expect_err("a damaged block");
    assert_eq!(decoder.feed(&bytes), Err(error.clone()));
    assert_eq!(decoder.feed(&[]), Err(error.clone()));
    assert_eq!(decoder.finish(), Err(error));
    let updates = decoder.mt().map(|mt| mt.present());
    assert!(updates.is_some_and(|n| n > 0 && n < 700), "{updates:?}");
    assert!(!decoder.progress().complete);
}

#[test]
fn lost_repeated_and_swapped_sections_are_detected() {
    samples(1, 700).iter().for_each(sections_are_in_order);
}

fn sections_are_in_order(mt: &Mt) {
    let bytes = bytes_of(mt);
    let good = sections(&bytes);
    assert_eq!(assemble(&good, 700), bytes, "the test writes files as the library does");
    let starts: Vec<usize> = good
        .iter()
        .scan(32, |at, (_, payload)| {
            *at += 12 + payload.len();
            Some(*at - 12 - payload.len())
        })
        .chain([bytes.len() - 24])
        .collect();
    // A writer need not know the size; then the totals alone tell.
    let version = u16::from_le_bytes([bytes[8], bytes[9]]);
    for (i, pair) in starts.windows(2).enumerate() {
        let lost = [&bytes[..pair[0]], &bytes[pair[1]..]].concat();
        let repeated = [&bytes[..pair[1]], &bytes[pair[0]..]].concat();
        for (what, changed) in [("lost", lost), ("repeated", repeated)] {
            assert!(decode(&changed).is_err(), "section {i} {what}");
            let of_no_size = [&header(version, 0, 0), &changed[32..]].concat();
            assert!(decode(&of_no_size).is_err(), "section {i} {what}, in a file of no size");
        }
        // The same with totals that fit: the order of sections is checked, too.
        let mut sections = good.clone();
        let section = sections.remove(i);
        let is_skippable = [*b"hist", *b"extr"].contains(&section.0);
        assert_eq!(decode(&assemble(&sections, 700)).is_ok(), is_skippable, "section {i} left out");
        sections.insert((i + 1) % good.len(), section);
        assert!(decode(&assemble(&sections, 700)).is_err(), "section {i} moved");
    }
}

/// Replaces the payload of the first section of a kind.
fn with(bytes: &[u8], kind: &[u8; 4], change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    with_updates(bytes, kind, 20, change)
}

/// The same in a file of so many updates.
fn with_updates(bytes: &[u8], kind: &[u8; 4], updates: u32, change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut sections = sections(bytes);
    let found = sections.iter_mut().find(|(k, _)| k == kind).expect("the section is there");
    change(&mut found.1);
    assemble(&sections, updates)
}

fn is_corrupt(bytes: &[u8]) -> bool {
    matches!(decode(bytes), Err(FormatError::Corrupt { .. }))
}

fn is_refused_by_info(bytes: &[u8]) -> bool {
    matches!(decode(bytes), Err(FormatError::Base(BaseMeshError::Info(_))))
}

#[test]
fn content_with_good_checksums_is_not_trusted() {
    let bytes = bytes_of(&sample(1, 20));
    // Description: kind, then counts, lattice, its bits.
    assert!(is_corrupt(&with(&bytes, b"INFO", |p| p[0] = 7)));
    assert!(is_refused_by_info(&with(&bytes, b"INFO", |p| p[61] = 31)));
    let nan = f64::NAN.to_le_bytes();
    assert!(is_refused_by_info(&with(&bytes, b"INFO", |p| p[37..45].copy_from_slice(&nan))));
    assert!(is_refused_by_info(&with(&bytes, b"INFO", |p| p[1] += 1)), "vertices do not add up");
    assert!(is_refused_by_info(&with(&bytes, b"INFO", |p| p[9] += 1)), "nor with the updates");
    // Base mesh: vertex count, tetrahedra count, size of blocks.
    for bits in [0, 3, 17, 255] {
        assert!(is_corrupt(&with(&bytes, b"BASE", |p| p[2] = bits)), "{bits}");
    }
    assert!(is_refused_by_info(&with(&bytes, b"BASE", |p| p[0] += 1)));
    assert!(decode(&with(&bytes, b"BASE", |p| p[1] += 1)).is_err());
    // Updates: number of the block. Levels: field.
    assert!(is_corrupt(&with(&bytes, b"UPDT", |p| p[0] = 1)));
    assert!(is_corrupt(&with(&bytes, b"FLDB", |p| p[0] = 1)));
    for kind in [b"INFO", b"MODL", b"BASE", b"FLDB", b"UPDT"] {
        assert!(decode(&with(&bytes, kind, |p| p.push(0))).is_err(), "bytes left over");
        assert!(decode(&with(&bytes, kind, |p| p.truncate(p.len() - 1))).is_err(), "bytes missing");
        assert!(is_corrupt(&with(&bytes, kind, Vec::clear)), "nothing at all");
    }
}

#[test]
fn other_kinds_with_good_checksums_are_not_trusted() {
    let kinds = [(inserted(2, 1, 20), b"INSV"), (half_edge(2, 1, 20), b"HALF")];
    for (mt, kind) in &kinds {
        let bytes = bytes_of(mt);
        assert!(is_refused_by_info(&with(&bytes, b"INFO", |p| p[1] += 1)), "vertices do not add up");
        assert!(is_corrupt(&with(&bytes, kind, |p| p[0] = 1)), "the first block is missing");
        for kind in [b"INFO", b"MODL", b"BASE", b"FLDB", kind] {
            assert!(decode(&with(&bytes, kind, |p| p.push(0))).is_err(), "bytes left over");
            assert!(decode(&with(&bytes, kind, |p| p.truncate(p.len() - 1))).is_err(), "bytes missing");
            assert!(is_corrupt(&with(&bytes, kind, Vec::clear)), "nothing at all");
        }
    }
    let bytes = bytes_of(&kinds[1].0);
    assert!(is_corrupt(&with(&bytes, b"INFO", |p| p[10] += 1)), "more updates than the index tells");
    // Index: size of blocks, bytes of what is shared (two of them here), number of blocks.
    for bits in [0, 3, 17, 255] {
        assert!(is_corrupt(&with(&bytes, b"INDX", |p| p[0] = bits)), "{bits}");
    }
    assert!(is_corrupt(&with(&bytes, b"INDX", |p| p[3] = 2)), "a block too many");
    // What they do to fields: block and field.
    assert!(is_corrupt(&with(&bytes, b"FLDU", |p| p[0] = 1)));
    assert!(is_corrupt(&with(&bytes, b"FLDU", |p| p[1] = 1)));
    for kind in [b"INDX", b"FLDU"] {
        assert!(decode(&with(&bytes, kind, |p| p.push(0))).is_err(), "bytes left over");
        assert!(decode(&with(&bytes, kind, |p| p.truncate(p.len() - 1))).is_err(), "bytes missing");
        assert!(is_corrupt(&with(&bytes, kind, Vec::clear)), "nothing at all");
    }
    let of = |kind: usize, name: &[u8; 4]| {
        let sections = sections(&bytes_of(&kinds[kind].0));
        let at = sections.iter().position(|(found, _)| found == name).expect("it is there");
        (at, sections)
    };
    let (at, mut mixed) = of(1, b"HALF");
    let (first, other) = of(0, b"INSV");
    mixed[at] = other[first].clone();
    assert!(is_corrupt(&assemble(&mixed, 20)), "one kind in another");
}

/// What became of a file behind good checksums: refused, or written again as what was read. With the name of the error.
fn outcome(bytes: &[u8]) -> String {
    let mut decoder = Decoder::default();
    let fed = decoder.feed(bytes).map(drop).and_then(|()| decoder.finish());
    if let Err(error) = fed {
        return name(&error);
    }
    let mt = decoder.into_mt().expect("a complete file has a base mesh");
    match encode(&mt, &EncodeOptions::default()) {
        Ok(bytes) => {
            assert!(decode(&bytes).is_ok_and(|again| again == mt), "not what was written");
            "read".into()
        }
        Err(EncodeError::Update(error)) => format!("refused by the mesh: {}", name(&error)),
        // What only the neighbours tell of a base mesh.
        Err(EncodeError::Base(error)) => format!("refused by the mesh: {}", name(&error)),
        // Readers do not compare errors with those of other updates; writers do.
        Err(error @ EncodeError::Order { .. }) => format!("refused by the writer: {}", name(&error)),
        Err(error) => panic!("what was read cannot be written: {error:?}"),
    }
}

/// What an error begins with in its debug form.
fn name(error: &impl std::fmt::Debug) -> String {
    let text = format!("{error:?}");
    text.split([' ', '{'])
        .next()
        .unwrap_or_default()
        .split(char::is_numeric)
        .next()
        .unwrap_or_default()
        .to_owned()
}

/// Every single bit behind good checksums: whatever a reader can meet is met.
#[test]
fn any_bit_behind_good_checksums_is_refused_or_read_faithfully() {
    let mut seen = BTreeSet::new();
    for mt in samples(1, 20) {
        let good = sections(&bytes_in_blocks(&mt, 4));
        for section in 0..good.len() {
            for bit in 0..8 * good[section].1.len() {
                let mut sections = good.clone();
                sections[section].1[bit / 8] ^= 1 << (bit % 8);
                seen.insert(outcome(&assemble(&sections, 20)));
            }
        }
    }
    for expected in
        ["read", "Corrupt", "Base(Tetrahedron(", "Base(Info(", "Update(Vertex", "refused by the mesh: Mask"]
    {
        assert!(seen.iter().any(|name| name.starts_with(expected)), "{expected} in {seen:?}");
    }
}

#[test]
fn numbers_that_are_too_long_are_refused() {
    let bytes = bytes_of(&sample(1, 20));
    for number in [&[0x80_u8, 0x00][..], &[0xFF; 11], &[0xFF, 0xFF, 0xFF, 0xFF, 0x7F]] {
        for kind in [b"BASE", b"FLDB", b"UPDT"] {
            let padded = with(&bytes, kind, |p| drop(p.splice(0..1, number.iter().copied())));
            assert!(matches!(decode(&padded), Err(FormatError::Corrupt { .. })), "{number:?}");
        }
    }
}

#[test]
fn limits_hold_before_memory_is_taken() {
    for mt in samples(1, 520) {
        let bytes = bytes_of(&mt);
        let feed = |limits| within(limits).feed(&bytes).map(drop);
        let tight = Limits { section_bytes: 300, ..Limits::default() };
        assert!(matches!(feed(tight), Err(FormatError::Limit { limit: 300, .. })));
        let tight = Limits { memory_bytes: 5000, ..Limits::default() };
        assert!(matches!(feed(tight), Err(FormatError::Limit { limit: 5000, .. })));
        let roomy = Limits { section_bytes: 100_000, memory_bytes: 16 * MultiTessellation::bytes(&mt) };
        assert_eq!(feed(roomy), Ok(()));
        // Kinds whose updates differ in size tell it as they come; the others are refused at once.
        let half = MultiTessellation::bytes(&mt) * 3 / 4;
        let mut decoder = within(Limits { memory_bytes: half, ..Limits::default() });
        let refused = decoder.feed(&bytes);
        let held = decoder.mt().map_or(0, MultiTessellation::bytes);
        assert!(matches!(refused, Err(FormatError::Limit { .. })), "{refused:?}");
        assert!(held <= half, "{held}");
    }

    // A base mesh that claims 2^31 tetrahedra in a few bytes.
    let mt = sample(1, 20);
    let claims = with(&bytes_of(&mt), b"BASE", |p| {
        p.splice(1..2, [0x80, 0x80, 0x80, 0x80, 0x08]);
    });
    assert!(matches!(decode(&claims), Err(FormatError::Limit { .. })));
    let mut roomy = within(Limits { memory_bytes: u64::MAX, ..Limits::default() });
    assert!(matches!(roomy.feed(&claims), Err(FormatError::Corrupt { .. })));
}

proptest! {
    #![proptest_config(config(256, 31))]

    /// Behind good checksums anything may stand: no panic, and whatever is accepted is written as it was read.
    #[test]
    fn any_change_behind_good_checksums_is_refused_or_read_faithfully(
        kind in 0..3_usize,
        which in any::<prop::sample::Index>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let mut sections = sections(&bytes_in_blocks(&samples(2, 300)[kind], 6));
        let which = which.index(sections.len());
        let payload = &mut sections[which].1;
        overwrite(payload, &changes);
        if let Some(cut) = cut {
            payload.truncate(cut.index(payload.len()));
        }
        outcome(&assemble(&sections, 300));
    }

    #[test]
    fn noise_is_refused(noise in prop::collection::vec(any::<u8>(), 0..300)) {
        let mut decoder = Decoder::default();
        let fed = decoder.feed(&noise);
        prop_assert!(fed.is_err() || noise.len() < 8);
        let body = [header(2, 0, 0), noise].concat();
        prop_assert!(decode(&body).is_err());
    }
}

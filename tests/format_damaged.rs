//! Promise: damage is detected, whatever it is; nothing panics, hangs, or takes memory that the bytes do not back.

mod format_support;

use format_support::{assemble, bytes_of, decode, inserted, is_prefix, sample, samples, sections, spelled};
use proptest::prelude::*;
use tetralod::format::{Decoder, FormatError, Limits};
use tetralod::mt::{BaseMeshError, Mt, MultiTessellation, UpdateError};

#[test]
fn every_flipped_bit_is_detected_and_what_came_before_is_intact() {
    for mt in [sample(2, 2, 520), spelled(2, 2, 150), inserted(2, 2, 150)] {
        every_flip_is_detected(&mt);
    }
}

fn every_flip_is_detected(mt: &Mt) {
    let bytes = bytes_of(mt);
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
        assert!(decoder.mt().is_none_or(|part| is_prefix(part, mt)), "bit {bit}");
    }
}

#[test]
fn an_error_stays_and_the_mt_too() {
    samples(2, 1, 1200).iter().for_each(error_stays);
}

fn error_stays(mt: &Mt) {
    let mut bytes = bytes_of(mt);
    let place = bytes.len() * 3 / 4;
    bytes[place] ^= 1;
    let mut decoder = Decoder::default();
    let error = decoder.feed(&bytes).expect_err("a damaged block");
    assert_eq!(decoder.feed(&bytes), Err(error.clone()));
    assert_eq!(decoder.feed(&[]), Err(error.clone()));
    assert_eq!(decoder.finish(), Err(error));
    let updates = decoder.mt().map(Mt::updates);
    assert!(updates.is_some_and(|n| n > 0 && n < 1200), "{updates:?}");
    assert!(!decoder.progress().complete);
}

#[test]
fn lost_repeated_and_swapped_sections_are_detected() {
    samples(2, 1, 1500).iter().for_each(sections_are_in_order);
}

fn sections_are_in_order(mt: &Mt) {
    let bytes = bytes_of(mt);
    let good = sections(&bytes);
    assert_eq!(assemble(&good, 1500), bytes, "the test writes files as the library does");
    let starts: Vec<usize> = good
        .iter()
        .scan(32, |at, (_, payload)| {
            *at += 12 + payload.len();
            Some(*at - 12 - payload.len())
        })
        .chain([bytes.len() - 24])
        .collect();
    for (i, pair) in starts.windows(2).enumerate() {
        let lost = [&bytes[..pair[0]], &bytes[pair[1]..]].concat();
        assert!(decode(&lost).is_err(), "section {i} lost");
        let repeated = [&bytes[..pair[1]], &bytes[pair[0]..]].concat();
        assert!(decode(&repeated).is_err(), "section {i} repeated");
        // The same with totals that fit: the order of sections is checked, too.
        let mut sections = good.clone();
        let section = sections.remove(i);
        assert!(decode(&assemble(&sections, 1500)).is_err(), "section {i} left out");
        sections.insert((i + 1) % good.len(), section);
        assert!(decode(&assemble(&sections, 1500)).is_err(), "section {i} moved");
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

#[test]
fn content_with_good_checksums_is_not_trusted() {
    let mt = sample(1, 1, 20);
    let bytes = bytes_of(&mt);
    let corrupt = |bytes: &[u8]| matches!(decode(bytes), Err(FormatError::Corrupt { .. }));
    let info =
        |error: &Result<Mt, FormatError>| matches!(error, Err(FormatError::Base(BaseMeshError::Info(_))));
    // Description: kind, then counts, lattice, its bits.
    assert!(corrupt(&with(&bytes, b"INFO", |p| p[0] = 7)));
    assert!(info(&decode(&with(&bytes, b"INFO", |p| p[61] = 31))));
    assert!(info(&decode(&with(&bytes, b"INFO", |p| p[37..45].copy_from_slice(&f64::NAN.to_le_bytes())))));
    assert!(info(&decode(&with(&bytes, b"INFO", |p| p[1] += 1))), "vertices do not add up");
    assert!(corrupt(&with(&bytes, b"INFO", |p| p.push(0))), "bytes left over");
    assert!(corrupt(&with(&bytes, b"INFO", |p| p.truncate(p.len() - 1))), "bytes missing");
    // Base mesh: vertex count, tetrahedra count, length of the positions.
    assert!(decode(&with(&bytes, b"BASE", |p| p[0] = 5)).is_err());
    assert!(corrupt(&with(&bytes, b"BASE", |p| p[1] = 2)));
    assert!(corrupt(&with(&bytes, b"BASE", |p| p[2] += 1)));
    let inside_out = with(&bytes, b"BASE", |p| p[16] = 1);
    assert!(matches!(decode(&inside_out), Err(FormatError::Base(BaseMeshError::Tetrahedron(0)))));
    // Updates: first number, count.
    assert!(corrupt(&with(&bytes, b"UPDT", |p| p[0] = 1)));
    for count in [0, 19, 21] {
        assert!(corrupt(&with(&bytes, b"UPDT", |p| p[1] = count)), "{count} updates");
    }
    let twice = with(&bytes, b"UPDT", |p| p[4] += 2);
    assert!(matches!(decode(&twice), Err(FormatError::Update(_) | FormatError::Corrupt { .. })));
}

/// Behind two numbers, an `EXPL` section has columns: each a length, then new vertices, positions, removed, inserted.
#[test]
fn explicit_content_with_good_checksums_is_not_trusted() {
    // Two tetrahedra; one update puts a vertex into the first.
    let bytes = bytes_of(&spelled(2, 1, 1));
    let base =
        |found: Result<Mt, FormatError>| matches!(found, Err(FormatError::Base(BaseMeshError::Info(_))));
    let corrupt = |bytes: &[u8]| matches!(decode(bytes), Err(FormatError::Corrupt { .. }));
    let explicit = |change: &dyn Fn(&mut Vec<u8>)| with_updates(&bytes, b"EXPL", 1, |p| change(p));
    let mut removed_at = 0;
    explicit(&|p| assert_eq!(p[..4], [0, 1, 1, 1]));
    let _ = explicit(&|p| assert_eq!(&p[5 + usize::from(p[4])..][..3], [2, 1, 1]));
    for (kind, payload) in sections(&bytes) {
        if &kind == b"EXPL" {
            removed_at = 7 + usize::from(payload[4]);
        }
    }
    assert!(base(decode(&with_updates(&bytes, b"INFO", 1, |p| p[1] += 1))), "vertices do not add up");
    assert!(base(decode(&with_updates(&bytes, b"INFO", 1, |p| p[5] += 1))), "tetrahedra do not add up");
    assert!(corrupt(&explicit(&|p| p[1] = 2)), "more updates than there are");
    assert!(corrupt(&explicit(&|p| p[3] = 2)), "a vertex without position");
    assert!(corrupt(&explicit(&|p| p[removed_at] = 2)), "before the first tetrahedron");
    let other = decode(&explicit(&|p| p[removed_at] = 0));
    assert!(matches!(other, Err(FormatError::Update(_))), "the new vertex is not in the other: {other:?}");
    let one_kind_in_another = bytes_of(&sample(2, 1, 1));
    let mut mixed = sections(&bytes);
    mixed[2] = sections(&one_kind_in_another)[2].clone();
    assert!(corrupt(&assemble(&mixed, 1)));
    let beyond = explicit(&|p| {
        let at = removed_at + 2;
        // Four tetrahedra of four numbers follow.
        assert_eq!(p[at], 4);
        p[at + 2] = 99;
    });
    assert!(corrupt(&beyond), "a vertex that is not at hand");
}

/// Behind two numbers, an `INSV` section has columns: lengths, nodes and errors. The last column of `BASE` tells the
/// whether updates make the mesh larger, the most children, then removers.
#[test]
fn vertex_content_with_good_checksums_is_not_trusted() {
    let mt = inserted(2, 1, 3);
    let bytes = bytes_of(&mt);
    let corrupt = |bytes: &[u8]| matches!(decode(bytes), Err(FormatError::Corrupt { .. }));
    let base =
        |found: Result<Mt, FormatError>| matches!(found, Err(FormatError::Base(BaseMeshError::Info(_))));
    let nodes = |change: &dyn Fn(&mut Vec<u8>)| with_updates(&bytes, b"INSV", 3, |p| change(p));
    let removers = |change: &dyn Fn(&mut [u8])| {
        with_updates(&bytes, b"BASE", 3, |p| {
            let at = p.len() - 5;
            // Four bytes: all make the mesh larger, one child at most, then the updates that remove the two tetrahedra.
            assert_eq!(p[at..], [4, 1, 1, 1, 2]);
            change(&mut p[at + 2..]);
        })
    };
    assert!(decode(&removers(&|_| {})).is_ok());
    assert!(corrupt(&removers(&|p| p[1] = 4)), "removed by an update that there is not");
    assert!(corrupt(&removers(&|p| p[0] = 125)), "more children than an update can have");
    assert!(base(decode(&with_updates(&bytes, b"INFO", 3, |p| p[1] += 1))), "vertices do not add up");
    assert!(corrupt(&nodes(&|p| p[0] = 1)), "the first update is missing");
    assert!(corrupt(&nodes(&|p| p[1] = 4)), "more updates than there are");
    assert_eq!(decode(&nodes(&|_| {})), Ok(mt));
    nodes(&|p| assert_eq!(p[2], 3, "three lengths"));
    assert!(corrupt(&nodes(&|p| p[3] += 2)), "the last node is longer than what there is");
    assert!(decode(&nodes(&|p| p[5] -= 1)).is_err(), "something is left");
    let cut = nodes(&|p| {
        let at = 6 + usize::from(p[6]);
        p[6] -= 1;
        p.remove(at);
    });
    assert!(corrupt(&cut), "a byte is missing");
    let off = nodes(&|p| p[7..11].fill(255));
    assert_eq!(decode(&off), Err(FormatError::Update(UpdateError::OffLattice { update: 0 })));
}

#[test]
fn numbers_that_are_too_long_are_refused() {
    let bytes = bytes_of(&sample(1, 1, 20));
    for number in [&[0x80_u8, 0x00][..], &[0xFF; 11], &[0xFF, 0xFF, 0xFF, 0xFF, 0x7F]] {
        let padded = with(&bytes, b"UPDT", |p| drop(p.splice(0..1, number.iter().copied())));
        assert!(matches!(decode(&padded), Err(FormatError::Corrupt { .. })), "{number:?}");
    }
}

#[test]
fn limits_hold_before_memory_is_taken() {
    let bytes = bytes_of(&sample(2, 1, 520));
    let feed = |limits| Decoder::new(limits).feed(&bytes).map(|_| ());
    let tight = Limits { section_bytes: 1000, ..Limits::default() };
    assert!(matches!(feed(tight), Err(FormatError::Limit { limit: 1000, .. })));
    let tight = Limits { memory_bytes: 5000, ..Limits::default() };
    assert!(matches!(feed(tight), Err(FormatError::Limit { limit: 5000, .. })));
    let enough = Limits { section_bytes: 20_000, memory_bytes: 40_000 };
    assert_eq!(feed(enough), Ok(()));

    // Explicit updates tell their size as they come.
    let mt = spelled(2, 1, 520);
    let bytes = bytes_of(&mt);
    let feed = |memory_bytes| {
        let mut decoder = Decoder::new(Limits { memory_bytes, ..Limits::default() });
        (decoder.feed(&bytes).map(drop), decoder.mt().map_or(0, Mt::bytes))
    };
    let whole = feed(2 * mt.bytes());
    assert_eq!(whole, (Ok(()), mt.bytes()));
    let (refused, held) = feed(mt.bytes() / 2);
    assert!(matches!(refused, Err(FormatError::Limit { .. })), "{refused:?}");
    assert!(held > 0 && held <= mt.bytes() / 2, "{held}");

    // So do nodes.
    let mt = inserted(2, 1, 520);
    let bytes = bytes_of(&mt);
    let feed = |memory_bytes| {
        let mut decoder = Decoder::new(Limits { memory_bytes, ..Limits::default() });
        (decoder.feed(&bytes).map(drop), decoder.mt().map_or(0, Mt::bytes))
    };
    assert_eq!(feed(2 * mt.bytes()), (Ok(()), mt.bytes()));
    let (refused, held) = feed(mt.bytes() * 3 / 4);
    assert!(matches!(refused, Err(FormatError::Limit { .. })), "{refused:?}");
    assert!(held <= mt.bytes() * 3 / 4, "{held}");

    // A base mesh that claims 2^31 tetrahedra in a few bytes.
    let claims = with(&bytes_of(&sample(1, 1, 20)), b"BASE", |p| {
        p.splice(1..2, [0x80, 0x80, 0x80, 0x80, 0x08]);
    });
    assert!(matches!(decode(&claims), Err(FormatError::Limit { .. })));
    let mut roomy = Decoder::new(Limits { memory_bytes: u64::MAX, ..Limits::default() });
    assert!(matches!(roomy.feed(&claims), Err(FormatError::Corrupt { .. })));
}

proptest! {
    /// Behind good checksums anything may stand: no panic, and whatever is accepted is written as it was read.
    #[test]
    fn any_change_behind_good_checksums_is_refused_or_read_faithfully(
        kind in 0..3_usize,
        which in 0..4_usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let mut sections = sections(&bytes_of(&samples(2, 2, 600)[kind]));
        let payload = &mut sections[which].1;
        for (place, value) in &changes {
            let place = place.index(payload.len());
            payload[place] = *value;
        }
        if let Some(cut) = cut {
            payload.truncate(cut.index(payload.len()));
        }
        let bytes = assemble(&sections, 600);
        if let Ok(mt) = decode(&bytes) {
            prop_assert_eq!(decode(&bytes_of(&mt)), Ok(mt));
        }
    }

    #[test]
    fn noise_is_refused(noise in prop::collection::vec(any::<u8>(), 0..300)) {
        let mut decoder = Decoder::default();
        let fed = decoder.feed(&noise);
        prop_assert!(fed.is_err() || noise.len() < 8);
        let body = [format_support::header([1, 0], 0, 0), noise].concat();
        prop_assert!(decode(&body).is_err());
    }
}

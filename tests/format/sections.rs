//! Promise: files can grow. Unknown skippable sections and hint flags are passed over, unknown critical ones and
//! other versions are refused, and what is not an MT file is called so at its first byte.

use crate::support::files::{assemble, bytes_of, coded, decode, header, sample, section, sections, within};
use tetralod::format::{Decoder, FormatError, Limits};
use tetralod::mt::{BaseMeshError, PageError, UpdateError};

#[test]
fn unknown_skippable_sections_are_skipped_anywhere() {
    let mt = sample(2, 600);
    let good = sections(&bytes_of(&mt));
    let expected = Ok(coded(&mt));
    for place in 0..=good.len() {
        for payload in [vec![], vec![0xAB; 5], vec![7; 100_000]] {
            let mut sections = good.clone();
            sections.insert(place, (*b"xtra", payload));
            let bytes = assemble(&sections, 600);
            assert!(decode(&bytes) == expected, "at {place}");
            let mut decoder = Decoder::default();
            for piece in bytes.chunks(997) {
                decoder.feed(piece).expect("the same in pieces");
            }
            assert_eq!(decoder.finish(), Ok(()));
        }
    }
}

#[test]
fn skipped_sections_are_checked_but_not_kept() {
    let mt = sample(1, 20);
    let mut sections = sections(&bytes_of(&mt));
    sections.insert(1, (*b"xtra", vec![1; 50_000]));
    let mut bytes = assemble(&sections, 20);
    let mut decoder = within(Limits { section_bytes: 3_000, ..Limits::default() });
    assert!(decoder.feed(&bytes).is_ok(), "the limit is for what is kept");
    let place = 32 + 12 + sections[0].1.len() + 12 + 30_000;
    bytes[place] ^= 4;
    assert!(matches!(decode(&bytes), Err(FormatError::Corrupt { .. })));
}

#[test]
fn unknown_critical_sections_are_refused_where_they_stand() {
    let mut sections = sections(&bytes_of(&sample(1, 20)));
    let offset = 32 + sections[..5].iter().map(|(_, p)| 12 + p.len() as u64).sum::<u64>();
    sections.insert(5, (*b"UPDC", vec![1, 2, 3]));
    let mut decoder = Decoder::default();
    let error = decoder.feed(&assemble(&sections, 20)).expect_err("a section that must be known");
    assert!(matches!(error, FormatError::UnsupportedFeature { offset: o, .. } if o == offset), "{error:?}");
    assert!(decoder.mt().is_some(), "what came before is usable");
}

#[test]
fn versions_and_flags() {
    let bytes = bytes_of(&sample(1, 20));
    let with = |head: Vec<u8>| decode(&[&head, &bytes[32..]].concat());
    let total = bytes.len() as u64;
    assert!(with(header(2, 0, total)).is_ok());
    assert!(with(header(2, 0, 0)).is_ok(), "a writer need not know the size");
    assert!(with(header(2, 1 << 16, total)).is_ok(), "a hint");
    for found in [0, 1, 3, 257, u16::MAX] {
        let other = FormatError::UnsupportedVersion { found, supported: 2 };
        assert_eq!(with(header(found, 0, total)), Err(other));
    }
    let critical = with(header(2, 1 << 15, total));
    assert!(matches!(critical, Err(FormatError::UnsupportedFeature { offset: 12, .. })));
    for wrong in [total - 1, total + 1, 33] {
        let found = with(header(2, 0, wrong));
        assert!(matches!(found, Err(FormatError::Corrupt { .. })), "{wrong} of {total} bytes");
    }
}

#[test]
fn nothing_follows_the_end() {
    let bytes = [bytes_of(&sample(1, 20)), section(b"xtra", &[])].concat();
    assert!(matches!(decode(&bytes), Err(FormatError::Corrupt { .. })));
}

#[test]
fn other_files_are_called_so_at_once() {
    for start in ["<!DOCTYPE html>", "<", "\u{89}TLOD", "PK\x03\x04"] {
        assert_eq!(Decoder::default().feed(start.as_bytes()), Err(FormatError::NotMt), "{start}");
    }
    assert_eq!(Decoder::default().feed(b"\x89TLOD\n"), Err(FormatError::NotMt), "line ends were changed");
    assert_eq!(Decoder::default().finish(), Err(FormatError::Truncated { offset: 0 }));
}

#[test]
fn every_error_says_what_to_do() {
    let errors = [
        FormatError::NotMt,
        FormatError::UnsupportedVersion { found: 99, supported: 2 },
        FormatError::UnsupportedFeature { offset: 12, what: "a flag" },
        FormatError::Corrupt { offset: 99, what: "a number" },
        FormatError::Truncated { offset: 99 },
        FormatError::Limit { what: "one section", needed: 99, limit: 9 },
        FormatError::Field { name: "U99".into(), known: vec!["p".into()] },
        FormatError::Page(PageError::Present { page: 99 }),
        FormatError::Update(UpdateError::Star { update: 99 }),
        FormatError::Base(BaseMeshError::Tetrahedron(99)),
    ];
    for error in errors {
        let text = error.to_string();
        let remedy =
            ["give a file", "update tetralod", "fetch the file again", "raise the limit", "it has: "];
        assert!(remedy.iter().any(|r| text.contains(r)), "{text}");
        assert!(text.contains("99") || !format!("{error:?}").contains("99"), "{text}");
    }
}

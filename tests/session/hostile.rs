//! Promise: whatever a file with good checksums holds, a session gives valid meshes or typed errors, and ends.

use crate::support::files::{assemble, bytes_of, half_edge, header, overwrite, section, sections};
use crate::support::requests::requests;
use crate::support::strategies::config;
use proptest::prelude::*;
use std::sync::LazyLock;
use tetralod::format::{DecodeOptions, EncodeOptions, FormatError, encode};
use tetralod::mt::{MtKind, MultiTessellation};
use tetralod::session::{Session, SessionError};
use tetralod_build::{BuildConfig, build};
use tetralod_io::generate::by_name;

/// A small MT of vertex splits and one of vertex insertions, each with its number of updates.
static FILES: LazyLock<[(Vec<u8>, u32); 2]> = LazyLock::new(|| {
    let mesh = by_name("bucky", 8).expect("a size that is allowed");
    [MtKind::Edge, MtKind::Vertex].map(|kind| {
        let built = build(&mesh, &BuildConfig::of(kind));
        let mt = built.expect("a good mesh").mt;
        (encode(&mt, &EncodeOptions::default()).expect("a complete MT"), mt.updates())
    })
});

/// Runs all requests; a mesh that is given out must be valid. True if nothing was found to be wrong.
fn exercise(bytes: &[u8]) -> bool {
    let mut session = Session::new();
    let mut sound = session.feed(bytes).is_ok() & session.finish().is_ok();
    if session.info().is_none() {
        return false;
    }
    for request in requests() {
        match session.refine(&request) {
            Ok(stats) => assert_eq!(stats.tetrahedra as usize, session.view().tets.len()),
            Err(SessionError::Format(_)) => sound = false,
            Err(other) => panic!("the requests are good: {other}"),
        }
        session.mesh().expect("it is open").check().expect("a valid mesh");
        let surface = session.isosurface(0.3).expect("it is open");
        let points = surface.positions.len() as u32;
        assert!(surface.indices.iter().flatten().all(|&v| v < points));
    }
    sound
}

#[test]
fn the_files_themselves_are_sound() {
    for (bytes, updates) in &*FILES {
        assert!(*updates > 400 && exercise(bytes));
        assert_eq!(&assemble(&sections(bytes), *updates), bytes);
    }
}

/// The beginning of a section that claims to have so many bytes.
fn begun(kind: &[u8; 4], length: u32, content: &[u8]) -> Vec<u8> {
    [kind.as_slice(), &length.to_le_bytes(), &[0; 4], content].concat()
}

/// What a session in parts asks for does not grow with what a file claims, checked or not.
#[test]
fn claimed_lengths_are_asked_for_in_pieces() {
    let good = sections(&bytes_of(&half_edge(2, 1, 600)));
    let [(b"INFO", info), (b"INDX", index)] = [0, 1].map(|i| (&good[i].0, &good[i].1)) else {
        panic!("description and index come first");
    };
    // The number behind the first byte says what the blocks share.
    let old = 1 + index[1..].iter().position(|&byte| byte < 0x80).expect("the end of a number") + 1;
    let shares = |number: &[u8]| [&index[..1], number, &index[old..]].concat();
    let most = shares(&[0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x40]);
    let too_much = shares(&[0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 1]);
    let length = index.len() as u32 + 100;
    let cases = [
        ("much to skip", begun(b"xtra", u32::MAX, &[1; 100])),
        ("much to skip, of which nothing is here", begun(b"xtra", u32::MAX, &[])),
        ("an index of 256 MiB", begun(b"INDX", 256 << 20, index)),
        ("an index of which too little is here", begun(b"INDX", 256 << 20, &most[..4])),
        ("2^48 bytes behind the index", begun(b"INDX", length, &most)),
        ("the same, as good as checked", section(b"INDX", &most)),
        ("2^64 bytes behind the index", begun(b"INDX", length, &too_much)),
        ("blocks of no size", begun(b"INDX", length, &[0xFF; 20])),
    ];
    let opened = |bytes: &[u8]| {
        let mut session = Session::in_parts(DecodeOptions::default(), u64::MAX);
        session.take(&(0..1 << 16), bytes).map(|()| session)
    };
    let before = [header(2, 0, 0), section(b"INFO", info)].concat();
    for (what, claim) in cases {
        let bytes = [&before[..], &claim].concat();
        let mut session = opened(&bytes).expect("not enough to be wrong");
        let wanted = session.wanted();
        let range = &wanted[0].range;
        assert!(wanted.len() == 1 && range.start == bytes.len() as u64, "{what}: {wanted:?}");
        assert!(range.end > range.start && range.end - range.start <= 16 << 20, "{what}: {wanted:?}");
        let ended = session.take(range, &[]);
        assert_eq!(ended, Err(FormatError::Truncated { offset: range.start }), "{what}");
    }
    for length in [(256 << 20) + 1, u32::MAX] {
        let found = opened(&[&before[..], &begun(b"INDX", length, index)].concat()).map(|_| ());
        assert!(matches!(found, Err(FormatError::Limit { .. })), "{found:?}");
    }
    let found = opened(&[&before[..], &section(b"INDX", &too_much)].concat()).map(|_| ());
    assert!(matches!(found, Err(FormatError::Corrupt { .. })), "{found:?}");
}

proptest! {
    #![proptest_config(config(400, 47))]

    #[test]
    fn changes_behind_good_checksums(
        kind in 0..2_usize,
        which in any::<prop::sample::Index>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let (bytes, updates) = &FILES[kind];
        let mut sections = sections(bytes);
        let which = which.index(sections.len());
        let payload = &mut sections[which].1;
        overwrite(payload, &changes);
        exercise(&assemble(&sections, *updates));
    }

    /// Blocks alone: many of these decode and fail, if at all, in the mesh.
    #[test]
    fn flipped_low_bits_of_updates(
        kind in 0..2_usize,
        which in any::<prop::sample::Index>(),
        flips in prop::collection::vec((any::<prop::sample::Index>(), 0..7_u8), 1..4),
    ) {
        let (bytes, updates) = &FILES[kind];
        let mut sections = sections(bytes);
        let is_block = |section: &([u8; 4], Vec<u8>)| [*b"UPDT", *b"INSV"].contains(&section.0);
        let blocks: Vec<usize> = (0..sections.len()).filter(|&i| is_block(&sections[i])).collect();
        let which = blocks[which.index(blocks.len())];
        let payload = &mut sections[which].1;
        for (place, bit) in &flips {
            let place = place.index(payload.len());
            payload[place] ^= 1 << bit;
        }
        exercise(&assemble(&sections, *updates));
    }
}

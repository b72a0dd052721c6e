//! Promise: whatever a file with good checksums holds, a session gives valid meshes or typed errors, and ends.

use crate::support::files::{assemble, overwrite, sections};
use crate::support::requests::requests;
use crate::support::strategies::config;
use proptest::prelude::*;
use std::sync::LazyLock;
use tetralod::format::{EncodeOptions, encode};
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

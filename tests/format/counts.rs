//! Promise: files count as far as `docs/format.md` says, and a reader that cannot count so far refuses them.

use crate::reader;
use crate::support::files::{
    assemble, assemble_flagged, bytes_of, decode, encoded, field, half_edge, samples, sections, small_info,
};
use tetralod::format::{Decoder, EncodeOptions, FormatError};
use tetralod::mt::{MAX_UPDATES, MAX_VERTICES, Mt, MtKind, MultiTessellation, RegionInfo, Regions};

/// The flag of files that have more tetrahedra than 32 bits can count.
const MANY_TETS: u32 = 8;

/// Where `INFO` has the number of tetrahedra.
const TETS_AT: usize = 5;

/// The sections of a file, with another number of tetrahedra in as many bytes as `count` has.
fn with_tets<const N: usize>(bytes: &[u8], count: [u8; N]) -> Vec<([u8; 4], Vec<u8>)> {
    let mut sections = sections(bytes);
    let (kind, info) = &mut sections[0];
    assert_eq!(kind, b"INFO");
    drop(info.splice(TETS_AT..TETS_AT + 4, count));
    sections
}

#[test]
fn more_tetrahedra_than_32_bits_can_count_come_back() {
    for mt in samples(2, 300) {
        let bytes = bytes_of(&mt);
        for count in [1 << 32, (1 << 32) + 1, 6 * 1624_u64.pow(3), u64::MAX] {
            let many = assemble_flagged(MANY_TETS, &with_tets(&bytes, count.to_le_bytes()), 300);
            let found = decode(&many).expect("a good file");
            assert_eq!(found.info().tetrahedra, count);
            assert!(bytes_of(&found) == many, "and it is written so");
            assert_eq!(reader::open(&many).0.info.tetrahedra, count);
            // Nothing else depends on it.
            assert_eq!((found.info().vertices, found.updates()), (mt.info().vertices, mt.updates()));
            assert!(found.base() == mt.base());
        }
    }
}

#[test]
fn files_that_32_bits_can_count_are_as_they_were() {
    for mt in samples(2, 300) {
        let bytes = bytes_of(&mt);
        assert_eq!(bytes[12], 0, "no flag");
        let most = assemble(&with_tets(&bytes, [0xFF; 4]), 300);
        let found = decode(&most).expect("a good file");
        assert_eq!(found.info().tetrahedra, u64::from(u32::MAX));
        assert!(bytes_of(&found) == most);
    }
}

#[test]
fn a_number_and_the_flag_that_announces_it_go_together() {
    for mt in samples(1, 100) {
        let bytes = bytes_of(&mt);
        let many = with_tets(&bytes, (1_u64 << 32).to_le_bytes());
        // Where the flag is missing what follows is read from another place.
        assert!(decode(&assemble(&many, 100)).is_err());
        assert!(decode(&assemble_flagged(MANY_TETS, &sections(&bytes), 100)).is_err());
        let few = with_tets(&bytes, u64::from(u32::MAX).to_le_bytes());
        let refused = decode(&assemble_flagged(MANY_TETS, &few, 100)).expect_err("it does not need the flag");
        assert!(matches!(refused, FormatError::Corrupt { .. }), "{refused:?}");
        assert!(refused.to_string().contains("has 64 bits although 32 are enough"), "{refused}");
        // A reader that does not know the flag refuses the file by its header, as this one does the next flag.
        let refused = Decoder::default().feed(&assemble_flagged(2 * MANY_TETS, &many, 100)[..32]);
        assert!(matches!(refused, Err(FormatError::UnsupportedFeature { offset: 12, .. })), "{refused:?}");
    }
}

#[test]
fn a_region_can_have_more_tetrahedra_than_32_bits_can_count() {
    let Mt::HalfEdge(mut mt) = half_edge(2, 1, 100) else { panic!("a half-edge MT") };
    let region = |name: &str, tetrahedra: u64| RegionInfo {
        name: name.into(),
        labels: vec![tetrahedra as i64],
        tetrahedra,
        ..RegionInfo::default()
    };
    let regions = Regions {
        arrays: vec!["part".into()],
        all: vec![region("few", 3), region("many", 1 << 40)],
        of_base: vec![0, 1],
        ..Regions::default()
    };
    mt.set_regions(regions.clone()).expect("a region for each tetrahedron");
    let bytes = encoded(&mt, &EncodeOptions::default()).expect("a complete MT");
    let found = decode(&bytes).expect("a good file");
    assert_eq!(found.regions(), Some(&regions));
    let read = reader::open(&bytes).0.regions.expect("the section");
    assert_eq!(read.all.iter().map(|region| region.tetrahedra).collect::<Vec<_>>(), [3, 1 << 40]);
    let again = encoded(&found, &EncodeOptions::default()).expect("a complete MT");
    assert_eq!(decode(&again).expect("a good file").regions(), Some(&regions));
}

#[test]
fn vertices_and_updates_have_numbers_of_32_bits() {
    assert_eq!((MAX_VERTICES, MAX_UPDATES), (u32::MAX - 1, 1 << 30));
    let check = |kind: MtKind, vertices: u32, updates: u32| {
        let info = small_info(kind, 10, vec![field("f", 8)], [vertices, 1, updates]);
        info.check().map_err(|error| error.to_string())
    };
    for kind in [MtKind::Edge, MtKind::Vertex, MtKind::HalfEdge] {
        assert_eq!(check(kind, MAX_VERTICES, MAX_UPDATES), Ok(()));
        let said = check(kind, MAX_VERTICES + 1, 1).expect_err("a vertex without a number");
        assert!(said.ends_with("an MT has at most 2^32 - 2 vertices, and no more updates"), "{said}");
    }
    for kind in [MtKind::Edge, MtKind::Vertex] {
        let said = check(kind, MAX_VERTICES, MAX_UPDATES + 1).expect_err("too many updates");
        assert!(said.ends_with("an MT of this kind has at most 2^30 updates"), "{said}");
    }
    assert_eq!(check(MtKind::HalfEdge, MAX_VERTICES, MAX_VERTICES - 4), Ok(()));
    assert!(check(MtKind::HalfEdge, MAX_VERTICES, MAX_VERTICES + 1).is_err());
}

//! Promise: an index in pages says what one section does, from front to back and page by page; a page that is damaged, or not what the index
//! says of it, changes nothing.

use crate::reader;
use crate::support::files::{
    assemble_flagged, bytes_in_blocks, decode, half_edge, in_blocks, inserted, options, sections,
};
use tetralod::format::{DecodeOptions, Decoder, EncodeOptions, FormatError, Index, encode};
use tetralod::mt::{Mt, MtKind, UpdatePages};
use tetralod::session::Session;
use tetralod_build::{BuildConfig, build};
use tetralod_io::generate;

/// Pages of 2^2 blocks.
const PAGE_BITS: u32 = 2;

fn in_index_pages(mt: &Mt) -> Vec<u8> {
    let options = EncodeOptions { index_page_bits: Some(PAGE_BITS), ..options() };
    encode(&in_blocks(mt, 4), &options).expect("the MT is complete")
}

/// An MT of half-edge insertions with 19 blocks, so 5 pages.
fn sample() -> Mt {
    half_edge(2, 2, 300)
}

/// A file with these sections and flag 2.
fn assemble(sections: &[([u8; 4], Vec<u8>)], updates: u32) -> Vec<u8> {
    assemble_flagged(4, sections, updates)
}

/// A decoder that has what comes in front of the pages.
fn opened(bytes: &[u8]) -> Decoder {
    let mut decoder = Decoder::new(DecodeOptions { in_parts: true, ..DecodeOptions::default() });
    for byte in bytes {
        if decoder.takes_blocks() {
            break;
        }
        decoder.feed(&[*byte]).expect("a good file");
    }
    decoder
}

fn part(bytes: &[u8], range: std::ops::Range<u64>) -> &[u8] {
    &bytes[range.start as usize..range.end as usize]
}

/// The kind and the payload of each section of a file.
type Sections = Vec<([u8; 4], Vec<u8>)>;

#[test]
fn a_second_reader_finds_in_pages_what_is_in_one_section() {
    for fields in [1, 3] {
        let mt = half_edge(2, fields, 300);
        let [whole, paged] = [bytes_in_blocks(&mt, 4), in_index_pages(&mt)];
        let [(file, parts), (other, other_parts)] = [reader::open(&whole), reader::open(&paged)];
        let [index, pages] = [&file, &other].map(|file| file.index.as_ref().expect("an index"));
        assert_eq!(index.blocks, pages.blocks);
        assert!(index.pages.is_none() && pages.pages.as_ref().is_some_and(|pages| pages.all.len() == 5));
        assert!(reader::changes(&file, &parts) == reader::changes(&other, &other_parts));
        assert!(decode(&paged).expect("a good file") == decode(&whole).expect("a good file"));
        // The decoder reads the same of each block.
        let entries = |bytes: &[u8]| {
            let mut decoder = Decoder::default();
            decoder.feed(bytes).expect("a good file");
            let index = decoder.index().expect("an index");
            assert!(index.is_whole());
            (0..index.count()).map(|block| index.block(block).cloned()).collect::<Vec<_>>()
        };
        assert_eq!(entries(&whole), entries(&paged));
    }
}

#[test]
fn every_prefix_is_usable_and_every_cut_gives_the_same() {
    let (bytes, mut decoder) = (in_index_pages(&sample()), Decoder::default());
    let whole = decode(&bytes).expect("a good file");
    let (mut ready_at, mut steps, mut last) = (None, 0, 0);
    for (at, byte) in bytes[..bytes.len() - 1].iter().enumerate() {
        let progress = decoder.feed(&[*byte]).expect("a prefix is not damaged");
        assert_eq!(decoder.finish(), Err(FormatError::Truncated { offset: at as u64 + 1 }));
        ready_at = ready_at.or(progress.ready.then_some(at as u64 + 1));
        steps += u32::from(progress.updates != last);
        last = progress.updates;
        let mut session = Session::new();
        if progress.ready && at % 61 == 0 {
            session.feed(&bytes[..=at]).expect("a prefix is not damaged");
            assert!(session.mesh().is_some_and(|mesh| mesh.check().is_ok()));
            assert_eq!(session.mt().map(|mt| mt.present()), Some(progress.updates));
        }
    }
    assert_eq!((last, steps), (300, 19), "block by block");
    // The base mesh is there before any page.
    assert_eq!(ready_at, decoder.head_end());
    decoder.feed(&bytes[bytes.len() - 1..]).expect("the last byte");
    decoder.finish().expect("all of it");
    assert!(decoder.into_mt() == Some(whole));
}

#[test]
fn pages_and_blocks_come_in_any_order() {
    let bytes = in_index_pages(&sample());
    let whole = decode(&bytes).expect("a good file");
    let mut decoder = opened(&bytes);
    let pages = decoder.index().map_or(0, |index| index.pages().len() as u32);
    assert_eq!((pages, decoder.block_ranges(0), decoder.index_page_range(5)), (5, Vec::new(), None));
    for page in [3, 0, 4, 2, 1] {
        let range = decoder.index_page_range(page).expect("a page");
        assert_eq!(decoder.index_page_at(range.start), Some(page));
        decoder.take_index_page(page, part(&bytes, range.clone())).expect("a good page");
        assert!(decoder.take_index_page(page, part(&bytes, range)).is_err(), "it is there");
        let blocks = decoder.index().expect("an index").blocks_of(page);
        for block in blocks.clone().rev() {
            let [range] = &decoder.block_ranges(block)[..] else { panic!("all fields") };
            assert_eq!(decoder.block_at(range.start), Some(block));
            decoder.take_block(block, part(&bytes, range.clone())).expect("a good block");
        }
        assert!(!decoder.drop_index_page(page), "its blocks are here");
        if page == 4 {
            blocks.for_each(|block| decoder.drop_block(block).expect("it is here"));
            assert!(decoder.drop_index_page(page));
            assert!(decoder.block_ranges(18).is_empty() && !decoder.drop_index_page(9));
        }
    }
    let range = decoder.index_page_range(4).expect("a page");
    decoder.take_index_page(4, part(&bytes, range)).expect("a good page");
    for block in 16..19 {
        let range = decoder.block_ranges(block).swap_remove(0);
        decoder.take_block(block, part(&bytes, range)).expect("a good block");
    }
    assert!(decoder.into_mt() == Some(whole));
}

#[test]
fn a_damaged_page_changes_nothing() {
    let bytes = in_index_pages(&sample());
    let mut decoder = opened(&bytes);
    for page in 0..5 {
        let good = part(&bytes, decoder.index_page_range(page).expect("a page")).to_vec();
        for bit in 0..8 * good.len() {
            let mut damaged = good.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            let error = decoder.take_index_page(page, &damaged).expect_err("a damaged page");
            assert!(matches!(error, FormatError::Corrupt { .. }), "bit {bit}: {error:?}");
        }
        assert!((0..good.len()).all(|length| decoder.take_index_page(page, &good[..length]).is_err()));
        assert!(decoder.take_index_page(page, &[&good[..], &[0]].concat()).is_err());
        assert!(decoder.take_index_page((page + 1) % 5, &good).is_err(), "another page");
        assert!(decoder.index().is_some_and(|index| !index.pages()[page as usize].is_here()));
        decoder.take_index_page(page, &good).expect("the good one");
    }
}

#[test]
fn pages_with_good_checksums_are_not_trusted() {
    let good = sections(&in_index_pages(&sample()));
    let places: Vec<usize> = (0..good.len()).filter(|&at| &good[at].0 == b"IPAG").collect();
    assert!(decode(&assemble(&good, 300)).is_ok());
    let is_corrupt = |change: &dyn Fn(&mut Sections)| {
        let mut changed = good.clone();
        change(&mut changed);
        matches!(decode(&assemble(&changed, 300)), Err(FormatError::Corrupt { .. }))
    };
    let first = places[0];
    assert!(is_corrupt(&|all| drop(all.remove(first))), "a page too few");
    assert!(is_corrupt(&|all| all.insert(first, good[first].clone())), "a page too many");
    assert!(is_corrupt(&|all| all.swap(first, first + 1)), "pages out of order");
    assert!(is_corrupt(&|all| all.swap(places[4], places[4] + 1)), "a block in front of a page");
    assert!(is_corrupt(&|all| all.swap(first, first - 1)), "a page in front of the base mesh");
    // What is changed in a page does not agree with the list, or does not matter to whoever reads from front to back.
    let whole = decode(&assemble(&good, 300)).expect("a good file");
    let mut refused = 0;
    for at in (0..good[first].1.len()).chain([usize::MAX]) {
        let mut changed = good.clone();
        match changed[first].1.get_mut(at) {
            Some(byte) => *byte ^= 1,
            None => changed[first].1.push(0),
        }
        let found = decode(&assemble(&changed, 300));
        assert!(found.as_ref().map_or(true, |mt| *mt == whole), "byte {at} of a page");
        assert!(found.is_err() || (1..usize::MAX).contains(&at), "the number of a page, or a byte more");
        refused += u32::from(found.is_err());
    }
    assert!(refused > 20, "{refused}");
    let list = &good[1].1;
    assert_eq!(&good[1].0, b"INDX");
    for at in 4..list.len() {
        let mut changed = good.clone();
        changed[1].1[at] ^= 1;
        // Lengths of sections are for those who fetch them.
        let found = decode(&assemble(&changed, 300));
        assert!(found.is_err() || found.is_ok_and(|mt| mt.present() == 300), "byte {at} of the list");
    }
    // The flag without pages, pages without the flag, and other kinds.
    let in_one = sections(&bytes_in_blocks(&sample(), 4));
    assert!(decode(&assemble(&in_one, 300)).is_err());
    assert!(decode(&crate::support::files::assemble(&good, 300)).is_err());
    let other = sections(&bytes_in_blocks(&inserted(2, 2, 300), 4));
    assert!(matches!(decode(&assemble(&other, 300)), Err(FormatError::UnsupportedFeature { .. })));
}

/// The writer takes pages where the index is long, and they leave what is in front of the base mesh short.
#[test]
fn a_long_index_comes_in_pages() {
    let mesh = generate::bucky(17).expect("a size that is allowed");
    let config = BuildConfig { block_bits: 4, ..BuildConfig::of(MtKind::HalfEdge) };
    let mt = build(&mesh, &config).expect("a good mesh").mt;
    let written = |index_page_bits| {
        let options = EncodeOptions { index_page_bits, ..EncodeOptions::default() };
        let bytes = encode(&mt, &options).expect("complete");
        let mut decoder = Decoder::default();
        decoder.feed(&bytes).expect("a good file");
        let index: Index = decoder.index().expect("an index").clone();
        (bytes, index)
    };
    let (chosen, index) = written(None);
    assert!(
        !index.is_paged() && written(Some(u32::MAX)).0 == chosen,
        "the index of a small file is not in pages"
    );
    assert_eq!(chosen[12], 0, "and it has no flag");
    let (paged, index) = written(Some(3));
    assert!(index.is_paged() && paged[12] == 4);
    // Converted, it is as it was.
    let again = encode(&decode(&paged).expect("a good file"), &EncodeOptions::default()).expect("complete");
    assert!(again == chosen);
}

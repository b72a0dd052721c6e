//! Promise: the index of a half-edge file tells the truth, and is small; blocks come in any order, and make the MT that the stream
//! makes; one that is damaged changes nothing. Files of other kinds have neither index nor such blocks.

use crate::support::files::{
    assemble, bytes_in_blocks, coded, decode, half_edge, inserted, sample, sections,
};
use crate::support::random::Random;
use std::collections::BTreeSet;
use tetralod::format::{BlockInfo, DecodeOptions, Decoder, EncodeOptions, FormatError, encode};
use tetralod::mt::{
    Applied, ApplyUpdates, CurrentMesh, ExplicitMt, Mt, MultiTessellation, PageError, UpdateId, UpdatePages,
};

/// A decoder of blocks: it has what comes before the first one.
fn opened(bytes: &[u8], fields: &[&str]) -> Decoder {
    let fields = fields.iter().map(|&name| name.to_owned()).collect();
    let mut decoder = Decoder::new(DecodeOptions { fields, in_parts: true, ..DecodeOptions::default() });
    let mut at = 0;
    while decoder.mt().is_none() {
        decoder.feed(&bytes[at..=at]).expect("a good file");
        at += 1;
    }
    decoder
}

/// The bytes of a block, as a client puts them together.
fn block_bytes(decoder: &Decoder, bytes: &[u8], block: u32) -> Vec<u8> {
    let ranges = decoder.block_ranges(block);
    ranges.iter().flat_map(|range| &bytes[range.start as usize..range.end as usize]).copied().collect()
}

/// Every tetrahedron that an update of a block, or one that depends on it, removes or inserts lies within what the index tells of the block.
#[test]
fn the_index_tells_the_truth() {
    for fields in [1, 3] {
        let bytes = bytes_in_blocks(&half_edge(2, fields, 300), 4);
        let mut decoder = Decoder::default();
        decoder.feed(&bytes).expect("a good file");
        let index = decoder.index().expect("an index").clone();
        assert_eq!(index.count(), 19);
        let mt = decoder.mt().expect("a base mesh");
        let explicit = ExplicitMt::of(mt).expect("a valid MT");
        // The blocks of each update and of all that it depends on: all of them reach it.
        let mut reached_from: Vec<BTreeSet<usize>> = Vec::new();
        let mut mesh = mt.start().expect("a valid base mesh");
        mt.updates_arrived(&mut mesh, 0);
        for u in (0..mt.updates()).map(UpdateId) {
            let above = explicit.parents(u).iter().flat_map(|&p| reached_from[p as usize].clone());
            let blocks: BTreeSet<usize> = above.chain([u.0 as usize >> 4]).collect();
            let fit = |mesh: &CurrentMesh, tets: &[u32]| {
                let fits = |info: &BlockInfo, v: u32| {
                    let p = mesh.positions()[v as usize];
                    let mut levels = mesh.levels(v).iter().zip(&info.ranges);
                    (0..3).all(|i| info.bounds[0][i] <= p[i] && p[i] <= info.bounds[1][i])
                        && levels.all(|(level, range)| range[0] <= *level && *level <= range[1])
                };
                let mut vertices = tets.iter().filter_map(|&t| mesh.tet(t)).flatten();
                vertices
                    .all(|v| blocks.iter().all(|&block| fits(index.block(block as u32).expect("a block"), v)))
            };
            for &block in &blocks {
                let errors = index.errors(block as u32);
                assert!((0..errors.len()).all(|f| mt.error_of_field(u, f) <= errors[f]), "{u:?}");
            }
            let tets = mt.find_removed(&mut mesh, u).expect("a valid MT");
            assert!(fit(&mesh, &tets), "{u:?}");
            assert_eq!(mt.refine(&mut mesh, u), Ok(Applied::Done));
            let tets = mt.find_inserted(&mut mesh, u).expect("a valid MT");
            assert!(fit(&mesh, &tets), "{u:?}");
            reached_from.push(blocks);
        }
    }
}

#[test]
fn the_index_tells_where_blocks_are() {
    let bytes = bytes_in_blocks(&half_edge(2, 2, 300), 4);
    let decoder = opened(&bytes, &[]);
    let mut at = None;
    for block in 0..19 {
        let ranges = decoder.block_ranges(block);
        assert_eq!(ranges.len(), 1);
        assert!(at.is_none_or(|at| at == ranges[0].start));
        at = Some(ranges[0].end);
    }
    assert_eq!(at, Some(bytes.len() as u64 - 24), "the end follows");
    assert!(decoder.block_ranges(19).is_empty());
}

#[test]
fn header_and_index_are_small() {
    use tetralod_build::{BuildConfig, build};
    let mesh = tetralod_io::generate::bucky(33).expect("a size that is allowed");
    let config = BuildConfig { block_bits: 11, ..BuildConfig::default() };
    let built = build(&mesh, &config).expect("a good mesh");
    let bytes = encode(&built.mt, &EncodeOptions::default()).expect("complete");
    let sections = sections(&bytes);
    assert_eq!([sections[0].0, sections[1].0], [*b"INFO", *b"INDX"]);
    let head = 32 + 12 + sections[0].1.len() + 12 + sections[1].1.len();
    assert!(100 * head <= bytes.len(), "{head} of {} bytes", bytes.len());
}

#[test]
fn blocks_in_any_order_make_the_mt_of_the_stream() {
    let mt = half_edge(2, 2, 300);
    let bytes = bytes_in_blocks(&mt, 4);
    let mut whole = Decoder::default();
    whole.feed(&bytes).expect("a good file");
    for seed in 0..40 {
        let mut random = Random::new(seed);
        let mut decoder = opened(&bytes, &[]);
        let mut here = BTreeSet::new();
        while here.len() < 19 {
            let ready: Vec<u32> = (0..19).filter(|block| !here.contains(block)).collect();
            let block = ready[random.below(ready.len())];
            if random.once_in(3) {
                let gone = here.iter().copied().nth(random.below(here.len().max(1)));
                if let Some(gone) = gone {
                    decoder.drop_block(gone).expect("it is there");
                    here.remove(&gone);
                    continue;
                }
            }
            decoder.take_block(block, &block_bytes(&decoder, &bytes, block)).expect("a good block");
            here.insert(block);
        }
        assert!(decoder.into_mt().as_ref() == whole.mt());
    }
}

#[test]
fn a_block_that_comes_twice_or_is_not_there_is_refused() {
    let bytes = bytes_in_blocks(&half_edge(2, 1, 300), 4);
    let mut decoder = opened(&bytes, &[]);
    decoder.take_block(7, &block_bytes(&decoder, &bytes, 7)).expect("a good block");
    let before = decoder.mt().cloned();
    let again = decoder.take_block(7, &block_bytes(&decoder, &bytes, 7));
    assert!(matches!(again, Err(FormatError::Page(PageError::Present { page: 7 }))), "{again:?}");
    let beyond = decoder.take_block(19, &[]);
    assert!(matches!(beyond, Err(FormatError::Corrupt { .. })), "{beyond:?}");
    assert_eq!(decoder.drop_block(8), Err(PageError::Absent { page: 8 }));
    assert!(decoder.mt() == before.as_ref(), "nothing has changed");
}

#[test]
fn a_damaged_block_changes_nothing() {
    let bytes = bytes_in_blocks(&half_edge(1, 2, 60), 4);
    let mut decoder = opened(&bytes, &[]);
    for block in 0..4 {
        let good = block_bytes(&decoder, &bytes, block);
        let before = decoder.mt().cloned();
        for bit in 0..8 * good.len() {
            let mut damaged = good.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            let error = decoder.take_block(block, &damaged).expect_err("a damaged block");
            assert!(matches!(error, FormatError::Corrupt { .. }), "bit {bit}: {error:?}");
        }
        for length in 0..good.len() {
            assert!(decoder.take_block(block, &good[..length]).is_err());
        }
        assert!(decoder.take_block(block, &[&good[..], &[0]].concat()).is_err());
        assert!(decoder.take_block((block + 1) % 4, &good).is_err(), "another block");
        assert!(decoder.mt() == before.as_ref(), "nothing has changed");
        decoder.take_block(block, &good).expect("the good one");
    }
}

/// Levels and errors of all vertices by field, and where they are.
fn told(mt: &Mt, fields: &[usize]) -> Vec<([i32; 3], Vec<i32>)> {
    let mut mesh = mt.start().expect("a valid base mesh");
    mt.updates_arrived(&mut mesh, 0);
    for u in (0..mt.updates()).map(UpdateId) {
        assert_eq!(mt.refine(&mut mesh, u), Ok(Applied::Done));
    }
    let vertices = mesh.positions().iter().zip(0..);
    vertices.map(|(&p, v)| (p, fields.iter().map(|&f| mesh.levels(v)[f]).collect())).collect()
}

#[test]
fn some_fields_have_the_same_levels_as_all() {
    let mt = half_edge(2, 3, 300);
    let bytes = bytes_in_blocks(&mt, 4);
    let whole = coded(&mt);
    let name = |f: usize| mt.info().fields[f].name.as_str();
    for fields in [vec![0], vec![1], vec![0, 2], vec![2, 0]] {
        let names: Vec<&str> = fields.iter().map(|&f| name(f)).collect();
        let mut parts = opened(&bytes, &names);
        let mut stream = Decoder::new(DecodeOptions {
            fields: names.iter().map(|&name| name.to_owned()).collect(),
            ..DecodeOptions::default()
        });
        stream.feed(&bytes).expect("a good file");
        stream.finish().expect("all of it");
        let wanted = stream.wanted_fields().to_vec();
        assert_eq!(wanted.iter().copied().collect::<BTreeSet<_>>(), fields.iter().copied().collect());
        let mut fetched = 0;
        for block in 0..19 {
            let block_bytes = block_bytes(&parts, &bytes, block);
            fetched += block_bytes.len();
            parts.take_block(block, &block_bytes).expect("a good block");
        }
        assert!(fetched < bytes.len() * 9 / 10, "what is not wanted is not fetched");
        assert!(parts.mt() == stream.mt());
        let some = stream.into_mt().expect("a base mesh");
        assert_eq!(told(&some, &(0..wanted.len()).collect::<Vec<_>>()), told(&whole, &wanted));
        for u in (0..whole.updates()).map(UpdateId) {
            assert!(
                (0..).zip(&wanted).all(|(at, &f)| some.error_of_field(u, at) == whole.error_of_field(u, f))
            );
        }
    }
    let mut none = Decoder::new(DecodeOptions { fields: vec!["nothing".into()], ..DecodeOptions::default() });
    assert!(matches!(none.feed(&bytes), Err(FormatError::Field { .. })));
}

#[test]
fn other_kinds_have_neither_index_nor_blocks_to_take() {
    for mt in [sample(1, 60), inserted(1, 1, 60)] {
        let bytes = bytes_in_blocks(&mt, 4);
        let mut decoder = opened(&bytes, &[]);
        assert_eq!(decoder.info(), Some(mt.info()));
        assert!(!decoder.takes_blocks() && decoder.index().is_none() && decoder.block_ranges(0).is_empty());
        assert!(matches!(decoder.take_block(0, &[]), Err(FormatError::Corrupt { .. })));
        assert!(decoder.drop_block(0).is_err());
        // An index in such a file is out of place.
        let indexed = sections(&bytes_in_blocks(&half_edge(1, 1, 60), 4));
        let mut sections = sections(&bytes);
        sections.insert(1, indexed[1].clone());
        let refused = decode(&assemble(&sections, 60));
        assert!(matches!(refused, Err(FormatError::Corrupt { .. })), "{:?}", refused.err());
    }
}

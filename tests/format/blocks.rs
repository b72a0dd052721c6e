//! Promise: the index of a file tells the truth, and is small; blocks come in any order that keeps what they depend on, and
//! make the MT that the stream makes; one that is damaged changes nothing.

use crate::support::files::{bytes_in_blocks, coded, inserted, options, sample, samples, sections, spelled};
use crate::support::random::Random;
use std::collections::BTreeSet;
use tetralod::format::{DecodeOptions, Decoder, EncodeOptions, FormatError, encode};
use tetralod::mt::{
    Applied, ApplyUpdates, CurrentMesh, Mt, MtKind, MultiTessellation, PageError, UpdateId, UpdatePages,
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

fn parents(decoder: &Decoder, block: u32) -> Vec<u32> {
    decoder.index().map(|index| index.blocks[block as usize].parents.clone()).expect("an index")
}

/// Every tetrahedron that an update of a block removes or inserts lies within what the index tells of the block, and was
/// created in it or in a parent.
#[test]
fn the_index_tells_the_truth() {
    for mt in [sample(3, 300), spelled(2, 300), inserted(2, 2, 300)] {
        let bytes = bytes_in_blocks(&mt, 4);
        let mut decoder = Decoder::default();
        decoder.feed(&bytes).expect("a good file");
        let index = decoder.index().expect("an index").clone();
        assert_eq!(index.blocks.len(), 19);
        let mt = decoder.mt().expect("a base mesh");
        let mut mesh = mt.start().expect("a valid base mesh");
        mt.updates_arrived(&mut mesh, 0);
        for u in (0..mt.updates()).map(UpdateId) {
            let block = u.0 >> 4;
            let info = &index.blocks[block as usize];
            let largest = (0..mt.info().fields.len()).all(|f| mt.error_of_field(u, f) <= info.errors[f]);
            assert!(largest, "{u:?}");
            let mut tets = Vec::new();
            mt.find_removed(&mut mesh, u, &mut tets).expect("a valid MT");
            for creator in tets.iter().filter_map(|&t| mt.creator(&mesh, t)) {
                let other = creator.0 >> 4;
                assert!(other == block || info.parents.contains(&other), "{u:?} needs block {other}");
            }
            let inside = |mesh: &CurrentMesh, tets: &[u32]| {
                tets.iter().filter_map(|&t| mesh.tet(t)).flatten().all(|v| {
                    let p = mesh.positions()[v as usize];
                    let mut levels = mesh.levels(v).iter().zip(&info.ranges);
                    (0..3).all(|i| info.bounds[0][i] <= p[i] && p[i] <= info.bounds[1][i])
                        && levels.all(|(level, range)| range[0] <= *level && *level <= range[1])
                })
            };
            assert!(inside(&mesh, &tets), "{u:?}");
            assert_eq!(mt.refine(&mut mesh, u), Ok(Applied::Done));
            tets.clear();
            mt.find_inserted(&mut mesh, u, &mut tets).expect("a valid MT");
            assert!(inside(&mesh, &tets), "{u:?}");
        }
        for (at, info) in (0..).zip(&index.blocks) {
            assert!(info.parents.is_sorted() && info.parents.iter().all(|&parent| parent < at));
        }
    }
}

#[test]
fn the_index_tells_where_blocks_are() {
    for mt in samples(2, 300) {
        let bytes = bytes_in_blocks(&mt, 4);
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
}

#[test]
fn header_and_index_are_small() {
    use tetralod_build::{BuildConfig, build};
    let mesh = tetralod_io::generate::bucky(33).expect("a size that is allowed");
    let built = build(&mesh, &BuildConfig::of(MtKind::Edge)).expect("a good mesh");
    let bytes = encode(&built.mt, &EncodeOptions::default()).expect("complete");
    let sections = sections(&bytes);
    assert_eq!([sections[0].0, sections[1].0], [*b"INFO", *b"INDX"]);
    let head = 32 + 12 + sections[0].1.len() + 12 + sections[1].1.len();
    assert!(100 * head <= bytes.len(), "{head} of {} bytes", bytes.len());
}

#[test]
fn blocks_in_any_order_make_the_mt_of_the_stream() {
    let mt = sample(2, 300);
    let bytes = bytes_in_blocks(&mt, 4);
    let mut whole = Decoder::default();
    whole.feed(&bytes).expect("a good file");
    for seed in 0..40 {
        let mut random = Random::new(seed);
        let mut decoder = opened(&bytes, &[]);
        let mut here = BTreeSet::new();
        while here.len() < 19 {
            let ready = |block: &u32| {
                !here.contains(block) && parents(&decoder, *block).iter().all(|p| here.contains(p))
            };
            let ready: Vec<u32> = (0..19).filter(ready).collect();
            let block = ready[random.below(ready.len())];
            if random.once_in(3) {
                let gone = here.iter().copied().nth(random.below(here.len().max(1)));
                let free = |b: &u32| !here.iter().any(|other| parents(&decoder, *other).contains(b));
                if let Some(gone) = gone.filter(free) {
                    decoder.drop_block(gone).expect("nothing depends on it");
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

/// The blocks that a block depends on, directly or not.
fn ancestors(decoder: &Decoder, block: u32) -> Vec<u32> {
    let mut all = Vec::from_iter(parents(decoder, block));
    let mut at = 0;
    while at < all.len() {
        let more = parents(decoder, all[at]);
        all.extend(more);
        at += 1;
    }
    all
}

#[test]
fn a_block_before_its_parents_or_twice_is_refused() {
    let bytes = bytes_in_blocks(&sample(1, 300), 4);
    let mut decoder = opened(&bytes, &[]);
    // From the first block on, the index says what errors are to come.
    decoder.take_block(0, &block_bytes(&decoder, &bytes, 0)).expect("it depends on nothing");
    decoder.drop_block(0).expect("it is there");
    let before = decoder.mt().cloned();
    let mut refused = 0;
    for block in 0..19 {
        let vertices_from = decoder.take_block(block, &block_bytes(&decoder, &bytes, block));
        match vertices_from {
            Ok(()) => decoder.drop_block(block).expect("it is there"),
            Err(FormatError::Page(PageError::Needs { other, .. })) => {
                assert!(ancestors(&decoder, block).contains(&other));
                refused += 1;
            }
            // What the offset above is cannot be known without the block that has it.
            Err(FormatError::Corrupt { .. } | FormatError::Update(_)) => refused += 1,
            Err(error) => panic!("{error:?}"),
        }
        assert!(decoder.mt() == before.as_ref(), "block {block}");
    }
    assert!(refused > 0);
    decoder.take_block(0, &block_bytes(&decoder, &bytes, 0)).expect("it depends on nothing");
    let again = decoder.take_block(0, &block_bytes(&decoder, &bytes, 0));
    assert!(matches!(again, Err(FormatError::Page(PageError::Present { page: 0 }))), "{again:?}");
    let beyond = decoder.take_block(19, &[]);
    assert!(matches!(beyond, Err(FormatError::Corrupt { .. })), "{beyond:?}");
    assert!(decoder.drop_block(7).is_err());
}

#[test]
fn a_damaged_block_changes_nothing() {
    let bytes = bytes_in_blocks(&sample(2, 60), 4);
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
    let mt = sample(3, 300);
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
fn other_kinds_have_an_index_but_no_blocks_to_take() {
    let bytes = bytes_in_blocks(&spelled(1, 60), 4);
    let mut decoder = opened(&bytes, &[]);
    assert_eq!(decoder.info().map(|info| info.kind), Some(MtKind::Explicit));
    let block = block_bytes(&decoder, &bytes, 0);
    assert!(matches!(decoder.take_block(0, &block), Err(FormatError::Corrupt { .. })));
    assert!(decoder.drop_block(0).is_err());
    assert!(encode(&sample(1, 60), &options()).is_ok());
}

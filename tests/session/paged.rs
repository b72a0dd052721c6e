//! Promise: a file whose index is in pages gives the meshes that the same file with one index gives, for at most a round more, and what comes in front
//! of the first picture is short however long the file is. Pages go when memory is short.

use crate::support::files::{header, section, sections};
use crate::support::meshes::{bent, hilly, parted};
use crate::support::network::{Network, Protocol, Visitor};
use crate::support::random::Random;
use std::io::Cursor;
use std::ops::Range;
use std::sync::{Arc, LazyLock};
use std::time::Duration;
use tetralod::format::{BlockInfo, DecodeOptions, Decoder, EncodeOptions, Index, encode};
use tetralod::geom::{Bounds, Camera};
use tetralod::mt::{ErrorCode, Mt, MultiTessellation};
use tetralod::refine::{Criterion, Custom, Need, Region, Request, TetData, View};
use tetralod::session::{Client, Session};
use tetralod::stream::{FileSource, LoaderOptions};
use tetralod_build::{BuildConfig, build};
use tetralod_io::generate;

const NETWORK: Network = Network { latency_ms: 40.0, bytes_per_ms: 2500.0, protocol: Protocol::Http1 };

/// Pages of 2^3 blocks.
const PAGE_BITS: u32 = 3;

struct Files {
    whole: Vec<u8>,
    paged: Vec<u8>,
}

/// Both have a long description, so that no page comes with the first bytes that are asked for.
fn files(mt: &Mt) -> Files {
    let written = |index_page_bits| {
        let metadata = [("note".to_owned(), "a".repeat(62_000))].into();
        let options =
            EncodeOptions { index_page_bits, metadata, histograms: true, ..EncodeOptions::default() };
        encode(mt, &options).expect("a sound MT")
    };
    Files { whole: written(Some(u32::MAX)), paged: written(Some(PAGE_BITS)) }
}

/// Volumes in many blocks, one of them in regions.
static FILES: LazyLock<[(&str, Files); 2]> = LazyLock::new(|| {
    let config = BuildConfig { block_bits: 4, all_fields: true, ..BuildConfig::default() };
    let bucky =
        build(&generate::bucky(21).expect("a size that is allowed"), &config).expect("a valid mesh").mt;
    let config = BuildConfig { preserve: vec!["part".into()], ..config };
    let mut random = Random::new(11);
    let mut mesh = parted(15);
    for (value, p) in mesh.fields[0].values.iter_mut().zip(&mesh.positions) {
        *value = hilly(*p) + 0.05 * random.fraction();
    }
    [("bucky", files(&bucky)), ("parts", files(&build(&mesh, &config).expect("a valid mesh").mt))]
});

fn opened(file: &[u8]) -> Session {
    let mut session = Session::new();
    session.feed(file).expect("a sound file");
    session.finish().expect("all of it");
    session
}

fn requests(session: &Session) -> Vec<Request> {
    let bounds = session.bounds().expect("a file that is open");
    let fields = &session.info().expect("a file that is open").fields;
    let at = |part: f64| [0, 1, 2].map(|i| bounds.min[i] + part * (bounds.max[i] - bounds.min[i]));
    let inside = Bounds { min: at(0.3), max: at(0.55) };
    let corner = Bounds { min: at(0.0), max: at(0.1) };
    let last = fields.len() - 1;
    let value = |part: f64| fields[last].min + part * fields[last].range();
    let mut camera = Camera::home(&bounds, 1.5);
    camera.zoom(0.2);
    let view = View { matrix: camera.view_projection(1.5).to_cols_array(), viewport: [1200.0, 800.0] };
    let ball = Region::Sphere { centre: at(0.7), radius: 0.1 * bounds.diagonal() };
    let mut requests = vec![
        Request::within(0.3),
        Request::within(0.05),
        Need::within(0.0).inside(corner).into(),
        Need::within(0.01).inside(inside).into(),
        Need::within(0.0).around(last, &[value(0.5)]).into(),
        Need::within(0.0).around(last, &[value(0.3)]).inside(inside).into(),
        Need::seen(view, 1.0).into(),
        Request::within(0.1).and(Need::within(0.0).inside(ball)),
        Request::within(0.0).at_most(3000),
        Request::from(Need::within(0.0).around(last, &[value(0.5)])).at_most(2000),
        Need::within(0.02).of_field(0).into(),
        Request::within(0.0),
    ];
    if session.regions().is_some() {
        requests.push(Need::within(0.0).in_regions(vec![2]).into());
        requests.push(Need::within(0.01).in_regions(vec![0]).inside(inside).into());
    }
    requests
}

fn length(ranges: &[Range<u64>]) -> u64 {
    ranges.iter().map(|range| range.end - range.start).sum()
}

#[test]
fn meshes_are_those_of_the_whole_file_for_a_round_more_at_most() {
    for (name, Files { whole, paged }) in FILES.iter() {
        let (mut one, mut front_to_back) = (opened(whole), opened(paged));
        let [mut some, mut fewer_pages] = [0, 0];
        let of_index = front_to_back.decoder().index().expect("an index").pages().len() as u32;
        assert!(of_index > 20, "{name}: {of_index} pages");
        for request in requests(&one) {
            one.refine(&request).expect("a sensible request");
            front_to_back.refine(&request).expect("a sensible request");
            assert_eq!(one.hash(), front_to_back.hash(), "{name}: {request:?}");
            let visit = |file| {
                let mut visitor = Visitor::new(file, NETWORK, LoaderOptions::default());
                let first = visitor.open();
                assert!(first.rounds <= 2 && first.repeated == 0, "{first:?}");
                let cost = visitor.refine(&request).expect("a sensible request");
                assert_eq!(visitor.session.hash(), one.hash(), "{name}: {request:?}");
                let progress = visitor.session.block_progress();
                assert_eq!(
                    (progress.missed, progress.left_out, progress.absent),
                    (0, 0, 0),
                    "{name}: {request:?}"
                );
                assert!(visitor.stats.satisfied || request.budget != Default::default());
                assert!(cost.repeated == 0, "{name}: {request:?}, {cost:?}");
                (cost, progress)
            };
            let ((cost, before), (of_paged, progress)) = (visit(whole), visit(paged));
            assert!(of_paged.rounds <= cost.rounds + 1, "{name}: {request:?}: {cost:?}, {of_paged:?}");
            assert_eq!((before.index_pages, before.index_pages_here, progress.index_pages), (0, 0, of_index));
            // Under a budget, the mesh may have asked for others.
            if request.budget == Default::default() {
                assert_eq!(
                    (progress.here, progress.needed),
                    (before.here, before.needed),
                    "{name}: {request:?}"
                );
                some += 1;
            }
            fewer_pages += u32::from(progress.index_pages_here < of_index);
        }
        assert!(some > 8 && fewer_pages > 2, "{name}: {some}, {fewer_pages}");
    }
}

/// Without its pages a session states no less than what comes; with them it states just that.
#[test]
fn what_a_mesh_takes_is_stated() {
    for (name, Files { paged, .. }) in FILES.iter() {
        let curve = opened(paged).bytes_by_error(0);
        for point in [0, curve.len() / 2, curve.len() - 1].map(|at| curve[at]) {
            let options = LoaderOptions { gap: Some(0), ..LoaderOptions::default() };
            let mut visitor = Visitor::new(paged, NETWORK, options);
            let first = visitor.open();
            let stated = visitor.session.bytes_by_error(0);
            let stated = stated.iter().rfind(|other| other.error >= point.error).expect("an error");
            let request = Need::within(point.error).of_field(0).into();
            let bytes = first.bytes + visitor.refine(&request).expect("a sensible request").bytes;
            assert_eq!(bytes, point.bytes, "{name}: {point:?}");
            assert!(bytes <= stated.bytes, "{name}: {point:?}, {stated:?}");
        }
    }
}

/// One session for all requests, in random order: nothing comes twice, and no mesh depends on those before.
#[test]
fn one_request_after_the_other_gets_its_mesh() {
    for (name, Files { whole, paged }) in FILES.iter() {
        let (mut one, random) = (opened(whole), &mut Random::new(3));
        let all = requests(&one);
        let mut visitor =
            Visitor::new(paged, NETWORK, LoaderOptions { gap: Some(300), ..LoaderOptions::default() });
        let mut bytes = visitor.open().bytes;
        for _ in 0..20 {
            let request = &all[random.below(all.len())];
            one.refine(request).expect("a sensible request");
            let cost = visitor.refine(request).expect("a sensible request");
            bytes += cost.bytes;
            assert_eq!(visitor.session.hash(), one.hash(), "{name}: {request:?}");
            assert_eq!(
                (visitor.session.block_progress().missed, cost.repeated),
                (0, 0),
                "{name}: {request:?}"
            );
        }
        assert!(bytes <= paged.len() as u64);
        let (map, progress) = (visitor.session.block_map(), visitor.session.block_progress());
        assert!(map.len() <= progress.blocks as usize && progress.here > 0);
    }
}

/// What only a caller's function can tell shows as the mesh is refined.
#[test]
fn requests_of_the_callers_own_have_their_mesh_too() {
    let Files { whole, paged } = &FILES[0].1;
    let mut one = opened(whole);
    let half = (0.5 * f64::from(1_u32 << one.info().expect("it is open").lattice.bits)) as i32;
    let left = Custom::new(move |tet: &TetData<'_>| {
        let is_left = tet.corners.iter().any(|corner| corner[0] < half);
        if is_left { tet.error.error() / 0.01 } else { 0.0 }
    });
    let custom: [Arc<dyn Criterion>; 1] = [Arc::new(left)];
    one.request_with(&Request::within(0.3), &custom).expect("a sensible request");
    one.step(&mut |_| true).expect("a sound file");
    let mut visitor = Visitor::new(paged, NETWORK, LoaderOptions::default());
    visitor.open();
    visitor.refine_with(&Request::within(0.3), &custom).expect("a sensible request");
    assert_eq!((visitor.session.hash(), visitor.session.block_progress().missed), (one.hash(), 0));
}

#[test]
fn pages_go_when_memory_is_short() {
    for (name, Files { whole, paged }) in FILES.iter() {
        let (mut one, random) = (opened(whole), &mut Random::new(5));
        let all = requests(&one);
        let room = one.mt().map_or(0, |mt| mt.bytes()) / 2;
        let source = FileSource::new(Cursor::new(&paged[..])).expect("bytes");
        let mut client = Client::open(source, DecodeOptions::default(), room).expect("a sound file");
        let (mut complete, mut left_out, mut gone, mut pages_here) = (0, 0, 0, 0);
        for _ in 0..8 {
            let request = &all[random.below(all.len())];
            client.request(request).expect("a sensible request");
            let mut steps = 0;
            let stats = loop {
                while !client.fetch(Duration::from_secs(1)).expect("a sound file") {}
                let stats = client.step(Duration::ZERO, &mut |_| true).expect("a sound file");
                if client.is_complete(&stats) {
                    break stats;
                }
                steps += 1;
                let progress = client.session().block_progress();
                assert!(steps < 1500, "{name}: {request:?} comes to no end: {progress:?}");
            };
            let progress = client.session().block_progress();
            assert!(progress.bytes <= room + 160_000, "{name}: {progress:?}, {room}");
            assert_eq!(progress.missed, 0);
            client.session().mesh().expect("it is ready").check().expect("a valid mesh");
            if progress.left_out == 0 && request.budget == Default::default() {
                one.refine(request).expect("a sensible request");
                assert_eq!(client.session().hash(), one.hash(), "{name}: {request:?}");
                assert!(stats.satisfied);
                complete += 1;
            }
            left_out += u32::from(progress.left_out > 0);
            gone += u32::from(progress.index_pages_here < pages_here);
            pages_here = progress.index_pages_here;
        }
        println!("{name}: {complete}, {left_out}, {gone}");
        assert!(complete + left_out > 2, "{name}: {complete}, {left_out}, {gone}");
    }
}

/// What a session has needed is a part of the file that gives its mesh again; what needs more gets what there is.
#[test]
fn a_part_of_a_file_has_the_pages_that_it_needs() {
    let Files { whole, paged } = &FILES[0].1;
    let mut one = opened(whole);
    for request in requests(&one) {
        one.refine(&request).expect("a sensible request");
        let source = FileSource::new(Cursor::new(&paged[..])).expect("bytes");
        let mut client = Client::open(source, DecodeOptions::default(), u64::MAX).expect("a sound file");
        client.refine(&request).expect("a sensible request");
        let held = client.session().needed_bytes(u64::MAX);
        assert!(length(&held) <= paged.len() as u64);
        let part: Vec<u8> =
            held.iter().flat_map(|range| &paged[range.start as usize..range.end as usize]).copied().collect();
        let source = FileSource::of_part(Cursor::new(part), held, paged.len() as u64);
        let mut client =
            Client::open(source, DecodeOptions::default(), u64::MAX).expect("a part of a sound file");
        client.refine(&request).expect("a sensible request");
        assert_eq!(
            (client.session().hash(), client.session().block_progress().absent),
            (one.hash(), 0),
            "{request:?}"
        );
        let finest = client.refine(&Request::within(0.0)).expect("a sensible request");
        assert_eq!(finest.satisfied, client.session().block_progress().absent == 0, "{request:?}");
        client.session().mesh().expect("it is ready").check().expect("a valid mesh");
    }
}

/// A file with the head of a small one and an index of so many blocks, which are not there.
fn of_many_blocks(count: u32) -> (Vec<u8>, Index) {
    let config = BuildConfig { block_bits: 4, ..BuildConfig::default() };
    let mt = build(&bent(9), &config).expect("a valid mesh").mt;
    let small = encode(&mt, &EncodeOptions::default()).expect("a sound MT");
    let mut decoder = Decoder::default();
    decoder.feed(&small).expect("a good file");
    let mut info = decoder.info().expect("a description").clone();
    let base = info.vertices - info.updates;
    info.updates = 16 * count;
    info.vertices = base + info.updates;
    let mut all = sections(&small);
    for (at, number) in [(1, info.vertices), (5, 6 * info.updates), (9, info.updates)] {
        all[0].1[at..at + 4].copy_from_slice(&number.to_le_bytes());
    }
    let shift = info.lattice.bits.saturating_sub(8);
    let side = 1 << info.lattice.bits.min(8);
    let block = |j: u32| {
        // Level by level twice as many, each level along a curve.
        let level = (j + 1).ilog2();
        let place = (j + 1 - (1 << level)) as i32;
        let low = [place % side, (place / 7) % side, (place / 31) % side].map(|x| x / 16 * 16);
        let mut block = BlockInfo {
            lengths: vec![20_000 + j % 900, 3000 + j % 70],
            bounds: [low.map(|x| x << shift), low.map(|x| (x + 16) << shift)],
            errors: vec![ErrorCode(60_000 - 2500 * level as u16)],
            ranges: vec![[0, 1 << info.fields[0].bits]],
            regions: Vec::new(),
        };
        block.round();
        block
    };
    let mut index = Index::new(4, (0..count).map(block).collect()).as_written(&info, None);
    let page = |page: u32| {
        let mut bytes = Vec::new();
        index.write_page(&mut bytes, page, &info, false);
        section(b"IPAG", &bytes)
    };
    let pages: Vec<Vec<u8>> = (0..index.pages().len() as u32).map(page).collect();
    index.set_sections(pages.iter().map(|page| page.len() as u32));
    let shared: Vec<Vec<u8>> = all[2..]
        .iter()
        .take_while(|(kind, _)| kind != b"HALF")
        .map(|(kind, payload)| section(kind, payload))
        .collect();
    index.shared = shared.concat().len() as u64;
    let mut list = Vec::new();
    index.write(&mut list, &info);
    let front =
        [section(b"INFO", &all[0].1), section(b"INDX", &list), shared.concat(), pages.concat()].concat();
    let total = 32 + front.len() as u64 + index.end() - index.first_block();
    ([header(2, 4, total), front].concat(), index)
}

#[test]
fn what_comes_first_is_short_however_many_blocks_there_are() {
    let (file, index) = of_many_blocks(600_000);
    let mut session = Session::in_parts(DecodeOptions::default(), u64::MAX);
    let mut bytes = 0;
    while session.mesh().is_none() {
        let range = session.wanted().swap_remove(0).range;
        bytes += range.end - range.start;
        session.take(&range, &file[range.start as usize..range.end as usize]).expect("a sound file");
    }
    let of_pages = index.first_block();
    assert!(of_pages > 8 << 20, "{of_pages} bytes of pages");
    assert!(bytes <= 64 << 10, "{bytes} bytes before the first picture");
    let first = session.block_progress();
    assert!(first.bytes <= 2 << 20, "{first:?}");
    // A small part of the volume needs few of the pages, and asks for them at once.
    let bounds = session.bounds().expect("it is open");
    let corner = Bounds {
        min: bounds.min,
        max: [0, 1, 2].map(|k| bounds.min[k] + 0.02 * (bounds.max[k] - bounds.min[k])),
    };
    session.request(&Need::within(0.001).inside(corner).into()).expect("a sensible request");
    let wanted = session.wanted();
    let pages: Vec<Range<u64>> = wanted
        .into_iter()
        .map(|one| one.range)
        .filter(|range| session.decoder().index_page_at(range.start).is_some())
        .collect();
    assert!(!pages.is_empty() && length(&pages) < of_pages / 4, "{} of {of_pages}", length(&pages));
    for range in &pages {
        session.take(range, &file[range.start as usize..range.end as usize]).expect("a sound page");
    }
    let after = session.block_progress();
    let all: u64 = (0..index.pages().len() as u32).map(|page| index.page_bytes(page)).sum();
    println!(
        "{} pages, {} bytes of them; first picture after {bytes} bytes, index in memory {} bytes; a corner: {} pages, {} bytes, in memory {}; all {all}",
        index.pages().len(),
        of_pages,
        first.bytes,
        pages.len(),
        length(&pages),
        after.bytes
    );
    assert!(after.bytes < all / 3 && !session.wanted().is_empty());
}

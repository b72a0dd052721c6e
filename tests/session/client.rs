//! Promise: a client fetches what a request needs and no more, and its mesh is that of a session with the whole file.

use crate::support::random::Random;
use std::cell::Cell;
use std::io::Cursor;
use std::ops::Range;
use std::rc::Rc;
use std::time::Duration;
use tetralod::format::{DecodeOptions, EncodeOptions, FormatError, encode};
use tetralod::geom::Bounds;
use tetralod::mt::{MtKind, MultiTessellation, UpdatePages};
use tetralod::refine::{Need, Request};
use tetralod::session::{Client, ClientError, Session};
use tetralod::stream::{
    Action, Arrived, FileSource, Loader, LoaderOptions, RangeSource, ResponseHead, StreamError, WantedRange,
};
use tetralod_build::{BuildConfig, Construction, build};
use tetralod_io::generate;

const BLOCK_BITS: u32 = 6;

pub fn file(kind: MtKind) -> Vec<u8> {
    // More than a client reads at first.
    let mesh = generate::bucky(25).expect("a size that is allowed");
    let construction = Construction::default_for(kind);
    let config = BuildConfig { construction, block_bits: BLOCK_BITS, ..BuildConfig::of(MtKind::Edge) };
    let mt = build(&mesh, &config).expect("a valid mesh").mt;
    encode(&mt, &EncodeOptions::default()).expect("a sound MT")
}

/// Counts the bytes that a file gives.
struct Counted {
    file: FileSource<Cursor<Vec<u8>>>,
    given: Rc<Cell<u64>>,
}

impl Counted {
    fn new(file: &[u8]) -> (Self, Rc<Cell<u64>>) {
        let given = Rc::new(Cell::new(0));
        let file = FileSource::new(Cursor::new(file.to_vec())).expect("it can be read");
        (Self { file, given: Rc::clone(&given) }, given)
    }
}

impl RangeSource for Counted {
    fn want(&mut self, wanted: &[WantedRange]) {
        self.file.want(wanted);
    }

    fn next(&mut self, patience: Duration) -> Result<Option<Arrived>, StreamError> {
        let arrived = self.file.next(patience)?;
        self.given.set(self.given.get() + arrived.as_ref().map_or(0, |(_, bytes)| bytes.len() as u64));
        Ok(arrived)
    }

    fn total(&self) -> Option<u64> {
        self.file.total()
    }
}

pub fn requests() -> Vec<Request> {
    let mut random = Random(3);
    let mut requests = vec![Request::within(0.05)];
    for _ in 0..6 {
        let min = [0, 1, 2].map(|_| random.below(70) as f64 / 100.0);
        let corner = Bounds { min, max: min.map(|x| x + 0.25) };
        requests.push(Need::within(0.01).inside(corner).into());
        let value = 0.1 + random.below(80) as f64 / 100.0;
        requests.push(Need::within(0.005).around(0, &[value]).into());
    }
    requests.push(Request::within(0.0));
    requests
}

#[test]
fn meshes_and_bounds_are_those_of_the_whole_file() {
    for kind in MtKind::ALL {
        let file = file(kind);
        let mut whole = Session::new();
        whole.feed(&file).expect("a sound file");
        let (source, given) = Counted::new(&file);
        let mut client = Client::open(source, DecodeOptions::default(), u64::MAX).expect("a sound file");
        let first = given.get();
        assert!(!kind.is_paged() || first < file.len() as u64, "the base mesh is not the whole file");
        for request in requests() {
            let stats = client.refine(&request).expect("a sound file");
            let expected = whole.refine(&request).expect("a sound file");
            assert_eq!(client.session().hash(), whole.hash(), "{kind:?}: {request:?}");
            assert_eq!(stats.satisfied, expected.satisfied);
            assert!(!stats.missing, "all that it needs is here");
            client.session().mesh().expect("it is ready").check().expect("a valid mesh");
            // What has not come may have any error that its block may have.
            assert!(stats.error_bound >= expected.error_bound, "{kind:?}: {request:?}");
        }
        assert_eq!(client.session().fetched(), given.get());
        // But for the block of which the first request brought a part.
        let index = client.session().decoder().index();
        let blocks = index.into_iter().flat_map(|index| index.known());
        let largest = blocks.map(|(_, block)| block.len()).max().unwrap_or(0);
        assert!(given.get() <= file.len() as u64 + largest, "nothing is fetched twice: {}", given.get());
    }
}

#[test]
fn a_small_request_needs_a_part_of_the_file() {
    let file = file(MtKind::HalfEdge);
    let (source, given) = Counted::new(&file);
    let mut client = Client::open(source, DecodeOptions::default(), u64::MAX).expect("a sound file");
    let stats = client.refine(&Request::within(0.1)).expect("a sound file");
    assert!(stats.satisfied && stats.applied > 0);
    // Not half of it, for a client reads some 64 KiB at first.
    assert!(given.get() < file.len() as u64, "{} of {}", given.get(), file.len());
    assert_eq!(client.total(), Some(file.len() as u64));
    // Once more costs nothing.
    let before = given.get();
    client.refine(&Request::within(0.1)).expect("a sound file");
    assert_eq!(given.get(), before);
}

#[test]
fn steps_give_valid_meshes_on_the_way() {
    let file = file(MtKind::HalfEdge);
    let (source, _) = Counted::new(&file);
    let mut client = Client::open(source, DecodeOptions::default(), u64::MAX).expect("a sound file");
    client.request(&Request::within(0.0)).expect("a sensible request");
    let mut steps = 0;
    loop {
        let mut left = 200;
        let step = client.step(Duration::ZERO, &mut |_| {
            left -= 1;
            left > 0
        });
        client.session().mesh().expect("it is ready").check().expect("a valid mesh");
        steps += 1;
        if client.is_complete(&step.expect("a sound file")) {
            break;
        }
        assert!(steps < 1000, "it comes to an end");
    }
    let mut whole = Session::new();
    whole.feed(&file).expect("a sound file");
    whole.refine(&Request::within(0.0)).expect("a sound file");
    assert_eq!(client.session().hash(), whole.hash());
    assert!(steps > 3);
}

#[test]
fn blocks_stay_within_the_memory() {
    let file = file(MtKind::HalfEdge);
    let mut whole = Session::new();
    whole.feed(&file).expect("a sound file");
    let memory = whole.mt().map_or(0, MultiTessellation::bytes) * 2 / 3;
    let (source, _) = Counted::new(&file);
    let mut client = Client::open(source, DecodeOptions::default(), memory).expect("sound");
    let mut complete = 0;
    for request in requests() {
        client.refine(&request).expect("a sound file");
        client.session().mesh().expect("it is ready").check().expect("a valid mesh");
        let progress = client.session().block_progress();
        let pages = client.session().mt().map_or(0, UpdatePages::page_bytes);
        assert!(pages <= memory, "{pages} of {memory}");
        assert!(progress.bytes <= memory + 40_000, "what waits is compressed: {progress:?}");
        if progress.left_out == 0 {
            whole.refine(&request).expect("a sound file");
            assert_eq!(client.session().hash(), whole.hash(), "what fits is as good as the whole file");
            complete += 1;
        }
    }
    let last = client.session().block_progress();
    assert!(complete > 0 && last.left_out > 0, "both happen: {complete}, {last:?}");
}

#[test]
fn files_that_are_cut_or_damaged_are_told() {
    for kind in MtKind::ALL {
        let file = file(kind);
        let all = |bytes: &[u8]| {
            let (source, _) = Counted::new(bytes);
            let mut client = Client::open(source, DecodeOptions::default(), u64::MAX)?;
            client.refine(&Request::within(0.0)).map(drop)
        };
        assert_eq!(all(&file), Ok(()));
        for end in [0, 10, file.len() / 3, file.len() - 500] {
            let found = all(&file[..end]);
            let Err(ClientError::Format(FormatError::Truncated { offset })) = found else {
                panic!("{kind:?} {end}: {found:?}");
            };
            // Of half-edge files, ranges are asked for that may begin beyond the end.
            assert!(offset <= end as u64 || kind == MtKind::HalfEdge && offset < file.len() as u64);
        }
        let mut damaged = file.clone();
        damaged[file.len() / 2] ^= 1;
        assert!(matches!(all(&damaged), Err(ClientError::Format(FormatError::Corrupt { .. }))), "{kind:?}");
    }
}

#[test]
fn a_request_that_makes_no_sense_changes_nothing() {
    let file = file(MtKind::HalfEdge);
    let (source, _) = Counted::new(&file);
    let mut client = Client::open(source, DecodeOptions::default(), u64::MAX).expect("a sound file");
    client.refine(&Request::within(0.01)).expect("a sound file");
    let hash = client.session().hash();
    assert!(matches!(client.refine(&Request::within(-1.0)), Err(ClientError::Session(_))));
    assert_eq!(client.session().hash(), hash);
}

/// Answers all that `loader` asks for with bytes of `shards`, in pieces, until `session` waits for nothing more.
fn serve(session: &mut Session, loader: &mut Loader, shards: &[&[u8]]) -> Result<(), FormatError> {
    loop {
        session.supply(loader)?;
        let (id, shard, range) = match loader.next(0) {
            Some(Action::Fetch { id, shard, range, .. }) => (id, shard, range),
            Some(Action::Cancel { .. }) => continue,
            None => return Ok(()),
            other => panic!("{other:?}"),
        };
        let Some(file) = shards.get(shard as usize) else {
            loader.head(id, 0, &ResponseHead { status: 404, ..ResponseHead::default() });
            continue;
        };
        let total = file.len() as u64;
        if range.start >= total {
            loader.head(id, 0, &ResponseHead { status: 416, ..ResponseHead::default() });
            continue;
        }
        let end = range.end.min(total);
        let content_range = format!("bytes {}-{}/{total}", range.start, end - 1);
        let head =
            ResponseHead { status: 206, content_range: Some(&content_range), ..ResponseHead::default() };
        loader.head(id, 0, &head);
        for piece in file[range.start as usize..end as usize].chunks(1000) {
            loader.data(id, 0, piece);
        }
    }
}

#[test]
fn without_io_it_is_the_same_machine() {
    let file = file(MtKind::HalfEdge);
    let mut loader = Loader::new(LoaderOptions { gap: Some(64), ..LoaderOptions::default() });
    let mut session = Session::in_parts(DecodeOptions::default(), u64::MAX);
    serve(&mut session, &mut loader, &[&file]).expect("a sound file");
    assert!(session.mesh().is_some() && !session.is_waiting());
    let mut whole = Session::new();
    whole.feed(&file).expect("a sound file");
    for request in requests() {
        session.request(&request).expect("a sensible request");
        let mut stats = session.step(&mut |_| true).expect("a sound file");
        while !stats.done || session.is_waiting() {
            assert!(!stats.done || session.is_waiting(), "there is a reason to go on");
            serve(&mut session, &mut loader, &[&file]).expect("a sound file");
            stats = session.step(&mut |_| true).expect("a sound file");
        }
        let expected = whole.refine(&request).expect("a sound file");
        assert_eq!(session.hash(), whole.hash(), "{request:?}");
        assert_eq!((stats.satisfied, stats.missing), (expected.satisfied, false));
    }
    assert_eq!(loader.total(), Some(file.len() as u64));
    assert!(session.fetched() <= loader.traffic().received);
    // A file that was cut: told, and not asked for again and again.
    for end in [10, file.len() / 3, file.len() * 2 / 3] {
        let (mut loader, mut session) =
            (Loader::default(), Session::in_parts(DecodeOptions::default(), u64::MAX));
        let opened = serve(&mut session, &mut loader, &[&file[..end]]);
        let found = opened.and_then(|()| {
            if session.mesh().is_none() {
                return Ok(());
            }
            session.request(&Request::within(0.0)).expect("a sensible request");
            session.step(&mut |_| true).expect("a sound beginning");
            serve(&mut session, &mut loader, &[&file[..end]])
        });
        // The rest may be in shards, but is not.
        match loader.error() {
            Some(StreamError::MissingShard { suffix, from, total }) => {
                assert_eq!((&suffix[..], *from, *total), (".0001", end as u64, file.len() as u64));
            }
            _ => assert!(matches!(found, Err(FormatError::Truncated { .. })), "{end}: {found:?}"),
        }
    }
}

fn length(ranges: &[Range<u64>]) -> u64 {
    ranges.iter().map(|range| range.end - range.start).sum()
}

/// A client of a part of a file.
fn client_of_part(file: &[u8], whole: &Client<Counted>, most: u64) -> Client<FileSource<Cursor<Vec<u8>>>> {
    let needed = whole.session().needed_bytes(most);
    let bytes = Counted::new(file).0.read(&needed).expect("it is there");
    assert_eq!(bytes.len() as u64, length(&needed));
    let part = FileSource::of_part(Cursor::new(bytes), needed, file.len() as u64);
    Client::open(part, DecodeOptions::default(), u64::MAX).expect("a sound file")
}

#[test]
fn a_part_of_a_file_gives_the_mesh_that_it_was_cut_for_and_says_what_it_lacks() {
    for kind in MtKind::ALL {
        let file = file(kind);
        for request in requests() {
            let (source, _) = Counted::new(&file);
            let mut whole = Client::open(source, DecodeOptions::default(), u64::MAX).expect("a sound file");
            let stats = whole.refine(&request).expect("a good request");
            let mut part = client_of_part(&file, &whole, u64::MAX);
            let mut check = || {
                let again = part.refine(&request).expect("a good request");
                assert_eq!(part.session().hash(), whole.session().hash(), "{kind:?} {request:?}");
                assert_eq!((again.satisfied, again.error_bound), (true, stats.error_bound));
                assert_eq!(part.session().block_progress().absent, 0);
                // What is not there is no reason to wait.
                let finest = part.refine(&Request::within(0.0)).expect("a good request");
                assert!(!finest.missing && !part.session().is_waiting());
                assert!(finest.tetrahedra >= again.tetrahedra);
                assert_eq!(finest.satisfied, part.session().block_progress().absent == 0);
            };
            check();
            check();
        }
    }
}

#[test]
fn a_smaller_part_has_the_blocks_with_the_largest_errors() {
    let file = file(MtKind::HalfEdge);
    let (source, _) = Counted::new(&file);
    let mut whole = Client::open(source, DecodeOptions::default(), u64::MAX).expect("a sound file");
    let full = whole.refine(&Request::within(0.0)).expect("a good request");
    let head = length(&whole.session().needed_bytes(0));
    let all = length(&whole.session().needed_bytes(u64::MAX)) - head;
    let mut last = (0, f64::INFINITY);
    for part in [0, all / 8, all / 4, all / 2, all] {
        assert!(length(&whole.session().needed_bytes(part)) <= head + part);
        let mut client = client_of_part(&file, &whole, part);
        let stats = client.refine(&Request::within(0.0)).expect("a good request");
        assert!(stats.tetrahedra > last.0 && stats.error_bound <= last.1, "{part} of {all}: {stats:?}");
        let again = client.refine(&Request::within(1.01 * stats.error_bound)).expect("a good request");
        assert!(again.satisfied, "{part} of {all}");
        last = (stats.tetrahedra, stats.error_bound);
    }
    assert_eq!(last, (full.tetrahedra, full.error_bound));
}

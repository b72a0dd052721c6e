//! Sessions that keep only the blocks that their request needs: the mesh is that of a session with the whole file, memory
//! stays within the room, and bytes may come in any order.

use crate::support::random::Random;
use tetralod::format::{DecodeOptions, EncodeOptions, encode};
use tetralod::geom::Bounds;
use tetralod::mt::CurrentMesh;
use tetralod::refine::{Need, Request};
use tetralod::session::{BlockState, MappedBlock, Session};
use tetralod_build::{BuildConfig, build};
use tetralod_io::generate;

const BLOCK_BITS: u32 = 6;

/// A half-edge file: the kind whose blocks come one by one.
fn file(size: u32) -> Vec<u8> {
    let mesh = generate::bucky(size).expect("a size that is allowed");
    let config = BuildConfig { block_bits: BLOCK_BITS, ..BuildConfig::default() };
    let mt = build(&mesh, &config).expect("a valid mesh").mt;
    encode(&mt, &EncodeOptions::default()).expect("a sound MT")
}

/// A server: counts the bytes it gives.
struct Server<'a> {
    file: &'a [u8],
    given: u64,
}

impl Server<'_> {
    fn get(&mut self, range: std::ops::Range<u64>) -> Vec<u8> {
        let end = range.end.min(self.file.len() as u64);
        self.given += end - range.start;
        self.file[range.start as usize..end as usize].to_vec()
    }
}

fn check(mesh: &CurrentMesh) {
    mesh.check().expect("a valid mesh");
}

/// Fetches until nothing is wanted, in random order, refining in between. Whether the mesh is what was asked for.
fn settle(session: &mut Session, server: &mut Server<'_>, random: &mut Random, room: u64) -> bool {
    for _ in 0..10_000 {
        let mut wanted = session.wanted();
        if wanted.is_empty() && session.mesh().is_some() {
            // The mesh may show now what else it needs.
            let before = session.block_progress();
            session.step(&mut |_| true).expect("a sound file");
            wanted = session.wanted();
            if wanted.is_empty() && session.block_progress() != before {
                continue;
            }
        }
        let Some(chosen) = wanted.get(random.below(wanted.len().max(1))) else { break };
        let bytes = server.get(chosen.range.clone());
        session.take(&chosen.range, &bytes).expect("a sound file");
        assert!(session.block_progress().bytes <= room + 40_000, "what waits is compressed");
        if random.once_in(3) && session.mesh().is_some() {
            session.step(&mut |_| true).expect("a sound file");
            check(session.mesh().expect("it is ready"));
        }
    }
    let stats = session.step(&mut |_| true).expect("a sound file");
    check(session.mesh().expect("it is ready"));
    stats.satisfied
}

fn requests(random: &mut Random) -> Request {
    let at = |random: &mut Random| [0, 1, 2].map(|_| random.below(75) as f64 / 100.0);
    let error = [0.0, 0.002, 0.01, 0.05, 0.1, 0.2, 0.4][random.below(7)];
    match random.below(3) {
        0 => Request::within(error),
        1 => {
            let min = at(random);
            Request::from(Need::within(error).inside(Bounds { min, max: min.map(|x| x + 0.25) }))
        }
        _ => Request::from(Need::within(error).around(0, &[0.1 + random.below(80) as f64 / 100.0])),
    }
}

#[test]
fn the_mesh_is_that_of_the_whole_file() {
    let file = file(15);
    let random = &mut Random::new(7);
    let mut whole = Session::new();
    whole.feed(&file).expect("a sound file");
    for _ in 0..3 {
        let mut server = Server { file: &file, given: 0 };
        let mut session = Session::in_parts(DecodeOptions::default(), u64::MAX);
        settle(&mut session, &mut server, random, u64::MAX / 2);
        for _ in 0..12 {
            let request = requests(random);
            session.request(&request).expect("a sensible request");
            assert!(settle(&mut session, &mut server, random, u64::MAX / 2));
            whole.refine(&request).expect("a sensible request");
            assert_eq!(session.hash(), whole.hash(), "{request:?}");
            assert!(session.wanted().is_empty());
        }
        assert!(server.given <= file.len() as u64, "nothing is fetched twice while there is room");
    }
}

#[test]
fn memory_stays_within_the_room() {
    let file = file(15);
    let random = &mut Random::new(8);
    let mut whole = Session::new();
    whole.feed(&file).expect("a sound file");
    let all = whole.mt().map_or(0, tetralod::mt::MultiTessellation::bytes);
    let room = all / 3;
    let mut server = Server { file: &file, given: 0 };
    let mut session = Session::in_parts(DecodeOptions::default(), room);
    settle(&mut session, &mut server, random, room);
    let (mut complete, mut left_out) = (0, 0);
    for _ in 0..40 {
        let request = requests(random);
        session.request(&request).expect("a sensible request");
        let satisfied = settle(&mut session, &mut server, random, room);
        let progress = session.block_progress();
        assert!(progress.bytes <= room + 40_000);
        if progress.left_out == 0 {
            whole.refine(&request).expect("a sensible request");
            assert_eq!(session.hash(), whole.hash(), "what fits is as good as the whole file");
            assert!(satisfied, "{request:?}");
            complete += 1;
        } else {
            left_out += 1;
        }
    }
    assert!(complete > 3 && left_out > 3, "both happen: {complete}, {left_out}");
}

#[test]
fn the_map_of_blocks_tells_where_they_are_and_which_are_used() {
    // Larger than what is fetched at first.
    let file = file(26);
    let mut server = Server { file: &file, given: 0 };
    let mut session = Session::in_parts(DecodeOptions::default(), u64::MAX);
    assert!(session.block_map().is_empty(), "nothing is known before the index is here");
    let corner = Bounds { min: [0.0; 3], max: [0.3; 3] };
    let random = &mut Random::new(9);
    while session.info().is_none() {
        let head = session.wanted()[0].range.clone();
        let bytes = server.get(head.clone());
        session.take(&head, &bytes).expect("a sound file");
    }
    session.request(&Request::from(Need::within(0.1).inside(corner))).expect("a sensible request");
    assert!(settle(&mut session, &mut server, random, u64::MAX / 2));

    let (map, progress) = (session.block_map(), session.block_progress());
    let count = |state| map.iter().filter(|block| block.state == state).count();
    assert_eq!(map.len(), progress.blocks as usize);
    assert_eq!(count(BlockState::Missing), (progress.blocks - progress.here) as usize);
    assert!(count(BlockState::Missing) > 0, "not all is fetched");
    assert!(count(BlockState::InUse) > 0);
    let whole = session.info().expect("it is open").lattice;
    let largest = whole.point([1 << whole.bits; 3]);
    for block in &map {
        let Bounds { min, max } = block.bounds;
        for axis in 0..3 {
            assert!(whole.origin[axis] <= min[axis] && min[axis] < max[axis] && max[axis] <= largest[axis]);
        }
    }
    // The mesh uses blocks where the request is.
    let is_near = |bounds: &Bounds| bounds.min.iter().all(|&x| x <= corner.max[0]);
    assert!(map.iter().any(|block| block.state == BlockState::InUse && is_near(&block.bounds)));

    session.request(&Request::within(1.0)).expect("a sensible request");
    settle(&mut session, &mut server, random, u64::MAX / 2);
    let (before, map) = (map, session.block_map());
    let count = |map: &[MappedBlock], least| map.iter().filter(|block| block.state >= least).count();
    assert!(count(&map, BlockState::InUse) < count(&before, BlockState::InUse), "a coarser mesh uses less");
    assert_eq!(
        count(&map, BlockState::Here),
        count(&before, BlockState::Here),
        "there is room for what is here"
    );
}

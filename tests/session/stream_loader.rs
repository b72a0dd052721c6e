//! Promise: whatever a server does, the loader hands out bytes of the file or a typed error, asks for no byte twice
//! while it holds it, keeps to its number of requests, and never waits for ever.

use crate::support::random::Random;
use crate::support::strategies::config;
use proptest::prelude::*;
use std::ops::Range;
use tetralod::stream::{Action, Failure, Loader, LoaderOptions, ResponseHead, StreamError, WantedRange};

const SIZE: u64 = 3000;

fn byte(at: u64) -> u8 {
    (at.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 56) as u8
}

fn bytes(range: Range<u64>) -> Vec<u8> {
    (range.start.min(SIZE)..range.end.min(SIZE)).map(byte).collect()
}

fn wanted(range: Range<u64>, priority: f32) -> WantedRange {
    WantedRange { range, priority }
}

fn small() -> LoaderOptions {
    LoaderOptions {
        max_requests: 3,
        gap: Some(20),
        spare_bytes: 0,
        max_request_bytes: 300,
        ..LoaderOptions::default()
    }
}

/// What to answer to a request.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    Nothing,
    /// A part of the range that ends too early, and says so.
    Short,
    Whole,
    WholeOfUnknownLength,
    Status(u16),
    /// Another range than was asked for.
    Wrong,
    /// The connection is cut after so many thousandths.
    Cut(u64),
    /// The body ends after so many thousandths, as if that were all.
    Truncated(u64),
    Refused,
    Silent,
}

/// A request as the server sees it.
struct Open {
    id: u32,
    asked: Range<u64>,
    fault: Fault,
    /// What is still to be sent, once the head has been.
    body: Option<Range<u64>>,
    stop: u64,
}

/// A loader, a server with faults, and a clock.
struct World {
    loader: Loader,
    options: LoaderOptions,
    random: Random,
    now: u64,
    open: Vec<Open>,
    pending: Vec<Range<u64>>,
    /// Bytes that the loader must hold.
    held: Vec<bool>,
    asked: u64,
}

impl World {
    fn new(seed: u64, options: LoaderOptions) -> Self {
        let (random, held) = (Random(seed), vec![false; SIZE as usize]);
        Self {
            loader: Loader::new(options),
            options,
            random,
            now: 0,
            open: Vec::new(),
            pending: Vec::new(),
            held,
            asked: 0,
        }
    }

    fn want_something(&mut self) {
        let count = self.random.below(12);
        let mut list: Vec<WantedRange> = (0..count)
            .map(|_| {
                let start = self.random.below(SIZE as usize + 50) as u64;
                let length = self.random.below([1, 30, 400, 4000][self.random.clone().below(4)]) as u64;
                wanted(start..start + length, self.random.below(4) as f32)
            })
            .collect();
        // Often a part of the old list stays.
        list.extend(self.pending.iter().filter(|_| !self.random.once_in(3)).map(|r| wanted(r.clone(), 1.0)));
        self.loader.want(&list);
        self.pending = list.into_iter().map(|wanted| wanted.range).collect();
        let cached: Vec<_> = self.pending.clone().into_iter().filter(|_| self.random.once_in(5)).collect();
        self.loader.add_cached(&cached);
        self.take();
        self.forget();
    }

    /// Nothing needs to be held that is not wanted.
    fn forget(&mut self) {
        for (at, held) in self.held.iter_mut().enumerate() {
            *held &= self.pending.iter().any(|range| range.contains(&(at as u64)));
        }
    }

    fn take(&mut self) {
        while let Some((range, got)) = self.loader.take() {
            assert!(self.pending.contains(&range), "{range:?} was not wanted, or came twice");
            assert_eq!(got, bytes(range.clone()), "{range:?}");
            self.pending.retain(|wanted| *wanted != range);
        }
        self.forget();
    }

    /// Does what the loader says until it has to wait.
    fn obey(&mut self, faults: &[Fault]) -> Option<u64> {
        for _ in 0..100 {
            match self.loader.next(self.now) {
                None => return None,
                Some(Action::Wait { until_ms }) => {
                    assert!(until_ms > self.now, "waiting takes time");
                    return Some(until_ms);
                }
                Some(Action::Cancel { id }) => self.open.retain(|open| open.id != id),
                Some(Action::Fetch { id, range, .. }) => self.accept(id, range, faults),
                Some(Action::Read { range }) => self.read(&range),
            }
        }
        panic!("the loader has always something to do");
    }

    /// A cache has a range, or has lost it.
    fn read(&mut self, range: &Range<u64>) {
        assert!(self.pending.contains(range), "{range:?} was not wanted");
        if self.random.once_in(3) {
            self.loader.lost(range);
        } else {
            self.loader.put(range, &bytes(range.clone()));
            self.take();
        }
    }

    fn accept(&mut self, id: u32, asked: Range<u64>, faults: &[Fault]) {
        assert!(asked.start < asked.end && !self.pending.is_empty());
        assert!(self.open.len() < self.options.max_requests, "too many requests");
        if self.loader.serves_ranges() != Some(false) {
            assert!(asked.end - asked.start <= self.options.max_request_bytes);
            let twice = asked.clone().find(|at| self.held.get(*at as usize) == Some(&true));
            assert_eq!(twice, None, "asked for again in {asked:?}, though held");
            let other = |open: &&Open| open.asked.start < asked.end && asked.start < open.asked.end;
            let other = self.open.iter().filter(|open| open.body.is_none()).find(other);
            assert!(other.is_none(), "{asked:?} is on its way");
        }
        let fault = faults[self.random.below(faults.len())];
        self.open.push(Open { id, asked, fault, body: None, stop: 0 });
        self.asked += 1;
    }

    /// One thing happens on one of the connections.
    fn happen(&mut self) {
        if self.open.is_empty() {
            return;
        }
        let at = self.random.below(self.open.len());
        let open = &mut self.open[at];
        let (id, now) = (open.id, self.now);
        let Some(body) = open.body.clone() else {
            if !self.answer(at) {
                self.open.retain(|open| open.id != id);
            }
            return;
        };
        if body.start < open.stop {
            let length = 1 + self.random.below(150) as u64;
            let chunk = body.start..(body.start + length).min(open.stop);
            open.body = Some(chunk.end..body.end);
            for at in chunk.clone() {
                self.held[at as usize] |= self.pending.iter().any(|range| range.contains(&at));
            }
            let done = chunk.end == body.end;
            self.loader.data(id, now, &bytes(chunk));
            self.take();
            if done {
                self.open.remove(at);
                self.loader.end(id, now);
                self.take();
            }
            return;
        }
        let fault = open.fault;
        self.open.remove(at);
        match fault {
            Fault::Cut(_) => self.loader.failed(id, now, Failure::Network("cut".to_owned())),
            _ => self.loader.end(id, now),
        }
        self.take();
    }

    /// Sends a head, or does not; false if nothing follows.
    fn answer(&mut self, at: usize) -> bool {
        let open = &mut self.open[at];
        let (id, now, asked) = (open.id, self.now, open.asked.clone());
        let part = |range: &Range<u64>| format!("bytes {}-{}/{SIZE}", range.start, range.end - 1);
        let tagged =
            ResponseHead { etag: Some("\"one\""), last_modified: Some("then"), ..ResponseHead::default() };
        let mut range = asked.start..asked.end.min(SIZE);
        match open.fault {
            Fault::Silent => return true,
            Fault::Refused => {
                self.loader.failed(id, now, Failure::Network("refused".to_owned()));
                return false;
            }
            Fault::Status(status) => {
                self.loader.head(id, now, &ResponseHead { status, ..ResponseHead::default() });
                return false;
            }
            Fault::Whole | Fault::WholeOfUnknownLength => {
                let content_length = (open.fault == Fault::Whole).then_some(SIZE);
                (open.body, open.stop) = (Some(0..SIZE), SIZE);
                self.loader.head(id, now, &ResponseHead { status: 200, content_length, ..tagged });
                self.take();
                return true;
            }
            _ if range.start >= SIZE => {
                let content_range = format!("bytes */{SIZE}");
                let head = ResponseHead { status: 416, content_range: Some(&content_range), ..tagged };
                self.loader.head(id, now, &head);
                self.take();
                return false;
            }
            Fault::Wrong => range = range.start + 1..range.end + 1,
            Fault::Short => range.end = range.start + (range.end - range.start).div_ceil(2),
            _ => {}
        }
        let length = range.end - range.start;
        open.stop = range.start
            + match open.fault {
                Fault::Cut(part) | Fault::Truncated(part) => length * part / 1000,
                _ => length,
            };
        open.body = Some(range.clone());
        let content_range = part(&range);
        let head = ResponseHead {
            status: 206,
            content_range: Some(&content_range),
            content_length: Some(range.end - range.start),
            ..tagged
        };
        if open.fault == Fault::Wrong {
            self.open.remove(at);
        }
        self.loader.head(id, now, &head);
        self.take();
        true
    }

    /// Lets things happen until the loader has all, or gives up.
    fn settle(&mut self, faults: &[Fault]) -> Result<(), StreamError> {
        for _ in 0..100_000 {
            let until = self.obey(faults);
            if let Some(error) = self.loader.error() {
                return Err(error.clone());
            }
            let Some(until) = until else {
                assert!(self.loader.is_idle() && self.pending.is_empty(), "{:?} never came", self.pending);
                assert!(self.open.is_empty() && self.loader.held_bytes() == 0);
                return Ok(());
            };
            let lively = self.open.iter().any(|open| open.fault != Fault::Silent);
            if lively {
                self.happen();
                self.now += self.random.below(20) as u64;
            } else {
                self.now = until;
            }
        }
        panic!("it goes on for ever");
    }
}

const FAULTS: [Fault; 12] = [
    Fault::Nothing,
    Fault::Nothing,
    Fault::Short,
    Fault::Whole,
    Fault::WholeOfUnknownLength,
    Fault::Status(500),
    Fault::Status(429),
    Fault::Wrong,
    Fault::Cut(300),
    Fault::Truncated(900),
    Fault::Refused,
    Fault::Silent,
];

proptest! {
    #![proptest_config(config(400, 59))]

    #[test]
    fn everything_wanted_comes_when_the_server_recovers(
        seed: u64,
        max_requests in 1usize..5,
        gap in 0u64..60,
        max_request_bytes in 1u64..900,
        chosen in prop::collection::vec(0..FAULTS.len(), 1..5),
    ) {
        let limits = LoaderOptions { max_requests, gap: Some(gap), max_request_bytes, seed, ..LoaderOptions::default() };
        let options = LoaderOptions { spare_bytes: 0, ..limits };
        let mut world = World::new(seed, options);
        let faults: Vec<Fault> = chosen.into_iter().map(|at| FAULTS[at]).collect();
        for _ in 0..6 {
            world.want_something();
            for _ in 0..world.random.below(40) {
                let until = world.obey(&faults);
                world.loader.retry();
                if world.random.once_in(4) {
                    world.now = until.unwrap_or(world.now);
                }
                world.happen();
            }
        }
        world.loader.retry();
        for open in &mut world.open {
            if open.body.is_none() {
                open.fault = Fault::Nothing;
            }
        }
        while world.settle(&[Fault::Nothing]).is_err() {
            // From the time before: the last of its failures.
            world.loader.retry();
        }
        let Some(_) = world.loader.total() else { return Ok(()) };
        prop_assert_eq!(world.loader.total(), Some(SIZE));
    }

    #[test]
    fn a_server_that_never_recovers_is_given_up_after_a_bounded_number_of_requests(
        seed: u64,
        chosen in prop::collection::vec(5..FAULTS.len(), 1..5),
    ) {
        let mut world = World::new(seed, small());
        let faults: Vec<Fault> = chosen.into_iter().map(|at| FAULTS[at]).collect();
        for start in [0, 700, 2000] {
            world.pending.push(start..start + 500);
        }
        let list: Vec<_> = world.pending.iter().map(|range| wanted(range.clone(), 0.0)).collect();
        world.loader.want(&list);
        match world.settle(&faults) {
            Ok(()) => {}
            Err(error) => prop_assert!(error.may_pass(), "{error}"),
        }
        // Each of some pieces fails six times, and gets on by an eighth before it does.
        prop_assert!(world.asked < 400, "{} requests", world.asked);
    }
}

/// All that the loader wants done now, without the waiting.
fn actions(loader: &mut Loader, now: u64) -> Vec<Action> {
    let mut actions = Vec::new();
    while let Some(action) = loader.next(now) {
        if let Action::Wait { .. } = action {
            break;
        }
        actions.push(action);
    }
    actions
}

fn fetches(loader: &mut Loader, now: u64) -> Vec<(u32, Range<u64>)> {
    let fetch = |action| match action {
        Action::Fetch { id, range, .. } => (id, range),
        other => panic!("{other:?}"),
    };
    actions(loader, now).into_iter().map(fetch).collect()
}

const GOOD: ResponseHead = ResponseHead {
    status: 206,
    content_range: None,
    content_length: None,
    content_encoding: None,
    decoded: false,
    content_type: None,
    etag: Some("\"one\""),
    last_modified: None,
    retry_after_seconds: None,
};

/// A loader of whose server it is known that it gives ranges.
fn open(options: LoaderOptions) -> Loader {
    let mut loader = Loader::new(options);
    loader.want(&[wanted(0..10, 0.0), wanted(500..510, -1.0)]);
    let first = fetches(&mut loader, 0);
    assert_eq!(first, [(1, 0..10)], "one request, until it is known what the server does");
    loader.head(1, 0, &ResponseHead { content_range: Some("bytes 0-9/3000"), ..GOOD });
    loader.data(1, 0, &bytes(0..10));
    loader.want(&[]);
    assert_eq!(loader.take(), Some((0..10, bytes(0..10))));
    loader
}

#[test]
fn neighbours_are_fetched_together_the_most_important_first() {
    let mut loader = open(small());
    loader.want(&[
        wanted(100..150, 0.0),
        wanted(150..200, 0.0),
        wanted(215..220, 0.0),
        wanted(1000..1100, 5.0),
    ]);
    assert_eq!(fetches(&mut loader, 0), [(2, 1000..1100), (3, 100..220)]);
    let mut loader = open(small());
    // Longer than a request may be; one byte further than the gap may be.
    loader.want(&[wanted(100..500, 1.0), wanted(521..530, 0.0)]);
    assert_eq!(fetches(&mut loader, 0), [(2, 100..400), (3, 400..500), (4, 521..530)]);
}

#[test]
fn what_nobody_wants_any_more_is_cancelled_and_the_rest_is_not() {
    let mut loader = open(small());
    loader.want(&[wanted(100..200, 1.0), wanted(1000..1100, 0.0)]);
    assert_eq!(fetches(&mut loader, 0).len(), 2);
    loader.want(&[wanted(150..160, 1.0)]);
    assert_eq!(actions(&mut loader, 1), [Action::Cancel { id: 3 }]);
    loader.head(2, 1, &ResponseHead { content_range: Some("bytes 100-199/3000"), ..GOOD });
    loader.data(2, 1, &bytes(100..170));
    assert_eq!(loader.take(), Some((150..160, bytes(150..160))));
    assert_eq!(actions(&mut loader, 1), [Action::Cancel { id: 2 }]);
    assert_eq!((loader.next(1), loader.held_bytes()), (None, 0));
}

#[test]
fn a_cut_connection_is_taken_up_where_it_ended() {
    let mut loader = open(small());
    loader.want(&[wanted(100..300, 0.0)]);
    assert_eq!(fetches(&mut loader, 0), [(2, 100..300)]);
    loader.head(2, 0, &ResponseHead { content_range: Some("bytes 100-299/3000"), ..GOOD });
    loader.data(2, 0, &bytes(100..180));
    loader.failed(2, 0, Failure::Network("cut".to_owned()));
    let tagged = Some("\"one\"".to_owned());
    assert_eq!(
        actions(&mut loader, 0),
        [Action::Fetch { id: 3, shard: 0, range: 180..300, if_match: tagged }]
    );
    loader.head(3, 0, &GOOD);
    loader.data(3, 0, &bytes(180..300));
    assert_eq!(loader.take(), Some((100..300, bytes(100..300))));
}

#[test]
fn tries_get_rarer_and_end() {
    for failure in [Failure::Network("refused".to_owned()), Failure::Timeout] {
        let options = LoaderOptions { retries: 4, ..LoaderOptions::default() };
        let mut loader = Loader::new(options);
        loader.want(&[wanted(0..10, 0.0)]);
        let (mut now, mut waits) = (0, Vec::new());
        loop {
            match loader.next(now) {
                None => break,
                Some(Action::Wait { until_ms }) => {
                    waits.push(until_ms - now);
                    now = until_ms;
                }
                Some(Action::Fetch { id, .. }) => loader.failed(id, now, failure.clone()),
                Some(Action::Cancel { .. }) => {}
                Some(Action::Read { .. }) => panic!("there is no cache"),
            }
        }
        assert_eq!(waits.len(), 4);
        for (k, wait) in waits.iter().enumerate() {
            let longest = 500 << k;
            assert!((longest / 2..=longest).contains(wait), "{waits:?}");
        }
        assert_eq!(loader.traffic().requests, 5);
        assert!(loader.error().is_some_and(StreamError::may_pass));
        loader.retry();
        assert_eq!(fetches(&mut loader, now), [(6, 0..10)]);
    }
}

#[test]
fn what_a_cache_has_is_read_from_there_and_not_fetched() {
    let mut loader = Loader::new(LoaderOptions { gap: Some(0), ..LoaderOptions::default() });
    loader.want(&[wanted(0..10, 0.0)]);
    assert_eq!(fetches(&mut loader, 0), [(1, 0..10)]);
    loader.head(
        1,
        0,
        &ResponseHead { content_range: Some("bytes 0-9/3000"), content_length: Some(10), ..GOOD },
    );
    loader.data(1, 0, &bytes(0..10));
    assert_eq!(loader.uncached().count(), 1);
    assert!(loader.has_complete());
    assert_eq!(loader.take(), Some((0..10, bytes(0..10))));
    loader.add_cached(&[2990..3010, 20..30, 100..200]);
    loader.want(&[wanted(20..30, 1.0), wanted(30..40, 0.0), wanted(2990..3010, 0.0), wanted(100..200, 0.0)]);
    let told = actions(&mut loader, 0);
    let reads = told.iter().filter(|action| matches!(action, Action::Read { .. })).count();
    assert_eq!(reads, 3, "{told:?}");
    let fetched: Vec<_> = told
        .iter()
        .filter_map(|a| if let Action::Fetch { range, .. } = a { Some(range.clone()) } else { None })
        .collect();
    assert_eq!(fetched.as_slice(), std::slice::from_ref(&(30..40)));
    loader.put(&(20..30), &bytes(20..30));
    loader.put(&(2990..3010), &bytes(2990..3000));
    assert_eq!(loader.uncached().count(), 0, "what a cache has is not kept again");
    assert_eq!(loader.take(), Some((20..30, bytes(20..30))));
    assert_eq!(loader.take(), Some((2990..3010, bytes(2990..3000))));
    loader.lost(&(100..200));
    assert_eq!(fetches(&mut loader, 0), [(3, 100..200)], "what it has lost is fetched");
}

#[test]
fn a_server_is_not_asked_before_it_wants_to_be() {
    let mut loader = Loader::new(LoaderOptions::default());
    loader.want(&[wanted(0..10, 0.0)]);
    assert_eq!(fetches(&mut loader, 0).len(), 1);
    loader.head(1, 0, &ResponseHead { status: 503, retry_after_seconds: Some(7), ..ResponseHead::default() });
    assert_eq!(actions(&mut loader, 0), [Action::Cancel { id: 1 }]);
    // A new list changes nothing about that.
    loader.want(&[wanted(20..30, 0.0)]);
    assert_eq!(loader.next(6_999), Some(Action::Wait { until_ms: 7_000 }));
    assert_eq!(fetches(&mut loader, 7_000), [(2, 20..30)]);
}

#[test]
fn a_server_without_ranges_is_read_from_the_start_by_one_request() {
    let mut loader = Loader::new(small());
    loader.want(&[wanted(100..120, 0.0), wanted(2000..2010, 0.0)]);
    assert_eq!(fetches(&mut loader, 0).len(), 1);
    loader.head(1, 0, &ResponseHead { status: 200, content_length: Some(SIZE), ..GOOD });
    assert_eq!(loader.serves_ranges(), Some(false));
    assert_eq!(fetches(&mut loader, 0), []);
    loader.data(1, 0, &bytes(0..1500));
    assert_eq!(loader.take(), Some((100..120, bytes(100..120))));
    assert_eq!(loader.held_bytes(), 0, "what is not wanted is dropped");
    // What has passed by is fetched again when nothing ahead is wanted, not before.
    loader.want(&[wanted(50..60, 9.0), wanted(2000..2010, 0.0)]);
    assert_eq!(fetches(&mut loader, 0), []);
    loader.data(1, 0, &bytes(1500..2200));
    assert_eq!(loader.take(), Some((2000..2010, bytes(2000..2010))));
    let expected = Action::Fetch { id: 2, shard: 0, range: 50..60, if_match: Some("\"one\"".to_owned()) };
    assert_eq!(actions(&mut loader, 0), [Action::Cancel { id: 1 }, expected]);
}

#[test]
fn another_version_of_the_file_is_never_mixed_in() {
    let other = [
        ResponseHead { etag: Some("\"two\""), ..GOOD },
        ResponseHead { content_range: Some("bytes 100-199/3001"), ..GOOD },
        ResponseHead { status: 412, ..GOOD },
        ResponseHead { status: 200, content_length: Some(5), ..GOOD },
        ResponseHead { status: 200, etag: Some("\"two\""), ..GOOD },
    ];
    for head in other {
        let mut loader = open(small());
        loader.want(&[wanted(100..200, 0.0)]);
        assert_eq!(fetches(&mut loader, 0).len(), 1);
        loader.head(2, 0, &head);
        assert_eq!(loader.error(), Some(&StreamError::Changed), "{head:?}");
        assert_eq!(actions(&mut loader, 0), [Action::Cancel { id: 2 }]);
        assert_eq!((loader.take(), loader.next(0)), (None, None));
        loader.retry();
        assert_eq!(fetches(&mut loader, 0), [(3, 100..200)]);
        assert_eq!(loader.version(), None);
    }
}

/// Servers that compress on their way, for one, give the same bytes other weak tags.
#[test]
fn weak_tags_tell_no_versions_apart() {
    let mut loader = Loader::new(small());
    loader.want(&[wanted(0..10, 0.0), wanted(100..200, -1.0)]);
    assert_eq!(fetches(&mut loader, 0), [(1, 0..10)]);
    let head = |range, etag| ResponseHead { content_range: Some(range), etag: Some(etag), ..GOOD };
    loader.head(1, 0, &head("bytes 0-9/3000", "W/\"one\""));
    loader.data(1, 0, &bytes(0..10));
    assert_eq!(loader.version(), None);
    let asked = actions(&mut loader, 0);
    let [Action::Fetch { id, if_match: None, .. }] = asked[..] else { panic!("{asked:?}") };
    loader.head(id, 0, &head("bytes 100-199/3000", "W/\"two\""));
    loader.data(id, 0, &bytes(100..200));
    assert_eq!(loader.error(), None);
}

#[test]
fn the_end_of_the_file_is_found_without_being_told() {
    let mut loader = Loader::new(small());
    loader.want(&[wanted(2900..u64::MAX, 1.0), wanted(5000..5001, 0.0)]);
    assert_eq!(fetches(&mut loader, 0), [(1, 2900..3200)]);
    // Pages may not see how much of the file that is.
    loader.head(1, 0, &ResponseHead { content_length: Some(100), ..GOOD });
    loader.data(1, 0, &bytes(2900..3000));
    assert_eq!(fetches(&mut loader, 0)[0], (2, 3000..3300));
    loader.head(2, 0, &ResponseHead { status: 416, ..GOOD });
    assert_eq!(loader.take(), Some((2900..u64::MAX, bytes(2900..3000))));
    assert_eq!(loader.take(), Some((5000..5001, Vec::new())));
    assert!(loader.is_idle());
}

#[test]
fn what_cannot_be_mended_by_trying_is_reported_at_once_and_says_what_to_do() {
    let page = ResponseHead { status: 200, content_type: Some("text/html"), ..ResponseHead::default() };
    let packed = ResponseHead { content_encoding: Some("br"), decoded: true, ..GOOD };
    let cases = [
        (page, "404"),
        (packed, "compression"),
        (ResponseHead { status: 404, ..GOOD }, "address"),
        (ResponseHead { status: 403, ..GOOD }, "allow"),
    ];
    for (head, advice) in cases {
        let mut loader = Loader::new(small());
        loader.want(&[wanted(0..10, 0.0)]);
        assert_eq!(fetches(&mut loader, 0).len(), 1);
        loader.head(1, 0, &head);
        let error = loader.error().expect("an error").to_string();
        assert!(error.contains(advice), "{error}");
        assert_eq!(actions(&mut loader, 0), [Action::Cancel { id: 1 }]);
        assert_eq!(loader.next(u64::MAX), None);
    }
}

#[test]
fn events_of_requests_that_are_over_change_nothing() {
    let mut loader = open(small());
    loader.want(&[wanted(100..110, 0.0)]);
    assert_eq!(fetches(&mut loader, 0).len(), 1);
    for id in [0, 1, 7] {
        loader.head(id, 0, &ResponseHead { status: 404, ..ResponseHead::default() });
        loader.data(id, 0, &[1, 2, 3]);
        loader.end(id, 0);
        loader.failed(id, 0, Failure::Blocked);
    }
    assert_eq!(loader.error(), None);
    loader.head(2, 0, &GOOD);
    // More than was asked for: the surplus is not taken for bytes of the file.
    loader.data(2, 0, &[bytes(100..110), vec![1, 2, 3]].concat());
    assert_eq!(loader.take(), Some((100..110, bytes(100..110))));
    assert!(loader.is_idle());
}

#[test]
fn many_small_ranges_take_few_requests_in_any_order_of_importance() {
    let (count, size) = (10_000u64, 64u64);
    let options = LoaderOptions { gap: Some(0), max_request_bytes: 1 << 14, ..LoaderOptions::default() };
    for shuffled in [false, true] {
        let mut loader = Loader::new(options);
        let mut random = Random::new(7);
        let mut list: Vec<_> = (0..count)
            .map(|k| wanted(k * size..(k + 1) * size, if shuffled { random.below(1000) as f32 } else { 0.0 }))
            .collect();
        loader.want(&list);
        let mut came = 0;
        let mut open = Vec::new();
        loop {
            open.extend(fetches(&mut loader, 0));
            if open.is_empty() {
                break;
            }
            let (id, range) = open.remove(0);
            let whole = format!("bytes {}-{}/{}", range.start, range.end - 1, count * size);
            loader.head(id, 0, &ResponseHead { content_range: Some(&whole), ..GOOD });
            loader.data(id, 0, &vec![0; (range.end - range.start) as usize]);
            came +=
                std::iter::from_fn(|| loader.take()).map(|(range, _)| range.end - range.start).sum::<u64>();
            // A viewer says anew what it wants for every picture.
            list.retain(|wanted| wanted.range.start < range.start || wanted.range.end > range.end);
            list.reverse();
            loader.want(&list);
            while loader.take().is_some() {}
        }
        let traffic = loader.traffic();
        assert_eq!((came, traffic.received, traffic.used), (count * size, count * size, count * size));
        let least = (count * size).div_ceil(options.max_request_bytes);
        assert!(traffic.requests <= least * if shuffled { 4 } else { 1 }, "{} of {least}", traffic.requests);
    }
}

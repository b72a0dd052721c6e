//! Decides which bytes to ask for next, and takes what comes.

use super::error::StreamError;
use super::objects::Objects;
use super::range_set::RangeSet;
use super::reassembly::Reassembly;
use super::response::{ResponseContent, ResponseHead, UNKNOWN};
use foldhash::HashSet;
use std::collections::VecDeque;
use std::ops::Range;

/// How a loader goes about its work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoaderOptions {
    /// Most requests at a time.
    pub max_requests: usize,
    /// Unwanted bytes that are rather fetched than asked around; they are kept, for they may be wanted later. None follows the network: the
    /// slower an answer begins, and the faster it comes then, the more.
    pub gap: Option<u64>,
    /// Most unwanted bytes that are kept.
    pub spare_bytes: u64,
    /// Most bytes in one request.
    pub max_request_bytes: u64,
    /// How often the same bytes are asked for again without success.
    pub retries: u32,
    /// The wait before the first such try, in milliseconds; each one after waits twice as long.
    pub backoff_ms: u64,
    /// The longest such wait.
    pub max_backoff_ms: u64,
    /// How long a request may bring nothing, in milliseconds.
    pub timeout_ms: u64,
    /// Seed of the jitter, which keeps clients from trying again in step.
    pub seed: u64,
}

impl Default for LoaderOptions {
    /// Six requests of up to 4 MiB over gaps that suit the network, of which 32 MiB are kept; five more tries, after 0.5 s to 10 s; 30 s
    /// of silence.
    fn default() -> Self {
        Self {
            max_requests: 6,
            gap: None,
            spare_bytes: 32 << 20,
            max_request_bytes: 4 << 20,
            retries: 5,
            backoff_ms: 500,
            max_backoff_ms: 10_000,
            timeout_ms: 30_000,
            seed: 0,
        }
    }
}

/// Bytes that are wanted, and how much.
#[derive(Clone, Debug, PartialEq)]
pub struct WantedRange {
    /// Which bytes. What lies beyond the end of the file comes out shorter.
    pub range: Range<u64>,
    /// Higher comes first.
    pub priority: f32,
}

/// What the driver is to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Action {
    /// Ask for these bytes.
    Fetch {
        /// The number by which the driver reports about the request.
        id: u32,
        /// The shard of the file that is to be asked for them; 0 if it is in one object, as most are.
        shard: u64,
        /// The bytes, by their places in that shard.
        range: Range<u64>,
        /// For `If-Match`, where sending that costs nothing (in a page it costs a preflight); answers are checked anyway.
        if_match: Option<String>,
    },
    /// Read these bytes, which a cache has, and [put](Loader::put) them, or say that they are [lost](Loader::lost).
    Read {
        /// The bytes.
        range: Range<u64>,
    },
    /// Drop this request; it needs no further report.
    Cancel {
        /// The name of the request.
        id: u32,
    },
    /// Nothing to do before this time, unless something happens.
    Wait {
        /// In milliseconds, by the clock of the driver.
        until_ms: u64,
    },
}

/// How a request failed that did not get to its end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Failure {
    /// No connection, or one that was cut; with what is known of it.
    Network(String),
    /// The browser refused (CORS).
    Blocked,
    /// What came was packed in this way, and cannot be unpacked: a part of packed bytes, most likely.
    Encoded(String),
    /// Nothing came for too long.
    Timeout,
}

/// What has been asked and has come so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Requests that were made.
    pub requests: u64,
    /// Bytes that came.
    pub received: u64,
    /// Of those, bytes that were wanted when they came.
    pub used: u64,
    /// Bytes that had come before, and came again.
    pub repeated: u64,
    /// How often something was asked for while nothing was on its way.
    pub rounds: u64,
    /// Milliseconds for which something was.
    pub waited_ms: u64,
}

/// Decides which bytes of a file to ask for next, and takes what comes.
///
/// It does no I/O and reads no clock: a driver reports what happens, and when, and carries out its actions. So one machine
/// serves pages, programs and tests, and every fault of a network can be played to it. What it holds to: the bytes
/// that come out are those of one version of the file; never more than
/// [`max_requests`](LoaderOptions::max_requests) requests are open or waiting to be tried again; no byte is asked for
/// that is held or on its way, and none that has come before unless it is wanted again; nobody waits for ever: in the end there are bytes or a [`StreamError`].
#[derive(Debug, Default)]
pub struct Loader {
    options: LoaderOptions,
    /// What has not come out yet.
    wanted: Vec<WantedRange>,
    /// Bytes of `wanted` that are not held.
    needed: RangeSet,
    /// Bytes of `wanted` that are, and others that have come with them.
    reassembly: Reassembly,
    /// Bytes that have come, of this version of the file.
    came: RangeSet,
    ready: VecDeque<(Range<u64>, Vec<u8>)>,
    /// Ranges that a cache has, and those of them that are being read.
    cached: HashSet<Range<u64>>,
    reading: Vec<Range<u64>>,
    requests: Vec<Request>,
    pauses: Vec<Pause>,
    cancelled: Vec<u32>,
    file: Objects,
    /// Whether the length of the first object is to be found out by a request of its own.
    measures: Measures,
    pace: Pace,
    /// Whether the server has answered with a range, or with the whole file instead.
    ranges: Option<bool>,
    error: Option<StreamError>,
    traffic: Traffic,
    /// Since when something is on its way, if it is.
    waiting_since: Option<u64>,
    /// Of jitter.
    drawn: u64,
    last_id: u32,
}

/// Where it is not to be seen how long an object is, as of servers elsewhere in most pages, a header that promises more than there is leads
/// here: a request for all of it has an answer whose length is that of the object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Measures {
    #[default]
    Unneeded,
    Due,
    Done,
}

/// What is to be asked for next.
#[derive(Debug)]
struct Chosen {
    range: Range<u64>,
    /// Tries before it that brought nothing.
    strikes: u32,
    /// Whether it is asked for to learn the length of the object.
    measures: bool,
}

/// A request under way.
#[derive(Debug)]
struct Request {
    id: u32,
    /// The shard that is asked, and where it begins in the file.
    shard: u64,
    base: u64,
    measures: bool,
    asked: Range<u64>,
    /// The next byte of the body, and its end.
    body: Range<u64>,
    answered: bool,
    /// When it was made, and when its head came, in milliseconds.
    made: u64,
    headed: u64,
    /// Bytes of it that were wanted.
    used: u64,
    /// Tries before it that brought nothing.
    strikes: u32,
    deadline: u64,
}

/// The rest of a request that failed: it keeps its place among the requests until it is asked for again.
#[derive(Debug)]
struct Pause {
    range: Range<u64>,
    measures: bool,
    strikes: u32,
    until: u64,
}

/// How soon answers begin, and how fast they come then, as far as is known.
#[derive(Debug, Default)]
struct Pace {
    latency_ms: Option<f64>,
    /// Of one request.
    bytes_per_ms: Option<f64>,
}

/// Gaps before anything is known of the network.
const USUAL_GAP: u64 = 16 << 10;
/// Smaller gaps cost less than the head of a request.
const LEAST_GAP: f64 = 1024.0;
/// A byte that nobody has asked for is worth so much of the time that it takes: others pay for it, too.
const WASTE: f64 = 8.0;
/// Rates of fewer bytes say more of the clock than of the network.
const RATED_BYTES: u64 = 32 << 10;

impl Pace {
    /// Takes in how long the head of an answer took.
    fn note_latency(&mut self, ms: u64) {
        blend(&mut self.latency_ms, ms as f64);
    }

    /// Takes in how long a body took.
    fn note_rate(&mut self, bytes: u64, ms: u64) {
        if bytes >= RATED_BYTES {
            blend(&mut self.bytes_per_ms, bytes as f64 / ms.max(1) as f64);
        }
    }

    /// How to fetch `free`, the rest of so many bytes that are needed.
    ///
    /// Asking around a gap takes an answer more, of which only the wait counts: the gap whose bytes take as long saves nothing. Much
    /// smaller ones are bridged, unless there are so many that all waits together take longer than all gaps. And requests take equal shares of
    /// what is needed, unless waits would be longer than what they bring.
    fn plan(&self, options: &LoaderOptions, free: &RangeSet, needed: u64) -> Plan {
        let most = options.max_request_bytes.max(1);
        if let Some(gap) = options.gap {
            return Plan { gap, most, before: 0 };
        }
        let (Some(latency), Some(rate)) = (self.latency_ms, self.bytes_per_ms) else {
            return Plan { gap: USUAL_GAP, most, before: 0 };
        };
        let even = latency * rate;
        let lanes = options.max_requests.max(1) as f64;
        let runs = free.iter().count() as f64;
        let around = (runs / lanes).ceil() * latency + free.len() as f64 / (rate * lanes);
        let all = free.hull().map_or(0.0, |hull| latency + (hull.end - hull.start) as f64 / rate);
        let gap = if around > all { even } else { even / WASTE }.max(LEAST_GAP) as u64;
        let share = (needed as f64 / lanes).max(even) as u64;
        Plan { gap, most: share.clamp(1, most), before: even as u64 }
    }
}

/// How much goes into a request.
struct Plan {
    /// The largest gap that is fetched with what is around it.
    gap: u64,
    /// Bytes at most, as far as they are not one run, and of these at most so many in front of the most important ones.
    most: u64,
    before: u64,
}

/// Moves a mean towards what was measured last.
fn blend(mean: &mut Option<f64>, measured: f64) {
    *mean = Some(mean.map_or(measured, |mean| 0.7 * mean + 0.3 * measured));
}

impl Loader {
    /// A loader of one file.
    pub fn new(options: LoaderOptions) -> Self {
        Self { options, drawn: options.seed, ..Self::default() }
    }

    /// Makes more or fewer requests at a time from now on.
    pub fn set_max_requests(&mut self, most: usize) {
        self.options.max_requests = most;
    }

    /// Says which ranges are wanted from now on, all of them: what is missing in `wanted` is not wanted any more.
    ///
    /// A range comes out once. One that has come out is fetched again if it is still in the list: leave it out.
    pub fn want(&mut self, wanted: &[WantedRange]) {
        self.wanted = wanted.to_vec();
        let ready = &self.ready;
        self.wanted.retain(|wanted| ready.iter().all(|(range, _)| *range != wanted.range));
        self.find_needed();
        self.drop_spare();
        self.deliver(&(0..UNKNOWN));
    }

    /// What to do now; `None` and `Wait` mean nothing until something happens, `Wait` not after its time either.
    pub fn next(&mut self, now_ms: u64) -> Option<Action> {
        self.time_out(now_ms);
        self.drop_useless(now_ms);
        if self.requests.is_empty() {
            let since = self.waiting_since.take().unwrap_or(now_ms);
            self.traffic.waited_ms += now_ms.saturating_sub(since);
        }
        if let Some(id) = self.cancelled.pop() {
            return Some(Action::Cancel { id });
        }
        if self.error.is_some() {
            return None;
        }
        if let Some(range) = self.readable() {
            self.reading.push(range.clone());
            return Some(Action::Read { range });
        }
        if let Some(chosen) = self.choose(now_ms) {
            return Some(self.fetch(chosen, now_ms));
        }
        let deadlines = self.requests.iter().map(|request| request.deadline);
        let until_ms = deadlines.chain(self.pauses.iter().map(|pause| pause.until)).min()?;
        Some(Action::Wait { until_ms })
    }

    /// The head of an answer has come.
    pub fn head(&mut self, id: u32, now_ms: u64, head: &ResponseHead) {
        let Some(at) = self.position(id) else { return };
        let request = &mut self.requests[at];
        request.deadline = now_ms.saturating_add(self.options.timeout_ms);
        (request.answered, request.headed) = (true, now_ms);
        self.pace.note_latency(now_ms.saturating_sub(request.made));
        let (shard, base) = (request.shard, request.base);
        let judged = head.judge(&(request.asked.start - base..request.asked.end - base));
        let judged = judged.and_then(|answer| self.file.learn(shard, head).map(|()| answer));
        if judged.is_ok() {
            self.look_for_shards();
        }
        match judged {
            Ok(ResponseContent::Part(part)) if self.requests[at].measures => {
                let request = self.requests.swap_remove(at);
                // The rest of it is asked for as it is needed.
                self.cancelled.push(id);
                if part.end < request.asked.end {
                    self.learn_length(part.end);
                }
            }
            Ok(ResponseContent::Part(part)) => {
                self.requests[at].body = base + part.start..base + part.end;
                self.ranges = Some(true);
                self.settle_end();
            }
            Ok(ResponseContent::Whole(end)) => self.take_whole(at, base.saturating_add(end)),
            Ok(ResponseContent::Beyond(end)) => {
                let request = self.requests.swap_remove(at);
                // Its body, if any, says nothing.
                self.cancelled.push(id);
                if request.asked.start > 0 && (self.awaits_header() || self.awaits_length()) {
                    // Then it is known where this is.
                    let error = StreamError::WrongRange("nothing, before its beginning has come".to_owned());
                    self.stumble(request, error, now_ms, 0);
                } else {
                    self.go_beyond(&request, end);
                }
            }
            Err(error) => {
                let request = self.requests.swap_remove(at);
                self.cancelled.push(id);
                let after = head.retry_after_seconds.map(|seconds| seconds.saturating_mul(1000));
                self.stumble(request, error, now_ms, after.unwrap_or(0));
            }
        }
    }

    /// Bytes of the body have come.
    pub fn data(&mut self, id: u32, now_ms: u64, bytes: &[u8]) {
        let Some(at) = self.position(id) else { return };
        let request = &mut self.requests[at];
        self.traffic.received += bytes.len() as u64;
        if !request.answered {
            return;
        }
        request.deadline = now_ms.saturating_add(self.options.timeout_ms);
        let start = request.body.start;
        let room = request.body.end - start;
        let taken = usize::try_from(room).map_or(bytes.len(), |room| room.min(bytes.len()));
        request.body.start += taken as u64;
        let chunk = start..request.body.start;
        let done = request.body.start == request.body.end;
        let [used, new] = self.store(&chunk, &bytes[..taken]);
        self.traffic.repeated += taken as u64 - new;
        self.requests[at].used += used;
        self.traffic.used += used;
        self.take_start(start, &bytes[..taken]);
        if done {
            self.finish(at, now_ms);
            if taken < bytes.len() {
                self.cancelled.push(id);
            }
        }
        if used > 0 {
            self.deliver(&chunk);
        }
    }

    /// The body has ended.
    pub fn end(&mut self, id: u32, now_ms: u64) {
        let Some(at) = self.position(id) else { return };
        let request = self.requests.swap_remove(at);
        if request.answered && request.body.end == UNKNOWN {
            self.learn_length(request.body.start);
        } else {
            self.stumble(request, StreamError::Network("an answer ended too early".to_owned()), now_ms, 0);
        }
    }

    /// The request has failed.
    pub fn failed(&mut self, id: u32, now_ms: u64, failure: Failure) {
        let Some(at) = self.position(id) else { return };
        let request = self.requests.swap_remove(at);
        let error = match failure {
            Failure::Network(detail) => StreamError::Network(detail),
            Failure::Blocked => StreamError::Blocked,
            Failure::Encoded(encoding) => StreamError::Encoded(encoding),
            Failure::Timeout => StreamError::Timeout,
        };
        self.stumble(request, error, now_ms, 0);
    }

    /// Says of more ranges that a cache has them: those that are wanted are read from there.
    pub fn add_cached(&mut self, ranges: &[Range<u64>]) {
        self.cached.extend(ranges.iter().cloned());
    }

    /// There is no cache any more.
    pub fn forget_cached(&mut self) {
        self.cached.clear();
        self.reading.clear();
    }

    /// Takes a range that a cache had, with its bytes; ignored if it is not wanted any more.
    pub fn put(&mut self, range: &Range<u64>, bytes: &[u8]) {
        self.reading.retain(|reading| reading != range);
        let there = range.start..range.end.min(range.start.saturating_add(bytes.len() as u64));
        self.store(&there, bytes);
        self.take_start(range.start, bytes);
        self.deliver(range);
    }

    /// The cache does not have a range any more.
    pub fn lost(&mut self, range: &Range<u64>) {
        self.reading.retain(|reading| reading != range);
        self.cached.remove(range);
    }

    /// The complete ranges that have not been taken, without those from a cache.
    pub fn uncached(&self) -> impl Iterator<Item = (&Range<u64>, &[u8])> {
        let new = self.ready.iter().filter(|(range, _)| !self.cached.contains(range));
        new.map(|(range, bytes)| (range, &bytes[..]))
    }

    /// Whether [`Loader::take`] has something to give.
    pub fn has_complete(&self) -> bool {
        !self.ready.is_empty()
    }

    /// A range that is complete: as it was wanted, with its bytes, fewer where it reaches beyond the end of the file.
    pub fn take(&mut self) -> Option<(Range<u64>, Vec<u8>)> {
        self.ready.pop_front()
    }

    /// Nothing is wanted any more, and what is complete neither.
    pub fn drop_all(&mut self) {
        self.want(&[]);
        self.ready.clear();
    }

    /// Why nothing comes any more. What was complete before can still be taken.
    pub fn error(&self) -> Option<&StreamError> {
        self.error.as_ref()
    }

    /// Tries again after an error, from the beginning if the file had changed; what a cache has is not known any more.
    pub fn retry(&mut self) {
        self.forget_cached();
        if self.error.take() == Some(StreamError::Changed) {
            (self.file, self.measures) = (Objects::default(), Measures::default());
            self.reassembly = Reassembly::default();
            self.came = RangeSet::default();
            self.needed = self.all_wanted();
        }
    }

    /// The size of the file, once it is known.
    pub fn total(&self) -> Option<u64> {
        self.file.total()
    }

    /// What names this version of the file: its strong entity tag or, failing that, its date.
    pub fn version(&self) -> Option<&str> {
        self.file.version()
    }

    /// Whether the server gives ranges; where it does not, everything passes by from the start for whatever is wanted.
    pub fn serves_ranges(&self) -> Option<bool> {
        self.ranges
    }

    /// Whether all that was wanted has come.
    pub fn is_idle(&self) -> bool {
        self.wanted.is_empty()
    }

    /// What has been asked and has come so far.
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// Bytes that wait for the rest of their range, and complete ones that have not been taken.
    pub fn held_bytes(&self) -> u64 {
        self.reassembly.len() + self.ready.iter().map(|(_, bytes)| bytes.len() as u64).sum::<u64>()
    }

    /// A range that is wanted, that a cache has, and that is not being read.
    fn readable(&self) -> Option<Range<u64>> {
        let ranges = self.wanted.iter().map(|wanted| &wanted.range);
        ranges
            .filter(|range| self.cached.contains(range))
            .find(|range| !self.reading.contains(range))
            .cloned()
    }

    fn position(&self, id: u32) -> Option<usize> {
        self.requests.iter().position(|request| request.id == id)
    }

    fn all_wanted(&self) -> RangeSet {
        RangeSet::of(self.wanted.iter().map(|wanted| self.file.clip(&wanted.range)).collect())
    }

    /// Notes which bytes are wanted and not held.
    fn find_needed(&mut self) {
        self.needed = self.all_wanted();
        for range in self.reassembly.ranges() {
            self.needed.remove(&range);
        }
    }

    /// The bytes at a place have come: they may be those of the header, which says whether the file goes on in other shards.
    fn take_start(&mut self, at: u64, bytes: &[u8]) {
        let rest = self.file.rest_of_header();
        if rest.is_empty() || at > rest.start {
            return;
        }
        self.file.take_start(at, bytes);
        self.look_for_shards();
        self.settle_end();
    }

    /// There are no bytes beyond the end of the file, as it is known now; unless its header is on its way, which may say otherwise.
    fn settle_end(&mut self) {
        if !self.awaits_header() {
            self.end_at(self.file.end());
        }
    }

    /// Whether the header of the file is wanted, and has not come.
    fn awaits_header(&self) -> bool {
        let rest = self.file.rest_of_header();
        self.needed.first_in(&rest).is_some_and(|next| next.start == rest.start)
    }

    /// Whether the length of the first object is being found out.
    fn awaits_length(&self) -> bool {
        let is_asked = self.requests.iter().any(|request| request.measures);
        is_asked || self.measures == Measures::Due || self.pauses.iter().any(|pause| pause.measures)
    }

    /// Sees that the file is in shards, if it shows now: then there is more of it to be needed, and what was not in the first one need not wait.
    fn look_for_shards(&mut self) {
        if self.file.find_shards() {
            self.find_needed();
            let file = &self.file;
            self.pauses.retain(|pause| pause.measures || file.object_at(pause.range.start) == 0);
        }
    }

    /// The first object has so many bytes.
    fn learn_length(&mut self, length: u64) {
        match self.file.learn_length(length) {
            Ok(()) => {
                self.look_for_shards();
                self.end_at(self.file.end());
            }
            Err(error) => self.fail(error),
        }
    }

    /// An object has no bytes where it was asked for them: it ends at `end`, by its own count.
    fn go_beyond(&mut self, request: &Request, end: u64) {
        let shards = self.file.shards();
        match shards {
            Some(shards) if request.shard > 0 => match shards.check(request.shard, end) {
                Ok(()) => self.fail(StreamError::Changed),
                Err(error) => self.fail(error),
            },
            // It was asked for before the file was known to be in shards.
            Some(shards) if shards.number_at(request.asked.start) > 0 => {}
            Some(_) => self.fail(StreamError::Changed),
            None if self.measures == Measures::Unneeded
                && self.file.stated().is_some_and(|total| request.asked.start < total) =>
            {
                self.measures = Measures::Due;
            }
            None => self.end_at(end),
        }
    }

    /// What an error is if it was not the file itself that was asked for, but a shard of it.
    fn error_of(&self, shard: u64, error: StreamError) -> StreamError {
        match (self.file.shards(), &error) {
            (
                Some(shards),
                // Servers that list nothing refuse what is not there, others send a page; and an error may lack what lets a page read it.
                StreamError::Status(403 | 404 | 410) | StreamError::WebPage | StreamError::Blocked,
            ) if shard > 0 => shards.missing(shard),
            _ => error,
        }
    }

    /// Keeps of `chunk` what is wanted and not held, and what has not come before; says how much was wanted, and how much had not come.
    fn store(&mut self, chunk: &Range<u64>, bytes: &[u8]) -> [u64; 2] {
        let mut new = RangeSet::of(vec![chunk.clone()]);
        self.came.iter().for_each(|range| new.remove(range));
        self.came.insert(chunk);
        let unseen = new.len();
        // The whole file is not kept by the way.
        if self.ranges == Some(false) {
            new = RangeSet::default();
        }
        let (mut rest, mut used) = (chunk.clone(), 0);
        while let Some(part) = self.needed.first_in(&rest) {
            self.needed.remove(&part);
            new.insert(&part);
            used += part.end - part.start;
            rest.start = part.end;
        }
        for part in new.iter() {
            let place = |at: u64| (at - chunk.start) as usize;
            self.reassembly.put(part.start, &bytes[place(part.start)..place(part.end)]);
        }
        self.drop_spare();
        [used, unseen]
    }

    /// Drops bytes that are not wanted, if there are too many.
    fn drop_spare(&mut self) {
        // Without those that are not wanted, no more than what is wanted is held.
        if self.reassembly.len() <= self.options.spare_bytes {
            return;
        }
        let all = self.all_wanted();
        let held = self.reassembly.ranges().map(|range| {
            let mut spare = RangeSet::of(vec![range]);
            all.iter().for_each(|wanted| spare.remove(wanted));
            spare.len()
        });
        if held.sum::<u64>() > self.options.spare_bytes {
            self.reassembly.keep(&all);
        }
    }

    /// Hands out what is complete now that the bytes of `touched` are there or known not to exist.
    fn deliver(&mut self, touched: &Range<u64>) {
        let Self { wanted, needed, reassembly, ready, file, .. } = self;
        let mut done = Vec::new();
        wanted.retain(|wanted| {
            let range = file.clip(&wanted.range);
            if wanted.range.start > touched.end
                || touched.start > wanted.range.end
                || needed.first_in(&range).is_some()
            {
                return true;
            }
            // The same range may have been wanted twice.
            if ready.iter().all(|(ready, _)| *ready != wanted.range) {
                ready.push_back((wanted.range.clone(), reassembly.get(&range)));
            }
            done.push(range);
            false
        });
        self.let_go(done);
    }

    /// Drops the bytes of `done`, except those that other ranges still wait for.
    fn let_go(&mut self, done: Vec<Range<u64>>) {
        if done.is_empty() {
            return;
        }
        let mut gone = RangeSet::of(done);
        for wanted in &self.wanted {
            gone.remove(&wanted.range);
        }
        let mut keep = RangeSet::of(self.reassembly.ranges().collect());
        for range in gone.iter() {
            keep.remove(range);
        }
        self.reassembly.keep(&keep);
    }

    /// There are no bytes from `end` on.
    fn end_at(&mut self, end: u64) {
        self.file.end_at(end);
        self.needed.remove(&(self.file.end()..UNKNOWN));
        self.deliver(&(0..UNKNOWN));
    }

    /// The server sends all of an object: one request is enough.
    fn take_whole(&mut self, at: usize, end: u64) {
        self.ranges = Some(false);
        let mut request = self.requests.swap_remove(at);
        let object = self.file.range(request.shard);
        request.body = request.base..end.min(object.end);
        self.cancelled.extend(self.requests.drain(..).map(|other| other.id));
        self.pauses.clear();
        let (is_last, end) = (object.end == self.file.end(), request.body.end);
        if end > request.base {
            self.requests.push(request);
        }
        if end != UNKNOWN && is_last {
            self.file.end_at(end);
            self.settle_end();
        }
    }

    /// Requests that have been silent for too long are dropped and tried again.
    fn time_out(&mut self, now: u64) {
        while let Some(at) = self.requests.iter().position(|request| request.deadline <= now) {
            let request = self.requests.swap_remove(at);
            self.cancelled.push(request.id);
            self.stumble(request, StreamError::Timeout, now, 0);
        }
    }

    /// Drops requests that bring nothing more that is wanted. Pauses stay for their time: a list that changes often
    /// must not make a client ask a server in trouble more often.
    fn drop_useless(&mut self, now: u64) {
        let Self { requests, needed, cancelled, pauses, measures, .. } = self;
        requests.retain(|request| {
            let useful = needed.first_in(&request.body).is_some();
            if !useful {
                cancelled.push(request.id);
                if request.measures {
                    *measures = Measures::Unneeded;
                }
            }
            useful
        });
        pauses.retain(|pause| pause.until > now || needed.first_in(&pause.range).is_some());
    }

    /// The next range to ask for.
    fn choose(&mut self, now: u64) -> Option<Chosen> {
        while let Some(due) = self.pauses.iter().position(|pause| pause.until <= now) {
            let Pause { range, measures, strikes, .. } = self.pauses.swap_remove(due);
            let range = if measures { Some(range) } else { self.plan(Some(&range)) };
            if let Some(range) = range {
                return Some(Chosen { range, strikes, measures });
            }
        }
        // Until the server has shown that it gives ranges, several requests might fetch the file several times.
        let most = if self.ranges == Some(true) { self.options.max_requests.max(1) } else { 1 };
        let room = self.requests.len() + self.pauses.len() < most;
        if !room {
            return None;
        }
        if let (Measures::Due, Some(total), Some(_)) = (self.measures, self.file.stated(), self.needed.hull())
        {
            self.measures = Measures::Done;
            return Some(Chosen { range: 0..total, strikes: 0, measures: true });
        }
        self.plan(None).map(|range| Chosen { range, strikes: 0, measures: false })
    }

    /// The range to ask for: of what is in `within`, or from the most important bytes on.
    fn plan(&self, within: Option<&Range<u64>>) -> Option<Range<u64>> {
        let mut free = self.needed.clone();
        free.remove(&(self.file.end()..UNKNOWN));
        for range in self.under_way() {
            free.remove(&range);
        }
        if self.ranges == Some(false) {
            let mut all = free.hull()?;
            all.end = all.end.min(self.file.range(self.file.object_at(all.start)).end);
            return Some(all);
        }
        let first = match within {
            Some(range) => free.first_in(range),
            None => self.most_important(&free),
        };
        Some(self.grown(first?.start, &free))
    }

    /// The first free bytes of the range that is wanted most, the first such range in the file.
    fn most_important(&self, free: &RangeSet) -> Option<Range<u64>> {
        let mut best: Option<(f32, Range<u64>)> = None;
        for wanted in &self.wanted {
            let Some(part) = free.first_in(&wanted.range) else { continue };
            let better = |(priority, first): &(f32, Range<u64>)| {
                wanted.priority > *priority || wanted.priority == *priority && part.start < first.start
            };
            if best.as_ref().is_none_or(better) {
                best = Some((wanted.priority, part));
            }
        }
        best.map(|(_, part)| part)
    }

    /// The body of a request is there; that of a part may be less than was asked for.
    fn finish(&mut self, at: usize, now: u64) {
        let request = self.requests.swap_remove(at);
        let bytes = request.body.end.saturating_sub(request.asked.start);
        self.pace.note_rate(bytes, now.saturating_sub(request.headed));
        if request.body.end < request.asked.end.min(self.file.range(request.shard).end) {
            // Allowed, but a server that gives a few bytes each time gets us nowhere.
            self.stumble(request, StreamError::WrongRange("a small part of it".to_owned()), now, 0);
        }
    }

    /// What is on its way, will be tried again, or is being read from a cache.
    fn under_way(&self) -> impl Iterator<Item = Range<u64>> {
        let requests = self.requests.iter().map(|request| request.body.clone());
        requests
            .chain(self.pauses.iter().map(|pause| pause.range.clone()))
            .chain(self.reading.iter().cloned())
    }

    /// The range from `start` over what is free, and over gaps that are small, not on their way, and have not come before.
    ///
    /// It grows backwards only by what comes within a wait: that comes before the most important bytes. It stays within one shard.
    fn grown(&self, start: u64, free: &RangeSet) -> Range<u64> {
        let Plan { gap, most, before } = self.pace.plan(&self.options, free, self.needed.len());
        let is_bridged = |between: Range<u64>| between.end - between.start <= gap && !self.is_busy(&between);
        let object = self.file.range(self.file.object_at(start));
        let limit = start.saturating_add(most).min(object.end);
        let mut grown = start..start;
        while let Some(next) = free.first_in(&(grown.end..limit)) {
            if !is_bridged(grown.end..next.start) {
                break;
            }
            grown.end = next.end;
        }
        let first = start.saturating_sub(before.min(most.saturating_sub(grown.end - grown.start)));
        let first = first.max(object.start);
        while let Some(last) = free.last_in(&(first..grown.start)) {
            if !is_bridged(last.end..grown.start) {
                break;
            }
            grown.start = last.start;
        }
        grown
    }

    fn is_busy(&self, gap: &Range<u64>) -> bool {
        let mut busy = self.under_way();
        self.came.first_in(gap).is_some() || busy.any(|range| range.start < gap.end && gap.start < range.end)
    }

    fn fetch(&mut self, Chosen { range, strikes, measures }: Chosen, now: u64) -> Action {
        self.last_id = self.last_id.wrapping_add(1);
        let id = self.last_id;
        let deadline = now.saturating_add(self.options.timeout_ms);
        let shard = self.file.object_at(range.start);
        let base = self.file.range(shard).start;
        let (asked, body) = (range.clone(), range.clone());
        let (made, headed) = (now, now);
        self.traffic.rounds += u64::from(self.waiting_since.is_none());
        self.waiting_since.get_or_insert(now);
        self.requests.push(Request {
            id,
            shard,
            base,
            measures,
            asked,
            body,
            answered: false,
            made,
            headed,
            used: 0,
            strikes,
            deadline,
        });
        self.traffic.requests += 1;
        let if_match = self.file.etag(shard).map(str::to_owned);
        Action::Fetch { id, shard, range: range.start - base..range.end - base, if_match }
    }

    /// Deals with a request that failed: its rest is asked for again, at once if it had got on, else after a while.
    fn stumble(&mut self, request: Request, error: StreamError, now: u64, at_least_ms: u64) {
        let enough = (16 << 10).min((request.asked.end - request.asked.start) / 8).max(1);
        let strikes = if request.used >= enough { 0 } else { request.strikes + 1 };
        if strikes > self.options.retries || !error.may_pass() {
            return self.fail(self.error_of(request.shard, error));
        }
        let wait = if strikes == 0 { 0 } else { self.backoff(strikes).max(at_least_ms.min(60_000)) };
        // Of a whole file the beginning has passed by, but only the wanted part of it is held.
        let range =
            if self.ranges == Some(false) { 0..UNKNOWN } else { request.body.start..request.asked.end };
        let (measures, until) = (request.measures, now.saturating_add(wait));
        self.pauses.push(Pause { range, measures, strikes, until });
    }

    /// Twice as long for each strike, and up to half of that less by chance.
    fn backoff(&mut self, strikes: u32) -> u64 {
        let doubled = self.options.backoff_ms.saturating_mul(1 << (strikes - 1).min(20));
        let longest = doubled.min(self.options.max_backoff_ms);
        longest - self.random() % (longest / 2 + 1)
    }

    /// SplitMix64 (Steele, Lea, Flood 2014).
    fn random(&mut self) -> u64 {
        self.drawn = self.drawn.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let x = (self.drawn ^ self.drawn >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let x = (x ^ x >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        x ^ x >> 31
    }

    fn fail(&mut self, error: StreamError) {
        self.cancelled.extend(self.requests.drain(..).map(|request| request.id));
        self.pauses.clear();
        self.error = Some(error);
    }
}

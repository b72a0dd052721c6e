//! The loader over HTTP, for native programs: a thread for each request, and a channel.

mod cache;

pub use cache::CacheFolder;

use super::error::StreamError;
use super::loader::{Action, Failure, Loader, LoaderOptions, Traffic, WantedRange};
use super::response::ResponseHead;
use super::shards::shard_suffix;
use super::source::{Arrived, RangeSource};
use cache::Cache;
use std::collections::{BTreeMap, VecDeque};
use std::io::Read;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender};
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::{Duration, Instant};
use ureq::http::{Response, header};
use ureq::{Agent, Body};
use url::Url;

/// Bytes that are read at a time.
const CHUNK: usize = 64 << 10;

/// Events that may wait before the threads do.
const WAITING: usize = 32;

/// How a server is asked.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct HttpOptions {
    /// How requests are made and tried again.
    pub loader: LoaderOptions,
    /// Headers that go along with each request to the origin of the address, such as `Authorization`. Another origin that a redirect
    /// leads to is not sent them.
    pub headers: Vec<(String, String)>,
    /// Where ranges are kept for the next time, if anywhere.
    pub cache: Option<CacheFolder>,
}

/// Ranges of a file on a server.
///
/// Time passes for it only while [`next`](RangeSource::next) waits: a program that computes for a while must not find its
/// requests timed out when it comes back.
#[derive(Debug)]
pub struct HttpSource {
    loader: Loader,
    options: HttpOptions,
    client: Client,
    /// Where the file was asked for.
    given: String,
    /// Where redirects led to, for each shard that was redirected.
    led_to: BTreeMap<u64, String>,
    /// Whether other origins that redirects led to are asked directly: not if one has refused without the headers.
    asks_others: bool,
    events: Receiver<Event>,
    sender: SyncSender<Event>,
    open: Vec<(u32, Arc<AtomicBool>)>,
    /// What has been found in the cache.
    found: VecDeque<Arrived>,
    cache: Option<Cache>,
    clock: Duration,
}

/// Something that happened to the request of that number.
#[derive(Debug)]
struct Event(u32, What);

#[derive(Debug)]
enum What {
    Head(Box<OwnedResponseHead>),
    Data(Vec<u8>),
    End,
    Failed(Failure),
}

/// What a [`ResponseHead`] borrows, the shard and the address that were asked for it, and where redirects led to.
#[derive(Debug)]
struct OwnedResponseHead {
    shard: u64,
    asked: String,
    led_to: String,
    status: u16,
    fields: [Option<String>; 7],
}

/// In the order of `OwnedResponseHead::fields`.
const FIELDS: [header::HeaderName; 7] = [
    header::CONTENT_RANGE,
    header::CONTENT_LENGTH,
    header::CONTENT_ENCODING,
    header::CONTENT_TYPE,
    header::ETAG,
    header::LAST_MODIFIED,
    header::RETRY_AFTER,
];

impl OwnedResponseHead {
    /// Packed answers are unpacked on the way, and their head says neither that nor the length any more.
    fn of((shard, asked): (u64, &str), led_to: String, response: &Response<Body>) -> Self {
        let field = |name| Some(response.headers().get(name)?.to_str().ok()?.to_owned());
        let asked = asked.to_owned();
        Self { shard, asked, led_to, status: response.status().as_u16(), fields: FIELDS.map(field) }
    }

    fn head(&self) -> ResponseHead<'_> {
        let [range, length, encoding, kind, etag, modified, retry] =
            self.fields.each_ref().map(Option::as_deref);
        let number = |text: Option<&str>| text?.trim().parse().ok();
        ResponseHead {
            status: self.status,
            content_range: range,
            content_length: number(length),
            content_encoding: encoding,
            decoded: false,
            content_type: kind,
            etag,
            last_modified: modified,
            retry_after_seconds: number(retry),
        }
    }
}

impl HttpSource {
    /// Ranges of the file at `url`; nothing is asked before something is wanted.
    pub fn new(url: &str, options: HttpOptions) -> Self {
        let (sender, events) = mpsc::sync_channel(WAITING);
        Self {
            loader: Loader::new(options.loader),
            client: Client::new(url, &options),
            options,
            given: url.to_owned(),
            led_to: BTreeMap::new(),
            asks_others: true,
            events,
            sender,
            open: Vec::new(),
            found: VecDeque::new(),
            cache: None,
            clock: Duration::ZERO,
        }
    }

    /// Ranges of another file, asked for in the same way, by the same connections.
    #[must_use]
    pub fn of_another(&self, url: &str) -> Self {
        let mut other = Self::new(url, self.options.clone());
        other.client.agent = self.client.agent.clone();
        other
    }

    /// Whether the server gives ranges; where it does not, everything passes by from the start for whatever is wanted.
    pub fn serves_ranges(&self) -> Option<bool> {
        self.loader.serves_ranges()
    }

    /// Tries again after an error, from the beginning if the file had changed.
    pub fn retry(&mut self) {
        self.loader.retry();
        self.cache = None;
    }

    fn now(&self) -> u64 {
        u64::try_from(self.clock.as_millis()).unwrap_or(u64::MAX)
    }

    /// Does what the loader says; gives the time up to which there is nothing more to do.
    fn obey(&mut self) -> Option<u64> {
        loop {
            match self.loader.next(self.now())? {
                Action::Wait { until_ms } => return Some(until_ms),
                Action::Cancel { id } => self.open.retain(|(open, cancelled)| {
                    if *open == id {
                        cancelled.store(true, Ordering::Relaxed);
                    }
                    *open != id
                }),
                Action::Fetch { id, shard, range, if_match } => self.fetch(id, shard, range, if_match),
                // Only those are told what a cache has who read it later: `want` has read it already.
                Action::Read { range } => self.loader.lost(&range),
            }
        }
    }

    fn fetch(&mut self, id: u32, shard: u64, range: Range<u64>, if_match: Option<String>) {
        let cancelled = Arc::new(AtomicBool::new(false));
        self.open.push((id, Arc::clone(&cancelled)));
        let url = self.led_to.get(&shard).cloned().unwrap_or_else(|| shard_address(&self.given, shard));
        let (client, sender) = (self.client.clone(), self.sender.clone());
        let run = move || {
            client.run((shard, &url), range, if_match, &mut |what| {
                !cancelled.load(Ordering::Relaxed) && sender.send(Event(id, what)).is_ok()
            })
        };
        if let Err(error) = thread::Builder::new().name("tetralod-http".to_owned()).spawn(run) {
            self.loader.failed(id, self.now(), Failure::Network(error.to_string()));
        }
    }

    fn take_in(&mut self, Event(id, what): Event) {
        let now = self.now();
        match what {
            What::Head(head) => self.take_head(id, &head),
            What::Data(bytes) => self.loader.data(id, now, &bytes),
            What::End => self.loader.end(id, now),
            What::Failed(failure) => self.loader.failed(id, now, failure),
        }
        if self.cache.is_none()
            && let Some(folder) = &self.options.cache
            && let Some(version) = self.loader.version()
        {
            self.cache = Some(Cache::open(folder, &self.given, version));
        }
    }

    fn take_head(&mut self, id: u32, head: &OwnedResponseHead) {
        if matches!(head.status, 401 | 403 | 404 | 410)
            && head.asked != shard_address(&self.given, head.shard)
        {
            // Addresses that redirects lead to may be good for a while only.
            if self.led_to.get(&head.shard) == Some(&head.asked) {
                self.led_to.remove(&head.shard);
            }
            self.asks_others &= self.options.headers.is_empty() || is_same_origin(&head.asked, &self.given);
            let expired = Failure::Network(format!("HTTP {} where a redirect led to", head.status));
            return self.loader.failed(id, self.now(), expired);
        }
        self.loader.head(id, self.now(), &head.head());
        let is_asked = self.asks_others || is_same_origin(&head.led_to, &self.given);
        if matches!(head.status, 200 | 206) && is_asked {
            self.led_to.insert(head.shard, head.led_to.clone());
        }
    }

    fn take(&mut self) -> Option<Arrived> {
        if let Some(found) = self.found.pop_front() {
            return Some(found);
        }
        let arrived = self.loader.take()?;
        if let Some(cache) = &mut self.cache {
            cache.put(&arrived.0, &arrived.1);
        }
        Some(arrived)
    }

    /// What comes first: something complete, an error, or the end of patience.
    fn wait(&mut self, patience: Duration) -> Result<Option<Arrived>, StreamError> {
        let end = self.clock + patience;
        loop {
            while let Ok(event) = self.events.try_recv() {
                self.take_in(event);
            }
            if let Some(arrived) = self.take() {
                return Ok(Some(arrived));
            }
            let until = self.obey();
            if let Some(error) = self.loader.error() {
                return Err(error.clone());
            }
            let Some(until) = until else { return Ok(None) };
            if self.clock >= end {
                return Ok(None);
            }
            let until = end.min(Duration::from_millis(until));
            let start = Instant::now();
            // At least a moment, for times are rounded.
            let left = until.saturating_sub(self.clock).max(Duration::from_millis(1));
            let event = self.events.recv_timeout(left);
            self.clock += start.elapsed().min(left);
            if let Ok(event) = event {
                self.take_in(event);
            }
        }
    }
}

impl RangeSource for HttpSource {
    fn want(&mut self, wanted: &[WantedRange]) {
        let Some(cache) = &mut self.cache else { return self.loader.want(wanted) };
        let mut missing = Vec::new();
        for wanted in wanted {
            match cache.get(&wanted.range) {
                Some(bytes) if self.found.iter().all(|(range, _)| *range != wanted.range) => {
                    self.found.push_back((wanted.range.clone(), bytes));
                }
                Some(_) => {}
                None => missing.push(wanted.clone()),
            }
        }
        self.loader.want(&missing);
    }

    fn next(&mut self, patience: Duration) -> Result<Option<Arrived>, StreamError> {
        self.wait(patience)
    }

    fn traffic(&self) -> Option<Traffic> {
        Some(self.loader.traffic())
    }

    fn total(&self) -> Option<u64> {
        self.loader.total()
    }
}

impl Drop for HttpSource {
    fn drop(&mut self) {
        for (_, cancelled) in &self.open {
            cancelled.store(true, Ordering::Relaxed);
        }
    }
}

/// Makes requests; its copies share their connections.
#[derive(Clone, Debug)]
struct Client {
    agent: Agent,
    /// The address that was given, and what its origin is sent.
    given: Arc<str>,
    headers: Arc<[(String, String)]>,
}

/// So many redirects are followed, one after the other.
const MAX_REDIRECTS: usize = 8;

impl Client {
    fn new(given: &str, options: &HttpOptions) -> Self {
        // The loader gives up first; the thread must not stay for ever.
        let patience = Some(Duration::from_millis(options.loader.timeout_ms.saturating_add(1000)));
        let config = Agent::config_builder()
            .http_status_as_error(false)
            // They are followed here, for other origins are not sent the same.
            .max_redirects(0)
            .max_redirects_will_error(false)
            .timeout_resolve(patience)
            .timeout_connect(patience)
            .timeout_recv_response(patience)
            .timeout_per_read(patience)
            .max_idle_connections_per_host(options.loader.max_requests)
            .user_agent(concat!("tetralod/", env!("CARGO_PKG_VERSION")))
            .accept_encoding("identity");
        let agent = config.build().new_agent();
        Self { agent, given: given.into(), headers: options.headers.clone().into() }
    }

    /// The answer, after redirects, and where they led to.
    fn ask(
        &self,
        url: &str,
        range: &str,
        if_match: Option<&str>,
    ) -> Result<(String, Response<Body>), ureq::Error> {
        let mut at = url.to_owned();
        for _ in 0..=MAX_REDIRECTS {
            let mut request = self.agent.get(&at).header(header::RANGE, range);
            if is_same_origin(&at, &self.given) {
                for (name, value) in self.headers.iter() {
                    request = request.header(name, value);
                }
            }
            if let Some(tag) = if_match {
                request = request.header(header::IF_MATCH, tag);
            }
            let response = request.call()?;
            let next = matches!(response.status().as_u16(), 301 | 302 | 303 | 307 | 308)
                .then(|| response.headers().get(header::LOCATION)?.to_str().ok())
                .flatten()
                .and_then(|location| Url::parse(&at).ok()?.join(location).ok());
            match next {
                Some(next) => at = next.into(),
                None => return Ok((at, response)),
            }
        }
        Err(ureq::Error::TooManyRedirects)
    }

    /// One request from beginning to end; `report` returns whether the answer is still wanted.
    fn run(
        &self,
        (shard, url): (u64, &str),
        range: Range<u64>,
        if_match: Option<String>,
        report: &mut dyn FnMut(What) -> bool,
    ) {
        // Without an end where it is not known: some servers read numbers as 32 or 53 bits.
        let last = if range.end == u64::MAX { String::new() } else { (range.end - 1).to_string() };
        let range = format!("bytes={}-{last}", range.start);
        let (led_to, response) = match self.ask(url, &range, if_match.as_deref()) {
            Ok(answer) => answer,
            Err(error) => {
                report(What::Failed(failure(&error)));
                return;
            }
        };
        if !report(What::Head(Box::new(OwnedResponseHead::of((shard, url), led_to, &response)))) {
            return;
        }
        let mut body = response.into_body().into_reader();
        let mut chunk = vec![0; CHUNK];
        loop {
            let what = match body.read(&mut chunk) {
                Ok(0) => What::End,
                Ok(count) => What::Data(chunk[..count].to_vec()),
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
                Err(error) => What::Failed(failure(&ureq::Error::from(error))),
            };
            let last = !matches!(what, What::Data(_));
            if !report(what) || last {
                return;
            }
        }
    }
}

/// The address of a shard of the file at `given`: the suffix belongs to the path.
fn shard_address(given: &str, shard: u64) -> String {
    let (path, rest) = given.split_at(given.find(['?', '#']).unwrap_or(given.len()));
    format!("{path}{}{rest}", shard_suffix(shard))
}

/// Whether two addresses have the scheme, the host and the port in common. Those that are none have not.
fn is_same_origin(a: &str, b: &str) -> bool {
    let [a, b] = [a, b].map(|url| Url::parse(url).map(|url| url.origin()));
    matches!((a, b), (Ok(a), Ok(b)) if a == b)
}

fn failure(error: &ureq::Error) -> Failure {
    match error {
        ureq::Error::Timeout(_) => Failure::Timeout,
        ureq::Error::Decompress(encoding, _) => Failure::Encoded((*encoding).to_owned()),
        other => Failure::Network(other.to_string()),
    }
}

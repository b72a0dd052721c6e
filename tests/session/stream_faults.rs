//! Promise: over real connections to a server that misbehaves, the right bytes come or an error that says what to do
//! about it, after a bounded number of requests, and nothing hangs.

use std::collections::HashSet;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::ops::Range;
use std::path::PathBuf;
use std::slice::from_ref;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};
use tetralod::stream::{
    CacheFolder, HttpOptions, HttpSource, LoaderOptions, RangeSource, StreamError, WantedRange,
};

const SIZE: u64 = 200_000;

/// Noise, as what is well packed is.
fn byte(at: u64) -> u8 {
    let mixed = at.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    ((mixed ^ mixed >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 56) as u8
}

fn bytes(range: Range<u64>) -> Vec<u8> {
    (range.start..range.end.min(SIZE)).map(byte).collect()
}

/// A request, as far as it matters here.
struct Asked {
    path: String,
    range: Range<u64>,
    if_match: Option<String>,
    /// What the caller sends along: `Authorization` and `X-Key`.
    secrets: Vec<String>,
    /// How many came before.
    number: usize,
}

/// What the server does, in order; then it closes the connection.
enum Step {
    Send(Vec<u8>),
    Sleep(u64),
    /// Says nothing more until the client goes away.
    Hang,
}

use Step::{Hang, Send, Sleep};

type Answers = dyn Fn(&Asked) -> Vec<Step> + std::marker::Send + Sync;

/// Counts what it is asked.
#[derive(Default)]
struct Counts {
    requests: AtomicUsize,
    open: AtomicUsize,
    most_open: AtomicUsize,
}

struct Server {
    url: String,
    counts: Arc<Counts>,
}

impl Server {
    fn start(answers: impl Fn(&Asked) -> Vec<Step> + std::marker::Send + Sync + 'static) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let url = format!("http://{}/file.mt", listener.local_addr().expect("an address"));
        let counts = Arc::new(Counts::default());
        let (answers, shared): (Arc<Answers>, _) = (Arc::new(answers), Arc::clone(&counts));
        thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let (answers, counts) = (Arc::clone(&answers), Arc::clone(&shared));
                thread::spawn(move || serve(stream, &*answers, &counts));
            }
        });
        Self { url, counts }
    }

    fn requests(&self) -> usize {
        self.counts.requests.load(Ordering::SeqCst)
    }
}

fn serve(stream: TcpStream, answers: &Answers, counts: &Counts) {
    let mut reader = BufReader::new(stream.try_clone().expect("a handle"));
    let Some(mut asked) = read_request(&mut reader) else { return };
    asked.number = counts.requests.fetch_add(1, Ordering::SeqCst);
    let open = counts.open.fetch_add(1, Ordering::SeqCst) + 1;
    counts.most_open.fetch_max(open, Ordering::SeqCst);
    let mut stream = stream;
    for step in answers(&asked) {
        match step {
            Send(bytes) => {
                if stream.write_all(&bytes).is_err() {
                    break;
                }
            }
            Sleep(ms) => thread::sleep(Duration::from_millis(ms)),
            Hang => drop(reader.read(&mut [0])),
        }
    }
    counts.open.fetch_sub(1, Ordering::SeqCst);
    let _ = stream.shutdown(Shutdown::Both);
}

fn read_request(reader: &mut impl BufRead) -> Option<Asked> {
    let mut line = String::new();
    reader.read_line(&mut line).ok()?;
    let path = line.split(' ').nth(1)?.to_owned();
    let mut asked = Asked { path, range: 0..SIZE, if_match: None, secrets: Vec::new(), number: 0 };
    loop {
        line.clear();
        reader.read_line(&mut line).ok()?;
        let Some((name, value)) = line.trim().split_once(": ") else { return Some(asked) };
        match name.to_ascii_lowercase().as_str() {
            "range" => {
                let (start, last) = value.strip_prefix("bytes=")?.split_once('-')?;
                let end = last.parse::<u64>().map_or(SIZE, |last| (last + 1).min(SIZE));
                asked.range = start.parse().ok()?..end;
            }
            "if-match" => asked.if_match = Some(value.to_owned()),
            "authorization" | "x-key" => asked.secrets.push(value.to_owned()),
            "accept-encoding" => assert_eq!(value, "identity", "ranges of packed bytes are of no use"),
            _ => {}
        }
    }
}

fn head(status: &str, fields: &str) -> Step {
    Send(format!("HTTP/1.1 {status}\r\n{fields}Connection: close\r\n\r\n").into_bytes())
}

/// The head of a good answer with `range` of the file.
fn part_head(range: &Range<u64>, tag: &str) -> Step {
    let (length, last) = (range.end - range.start, range.end - 1);
    let place = format!("Content-Range: bytes {}-{last}/{SIZE}\r\n", range.start);
    head("206 Partial Content", &format!("{place}Content-Length: {length}\r\nETag: \"{tag}\"\r\n"))
}

fn good(asked: &Asked) -> Vec<Step> {
    vec![part_head(&asked.range, "one"), Send(bytes(asked.range.clone()))]
}

fn whole(fields: &str) -> Vec<Step> {
    vec![head("200 OK", fields), Send(bytes(0..SIZE))]
}

/// Quick tries and small requests.
fn options() -> HttpOptions {
    let loader = LoaderOptions {
        retries: 3,
        backoff_ms: 10,
        timeout_ms: 400,
        max_request_bytes: 30_000,
        gap: Some(500),
        ..LoaderOptions::default()
    };
    HttpOptions { loader, ..HttpOptions::default() }
}

const WANTED: [Range<u64>; 5] = [0..1000, 1200..50_000, 60_000..60_010, 100_000..160_000, 199_000..SIZE + 7];

/// Fetches `ranges` and checks every byte.
fn fetch_with(url: &str, options: HttpOptions, ranges: &[Range<u64>]) -> Result<HttpSource, StreamError> {
    let mut source = HttpSource::new(url, options);
    fetch_from(&mut source, ranges).map(|()| source)
}

fn fetch_from(source: &mut HttpSource, ranges: &[Range<u64>]) -> Result<(), StreamError> {
    let mut left = ranges.to_vec();
    let list: Vec<_> =
        left.iter().map(|r| WantedRange { range: r.clone(), priority: -(r.start as f32) }).collect();
    source.want(&list);
    let start = Instant::now();
    while !left.is_empty() {
        if let Some((range, got)) = source.next(Duration::from_secs(1))? {
            assert!(got == bytes(range.clone()), "{range:?} has other bytes");
            assert!(left.contains(&range), "{range:?} came twice");
            left.retain(|wanted| *wanted != range);
        }
        assert!(start.elapsed() < Duration::from_secs(60), "it hangs");
    }
    Ok(())
}

/// All of `WANTED` comes, in at most so many requests.
fn works(most: usize, answers: impl Fn(&Asked) -> Vec<Step> + std::marker::Send + Sync + 'static) -> Server {
    let server = Server::start(answers);
    if let Err(error) = fetch_with(&server.url, options(), &WANTED) {
        panic!("{error}");
    }
    assert!(server.requests() <= most, "{} requests", server.requests());
    assert!(server.counts.most_open.load(Ordering::SeqCst) <= 6 + 1, "too many at a time");
    server
}

/// It ends with an error, after at most so many requests.
fn fails(
    most: usize,
    answers: impl Fn(&Asked) -> Vec<Step> + std::marker::Send + Sync + 'static,
) -> StreamError {
    let server = Server::start(answers);
    let error = fetch_with(&server.url, options(), &WANTED).map(drop).expect_err("an error");
    assert!(server.requests() <= most, "{} requests: {error:?}", server.requests());
    error
}

/// What a good server needs: the first range with its neighbour, and the others in parts of up to 30 000 bytes.
const FEW: usize = 8;

#[test]
fn a_good_server_is_asked_for_little_more_than_is_wanted() {
    let server = works(FEW, good);
    let source = fetch_with(&server.url, options(), &WANTED).expect("it works");
    let wanted: u64 = WANTED.iter().map(|range| range.end.min(SIZE) - range.start).sum();
    let traffic = source.traffic().expect("it is a network");
    assert_eq!(traffic.used, wanted);
    assert!(traffic.received <= wanted + 500, "{traffic:?}");
    assert_eq!((source.total(), source.serves_ranges()), (Some(SIZE), Some(true)));
}

#[test]
fn cut_connections_are_taken_up_where_they_ended() {
    let asked = Arc::new(Mutex::new(Vec::new()));
    let seen = Arc::clone(&asked);
    works(4 * FEW, move |asked| {
        seen.lock().unwrap().push(asked.range.clone());
        let length = asked.range.end - asked.range.start;
        let sent = if length > 9000 { 9000 } else { length };
        vec![part_head(&asked.range, "one"), Send(bytes(asked.range.start..asked.range.start + sent))]
    });
    let asked = asked.lock().unwrap();
    assert!(asked.iter().any(|range| range.start == 9000), "{asked:?}");
    let fetched: u64 = asked.iter().map(|range| (range.end - range.start).min(9000)).sum();
    assert!(fetched <= SIZE, "nothing is fetched twice");
}

#[test]
fn a_server_that_only_ever_cuts_is_given_up() {
    let error = fails(50, |asked| vec![part_head(&asked.range, "one")]);
    assert!(matches!(error, StreamError::Network(_)), "{error}");
    let error = fails(50, |_| vec![Send(b"HTTP/1.1 206 Part".to_vec())]);
    assert!(matches!(error, StreamError::Network(_)), "{error}");
}

#[test]
fn slow_drips_are_waited_for() {
    let server = Server::start(|asked| {
        let mut steps = vec![part_head(&asked.range, "one")];
        for at in asked.range.clone().step_by(100) {
            steps.push(Send(bytes(at..(at + 100).min(asked.range.end))));
            steps.push(Sleep(60));
        }
        steps
    });
    fetch_with(&server.url, options(), from_ref(&(0..1000)))
        .expect("it comes, though later than the timeout");
    assert_eq!(server.requests(), 1);
}

#[test]
fn a_server_that_hangs_is_given_up_or_recovers() {
    let hanging = [
        vec![],
        vec![Send(b"HTTP/1.1 2".to_vec())],
        vec![part_head(&(0..30_000), "one"), Send(bytes(0..10))],
    ];
    for steps in hanging {
        let steps = Mutex::new(Some(steps));
        works(FEW + 1, move |asked| match steps.lock().unwrap().take() {
            Some(mut steps) => {
                steps.push(Hang);
                steps
            }
            None => good(asked),
        });
    }
    let error = fails(4, |_| vec![Hang]);
    assert_eq!(error, StreamError::Timeout);
    assert!(error.to_string().contains("overloaded"));
}

#[test]
fn server_errors_pass_or_are_reported() {
    for status in ["500 Oops", "502 Bad Gateway", "503 Busy\r\nRetry-After: 0", "429 Too Many"] {
        works(FEW + 3, move |asked| {
            let failing = vec![head(status, "Content-Length: 4\r\n"), Send(b"oops".to_vec())];
            if asked.number % 3 == 1 { failing } else { good(asked) }
        });
    }
    let error = fails(4, |_| vec![head("500 Oops", "")]);
    assert_eq!(error, StreamError::Status(500));
    for (status, code) in [("404 Not Found", 404), ("403 Forbidden", 403)] {
        let error = fails(1, move |_| vec![head(status, "Content-Length: 0\r\n")]);
        assert_eq!(error, StreamError::Status(code));
    }
}

#[test]
fn answers_with_another_range_are_not_taken() {
    let wrong = |asked: &Asked| {
        let range = asked.range.start + 1..asked.range.end + 1;
        vec![part_head(&range, "one"), Send(bytes(range))]
    };
    let error = fails(4, wrong);
    assert!(matches!(error, StreamError::WrongRange(_)), "{error}");
    assert!(error.to_string().contains("bytes 1-30000/200000"), "{error}");
    works(FEW + 2, move |asked| if asked.number == 2 { wrong(asked) } else { good(asked) });
}

#[test]
fn parts_of_what_was_asked_for_are_welcome() {
    works(4 * FEW, |asked| {
        let range = asked.range.start..asked.range.end.min(asked.range.start + 10_000);
        vec![part_head(&range, "one"), Send(bytes(range))]
    });
}

#[test]
fn a_server_without_ranges_is_read_once() {
    works(1, |_| whole(&format!("Content-Length: {SIZE}\r\n")));
    // Neither with a length: the end of the connection is the end of the file.
    works(1, |_| whole(""));
    // Cut once: from the start again, and only what was missing is taken.
    works(2, |asked| {
        let mut steps = whole(&format!("Content-Length: {SIZE}\r\n"));
        if asked.number == 0 {
            steps[1] = Send(bytes(0..120_000));
        }
        steps
    });
}

#[test]
fn parts_of_packed_bytes_are_refused_with_advice() {
    let packed = packed();
    let refused = |most, coding: &'static str| {
        let packed = packed.clone();
        let error = fails(most, move |asked| {
            let part = &packed[asked.range.start as usize..asked.range.end as usize];
            let (last, total) = (asked.range.end - 1, packed.len());
            let place = format!("Content-Range: bytes {}-{last}/{total}\r\n", asked.range.start);
            let length = format!("Content-Length: {}\r\n", part.len());
            let fields = format!("Content-Encoding: {coding}\r\n{place}{length}");
            vec![head("206 Partial Content", &fields), Send(part.to_vec())]
        });
        assert_eq!(error, StreamError::Encoded(coding.to_owned()));
        assert!(error.to_string().contains("switch compression off"));
    };
    // The beginning can be unpacked as far as it goes; the parts after it, all asked for by then, cannot.
    refused(FEW, "gzip");
    refused(1, "zstd");
}

#[test]
fn a_file_that_is_packed_as_a_whole_is_unpacked() {
    let packed = packed();
    works(1, move |_| vec![head("200 OK", "Content-Encoding: gzip\r\n"), Send(packed.clone())]);
    let error = fails(1, |_| vec![head("200 OK", "Content-Encoding: zstd\r\n"), Send(vec![40, 181])]);
    assert_eq!(error, StreamError::Encoded("zstd".to_owned()));
}

/// The whole file as gzip; its bytes are noise, so it is no shorter.
fn packed() -> Vec<u8> {
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packer.write_all(&bytes(0..SIZE)).expect("it is memory");
    packer.finish().expect("it is memory")
}

#[test]
fn web_pages_are_not_taken_for_the_file() {
    let error =
        fails(1, |_| vec![head("200 OK", "Content-Type: text/html\r\n"), Send(b"<p>Log in".to_vec())]);
    assert_eq!(error, StreamError::WebPage);
}

#[test]
fn a_file_that_changes_is_noticed() {
    // At the second request, in four ways.
    let ways: [fn(&Asked) -> Vec<Step>; 4] = [
        |asked| vec![part_head(&asked.range, "two"), Send(bytes(asked.range.clone()))],
        |asked| {
            assert_eq!(asked.if_match.as_deref(), Some("\"one\""));
            vec![head("412 Precondition Failed", "Content-Length: 0\r\n")]
        },
        |asked| {
            let last = asked.range.end - 1;
            vec![head(
                "206 P",
                &format!("Content-Range: bytes {}-{last}/{}\r\n", asked.range.start, SIZE + 1),
            )]
        },
        |_| vec![head("200 OK", "Content-Length: 7\r\n"), Send(b"changed".to_vec())],
    ];
    for way in ways {
        let error = fails(FEW, move |asked| if asked.number == 0 { good(asked) } else { way(asked) });
        assert_eq!(error, StreamError::Changed);
    }
    // The new version can then be read.
    let server = Server::start(|asked| {
        let tag = if asked.number == 0 { "one" } else { "two" };
        vec![part_head(&asked.range, tag), Send(bytes(asked.range.clone()))]
    });
    let mut source = HttpSource::new(&server.url, options());
    assert_eq!(fetch_from(&mut source, &WANTED), Err(StreamError::Changed));
    source.retry();
    fetch_from(&mut source, &WANTED).expect("the new version");
}

/// Fetches all from a server that redirects each request to an address of its own at another origin, which may be good for one request.
fn through_another_origin(is_good_for_one: bool) -> [Server; 2] {
    let secrets: [Arc<Mutex<Vec<Vec<String>>>>; 2] = Default::default();
    let [told, told_there] = secrets.clone();
    let used = Mutex::new(HashSet::new());
    let there = Server::start(move |asked| {
        told_there.lock().expect("a list").push(asked.secrets.clone());
        let is_new = used.lock().expect("a set").insert(asked.path.clone());
        if is_new || !is_good_for_one {
            good(asked)
        } else {
            vec![head("403 Forbidden", "Content-Length: 0\r\n")]
        }
    });
    let location = there.url.clone();
    let here = Server::start(move |asked| {
        told.lock().expect("a list").push(asked.secrets.clone());
        vec![head("302 Found", &format!("Location: {location}?{}\r\nContent-Length: 0\r\n", asked.number))]
    });
    let headers = [("Authorization", "Bearer secret"), ("X-Key", "secret")];
    let headers = headers.map(|(name, value)| (name.to_owned(), value.to_owned())).to_vec();
    let mut source = HttpSource::new(&here.url, HttpOptions { headers, ..options() });
    fetch_from(&mut source, &WANTED).expect("the ranges");
    let [told, told_there] = secrets;
    assert!(
        told.lock().expect("a list").iter().all(|secrets| secrets.len() == 2),
        "the given origin is told"
    );
    assert!(
        told_there.lock().expect("a list").iter().all(Vec::is_empty),
        "another one is told {told_there:?}"
    );
    [here, there]
}

#[test]
fn headers_of_the_caller_go_to_no_other_origin() {
    let [here, there] = through_another_origin(false);
    assert!(here.requests() < there.requests(), "where it leads to is asked directly");
}

#[test]
fn another_origin_that_refuses_without_the_headers_is_asked_by_way_of_the_given_one() {
    let [here, there] = through_another_origin(true);
    // Those that were asked for at the same time as the first one that is refused.
    assert!(there.requests() <= here.requests() + options().loader.max_requests);
}

#[test]
fn redirects_are_followed_once_and_again_when_they_expire() {
    // For each range at most the expired address, the given one, and where that leads now.
    let server = works(3 * FEW, |asked| match asked.path.as_str() {
        "/file.mt" => {
            let to = format!("Location: /elsewhere-{}\r\nContent-Length: 0\r\n", asked.number);
            vec![head("302 Found", &to)]
        }
        path => {
            // The first addresses are good for three requests. On a slow machine the first request is repeated, and there are several.
            let number: Option<usize> =
                path.strip_prefix("/elsewhere-").and_then(|number| number.parse().ok());
            let has_expired = number.is_some_and(|number| number < 3 && asked.number > number + 3);
            if has_expired { vec![head("403 Expired", "Content-Length: 0\r\n")] } else { good(asked) }
        }
    });
    assert!(server.requests() > FEW, "it was redirected twice");
    let error = fails(50, |asked| vec![head("302 Found", &format!("Location: {}x\r\n", asked.path))]);
    assert!(!error.may_pass() || matches!(error, StreamError::Network(_)), "{error}");
}

#[test]
fn no_server_is_reported() {
    let address = TcpListener::bind("127.0.0.1:0").expect("a port").local_addr().expect("an address");
    let error =
        fetch_with(&format!("http://{address}/x"), options(), &WANTED).map(drop).expect_err("an error");
    assert!(matches!(error, StreamError::Network(_)), "{error}");
    let error = fetch_with("http://", options(), &WANTED).map(drop).expect_err("an error");
    assert!(matches!(error, StreamError::Network(_)), "{error}");
}

#[test]
fn what_is_wanted_no_longer_is_not_waited_for() {
    let server = Server::start(|asked| if asked.range.start == 100_000 { vec![Hang] } else { good(asked) });
    let mut source = fetch_with(&server.url, options(), from_ref(&(0..10))).expect("it works");
    source.want(&[WantedRange { range: 100_000..100_100, priority: 1.0 }]);
    assert_eq!(source.next(Duration::from_millis(50)), Ok(None));
    fetch_from(&mut source, from_ref(&(5000..6000))).expect("it works");
    let start = Instant::now();
    while server.counts.open.load(Ordering::SeqCst) > 0 {
        assert!(start.elapsed() < Duration::from_secs(10), "the old request is still open");
        thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn what_was_fetched_once_is_kept_for_the_next_time() {
    let tag = Arc::new(Mutex::new("one"));
    let current = Arc::clone(&tag);
    let server = Server::start(move |asked| {
        vec![part_head(&asked.range, *current.lock().unwrap()), Send(bytes(asked.range.clone()))]
    });
    let path: PathBuf = std::env::temp_dir().join(format!("tetralod-faults-{}", std::process::id()));
    let cache = Some(CacheFolder { path: path.clone(), max_bytes: 1 << 20 });
    let cached = || HttpOptions { cache: cache.clone(), ..options() };
    // The first range always comes from the server: it tells which version that has.
    let open = || fetch_with(&server.url, cached(), from_ref(&(0..10))).expect("it works");
    let fetched = |source: &mut HttpSource| {
        fetch_from(source, &WANTED).expect("it works");
        source.traffic().expect("it is a network").received
    };
    assert!(fetched(&mut open()) > 100_000);
    assert_eq!(fetched(&mut open()), 10);
    *tag.lock().unwrap() = "two";
    assert!(fetched(&mut open()) > 100_000);
    let _ = std::fs::remove_dir_all(path);
}

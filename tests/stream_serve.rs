//! Promise: `tetralod serve` answers as readers of byte ranges need it, shows nothing but what it was told to, and ends
//! when it is asked to.
#![cfg(feature = "serve")]

mod cli_support;

use cli_support::Folder;
use cli_support::bad;
use cli_support::command;
use std::fs;
use std::io::BufRead;
use std::io::BufReader;
use std::io::Read;
use std::io::Write;
use std::net::TcpStream;
use std::process::Child;
use std::process::Stdio;

const DIGITS: &str = "0123456789";

/// A server that ends with the test.
struct Server {
    child: Child,
    address: String,
    path: String,
}

impl Server {
    fn start(arguments: &[&str]) -> Self {
        let mut all = vec!["serve", "--port", "0"];
        all.extend(arguments);
        let mut child =
            command(&all).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("it starts");
        let mut line = String::new();
        BufReader::new(child.stdout.take().expect("a pipe")).read_line(&mut line).expect("a line");
        let rest = line.trim().strip_prefix("http://").expect("it prints its address");
        let (address, path) = rest.split_once('/').expect("with a path");
        Self { child, address: address.to_owned(), path: format!("/{path}") }
    }

    fn ask(&self, method: &str, path: &str, headers: &[(&str, &str)]) -> Answer {
        let mut stream = TcpStream::connect(&self.address).expect("it listens");
        let headers: String = headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
        write!(stream, "{method} {path} HTTP/1.1\r\nHost: x\r\n{headers}Connection: close\r\n\r\n").unwrap();
        let mut text = String::new();
        stream.read_to_string(&mut text).expect("an answer");
        let (head, body) = text.split_once("\r\n\r\n").expect("a head");
        Answer {
            status: head[9..12].parse().expect("a status"),
            head: head.to_owned(),
            body: body.to_owned(),
        }
    }

    fn get(&self, path: &str, headers: &[(&str, &str)]) -> Answer {
        self.ask("GET", path, headers)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

struct Answer {
    status: u16,
    head: String,
    body: String,
}

impl Answer {
    fn header(&self, name: &str) -> Option<&str> {
        let lines = self.head.lines().filter_map(|line| line.split_once(": "));
        lines.filter(|(found, _)| found.eq_ignore_ascii_case(name)).map(|(_, value)| value).next()
    }
}

/// A folder with `www/digits.mt`, `www/index.html`, and `secret` outside of `www`.
fn folder(name: &str) -> (Folder, String) {
    let folder = Folder::new(name);
    let www = folder.path("www");
    fs::create_dir_all(&www).expect("a folder");
    fs::write(folder.path("www/digits.mt"), DIGITS).expect("a file");
    fs::write(folder.path("www/index.html"), "<p>").expect("a file");
    fs::write(folder.path("secret"), "secret").expect("a file");
    (folder, www)
}

#[test]
fn whole_files_carry_what_readers_and_caches_need() {
    let (_folder, www) = folder("serve-whole");
    let server = Server::start(&[&www]);
    assert_eq!(server.path, "/");
    let answer = server.get("/digits.mt", &[("Origin", "https://example.org")]);
    assert_eq!((answer.status, answer.body.as_str()), (200, DIGITS));
    for (name, value) in [
        ("content-type", "application/octet-stream"),
        ("content-length", "10"),
        ("accept-ranges", "bytes"),
        ("cache-control", "no-cache"),
        ("access-control-allow-origin", "*"),
        ("x-content-type-options", "nosniff"),
    ] {
        assert_eq!(answer.header(name), Some(value), "{name}");
    }
    assert!(answer.header("etag").is_some_and(|tag| tag.starts_with('"')), "{}", answer.head);
    assert!(answer.header("last-modified").is_some());
    let exposed = answer.header("access-control-expose-headers").expect("headers are exposed");
    for name in ["content-range", "etag", "accept-ranges", "content-length"] {
        assert!(exposed.contains(name), "{name} in {exposed}");
    }
    let head = server.ask("HEAD", "/digits.mt", &[]);
    assert_eq!((head.status, head.header("content-length"), head.body.as_str()), (200, Some("10"), ""));
    assert!(server.get("/", &[]).header("content-type").is_some_and(|kind| kind.starts_with("text/html")));
    assert_eq!(server.ask("POST", "/digits.mt", &[]).status, 405);
}

#[test]
fn ranges_are_answered_exactly() {
    let (_folder, www) = folder("serve-ranges");
    let server = Server::start(&[&www]);
    for (range, content_range, body) in [
        ("bytes=2-4", "bytes 2-4/10", "234"),
        ("bytes=7-", "bytes 7-9/10", "789"),
        ("bytes=-3", "bytes 7-9/10", "789"),
        ("bytes=8-99", "bytes 8-9/10", "89"),
    ] {
        let answer = server.get("/digits.mt", &[("Range", range)]);
        assert_eq!((answer.status, answer.body.as_str()), (206, body), "{range}");
        assert_eq!(answer.header("content-range"), Some(content_range), "{range}");
    }
    let beyond = server.get("/digits.mt", &[("Range", "bytes=10-")]);
    assert_eq!((beyond.status, beyond.header("content-range")), (416, Some("bytes */10")));
    // Several ranges at once are not given; a whole file may always be.
    assert_eq!(server.get("/digits.mt", &[("Range", "bytes=0-1,3-4")]).body, DIGITS);
}

#[test]
fn a_file_that_was_replaced_is_noticed() {
    let (folder, www) = folder("serve-tags");
    let server = Server::start(&[&www]);
    let first = server.get("/digits.mt", &[]);
    let (tag, date) = (first.header("etag").unwrap(), first.header("last-modified").unwrap());
    let part = |held: (&str, &str)| server.get("/digits.mt", &[("Range", "bytes=2-4"), held]);
    assert_eq!(part(("If-Range", tag)).body, "234");
    assert_eq!(part(("If-Range", date)).body, "234");
    assert_eq!(part(("If-Match", tag)).body, "234");
    assert_eq!(server.get("/digits.mt", &[("If-None-Match", tag)]).status, 304);
    assert_eq!(server.get("/digits.mt", &[("If-Modified-Since", date)]).status, 304);
    fs::write(folder.path("www/digits.mt"), "abcdefghijk").expect("a file");
    let whole = part(("If-Range", tag));
    assert_eq!((whole.status, whole.body.as_str()), (200, "abcdefghijk"));
    assert_eq!(part(("If-Match", tag)).status, 412);
    let fresh = server.get("/digits.mt", &[("If-None-Match", tag)]);
    assert_eq!(fresh.status, 200);
    assert_ne!(fresh.header("etag"), Some(tag));
}

#[test]
fn nothing_else_is_shown() {
    let (folder, www) = folder("serve-outside");
    let server = Server::start(&[&www]);
    for path in
        ["/../secret", "/%2e%2e/secret", "/..%2fsecret", "/x/../../secret", "/..%5csecret", "/%00", "/none"]
    {
        let answer = server.get(path, &[]);
        assert!(matches!(answer.status, 400 | 404), "{path}: {}", answer.status);
        assert!(!answer.body.contains("secret"), "{path}");
        assert_eq!(answer.header("cache-control").unwrap_or("no-store"), "no-store", "{path}");
    }
    fs::write(folder.path("www/a b{c}.mt"), "one").expect("a file");
    let one = Server::start(&[&folder.path("www/a b{c}.mt")]);
    assert_eq!(one.path, "/a%20b%7Bc%7D.mt");
    assert_eq!(one.get(&one.path, &[("Range", "bytes=0-1")]).body, "on");
    for path in ["/", "/digits.mt", "/../secret"] {
        assert_eq!(one.get(path, &[]).status, 404, "{path}");
    }
}

#[test]
fn other_origins_and_caches_are_told_what_was_chosen() {
    let (_folder, www) = folder("serve-cors");
    let page = ("Origin", "https://example.org");
    let server = Server::start(&[&www, "--cors", "https://example.org", "--cache", "60"]);
    let answer = server.get("/digits.mt", &[page, ("Range", "bytes=0-0")]);
    assert_eq!(answer.header("access-control-allow-origin"), Some("https://example.org"));
    assert_eq!(answer.header("cache-control"), Some("public, max-age=60"));
    let asked = [page, ("Access-Control-Request-Method", "GET"), ("Access-Control-Request-Headers", "range")];
    let preflight = server.ask("OPTIONS", "/digits.mt", &asked);
    assert_eq!(preflight.status, 200);
    assert!(preflight.header("access-control-allow-headers").is_some_and(|names| names.contains("range")));
    let server = Server::start(&[&www, "--cors", "none"]);
    assert_eq!(server.get("/digits.mt", &[page]).header("access-control-allow-origin"), None);
}

#[test]
fn what_cannot_be_served_is_refused_with_a_reason() {
    let (folder, www) = folder("serve-refused");
    bad(1, &["serve", &folder.path("none")], &["none"]);
    bad(1, &["serve", "--port", "0", "--cors", "example.org", &www], &["--cors", "https://"]);
    let server = Server::start(&[&www]);
    let port = server.address.rsplit_once(':').unwrap().1;
    bad(1, &["serve", "--port", port, &www], &[port, "--port"]);
}

#[test]
#[cfg(unix)]
fn it_ends_well_when_it_is_asked_to() {
    let (_folder, www) = folder("serve-end");
    for signal in ["-INT", "-TERM"] {
        let mut server = Server::start(&[&www]);
        // A connection that nobody uses does not keep it.
        let _idle = TcpStream::connect(&server.address).expect("it listens");
        assert_eq!(server.get("/digits.mt", &[]).status, 200);
        let id = server.child.id().to_string();
        let sent = std::process::Command::new("kill").args([signal, &id]).status().expect("kill runs");
        assert!(sent.success());
        assert!(server.child.wait().expect("it ends").success(), "{signal}");
        assert!(TcpStream::connect(&server.address).is_err());
    }
}

#[test]
#[cfg(feature = "http")]
fn the_project_s_own_client_gets_along_with_it() {
    use std::time::Duration;
    use tetralod::stream::HttpOptions;
    use tetralod::stream::HttpSource;
    use tetralod::stream::RangeSource;
    use tetralod::stream::StreamError;
    use tetralod::stream::WantedRange;

    let (folder, www) = folder("serve-client");
    let server = Server::start(&[&www]);
    let mut source = HttpSource::new(&format!("http://{}/digits.mt", server.address), HttpOptions::default());
    let wanted = |range| [WantedRange { range, priority: 0.0 }];
    source.want(&wanted(2..5));
    assert_eq!(source.next(Duration::from_secs(20)), Ok(Some((2..5, b"234".to_vec()))));
    assert_eq!((source.total(), source.serves_ranges()), (Some(10), Some(true)));
    fs::write(folder.path("www/digits.mt"), "abcdefghijk").expect("a file");
    source.want(&wanted(2..5));
    assert_eq!(source.next(Duration::from_secs(20)), Err(StreamError::Changed));
    source.retry();
    assert_eq!(source.next(Duration::from_secs(20)), Ok(Some((2..5, b"cde".to_vec()))));
    source.want(&wanted(5..50));
    assert_eq!(source.next(Duration::from_secs(20)), Ok(Some((5..50, b"fghijk".to_vec()))));
}

//! Promise: `tetralod serve` answers as readers of byte ranges need it, shows nothing but what it was told to, and ends
//! when it is asked to.

use crate::support::{Folder, Server, bad};
use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};
use tetralod::stream::{HttpOptions, HttpSource, RangeSource, StreamError, WantedRange};

const DIGITS: &str = "0123456789";

fn ask(server: &Server, method: &str, path: &str, headers: &[(&str, &str)]) -> Answer {
    ask_as("localhost", server, method, path, headers)
}

/// Asks for something by this name of the server.
fn ask_as(host: &str, server: &Server, method: &str, path: &str, headers: &[(&str, &str)]) -> Answer {
    let mut stream = TcpStream::connect(server.address().0).expect("it listens");
    let headers: String = headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
    let head = format!("{method} {path} HTTP/1.1\r\nHost: {host}\r\n{headers}Connection: close\r\n\r\n");
    stream.write_all(head.as_bytes()).expect("it listens");
    let mut text = String::new();
    stream.read_to_string(&mut text).expect("an answer");
    let (head, body) = text.split_once("\r\n\r\n").expect("a head");
    Answer { status: head[9..12].parse().expect("a status"), head: head.to_owned(), body: body.to_owned() }
}

fn get(server: &Server, path: &str, headers: &[(&str, &str)]) -> Answer {
    ask(server, "GET", path, headers)
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
    assert_eq!(server.address().1, "/");
    let answer = get(&server, "/digits.mt", &[("Origin", "https://example.org")]);
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
    let head = ask(&server, "HEAD", "/digits.mt", &[]);
    assert_eq!((head.status, head.header("content-length"), head.body.as_str()), (200, Some("10"), ""));
    assert!(get(&server, "/", &[]).header("content-type").is_some_and(|kind| kind.starts_with("text/html")));
    assert_eq!(ask(&server, "POST", "/digits.mt", &[]).status, 405);
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
        ("bytes=-99", "bytes 0-9/10", DIGITS),
    ] {
        let answer = get(&server, "/digits.mt", &[("Range", range)]);
        assert_eq!((answer.status, answer.body.as_str()), (206, body), "{range}");
        assert_eq!(answer.header("content-range"), Some(content_range), "{range}");
    }
    for beyond in ["bytes=10-", "bytes=-0"] {
        let answer = get(&server, "/digits.mt", &[("Range", beyond)]);
        assert_eq!((answer.status, answer.header("content-range")), (416, Some("bytes */10")), "{beyond}");
        assert_eq!(answer.body, "", "{beyond}");
    }
    // Several ranges at once, and what is no range, get the whole file.
    for ignored in ["bytes=4-2", "bytes=0-1,3-4", "lines=1-2", "bytes=a-b", "bytes=-"] {
        let answer = get(&server, "/digits.mt", &[("Range", ignored)]);
        assert_eq!((answer.status, answer.body.as_str()), (200, DIGITS), "{ignored}");
    }
}

#[test]
fn a_file_that_was_replaced_is_noticed() {
    let (folder, www) = folder("serve-tags");
    let server = Server::start(&[&www]);
    let first = get(&server, "/digits.mt", &[]);
    let (tag, date) = (first.header("etag").unwrap(), first.header("last-modified").unwrap());
    let part = |held: (&str, &str)| get(&server, "/digits.mt", &[("Range", "bytes=2-4"), held]);
    assert_eq!(part(("If-Range", tag)).body, "234");
    assert_eq!(part(("If-Range", date)).body, "234");
    assert_eq!(part(("If-Match", tag)).body, "234");
    assert_eq!(get(&server, "/digits.mt", &[("If-None-Match", tag)]).status, 304);
    assert_eq!(get(&server, "/digits.mt", &[("If-Modified-Since", date)]).status, 304);
    fs::write(folder.path("www/digits.mt"), "abcdefghijk").expect("a file");
    let whole = part(("If-Range", tag));
    assert_eq!((whole.status, whole.body.as_str()), (200, "abcdefghijk"));
    assert_eq!(part(("If-Match", tag)).status, 412);
    let fresh = get(&server, "/digits.mt", &[("If-None-Match", tag)]);
    assert_eq!(fresh.status, 200);
    assert_ne!(fresh.header("etag"), Some(tag));
}

#[test]
fn nothing_else_is_shown() {
    let (folder, www) = folder("serve-outside");
    // Links that lead outside are not followed.
    #[cfg(unix)]
    {
        fs::create_dir_all(folder.path("www/linked")).expect("a folder");
        for link in ["www/link", "www/linked/index.html"] {
            std::os::unix::fs::symlink(folder.path("secret"), folder.path(link)).expect("a link");
        }
    }
    let server = Server::start(&[&www]);
    for path in [
        "/../secret",
        "/%2e%2e/secret",
        "/..%2fsecret",
        "/x/../../secret",
        "/..%5csecret",
        "/%00",
        "/%zz",
        "/none",
        "/link",
        "/linked/",
        "/linked/index.html",
    ] {
        let answer = get(&server, path, &[]);
        assert!(matches!(answer.status, 400 | 404), "{path}: {}", answer.status);
        assert!(!answer.body.contains("secret"), "{path}");
        assert_eq!(answer.header("cache-control").unwrap_or("no-store"), "no-store", "{path}");
    }
    fs::write(folder.path("www/a b{c}.mt"), "one").expect("a file");
    let one = Server::start(&[&folder.path("www/a b{c}.mt")]);
    assert_eq!(one.address().1, "/a%20b%7Bc%7D.mt");
    assert_eq!(get(&one, one.address().1, &[("Range", "bytes=0-1")]).body, "on");
    for path in ["/", "/digits.mt", "/../secret"] {
        assert_eq!(get(&one, path, &[]).status, 404, "{path}");
    }
}

#[test]
fn hidden_files_are_not_served() {
    let (folder, www) = folder("serve-hidden");
    for hidden in ["www/.git", "www/sub/.cache"] {
        fs::create_dir_all(folder.path(hidden)).expect("a folder");
    }
    for hidden in ["www/.git/config", "www/.env", "www/sub/.cache/secret.mt"] {
        fs::write(folder.path(hidden), "secret").expect("a file");
    }
    let server = Server::start(&[&www, "--mount", &format!("/m={www}")]);
    let paths =
        ["/.git/config", "/%2egit/config", "/.env", "/%2Eenv", "/sub/.cache/secret.mt", "/sub/..%2f.env"];
    for path in paths {
        for path in [path.to_owned(), format!("/m{path}")] {
            let answer = get(&server, &path, &[]);
            assert_eq!((answer.status, answer.body.as_str()), (404, ""), "{path}");
        }
    }
}

#[test]
fn no_address_leads_to_another_server() {
    let (folder, www) = folder("serve-redirect");
    fs::create_dir_all(folder.path("www/sub")).expect("a folder");
    let server = Server::start(&[&www]);
    assert_eq!(get(&server, "/sub", &[]).header("location"), Some("/sub/"));
    for path in ["//sub", "///sub", "//example.org/..", "/%2Fsub", "/%2f/sub", "/\\sub", "/%5csub"] {
        let answer = get(&server, path, &[]);
        assert_eq!(answer.header("location"), None, "{path}: {}", answer.head);
        assert!(matches!(answer.status, 400 | 404), "{path}: {}", answer.status);
    }
}

#[test]
fn what_is_for_this_machine_answers_to_its_names_alone() {
    let (_folder, www) = folder("serve-names");
    let ask = |server: &Server, host: &str| ask_as(host, server, "GET", "/digits.mt", &[]);
    let server = Server::start(&[&www]);
    let address = server.address().0;
    for name in [address, "localhost", "LOCALHOST:1", "volumes.localhost", "127.0.0.2:80", "[::1]:8080"] {
        assert_eq!(ask(&server, name).body, DIGITS, "{name}");
    }
    for name in
        ["example.org", "example.org:8080", "localhost.example.org", "192.168.0.1", "0.0.0.0", "", "a b"]
    {
        let answer = ask(&server, name);
        assert!(matches!(answer.status, 400 | 421), "{name}: {}", answer.status);
        assert!(!answer.body.contains(DIGITS), "{name}");
    }
    let mut server = Server::start(&[&www, "--host", "0.0.0.0"]);
    server.url = server.url.replace("0.0.0.0", "127.0.0.1");
    assert_eq!(ask(&server, "example.org").body, DIGITS);
}

#[test]
fn pages_of_other_origins_may_read_mt_files_alone_unless_more_is_asked_for() {
    let (folder, www) = folder("serve-shared");
    fs::write(folder.path("www/notes.txt"), "notes").expect("a file");
    let page = [("Origin", "https://example.org"), ("Access-Control-Request-Method", "GET")];
    let allowed = |server: &Server, path: &str| {
        let [answer, preflight] = ["GET", "OPTIONS"].map(|method| ask(server, method, path, &page));
        let policy = answer.header("cross-origin-resource-policy").map(str::to_owned);
        let [a, b] = [&answer, &preflight]
            .map(|answer| answer.header("access-control-allow-origin").map(str::to_owned));
        assert_eq!(a, b, "{path}");
        (a.as_deref() == Some("*"), policy.as_deref() == Some("cross-origin"))
    };
    let server = Server::start(&[&www]);
    assert_eq!(allowed(&server, "/digits.mt"), (true, true));
    for path in ["/", "/notes.txt", "/none", "/index.html"] {
        assert_eq!(allowed(&server, path), (false, false), "{path}");
    }
    let server = Server::start(&[&www, "--cors", "*"]);
    assert_eq!(allowed(&server, "/notes.txt"), (true, true));
    let server = Server::start(&[&folder.path("www/notes.txt")]);
    assert_eq!(allowed(&server, "/notes.txt"), (true, true), "the one file that was named");
    let server = Server::start(&[&www, "--cors", "none"]);
    assert_eq!(allowed(&server, "/digits.mt"), (false, false));
}

#[test]
fn other_origins_and_caches_are_told_what_was_chosen() {
    let (_folder, www) = folder("serve-cors");
    let page = ("Origin", "https://example.org");
    let server = Server::start(&[&www, "--cors", "https://example.org", "--cache", "60"]);
    let answer = get(&server, "/digits.mt", &[page, ("Range", "bytes=0-0")]);
    assert_eq!(answer.header("access-control-allow-origin"), Some("https://example.org"));
    assert_eq!(answer.header("cache-control"), Some("public, max-age=60"));
    let asked = [page, ("Access-Control-Request-Method", "GET"), ("Access-Control-Request-Headers", "range")];
    let preflight = ask(&server, "OPTIONS", "/digits.mt", &asked);
    assert_eq!(preflight.status, 200);
    assert!(preflight.header("access-control-allow-headers").is_some_and(|names| names.contains("range")));
    let server = Server::start(&[&www, "--cors", "none"]);
    assert_eq!(get(&server, "/digits.mt", &[page]).header("access-control-allow-origin"), None);
}

#[test]
fn pages_and_their_modules_have_the_types_that_browsers_ask_for() {
    let (folder, www) = folder("serve-types");
    let package = folder.path("package");
    fs::create_dir_all(folder.path("package/sub")).expect("a folder");
    fs::write(folder.path("package/index.js"), "1").expect("a file");
    fs::write(folder.path("package/sub/index.html"), "<b>").expect("a file");
    fs::write(folder.path("www/a b.wasm"), "\0asm").expect("a file");
    let server = Server::start(&[&www, "--mount", &format!("/pkg={package}")]);
    for (path, kind, body) in [
        ("/", "text/html", "<p>"),
        ("/index.html", "text/html", "<p>"),
        ("/a%20b.wasm", "application/wasm", "\0asm"),
        ("/pkg/index.js", "text/javascript", "1"),
        ("/pkg/sub/", "text/html", "<b>"),
    ] {
        let answer = get(&server, path, &[]);
        assert_eq!((answer.status, answer.body.as_str()), (200, body), "{path}");
        assert!(answer.header("content-type").is_some_and(|found| found.starts_with(kind)), "{path}");
    }
    assert_eq!(get(&server, "/pkg/sub", &[]).header("location"), Some("/pkg/sub/"));
    for path in ["/pkg/../secret", "/pkg/%2e%2e/secret", "/pkg/none", "/index.js"] {
        assert_eq!(get(&server, path, &[]).status, 404, "{path}");
    }
}

#[test]
fn connections_that_wait_do_not_keep_others_waiting() {
    let (folder, www) = folder("serve-idle");
    fs::write(folder.path("www/large.mt"), vec![1; 4 << 20]).expect("a file");
    let server = Server::start(&[&www]);
    // Some say nothing, some stop in the middle of a request, some take nothing of what they asked for, one is open between two requests:
    // more of them than there may be.
    let begun =
        ["", "GET /digits.mt HTTP/1.1\r\nHost: local", "GET /large.mt HTTP/1.1\r\nHost: localhost\r\n\r\n"];
    let connect = |i: usize| {
        let mut stream = TcpStream::connect(server.address().0).expect("it listens");
        stream
            .write_all(begun[usize::from(!i.is_multiple_of(8)) + usize::from(i % 40 == 1)].as_bytes())
            .expect("it listens");
        stream
    };
    let waiting: Vec<TcpStream> = (0..450).map(connect).collect();
    assert_eq!(get(&server, "/digits.mt", &[]).body, DIGITS);
    drop(waiting);
}

#[test]
fn a_throttled_file_takes_its_time() {
    let (_folder, www) = folder("serve-throttle");
    let server = Server::start(&[&www]);
    let start = Instant::now();
    let answer = get(&server, "/digits.mt?throttle=50", &[]);
    assert_eq!((answer.body.as_str(), answer.header("content-length")), (DIGITS, Some("10")));
    assert!(start.elapsed() >= Duration::from_millis(180), "{:?}", start.elapsed());
}

#[test]
fn what_cannot_be_served_is_refused_with_a_reason() {
    let (folder, www) = folder("serve-refused");
    bad(1, &["serve", &folder.path("none")], &["none"]);
    bad(1, &["serve", "--mount", "/pkg=nowhere", &www], &["--mount /pkg", "nowhere"]);
    for mount in ["pkg=nowhere", "/=nowhere", "/pkg", "/{x}=nowhere"] {
        bad(2, &["serve", "--mount", mount, &www], &["--mount", "node_modules"]);
    }
    bad(1, &["serve", "--port", "0", "--cors", "example.org", &www], &["--cors", "https://"]);
    let server = Server::start(&[&www]);
    let port = server.address().0.rsplit_once(':').unwrap().1;
    bad(1, &["serve", "--port", port, &www], &[port, "--port"]);
}

#[test]
#[cfg(unix)]
fn it_ends_well_when_it_is_asked_to() {
    let (_folder, www) = folder("serve-end");
    for signal in ["-INT", "-TERM"] {
        let mut server = Server::start(&[&www]);
        // A connection that nobody uses does not keep it.
        let _idle = TcpStream::connect(server.address().0).expect("it listens");
        assert_eq!(get(&server, "/digits.mt", &[]).status, 200);
        let id = server.child.id().to_string();
        let sent = std::process::Command::new("kill").args([signal, &id]).status().expect("kill runs");
        assert!(sent.success());
        assert!(server.child.wait().expect("it ends").success(), "{signal}");
        assert!(TcpStream::connect(server.address().0).is_err());
    }
}

#[test]
fn the_project_s_own_client_gets_along_with_it() {
    let (folder, www) = folder("serve-client");
    let server = Server::start(&[&www]);
    let mut source = HttpSource::new(&format!("{}digits.mt", server.url), HttpOptions::default());
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

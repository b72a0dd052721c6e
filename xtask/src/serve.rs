//! A static file server for localhost: single byte ranges, right media types, and a throttle that makes a fast disk as
//! slow as a network (`?throttle=BYTES_PER_SECOND`), so that streaming can be seen and tested.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use anyhow::{Context, Result};

/// Browsers connect ahead of time; such a connection is not kept for ever.
const PATIENCE: Duration = Duration::from_secs(120);

/// The head of a request may have so many bytes.
const LONGEST_HEAD: u64 = 64 << 10;

/// Requests below `prefix` are answered from `folder`.
#[derive(Clone, Debug)]
pub struct Mount {
    prefix: String,
    folder: PathBuf,
}

impl Mount {
    /// Serves `folder`, which must exist, below `prefix`, which ends in a slash.
    pub fn new(prefix: &str, folder: &str) -> Result<Self> {
        let folder = Path::new(folder).canonicalize().with_context(|| format!("serving {folder}"))?;
        Ok(Self { prefix: prefix.to_owned(), folder })
    }
}

/// Starts to serve `mounts` (the first whose prefix fits answers) and returns the address with a final slash.
/// Port 0 takes any free one.
///
/// Each connection has a thread and one request. In a pool of threads that stay with their connections, one can wait for
/// another to end; that kept pages from starting.
pub fn start(mounts: Vec<Mount>, port: u16) -> Result<String> {
    let listener = TcpListener::bind(("127.0.0.1", port)).with_context(|| format!("port {port}"))?;
    let address = listener.local_addr()?;
    thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let mounts = mounts.clone();
            // A client that went away is no concern of the server.
            thread::spawn(move || answer(&stream, &mounts).ok());
        }
    });
    Ok(format!("http://{address}/"))
}

/// What matters of the head of a request.
struct Request {
    method: String,
    url: String,
    range: Option<String>,
}

fn answer(mut stream: &TcpStream, mounts: &[Mount]) -> io::Result<()> {
    stream.set_read_timeout(Some(PATIENCE))?;
    let Some(request) = read_head(&mut BufReader::new(stream.take(LONGEST_HEAD)))? else { return Ok(()) };
    let (status, fields, body) = match reply(&request, mounts) {
        Ok(reply) => (reply.status, reply.fields, Some(reply.body)),
        Err(status) => (status, "Content-Type: text/plain\r\nContent-Length: 0\r\n".to_owned(), None),
    };
    let common = "Accept-Ranges: bytes\r\nCache-Control: no-cache\r\nX-Content-Type-Options: nosniff\r\n";
    // The reason may be empty.
    write!(stream, "HTTP/1.1 {status} \r\n{fields}{common}Connection: close\r\n\r\n")?;
    match body {
        Some(mut body) if request.method != "HEAD" => io::copy(&mut body, &mut stream).map(drop),
        _ => Ok(()),
    }
}

/// None if the connection ends before there is a request.
fn read_head(reader: &mut impl BufRead) -> io::Result<Option<Request>> {
    let mut line = String::new();
    reader.read_line(&mut line)?;
    let mut words = line.split(' ').map(str::to_owned);
    let (Some(method), Some(url)) = (words.next(), words.next()) else { return Ok(None) };
    let mut request = Request { method, url, range: None };
    loop {
        line.clear();
        if reader.read_line(&mut line)? == 0 {
            return Ok(None);
        }
        match line.trim_end().split_once(':') {
            None => return Ok(Some(request)),
            Some((name, value)) if name.eq_ignore_ascii_case("range") => {
                request.range = Some(value.trim().to_owned());
            }
            Some(_) => {}
        }
    }
}

struct Reply {
    status: u16,
    /// Each with its end of line.
    fields: String,
    body: Throttled<io::Take<File>>,
}

/// The answer, or the status of an empty one.
fn reply(request: &Request, mounts: &[Mount]) -> Result<Reply, u16> {
    if !matches!(request.method.as_str(), "GET" | "HEAD") {
        return Err(405);
    }
    let (path, query) = request.url.split_once('?').unwrap_or((&request.url, ""));
    let path = locate(path, mounts).ok_or(404_u16)?;
    let mut file = File::open(&path).map_err(|_| 404_u16)?;
    let size = file.metadata().map_err(|_| 500_u16)?.len();
    let range = request.range.as_ref().map_or(Range::Whole, |value| parse_range(value, size));
    let (status, start, length) = match range {
        Range::Whole => (200, 0, size),
        Range::Part { start, end } => (206, start, end - start),
        Range::Unsatisfiable => (416, 0, 0),
    };
    file.seek(SeekFrom::Start(start)).map_err(|_| 500_u16)?;
    let body = Throttled { inner: file.take(length), bytes_per_second: throttle(query) };
    let place = match range {
        Range::Whole => String::new(),
        Range::Part { start, end } => format!("Content-Range: bytes {start}-{}/{size}\r\n", end - 1),
        Range::Unsatisfiable => format!("Content-Range: bytes */{size}\r\n"),
    };
    let fields = format!("Content-Type: {}\r\nContent-Length: {length}\r\n{place}", media_type(&path));
    Ok(Reply { status, fields, body })
}

/// The file that `path` names, only if it lies inside its mount.
fn locate(path: &str, mounts: &[Mount]) -> Option<PathBuf> {
    let path = decode_percent(path)?;
    let mount = mounts.iter().find(|mount| path.starts_with(&mount.prefix))?;
    let mut file = mount.folder.clone();
    for part in path[mount.prefix.len()..].split('/').filter(|part| !part.is_empty()) {
        if part == "." || part == ".." || part.contains(['\\', '\0', ':']) {
            return None;
        }
        file.push(part);
    }
    if file.is_dir() {
        file.push("index.html");
    }
    // Links may point elsewhere; what they point at must lie inside too.
    let file = file.canonicalize().ok()?;
    (file.starts_with(&mount.folder) && file.is_file()).then_some(file)
}

fn decode_percent(text: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(if byte == b'%' { hex(rest.next()?)? * 16 + hex(rest.next()?)? } else { byte });
    }
    String::from_utf8(bytes).ok()
}

fn hex(digit: u8) -> Option<u8> {
    char::from(digit).to_digit(16).and_then(|value| u8::try_from(value).ok())
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Range {
    Whole,
    /// `start..end`, not empty.
    Part {
        start: u64,
        end: u64,
    },
    Unsatisfiable,
}

/// RFC 9110, section 14: a header that is malformed or names several ranges is ignored.
fn parse_range(value: &str, size: u64) -> Range {
    let Some((first, last)) = value.trim().strip_prefix("bytes=").and_then(|range| range.split_once('-'))
    else {
        return Range::Whole;
    };
    let (start, end) = match (first.trim().parse::<u64>(), last.trim().parse::<u64>()) {
        (Ok(start), Ok(last)) if start <= last => (start, last.saturating_add(1).min(size)),
        (Ok(start), Err(_)) if last.trim().is_empty() => (start, size),
        (Err(_), Ok(suffix)) if first.trim().is_empty() => (size - suffix.min(size), size),
        _ => return Range::Whole,
    };
    if start < end { Range::Part { start, end } } else { Range::Unsatisfiable }
}

fn throttle(query: &str) -> Option<u64> {
    let value = query.split('&').find_map(|pair| pair.strip_prefix("throttle="))?;
    value.parse().ok().filter(|rate| *rate > 0)
}

fn media_type(path: &Path) -> &'static str {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("html") => "text/html; charset=utf-8",
        Some("js" | "mjs") => "text/javascript; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("json" | "map") => "application/json",
        Some("wasm") => "application/wasm",
        Some("svg") => "image/svg+xml",
        Some("png") => "image/png",
        Some("ico") => "image/x-icon",
        Some("md" | "ts" | "txt") => "text/plain; charset=utf-8",
        _ => "application/octet-stream",
    }
}

/// Hands on at most `bytes_per_second`, in twenty portions a second.
struct Throttled<R> {
    inner: R,
    bytes_per_second: Option<u64>,
}

impl<R: Read> Read for Throttled<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let Some(rate) = self.bytes_per_second else { return self.inner.read(buffer) };
        let portion = usize::try_from(rate.div_ceil(20)).unwrap_or(usize::MAX).min(buffer.len());
        let read = self.inner.read(&mut buffer[..portion])?;
        thread::sleep(Duration::from_secs_f64(read as f64 / rate as f64));
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;

    /// A server over a fresh folder: `www/page.html`, `www/digits` (0 to 9) and, outside, `secret`.
    fn serve(name: &str) -> String {
        let folder = std::env::temp_dir().join(format!("tetralod-serve-{}-{name}", std::process::id()));
        std::fs::create_dir_all(folder.join("www")).unwrap();
        std::fs::write(folder.join("www/page.html"), "<p>").unwrap();
        std::fs::write(folder.join("www/digits"), "0123456789").unwrap();
        std::fs::write(folder.join("www/a b.wasm"), "\0asm").unwrap();
        std::fs::write(folder.join("secret"), "secret").unwrap();
        start(vec![Mount::new("/", folder.join("www").to_str().unwrap()).unwrap()], 0).unwrap()
    }

    /// Status, headers in lower case, and body of one request.
    fn get(server: &str, path: &str, range: Option<&str>) -> (u16, String, String) {
        let address = server.trim_start_matches("http://").trim_end_matches('/');
        let mut stream = TcpStream::connect(address).unwrap();
        let range = range.map_or(String::new(), |range| format!("Range: {range}\r\n"));
        write!(stream, "GET {path} HTTP/1.1\r\nHost: x\r\n{range}Connection: close\r\n\r\n").unwrap();
        let mut reader = BufReader::new(stream);
        let mut head = String::new();
        while reader.read_line(&mut head).unwrap() > 2 {}
        let mut body = String::new();
        reader.read_to_string(&mut body).unwrap();
        (head[9..12].parse().unwrap(), head.to_lowercase(), body)
    }

    #[test]
    fn whole_files_have_a_type_a_length_and_no_cache() {
        let server = serve("whole");
        let (status, head, body) = get(&server, "/page.html", None);
        assert_eq!((status, body.as_str()), (200, "<p>"));
        assert!(head.contains("content-type: text/html") && head.contains("content-length: 3"), "{head}");
        assert!(head.contains("cache-control: no-cache") && head.contains("accept-ranges: bytes"), "{head}");
        assert!(get(&server, "/a%20b.wasm", None).1.contains("content-type: application/wasm"));
    }

    #[test]
    fn ranges_are_answered_exactly() {
        let server = serve("ranges");
        for (range, status, content_range, body) in [
            ("bytes=2-4", 206, "bytes 2-4/10", "234"),
            ("bytes=7-", 206, "bytes 7-9/10", "789"),
            ("bytes=-3", 206, "bytes 7-9/10", "789"),
            ("bytes=8-99", 206, "bytes 8-9/10", "89"),
            ("bytes=-99", 206, "bytes 0-9/10", "0123456789"),
            ("bytes=10-", 416, "bytes */10", ""),
            ("bytes=-0", 416, "bytes */10", ""),
        ] {
            let (got, head, text) = get(&server, "/digits", Some(range));
            assert_eq!((got, text.as_str()), (status, body), "{range}");
            assert!(head.contains(&format!("content-range: {content_range}")), "{range}: {head}");
        }
        for ignored in ["bytes=4-2", "bytes=0-1,3-4", "lines=1-2", "bytes=a-b", "bytes=-"] {
            assert_eq!(get(&server, "/digits", Some(ignored)).0, 200, "{ignored}");
        }
    }

    #[test]
    fn nothing_outside_the_folder_is_served() {
        let server = serve("outside");
        for path in [
            "/../secret",
            "/%2e%2e/secret",
            "/..%2fsecret",
            "/x/../../secret",
            "/..%5csecret",
            "/%00",
            "/%zz",
            "/none",
        ] {
            assert_eq!(get(&server, path, None).0, 404, "{path}");
        }
    }

    #[test]
    #[cfg(unix)]
    fn a_link_that_leads_outside_is_not_followed() {
        let server = serve("link");
        let folder = std::env::temp_dir().join(format!("tetralod-serve-{}-link", std::process::id()));
        let link = folder.join("www/link");
        if !link.exists() {
            std::os::unix::fs::symlink(folder.join("secret"), link).unwrap();
        }
        assert_eq!(get(&server, "/link", None).0, 404);
    }

    #[test]
    fn connections_that_wait_do_not_keep_others_waiting() {
        let server = serve("idle");
        let address = server.trim_start_matches("http://").trim_end_matches('/');
        let idle: Vec<TcpStream> = (0..40).map(|_| TcpStream::connect(address).unwrap()).collect();
        assert_eq!(get(&server, "/digits", None).2, "0123456789");
        drop(idle);
    }

    #[test]
    fn a_throttled_file_takes_its_time() {
        let server = serve("throttle");
        let start = Instant::now();
        assert_eq!(get(&server, "/digits?throttle=50", None).2, "0123456789");
        assert!(start.elapsed() >= Duration::from_millis(180), "{:?}", start.elapsed());
    }
}

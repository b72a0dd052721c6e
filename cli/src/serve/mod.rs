//! `tetralod serve`: a static server for MT files, with what their readers ask of one.
//!
//! Readers fetch byte ranges, from other origins, and must notice when the file is replaced between two of them: hence
//! Range, CORS with the headers that scripts have to see, and entity tags. Any good host does the same; this one is for
//! the own machine and for data that does not leave the house.

mod connections;

use crate::files;
use anyhow::{Context, Result, bail};
use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::Request;
use axum::http::uri::Authority;
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use futures_util::StreamExt;
use futures_util::stream::unfold;
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, percent_decode_str, utf8_percent_encode};
use std::io::Write;
use std::net::{IpAddr, SocketAddr};
use std::path::{Path, PathBuf};
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::sync::watch;
use tower_http::cors::{AllowOrigin, CorsLayer};
use tower_http::services::{ServeDir, ServeFile};

/// What scripts of other origins must be able to read of an answer.
const EXPOSED: [HeaderName; 7] = [
    header::ACCEPT_RANGES,
    header::CONTENT_ENCODING,
    header::CONTENT_LENGTH,
    header::CONTENT_RANGE,
    header::ETAG,
    header::LAST_MODIFIED,
    header::RETRY_AFTER,
];

/// What they may send.
const ACCEPTED: [HeaderName; 4] = [header::IF_MATCH, header::IF_NONE_MATCH, header::IF_RANGE, header::RANGE];

/// What lets pages of other origins read an answer.
const CORS: [HeaderName; 2] = [header::ACCESS_CONTROL_ALLOW_ORIGIN, header::ACCESS_CONTROL_EXPOSE_HEADERS];

/// What is no plain character of an address.
const RESERVED: &AsciiSet = &NON_ALPHANUMERIC.remove(b'-').remove(b'.').remove(b'_').remove(b'~');

/// What pages that are served may do: nothing that a page with volumes needs is among what is forbidden.
const POLICY: &str = "base-uri 'self'; form-action 'self'; object-src 'none'";

/// Serves MT files to pages and programs: byte ranges, entity tags, CORS.
#[derive(clap::Args)]
pub struct Arguments {
    /// The folder to serve, or the one file. Files whose names, or whose folders' names, begin with a dot are not served, and links that
    /// lead out of a folder not followed.
    #[arg(default_value = ".", value_name = "DIR|FILE")]
    path: PathBuf,
    /// The port to listen on; 0 takes any that is free.
    #[arg(long, default_value_t = 8080)]
    port: u16,
    /// The address to listen on; 0.0.0.0 lets other machines in. On the own machine only requests for localhost are answered.
    #[arg(long, default_value = "127.0.0.1")]
    host: String,
    /// How long a copy may be used unasked; with 0 browsers ask each time whether theirs still holds.
    #[arg(long, value_name = "SECONDS", default_value_t = 0)]
    cache: u32,
    /// The origin whose pages may read the files, * for any, none for those of this server alone. Without it pages of any origin may read
    /// MT files (.mt), and nothing else.
    #[arg(long, value_name = "ORIGIN")]
    cors: Option<String>,
    /// Serve another folder below an address (repeatable): --mount /pkg=node_modules/tetralod.
    #[arg(long = "mount", value_name = "/NAME=DIR", value_parser = parse_mount)]
    mounts: Vec<(String, PathBuf)>,
}

fn parse_mount(text: &str) -> Result<(String, PathBuf), String> {
    let parts = text.split_once('=').filter(|(at, _)| {
        let name = at.strip_prefix('/').unwrap_or_default();
        !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "-._/".contains(c))
    });
    let (at, folder) = parts.ok_or("it must be an address and a folder, as in /pkg=node_modules/tetralod")?;
    Ok((at.trim_end_matches('/').to_owned(), folder.into()))
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let (router, path) = router(arguments)?;
    let shared = match arguments.cors.as_deref() {
        Some("none") => Shared::Nothing,
        None if arguments.path.is_dir() => Shared::MtFiles,
        // The one file is meant to be read, whatever its name.
        _ => Shared::All,
    };
    let router = with_headers(router, arguments.cache, shared, arguments.cors.as_deref())?;
    listen(router, &arguments.host, &[arguments.port], |address| announce(address, &path))
}

/// Answers on the first of `ports` that is free, until Ctrl-C; says when it has begun.
pub fn listen(
    router: Router,
    host: &str,
    ports: &[u16],
    begun: impl FnOnce(SocketAddr) -> Result<()>,
) -> Result<()> {
    let stop = stop_on_interrupt()?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let served = runtime.block_on(async {
        let listener = bind(host, ports).await?;
        let address = listener.local_addr()?;
        let names = Names::of(host, address.ip());
        let router = router.layer(middleware::from_fn(move |request: Request, next: Next| {
            let known = names.include(&request);
            async move { if known { next.run(request).await } else { misdirected() } }
        }));
        begun(address)?;
        connections::serve(listener, router, stop).await;
        Ok(())
    });
    // A file that is being read from a slow disk does not hold up the end.
    runtime.shutdown_background();
    served
}

async fn bind(host: &str, ports: &[u16]) -> Result<TcpListener> {
    let mut result = Err(std::io::ErrorKind::AddrNotAvailable.into());
    let mut tried = 0;
    for &port in ports {
        (result, tried) = (TcpListener::bind((host, port)).await, port);
        if result.is_ok() {
            break;
        }
    }
    result.with_context(|| {
        format!("{host}:{tried} cannot be listened on; choose another --port, or 0 for any that is free")
    })
}

/// What answers, and the path at which it does.
fn router(arguments: &Arguments) -> Result<(Router, String)> {
    let path = &arguments.path;
    let found = std::fs::metadata(path).with_context(|| path.display().to_string())?;
    let (mut router, at) = if found.is_dir() { (folder("", path)?, "/".to_owned()) } else { file(path)? };
    for (at, path) in &arguments.mounts {
        let files = folder(at, path).with_context(|| format!("--mount {at}"))?;
        router = router.nest_service(at, files);
    }
    Ok((router, at))
}

/// The files in the folder at `path`, below the address `at`.
pub fn folder(at: &str, path: &Path) -> Result<Router> {
    let root = path.canonicalize().with_context(|| path.display().to_string())?;
    let files = ServeDir::new(&root).redirect_path_prefix(at);
    let guard = middleware::from_fn(move |request: Request, next: Next| {
        let path = percent_decode_str(request.uri().path()).decode_utf8_lossy().into_owned();
        let file = root.join(path.trim_start_matches('/'));
        let root = root.clone();
        async move {
            if is_hidden(&path) || leads_out(&root, file).await {
                with_status(StatusCode::NOT_FOUND)
            } else {
                next.run(request).await
            }
        }
    });
    Ok(Router::new().fallback_service(files).layer(guard))
}

/// Whether a path has a part that begins with a dot, or an empty one: a redirect to `//name/` would lead to another server.
fn is_hidden(path: &str) -> bool {
    path.contains("//") || path.split(['/', '\\']).any(|part| part.starts_with('.'))
}

/// Whether a file that is there lies outside of the folder `root`: a link may lead there.
async fn leads_out(root: &Path, file: PathBuf) -> bool {
    let index = file.join("index.html");
    let outside =
        async |path: PathBuf| tokio::fs::canonicalize(path).await.is_ok_and(|found| !found.starts_with(root));
    outside(file).await || outside(index).await
}

/// The one file at `path`, and its address.
fn file(path: &Path) -> Result<(Router, String)> {
    let name = path.file_name().and_then(|name| name.to_str());
    let Some(name) = name else { bail!("{}: a name in UTF-8 is needed for the address", path.display()) };
    let at = format!("/{}", utf8_percent_encode(name, RESERVED));
    // Braces mean something in a route: the one file is therefore asked for by its exact address.
    let (file, only) = (path.to_owned(), at.clone());
    let answer = move |request: Request| {
        let (file, suffix) = (file.clone(), request.uri().path().strip_prefix(&only).map(str::to_owned));
        async move {
            match suffix {
                Some(suffix) => file_or_shard(&file, &suffix, request).await,
                None => with_status(StatusCode::NOT_FOUND),
            }
        }
    };
    Ok((Router::new().fallback(answer), at))
}

/// Answers with the file at `path`, or with the shard of it that has this suffix.
pub async fn file_or_shard(path: &Path, suffix: &str, request: Request) -> Response {
    let is_shard = suffix.strip_prefix('.').is_some_and(|number| number.bytes().all(|b| b.is_ascii_digit()));
    if !suffix.is_empty() && !is_shard {
        return with_status(StatusCode::NOT_FOUND);
    }
    match ServeFile::new(files::with_suffix(path, suffix)).try_call(request).await {
        Ok(response) => response.into_response(),
        Err(_) => with_status(StatusCode::NOT_FOUND),
    }
}

pub fn with_status(status: StatusCode) -> Response {
    let mut response = Response::default();
    *response.status_mut() = status;
    response
}

/// Puts on all answers what does not depend on the file: how long copies may be used (in seconds), and what pages of other origins may read.
pub fn with_headers(router: Router, cache: u32, shared: Shared, origin: Option<&str>) -> Result<Router> {
    let caching = match cache {
        0 => HeaderValue::from_static("no-cache"),
        seconds => HeaderValue::try_from(format!("public, max-age={seconds}"))?,
    };
    let router = router.layer(middleware::from_fn(ranges)).layer(middleware::from_fn(throttle));
    let router = match shared {
        Shared::Nothing => router,
        Shared::MtFiles | Shared::All => router.layer(cors(origin.unwrap_or("*"))?),
    };
    Ok(router.layer(middleware::from_fn(move |request: Request, next: Next| {
        let (caching, shared) = (caching.clone(), shared.has(request.uri().path()));
        async move {
            let mut response = next.run(request).await;
            label(&mut response, caching, shared);
            response
        }
    })))
}

/// What pages of other origins may read.
#[derive(Clone, Copy)]
pub enum Shared {
    Nothing,
    MtFiles,
    All,
}

impl Shared {
    fn has(self, path: &str) -> bool {
        match self {
            Self::Nothing => false,
            Self::MtFiles => is_mt_file(path),
            Self::All => true,
        }
    }
}

/// Whether a path is that of an MT file, or of a shard of one.
fn is_mt_file(path: &str) -> bool {
    let name = path.trim_end_matches(|c: char| c.is_ascii_digit());
    let name = if name.len() + 4 <= path.len() { name.strip_suffix('.').unwrap_or(path) } else { path };
    name.to_ascii_lowercase().ends_with(".mt")
}

/// What a server is called by those who mean it. A page elsewhere can give its own name the address of this machine, to read what is served
/// here as if it were its own (DNS rebinding): what is for this machine alone answers to its names alone.
#[derive(Clone)]
enum Names {
    Any,
    Local(String),
}

impl Names {
    /// The names of what listens to `address`, which the user called `host`.
    fn of(host: &str, address: IpAddr) -> Self {
        if address.is_loopback() { Self::Local(host.to_ascii_lowercase()) } else { Self::Any }
    }

    fn include(&self, request: &Request) -> bool {
        let Self::Local(own) = self else { return true };
        // Programs from before there was the header ask for nobody in particular.
        let Some(named) = request.headers().get(header::HOST) else { return true };
        let Some(authority) = named.to_str().ok().and_then(|text| text.parse::<Authority>().ok()) else {
            return false;
        };
        let name = authority.host().trim_matches(['[', ']']).to_ascii_lowercase();
        let is_loopback = name.parse::<IpAddr>().is_ok_and(|address| address.is_loopback());
        is_loopback || name == *own || name == "localhost" || name.ends_with(".localhost")
    }
}

fn misdirected() -> Response {
    let mut response =
        Response::new(Body::from("this server answers to localhost; `--host` opens it to others\n"));
    *response.status_mut() = StatusCode::MISDIRECTED_REQUEST;
    response
}

/// Puts the headers on an answer that do not depend on the file.
fn label(response: &mut Response, caching: HeaderValue, shared: bool) {
    let good = response.status().is_success() || response.status() == StatusCode::NOT_MODIFIED;
    let headers = response.headers_mut();
    // A file that is missing now may be there in a moment.
    headers.insert(header::CACHE_CONTROL, if good { caching } else { HeaderValue::from_static("no-store") });
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY));
    // For pages that are isolated to use threads.
    let policy = if shared { "cross-origin" } else { "same-origin" };
    let name = HeaderName::from_static("cross-origin-resource-policy");
    headers.insert(name, HeaderValue::from_static(policy));
    if !shared {
        for name in CORS {
            headers.remove(name);
        }
    }
}

fn cors(origin: &str) -> Result<CorsLayer> {
    let origin = match origin {
        "*" => AllowOrigin::any(),
        one if one.contains("://") && !one.ends_with('/') => AllowOrigin::exact(HeaderValue::from_str(one)?),
        other => {
            bail!("--cors {other}: an origin looks like https://example.org; * allows any, none no other")
        }
    };
    Ok(CorsLayer::new()
        .allow_origin(origin)
        .allow_methods([Method::GET, Method::HEAD])
        .allow_headers(ACCEPTED)
        .expose_headers(EXPOSED)
        .max_age(Duration::from_secs(3600)))
}

/// Answers ranges as RFC 9110 has it where the server of files does not: with the whole file where the range is none or is
/// of a file that the reader has an older version of, and where the end is longer than the file, with all of it.
async fn ranges(mut request: Request, next: Next) -> Response {
    let headers = request.headers_mut();
    let range = headers.remove(header::RANGE).filter(is_one_range);
    let held = headers.remove(header::IF_RANGE);
    let Some(range) = range else { return next.run(request).await };
    let (parts, _) = request.into_parts();
    let with_range = |range: Option<HeaderValue>| {
        let mut parts = parts.clone();
        parts.headers.extend(range.map(|range| (header::RANGE, range)));
        Request::from_parts(parts, Body::empty())
    };
    let mut response = next.clone().run(with_range(Some(range.clone()))).await;
    if response.status() == StatusCode::RANGE_NOT_SATISFIABLE && is_end(&range) {
        response = next.clone().run(with_range(Some(HeaderValue::from_static("bytes=0-")))).await;
    }
    let holds = held.is_none_or(|held| still_holds(&held, response.headers()));
    if holds || response.status() != StatusCode::PARTIAL_CONTENT {
        return response;
    }
    next.run(with_range(None)).await
}

/// Whether a range is some bytes at the end of a file, however long that is.
fn is_end(range: &HeaderValue) -> bool {
    let length = range.to_str().ok().and_then(|text| text.strip_prefix("bytes=-")?.parse::<u64>().ok());
    length.is_some_and(|length| length > 0)
}

/// Whether a header asks for one range of bytes; RFC 9110, section 14.2, lets a server ignore all others.
fn is_one_range(value: &HeaderValue) -> bool {
    let range = value.to_str().ok().and_then(|text| text.strip_prefix("bytes=")?.split_once('-'));
    let Some((first, last)) = range else { return false };
    match (first.parse::<u64>(), last.parse::<u64>()) {
        (Ok(first), Ok(last)) => first <= last,
        (Ok(_), Err(_)) => last.is_empty(),
        (Err(_), Ok(_)) => first.is_empty(),
        (Err(_), Err(_)) => false,
    }
}

/// Sends a body as slowly as `?throttle=BYTES_PER_SECOND` says, so that a page can be seen while its data arrives.
async fn throttle(request: Request, next: Next) -> Response {
    let mut entries = request.uri().query().unwrap_or_default().split('&');
    let rate = entries.find_map(|entry| entry.strip_prefix("throttle=")?.parse().ok());
    let response = next.run(request).await;
    match rate.filter(|rate: &u32| *rate > 0) {
        Some(rate) => response.map(|body| slowed(body, rate)),
        None => response,
    }
}

/// Hands on `rate` bytes a second, in twenty portions.
fn slowed(body: Body, rate: u32) -> Body {
    let portion = rate.div_ceil(20) as usize;
    let portions = unfold((body.into_data_stream(), Bytes::new()), move |(mut rest, mut bytes)| async move {
        if bytes.is_empty() {
            match rest.next().await? {
                Ok(more) => bytes = more,
                Err(error) => return Some((Err(error), (rest, bytes))),
            }
        }
        let next = bytes.split_to(portion.min(bytes.len()));
        tokio::time::sleep(Duration::from_secs_f64(next.len() as f64 / f64::from(rate))).await;
        Some((Ok(next), (rest, bytes)))
    });
    Body::from_stream(portions)
}

/// Whether `held`, an entity tag or a date, names the file of this answer; weak tags do not name bytes.
fn still_holds(held: &HeaderValue, found: &HeaderMap) -> bool {
    let tag = found.get(header::ETAG).filter(|tag| !tag.as_bytes().starts_with(b"W/"));
    tag == Some(held) || found.get(header::LAST_MODIFIED) == Some(held)
}

/// Becomes true at the first Ctrl-C or SIGTERM; the second ends the program.
fn stop_on_interrupt() -> Result<watch::Receiver<bool>> {
    let (stop, stopped) = watch::channel(false);
    let interrupted = move || {
        if stop.send_replace(true) {
            std::process::exit(files::INTERRUPTED);
        }
    };
    ctrlc::set_handler(interrupted).context("the handler for Ctrl-C could not be set")?;
    Ok(stopped)
}

/// The address goes to stdout, at once, for whoever started this.
fn announce(address: SocketAddr, path: &str) -> Result<()> {
    let mut out = std::io::stdout();
    writeln!(out, "http://{address}{path}")?;
    out.flush()?;
    eprintln!("Ctrl-C ends it");
    Ok(())
}

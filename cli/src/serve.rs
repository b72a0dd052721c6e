//! `tetralod serve`: a static server for MT files, with what their readers ask of one.
//!
//! Readers fetch byte ranges, from other origins, and must notice when the file is replaced between two of them: hence
//! Range, CORS with the headers that scripts have to see, and entity tags. Any good host does the same; this one is for
//! the own machine and for data that does not leave the house.

use anyhow::Context;
use anyhow::Result;
use anyhow::bail;
use axum::Router;
use axum::extract::Request;
use axum::http::HeaderMap;
use axum::http::HeaderName;
use axum::http::HeaderValue;
use axum::http::Method;
use axum::http::StatusCode;
use axum::http::header;
use axum::middleware;
use axum::middleware::Next;
use axum::response::Response;
use std::io::Write;
use std::net::SocketAddr;
use std::path::Path;
use std::path::PathBuf;
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::sync::watch;
use tower_http::cors::AllowOrigin;
use tower_http::cors::CorsLayer;
use tower_http::services::ServeDir;
use tower_http::services::ServeFile;

/// How long downloads under way may take to end after Ctrl-C.
const GRACE: Duration = Duration::from_secs(5);

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

/// Serves MT files to pages and programs: byte ranges, entity tags, CORS.
#[derive(clap::Args)]
pub struct Arguments {
    /// The folder to serve, or the one file.
    #[arg(default_value = ".", value_name = "DIR|FILE")]
    path: PathBuf,
    /// The port to listen on; 0 takes any that is free.
    #[arg(long, default_value_t = 8080)]
    port: u16,
    /// The address to listen on; 0.0.0.0 lets other machines in.
    #[arg(long, default_value = "127.0.0.1")]
    host: String,
    /// How long a copy may be used unasked; with 0 browsers ask each time whether theirs still holds.
    #[arg(long, value_name = "SECONDS", default_value_t = 0)]
    cache: u32,
    /// The origin whose pages may read the files, * for any, none for those of this server alone.
    #[arg(long, value_name = "ORIGIN", default_value = "*")]
    cors: String,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let (router, path) = files(&arguments.path)?;
    let router = with_headers(router, arguments)?;
    let stop = stop_on_interrupt()?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let served = runtime.block_on(async {
        let Arguments { host, port, .. } = arguments;
        let listener = TcpListener::bind((host.as_str(), *port)).await.with_context(|| {
            format!("{host}:{port} cannot be listened on; choose another --port, or 0 for any that is free")
        })?;
        announce(listener.local_addr()?, &path)?;
        listen(listener, router, stop).await
    });
    // A file that is being read from a slow disk does not hold up the end.
    runtime.shutdown_background();
    served
}

/// What answers, and the path at which it does.
fn files(path: &Path) -> Result<(Router, String)> {
    let found = std::fs::metadata(path).with_context(|| path.display().to_string())?;
    if found.is_dir() {
        let folder = ServeDir::new(path).ignore_multi_range_requests(true);
        return Ok((Router::new().fallback_service(folder), "/".to_owned()));
    }
    let name = path.file_name().and_then(|name| name.to_str());
    let Some(name) = name else { bail!("{}: a name in UTF-8 is needed for the address", path.display()) };
    let at = format!("/{}", encoded(name));
    // Braces mean something in a route: the one file is therefore asked for by its exact address.
    let (file, only) = (ServeFile::new(path), at.clone());
    let guard = middleware::from_fn(move |request: Request, next: Next| {
        let known = request.uri().path() == only;
        async move { if known { next.run(request).await } else { with_status(StatusCode::NOT_FOUND) } }
    });
    Ok((Router::new().fallback_service(file).layer(guard), at))
}

/// `name` as a part of an address.
fn encoded(name: &str) -> String {
    let mut out = String::new();
    for byte in name.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' => out.push(char::from(byte)),
            _ => out.push_str(&format!("%{byte:02X}")),
        }
    }
    out
}

fn with_status(status: StatusCode) -> Response {
    let mut response = Response::default();
    *response.status_mut() = status;
    response
}

fn with_headers(router: Router, arguments: &Arguments) -> Result<Router> {
    let caching = match arguments.cache {
        0 => HeaderValue::from_static("no-cache"),
        seconds => HeaderValue::try_from(format!("public, max-age={seconds}"))?,
    };
    let shared = arguments.cors != "none";
    let router = router.layer(middleware::from_fn(if_range));
    let router = router.layer(middleware::from_fn(move |request: Request, next: Next| {
        let caching = caching.clone();
        async move {
            let mut response = next.run(request).await;
            label(&mut response, caching, shared);
            response
        }
    }));
    Ok(if shared { router.layer(cors(&arguments.cors)?) } else { router })
}

/// Puts the headers on an answer that do not depend on the file.
fn label(response: &mut Response, caching: HeaderValue, shared: bool) {
    let good = response.status().is_success() || response.status() == StatusCode::NOT_MODIFIED;
    let headers = response.headers_mut();
    // A file that is missing now may be there in a moment.
    headers.insert(header::CACHE_CONTROL, if good { caching } else { HeaderValue::from_static("no-store") });
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    if shared {
        // For pages that are isolated to use threads.
        let name = HeaderName::from_static("cross-origin-resource-policy");
        headers.insert(name, HeaderValue::from_static("cross-origin"));
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

/// Answers a range with the whole file when that is no longer the one which the reader has a part of.
async fn if_range(request: Request, next: Next) -> Response {
    let Some(held) = request.headers().get(header::IF_RANGE).cloned() else { return next.run(request).await };
    let mut whole = Request::new(axum::body::Body::empty());
    *whole.method_mut() = request.method().clone();
    *whole.uri_mut() = request.uri().clone();
    let response = next.clone().run(request).await;
    if response.status() != StatusCode::PARTIAL_CONTENT || still_holds(&held, response.headers()) {
        return response;
    }
    next.run(whole).await
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
            std::process::exit(super::files::INTERRUPTED);
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

async fn listen(listener: TcpListener, router: Router, stop: watch::Receiver<bool>) -> Result<()> {
    let mut overdue = stop.clone();
    let server = axum::serve(listener, router).with_graceful_shutdown(stopped(stop));
    let patience = async {
        let _ = overdue.wait_for(|stop| *stop).await;
        tokio::time::sleep(GRACE).await;
    };
    tokio::select! {
        served = server => Ok(served?),
        () = patience => Ok(()),
    }
}

async fn stopped(mut stop: watch::Receiver<bool>) {
    let _ = stop.wait_for(|stop| *stop).await;
}

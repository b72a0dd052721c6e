//! `tetralod view`: a page on this machine that shows volumes. MT files are shown as they are; of everything else that `tetralod build`
//! reads, an MT file is built and kept. What changes is shown anew.

mod cache;
pub mod page;
mod volumes;

use self::cache::Cache;
use self::page::Page;
use self::volumes::Volumes;
use super::output;
use super::serve::{self, Shared, with_status};
use anyhow::Result;
use axum::extract::{Path as InAddress, Request, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use axum::{Json, Router};
use std::ffi::OsString;
use std::io::Write;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;

/// Shows volumes in the browser: MT files, and all that `tetralod build` reads, of which it builds MT files and keeps them in a cache.
///
/// The page and what it needs are inside of this program: nothing is fetched from elsewhere, and nothing leaves this machine. A file that
/// changes is shown anew. Ctrl-C ends it.
#[derive(clap::Args)]
pub struct Arguments {
    /// MT files, or meshes and grids as `tetralod build` reads them, each a volume of its own. Without any, the page waits for files that
    /// are dropped on it.
    #[arg(value_name = "FILE")]
    files: Vec<PathBuf>,
    /// The port to listen on; 0 takes any that is free [default: 8080, or any that is free].
    #[arg(long)]
    port: Option<u16>,
    /// The address to listen on; 0.0.0.0 lets other machines in, whoever uses them.
    #[arg(long, default_value = "127.0.0.1")]
    host: String,
    /// Open no browser; the address is printed.
    #[arg(long)]
    no_browser: bool,
    /// The folder in which MT files are kept that were built [default: tetralod in the user's folder of caches].
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// A folder with the page, and with the npm package in `pkg`, to be served in the place of those in this program.
    #[arg(long, value_name = "DIR", hide = true)]
    page: Option<PathBuf>,
    /// Options of `tetralod build` for what is built, behind `--` [default: --all-fields --cell-to-point].
    #[arg(last = true, value_name = "OPTION")]
    build: Vec<String>,
}

/// Where the page is looked for first: a port that stays the same can be bookmarked, and tunnelled.
const PORT: u16 = 8080;

pub fn run(arguments: &Arguments, again: &[OsString]) -> Result<()> {
    let Arguments { files, port, host, no_browser, cache, page, build } = arguments;
    let page = Page::of(page.as_deref())?;
    let cache = Cache::of(cache.clone(), build)?;
    let volumes = Arc::new(Volumes::of(files, cache, again)?);
    let router = Router::new()
        .route("/data/volumes.json", get(list))
        .route("/files/{number}/{name}", get(file))
        .with_state(Arc::clone(&volumes))
        .fallback_service(page.router()?);
    let router = serve::with_headers(router, 0, Shared::Nothing, None)?;
    let kept_up = Arc::clone(&volumes);
    let worker = std::thread::spawn(move || kept_up.keep_up());
    let ports = port.map_or_else(|| vec![PORT, 0], |port| vec![port]);
    let served = serve::listen(router, host, &ports, |address| announce(address, host, *no_browser));
    volumes.stop();
    // It removes what is unfinished.
    let _ = worker.join();
    served
}

async fn list(State(volumes): State<Arc<Volumes>>) -> Response {
    Json(volumes.list()).into_response()
}

/// The MT file of a volume, or a shard of it; its name is for people, but for what stands behind `.mt`.
async fn file(
    State(volumes): State<Arc<Volumes>>,
    InAddress((number, name)): InAddress<(usize, String)>,
    request: Request,
) -> Response {
    let Some(path) = volumes.file(number) else { return with_status(StatusCode::NOT_FOUND) };
    let suffix = name.rsplit_once(".mt").map_or("", |(_, suffix)| suffix);
    serve::file_or_shard(&path, suffix, request).await
}

/// Says where the page is, and opens it.
fn announce(address: SocketAddr, host: &str, no_browser: bool) -> Result<()> {
    let port = address.port();
    let page = if address.ip().is_unspecified() {
        format!("http://localhost:{port}/")
    } else {
        format!("http://{address}/")
    };
    let mut out = std::io::stdout();
    writeln!(out, "{page}")?;
    out.flush()?;
    if !address.ip().is_loopback() {
        output::note(&format!("--host {host}: whoever reaches this machine can read these volumes"));
    }
    if let Some(tunnel) = tunnel(port) {
        output::note(&format!(
            "this machine is a remote one; on yours: {tunnel}, then open http://localhost:{port}/"
        ));
    } else if !no_browser && let Err(error) = open::that_detached(&page) {
        output::note(&format!("no browser could be opened ({error}); open {page}"));
    }
    eprintln!("Ctrl-C ends it");
    Ok(())
}

/// What brings a port of this machine to that of the user, who came by ssh.
fn tunnel(port: u16) -> Option<String> {
    // The addresses and ports of both ends: "client port server port".
    let connection = std::env::var("SSH_CONNECTION").ok()?;
    let server = connection.split_whitespace().nth(2)?;
    let user = std::env::var("USER").or_else(|_| std::env::var("LOGNAME")).unwrap_or_default();
    let at = if user.is_empty() { String::new() } else { format!("{user}@") };
    Some(format!("ssh -N -L {port}:localhost:{port} {at}{server}"))
}

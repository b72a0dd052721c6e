//! Promise: programs and commands read what they need of a file that `tetralod serve` has, and get the same meshes.

use crate::support::{Folder, Server, good, json};
use std::fs;
use tetralod::format::DecodeOptions;
use tetralod::refine::Request;
use tetralod::session::{Client, Session};
use tetralod::stream::{HttpOptions, HttpSource, LoaderOptions};

/// Writes an MT of many blocks: more than a client reads at first.
fn many_blocks(kind: &str, grid: &str, mt: &str) {
    good(&["generate", "bucky", "--size", "25", "-o", grid]);
    good(&["build", grid, "-o", mt, "--quiet", "--kind", kind, "--block-updates", "64"]);
}

#[test]
fn clients_read_what_they_need() {
    let folder = Folder::new("client-serve");
    let [grid, mt] = ["b.vti", "b.mt"].map(|name| folder.path(name));
    many_blocks("edge", &grid, &mt);
    let bytes = fs::read(&mt).expect("it is there");
    let server = Server::start(&[&mt]);
    // Small gaps, for the file is small.
    let loader = LoaderOptions { gap: Some(64), ..LoaderOptions::default() };
    let source = HttpSource::new(&server.url, HttpOptions { loader, ..HttpOptions::default() });
    let mut client = Client::open(source, DecodeOptions::default(), u64::MAX).expect("a sound file");
    let mut whole = Session::new();
    whole.feed(&bytes).expect("a sound file");
    for request in [Request::within(0.1), Request::within(0.03), Request::within(0.0)] {
        client.refine(&request).expect("a sound file");
        whole.refine(&request).expect("a sound file");
        assert_eq!(client.session().hash(), whole.hash(), "{request:?}");
    }
    assert_eq!(client.total(), Some(bytes.len() as u64));
}

#[test]
fn commands_take_addresses_and_read_what_they_need() {
    let folder = Folder::new("client-command");
    let [grid, mt, out] = ["b.vti", "b.mt", "out.vtu"].map(|name| folder.path(name));
    many_blocks("half-edge", &grid, &mt);
    let server = Server::start(&[&mt]);
    let extract = |file: &str| json(&["extract", file, "--error", "10%", "-o", &out, "--json"]);
    let (here, there) = (extract(&mt), extract(&server.url));
    for key in ["hash", "file_bytes", "relative_error_bound"] {
        assert_eq!(here[key], there[key], "{key}");
    }
    assert_eq!(here["file_bytes"].as_u64(), fs::metadata(&mt).ok().map(|found| found.len()));
    for report in [&here, &there] {
        assert!(report["bytes_read"].as_u64() < report["file_bytes"].as_u64(), "{report}");
    }
    let (here, there) = (json(&["info", &mt, "--json"]), json(&["info", &server.url, "--json"]));
    assert_eq!(here, there);
    assert_eq!(here["blocks"]["updates_per_block"], 64);
    let parts = here["breakdown"].as_array().expect("a list").iter();
    let sum: f64 = parts.map(|part| part["bytes"].as_f64().expect("a number")).sum();
    assert!((sum - here["file_bytes"].as_f64().expect("a number")).abs() < 1.0, "all bytes are told");
}

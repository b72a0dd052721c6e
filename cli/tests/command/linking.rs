//! Promise: each crate links what it needs, and no more: the core nothing of files, of pictures or of JavaScript, TLS only with the feature
//! `http`, and nothing that only the command needs.

use std::process::Command;

/// Names of the packages that are linked into `package` with these features.
fn linked(package: &str, features: &str) -> Vec<String> {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.current_dir(env!("CARGO_MANIFEST_DIR"));
    cargo.args(["tree", "--locked", "--offline", "--edges", "normal", "--prefix", "none", "--format", "{p}"]);
    cargo.args(["--package", package, "--no-default-features", "--features", features]);
    let output = cargo.output().expect("cargo starts");
    assert!(output.status.success(), "{package}: {}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    text.lines().filter_map(|line| line.split(' ').next()).map(str::to_owned).collect()
}

fn assert_without(found: &[String], names: &[&str]) {
    for name in names {
        assert!(!found.iter().any(|found| found == name), "{name} is linked: {found:?}");
    }
}

#[test]
fn libraries_link_nothing_of_the_command() {
    for (library, features, needed) in [
        ("tetralod", "parallel,http", &["glam", "ureq", "rustls", "rayon"][..]),
        ("tetralod-io", "hdf5", &["tetralod", "quick-xml", "hdf5-reader"]),
        ("tetralod-build", "", &["tetralod", "postcard"]),
        ("tetralod-render", "", &["tetralod", "wgpu"]),
    ] {
        let all = linked(library, features);
        assert!(needed.iter().all(|name| all.iter().any(|found| found == name)), "{library}: {all:?}");
        assert_without(
            &all,
            &["clap", "axum", "tokio", "tower-http", "hyper", "anyhow", "indicatif", "ctrlc"],
        );
        assert_without(&all, &["wasm-bindgen", "js-sys", "web-sys"]);
    }
}

#[test]
fn each_library_links_what_it_needs() {
    let core = linked("tetralod", "");
    assert_without(
        &core,
        &["ureq", "rayon", "wgpu", "quick-xml", "serde_json", "flate2", "tetralod-io", "tetralod-build"],
    );
    assert_without(&linked("tetralod", "parallel"), &["ureq", "rustls", "ring", "webpki-roots"]);
    assert_without(
        &linked("tetralod-io", ""),
        &["hdf5-reader", "netcdf-reader", "wgpu", "ureq", "tetralod-build"],
    );
    assert_without(&linked("tetralod-build", ""), &["quick-xml", "wgpu", "ureq", "tetralod-io"]);
    assert_without(&linked("tetralod-render", ""), &["quick-xml", "ureq", "tetralod-io", "tetralod-build"]);
}

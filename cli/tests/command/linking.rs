//! Promise: the library links nothing that only the command needs, TLS only with the feature `http`, and the command
//! knows the renderer only with the feature `render`, and never JavaScript.

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
fn the_library_links_nothing_of_the_command() {
    let all = linked("tetralod", "build,http,gpu,vulkan,web");
    for name in ["tetralod", "glam", "ureq", "rustls", "wgpu", "wasm-bindgen", "quick-xml"] {
        assert!(all.iter().any(|found| found == name), "{name} is not in {all:?}");
    }
    assert_without(&all, &["clap", "axum", "tokio", "tower-http", "hyper", "anyhow", "indicatif", "ctrlc"]);
    let offline = linked("tetralod", "build,gpu,vulkan,web");
    assert_without(&offline, &["ureq", "rustls", "ring", "webpki-roots"]);
    let core = linked("tetralod", "");
    assert_without(&core, &["ureq", "wgpu", "wasm-bindgen", "quick-xml", "serde_json", "flate2"]);
}

#[test]
fn the_command_links_the_renderer_only_to_render_and_no_javascript() {
    let all = linked("tetralod-cli", "render");
    assert!(["wgpu", "png"].iter().all(|name| all.iter().any(|found| found == name)), "{all:?}");
    assert_without(&all, &["wasm-bindgen", "js-sys", "web-sys"]);
    let command = linked("tetralod-cli", "");
    assert!(command.iter().any(|found| found == "tetralod"), "{command:?}");
    assert_without(&command, &["wgpu", "naga", "png", "wasm-bindgen", "js-sys", "web-sys"]);
}

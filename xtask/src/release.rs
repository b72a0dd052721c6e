//! `cargo xtask release`: whether everything can be published, without publishing it.

use std::fs;

use anyhow::{Context, Result, bail, ensure};

use crate::serve::Server;
use crate::{package, release_files, shell};

/// Checks the version and what would be uploaded; with a tag, such as `v0.1.0`, also that it names this version.
pub fn run(args: &[String]) -> Result<()> {
    let version = package::version()?;
    match args {
        [] => {}
        [tag] => {
            ensure!(*tag == format!("v{version}"), "the tag is {tag}, the version {version}");
            check_changes(&fs::read_to_string("CHANGELOG.md").context("CHANGELOG.md")?, &version)?;
        }
        _ => bail!("`release` takes one tag, got {}", args.join(" ")),
    }
    package::build(&[])?;
    check_page()?;
    release_files::archive()?;
    package::pack_extension()?;
    release_files::recipes()?;
    // They need each other, which are not on crates.io yet: cargo takes them from here.
    let mut publish = shell::cargo(["publish", "--dry-run", "--locked"]);
    shell::run(publish.args(package::PUBLISHED.iter().flat_map(|name| ["--package", name])))?;
    shell::run(shell::npm(["publish", "--dry-run", "--access", "public"]).current_dir(package::PKG))
}

/// Builds the command with the page inside, and checks that it serves the page and the package.
fn check_page() -> Result<()> {
    let program = shell::command_with_page()?;
    println!("{}: {} bytes", program.display(), fs::metadata(&program)?.len());
    let server = Server::of(shell::command(&program, ["view", "--no-browser", "--port", "0"]))?;
    for (path, file) in
        [("", "www/index.html"), ("pkg/tetralod_viewer_bg.wasm", "pkg/tetralod_viewer_bg.wasm")]
    {
        ensure!(server.get(path)? == fs::read(file)?, "`tetralod view` does not serve {file}");
    }
    Ok(())
}

/// A version that is published is no longer called unreleased.
fn check_changes(changes: &str, version: &str) -> Result<()> {
    let heading = changes.lines().find(|line| line.starts_with("## ")).unwrap_or_default();
    let rest = heading.strip_prefix("## ").and_then(|rest| rest.strip_prefix(version)).unwrap_or("?");
    ensure!(
        rest.is_empty() || rest.starts_with(" ("),
        "CHANGELOG.md begins with `{heading}`, not with `## {version}`"
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::check_changes;

    #[test]
    fn the_changes_of_the_version_are_on_top() {
        assert!(check_changes("# Changelog\n\n## 0.1.0 (2026-12-01)\n\n## 0.0.9\n", "0.1.0").is_ok());
        assert!(check_changes("## 0.1.0\n", "0.1.0").is_ok());
        for wrong in ["## Unreleased: 0.1.0\n## 0.1.0\n", "## 0.1.01\n", "## 0.0.9\n## 0.1.0\n", ""] {
            assert!(check_changes(wrong, "0.1.0").is_err(), "{wrong}");
        }
    }

    #[test]
    fn tests_name_own_crates_by_path_alone() {
        let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
        for folder in [".", "crates/io", "crates/build", "crates/render", "crates/bench", "cli"] {
            let path = format!("{root}/{folder}/Cargo.toml");
            let manifest = fs::read_to_string(&path).expect(&path);
            let mut of_tests = manifest.lines().skip_while(|line| *line != "[dev-dependencies]").skip(1);
            let own = of_tests
                .by_ref()
                .take_while(|line| !line.starts_with('['))
                .filter(|line| line.starts_with("tetralod"));
            for line in own {
                // With a version, crates need each other, and none of them can be published first.
                assert!(line.contains("path = ") && !line.contains("version"), "{path}: {line}");
            }
        }
    }
}

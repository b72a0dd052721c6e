//! The licences of the crates that are compiled into the wasm files of the npm package, or into the native module of the Python package, as
//! one text file.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde_json::Value;
use spdx::{Expression, ParseMode};

use crate::shell;

/// The file in the package.
pub const FILE: &str = "THIRD-PARTY-LICENSES.txt";

/// What dependencies may be licensed under: whoever redistributes the package has to pass on the notices, and no more.
const ALLOWED: [&str; 11] = [
    "MIT",
    "MIT-0",
    "Apache-2.0",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "CDLA-Permissive-2.0",
    "ISC",
    "Unicode-3.0",
    "Zlib",
];

const HEAD: &str = "\
The compiled files of this package contain the following software under the licences below. Where a crate may be used under
several licences, it is used under those whose texts are given. They also contain parts of the Rust standard library,
copyright The Rust Project Contributors, under the MIT licence (https://www.rust-lang.org/policies/licenses).
";

/// A crate: its name with its version, and the licence in its manifest.
type Crates = BTreeMap<String, String>;

/// Writes the licences of all crates in the modules that are made of these packages, each for a target, into `folder`; for this machine
/// without one.
pub fn write<'a>(
    folder: &Path,
    packages: impl IntoIterator<Item = (&'a str, Option<&'a str>)>,
) -> Result<()> {
    let mut crates = Crates::new();
    for (package, target) in packages {
        crates.extend(compiled(package, target)?);
    }
    for (name, licence) in &crates {
        check(name, licence)?;
    }
    let text = page(&crates, &sources()?)?;
    fs::write(folder.join(FILE), text).with_context(|| FILE.to_owned())
}

/// The crates that a module contains: no build scripts and no procedural macros.
fn compiled(package: &str, target: Option<&str>) -> Result<Crates> {
    let mut command = shell::cargo(["tree", "--package", package, "--prefix", "none"]);
    command.args(target.into_iter().flat_map(|target| ["--target", target]));
    command.args(["--edges", "normal,no-proc-macro", "--format", "{p}|{l}"]);
    let tree = shell::output(&mut command)?;
    let rows = tree.lines().map(|line| line.trim_end_matches(" (*)"));
    // Our own say themselves what they are under.
    let rows = rows.filter(|row| !row.starts_with("tetralod"));
    rows.map(|row| {
        let (name, licence) = row.split_once('|').with_context(|| format!("cargo tree printed `{row}`"))?;
        Ok((name.replace(" v", " "), licence.to_owned()))
    })
    .collect()
}

/// Whether the licence of a crate allows to put it into the package.
fn check(name: &str, licence: &str) -> Result<()> {
    let expression = Expression::parse_mode(licence, ParseMode::LAX)
        .with_context(|| format!("the licence of {name} is `{licence}`"))?;
    let allowed = expression.evaluate(|required| ALLOWED.contains(&required.license.to_string().as_str()));
    ensure!(allowed, "{name} is licensed under {licence}; allowed are {}", ALLOWED.join(", "));
    Ok(())
}

/// The folder of each crate.
fn sources() -> Result<BTreeMap<String, String>> {
    let text = shell::output(&mut shell::cargo([
        "metadata",
        "--format-version",
        "1",
        "--locked",
        "--all-features",
    ]))?;
    let metadata: Value = serde_json::from_str(&text).context("cargo metadata")?;
    let packages = metadata["packages"].as_array().context("cargo metadata names no packages")?;
    let text = |package: &Value, key: &str| package[key].as_str().unwrap_or_default().to_owned();
    let entry = |package: &Value| {
        let folder = text(package, "manifest_path").trim_end_matches("Cargo.toml").to_owned();
        (format!("{} {}", text(package, "name"), text(package, "version")), folder)
    };
    Ok(packages.iter().map(entry).collect())
}

/// Every text once, below the crates that it is of.
fn page(crates: &Crates, sources: &BTreeMap<String, String>) -> Result<String> {
    let mut by_text: BTreeMap<String, BTreeSet<&str>> = BTreeMap::new();
    for (name, licence) in crates {
        let folder = sources.get(name).with_context(|| format!("cargo metadata does not name {name}"))?;
        let mut texts = texts(Path::new(folder))?;
        if texts.is_empty() {
            texts.push(format!("{licence} (the crate has no file with the text)"));
        }
        for text in texts {
            by_text.entry(text).or_default().insert(name);
        }
    }
    // In the order of the first crate of each.
    let mut sections: Vec<(&str, String)> = Vec::new();
    for (text, names) in &by_text {
        let names: Vec<&str> = names.iter().copied().collect();
        sections.push((names[0], format!("\n{}\n\n{}\n\n{text}\n", "-".repeat(80), names.join(", "))));
    }
    sections.sort();
    Ok(HEAD.to_owned() + &sections.into_iter().map(|(_, section)| section).collect::<String>())
}

/// The texts of the licences in a folder; that of Apache, which says nothing of its crate, only where there is no other.
fn texts(folder: &Path) -> Result<Vec<String>> {
    let entries = fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let names = entries.map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()));
    let mut names: Vec<String> = names.collect::<Result<_>>()?;
    names.retain(|name| {
        let name = name.to_uppercase();
        ["LICENSE", "LICENCE", "COPYING", "COPYRIGHT", "NOTICE"].iter().any(|start| name.starts_with(start))
    });
    names.sort();
    let others: Vec<&String> = names.iter().filter(|name| !name.to_uppercase().contains("APACHE")).collect();
    let chosen = if others.is_empty() { names.iter().collect() } else { others };
    let read = |name: &String| {
        let text = fs::read_to_string(folder.join(name)).with_context(|| name.clone())?;
        // Line ends differ.
        Ok(text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n").trim().to_owned())
    };
    chosen.into_iter().filter(|name| folder.join(name).is_file()).map(read).collect()
}

#[cfg(test)]
mod tests {
    use super::{check, compiled, page, shell, sources};

    #[test]
    fn licences_that_ask_for_more_are_refused() {
        for licence in ["MIT", "Apache-2.0/MIT", "(MIT OR Apache-2.0) AND Unicode-3.0", "GPL-3.0 OR Zlib"] {
            assert!(check("a", licence).is_ok(), "{licence}");
        }
        for licence in ["GPL-3.0", "MIT AND AGPL-3.0", "", "LicenseRef-own"] {
            assert!(check("a", licence).is_err(), "{licence}");
        }
    }

    #[test]
    fn every_crate_of_a_module_is_in_the_file() {
        let crates = compiled("tetralod-web-core", Some(shell::WASM)).expect("cargo tree");
        assert!(crates.keys().any(|name| name.starts_with("wasm-bindgen ")));
        assert!(!crates.keys().any(|name| name.starts_with("syn ")), "no procedural macros");
        let text = page(&crates, &sources().expect("cargo metadata")).expect("all licences can be read");
        for name in crates.keys() {
            assert!(text.contains(name.as_str()), "{name}");
        }
        assert!(text.contains("Permission is hereby granted"));
    }
}

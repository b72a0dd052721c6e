//! The public names of the crates that are published, one a line, in `tests/public-api.txt`: so a change of them shows in a diff.
//!
//! They are read from rustdoc's JSON, which knows what is re-exported where. What is hidden from the documentation is for the crates of
//! this workspace alone, and is not listed.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Command, ExitCode};

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::shell;

const LIST: &str = "tests/public-api.txt";

/// The crates that are libraries for everybody.
const LIBRARIES: [&str; 4] = ["tetralod", "tetralod-io", "tetralod-build", "tetralod-render"];

/// As many names as a user of the library should have to know of, at most.
const MOST_NAMES: usize = 155;

/// Compares the list with the sources; with `TETRALOD_UPDATE_API` set, writes it.
pub fn check() -> Result<()> {
    let mut text = String::new();
    let mut count = 0;
    for library in LIBRARIES {
        let names = names_of(library)?;
        count += names.len();
        names.iter().for_each(|name| text += &format!("{name}\n"));
    }
    println!("{count} public names");
    if std::env::var_os("TETRALOD_UPDATE_API").is_some() {
        return fs::write(LIST, text).context(LIST);
    }
    let listed = fs::read_to_string(LIST).context(LIST)?;
    let (old, new): (BTreeSet<&str>, BTreeSet<&str>) = (listed.lines().collect(), text.lines().collect());
    let gone: Vec<&&str> = old.difference(&new).collect();
    let come: Vec<&&str> = new.difference(&old).collect();
    ensure!(
        gone.is_empty() && come.is_empty(),
        "the public names are not those of {LIST}: gone {gone:?}, new {come:?}; if that is meant, run the step with \
         TETRALOD_UPDATE_API=1"
    );
    ensure!(
        count <= MOST_NAMES,
        "{count} public names, more than {MOST_NAMES}: hide what no user of the crates needs"
    );
    Ok(())
}

/// Is set where this program stands for rustdoc.
const AS_RUSTDOC: &str = "XTASK_AS_RUSTDOC";

/// Runs rustdoc with what only nightly versions do by themselves, if this program stands for it; its exit code then.
pub fn as_rustdoc() -> Option<Result<ExitCode>> {
    std::env::var_os(AS_RUSTDOC)?;
    let mut rustdoc = Command::new("rustdoc");
    rustdoc.args(std::env::args_os().skip(1)).env("RUSTC_BOOTSTRAP", "1");
    Some(
        rustdoc
            .status()
            .context("rustdoc")
            .map(|status| if status.success() { ExitCode::SUCCESS } else { ExitCode::FAILURE }),
    )
}

/// The public names of a crate, with their paths and kinds.
fn names_of(library: &str) -> Result<BTreeSet<String>> {
    let args = ["rustdoc", "--package", library, "--lib", "--all-features", "--", "-Z", "unstable-options"];
    let mut command = shell::cargo(args);
    // The format is no promise of rustdoc's yet; rust-toolchain.toml names the version that this reads. rustdoc alone is told so: build
    // scripts that heard of it would run again, and most crates be compiled again, now and by the next step.
    command.args(["--output-format", "json"]).env("RUSTDOC", std::env::current_exe()?).env(AS_RUSTDOC, "1");
    shell::run(&mut command)?;
    let name = library.replace('-', "_");
    let path = format!("target/doc/{name}.json");
    let text = fs::read_to_string(Path::new(&path)).context(path)?;
    let json: Value = serde_json::from_str(&text).context("rustdoc's JSON")?;
    let mut names = BTreeSet::new();
    add_names(&json["index"], &json["root"], &name, &mut names);
    ensure!(!names.is_empty(), "rustdoc names nothing of {library}");
    Ok(names)
}

/// Adds the names in the module `id`, which is called `path`.
fn add_names(index: &Value, id: &Value, path: &str, names: &mut BTreeSet<String>) {
    let item = |id: &Value| &index[id.to_string()];
    for id in item(id)["inner"]["module"]["items"].as_array().into_iter().flatten() {
        let found = item(id);
        let used = &found["inner"]["use"];
        if used.is_object() {
            let target = item(&used["id"]);
            if used["is_glob"] == true {
                add_names(index, &used["id"], path, names);
            } else if let (Some(name), Some(kind)) = (used["name"].as_str(), kind_of(target)) {
                names.insert(format!("{path}::{name} ({kind})"));
            } else if let Some(name) = used["name"].as_str() {
                names.insert(format!("{path}::{name} (of another crate)"));
            }
            continue;
        }
        let (Some(name), Some(kind)) = (found["name"].as_str(), kind_of(found)) else { continue };
        let inside = format!("{path}::{name}");
        if kind == "module" {
            add_names(index, id, &inside, names);
        } else {
            names.insert(format!("{inside} ({kind})"));
        }
    }
}

fn kind_of(item: &Value) -> Option<&str> {
    let kind = item["inner"].as_object()?.keys().next()?;
    (kind != "impl").then_some(kind)
}

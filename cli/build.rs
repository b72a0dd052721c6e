//! Puts the page (`www`) and the npm package (`pkg`) into the command, with the feature `page`.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

/// What browsers fetch. `inline.js` has the modules once more, for pages of one file; the page's own volumes are no part of it.
fn is_wanted(path: &str) -> bool {
    let ending = path.rsplit_once('.').map_or("", |(_, ending)| ending);
    ["html", "css", "js", "wasm", "svg", "png"].contains(&ending)
        && path != "pkg/inline.js"
        && !path.starts_with("data/")
}

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=build.rs");
    let variable = |name: &str| env::var_os(name).map(PathBuf::from).ok_or(io::ErrorKind::NotFound);
    let mut list = String::new();
    if env::var_os("CARGO_FEATURE_PAGE").is_some() {
        let root = variable("CARGO_MANIFEST_DIR")?.join("..");
        for (folder, at) in [("www", ""), ("pkg", "pkg/")] {
            let folder = root.join(folder).canonicalize().map_err(|error| {
                let words = format!("{folder}: {error}; `cargo xtask build` makes the package");
                io::Error::new(error.kind(), words)
            })?;
            println!("cargo::rerun-if-changed={}", folder.display());
            collect(&folder, at, &mut list)?;
        }
    }
    let code = format!("pub static FILES: &[(&str, &[u8])] = &[{list}];\n");
    fs::write(variable("OUT_DIR")?.join("page.rs"), code)
}

/// Lists what is wanted of a folder, in the order of names, below the address `at`.
fn collect(folder: &Path, at: &str, list: &mut String) -> io::Result<()> {
    let mut entries = fs::read_dir(folder)?.collect::<io::Result<Vec<_>>>()?;
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let (path, name) = (entry.path(), entry.file_name());
        let name = format!("{at}{}", name.to_string_lossy());
        if path.is_dir() {
            collect(&path, &format!("{name}/"), list)?;
        } else if is_wanted(&name) {
            writeln!(list, "({name:?}, include_bytes!({:?})),", path.display().to_string())
                .map_err(io::Error::other)?;
        }
    }
    Ok(())
}

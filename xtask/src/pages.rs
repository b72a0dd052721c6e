//! `cargo xtask pages`: the demo, its gallery of volumes, and the documentation, as one folder of static files for GitHub Pages or any other host.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};

use crate::{demo, docs, package, shell};

/// Where the folder is.
const PAGES: &str = "target/pages";

/// What a repository of GitHub Pages may have in one file, and in all, in bytes.
const LARGEST: u64 = 100 << 20;
const ALL: u64 = 1 << 30;

/// Makes the folder and says where it is.
pub fn run(args: &[String]) -> Result<()> {
    let make = match args {
        [] => demo::make_all,
        [only] if only == "--small" => demo::make_data,
        _ => bail!("`pages` knows --small, not `{}`", args.join(" ")),
    };
    package::ensure_built(package::Profile::Released)?;
    docs::build()?;
    make(&shell::tested_command()?)?;
    let pages = Path::new(PAGES);
    if pages.exists() {
        fs::remove_dir_all(pages).context(PAGES)?;
    }
    for (from, to) in [("www", ""), (package::PKG, "pkg"), (docs::SITE, "docs")] {
        copy(Path::new(from), &pages.join(to))?;
    }
    // Without it GitHub leaves out what begins with an underscore.
    fs::write(pages.join(".nojekyll"), "")?;
    let sizes = sizes(pages)?;
    let all: u64 = sizes.iter().map(|(_, bytes)| bytes).sum();
    if let Some((path, bytes)) = sizes.iter().find(|(_, bytes)| *bytes > LARGEST) {
        bail!("{}: {bytes} bytes are more than such a host takes", path.display());
    }
    ensure!(all <= ALL, "{PAGES}: {all} bytes are more than such a host takes");
    println!("{} files, {:.1} MB, are in {PAGES}", sizes.len(), all as f64 / 1e6);
    Ok(())
}

fn copy(from: &Path, to: &Path) -> Result<()> {
    fs::create_dir_all(to).with_context(|| to.display().to_string())?;
    for entry in fs::read_dir(from).with_context(|| from.display().to_string())? {
        let entry = entry?;
        let (path, to) = (entry.path(), to.join(entry.file_name()));
        if path.is_dir() {
            copy(&path, &to)?;
        } else {
            fs::copy(&path, &to).with_context(|| path.display().to_string())?;
        }
    }
    Ok(())
}

/// The files of a folder, with their bytes.
fn sizes(folder: &Path) -> Result<Vec<(PathBuf, u64)>> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            all.extend(sizes(&path)?);
        } else {
            let bytes = fs::metadata(&path)?.len();
            all.push((path, bytes));
        }
    }
    Ok(all)
}

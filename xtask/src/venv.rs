//! Environments of Python with packages from PyPI.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};

use crate::{browser, shell};

/// The folder of an environment with the packages that a file lists, which is made where it is missing or the list is another one.
pub fn environment(folder: &Path, requirements: &Path) -> Result<PathBuf> {
    let folder = shell::root().join(folder);
    let (wanted, done) = (fs::read_to_string(requirements)?, folder.join("installed.txt"));
    if fs::read_to_string(&done).is_ok_and(|installed| installed == wanted) {
        return Ok(folder);
    }
    println!("installing what {} lists", requirements.display());
    make(&folder)?;
    shell::run(shell::command(program(&folder, "pip"), INSTALL).arg("--requirement").arg(requirements))?;
    fs::write(done, wanted)?;
    Ok(folder)
}

/// What pip is told to do.
pub const INSTALL: [&str; 3] = ["install", "--quiet", "--disable-pip-version-check"];

/// Makes an empty environment.
pub fn make(folder: &Path) -> Result<()> {
    require_python()?;
    shell::run(shell::command("python3", ["-m", "venv", "--clear"]).arg(folder))
}

/// A program of an environment.
pub fn program(folder: &Path, name: &str) -> PathBuf {
    let programs = folder.join(if cfg!(windows) { "Scripts" } else { "bin" });
    programs.join(format!("{name}{}", std::env::consts::EXE_SUFFIX))
}

/// Python as all of this needs it.
fn require_python() -> Result<()> {
    let check = "import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 11))";
    let is_there = || shell::succeeds(&mut shell::command("python3", ["-c", check]));
    let by_hand = "Python 3.11 or later with its module `venv` is needed: install it (Debian: the package `python3-venv`)";
    if !is_there() {
        browser::install_packages("Python", &["python3-venv"], by_hand)?;
    }
    ensure!(is_there(), by_hand);
    Ok(())
}

//! `cargo xtask paper`: the experiments of the paper, done again, as a page with plots and pictures in `docs/`.

use std::time::Instant;

use anyhow::{Result, ensure};

use crate::shell;

/// Runs the program of its own that does the work, so that this one stays quick to build.
pub fn run(args: &[String]) -> Result<()> {
    ensure!(args.is_empty(), "`paper` takes no arguments, and finds data sets through TETRALOD_DATA");
    let start = Instant::now();
    let args = ["run", "--release", "--package", "paper", "--", "docs"];
    shell::run(&mut shell::cargo(args))?;
    println!("docs/paper.md is written; it took {:.0} s", start.elapsed().as_secs_f64());
    Ok(())
}

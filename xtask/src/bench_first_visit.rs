//! `cargo xtask bench --first-visit`: how soon the demo's page shows what, in a browser that has never seen it; writes its part of
//! `docs/benchmarks.md`. With a file: what the page takes to show that one, behind a network.

use anyhow::{Result, bail};

use crate::benchmarks_page::{self, Part};
use crate::{demo, package, shell};

const HEAD: &str = "
Written by `cargo xtask bench --first-visit`. The demo's page with its large volume, from this machine, in a headless Chromium that has
just been started and has not seen the page, 1280 × 800 pixels; pictures are drawn in software where there is no GPU, on the same processors
that the page needs. Times are from the start of the navigation. The first picture is the base mesh, in which little can be recognised.
Tasks are those of the page's thread by the clock (Long Tasks API), in which it may wait for a processor; *processor time* is what a task had
of one (a trace of Chromium).

";

pub fn run(options: &[String]) -> Result<()> {
    let file = match options {
        [] => None,
        [file] => Some(std::path::absolute(file)?),
        [_, other, ..] => bail!("`bench --first-visit` takes at most one FILE.mt, got `{other}`"),
    };
    package::ensure_built(package::Profile::Released)?;
    // As users get it: it answers while the page is timed.
    let tetralod = shell::released_command()?;
    if let Some(file) = file {
        let (_server, mut script) = demo::page_script(&tetralod, &["benches/first_visit/file.js"])?;
        return shell::run(script.env("TETRALOD_FILE", file));
    }
    demo::make_all(&tetralod)?;
    let (_server, mut script) = demo::page_script(&tetralod, &["benches/first_visit/run.js"])?;
    let table = shell::output(&mut script)?;
    println!("{table}");
    benchmarks_page::write(Part::FirstVisit, &[HEAD, &table].concat())
}

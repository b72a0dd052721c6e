//! `cargo xtask bench --first-visit`: how soon the demo's page shows what, in a browser that has never seen it; writes its part of
//! `docs/benchmarks.md`.

use anyhow::{Result, bail};

use crate::benchmarks_page::{self, Part};
use crate::{browser, demo, package, shell};

const HEAD: &str = "
Written by `cargo xtask bench --first-visit`. The demo's page with its large volume, from this machine, in a new headless Chromium for each
visit, 1280 × 800 pixels; pictures are drawn in software where there is no GPU. Times are from the start of the navigation. The first
picture is the base mesh, in which little can be recognised.

";

pub fn run(options: &[String]) -> Result<()> {
    if let Some(option) = options.first() {
        bail!("`bench --first-visit` takes no argument, got `{option}`");
    }
    package::ensure_built()?;
    let tetralod = shell::tested_command()?;
    demo::make_all(&tetralod)?;
    let server = demo::start_server(&tetralod, 0)?;
    let mut command = shell::command("node", ["benches/first_visit/run.js"]);
    command.env("TETRALOD_PAGE", &server.address).env("CHROMIUM", browser::require()?.chromium);
    let table = shell::output(&mut command)?;
    println!("{table}");
    benchmarks_page::write(Part::FirstVisit, &[HEAD, &table].concat())
}

//! `tetralod bench`: how fast this machine is with an MT file.

use super::output;
use anyhow::Context;
use anyhow::Result;
use serde::Serialize;
use std::fs;
use std::path::PathBuf;
use std::time::Instant;
use tetralod::bench;

/// Times decoding, refinement, coarsening and isosurfaces of an MT file on one thread.
#[derive(clap::Args)]
pub struct Arguments {
    /// The MT file.
    file: PathBuf,
    /// Print a JSON object.
    #[arg(long)]
    json: bool,
}

/// Go on for this long, in seconds.
const TIME: f64 = 2.0;

#[derive(Serialize)]
struct Report {
    updates: u32,
    tetrahedra: u32,
    runs: u32,
    decode: Updates,
    refine: Refine,
    coarsen: Updates,
    isosurface: Tets,
}

#[derive(Serialize)]
struct Updates {
    updates_per_second: f64,
}

#[derive(Serialize)]
struct Refine {
    updates_per_second: f64,
    tets_per_second: f64,
}

#[derive(Serialize)]
struct Tets {
    tets_per_second: f64,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let name = || arguments.file.display().to_string();
    let bytes = fs::read(&arguments.file).with_context(name)?;
    let start = Instant::now();
    let mut clock = || start.elapsed().as_secs_f64();
    let found = bench::run(&bytes, &mut clock, TIME).with_context(name)?;
    let report = Report {
        updates: found.updates,
        tetrahedra: found.tetrahedra,
        runs: found.runs,
        decode: Updates { updates_per_second: found.decode_updates },
        refine: Refine { updates_per_second: found.refine_updates, tets_per_second: found.refine_tets },
        coarsen: Updates { updates_per_second: found.coarsen_updates },
        isosurface: Tets { tets_per_second: found.isosurface_tets },
    };
    if arguments.json { output::json(&report) } else { print(&report) }
}

fn print(report: &Report) -> Result<()> {
    let rate =
        |per_second: f64, what: &str| format!("{} {what} per second", output::count(per_second as u64));
    output::table(&[
        ("decode", rate(report.decode.updates_per_second, "updates")),
        ("refine", rate(report.refine.updates_per_second, "updates")),
        ("", rate(report.refine.tets_per_second, "tetrahedra")),
        ("coarsen", rate(report.coarsen.updates_per_second, "updates")),
        ("isosurface", rate(report.isosurface.tets_per_second, "tetrahedra")),
        ("", format!("the fastest of {} runs on one thread", report.runs)),
    ])
}

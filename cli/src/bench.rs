//! `tetralod bench`: how fast this machine is with an MT file, or at Delaunay triangulation.

use super::{files, output};
use anyhow::{Context, Result};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;
use tetralod_bench as bench;

/// Times decoding, refinement, coarsening and isosurfaces of an MT file on one thread.
#[derive(clap::Args)]
pub struct Arguments {
    /// The MT file.
    #[arg(required_unless_present = "delaunay")]
    file: Option<PathBuf>,
    /// Time the Delaunay triangulation of a grid and of random points instead.
    #[arg(long, conflicts_with = "file")]
    delaunay: bool,
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
    coherent: bench::Walks,
    bytes_per_tet: f64,
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

/// Triangulation, without the mesh of tetrahedra that is made of it.
#[derive(Serialize)]
struct Delaunay {
    /// 33³ points.
    grid: Tets,
    /// 100,000 points.
    random: Tets,
}

const GRID: i32 = 33;
const RANDOM: usize = 100_000;

pub fn run(arguments: &Arguments) -> Result<()> {
    let Some(file) = &arguments.file else { return run_delaunay(arguments) };
    let name = || file.display().to_string();
    let mut bytes = Vec::new();
    files::Bytes::of(file)
        .and_then(|source| {
            source.read_all(|piece| {
                bytes.extend_from_slice(piece);
                Ok(())
            })
        })
        .with_context(name)?;
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
        coherent: found.coherent,
        bytes_per_tet: bytes_per_tet(&found.coherent),
    };
    output::result(arguments.json, &report, &rows(&report))
}

/// The most of the three: where the mesh is small beside the MT, arrays by vertex and update of the MT count more.
fn bytes_per_tet(walks: &bench::Walks) -> f64 {
    walks.roi.bytes_per_tet.max(walks.iso.bytes_per_tet).max(walks.view.bytes_per_tet)
}

fn run_delaunay(arguments: &Arguments) -> Result<()> {
    let grid: Vec<[i32; 3]> =
        (0..GRID.pow(3)).map(|i| [i % GRID, i / GRID % GRID, i / (GRID * GRID)]).collect();
    let report = Delaunay { grid: triangulate(&grid)?, random: triangulate(&random_points(RANDOM))? };
    let rate = |tets: &Tets| format!("{} tetrahedra per second", output::count(tets.tets_per_second as u64));
    let rows = [("grid", rate(&report.grid)), ("random points", rate(&report.random))];
    output::result(arguments.json, &report, &rows)
}

/// The fastest of several runs, as of all benchmarks.
fn triangulate(points: &[[i32; 3]]) -> Result<Tets> {
    let mut fastest = 0.0_f64;
    let begin = Instant::now();
    while begin.elapsed().as_secs_f64() < TIME {
        let start = Instant::now();
        let tets = tetralod_build::delaunay(points)?;
        fastest = fastest.max(tets.len() as f64 / start.elapsed().as_secs_f64());
    }
    Ok(Tets { tets_per_second: fastest })
}

/// Points that look random on a lattice of 20 bits, each once.
fn random_points(count: usize) -> Vec<[i32; 3]> {
    let mut state = 1_u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 44) as i32
    };
    let mut points: Vec<[i32; 3]> = (0..count).map(|_| [next(), next(), next()]).collect();
    points.sort_unstable();
    points.dedup();
    points
}

fn rows(report: &Report) -> [(&'static str, String); 10] {
    let walk = |walk: &bench::Coherent| {
        let bench::Coherent { median_ms, p95_ms, cold_ms, updates, .. } = walk;
        format!(
            "{median_ms:.2} ms a frame of {updates} updates, 95 % within {p95_ms:.2} ms; from the base mesh {cold_ms:.1} ms"
        )
    };
    let rate =
        |per_second: f64, what: &str| format!("{} {what} per second", output::count(per_second as u64));
    [
        ("decode", rate(report.decode.updates_per_second, "updates")),
        ("refine", rate(report.refine.updates_per_second, "updates")),
        ("", rate(report.refine.tets_per_second, "tetrahedra")),
        ("coarsen", rate(report.coarsen.updates_per_second, "updates")),
        ("isosurface", rate(report.isosurface.tets_per_second, "tetrahedra")),
        ("moving box", walk(&report.coherent.roi)),
        ("moving isovalue", walk(&report.coherent.iso)),
        ("turning camera", walk(&report.coherent.view)),
        ("memory", format!("{:.0} bytes a tetrahedron of the mesh", report.bytes_per_tet)),
        ("", format!("the fastest of {} runs on one thread", report.runs)),
    ]
}

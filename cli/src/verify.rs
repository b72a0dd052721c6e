//! `tetralod verify`: does an MT file keep its promises?

use super::{files, input, output};
use anyhow::Result;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};
use tetralod::mesh::TetMesh;
use tetralod::mt::{Mt, MultiTessellation};
use tetralod::verify;
use tetralod::verify::{Sample, VerifyReport};

/// Checks every promise of an MT file against the mesh that it was built from; exit code 1 if one is broken.
#[derive(clap::Args)]
pub struct Arguments {
    /// The MT file, or its http(s) address.
    file: PathBuf,
    /// The mesh, or the points, that it was built from (repeatable: time steps).
    #[arg(long, value_name = "INPUT", required = true)]
    against: Vec<PathBuf>,
    /// Only a sample: fewer requests, and errors measured at about 20 000 vertices. For very large meshes.
    #[arg(long)]
    quick: bool,
    /// Print a JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Report<'a> {
    valid: bool,
    queries: u32,
    worst_error_ratio: f64,
    /// Whether only a sample was checked.
    quick: bool,
    /// About what it took.
    memory_bytes: u64,
    failures: &'a [String],
}

/// Shorter runs print no progress.
const LONG: Duration = Duration::from_secs(10);
/// Percent between two lines of progress.
const PRINT_EVERY: u64 = 10;
/// Bytes for each tetrahedron and vertex of the reference mesh beside the MT and the input: two current meshes, the tetrahedra
/// around each vertex, and what requests are answered with.
const TET_BYTES: u64 = 140;
const VERTEX_BYTES: u64 = 240;

/// About the most memory that a verification takes.
fn memory(mt: &Mt, input: &TetMesh) -> u64 {
    let [vertices, tets] = [input.positions.len() as u64, u64::from(mt.info().tetrahedra)];
    let fields = (input.fields.len() + 3) as u64;
    mt.bytes() + (16 + TET_BYTES) * tets + (VERTEX_BYTES + 8 * fields) * vertices
}

pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let opened = files::open_mt(&arguments.file)?;
    let reference = opened.reference();
    let input = input::read_reference(&arguments.against, &opened)?;
    let about = memory(opened.mt()?, &input);
    // Drawn on stderr, and only on a terminal; elsewhere long runs print lines of progress.
    let start = Instant::now();
    let bar = ProgressBar::new(1);
    bar.set_style(ProgressStyle::with_template("{wide_bar} {percent:>3} %  about {eta} left")?);
    let mut printed = 0;
    let mut on_progress = |done: u32, total: u32| {
        bar.set_length(u64::from(total.max(1)));
        bar.set_position(u64::from(done));
        let percent = 100 * u64::from(done) / u64::from(total.max(1));
        if bar.is_hidden() && !arguments.json && percent >= printed + PRINT_EVERY && start.elapsed() >= LONG {
            printed = percent;
            eprintln!("{percent} % ({done} of {total} steps), about {} of memory", output::bytes(about));
        }
    };
    let report = if arguments.quick {
        verify::run_sample(opened.mt()?, &input, reference, Sample::default(), &mut on_progress)
    } else {
        verify::run(opened.mt()?, &input, reference, &mut on_progress)
    };
    bar.finish_and_clear();
    print(arguments, &report, about)?;
    Ok(if report.valid { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn print(arguments: &Arguments, report: &VerifyReport, memory_bytes: u64) -> Result<()> {
    let &Arguments { quick, json, .. } = arguments;
    let VerifyReport { valid, queries, worst_error_ratio, ref failures, .. } = *report;
    let verdict = if valid { "every promise is kept" } else { "promises are broken" };
    let mut rows = vec![
        ("verdict", verdict.to_owned()),
        ("requests", output::count(queries)),
        ("worst error", format!("{} of what is promised", output::percent(worst_error_ratio))),
        ("memory", format!("about {}", output::bytes(memory_bytes))),
    ];
    rows.extend(failures.iter().map(|failure| ("broken", failure.clone())));
    let report = Report { valid, queries, worst_error_ratio, quick, memory_bytes, failures };
    output::result(json, &report, &rows)
}

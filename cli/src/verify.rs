//! `tetralod verify`: does an MT file keep its promises?

use super::files::Opened;
use super::{files, input, output};
use anyhow::{Context, Result, bail};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use std::cell::Cell;
use std::ops::Range;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use tetralod::mesh::TetMesh;
use tetralod::mt::{Mt, MultiTessellation};
use tetralod_build::verify;
use tetralod_build::verify::{GridValues, Reference, Sample, VerifyReport};
use tetralod_io::Pieces;

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
    /// Only N requests, for files that do not fit into memory: one for the whole domain, the others for boxes all over it and for values in
    /// boxes. Each is answered from the file anew, by the blocks that it needs, and its mesh is compared with the input there: of a regular
    /// grid that `part` reads layer by layer no more than that is read.
    #[arg(long, value_name = "N", conflicts_with = "quick", value_parser = clap::value_parser!(u32).range(1..))]
    samples: Option<u32>,
    /// Print a JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    found: &'a VerifyReport,
    /// Whether only a sample was checked.
    quick: bool,
    /// About what it took.
    #[serde(skip_serializing_if = "Option::is_none")]
    memory_bytes: Option<u64>,
    /// What was read of the file, all requests together.
    #[serde(skip_serializing_if = "Option::is_none")]
    bytes_read: Option<u64>,
}

/// Shorter runs print no progress.
const LONG: Duration = Duration::from_secs(10);
/// Percent between two lines of progress.
const PRINT_EVERY: u64 = 10;
/// Bytes for each tetrahedron and vertex of the reference mesh beside the MT and the input: current meshes, a list of all tetrahedra of the
/// MT, what is remembered of each, and what requests are answered with. Updates of kind edge insert more tetrahedra.
const TET_BYTES: u64 = 560;
const EDGE_TET_BYTES: u64 = 800;
const VERTEX_BYTES: u64 = 240;

/// About the most memory that a verification takes.
fn memory(mt: &Mt, input: &TetMesh) -> u64 {
    let [vertices, tets] = [input.positions.len() as u64, mt.info().tetrahedra];
    let fields = (input.fields.len() + 3) as u64;
    let of_tet = if matches!(mt, Mt::Edge(_)) { EDGE_TET_BYTES } else { TET_BYTES };
    mt.bytes() + (16 + of_tet) * tets + (VERTEX_BYTES + 8 * fields) * vertices
}

pub fn run(arguments: &Arguments) -> Result<u8> {
    if let Some(count) = arguments.samples {
        return run_samples(arguments, count).with_context(|| arguments.file.display().to_string());
    }
    let mut opened = files::open_mt(&arguments.file)?;
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
    let mut report = if arguments.quick {
        verify::run_sample(opened.mt()?, &input, reference, Sample::default(), &mut on_progress)
    } else {
        verify::run(opened.mt()?, &input, reference, &mut on_progress)
    };
    report.add(verify::run_shown(&mut opened.session, &input, reference));
    bar.finish_and_clear();
    print(arguments, &report, [Some(about), None])
}

/// A mesh of the whole domain is one that takes at most this part of the file, or so many bytes.
const COARSE_PART: u64 = 64;
const COARSE_BYTES: u64 = 1 << 20;

/// Makes requests one by one, each from a session of its own.
fn run_samples(arguments: &Arguments, count: u32) -> Result<u8> {
    let &Arguments { ref file, ref against, json, .. } = arguments;
    let first = files::open_parts(file)?;
    let all = first.total().unwrap_or(u64::MAX);
    let opened = Opened::of(first);
    if opened.reference() == Reference::Points {
        bail!(
            "--samples are compared with the cells of the input; this file was built from points alone: verify it without"
        );
    }
    let (input, pieces) = match input::open_reference_grid(against, &opened)? {
        Some((input, pieces)) => (input, Some(pieces)),
        None => (input::read_reference_alone(against, &opened)?, None),
    };
    let grid = pieces.as_ref().and_then(Pieces::grid);
    let failed = Cell::new(None);
    let read = |field: usize, points: [Range<u32>; 3]| {
        let read = grid.map_or(Ok(Vec::new()), |grid| grid.values(field, points));
        read.map_err(|error| {
            let said = error.to_string();
            failed.set(Some(error));
            said
        })
    };
    let values = grid.map(|grid| GridValues { layers: grid.layers(), read: &read });
    let most = (all / COARSE_PART).max(COARSE_BYTES);
    let curve = opened.session.bytes_by_error(0);
    let coarse = curve.iter().take_while(|point| point.bytes <= most).last();
    let coarse = coarse.map_or(f64::INFINITY, |point| point.error);
    let samples = verify::samples(opened.info()?, &input, count as usize, coarse);
    drop(opened);
    let mut whole = VerifyReport { valid: true, ..VerifyReport::default() };
    let mut read = 0;
    let bar = if json { ProgressBar::hidden() } else { ProgressBar::new(u64::from(count)) };
    for sample in &samples {
        let mut client = files::open_parts(file)?;
        client.refine(&sample.request)?;
        read += client.session().fetched();
        let mt = client.session().mt().context("the MT has no base mesh")?;
        whole.add(verify::run_request(mt, &input, values.as_ref(), sample));
        if let Some((error, pieces)) = failed.take().zip(pieces.as_ref()) {
            return Err(pieces.named(error).into());
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    print(arguments, &whole, [None, Some(read)])
}

/// Prints what was found, and what that took.
fn print(
    arguments: &Arguments,
    report: &VerifyReport,
    [memory_bytes, bytes_read]: [Option<u64>; 2],
) -> Result<u8> {
    let &Arguments { quick, json, samples, .. } = arguments;
    let quick = quick || samples.is_some();
    let VerifyReport { valid, queries, worst_error_ratio, ref failures, .. } = *report;
    let verdict = if valid { "every promise is kept" } else { "promises are broken" };
    let verdict = if samples.is_some() && valid { "every promise is kept by the samples" } else { verdict };
    let mut rows = vec![
        ("verdict", verdict.to_owned()),
        ("requests", output::count(queries)),
        ("worst error", format!("{} of what is promised", output::percent(worst_error_ratio))),
    ];
    rows.extend(memory_bytes.map(|bytes| ("memory", format!("about {}", output::bytes(bytes)))));
    rows.extend(bytes_read.map(|bytes| ("read", format!("{} of the file", output::bytes(bytes)))));
    rows.extend(failures.iter().map(|failure| ("broken", failure.clone())));
    let report = Report { found: report, quick, memory_bytes, bytes_read };
    output::result(json, &report, &rows)?;
    Ok(if valid { 0 } else { output::FAILED })
}

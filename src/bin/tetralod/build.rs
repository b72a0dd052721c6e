//! `tetralod build`: a mesh to an MT file.

use super::files;
use super::output;
use anyhow::Context;
use anyhow::Result;
use indicatif::ProgressBar;
use indicatif::ProgressStyle;
use serde::Serialize;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Instant;
use tetralod::build::BuildConfig;
use tetralod::build::BuildProgress;
use tetralod::build::BuildResult;
use tetralod::build::BuildSummary;
use tetralod::build::edge_mt;
use tetralod::format::EncodeOptions;
use tetralod::format::encode_to;
use tetralod::mesh::TetMesh;

/// Turns a tetrahedral mesh or a regular grid into an MT file.
#[derive(clap::Args)]
pub struct Arguments {
    /// Mesh or grid: .vtu, .vti, .vtk, or .raw with a .json beside it.
    input: PathBuf,
    /// The MT file to write.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// A point field to keep (repeatable, in this order); the first one if not given.
    #[arg(long = "field", value_name = "NAME")]
    fields: Vec<String>,
    /// Bits of the position lattice, 1 to 30; as few as the thinnest cells allow, at least 16, if not given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=30))]
    position_bits: Option<u32>,
    /// Bits of the field lattices, 1 to 24 [default: 16].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=24))]
    field_bits: Option<u32>,
    /// No progress bar and no summary.
    #[arg(short, long)]
    quiet: bool,
    /// Print the summary as a JSON object.
    #[arg(long, conflicts_with = "quiet")]
    json: bool,
}

/// The summary as programs get it.
#[derive(Serialize)]
struct Report {
    vertices: u32,
    tetrahedra: u32,
    base_vertices: u32,
    base_tetrahedra: u32,
    updates: u32,
    depth: u32,
    position_bits: u32,
    file_bytes: u64,
    bytes_per_vertex: f64,
    seconds: f64,
    repaired: String,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let start = Instant::now();
    let (mesh, repaired) = files::read_mesh(&arguments.input)?;
    let repaired = repaired.to_string();
    if !repaired.is_empty() && !arguments.quiet {
        eprintln!("{}: {repaired}", arguments.input.display());
    }
    let BuildResult { mt, summary, .. } = build(arguments, &mesh)?;
    drop(mesh);
    let options = EncodeOptions::default();
    let file_bytes = files::write_file(&arguments.output, |out| Ok(encode_to(&mt, &options, out)?))?;
    let report = report(&summary, file_bytes, start.elapsed().as_secs_f64(), repaired);
    match arguments {
        Arguments { json: true, .. } => output::json(&report),
        Arguments { quiet: true, .. } => Ok(()),
        _ => print(arguments, &report),
    }
}

fn build(arguments: &Arguments, mesh: &TetMesh) -> Result<BuildResult> {
    let default = BuildConfig::default();
    let config = BuildConfig {
        fields: arguments.fields.clone(),
        position_bits: arguments.position_bits,
        field_bits: arguments.field_bits.unwrap_or(default.field_bits),
        ..default
    };
    // Drawn on stderr, and only on a terminal.
    let bar = if arguments.quiet { ProgressBar::hidden() } else { ProgressBar::new(0) };
    let style = "{msg:<12} {wide_bar} {percent:>3} %  {pos}/{len}  {elapsed_precise}  about {eta} left";
    bar.set_style(ProgressStyle::with_template(style).context("the style of the progress bar")?);
    let mut stage = "";
    let result = edge_mt(mesh, &config, &mut |progress: BuildProgress| {
        bar.set_length(progress.total.max(1));
        if progress.stage != stage {
            stage = progress.stage;
            // Every stage has its own speed.
            bar.reset();
            bar.set_message(stage);
        }
        bar.set_position(progress.done);
        ControlFlow::Continue(())
    });
    bar.finish_and_clear();
    result.with_context(|| arguments.input.display().to_string())
}

fn report(summary: &BuildSummary, file_bytes: u64, seconds: f64, repaired: String) -> Report {
    Report {
        vertices: summary.vertices,
        tetrahedra: summary.tetrahedra,
        base_vertices: summary.base_vertices,
        base_tetrahedra: summary.base_tetrahedra,
        updates: summary.updates,
        depth: summary.depth,
        position_bits: summary.position_bits,
        file_bytes,
        bytes_per_vertex: file_bytes as f64 / f64::from(summary.vertices.max(1)),
        seconds,
        repaired,
    }
}

fn print(arguments: &Arguments, report: &Report) -> Result<()> {
    let removed = f64::from(report.tetrahedra.saturating_sub(report.base_tetrahedra));
    let mesh = |vertices: u32, tets: u32| {
        format!("{} vertices, {} tetrahedra", output::count(vertices), output::count(tets))
    };
    output::table(&[
        ("file", arguments.output.display().to_string()),
        ("reference mesh", mesh(report.vertices, report.tetrahedra)),
        ("base mesh", mesh(report.base_vertices, report.base_tetrahedra)),
        (
            "updates",
            format!("{}, at most {} deep", output::count(report.updates), output::count(report.depth)),
        ),
        ("position bits", report.position_bits.to_string()),
        ("file size", output::bytes(report.file_bytes)),
        ("bytes per vertex", format!("{:.2}", report.bytes_per_vertex)),
        (
            "time",
            format!(
                "{:.2} s ({:.0} tetrahedra removed per second)",
                report.seconds,
                removed / report.seconds
            ),
        ),
    ])
}

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
use tetralod::build::Criterion;
use tetralod::build::Method;
use tetralod::format::EncodeOptions;
use tetralod::format::encode_to;
use tetralod::mesh::TetMesh;
use tetralod::mt::MtKind;

/// Turns a tetrahedral mesh or a regular grid into an MT file.
#[derive(clap::Args)]
pub struct Arguments {
    /// Mesh or grid: .vtu, .vti, .vtk, or .raw with a .json beside it; points without cells for --method insert.
    input: PathBuf,
    /// The MT file to write.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// The kind of MT: edge, vertex or explicit [default: edge].
    #[arg(long, value_name = "KIND", value_parser = kind)]
    kind: Option<MtKind>,
    /// How it is built: collapse (edges, for kind edge), insert or decimate (vertices, for kind vertex); any for kind
    /// explicit [default: collapse, decimate for kind vertex].
    #[arg(long, value_name = "METHOD", value_parser = method)]
    method: Option<Method>,
    /// By what criterion vertices go or come: delaunay, or half-edge with decimate alone [default: half-edge with
    /// decimate].
    #[arg(long, value_name = "CRITERION", value_parser = criterion)]
    criterion: Option<Criterion>,
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

/// The metadata keys under which a file tells how it was built.
pub const METHOD: &str = "method";
pub const CRITERION: &str = "criterion";

/// Parses the name of a kind of MT.
pub fn kind(text: &str) -> Result<MtKind> {
    named(text, &MtKind::ALL.map(|kind| (kind.name(), kind)))
}

fn method(text: &str) -> Result<Method> {
    named(text, &Method::ALL.map(|method| (method.name(), method)))
}

fn criterion(text: &str) -> Result<Criterion> {
    named(text, &Criterion::ALL.map(|criterion| (criterion.name(), criterion)))
}

/// What has this name.
fn named<T: Copy>(text: &str, all: &[(&str, T)]) -> Result<T> {
    let found = all.iter().find(|(name, _)| *name == text).map(|&(_, value)| value);
    let names: Vec<&str> = all.iter().map(|(name, _)| *name).collect();
    found.with_context(|| format!("it must be one of: {}", names.join(", ")))
}

/// The summary as programs get it.
#[derive(Serialize)]
struct Report {
    kind: &'static str,
    method: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    criterion: Option<&'static str>,
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
    let config = config(arguments);
    let (mesh, repaired) = if config.method.keeps_the_mesh() {
        files::read_mesh(&arguments.input)?
    } else {
        files::read_points(&arguments.input)?
    };
    let repaired = repaired.to_string();
    if !repaired.is_empty() && !arguments.quiet {
        eprintln!("{}: {repaired}", arguments.input.display());
    }
    let BuildResult { mt, summary, .. } = build(arguments, &config, &mesh)?;
    drop(mesh);
    let told = metadata(&config);
    let metadata = told.into_iter().map(|(k, v)| (k.into(), v.into())).collect();
    let options = EncodeOptions { metadata, ..EncodeOptions::default() };
    let file_bytes = files::write_file(&arguments.output, |out| Ok(encode_to(&mt, &options, out)?))?;
    let report = report(&config, &summary, file_bytes, start.elapsed().as_secs_f64(), repaired);
    match arguments {
        Arguments { json: true, .. } => output::json(&report),
        Arguments { quiet: true, .. } => Ok(()),
        _ => print(arguments, &report),
    }
}

/// How to build. Ends the program if the options contradict each other.
fn config(arguments: &Arguments) -> BuildConfig {
    let default = BuildConfig::default();
    let kind = arguments.kind.unwrap_or(default.kind);
    let method = arguments.method.unwrap_or(Method::usual(kind));
    let config = BuildConfig {
        kind,
        method,
        criterion: arguments.criterion.unwrap_or(Criterion::usual(method)),
        fields: arguments.fields.clone(),
        position_bits: arguments.position_bits,
        field_bits: arguments.field_bits.unwrap_or(default.field_bits),
        ..default
    };
    if let Err(error) = config.check() {
        super::refuse_usage(&error.to_string());
    }
    if method == Method::Collapse && arguments.criterion.is_some() {
        super::refuse_usage("--criterion goes with --method insert or decimate, not with collapse");
    }
    config
}

/// What the file tells of how it was built.
fn metadata(config: &BuildConfig) -> Vec<(&'static str, &'static str)> {
    let criterion = (config.method != Method::Collapse).then_some((CRITERION, config.criterion.name()));
    criterion.into_iter().chain([(METHOD, config.method.name())]).collect()
}

fn build(arguments: &Arguments, config: &BuildConfig, mesh: &TetMesh) -> Result<BuildResult> {
    // Drawn on stderr, and only on a terminal.
    let bar = if arguments.quiet { ProgressBar::hidden() } else { ProgressBar::new(0) };
    let style = "{msg:<12} {wide_bar} {percent:>3} %  {pos}/{len}  {elapsed_precise}  about {eta} left";
    bar.set_style(ProgressStyle::with_template(style).context("the style of the progress bar")?);
    let mut stage = "";
    let result = tetralod::build::build(mesh, config, &mut |progress: BuildProgress| {
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

fn report(
    config: &BuildConfig,
    summary: &BuildSummary,
    file_bytes: u64,
    seconds: f64,
    repaired: String,
) -> Report {
    Report {
        kind: config.kind.name(),
        method: config.method.name(),
        criterion: (config.method != Method::Collapse).then_some(config.criterion.name()),
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

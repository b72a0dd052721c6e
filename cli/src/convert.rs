//! `tetralod convert`: an MT file to one of another kind.

use super::build::options;
use super::files;
use super::output::{self, Verbosity};
use anyhow::{Context, Result, anyhow};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;
use tetralod::mt::{ConvertError, MtKind, MultiTessellation, UpdatePages};

/// Writes the same updates as an MT of another kind that can hold them (half-edge and vertex, which are both made of vertex
/// insertions), or in blocks of another size.
#[derive(clap::Args)]
pub struct Arguments {
    /// The MT file, or its http(s) address.
    file: PathBuf,
    /// The MT file to write.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// The kind of MT that it becomes: half-edge, edge or vertex.
    #[arg(long, value_name = "KIND", value_parser = options::kind)]
    kind: MtKind,
    /// Updates in a block, the least that can be fetched of the file by itself: a power of two, 16 to 65536 [default: as in the file; of
    /// another kind 2048, 256 for kind half-edge].
    #[arg(long, value_name = "N", value_parser = options::block_bits)]
    block_updates: Option<u32>,
    #[command(flatten)]
    verbosity: Verbosity,
}

/// The summary as programs get it.
#[derive(Serialize)]
struct Report {
    kind: &'static str,
    from: &'static str,
    vertices: u32,
    tetrahedra: u32,
    updates: u32,
    file_bytes: u64,
    bytes_per_vertex: f64,
    memory_bytes: u64,
    /// How many regions the file has not any more, since its kind has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    regions_left_out: Option<usize>,
    seconds: f64,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let start = Instant::now();
    files::check_ending(&arguments.output, "mt")?;
    files::check_output(&arguments.output, [&arguments.file])?;
    let mut opened = files::open_mt(&arguments.file)?;
    let from = opened.info()?.kind;
    let regions = opened.mt()?.regions().map(|regions| regions.all.len());
    let converted = opened.mt()?.convert(arguments.kind);
    let hint = |error| match error {
        ConvertError::Kinds { to, .. } => anyhow!("{error}, with `tetralod build --kind {}`", to.name()),
        _ => error.into(),
    };
    let mut mt = converted.map_err(hint).with_context(|| arguments.file.display().to_string())?;
    if let Some(bits) = arguments.block_updates.filter(|&bits| bits != mt.page_bits()) {
        mt = mt.in_pages(bits)?;
    }
    mt.find_bounds()?;
    // Conversions keep the numbers of the vertices.
    let exact = opened.session.exact_tables()?;
    let metadata = opened.session.metadata().iter().cloned().collect();
    let file_bytes = files::write_mt(&arguments.output, &mt, exact, metadata)?;
    let info = mt.info();
    let report = Report {
        kind: info.kind.name(),
        from: from.name(),
        vertices: info.vertices,
        tetrahedra: info.tetrahedra,
        updates: info.updates,
        file_bytes,
        bytes_per_vertex: file_bytes as f64 / f64::from(info.vertices.max(1)),
        memory_bytes: mt.bytes(),
        regions_left_out: regions.filter(|_| mt.regions().is_none()),
        seconds: start.elapsed().as_secs_f64(),
    };
    let mut rows = vec![
        ("file", arguments.output.display().to_string()),
        ("kind", format!("{}, was {}", report.kind, report.from)),
        ("reference mesh", output::mesh(report.vertices, report.tetrahedra)),
        ("updates", output::count(report.updates)),
        ("file size", output::bytes(report.file_bytes)),
        ("bytes per vertex", format!("{:.2}", report.bytes_per_vertex)),
        ("in memory", output::bytes(report.memory_bytes)),
        ("time", format!("{:.2} s", report.seconds)),
    ];
    if let Some(count) = report.regions_left_out {
        rows.push((
            "left out",
            format!("{} regions: only kind half-edge has them", output::count(count as u32)),
        ));
    }
    arguments.verbosity.print(&report, &rows)
}

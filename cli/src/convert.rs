//! `tetralod convert`: an MT file to one of another kind, or in other shards.

use super::build::options;
use super::files::{self, Opened};
use super::output::{self, Verbosity};
use super::shards::Sharding;
use anyhow::{Context, Result, anyhow};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;
use tetralod::mt::{ConvertError, MtInfo, MtKind, MultiTessellation, UpdatePages};

/// Writes the same updates as an MT of another kind that can hold them (half-edge and vertex, which are both made of vertex
/// insertions), or in blocks of another size. With --shard-size alone the bytes stay as they are, and only the files that they are in change.
#[derive(clap::Args)]
pub struct Arguments {
    /// The MT file, or its http(s) address.
    file: PathBuf,
    /// The MT file to write.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// The kind of MT that it becomes: half-edge, edge or vertex.
    #[arg(long, value_name = "KIND", value_parser = options::kind, required_unless_present = "shard_size")]
    kind: Option<MtKind>,
    /// Updates in a block, the least that can be fetched of the file by itself: a power of two, 16 to 65536 [default: as in the file; of
    /// another kind 2048, 256 for kind half-edge].
    #[arg(long, value_name = "N", value_parser = options::block_bits, requires = "kind")]
    block_updates: Option<u32>,
    #[command(flatten)]
    sharding: Sharding,
    #[command(flatten)]
    verbosity: Verbosity,
}

/// The summary as programs get it.
#[derive(Serialize)]
struct Report {
    kind: &'static str,
    from: &'static str,
    vertices: u32,
    tetrahedra: u64,
    updates: u32,
    file_bytes: u64,
    /// In how many shards the file is, if these were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    shards: Option<u64>,
    bytes_per_vertex: f64,
    /// Not known of a file that was copied as it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    memory_bytes: Option<u64>,
    /// How many regions the file has not any more, since its kind has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    regions_left_out: Option<usize>,
    seconds: f64,
}

impl Report {
    /// Of a file that is written, of what it was made of.
    fn of(info: &MtInfo, file_bytes: u64, sharding: Sharding, start: Instant) -> Self {
        let kind = info.kind.name();
        Self {
            kind,
            from: kind,
            vertices: info.vertices,
            tetrahedra: info.tetrahedra,
            updates: info.updates,
            file_bytes,
            shards: sharding.count(file_bytes),
            bytes_per_vertex: file_bytes as f64 / f64::from(info.vertices.max(1)),
            memory_bytes: None,
            regions_left_out: None,
            seconds: start.elapsed().as_secs_f64(),
        }
    }
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let start = Instant::now();
    files::check_ending(&arguments.output, "mt")?;
    files::check_output(&arguments.output, [&arguments.file])?;
    let report = match arguments.kind {
        Some(kind) => convert(arguments, kind, start)?,
        None => copy(arguments, start)?,
    };
    let mut rows = vec![
        ("file", arguments.output.display().to_string()),
        ("kind", format!("{}, was {}", report.kind, report.from)),
        ("reference mesh", output::mesh(report.vertices, report.tetrahedra)),
        ("updates", output::count(report.updates)),
        ("file size", output::file_size(report.file_bytes, report.shards)),
        ("bytes per vertex", format!("{:.2}", report.bytes_per_vertex)),
    ];
    rows.extend(report.memory_bytes.map(|memory| ("in memory", output::bytes(memory))));
    rows.push(("time", format!("{:.2} s", report.seconds)));
    if let Some(count) = report.regions_left_out {
        rows.push((
            "left out",
            format!("{} regions: only kind half-edge has them", output::count(count as u32)),
        ));
    }
    arguments.verbosity.print(&report, &rows)
}

/// Writes the same bytes into other shards.
fn copy(arguments: &Arguments, start: Instant) -> Result<Report> {
    let &Arguments { ref file, ref output, sharding, .. } = arguments;
    // It is refused before anything is written if it is no MT file.
    let opened = Opened::of(files::open_parts(file).with_context(|| file.display().to_string())?);
    let file_bytes = sharding.write(output, |path| files::copy_mt(file, path))?;
    Ok(Report::of(opened.info()?, file_bytes, sharding, start))
}

/// Writes an MT of another kind.
fn convert(arguments: &Arguments, kind: MtKind, start: Instant) -> Result<Report> {
    let mut opened = files::open_mt(&arguments.file)?;
    let from = opened.info()?.kind;
    let regions = opened.mt()?.regions().map(|regions| regions.all.len());
    let converted = opened.mt()?.convert(kind);
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
    let write = |path: &Path| files::write_mt(path, &mt, exact, metadata);
    let file_bytes = arguments.sharding.write(&arguments.output, write)?;
    Ok(Report {
        from: from.name(),
        memory_bytes: Some(mt.bytes()),
        regions_left_out: regions.filter(|_| mt.regions().is_none()),
        ..Report::of(mt.info(), file_bytes, arguments.sharding, start)
    })
}

//! `tetralod join`: parts that are built to one MT file.

use super::output::{self, Verbosity};
use super::parts::Written;
use super::shards::Sharding;
use super::{build, extremes, files, parts};
use anyhow::{Context, Result};
use serde::Serialize;
use std::fs;
use std::path::{Path, PathBuf};
use tetralod::mt::{AveragedField, MultiTessellation};
use tetralod_build::BuildSummary;
use tetralod_build::parts::Node;

/// Joins parts that `tetralod build --part` has built: with --node those of one level to one of the next, with -o all that has been
/// built to one MT file.
#[derive(clap::Args)]
pub struct Arguments {
    /// The folder that `tetralod part` has written.
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
    /// What to make: level L, from 1, and the number there, from 0.
    #[arg(long, value_name = "L/K", value_parser = parts::node)]
    node: Option<Node>,
    /// The MT file to write, once the last level has been joined.
    #[arg(short, long, value_name = "FILE", required_unless_present = "node", conflicts_with = "node")]
    output: Option<PathBuf>,
    #[command(flatten)]
    sharding: Sharding,
    #[command(flatten)]
    verbosity: Verbosity,
}

/// The summary as programs get it.
#[derive(Serialize)]
struct Report {
    #[serde(flatten)]
    counts: BuildSummary,
    file_bytes: u64,
    /// In how many shards the file is, if these were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    shards: Option<u64>,
    /// How many regions the file has, if it has some.
    #[serde(skip_serializing_if = "Option::is_none")]
    regions: Option<usize>,
    /// What averaging has done to the fields that the input has at cells.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    averaged: Vec<AveragedField>,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let &Arguments { ref folder, node, ref output, sharding, ref verbosity } = arguments;
    if let Some(node) = node {
        return parts::join_node(folder, node, verbosity);
    }
    let output = output.as_ref().context("-o FILE is missing")?;
    files::check_ending(output, "mt")?;
    finish(folder, output, sharding, verbosity)
}

/// Writes the MT file of all that has been built.
pub fn finish(folder: &Path, output: &Path, sharding: Sharding, verbosity: &Verbosity) -> Result<()> {
    // All parts in the folder are read.
    let entries = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let parts: Vec<PathBuf> = entries.filter(|path| files::ending(path) == "part").collect();
    files::check_output(output, &parts)?;
    let Written { mt, summary, bytes: file_bytes } = parts::assemble(folder, output, sharding, verbosity)?;
    let shards = sharding.count(file_bytes);
    let mut rows = vec![("file", output.display().to_string())];
    rows.extend(build::report::rows_of(&summary));
    rows.push(("file size", output::file_size(file_bytes, shards)));
    let regions = mt.regions().map(|regions| regions.all.len());
    rows.extend(regions.map(|count| ("regions", output::count(count as u32))));
    let averaged = mt.info().averaged_fields();
    rows.extend(extremes::rows(&averaged, extremes::size(mt.info())));
    verbosity.print(&Report { counts: summary, file_bytes, shards, regions, averaged }, &rows)
}

//! What `tetralod build` says of the file that it has written.

use crate::repair::Repair;
use crate::restrictions::Angles;
use crate::{extremes, output};
use serde::Serialize;
use std::path::Path;
use tetralod::mt::AveragedField;
use tetralod_build::BuildSummary;

/// The summary as programs get it.
#[derive(Default, Serialize)]
pub(super) struct Report {
    pub kind: &'static str,
    pub method: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub criterion: Option<&'static str>,
    #[serde(flatten)]
    pub counts: BuildSummary,
    /// How many regions the file has, if arrays were to be kept apart: 0 in a file of a kind that has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub regions: Option<usize>,
    /// How far interfaces between regions have moved, in model units, if they may.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interface_deviation: Option<f64>,
    pub file_bytes: u64,
    /// In how many shards the file is, if these were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shards: Option<u64>,
    pub bytes_per_vertex: f64,
    pub seconds: f64,
    /// What was done in words; the same and more is in `repair`.
    pub repaired: String,
    /// Of points without cells nothing is repaired.
    pub repair: Option<Repair>,
    /// With a bound for them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angles: Option<Angles>,
    /// What averaging has done to the fields that the input has at cells.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub averaged: Vec<AveragedField>,
    /// The diagonal of the domain, for people.
    #[serde(skip)]
    pub size: f64,
    /// The files that were read, at their places without links.
    pub inputs: Vec<String>,
    /// What the reader left out of the input or changed, in words.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

/// The counts of a build for people.
pub fn rows_of(counts: &BuildSummary) -> [(&'static str, String); 3] {
    let &BuildSummary { vertices, tetrahedra, base_vertices, base_tetrahedra, updates, depth, .. } = counts;
    [
        ("reference mesh", output::mesh(vertices, tetrahedra)),
        ("base mesh", output::mesh(base_vertices, base_tetrahedra.into())),
        ("updates", format!("{}, at most {} deep", output::count(updates), output::count(depth))),
    ]
}

/// How many regions a file has.
fn said(regions: usize) -> String {
    match regions {
        0 => "none in the file: only kind half-edge has them; their interfaces are kept".to_owned(),
        _ => output::count(regions as u32),
    }
}

pub(super) fn rows(output: &Path, report: &Report) -> Vec<(&'static str, String)> {
    let counts = &report.counts;
    let removed = counts.tetrahedra.saturating_sub(counts.base_tetrahedra.into()) as f64;
    let mut rows = vec![("file", output.display().to_string())];
    rows.extend(rows_of(counts));
    rows.extend([
        ("position bits", counts.position_bits.to_string()),
        ("file size", output::file_size(report.file_bytes, report.shards)),
        ("bytes per vertex", format!("{:.2}", report.bytes_per_vertex)),
        (
            "time",
            format!(
                "{:.2} s ({:.0} tetrahedra removed per second)",
                report.seconds,
                removed / report.seconds
            ),
        ),
    ]);
    rows.extend(report.regions.map(|count| ("regions", said(count))));
    let moved = report
        .interface_deviation
        .map(|moved| ("interfaces moved", format!("{} at most", output::number(moved))));
    rows.extend(moved);
    rows.extend(report.angles.iter().flat_map(Angles::rows));
    rows.extend(extremes::rows(&report.averaged, report.size));
    rows
}

//! `tetralod verify`: does an MT file keep its promises?

use super::files;
use super::output;
use anyhow::Result;
use indicatif::ProgressBar;
use indicatif::ProgressStyle;
use serde::Serialize;
use std::path::PathBuf;
use std::process::ExitCode;
use tetralod::verify;
use tetralod::verify::VerifyReport;

/// Checks every promise of an MT file against the mesh that it was built from; exit code 1 if one is broken.
#[derive(clap::Args)]
pub struct Arguments {
    /// The MT file, or its http(s) address.
    file: PathBuf,
    /// The mesh, or the points, that it was built from (repeatable: time steps).
    #[arg(long, value_name = "INPUT", required = true)]
    against: Vec<PathBuf>,
    /// Print a JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Report<'a> {
    valid: bool,
    queries: u32,
    worst_error_ratio: f64,
    failures: &'a [String],
}

pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let opened = files::open_mt(&arguments.file)?;
    let reference = opened.reference();
    let input = files::read_reference(&arguments.against, &opened)?;
    // Drawn on stderr, and only on a terminal.
    let bar = ProgressBar::new(1);
    bar.set_style(ProgressStyle::with_template("{wide_bar} {percent:>3} %  about {eta} left")?);
    let report = verify::run(opened.mt()?, &input, reference, &mut |done, total| {
        bar.set_length(u64::from(total.max(1)));
        bar.set_position(u64::from(done));
    });
    bar.finish_and_clear();
    if arguments.json {
        print_json(&report)?
    } else {
        print(&report)?
    }
    Ok(if report.valid { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn print_json(report: &VerifyReport) -> Result<()> {
    let VerifyReport { valid, queries, worst_error_ratio, ref failures, .. } = *report;
    output::json(&Report { valid, queries, worst_error_ratio, failures })
}

fn print(report: &VerifyReport) -> Result<()> {
    let verdict = if report.valid { "every promise is kept" } else { "promises are broken" };
    let mut rows = vec![
        ("verdict", verdict.to_owned()),
        ("requests", output::count(report.queries)),
        ("worst error", format!("{} of what is promised", output::percent(report.worst_error_ratio))),
    ];
    rows.extend(report.failures.iter().map(|failure| ("broken", failure.clone())));
    output::table(&rows)
}

//! `tetralod verify`: does an MT file keep its promises?

use super::build::METHOD;
use super::files;
use super::files::Opened;
use super::output;
use anyhow::Result;
use indicatif::ProgressBar;
use indicatif::ProgressStyle;
use serde::Serialize;
use std::path::PathBuf;
use std::process::ExitCode;
use tetralod::build::Method;
use tetralod::verify;
use tetralod::verify::Reference;
use tetralod::verify::VerifyReport;

/// Checks every promise of an MT file against the mesh that it was built from; exit code 1 if one is broken.
#[derive(clap::Args)]
pub struct Arguments {
    /// The MT file.
    file: PathBuf,
    /// The mesh that it was built from.
    #[arg(long, value_name = "INPUT")]
    against: PathBuf,
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
    let reference = reference(&opened);
    let input = match reference {
        Reference::Mesh => files::read_mesh(&arguments.against)?.0,
        Reference::Points => files::read_points(&arguments.against)?.0,
    };
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

/// What is to be the same, by what the builder wrote into the file.
fn reference(opened: &Opened) -> Reference {
    let mut metadata = opened.session.metadata().iter();
    let method = metadata.find(|(key, _)| key == METHOD).map(|(_, value)| value.as_str());
    let found = Method::ALL.into_iter().find(|m| Some(m.name()) == method);
    if found.is_none_or(Method::keeps_the_mesh) { Reference::Mesh } else { Reference::Points }
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

//! `tetralod surface`: the boundary of the mesh.

use super::output;
use super::poly::Amount;
use super::poly::Target;
use super::query::Query;
use super::query::Summary;
use anyhow::Result;
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;
use tetralod::io::PolyData;
use tetralod::view::BoundarySurface;

/// Writes the boundary of the mesh: the faces of tetrahedra behind which there is nothing, facing outwards, with all
/// fields.
#[derive(clap::Args)]
#[command(after_help = "Example: tetralod surface engine.mt --error 5% -o engine.stl")]
pub struct Arguments {
    /// The MT file, or its http(s) address.
    file: PathBuf,
    #[command(flatten)]
    query: Query,
    /// The surface to write: .vtp, .stl, .ply, .obj, or .csv for its points.
    #[arg(short, long, value_name = "FILE")]
    output: Target,
    /// Print the result as a JSON object.
    #[arg(long)]
    json: bool,
}

/// The result as programs get it.
#[derive(Serialize)]
struct Report {
    #[serde(flatten)]
    surface: Amount,
    closed: bool,
    #[serde(flatten)]
    mesh: Summary,
    seconds: f64,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    arguments.output.check(arguments.query.files().chain([&arguments.file]))?;
    let mut answer = arguments.query.answer(&arguments.file)?;
    let (names, fields) = (answer.field_names()?, answer.all_values()?);
    let start = Instant::now();
    let mut surface = BoundarySurface::new();
    surface.extract(&answer.opened.session.view());
    let seconds = start.elapsed().as_secs_f64();
    let closed = surface.is_closed();
    let values = |field: &Vec<f32>| surface.points.iter().map(|p| field[*p as usize]).collect();
    let fields = names.into_iter().zip(fields.iter().map(values)).collect();
    let data =
        PolyData { positions: surface.positions, fields, triangles: surface.indices, ..PolyData::default() };
    arguments.output.write(&data)?;
    let report = Report { surface: Amount::of(&data), closed, mesh: answer.summary, seconds };
    if arguments.json { output::json(&report) } else { print(arguments, &report) }
}

fn print(arguments: &Arguments, report: &Report) -> Result<()> {
    let mut rows = report.surface.rows(&arguments.output);
    rows.push(("closed", if report.closed { "yes" } else { "no" }.to_owned()));
    rows.extend(report.mesh.rows());
    rows.push(("time", format!("{:.3} s", report.seconds)));
    output::table(&rows)
}

//! `tetralod surface`: the boundary of the mesh.

use super::output;
use super::poly::Target;
use super::query::Query;
use super::query::Summary;
use anyhow::Result;
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;
use tetralod::io::PolyData;
use tetralod::view::BoundarySurface;

/// Writes the boundary of the mesh: the faces of tetrahedra behind which there is nothing, facing outwards.
#[derive(clap::Args)]
#[command(after_help = "Example: tetralod surface engine.mt --error 5% -o engine.stl")]
pub struct Arguments {
    /// The MT file.
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

/// The result as programs get it; the area is in square model units.
#[derive(Serialize)]
struct Report {
    points: usize,
    triangles: usize,
    area: f64,
    closed: bool,
    #[serde(flatten)]
    mesh: Summary,
    seconds: f64,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let mut answer = arguments.query.answer(&arguments.file)?;
    let start = Instant::now();
    let mut surface = BoundarySurface::new();
    surface.extract(&answer.opened.session.view());
    let seconds = start.elapsed().as_secs_f64();
    let (area, closed) = (surface.area(), surface.is_closed());
    let data = PolyData {
        positions: surface.positions,
        fields: vec![(answer.summary.field.clone(), surface.values)],
        triangles: surface.indices,
        ..PolyData::default()
    };
    arguments.output.write(&data)?;
    let report = Report {
        points: data.positions.len(),
        triangles: data.triangles.len(),
        area,
        closed,
        mesh: answer.summary,
        seconds,
    };
    if arguments.json { output::json(&report) } else { print(arguments, &report) }
}

fn print(arguments: &Arguments, report: &Report) -> Result<()> {
    let mut rows = vec![
        ("file", arguments.output.path.display().to_string()),
        ("points", output::count(report.points as u64)),
        ("triangles", output::count(report.triangles as u64)),
        ("area", output::number(report.area)),
        ("closed", if report.closed { "yes" } else { "no" }.to_owned()),
    ];
    rows.extend(report.mesh.rows());
    rows.push(("time", format!("{:.3} s", report.seconds)));
    output::table(&rows)
}

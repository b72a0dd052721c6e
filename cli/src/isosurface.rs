//! `tetralod isosurface`: surfaces on which a field has a value.

use super::poly::{Amount, Target};
use super::query::Query;
use anyhow::Result;
use serde::Serialize;
use std::time::Instant;
use tetralod::io::{PointValues, PolyData};
use tetralod::view::is_closed;

/// Writes isosurfaces: where the field has the values given with --iso.
///
/// The mesh is refined around these values alone, to the error that is asked for.
#[derive(clap::Args)]
#[command(after_help = "Example: tetralod isosurface engine.mt --iso 0.3 --iso 0.6 --error 1% -o engine.vtp")]
pub struct Arguments {
    #[command(flatten)]
    query: Query,
    /// The surface to write: .vtp, .stl, .ply, .obj, .npz, or .csv for its points.
    #[arg(short, long, value_name = "FILE")]
    output: Target,
}

/// The result as programs get it.
#[derive(Serialize)]
struct Report {
    isovalues: Vec<f64>,
    #[serde(flatten)]
    surface: Amount,
    /// Whether the surfaces have no border.
    closed: bool,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let isovalues = arguments.query.isovalues();
    if isovalues.is_empty() {
        super::refuse_usage("isosurface needs a value: give --iso V, in units of the field");
    }
    arguments.output.check(arguments.query.files())?;
    let mut answer = arguments.query.answer()?;
    let start = Instant::now();
    let surface = answer.opened.session.isosurfaces(isovalues)?;
    let (positions, normals) = (surface.positions.clone(), surface.normals.clone());
    let (values, triangles) = (surface.values.clone(), surface.indices.clone());
    let seconds = start.elapsed().as_secs_f64();
    let step = answer.opened.info()?.fields[answer.field].step;
    let data = PolyData {
        normals,
        fields: vec![PointValues { name: answer.summary.field.clone(), values, step }],
        triangles,
        ..answer.poly_data(positions)?
    };
    let origin = arguments.output.write(&data)?;
    let report = Report {
        isovalues: isovalues.to_vec(),
        surface: Amount::of(&data, origin),
        closed: is_closed(&data.triangles),
    };
    let mut rows = report.surface.rows(&arguments.output);
    rows.push(("border", if report.closed { "none" } else { "where the mesh ends" }.to_owned()));
    arguments.query.print(&report, rows, (&answer.summary, seconds))
}

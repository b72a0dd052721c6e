//! `tetralod surface`: the boundary of the mesh.

use super::deform::{Deform, Displaced};
use super::poly::{Amount, Target};
use super::query::Query;
use anyhow::Result;
use serde::Serialize;
use std::time::Instant;
use tetralod::view::BoundarySurface;
use tetralod_io::PolyData;

/// Writes the boundary of the mesh: the faces of tetrahedra behind which there is nothing, facing outwards, with all
/// fields.
#[derive(clap::Args)]
#[command(after_help = "Example: tetralod surface engine.mt --error 5% -o engine.stl")]
pub struct Arguments {
    #[command(flatten)]
    query: Query,
    /// The surface to write: .vtp, .stl, .ply, .obj, .npz, or .csv for its points.
    #[arg(short, long, value_name = "FILE")]
    output: Target,
    #[command(flatten)]
    deform: Deform,
}

/// The result as programs get it.
#[derive(Serialize)]
struct Report {
    #[serde(flatten)]
    surface: Amount,
    closed: bool,
    #[serde(flatten)]
    displaced: Option<Displaced>,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    arguments.output.check(arguments.query.files())?;
    let mut answer = arguments.query.answer()?;
    let fields = answer.all_values()?;
    let start = Instant::now();
    let mut surface = BoundarySurface::new();
    surface.extract(&answer.opened.session.view());
    let seconds = start.elapsed().as_secs_f64();
    let closed = surface.is_closed();
    let values: Vec<Vec<f64>> = fields.iter().map(|field| surface.interpolate(field)).collect();
    let (deformation, displaced) = arguments.deform.of(&arguments.query, &answer)?.unzip();
    if let Some(deformation) = deformation {
        surface.positions =
            deformation.moved(&surface.positions, deformation.fields.map(|field| values[field].as_slice()));
    }
    let fields = answer.point_values(values)?;
    let data = PolyData { fields, triangles: surface.indices, ..answer.poly_data(surface.positions)? };
    let origin = arguments.output.write(&data)?;
    let report = Report { surface: Amount::of(&data, origin), closed, displaced };
    let mut rows = report.surface.rows(&arguments.output);
    rows.push(("closed", if closed { "yes" } else { "no" }.to_owned()));
    rows.extend(report.displaced.iter().flat_map(Displaced::rows));
    arguments.query.print(&report, rows, (&answer.summary, seconds))
}

//! `tetralod isosurface`: surfaces on which a field has a value.

use super::deform::{Deform, Displaced};
use super::poly::{Amount, Target};
use super::query::Query;
use anyhow::Result;
use serde::Serialize;
use std::time::Instant;
use tetralod::view::{Triangles, is_closed};
use tetralod_io::PolyData;

/// Writes isosurfaces: where the field has the values given with --iso.
///
/// The mesh is refined around these values alone, to the error that is asked for. All fields are written.
#[derive(clap::Args)]
#[command(after_help = "Example: tetralod isosurface engine.mt --iso 0.3 --iso 0.6 --error 1% -o engine.vtp")]
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
    isovalues: Vec<f64>,
    #[serde(flatten)]
    surface: Amount,
    /// Whether the surfaces have no border.
    closed: bool,
    #[serde(flatten)]
    displaced: Option<Displaced>,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let isovalues = arguments.query.isovalues();
    if isovalues.is_empty() {
        crate::usage::refuse_usage("isosurface needs a value: give --iso V, in units of the field");
    }
    arguments.output.check(arguments.query.files())?;
    let mut answer = arguments.query.answer()?;
    let fields = answer.all_values()?;
    let views = answer.views(&fields)?;
    let start = Instant::now();
    let mut surface = answer.opened.session.isosurfaces(isovalues)?.clone();
    let seconds = start.elapsed().as_secs_f64();
    let deformed = arguments.deform.of(&arguments.query, &answer)?;
    let mesh = answer.opened.session.view();
    let mut values: Vec<Vec<f64>> =
        views.into_iter().map(|field| surface.interpolate(&mesh, field)).collect();
    // Of its own field they are the isovalues, without rounding.
    values[answer.field].clone_from(&surface.values);
    let (deformation, displaced) = deformed.unzip();
    if let Some(deformation) = deformation {
        let slopes = surface.slopes(&mesh, deformation.fields.map(|field| fields[field].as_slice()));
        let times = deformation.factor * deformation.part;
        surface.normals = Triangles { slopes: &slopes, ..Triangles::from(&surface) }.turned_normals(times);
        surface.positions =
            deformation.moved(&surface.positions, deformation.fields.map(|field| values[field].as_slice()));
    }
    let data = PolyData {
        normals: surface.normals,
        fields: answer.point_values(values)?,
        triangles: surface.indices,
        ..answer.poly_data(surface.positions)?
    };
    let origin = arguments.output.write(&data)?;
    let report = Report {
        isovalues: isovalues.to_vec(),
        surface: Amount::of(&data, origin),
        closed: is_closed(&data.triangles),
        displaced,
    };
    let mut rows = report.surface.rows(&arguments.output);
    rows.push(("border", if report.closed { "none" } else { "where the mesh ends" }.to_owned()));
    rows.extend(report.displaced.iter().flat_map(Displaced::rows));
    arguments.query.print(&report, rows, (&answer.summary, seconds))
}

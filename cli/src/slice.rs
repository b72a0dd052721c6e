//! `tetralod slice`: the mesh in a plane.

use super::deform::{Deform, Displaced};
use super::output;
use super::parse::parse_plane;
use super::poly::{Amount, Target};
use super::query::Query;
use anyhow::Result;
use serde::Serialize;
use std::time::Instant;
use tetralod::view::{Plane, Slice};
use tetralod_io::PolyData;

/// Writes the section of the mesh with a plane, with all fields interpolated in it.
#[derive(clap::Args)]
#[command(
    after_help = "Examples: tetralod slice engine.mt --plane z=0.5 --error 1% -o slice.vtp\n          \
                        tetralod slice engine.mt --plane 1,1,0,12.5 --edges -o slice.obj"
)]
pub struct Arguments {
    /// The plane: x=D, y=D or z=D, or the points p with n · p = D; in model units.
    #[arg(long, value_name = "nx,ny,nz,D", value_parser = parse_plane, allow_hyphen_values = true)]
    plane: Plane,
    /// Also write the edges of the mesh's cells in the plane, as lines.
    #[arg(long)]
    edges: bool,
    #[command(flatten)]
    query: Query,
    /// The surface to write: .vtp, .stl (without edges), .ply, .obj, .npz, or .csv for its points.
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
    #[serde(skip_serializing_if = "Option::is_none")]
    edges: Option<usize>,
    #[serde(flatten)]
    displaced: Option<Displaced>,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    arguments.output.check(arguments.query.files())?;
    let mut answer = arguments.query.answer()?;
    let fields = answer.all_values()?;
    let views = answer.views(&fields)?;
    let (deformation, displaced) = arguments.deform.of(&arguments.query, &answer)?.unzip();
    let mesh = answer.opened.session.view();
    let start = Instant::now();
    let mut slice = Slice::new();
    slice.extract(&mesh, &arguments.plane);
    let mut edges = Vec::new();
    if arguments.edges {
        slice.cell_edges(&mut edges);
    }
    let seconds = start.elapsed().as_secs_f64();
    let values: Vec<Vec<f64>> = views.into_iter().map(|field| slice.interpolate(&mesh, field)).collect();
    // The section with the plane, displaced.
    let positions = deformation.map_or_else(
        || slice.positions().to_vec(),
        |by| by.moved(slice.positions(), by.fields.map(|field| values[field].as_slice())),
    );
    let data = PolyData {
        fields: answer.point_values(values)?,
        triangles: slice.indices().to_vec(),
        lines: edges.iter().map(|edge| edge.to_vec()).collect(),
        ..answer.poly_data(positions)?
    };
    let origin = arguments.output.write(&data)?;
    let edges = arguments.edges.then_some(edges.len());
    let report = Report { surface: Amount::of(&data, origin), edges, displaced };
    let mut rows = report.surface.rows(&arguments.output);
    if let Some(edges) = edges {
        rows.push(("cell edges", output::count(edges as u64)));
    }
    rows.extend(report.displaced.iter().flat_map(Displaced::rows));
    arguments.query.print(&report, rows, (&answer.summary, seconds))
}

//! `tetralod extract`: the mesh that a request needs, out of an MT file.

use super::files;
use super::files::Opened;
use super::output;
use anyhow::Context;
use anyhow::Result;
use serde::Serialize;
use std::path::Path;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Instant;
use tetralod::geom::Bounds;
use tetralod::measure::Part;
use tetralod::measure::Promise;
use tetralod::measure::Reference;
use tetralod::measure::deviation;
use tetralod::mesh::Field;
use tetralod::mesh::TetMesh;
use tetralod::mt::CurrentMesh;
use tetralod::mt::MtInfo;
use tetralod::refine::Budget;
use tetralod::refine::Need;
use tetralod::refine::RefineStats;
use tetralod::refine::Region;
use tetralod::refine::Request;

/// Takes the mesh out of an MT file that is as coarse as a request allows.
#[derive(clap::Args)]
pub struct Arguments {
    /// The MT file.
    file: PathBuf,
    /// Largest error, in units of the field, or with % of its range; 0 is the reference mesh.
    #[arg(long, value_name = "E|E%", default_value = "0", allow_hyphen_values = true)]
    error: Tolerance,
    /// Only inside this box; everywhere else as coarse as possible.
    #[arg(long = "box", value_name = "x0,y0,z0,x1,y1,z1", value_parser = parse_box, allow_hyphen_values = true)]
    roi: Option<Bounds>,
    /// Only where the field passes this value (repeatable).
    #[arg(long = "iso", value_name = "V", value_parser = parse_number, allow_hyphen_values = true)]
    isovalues: Vec<f64>,
    /// The field that --error and --iso speak of; the first one if not given.
    #[arg(long, value_name = "NAME")]
    field: Option<String>,
    /// At most so many tetrahedra.
    #[arg(long, value_name = "N")]
    budget: Option<u32>,
    /// The mesh to write: .vtu.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Compare with the mesh that the MT was built from.
    #[arg(long, value_name = "INPUT")]
    measure: Option<PathBuf>,
    /// Print the result as a JSON object.
    #[arg(long)]
    json: bool,
}

/// An error in units of a field, or as a fraction of its range.
#[derive(Clone, Copy, Debug)]
enum Tolerance {
    Absolute(f64),
    Relative(f64),
}

impl FromStr for Tolerance {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (number, relative) = match text.strip_suffix('%') {
            Some(number) => (number.trim_end(), true),
            None => (text, false),
        };
        let number = parse_number(number)?;
        if number < 0.0 {
            return Err("an error is not negative".to_owned());
        }
        Ok(if relative { Self::Relative(number / 100.0) } else { Self::Absolute(number) })
    }
}

impl Tolerance {
    /// As a fraction of the field's range.
    fn relative(self, range: f64) -> f64 {
        match self {
            Self::Absolute(error) => error / range,
            Self::Relative(error) => error,
        }
    }
}

fn parse_number(text: &str) -> Result<f64, String> {
    let number: f64 = text.trim().parse().map_err(|_| format!("'{text}' is not a number"))?;
    if number.is_finite() { Ok(number) } else { Err(format!("'{text}' is not finite")) }
}

fn parse_box(text: &str) -> Result<Bounds, String> {
    let numbers = text.split(',').map(parse_number).collect::<Result<Vec<_>, _>>()?;
    let [x0, y0, z0, x1, y1, z1] = numbers[..] else {
        return Err(format!("a box has 6 numbers, not {}", numbers.len()));
    };
    if x0 > x1 || y0 > y1 || z0 > z1 {
        return Err("a box has its smaller corner first".to_owned());
    }
    Ok(Bounds { min: [x0, y0, z0], max: [x1, y1, z1] })
}

/// The result as programs get it. Errors are in units of the field, relative ones as fractions of its range.
#[derive(Serialize)]
struct Report {
    vertices: u32,
    tetrahedra: u32,
    updates_applied: u32,
    error_bound: f64,
    relative_error_bound: f64,
    satisfied: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    measured_error: Option<f64>,
    seconds: f64,
    hash: String,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let mut opened = files::open_mt(&arguments.file)?;
    let name = || arguments.file.display().to_string();
    let request = request(arguments, opened.info()?).with_context(name)?;
    let start = Instant::now();
    let stats = opened.session.refine(&request).with_context(name)?;
    let seconds = start.elapsed().as_secs_f64();
    let report = report(arguments, &opened, &stats, seconds)?;
    let mesh = reference_units(opened.info()?, opened.session.mesh().context("there is no mesh")?);
    files::write_file(&arguments.output, |out| Ok(tetralod::io::write_vtu(&mesh, out)?))?;
    if arguments.json { output::json(&report) } else { print(arguments, &report) }
}

fn request(arguments: &Arguments, info: &MtInfo) -> Result<Request> {
    let field = files::field_index(info, arguments.field.as_deref())?;
    let need = Need::within(arguments.error.relative(info.fields[field].range()));
    let need = need.limited(arguments.roi.map(Region::Box), field, &arguments.isovalues);
    Ok(Request { needs: vec![need], budget: Budget { tets: arguments.budget, ..Budget::default() } })
}

/// The current mesh in the units of the model and of all its fields.
fn reference_units(info: &MtInfo, mesh: &CurrentMesh) -> TetMesh {
    let slots = 0..mesh.positions().len() as u32;
    let values =
        |f: usize| slots.clone().map(move |slot| info.fields[f].value(mesh.levels(slot)[f])).collect();
    TetMesh {
        positions: mesh.positions().iter().map(|&q| info.lattice.point(q)).collect(),
        fields: (0..info.fields.len())
            .map(|f| Field { name: info.fields[f].name.clone(), values: values(f) })
            .collect(),
        tets: mesh.tets().to_vec(),
        grid: None,
    }
}

fn report(arguments: &Arguments, opened: &Opened, stats: &RefineStats, seconds: f64) -> Result<Report> {
    let info = opened.info()?;
    let field = files::field_index(info, arguments.field.as_deref())?;
    let range = info.fields[field].range();
    let promise = Promise::of(info, field, stats.error_bound);
    let measure = |input: &Path| measure(input, arguments, field, opened, promise);
    let measured = arguments.measure.as_deref().map(measure).transpose()?;
    Ok(Report {
        vertices: stats.vertices,
        tetrahedra: stats.tetrahedra,
        updates_applied: stats.applied,
        error_bound: stats.error_bound * range,
        relative_error_bound: stats.error_bound,
        satisfied: stats.satisfied,
        measured_error: measured,
        seconds,
        hash: format!("{:016x}", opened.session.hash()),
    })
}

/// The largest difference from the field of the input at its vertices, in the part that the request selects.
fn measure(
    input: &Path,
    arguments: &Arguments,
    number: usize,
    opened: &Opened,
    promise: Promise,
) -> Result<f64> {
    let reference = files::read_reference(input, opened)?;
    let info = opened.info()?;
    let name = &info.fields[number].name;
    let field = reference.fields.iter().find(|field| field.name == *name);
    let field = field.with_context(|| {
        format!("{}: there is no field '{name}'; give the mesh that the MT was built from", input.display())
    })?;
    let reference = Reference { positions: &reference.positions, values: &field.values, field: number };
    let part = Part { roi: arguments.roi, isovalues: arguments.isovalues.clone(), promise: Some(promise) };
    let mesh = opened.session.mesh().context("there is no mesh")?;
    Ok(deviation(info, mesh, &reference, &part).field)
}

fn print(arguments: &Arguments, report: &Report) -> Result<()> {
    let mut rows = vec![
        ("file", arguments.output.display().to_string()),
        ("vertices", output::count(report.vertices)),
        ("tetrahedra", output::count(report.tetrahedra)),
        ("updates applied", output::count(report.updates_applied)),
        (
            "error bound",
            format!(
                "{} ({} of the range)",
                output::number(report.error_bound),
                output::percent(report.relative_error_bound)
            ),
        ),
    ];
    if let Some(error) = report.measured_error {
        rows.push(("measured error", output::number(error)));
    }
    if !report.satisfied {
        rows.push(("", "the budget did not allow the error that was asked for".to_owned()));
    }
    rows.push(("time", format!("{:.3} s", report.seconds)));
    rows.push(("hash", report.hash.clone()));
    output::table(&rows)
}

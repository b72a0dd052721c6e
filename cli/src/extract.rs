//! `tetralod extract`: the mesh that a request needs, out of an MT file.

use super::query::{Answer, EXAMPLES, Query};
use super::{files, input, npz, output};
use anyhow::{Context, Result, bail};
use serde::Serialize;
use std::path::{Path, PathBuf};
use tetralod::mesh::{Field, TetMesh};
use tetralod::mt::{CurrentMesh, FieldInfo, MtInfo};
use tetralod::refine;
use tetralod::session::Session;
use tetralod_build::measure::{Fit, Part, Promise, Reference, deviation, fit};

/// Takes the mesh out of an MT file that is as coarse as a request allows.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    #[command(flatten)]
    query: Query,
    /// The mesh to write: .vtu, or .npz for NumPy.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Compare with the mesh that the MT was built from, where regions and values (or nothing) say that the field matters.
    #[arg(long, value_name = "INPUT")]
    measure: Option<PathBuf>,
    /// Write values that fit those of the mesh that the MT was built from best, instead of its values at the same vertices: the mean error gets a
    /// fifth to a quarter smaller. For meshes of one error everywhere, and budgets.
    #[arg(long, value_name = "INPUT", conflicts_with = "measure")]
    fit: Option<PathBuf>,
}

/// The result as programs get it. Errors are in units of the field, relative ones as fractions of its range.
#[derive(Serialize)]
struct Report {
    #[serde(skip_serializing_if = "Option::is_none")]
    measured_error: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fit: Option<FitReport>,
    hash: String,
}

/// The differences from the input that `--fit` leaves, and those before.
#[derive(Serialize)]
struct FitReport {
    largest: f64,
    largest_before: f64,
    root_mean_square: f64,
    root_mean_square_before: f64,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let is_npz = files::ending(&arguments.output) == "npz";
    if !is_npz {
        files::check_ending(&arguments.output, "vtu")?;
    }
    let inputs = arguments.measure.iter().chain(&arguments.fit).chain(arguments.query.files());
    files::check_output(&arguments.output, inputs)?;
    let answer = arguments.query.answer_exactly()?;
    let opened = &answer.opened;
    // What is fitted to must be the mesh of the MT, too.
    let input = arguments.measure.as_deref().or(arguments.fit.as_deref());
    let measured = input.map(|input| measure(input, &answer)).transpose()?.flatten();
    if let (Some(measured), Some(input)) = (&measured, &arguments.fit) {
        // Nothing is fitted to another mesh.
        measured.check(input)?;
    }
    let mesh = opened.session.mesh().context("there is no mesh")?;
    let mut mesh = reference_units(&opened.session, opened.info()?, mesh);
    let fitted = arguments.fit.as_deref().map(|input| fit_fields(input, &answer, &mut mesh)).transpose()?;
    if is_npz {
        npz::write_mesh(&mesh, &arguments.output)?;
    } else {
        files::write_file(&arguments.output, |out| Ok(tetralod_io::write_vtu(&mesh, out)?))?;
    }
    let report = Report {
        measured_error: measured.as_ref().filter(|_| fitted.is_none()).map(|measured| measured.error),
        fit: fitted.flatten().as_ref().map(FitReport::of),
        hash: format!("{:016x}", opened.session.hash()),
    };
    let mut after = vec![("hash", report.hash.clone())];
    if let Some(fit) = &report.fit {
        after.extend(fit.rows(opened.info()?.fields[answer.field].range()));
    }
    after.extend(report.measured_error.map(|error| ("measured error", output::number(error))));
    let rows = [vec![("file", arguments.output.display().to_string())], after];
    arguments.query.print_around(&report, rows, (&answer.summary, answer.seconds))?;
    measured.zip(input).map_or(Ok(()), |(measured, input)| measured.check(input))
}

impl FitReport {
    fn of(fit: &Fit) -> Self {
        Self {
            largest: fit.after.largest,
            largest_before: fit.before.largest,
            root_mean_square: fit.after.root_mean_square,
            root_mean_square_before: fit.before.root_mean_square,
        }
    }

    fn rows(&self, range: f64) -> [(&'static str, String); 2] {
        let row = |now: f64, before: f64| {
            let part = |value: f64| output::percent(value / range);
            format!("{} ({} of the range; before the fit {})", output::number(now), part(now), part(before))
        };
        [
            ("measured error", row(self.largest, self.largest_before)),
            ("root mean square", row(self.root_mean_square, self.root_mean_square_before)),
        ]
    }
}

/// Replaces the values of all fields that the input has by those that fit it best; returns how well those of the field do that is asked for.
fn fit_fields(input: &Path, answer: &Answer, written: &mut TetMesh) -> Result<Option<Fit>> {
    if answer.needs.iter().any(|named| named.need.part != refine::Part::Everywhere) {
        bail!(
            "--fit is for meshes of one error everywhere: what is fitted outside of a region or of values changes them inside, too"
        );
    }
    let opened = &answer.opened;
    let (info, mesh) = (opened.info()?, opened.session.mesh().context("there is no mesh")?);
    let reference = input::read_reference(&[input.to_owned()], opened)?;
    let mut asked = None;
    for (f, (own, target)) in info.fields.iter().zip(&mut written.fields).enumerate() {
        let found = reference.fields.iter().find(|field| own.is_of(field)).with_context(|| {
            format!(
                "{}: there is no field '{}'; give the mesh that the MT was built from",
                input.display(),
                own.name
            )
        })?;
        let of = Reference { positions: &reference.positions, values: &found.values, field: f };
        let mut fit = fit(info, mesh, &of);
        target.values = std::mem::take(&mut fit.values);
        if f == answer.field {
            asked = Some(fit);
        }
    }
    Ok(asked)
}

/// Bounds and errors are computed in doubles.
const ROUNDING: f64 = 1e-9;

/// What was measured, in units of the field.
struct Measured {
    error: f64,
    /// The bound that it is above, if it is.
    beyond: Option<f64>,
}

impl Measured {
    /// Fails if the input is not that of the MT.
    fn check(&self, input: &Path) -> Result<()> {
        let Some(bound) = self.beyond else { return Ok(()) };
        bail!(
            "the measured error, {}, is above the bound, {}: {} is not what the MT was built from, or the MT is damaged; \
             `tetralod verify` looks at all of it",
            output::number(self.error),
            output::number(bound),
            input.display()
        )
    }
}

/// The current mesh in the units of the model and of all its fields.
fn reference_units(session: &Session, info: &MtInfo, mesh: &CurrentMesh) -> TetMesh {
    let field = |(f, info): (usize, &FieldInfo)| {
        let FieldInfo { name, unit, vector, time, .. } = info.clone();
        Field { name, values: session.exact_values(f), unit, vector, time, integer: false }
    };
    TetMesh {
        positions: mesh.positions().iter().map(|&q| info.lattice.point(q)).collect(),
        fields: info.fields.iter().enumerate().map(field).collect(),
        tets: mesh.tets().to_vec(),
        ..TetMesh::default()
    }
}

/// The largest difference from the field of the input at its vertices, in the parts that needs of that field select; none
/// if there are no such needs.
fn measure(input: &Path, answer: &Answer) -> Result<Option<Measured>> {
    let opened = &answer.opened;
    let reference = input::read_reference(&[input.to_owned()], opened)?;
    let info = opened.info()?;
    let name = &info.fields[answer.field].name;
    let field = reference.fields.iter().find(|field| info.fields[answer.field].is_of(field));
    let field = field.with_context(|| {
        format!("{}: there is no field '{name}'; give the mesh that the MT was built from", input.display())
    })?;
    let mesh = opened.session.mesh().context("there is no mesh")?;
    let mut largest: Option<Measured> = None;
    for (i, named) in answer.needs.iter().enumerate() {
        let (region, ranges) = match &named.need.part {
            refine::Part::Everywhere => (None, Vec::new()),
            refine::Part::Region(region) => (Some(region), Vec::new()),
            refine::Part::Values(values) if values.field == answer.field => (None, values.ranges.clone()),
            refine::Part::Both(region, values) if values.field == answer.field => {
                (Some(region), values.ranges.clone())
            }
            _ => continue,
        };
        let inside = |p: &[f64; 3]| region.is_none_or(|region| region.contains(*p));
        let chosen = reference.positions.iter().zip(&field.values).filter(|(p, _)| inside(p));
        let (positions, values): (Vec<[f64; 3]>, Vec<f64>) = chosen.unzip();
        let reference = Reference { positions: &positions, values: &values, field: answer.field };
        let bound = answer.stats.bounds.get(i);
        let promise = bound.map(|bound| Promise::of(info, answer.field, *bound));
        let part = Part { ranges, promise, ..Part::default() };
        let found = deviation(info, mesh, &reference, &part).field;
        let bound = bound.map(|bound| info.field_bound(answer.field, *bound)).filter(|_| answer.stats.done);
        let beyond = bound.filter(|bound| found > bound * (1.0 + ROUNDING));
        largest = Some(match largest {
            None => Measured { error: found, beyond },
            Some(largest) => Measured { error: largest.error.max(found), beyond: largest.beyond.or(beyond) },
        });
    }
    Ok(largest)
}

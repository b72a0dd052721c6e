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
use tetralod_build::measure::{Part, Promise, Reference, deviation};

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
}

/// The result as programs get it. Errors are in units of the field, relative ones as fractions of its range.
#[derive(Serialize)]
struct Report {
    #[serde(skip_serializing_if = "Option::is_none")]
    measured_error: Option<f64>,
    hash: String,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let is_npz = files::ending(&arguments.output) == "npz";
    if !is_npz {
        files::check_ending(&arguments.output, "vtu")?;
    }
    let inputs = arguments.measure.iter().chain(arguments.query.files());
    files::check_output(&arguments.output, inputs)?;
    let answer = arguments.query.answer_exactly()?;
    let opened = &answer.opened;
    let input = arguments.measure.as_deref();
    let measured = input.map(|input| measure(input, &answer)).transpose()?.flatten();
    let mesh = opened.session.mesh().context("there is no mesh")?;
    let mesh = reference_units(&opened.session, opened.info()?, mesh);
    if is_npz {
        npz::write_mesh(&mesh, &arguments.output)?;
    } else {
        files::write_file(&arguments.output, |out| Ok(tetralod_io::write_vtu(&mesh, out)?))?;
    }
    let report = Report {
        measured_error: measured.as_ref().map(|measured| measured.error),
        hash: format!("{:016x}", opened.session.hash()),
    };
    let mut after = vec![("hash", report.hash.clone())];
    after.extend(report.measured_error.map(|error| ("measured error", output::number(error))));
    let rows = [vec![("file", arguments.output.display().to_string())], after];
    arguments.query.print_around(&report, rows, (&answer.summary, answer.seconds))?;
    measured.zip(input).map_or(Ok(()), |(measured, input)| measured.check(input))
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
        let part = Part { ranges, promise };
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

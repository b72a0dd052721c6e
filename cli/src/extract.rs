//! `tetralod extract`: the mesh that a request needs, out of an MT file.

use super::deform::{Deform, Displaced};
use super::query::{Answer, EXAMPLES, Query};
use super::{files, input, npz, output};
use anyhow::{Context, Result, bail};
use serde::Serialize;
use std::path::{Path, PathBuf};
use tetralod::mesh::{Field, NONE, TetMesh};
use tetralod::mt::{CurrentMesh, FieldInfo, MtInfo, Regions};
use tetralod::refine;
use tetralod::session::Session;
use tetralod_build::measure::{Part, Promise, Reference, deviation};
use tetralod_build::verify::split;

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
    #[command(flatten)]
    deform: Deform,
}

/// The result as programs get it. Errors are in units of the field, relative ones as fractions of its range.
#[derive(Serialize)]
struct Report {
    #[serde(skip_serializing_if = "Option::is_none")]
    measured_error: Option<f64>,
    /// What is in the file: less than the mesh where regions are asked for.
    vertices_written: usize,
    tetrahedra_written: usize,
    hash: String,
    #[serde(flatten)]
    displaced: Option<Displaced>,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let is_npz = files::ending(&arguments.output) == "npz";
    if !is_npz {
        files::check_ending(&arguments.output, "vtu")?;
    }
    let inputs = arguments.measure.iter().chain(arguments.query.files());
    files::check_output(&arguments.output, inputs)?;
    let mut answer = arguments.query.answer_exactly()?;
    // What is shown is known once it has been looked at.
    answer.opened.session.view();
    let opened = &answer.opened;
    let input = arguments.measure.as_deref();
    let measured = input.map(|input| measure(input, &answer)).transpose()?.flatten();
    let mesh = opened.session.mesh().context("there is no mesh")?;
    let regions = opened.session.regions();
    let mut mesh = reference_units(&opened.session, opened.info()?, mesh, regions);
    let (deformation, displaced) = arguments.deform.of(&arguments.query, &answer)?.unzip();
    if let Some(deformation) = deformation {
        let components = deformation.fields.map(|field| mesh.fields[field].values.as_slice());
        mesh.positions = deformation.moved(&mesh.positions, components);
    }
    let written = answer.written_fields()?;
    let is_written: Vec<bool> =
        (0..mesh.fields.len()).map(|f| written.iter().any(|(field, _)| *field == f)).collect();
    keep(&mut mesh.fields, &is_written);
    if is_npz {
        npz::write_mesh(&mesh, &arguments.output)?;
    } else {
        files::write_file(&arguments.output, |out| Ok(tetralod_io::write_vtu(&mesh, out)?))?;
    }
    let report = Report {
        measured_error: measured.as_ref().map(|measured| measured.error),
        vertices_written: mesh.positions.len(),
        tetrahedra_written: mesh.tets.len(),
        hash: format!("{:016x}", opened.session.hash()),
        displaced,
    };
    let mut after = vec![("hash", report.hash.clone())];
    after.extend(report.displaced.iter().flat_map(Displaced::rows));
    after.extend(report.measured_error.map(|error| ("measured error", output::number(error))));
    let mut before = vec![("file", arguments.output.display().to_string())];
    if mesh.tets.len() < opened.session.mesh().map_or(0, CurrentMesh::tet_count) {
        let (vertices, tets) = (mesh.positions.len() as u32, mesh.tets.len() as u64);
        before.push(("in regions", output::mesh(vertices, tets)));
    }
    let rows = [before, after];
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
fn reference_units(
    session: &Session,
    info: &MtInfo,
    mesh: &CurrentMesh,
    regions: Option<&Regions>,
) -> TetMesh {
    let field = |(f, info): (usize, &FieldInfo)| {
        let FieldInfo { name, unit, vector, is_label, time, .. } = info.clone();
        let values = session.exact_values(f);
        Field { name, values, unit, vector, time, integer: is_label, is_label, ..Field::default() }
    };
    let mut whole = TetMesh {
        positions: mesh.positions().iter().map(|&q| info.lattice.point(q)).collect(),
        fields: info.fields.iter().enumerate().map(field).collect(),
        tets: mesh.tets().to_vec(),
        ..TetMesh::default()
    };
    if let Some(regions) = regions {
        let label = |array: usize, &region: &u16| regions.all[usize::from(region)].labels[array] as f64;
        let of_array = |(array, name): (usize, &String)| Field {
            integer: true,
            ..Field::new(name.clone(), mesh.regions().iter().map(|region| label(array, region)).collect())
        };
        whole.cell_fields = regions.arrays.iter().enumerate().map(of_array).collect();
        keep_shown(&mut whole, session.last_view().tets);
    }
    whole
}

/// Leaves out the tetrahedra that are not shown, which have no vertices in a view, and points that only these have.
fn keep_shown(mesh: &mut TetMesh, shown: &[[u32; 4]]) {
    if !shown.iter().any(|tet| tet[0] == NONE) {
        return;
    }
    let mut is_used = vec![false; mesh.positions.len()];
    shown.iter().flatten().filter(|&&v| v != NONE).for_each(|&v| is_used[v as usize] = true);
    let mut next = 0;
    let mut number = |&used: &bool| {
        next += u32::from(used);
        next.saturating_sub(1)
    };
    let numbers: Vec<u32> = is_used.iter().map(&mut number).collect();
    let is_shown: Vec<bool> = shown.iter().map(|tet| tet[0] != NONE).collect();
    keep(&mut mesh.positions, &is_used);
    mesh.fields.iter_mut().for_each(|field| keep(&mut field.values, &is_used));
    keep(&mut mesh.tets, &is_shown);
    mesh.cell_fields.iter_mut().for_each(|field| keep(&mut field.values, &is_shown));
    mesh.tets.iter_mut().for_each(|tet| *tet = tet.map(|v| numbers[v as usize]));
}

/// Leaves out the entries that are not kept.
fn keep<T>(list: &mut Vec<T>, kept: &[bool]) {
    let mut kept = kept.iter();
    list.retain(|_| kept.next().is_some_and(|kept| *kept));
}

/// The largest difference from the field of the input at its vertices, in the parts that needs of that field select; none
/// if there are no such needs.
fn measure(input: &Path, answer: &Answer) -> Result<Option<Measured>> {
    let opened = &answer.opened;
    let reference = input::read_reference(&[input.to_owned()], opened)?;
    let split = split(&reference, opened.session.regions()).map_err(anyhow::Error::msg)?;
    let reference = &split.mesh;
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
        let chosen: Vec<usize> =
            (0..reference.positions.len()).filter(|&v| inside(&reference.positions[v])).collect();
        let positions: Vec<[f64; 3]> = chosen.iter().map(|&v| reference.positions[v]).collect();
        let values: Vec<f64> = chosen.iter().map(|&v| field.values[v]).collect();
        let regions: Vec<u16> = chosen.iter().filter_map(|&v| Some(split.regions.get(v)?.0)).collect();
        let (positions, values, regions) = (&positions[..], &values[..], &regions[..]);
        let reference = Reference { positions, values, field: answer.field, regions };
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

//! Meshes from files: time steps put together, mended, fields at cells turned into fields at points.

use super::files::{self, Opened};
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use tetralod::io;
use tetralod::io::{CellData, ReadOptions, Step};
use tetralod::mesh::{Field, RepairReport, TetMesh, repair};
use tetralod::verify::Reference;

/// Which fields of the files are read.
pub struct FieldSelection<'a> {
    /// Names of fields, a vector's for its components; the first field if there are none and not all are wanted.
    pub names: &'a [String],
    /// All fields.
    pub all: bool,
    /// What to do with fields at cells. Their values are turned into fields at points.
    pub cells: CellData,
}

/// Reads the time steps in `paths`, each a mesh or a list of such, as one mesh, and mends what can be mended. Points
/// without any cell are as they are.
///
/// The first step is kept with all that is wanted, of later ones nothing but their fields.
pub fn read(paths: &[PathBuf], wanted: &FieldSelection<'_>) -> Result<(TetMesh, RepairReport)> {
    let mut steps = Vec::new();
    for path in paths {
        if let Some(scheme) = files::scheme(path) {
            bail!("{}: meshes are not read by {scheme}; fetch the file first", path.display());
        }
        // Read errors name the file themselves.
        steps.extend(io::steps(path)?);
    }
    let (first, later) = steps.split_first().context("no input is given")?;
    let mut options = ReadOptions { fields: None, cells: wanted.cells };
    let mut mesh = io::read_with(&first.path, &options)?;
    if !later.is_empty() {
        if let Some(names) = reduce(&mut mesh, wanted) {
            options.fields = Some(names);
            append(&mut mesh, first, later, &options)?;
        }
    } else if let Some(time) = first.time {
        set_time(&mut mesh, time);
    }
    let (mut mesh, report) = mend(mesh, &first.path)?;
    if wanted.cells == CellData::Values {
        mesh.cells_to_points();
    }
    Ok((mesh, report))
}

/// Leaves the fields that are wanted; returns their names. None if one is missing: that is for the builder to refuse, who
/// names those that are there.
fn reduce(mesh: &mut TetMesh, wanted: &FieldSelection<'_>) -> Option<Vec<String>> {
    let any = |test: &dyn Fn(&Field) -> bool| mesh.fields.iter().chain(&mesh.cell_fields).any(test);
    if !wanted.names.iter().all(|name| any(&|field| field.answers_to(name))) {
        return None;
    }
    if wanted.names.is_empty() && !wanted.all {
        // Where points have no field, the first one comes from the cells.
        mesh.fields.truncate(1);
        mesh.cell_fields.truncate(usize::from(mesh.fields.is_empty()));
    } else {
        let keep = |field: &Field| wanted.all || wanted.names.iter().any(|name| field.answers_to(name));
        mesh.fields.retain(keep);
        mesh.cell_fields.retain(keep);
    }
    Some(mesh.fields.iter().chain(&mesh.cell_fields).map(|field| field.name.clone()).collect())
}

/// Appends the fields of the later time steps. Steps without a time in their files are numbered from 0.
fn append(mesh: &mut TetMesh, first: &Step, later: &[Step], options: &ReadOptions) -> Result<()> {
    let first_time = first.time.or_else(|| time_of(mesh));
    let mut times = vec![first_time.unwrap_or(0.0)];
    set_time(mesh, times[0]);
    for (number, step) in later.iter().enumerate() {
        let name = step.path.display();
        let mut next = io::read_with(&step.path, options)?;
        let time = match (step.time.or_else(|| time_of(&next)), first_time) {
            (Some(time), Some(_)) => time,
            (None, None) => number as f64 + 1.0,
            _ => bail!("{name}: some files contain their time and some do not; list all of them in a .pvd"),
        };
        if times.contains(&time) {
            bail!("{name}: there is another time step at {time}; give each its own time, in a .pvd");
        }
        times.push(time);
        set_time(&mut next, time);
        let same = |field: &Field| options.fields.as_ref().is_some_and(|names| names.contains(&field.name));
        next.fields.retain(same);
        next.cell_fields.retain(same);
        mesh.add_step(next).with_context(|| name.to_string())?;
    }
    Ok(())
}

fn time_of(mesh: &TetMesh) -> Option<f64> {
    mesh.fields.iter().chain(&mesh.cell_fields).find_map(|field| field.time)
}

fn set_time(mesh: &mut TetMesh, time: f64) {
    mesh.fields.iter_mut().chain(&mut mesh.cell_fields).for_each(|field| field.time = Some(time));
}

fn mend(mesh: TetMesh, path: &Path) -> Result<(TetMesh, RepairReport)> {
    if mesh.tets.is_empty() {
        return Ok((mesh, RepairReport::default()));
    }
    repair(mesh).with_context(|| path.display().to_string())
}

/// Refuses a mesh that has points but no cells, for those that need cells.
pub fn expect_cells(mesh: &TetMesh, path: &Path) -> Result<()> {
    if mesh.tets.is_empty() && !mesh.positions.is_empty() {
        bail!(
            "{}: there are points but no tetrahedra; build --kind vertex --method insert makes an MT of points alone",
            path.display()
        );
    }
    if mesh.tets.is_empty() {
        // The same as for a mesh of which nothing is left.
        return Err(tetralod::mesh::MeshError::Empty).with_context(|| path.display().to_string());
    }
    Ok(())
}

/// Reads a mesh and mends what can be mended.
pub fn read_mesh(path: &Path) -> Result<(TetMesh, RepairReport)> {
    let wanted = FieldSelection { names: &[], all: true, cells: CellData::LeaveOut };
    let (mesh, report) = read(&[path.to_owned()], &wanted)?;
    expect_cells(&mesh, path)?;
    Ok((mesh, report))
}

/// Reads what the MT was built from: time steps of a mesh or, where no more is needed, of points.
pub fn read_reference(paths: &[PathBuf], opened: &Opened) -> Result<TetMesh> {
    let names: Vec<String> = opened.info()?.fields.iter().map(|field| field.name.clone()).collect();
    let (mesh, _) = read(paths, &FieldSelection { names: &names, all: false, cells: CellData::Values })?;
    if let (Reference::Mesh, Some(path)) = (opened.reference(), paths.first()) {
        expect_cells(&mesh, path)?;
    }
    Ok(mesh)
}

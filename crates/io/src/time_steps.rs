//! Time steps in several files, as one mesh.

use std::collections::HashSet;

use thiserror::Error;

use crate::fields::{set_time, tell};
use crate::{CellData, ReadError, ReadOptions};
use tetralod::geom::bits_of;
use tetralod::mesh::{Field, GeometryField, StepError, TetMesh, default_field};

/// Which fields of the files of a mesh are wanted.
#[derive(Clone, Copy, Debug)]
pub struct FieldSelection<'a> {
    /// Names of fields, a vector's for its components; if there are none and not all are wanted, [that which tells something](ReadOptions::first).
    pub names: &'a [String],
    /// All fields.
    pub all: bool,
    /// Names of labels of regions, which are wanted beside these.
    pub labels: &'a [String],
    /// What to do with fields at cells.
    pub cells: CellData,
}

/// Why files are not the time steps of one mesh.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum TimeStepsError {
    /// No file was given.
    #[error("no file is given")]
    None,
    /// A file could not be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The mesh, or its fields, are not those of the first time step.
    #[error("{file}: {error}")]
    Step {
        /// The file.
        file: String,
        /// The difference.
        error: StepError,
    },
    /// Only some of the files contain their time.
    #[error("{file}: some files contain their time and some do not; list all of them in a .pvd")]
    MixedTimes {
        /// The first file that differs from those before it.
        file: String,
    },
    /// Two files are of the same time.
    #[error("{file}: there is another time step at {time}; give each its own time, in a .pvd")]
    SameTime {
        /// The second one.
        file: String,
        /// The time.
        time: f64,
    },
}

/// Reads time steps as one mesh, as files have it: see [`tetralod::mesh::repair`]. `steps` are the name of each file, for errors, and
/// its time if that is known; `read` reads the file of a number.
///
/// The first step is kept with all that is read of it, of later ones nothing but their fields.
///
/// # Errors
/// If a file cannot be read, or the files are not time steps of one mesh.
pub fn read_time_steps(
    steps: &[(String, Option<f64>)],
    wanted: &FieldSelection<'_>,
    read: &mut dyn FnMut(usize, &ReadOptions) -> Result<TetMesh, ReadError>,
) -> Result<TetMesh, TimeStepsError> {
    let ((_, first_time), later) = steps.split_first().ok_or(TimeStepsError::None)?;
    let mut options = wanted.options();
    let mut mesh = read(0, &options)?;
    if !later.is_empty() {
        if let Some(names) = reduce(&mut mesh, wanted) {
            (options.fields, options.first) = (Some(names), false);
            append(&mut mesh, *first_time, later, &options, read)?;
        }
    } else if let Some(time) = *first_time {
        set_time(&mut mesh, Some(time));
    }
    Ok(mesh)
}

impl FieldSelection<'_> {
    /// What to read of a file.
    pub fn options(&self) -> ReadOptions {
        let names = self.names.iter().chain(self.labels).cloned().collect();
        let fields = if self.all { None } else { Some(names) };
        let first = !self.all && self.names.is_empty();
        ReadOptions { fields, first, cells: self.cells, ..ReadOptions::default() }
    }
}

/// Leaves the fields that are wanted; returns their names. None if one is missing: that is for the builder to refuse, who
/// names those that are there.
fn reduce(mesh: &mut TetMesh, wanted: &FieldSelection<'_>) -> Option<Vec<String>> {
    let any = |test: &dyn Fn(&Field) -> bool| mesh.fields.iter().chain(&mesh.cell_fields).any(test);
    let is_known =
        |name: &String| GeometryField::named(name).is_some() || any(&|field| field.answers_to(name));
    if !wanted.names.iter().all(is_known) {
        return None;
    }
    let is_named =
        |field: &Field| wanted.names.iter().chain(wanted.labels).any(|name| field.answers_to(name));
    if wanted.names.is_empty() && !wanted.all {
        // Where points have no field that tells something, that of the cells is shown.
        let at_points = default_field(&mesh.fields, wanted.labels);
        let at_cells = default_field(&mesh.cell_fields, wanted.labels).filter(|_| !tell(&mesh.fields));
        for (fields, shown) in [(&mut mesh.fields, at_points), (&mut mesh.cell_fields, at_cells)] {
            let name = shown.map(|shown| fields[shown].name.clone());
            fields.retain(|field| Some(&field.name) == name.as_ref() || is_named(field));
        }
    } else if !wanted.all {
        mesh.fields.retain(is_named);
        mesh.cell_fields.retain(is_named);
    }
    Some(mesh.fields.iter().chain(&mesh.cell_fields).map(|field| field.name.clone()).collect())
}

/// Appends the fields of the later time steps. Steps without a time in their files are numbered from 0.
fn append(
    mesh: &mut TetMesh,
    first_time: Option<f64>,
    later: &[(String, Option<f64>)],
    options: &ReadOptions,
    read: &mut dyn FnMut(usize, &ReadOptions) -> Result<TetMesh, ReadError>,
) -> Result<(), TimeStepsError> {
    let first_time = first_time.or_else(|| time_of(mesh));
    let mut times = HashSet::from([bits_of(first_time.unwrap_or(0.0))]);
    set_time(mesh, first_time.or(Some(0.0)));
    for (number, (file, time)) in later.iter().enumerate() {
        let file = || file.clone();
        let mut next = read(number + 1, options)?;
        let time = match (time.or_else(|| time_of(&next)), first_time) {
            (Some(time), Some(_)) => time,
            (None, None) => number as f64 + 1.0,
            _ => return Err(TimeStepsError::MixedTimes { file: file() }),
        };
        if !times.insert(bits_of(time)) {
            return Err(TimeStepsError::SameTime { file: file(), time });
        }
        set_time(&mut next, Some(time));
        let same = |field: &Field| options.fields.as_ref().is_some_and(|names| names.contains(&field.name));
        next.fields.retain(same);
        next.cell_fields.retain(same);
        mesh.input.files.0.append(&mut next.input.files.0);
        mesh.add_step(next).map_err(|error| TimeStepsError::Step { file: file(), error })?;
    }
    Ok(())
}

fn time_of(mesh: &TetMesh) -> Option<f64> {
    mesh.fields.iter().chain(&mesh.cell_fields).find_map(|field| field.time)
}

impl tetralod::Coded for TimeStepsError {
    fn code(&self) -> &'static str {
        match self {
            Self::Read(error) => error.code(),
            Self::None => "bad-source",
            _ => "bad-mesh",
        }
    }
}

//! Meshes from files: time steps put together, mended, fields at cells turned into fields at points.

use super::files::{self, Opened};
use super::{machine, output};
use anyhow::{Context, Result, bail};
use std::io::Read;
use std::path::{Path, PathBuf};
use tetralod::mesh::{
    CellsToPoints, Field, MAX_TETS, MeshError, RepairLevel, RepairReport, TetMesh, repair_at,
};
use tetralod::mt::{MultiTessellation, Regions};
use tetralod_build::verify::Reference;
use tetralod_io as io;
use tetralod_io::{CellData, FieldSelection, MemoryLimit, Pieces, ReadOptions, ReadReason, Step};

/// What is known of an input beside its paths.
#[derive(Clone, Copy, Debug, Default)]
pub struct Source<'a> {
    /// The format of the standard input.
    pub format: Option<&'a str>,
    /// The only time step that is wanted.
    pub step: Option<usize>,
    /// The most memory, in bytes, that reading may take; half of what the machine has if nothing is said, for building takes more.
    pub memory: Option<u64>,
}

impl Source<'_> {
    /// The most memory that reading may take.
    pub fn limit(&self) -> MemoryLimit {
        self.most().map_or_else(MemoryLimit::default, MemoryLimit::of)
    }

    fn most(&self) -> Option<u64> {
        self.memory.or_else(|| Some(machine::memory()? / 2))
    }
}

/// What a path stands for the standard input.
const STANDARD_INPUT: &str = "-";

/// The name of an input, for messages.
pub fn name(path: &Path) -> String {
    if path == Path::new(STANDARD_INPUT) { "standard input".to_owned() } else { path.display().to_string() }
}

/// Ends the program if a format is given for files.
pub fn expect_format(paths: &[PathBuf], format: Option<&str>) {
    if format.is_some() && !paths.iter().any(|path| path == Path::new(STANDARD_INPUT)) {
        crate::usage::refuse_usage(
            "--format goes with the standard input, '-'; the content of files says what they are",
        );
    }
}

/// Reads the time steps in `paths`, each a mesh or a list of such, as one mesh, and mends it at this level. Points
/// without any cell are as they are; fields at cells stay there. A regular grid may come `alone`, without points and tetrahedra: it is not
/// mended.
///
/// The first step is kept with all that is wanted, of later ones nothing but their fields.
pub fn read_cells(
    paths: &[PathBuf],
    wanted: &FieldSelection<'_>,
    level: RepairLevel,
    source: Source<'_>,
    alone: bool,
) -> Result<(TetMesh, RepairReport)> {
    let mut steps = steps(paths)?;
    if let Some(step) = source.step {
        choose(&mut steps, step)?;
    }
    let memory = source.limit();
    let mut input = Vec::new();
    if steps.iter().any(|step| step.path == Path::new(STANDARD_INPUT)) {
        let most = source.most().unwrap_or(u64::MAX);
        let mut stdin = std::io::stdin().take(most.saturating_add(1));
        stdin.read_to_end(&mut input).context("the standard input could not be read")?;
        if input.len() as u64 > most {
            return Err(ReadReason::Memory { limit: most }).context("standard input");
        }
        check_format(&input, source.format)?;
    }
    let named: Vec<_> = steps.iter().map(|step| (name(&step.path), step.time)).collect();
    let mesh = io::read_time_steps(&named, wanted, &mut |number, options| {
        let options = &ReadOptions { step: steps[number].number, memory: memory.clone(), ..options.clone() };
        match &steps[number].path {
            path if path == Path::new(STANDARD_INPUT) => io::read_bytes_with(&name(path), &input, options),
            path if alone && steps.len() == 1 => io::read_unexpanded(path, options),
            path => io::read_with(path, options),
        }
    })?;
    drop(input);
    files::note_inputs(&mesh.input.files.0);
    say_notes(&mesh.notes, &steps[0].path);
    mend(mesh, level, &steps[0].path)
}

/// Whether a file may be a regular grid of which boxes are read, by its name: folders are those of Zarr.
pub fn may_be_grid(path: &Path) -> bool {
    const ENDINGS: [&str; 7] = ["vti", "raw", "json", "nrrd", "nhdr", "mha", "mhd"];
    ENDINGS.contains(&files::ending(path).as_str()) || path.is_dir() || files::is_zarr_address(path)
}

/// Says what the reader left out of a file.
pub fn say_notes(notes: &[String], path: &Path) {
    notes.iter().for_each(|note| output::note(&format!("note: {}: {note}", name(path))));
}

/// The time steps in these files.
fn steps(paths: &[PathBuf]) -> Result<Vec<Step>> {
    let mut steps = Vec::new();
    for path in paths {
        if let Some(scheme) = files::scheme(path).filter(|_| !files::is_zarr_address(path)) {
            bail!("{}: meshes are not read by {scheme}, but for Zarr; fetch the file first", path.display());
        }
        // Read errors name the file themselves.
        steps.extend(io::steps(path)?);
    }
    Ok(steps)
}

/// Which of the time steps in these files is the one of this time, if the files say so.
fn step_at(paths: &[PathBuf], time: f64) -> Result<Option<usize>> {
    Ok(steps(paths)?.iter().position(|step| step.time == Some(time)))
}

/// Leaves one of the time steps. How many there are in the standard input is known when it was read.
fn choose(steps: &mut Vec<Step>, step: usize) -> Result<()> {
    if let [only] = steps.as_mut_slice()
        && only.path == Path::new(STANDARD_INPUT)
    {
        only.number = step;
        return Ok(());
    }
    if step >= steps.len() {
        bail!("--step {step}: there are {} time steps, and the first one is 0", steps.len());
    }
    *steps = vec![steps.swap_remove(step)];
    Ok(())
}

/// Refuses bytes that are not of the format that was given.
fn check_format(bytes: &[u8], format: Option<&str>) -> Result<()> {
    let found = io::format_of(bytes);
    match (format, found) {
        (Some(format), Some(found)) if format != found => {
            bail!("standard input: its content is {found}, not {format} as --format says")
        }
        _ => Ok(()),
    }
}

/// Mends a mesh at this level.
pub fn mend(mesh: TetMesh, level: RepairLevel, path: &Path) -> Result<(TetMesh, RepairReport)> {
    if mesh.tets.is_empty() {
        return Ok((mesh, RepairReport::default()));
    }
    repair_at(mesh, level).with_context(|| name(path))
}

/// Refuses a mesh that has points but no cells, for those that need cells.
pub fn expect_cells(mesh: &TetMesh, path: &Path) -> Result<()> {
    if mesh.is_grid_alone() {
        return Ok(());
    }
    if mesh.tets.is_empty() && !mesh.positions.is_empty() {
        bail!(
            "{}: there are points but no tetrahedra; build --kind vertex --method insert makes an MT of points alone",
            name(path)
        );
    }
    if mesh.tets.is_empty() {
        // The same as for a mesh of which nothing is left.
        return Err(tetralod::mesh::MeshError::Empty).with_context(|| name(path));
    }
    Ok(())
}

/// Reads what the MT was built from: time steps of a mesh, mended as it was then, or, where no more is needed, of points.
pub fn read_reference(paths: &[PathBuf], opened: &Opened) -> Result<TetMesh> {
    let mut mesh = read_reference_alone(paths, opened)?;
    paths.first().map_or(Ok(()), |path| expand(&mut mesh, path))?;
    Ok(mesh)
}

/// Makes the points and tetrahedra of a grid alone, if one mesh can have so many.
pub fn expand(mesh: &mut TetMesh, path: &Path) -> Result<()> {
    let [_, tets] = mesh.counts();
    if tets > MAX_TETS as u64 {
        return Err(MeshError::TooMany { tets: tets as usize }).with_context(|| name(path));
    }
    mesh.expand_grid();
    Ok(())
}

/// The regular grid that the MT was built from, without values, and the file from which boxes of them are read; none if that one is read as
/// a whole.
pub fn open_reference_grid(paths: &[PathBuf], opened: &Opened) -> Result<Option<(TetMesh, Pieces)>> {
    let info = opened.info()?;
    let time = info.fields.first().and_then(|field| field.time);
    let [path] = paths else { return Ok(None) };
    if !may_be_grid(path)
        || opened.mt()?.regions().is_some()
        || info.fields.iter().any(|field| field.time != time)
    {
        return Ok(None);
    }
    let all = steps(paths)?;
    let is_wanted = |step: &&Step| time.is_none() || step.time == time;
    let step = match &all[..] {
        [only] => only,
        several if let Some(step) = several.iter().find(is_wanted) => step,
        _ => return Ok(None),
    };
    let names: Vec<String> = info.fields.iter().map(|field| field.name.clone()).collect();
    let wanted = FieldSelection { names: &names, all: false, labels: &[], cells: CellData::Names };
    let options = ReadOptions { step: step.number, memory: Source::default().limit(), ..wanted.options() };
    let Ok(pieces) = Pieces::open_ranges(&step.path, &options, None)? else { return Ok(None) };
    let Some(mut mesh) = pieces.grid().map(|grid| grid.mesh().clone()) else { return Ok(None) };
    if step.time.is_some() {
        mesh.fields.iter_mut().for_each(|field| field.time = step.time);
    }
    let has_all = info.fields.iter().all(|info| mesh.fields.iter().any(|field| info.is_of(field)));
    if !has_all || mesh.counts() != [u64::from(info.vertices), info.tetrahedra] {
        return Ok(None);
    }
    files::note_inputs(&mesh.input.files.0);
    say_notes(&mesh.notes, path);
    Ok(Some((mesh, pieces)))
}

/// As [`read_reference`], but a regular grid comes without points and tetrahedra where only its values are needed.
pub fn read_reference_alone(paths: &[PathBuf], opened: &Opened) -> Result<TetMesh> {
    let fields = &opened.info()?.fields;
    let names: Vec<String> = fields.iter().map(|field| field.name.clone()).collect();
    let regions = opened.mt()?.regions();
    let labels = regions.map_or(&[][..], |regions| &regions.arrays);
    let jumps = regions.is_some_and(Regions::has_sides);
    let to_points = if jumps { CellsToPoints::ByRegion } else { CellsToPoints::AcrossRegions };
    let wanted = FieldSelection { names: &names, all: false, labels, cells: CellData::Values };
    // Of several time steps it may have been built from one.
    let time = fields.first().and_then(|field| field.time);
    let is_one = fields.iter().all(|field| field.time == time);
    let step = time.filter(|_| is_one).map(|time| step_at(paths, time)).transpose()?.flatten();
    let level = RepairLevel::from_metadata(opened.session.metadata());
    let (mut mesh, _) = read_cells(paths, &wanted, level, Source { step, ..Source::default() }, true)?;
    let is_known = |name: &String| mesh.fields.iter().any(|field| field.answers_to(name));
    if mesh.is_grid_alone() && !names.iter().all(is_known) {
        // Fields of the geometry need its points.
        paths.first().map_or(Ok(()), |path| expand(&mut mesh, path))?;
    }
    if !mesh.is_grid_alone() {
        let is_label = |field: &Field| fields.iter().any(|info| info.is_label && info.is_of(field));
        for field in mesh.fields.iter_mut().chain(&mut mesh.cell_fields) {
            field.is_label = is_label(field);
        }
        mesh.settle_cells(to_points, labels);
        mesh.add_geometry_fields(wanted.names);
    }
    if let (Reference::Mesh, Some(path)) = (opened.reference(), paths.first()) {
        expect_cells(&mesh, path)?;
    }
    Ok(mesh)
}

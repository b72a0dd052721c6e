//! The input of a build: a mesh, mended, or its pieces.

use super::options::BuildOptions;
use super::way::Way;
use crate::output::{self, Verbosity};
use crate::parts::InPieces;
use crate::repair::Repair;
use crate::{files, input};
use anyhow::{Result, anyhow};
use std::cell::RefCell;
use tetralod::mesh::{GeometryField, MeshInput, RepairLevel, RepairReport, TetMesh};
use tetralod_build::parts::PartsError;
use tetralod_build::{BuildConfig, mark_labels};
use tetralod_io::{CellData, FieldSelection, Pieces, ReadOptions};

/// Endings of files that are read by ranges of cells.
const BY_RANGES: [&str; 3] = ["vtu", "vtkhdf", "hdf"];

impl BuildOptions {
    /// Tells what was repaired, and what was found.
    pub fn repair_of(
        &self,
        mesh: &TetMesh,
        repaired: &RepairReport,
        way: Way,
        verbosity: &Verbosity,
    ) -> Result<Option<Repair>> {
        // To look through a grid takes more memory than its parts do, and nothing is wrong with it.
        let is_sound = way != Way::Whole && mesh.grid.is_some();
        let repair = if is_sound { None } else { Repair::of(mesh, self.repair.level(), repaired)? };
        let repaired = repaired.to_string();
        for line in [Some(&repaired), repair.as_ref().map(|repair| &repair.kept)].into_iter().flatten() {
            if !line.is_empty() && !verbosity.quiet {
                output::note(&format!("{}: {line}", self.name()));
            }
        }
        Ok(repair)
    }

    /// Reads what is wanted of the input, in so much memory at most.
    ///
    /// A regular grid comes without points and tetrahedra where only its values are needed: what building takes is known before these are made.
    pub fn read(
        &self,
        config: &BuildConfig,
        level: RepairLevel,
        memory: Option<u64>,
    ) -> Result<(TetMesh, RepairReport)> {
        let with_labels = !config.preserve.is_empty();
        let cells = if self.cell_to_point || with_labels { CellData::Values } else { CellData::Names };
        let wanted =
            FieldSelection { names: &config.fields, all: config.all_fields, labels: &config.preserve, cells };
        let needs_points = |name: &String| GeometryField::named(name).is_some();
        let alone = cells == CellData::Names
            && config.min_dihedral.is_none()
            && !config.fields.iter().any(needs_points);
        input::expect_format(&self.inputs, self.format.as_deref());
        let source = input::Source { format: self.format.as_deref(), step: self.step, memory };
        let (mut mesh, repaired) = input::read_cells(&self.inputs, &wanted, level, source, alone)?;
        mark_labels(&mut mesh, &self.labels(), config)?;
        let to_points = config.cells_to_points(self.cell_to_point, self.mean_across_regions);
        mesh.settle_cells(to_points, &config.preserve);
        mesh.add_geometry_fields(&config.fields);
        if config.construction.method().keeps_the_mesh() {
            input::expect_cells(&mesh, &self.inputs[0])?;
        }
        self.set_units(&mut mesh)?;
        Ok((mesh, repaired))
    }

    fn set_units(&self, mesh: &mut TetMesh) -> Result<()> {
        mesh.set_units(&self.units)
            .map_err(|(name, unit)| anyhow!("--unit {name}={unit}: there is no field '{name}'"))
    }

    /// The pieces of the input, if it is a list of such that can be read one by one, or a file that is read by ranges of cells; `prepare` does
    /// what the options say to each.
    pub fn in_pieces<T>(
        &self,
        config: &BuildConfig,
        memory: Option<u64>,
        verbosity: &Verbosity,
        work: impl FnOnce(InPieces<'_>) -> Result<Option<T>>,
    ) -> Result<Option<T>> {
        let needs_points = |name: &String| GeometryField::named(name).is_some();
        let needs_whole = self.cell_to_point
            || !self.labels().is_empty()
            || matches!(self.repair.level(), RepairLevel::Weld { .. })
            || config.fields.iter().any(needs_points);
        let [path] = &self.inputs[..] else { return Ok(None) };
        let is_list = files::ending(path) == "pvtu";
        let is_known = || {
            let by_ranges = BY_RANGES.contains(&files::ending(path).as_str());
            Ok::<_, anyhow::Error>(
                is_list || by_ranges || input::may_be_grid(path) || Pieces::are_beside(path)?,
            )
        };
        if needs_whole || !is_known()? {
            return Ok(None);
        }
        let steps = tetralod_io::steps(path)?;
        // Several of them are read as one mesh, which is the whole.
        let step = match (&steps[..], self.step) {
            ([only], None) => only,
            (_, Some(number)) if let Some(step) = steps.get(number) => step,
            _ => return Ok(None),
        };
        let wanted = FieldSelection {
            names: &config.fields,
            all: config.all_fields,
            labels: &config.preserve,
            cells: CellData::Names,
        };
        let memory = input::Source { memory, ..input::Source::default() }.limit();
        let options = ReadOptions { step: step.number, memory, ..wanted.options() };
        let pieces = if is_list {
            Pieces::open(&step.path, &options)?.ok_or(None)
        } else {
            Pieces::open_ranges(&step.path, &options, self.range)?
        };
        let pieces = match pieces {
            Ok(pieces) => pieces,
            Err(why) => {
                why.into_iter().for_each(|why| self.tell(&PartsError::NeedsWhole { why }, verbosity));
                return Ok(None);
            }
        };
        let known = RefCell::new(MeshInput::default());
        let prepare = |mesh: &mut TetMesh| {
            files::note_inputs(&mesh.input.files.0);
            let notes = std::mem::take(&mut mesh.input.notes);
            known.borrow_mut().append(MeshInput { notes, ..MeshInput::default() });
            if step.time.is_some() {
                mesh.fields.iter_mut().for_each(|field| field.time = step.time);
            }
            mark_labels(mesh, &[], config)?;
            self.set_units(mesh)
        };
        let done = work(InPieces { pieces, prepare: &prepare })?;
        // The whole tells it again.
        if done.is_some() {
            input::say_notes(&known.borrow().lines(), path);
        }
        Ok(done)
    }

    /// Tells why pieces are read as a whole after all.
    pub fn tell(&self, why: &PartsError, verbosity: &Verbosity) {
        if !verbosity.quiet {
            output::note(&format!("{}: {why}; so it is", self.name()));
        }
    }
}

//! A mesh as the files of meshers list it, before its cells are split.

use std::collections::BTreeMap;
use std::mem::take;

use crate::cells::{self, CellList, Indices};
use crate::error::{ReadReason, expect_count};
use crate::fields::{Collector, check_finite, check_finite_cells};
use crate::number::points_from;
use crate::numbering::Numbering;
use crate::vtu::NumberPoints;
use crate::{CellData, ReadOptions};
use tetralod::mesh::{Field, MeshInput, TetMesh};

/// Points, cells and fields as they were read.
pub(super) struct Draft<'a> {
    pub options: &'a ReadOptions,
    pub coordinates: Vec<f64>,
    list: CellList<'static>,
    pub fields: Collector<'a>,
    pub cell_fields: Collector<'a>,
    /// How many cells without a volume there are of each of VTK's types; they are left out.
    flat: BTreeMap<i64, u64>,
    /// What is left out, in words.
    pub notes: Vec<String>,
    /// What is left out is noted here.
    pub input: MeshInput,
}

impl<'a> Draft<'a> {
    pub fn new(options: &'a ReadOptions) -> Self {
        let [fields, cell_fields] = [(); 2].map(|()| Collector::new(options));
        let (coordinates, list, notes) = (Vec::new(), CellList::default(), Vec::new());
        let input = MeshInput::default();
        Self { options, coordinates, list, fields, cell_fields, flat: BTreeMap::new(), notes, input }
    }

    /// How many cells there are.
    pub fn cells(&self) -> usize {
        self.list.types.len()
    }

    /// Counts cells of VTK's type `kind`, which have no volume.
    pub fn add_flat(&mut self, kind: i64, count: u64) {
        *self.flat.entry(kind).or_default() += count;
    }

    /// Which of so many points a cell uses; all if there are no cells.
    pub fn used(&self, points: usize) -> Vec<bool> {
        if self.list.types.is_empty() { vec![true; points] } else { self.list.used(points) }
    }

    /// Appends a cell of VTK's type `kind`, with its points in the order that VTK has; a polyhedron with its faces.
    pub fn add_cell(&mut self, kind: i64, points: impl IntoIterator<Item = i64>) {
        self.list.types.push(kind);
        let mut listed = take(&mut self.list.connectivity).into_list();
        listed.extend(points);
        self.list.ends.push(listed.len() as i64);
        self.list.connectivity = Indices::Listed(listed);
    }

    /// Keeps an array with values at points, which are read only if they are wanted.
    pub fn at_points(
        &mut self,
        name: &str,
        components: usize,
        integer: bool,
        read: impl FnOnce() -> Result<Vec<f64>, ReadReason>,
    ) -> Result<(), ReadReason> {
        if let Some(claim) = self.fields.claim(name, components)? {
            return self.fields.fill(claim, read()?, integer, "");
        }
        Ok(())
    }

    /// Keeps an array with values at cells, which are read only if they are wanted.
    pub fn at_cells(
        &mut self,
        name: &str,
        components: usize,
        integer: bool,
        read: impl FnOnce() -> Result<Vec<f64>, ReadReason>,
    ) -> Result<(), ReadReason> {
        if self.options.cells == CellData::LeaveOut {
            return Ok(());
        }
        match self.cell_fields.claim(name, components)? {
            Some(claim) if self.options.cells == CellData::Names => self.cell_fields.keep_names(claim, ""),
            Some(claim) => self.cell_fields.fill(claim, read()?, integer, "")?,
            None => {}
        }
        Ok(())
    }

    /// The mesh. Without cells it has points alone.
    pub fn finish(self) -> Result<TetMesh, ReadReason> {
        self.finish_numbered(&mut |points| Ok(Numbering::From { first: 0, points: points.len() }))
    }

    /// The mesh, whose points are numbered as `numbers` says.
    pub fn finish_numbered(mut self, numbers: NumberPoints<'_>) -> Result<TetMesh, ReadReason> {
        let memory = &self.options.memory;
        memory.take(8 * self.coordinates.len() as u64)?;
        let mut positions = points_from(&self.coordinates);
        if positions.len() > u32::MAX as usize {
            return Err(ReadReason::TooLarge { what: "points".into(), limit: u64::from(u32::MAX) });
        }
        let mut fields = expect_values(self.fields.fields, positions.len())?;
        let has_flat = self.flat.iter().any(|(kind, count)| *count > 0 && !cells::are_points(&[*kind]));
        if self.list.types.is_empty() && has_flat {
            return Err(ReadReason::CellTypes(self.flat.into_iter().collect()));
        }
        self.input.other_fields = self.fields.others;
        if self.list.types.is_empty() {
            check_finite(&positions, &fields, &|| None)?;
            numbers(&positions)?;
            let Self { input, notes, .. } = self;
            return Ok(TetMesh { positions, fields, input, notes, ..TetMesh::default() });
        }
        if !fields.is_empty() {
            self.cell_fields.drop_first();
        }
        self.input.other_cell_fields = self.cell_fields.others;
        check_finite(&positions, &fields, &|| Some(self.list.used(positions.len())))?;
        let cells = self.list.types.len();
        cells::checked_ends(&self.list.types, &self.list.ends)?;
        let numbering = numbers(&positions)?;
        let split = self.list.split(&numbering, &mut positions, &mut fields, memory)?;
        let mut cell_fields = expect_values(self.cell_fields.fields, cells)?;
        check_finite_cells(&cell_fields, |_| true)?;
        split.spread(&mut cell_fields);
        self.input.append(split.input);
        let Self { input, notes, .. } = self;
        let tets = split.tets;
        Ok(TetMesh { positions, fields, tets, cell_fields, input, notes, ..TetMesh::default() })
    }
}

/// Checks that fields have as many values as there are points or cells, or none.
fn expect_values(fields: Vec<Field>, expected: usize) -> Result<Vec<Field>, ReadReason> {
    for Field { name, values, .. } in fields.iter().filter(|field| !field.values.is_empty()) {
        expect_count(format!("values of \"{name}\""), expected, values.len())?;
    }
    Ok(fields)
}

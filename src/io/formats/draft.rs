//! A mesh as the files of meshers list it, before its cells are split.

use std::collections::BTreeMap;

use crate::io::cells::{self, CellList, Numbering};
use crate::io::error::ReadReason;
use crate::io::fields::Collector;
use crate::io::{CellData, ReadOptions, points_from};
use crate::mesh::{Field, TetMesh};

/// Points, cells and fields as they were read.
pub(super) struct Draft<'a> {
    pub options: &'a ReadOptions,
    pub coordinates: Vec<f64>,
    list: CellList,
    pub fields: Collector<'a>,
    pub cell_fields: Collector<'a>,
    /// How many cells without a volume there are of each of VTK's types; they are left out.
    flat: BTreeMap<i64, u64>,
    /// What is left out, in words.
    pub notes: Vec<String>,
}

impl<'a> Draft<'a> {
    pub fn new(options: &'a ReadOptions) -> Self {
        let [fields, cell_fields] = [(); 2].map(|()| Collector::new(options.fields.as_deref()));
        let (coordinates, list, notes) = (Vec::new(), CellList::default(), Vec::new());
        Self { options, coordinates, list, fields, cell_fields, flat: BTreeMap::new(), notes }
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
        let mut used = vec![self.list.connectivity.is_empty(); points];
        for &point in &self.list.connectivity {
            if let Some(used) = usize::try_from(point).ok().and_then(|point| used.get_mut(point)) {
                *used = true;
            }
        }
        used
    }

    /// Appends a cell of VTK's type `kind`, with its points in the order that VTK has.
    pub fn add_cell(&mut self, kind: i64, points: impl IntoIterator<Item = i64>) {
        self.list.types.push(kind);
        self.list.connectivity.extend(points);
        self.list.ends.push(self.list.connectivity.len() as i64);
    }

    /// Keeps an array with values at points.
    pub fn at_points(
        &mut self,
        name: &str,
        components: usize,
        values: Vec<f64>,
        integer: bool,
    ) -> Result<(), ReadReason> {
        self.read_at_points(name, components, integer, || Ok(values))
    }

    /// The same with values that are read only if they are wanted.
    pub fn read_at_points(
        &mut self,
        name: &str,
        components: usize,
        integer: bool,
        read: impl FnOnce() -> Result<Vec<f64>, ReadReason>,
    ) -> Result<(), ReadReason> {
        match self.fields.claim(name, components)? {
            Some(claim) => self.fields.fill(claim, read()?, integer, ""),
            None => Ok(()),
        }
    }

    /// Keeps an array with values at cells, if that is wanted.
    pub fn at_cells(
        &mut self,
        name: &str,
        components: usize,
        values: Vec<f64>,
        integer: bool,
    ) -> Result<(), ReadReason> {
        self.read_at_cells(name, components, integer, || Ok(values))
    }

    /// The same with values that are read only if they are wanted.
    pub fn read_at_cells(
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
            Some(claim) => {
                self.cell_fields.fill(claim, read()?, integer, "").map_err(ReadReason::at_cells)?;
            }
            None => {}
        }
        Ok(())
    }

    /// The mesh. Without cells it has points alone.
    pub fn finish(self) -> Result<TetMesh, ReadReason> {
        let positions = points_from(&self.coordinates)?;
        if positions.len() > u32::MAX as usize {
            return Err(ReadReason::TooLarge { what: "points".into(), limit: u64::from(u32::MAX) });
        }
        let fields = expect_values(self.fields.fields, positions.len())?;
        let has_flat = self.flat.iter().any(|(kind, count)| *count > 0 && !cells::are_points(&[*kind]));
        if self.list.types.is_empty() && has_flat {
            return Err(ReadReason::CellTypes(self.flat.into_iter().collect()));
        }
        if self.list.types.is_empty() {
            return Ok(TetMesh { positions, fields, notes: self.notes, ..TetMesh::default() });
        }
        let cells = self.list.types.len();
        cells::checked_ends(&self.list.types, &self.list.ends)?;
        let numbering = Numbering::From { first: 0, points: positions.len() };
        let split = self.list.split(&numbering)?;
        let mut cell_fields = expect_values(self.cell_fields.fields, cells)?;
        split.spread(&mut cell_fields);
        let (tets, notes) = (split.tets, self.notes);
        Ok(TetMesh { positions, fields, tets, cell_fields, notes, ..TetMesh::default() })
    }
}

/// Checks that fields have as many values as there are points or cells, or none.
fn expect_values(fields: Vec<Field>, expected: usize) -> Result<Vec<Field>, ReadReason> {
    match fields.iter().find(|field| !field.values.is_empty() && field.values.len() != expected) {
        Some(Field { name, values, .. }) => Err(ReadReason::Count {
            what: format!("values of \"{name}\""),
            expected: expected as u64,
            found: values.len() as u64,
        }),
        None => Ok(fields),
    }
}

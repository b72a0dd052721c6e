//! Image data in VTK's XML (`.vti`) of which boxes are read.

use std::path::Path;

use crate::error::{At, ReadError, Stop};
use crate::fields::{Collector, set_time};
use crate::grid::{GridValues, grid_mesh};
use crate::grid_boxes::{Boxes, GridInParts, Points, in_box};
use crate::grid_parts::extent_of;
use crate::image::read_placement;
use crate::options::{CellData, ReadOptions};
use crate::vtu::{self, PieceReader};
use crate::xml::Array;
use crate::xml_on_disk::{XmlFile, expect_no_ghosts};
use tetralod::mesh::{Field, Grid, TetMesh};

/// A file of one piece of which boxes are read.
#[derive(Debug)]
pub(super) struct ImageFile {
    xml: XmlFile,
    options: ReadOptions,
    dims: [u32; 3],
    /// The array of each field, by its number among those that are wanted, from 1 on.
    arrays: Vec<usize>,
}

impl ImageFile {
    /// Opens a file; none if it is another one.
    pub fn open(path: &Path, options: &ReadOptions) -> Result<Option<GridInParts>, Stop> {
        let Some(xml) = XmlFile::open(path, "vti")? else { return Ok(None) };
        let (mut mesh, grid, arrays) = Self::described(&xml, options)?;
        mesh.input.files.0.push(path.to_owned());
        let image = Self { xml, options: options.clone(), dims: grid.dims, arrays };
        Ok(Some(GridInParts::new(mesh, grid, Box::new(image))))
    }

    /// The mesh with fields without values, its grid, and the array of each field.
    fn described(xml: &XmlFile, options: &ReadOptions) -> Result<(TetMesh, Grid, Vec<usize>), Stop> {
        let document = xml.document()?;
        let place = || format!("<{}>", document.kind);
        let (placement, whole) = read_placement(&document).at(place)?;
        let Some(grid) = placement.grid().at(place)? else { return Err(Stop::Whole("its axes are turned")) };
        let mut readers = vtu::readers(&document, options);
        let (Some(reader), None) = (readers.next(), readers.next()) else {
            return Err(Stop::Whole("it is in several pieces"));
        };
        if extent_of(&reader, whole)? != whole {
            return Err(Stop::Whole("a piece of it is missing"));
        }
        expect_no_ghosts(&reader)?;
        let points: u64 = placement.dims.iter().product();
        let mut count = 0;
        let [fields, others] = collect(&reader, options, &mut |array, components| {
            count += 1;
            // What cannot be read by parts is found before any is.
            let stored = xml.stored(&document, array, points.saturating_mul(components as u64))?;
            stored.floats(0..components as u64).map_err(|reason| Stop::from(reason).at(|| array.place()))?;
            // So the fields of an array are known by how many values they have.
            Ok::<_, Stop>(vec![0.0; components * count])
        })?;
        let arrays = fields.iter().map(|field| field.values.len()).collect();
        let names = match options.cells {
            CellData::Names => reader.field_names("CellData")?,
            _ => Vec::new(),
        };
        let mut values =
            GridValues { fields, cubes: names, others: [others, Vec::new()], ..GridValues::default() };
        values.fields.iter_mut().for_each(|field| field.values = Vec::new());
        let mut mesh = grid_mesh(grid, values, &options.memory).at(place)?;
        set_time(&mut mesh, xml.time(&document));
        Ok((mesh, grid, arrays))
    }
}

/// The fields at points that are wanted, and the others.
fn collect<E: From<ReadError>>(
    reader: &PieceReader<'_, '_>,
    options: &ReadOptions,
    read: vtu::ReadArray<'_, E>,
) -> Result<[Vec<Field>; 2], E> {
    reader.collect_by(Collector::new(options), "PointData", read)
}

impl Boxes for ImageFile {
    fn values(&self, field: usize, points: &Points) -> Result<Vec<f64>, ReadError> {
        let document = self.xml.document()?;
        let all: u64 = self.dims.iter().map(|d| u64::from(*d)).product();
        let mut number = 0;
        let mut read = |array: &Array<'_>, components: usize| -> Result<Vec<f64>, Stop> {
            number += 1;
            if self.arrays[field] != number {
                return Ok(Vec::new());
            }
            let each = components as u64;
            let stored = self.xml.stored(&document, array, all.saturating_mul(each))?;
            let rows = in_box(self.dims, points, components, |range| {
                stored.floats(range.start * each..range.end * each)
            });
            rows.map_err(|reason| Stop::from(reason).at(|| array.place()))
        };
        // What was read before is no longer here.
        let options = ReadOptions { memory: self.options.memory.afresh(), ..self.options.clone() };
        let Some(reader) = vtu::readers(&document, &options).next() else { return Ok(Vec::new()) };
        let [mut fields, _] = collect(&reader, &options, &mut read).map_err(Stop::into_changed)?;
        Ok(std::mem::take(&mut fields[field].values))
    }
}

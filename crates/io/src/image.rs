//! Regular grids in VTK's XML: image data (`.vti`).

use std::path::Path;

use crate::contents::Survey;
use crate::error::{At, ReadError, ReadReason, Stop};
use crate::fields::{Collector, set_time};
use crate::grid::{ALONG_THE_AXES, Extent, GridValues, Placement, grid_mesh, placed};
use crate::grid_boxes::{Boxes, GridInParts, Points, in_box};
use crate::grid_parts::{InParts, extent_of, whole_extent};
use crate::listed::for_each_file;
use crate::options::{Beside, CellData, ReadOptions};
use crate::vtu::{self, PieceReader};
use crate::xml::{Array, Document};
use crate::xml_on_disk::{XmlFile, expect_no_ghosts};
use tetralod::mesh::{Field, Grid, TetMesh};

/// Reads a document of type `ImageData`, or `PImageData` with the files that it lists, and its time.
pub(super) fn read(
    document: &Document<'_>,
    options: &ReadOptions,
    beside: Beside<'_>,
) -> Result<(TetMesh, Option<f64>), ReadError> {
    let whole_place = || format!("<{}>", document.kind);
    let (placement, whole) = read_placement(document).at(whole_place)?;
    let mut grid = InParts::default();
    let time = for_each_file(document, beside, &options.memory, &mut |file| {
        vtu::readers(file, options).try_for_each(|reader| grid.add(&reader, whole, Vec::new()))
    })?;
    let values = grid.finish(whole).at(whole_place)?;
    Ok((placement.mesh(values, &options.memory).at(whole_place)?, time))
}

/// Says what a document of type `ImageData` contains, or one that lists files with the pieces of one, whose fields are `names`.
pub(super) fn survey(
    format: &'static str,
    document: &Document<'_>,
    names: [Vec<Field>; 2],
) -> Result<Survey, ReadError> {
    let place = || format!("<{}>", document.kind);
    let (placement, _) = read_placement(document).at(place)?;
    Survey::of_placement(format, &placement, names).at(place)
}

fn read_placement(document: &Document<'_>) -> Result<(Placement, Extent), ReadReason> {
    let attributes = &document.dataset;
    let whole = whole_extent(document)?;
    let origin = attributes.numbers("Origin")?.unwrap_or([0.0; 3]);
    let spacing: [f64; 3] = attributes.numbers("Spacing")?.unwrap_or([1.0; 3]);
    let direction: Option<[f64; 9]> = attributes.numbers("Direction")?;
    placed(whole, origin, spacing, direction.unwrap_or(ALONG_THE_AXES))
}

/// A file of one piece of which boxes are read.
#[derive(Debug)]
pub(super) struct ImageFile {
    xml: XmlFile,
    options: ReadOptions,
    dims: [u32; 3],
    /// The array of each field, by its place among those that are wanted.
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
        // What cannot be read by parts is found before any is.
        let mut count = 0;
        let [fields, others] = collect(&reader, options, &mut |array, components| {
            count += 1;
            let stored = xml.stored(&document, array, points.saturating_mul(components as u64))?;
            stored.floats(0..components as u64).map_err(|reason| Stop::from(reason).at(|| array.place()))
        })?;
        let mut arrays = vec![0; fields.len()];
        for wanted in 0..count {
            // Components of this one are no numbers. Its fields follow one another, and begin with a component.
            let mut number = 0;
            let [marked, _] = collect::<Stop>(&reader, options, &mut |_, components| {
                number += 1;
                Ok(vec![if number == wanted + 1 { f64::NAN } else { 0.0 }; components])
            })?;
            let is_of = |field: &Field| field.values.iter().any(|value| value.is_nan());
            let first = marked.iter().position(is_of).unwrap_or(arrays.len());
            arrays[first..].fill(wanted);
        }
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
        let here: usize = points.iter().map(ExactSizeIterator::len).product();
        let mut number = 0;
        let mut read = |array: &Array<'_>, components: usize| -> Result<Vec<f64>, Stop> {
            number += 1;
            if self.arrays[field] + 1 != number {
                return Ok(vec![0.0; here * components]);
            }
            let each = components as u64;
            let stored = self.xml.stored(&document, array, all.saturating_mul(each))?;
            let rows = in_box(self.dims, points, components, |range| {
                stored.floats(range.start * each..range.end * each)
            });
            rows.map_err(|reason| Stop::from(reason).at(|| array.place()))
        };
        let Some(reader) = vtu::readers(&document, &self.options).next() else { return Ok(Vec::new()) };
        let [mut fields, _] = collect(&reader, &self.options, &mut read).map_err(Stop::as_changed)?;
        Ok(std::mem::take(&mut fields[field].values))
    }
}

//! Grids of cubes in VTK's XML whose points lie anywhere: rectilinear (`.vtr`) and structured ones (`.vts`).

use crate::contents::Survey;
use crate::error::{At, ReadError, ReadReason};
use crate::fields::component_of;
use crate::grid::{Extent, MAX_GRID_POINTS, checked_dims, dims_in, mesh, most_tets, rectilinear};
use crate::grid_parts::{InParts, expect_values, extent_of, whole_extent};
use crate::listed::for_each_file;
use crate::options::{Beside, ReadOptions};
use crate::vtu::{self, PieceReader};
use crate::xml::Document;
use tetralod::mesh::{Field, TetMesh};

/// Reads a document of type `RectilinearGrid` or `StructuredGrid`, or a list of files with the pieces of one, and its time.
pub(super) fn read(
    document: &Document<'_>,
    options: &ReadOptions,
    beside: Beside<'_>,
) -> Result<(TetMesh, Option<f64>), ReadError> {
    let place = || format!("<{}>", document.kind);
    let (whole, dims) = whole(document).at(place)?;
    let mut grid = InParts::default();
    let time = for_each_file(document, beside, &options.memory, &mut |file| {
        vtu::readers(file, options)
            .try_for_each(|reader| grid.add(&reader, whole, coordinates(&reader, whole)?))
    })?;
    // The first three are the coordinates.
    let mut values = grid.finish(whole).at(place)?;
    if values.fields.len() < AXES.len() {
        return Err(ReadReason::Missing("a piece of the grid".into())).at(place);
    }
    let rest = values.fields.split_off(AXES.len());
    let axes = std::mem::replace(&mut values.fields, rest);
    let point = |p: usize| [0, 1, 2].map(|axis| axes[axis].values[p]);
    let positions = (0..axes[0].values.len()).map(point).collect();
    Ok((mesh(dims.map(|d| d as u32), positions, values, &options.memory).at(place)?, time))
}

/// Says what a document of type `RectilinearGrid` or `StructuredGrid` contains, or one that lists files with the pieces of one, whose
/// fields are these.
pub(super) fn survey(
    format: &'static str,
    document: &Document<'_>,
    [fields, cell_fields]: [Vec<Field>; 2],
) -> Result<Survey, ReadError> {
    let (_, dims) = whole(document).at(|| format!("<{}>", document.kind))?;
    let points = dims.iter().product();
    Ok(Survey { format, points, cells: most_tets(dims), grid: None, fields, cell_fields })
}

pub(super) const RECTILINEAR: &str = "RectilinearGrid";
pub(super) const CURVILINEAR: &str = "StructuredGrid";

/// What the coordinates are called while pieces are put together.
const AXES: [&str; 3] = ["x", "y", "z"];

/// The extent of the whole grid and its points along each axis, whose product does not overflow.
fn whole(document: &Document<'_>) -> Result<(Extent, [u64; 3]), ReadReason> {
    let whole = whole_extent(document)?;
    let dims = dims_in(whole, whole)?;
    checked_dims(dims)?;
    Ok((whole, dims))
}

/// The coordinates of a piece as three fields.
fn coordinates(reader: &PieceReader<'_, '_>, whole: Extent) -> Result<Vec<Field>, ReadError> {
    let dims = dims_in(extent_of(reader, whole)?, whole).at(|| reader.place())?;
    let points = dims.iter().product::<u64>().min(MAX_GRID_POINTS) as usize;
    let coordinates = if reader.document.kind == RECTILINEAR {
        expect_values(reader, points, dims)?;
        along_axes(reader, dims)?
    } else {
        reader.points(points)?.into_flattened()
    };
    let axis = |(i, name): (usize, &&str)| Field::new(*name, component_of(&coordinates, i, 3));
    Ok(AXES.iter().enumerate().map(axis).collect())
}

/// The positions in a piece of a rectilinear grid.
fn along_axes(reader: &PieceReader<'_, '_>, dims: [u64; 3]) -> Result<Vec<f64>, ReadError> {
    let mut arrays = reader.piece.section("Coordinates");
    let mut coordinates = [const { Vec::new() }; 3];
    for (axis, dim) in coordinates.iter_mut().zip(dims) {
        let missing = || ReadReason::Missing("an array of <Coordinates>".into());
        let array = arrays.next().ok_or_else(missing).at(|| reader.place())?;
        *axis = reader.document.floats(array, dim as usize, 1).at(|| array.place())?;
    }
    Ok(rectilinear(&coordinates))
}

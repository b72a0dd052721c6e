//! Grids of cubes whose points lie anywhere: VTK XML rectilinear (`.vtr`) and structured grids (`.vts`), and what they share
//! with those of legacy files.
//!
//! Every cube is split as that of a regular grid, so neighbours agree.

use crate::io::error::{At, ReadError, ReadReason};
use crate::io::fields::component_of;
use crate::io::image::{self, Extent, MAX_GRID_POINTS, Part};
use crate::io::vtu::PieceReader;
use crate::io::xml::Document;
use crate::io::{Beside, ReadOptions, Survey, for_each_file, points_from, vtu};
use crate::mesh::{Field, TetMesh, kuhn_tets};

/// Points along each axis: at least two, and not too many together.
pub(super) fn checked_dims(dims: [u64; 3]) -> Result<[u32; 3], ReadReason> {
    image::checked_grid(dims, [0.0; 3], [1.0; 3]).map(|grid| grid.dims)
}

/// How many cubes there are between so many points.
pub(super) fn cubes(dims: [u32; 3]) -> usize {
    dims.map(|d| d as usize - 1).iter().product()
}

/// How many tetrahedra they are split into.
pub(super) fn most_tets(dims: [u64; 3]) -> u64 {
    dims.iter().map(|d| d.saturating_sub(1)).fold(6, u64::saturating_mul)
}

/// The positions of a grid with these coordinates along each axis.
pub(super) fn rectilinear([x, y, z]: &[Vec<f64>; 3]) -> Vec<f64> {
    let mut positions = Vec::with_capacity(3 * x.len() * y.len() * z.len());
    for z in z {
        for y in y {
            positions.extend(x.iter().flat_map(|x| [*x, *y, *z]));
        }
    }
    positions
}

/// The mesh of a grid of checked dimensions with these points, and fields at points and cubes.
pub(super) fn mesh(
    dims: [u32; 3],
    positions: Vec<[f64; 3]>,
    fields: Vec<Field>,
    mut cell_fields: Vec<Field>,
) -> Result<TetMesh, ReadReason> {
    let expected = dims.iter().map(|d| u64::from(*d)).product();
    if positions.len() as u64 != expected {
        let found = positions.len() as u64;
        return Err(ReadReason::Count { what: "points".into(), expected, found });
    }
    image::sixfold(&mut cell_fields);
    Ok(TetMesh { positions, fields, tets: kuhn_tets(dims), cell_fields, ..TetMesh::default() })
}

/// Reads a document of type `RectilinearGrid` or `StructuredGrid`, or a list of files with the pieces of one, and its time.
pub(super) fn read(
    document: &Document<'_>,
    options: &ReadOptions,
    beside: Beside<'_>,
) -> Result<(TetMesh, Option<f64>), ReadError> {
    let place = || format!("<{}>", document.kind);
    let (whole, dims) = whole(document).at(place)?;
    let mut parts = Vec::new();
    let mut cubes = image::Cubes::default();
    let time = for_each_file(document, beside, &mut |file| {
        for (number, piece) in file.pieces.iter().enumerate() {
            let reader = PieceReader { document: file, piece, number, options };
            parts.push(read_part(&reader, whole)?);
            cubes.add(&reader, whole)?;
        }
        Ok(())
    })?;
    // The first three are the coordinates.
    let mut fields = image::assemble(parts, whole).at(place)?;
    if fields.len() < AXES.len() {
        return Err(ReadReason::Missing("a piece of the grid".into())).at(place);
    }
    let rest = fields.split_off(AXES.len());
    let coordinates = |i: usize| fields.iter().map(move |field| field.values[i]);
    let points: Vec<f64> = (0..fields[0].values.len()).flat_map(coordinates).collect();
    let positions = points_from(&points).at(place)?;
    let cubes = cubes.finish(whole).at(place)?;
    Ok((mesh(dims.map(|d| d as u32), positions, rest, cubes).at(place)?, time))
}

/// Says what a document of type `RectilinearGrid` or `StructuredGrid` contains.
pub(super) fn survey(document: &Document<'_>) -> Result<Survey, ReadError> {
    let (_, dims) = whole(document).at(|| format!("<{}>", document.kind))?;
    let [fields, cell_fields] = vtu::names(document)?;
    let format = if document.kind == RECTILINEAR { "vtr" } else { "vts" };
    let points = dims.iter().product();
    Ok(Survey { format, points, cells: most_tets(dims), grid: None, fields, cell_fields })
}

pub(super) const RECTILINEAR: &str = "RectilinearGrid";
pub(super) const CURVILINEAR: &str = "StructuredGrid";

/// What the coordinates are called while pieces are put together.
const AXES: [&str; 3] = ["x", "y", "z"];

/// The extent of the whole grid and its points along each axis, whose product does not overflow.
fn whole(document: &Document<'_>) -> Result<(Extent, [u64; 3]), ReadReason> {
    let whole: Extent = document
        .dataset
        .numbers("WholeExtent")?
        .ok_or_else(|| ReadReason::Missing("attribute WholeExtent".into()))?;
    let dims = image::dims_in(whole, whole)?;
    checked_dims(dims)?;
    Ok((whole, dims))
}

/// A piece: its coordinates as three fields, then its own.
fn read_part(reader: &PieceReader<'_, '_>, whole: Extent) -> Result<Part, ReadError> {
    let place = || reader.place();
    let extent = reader.piece.attributes.numbers("Extent").at(place)?.unwrap_or(whole);
    let dims = image::dims_in(extent, whole).at(place)?;
    let points = dims.iter().product::<u64>().min(MAX_GRID_POINTS) as usize;
    let coordinates = if reader.document.kind == RECTILINEAR {
        expect_values(reader, points, dims)?;
        along_axes(reader, dims)?
    } else {
        reader.points(points)?.into_flattened()
    };
    let axis = |(i, name): (usize, &&str)| Field::new(*name, component_of(&coordinates, i, 3));
    let mut fields: Vec<Field> = AXES.iter().enumerate().map(axis).collect();
    fields.extend(reader.fields("PointData", points)?);
    Ok(Part { extent, fields })
}

/// Checks that there is an array of as many values as there are points or cubes: without, a few coordinates claim any size.
fn expect_values(reader: &PieceReader<'_, '_>, points: usize, dims: [u64; 3]) -> Result<(), ReadError> {
    let cubes = dims.iter().map(|d| *d as usize - 1).product();
    for (section, tuples) in [("PointData", points), ("CellData", cubes)] {
        if let Some(array) = reader.piece.section(section).find(|array| array.number_type().is_some()) {
            let components = array.components().at(|| array.place())?;
            return reader.document.floats(array, tuples, components).map(|_| ()).at(|| array.place());
        }
    }
    Err(ReadReason::Missing("an array with a value for every point or cell".into())).at(|| reader.place())
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

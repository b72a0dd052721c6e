//! Grids of cubes whose points lie anywhere: VTK XML rectilinear (`.vtr`) and structured grids (`.vts`), and what they share
//! with those of legacy files.
//!
//! Every cube is split as that of a regular grid, so neighbours agree.

use crate::error::{At, ReadError, ReadReason};
use crate::fields::{check_finite, check_finite_cells, component_of};
use crate::image::{self, Extent, GridValues, MAX_GRID_POINTS};
use crate::vtu::{HIDDEN_POINT, PieceReader};
use crate::xml::Document;
use crate::{Beside, MemoryLimit, ReadOptions, Survey, cells, for_each_file, vtu};
use tetralod::mesh::{CellNumbers, Field, MeshInput, TetMesh, kuhn_tets};

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

/// Bytes of the points and tetrahedra of a grid.
pub(super) fn bytes(dims: [u32; 3]) -> u64 {
    let points: u64 = dims.iter().map(|d| u64::from(*d)).product();
    24 * points + 6 * 16 * cubes(dims) as u64
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

/// What VTK's flags hide of a grid; none without flags.
#[derive(Debug, Default)]
pub(super) struct Ghosts {
    pub points: Option<Vec<i64>>,
    pub cubes: Option<Vec<i64>>,
}

impl Ghosts {
    /// Why each cube is left out, or 0 where it is not; none if all are there.
    fn left_out(&self, dims: [u32; 3]) -> Option<Vec<i64>> {
        let mut left_out = vec![0; cubes(dims)];
        for (kind, flags) in left_out.iter_mut().zip(self.cubes.iter().flatten()) {
            *kind = cells::left_out_by(*flags).unwrap_or(0);
        }
        if let Some(points) = self.points.as_ref().filter(|flags| flags.iter().any(|f| f & HIDDEN_POINT != 0))
        {
            let hidden = |corners: [usize; 8]| {
                corners.iter().any(|&p| points.get(p).is_some_and(|f| f & HIDDEN_POINT != 0))
            };
            let around = (0..left_out.len()).map(|cube| hidden(corners(dims, cube)));
            left_out
                .iter_mut()
                .zip(around)
                .filter(|(_, hidden)| *hidden)
                .for_each(|(kind, _)| *kind = cells::HIDDEN);
        }
        left_out.iter().any(|kind| *kind != 0).then_some(left_out)
    }
}

/// The points at the corners of a cube.
fn corners(dims: [u32; 3], cube: usize) -> [usize; 8] {
    let [x, y, _] = dims.map(|d| d as usize);
    let (row, layer) = (x - 1, (x - 1) * (y - 1));
    let first = cube % row + x * (cube % layer / row) + x * y * (cube / layer);
    [0, 1, x, x + 1, x * y, x * y + 1, x * y + x, x * y + x + 1].map(|offset| first + offset)
}

/// The mesh of a grid of checked dimensions with these points, and fields at points and cubes.
pub(super) fn mesh(
    dims: [u32; 3],
    positions: Vec<[f64; 3]>,
    values: GridValues,
    memory: &MemoryLimit,
) -> Result<TetMesh, ReadReason> {
    let expected = dims.iter().map(|d| u64::from(*d)).product();
    if positions.len() as u64 != expected {
        let found = positions.len() as u64;
        return Err(ReadReason::Count { what: "points".into(), expected, found });
    }
    memory.take(bytes(dims))?;
    with_values(TetMesh { positions, tets: kuhn_tets(dims), ..TetMesh::default() }, dims, values, memory)
}

/// A grid, alone or with its points and tetrahedra, with its values and without what is hidden.
pub(super) fn with_values(
    mut mesh: TetMesh,
    dims: [u32; 3],
    values: GridValues,
    memory: &MemoryLimit,
) -> Result<TetMesh, ReadReason> {
    let GridValues { fields, cubes, ghosts, others: [other_fields, other_cell_fields] } = values;
    let left_out = ghosts.left_out(dims);
    check_finite(&mesh.positions, &fields, &|| left_out.as_ref().map(|left_out| used(dims, left_out)))?;
    check_finite_cells(&cubes, |cube| left_out.as_ref().is_none_or(|left_out| left_out[cube] == 0))?;
    (mesh.fields, mesh.cell_fields) = (fields, cubes);
    mesh.input = MeshInput { other_fields, other_cell_fields, ..MeshInput::default() };
    let count = self::cubes(dims);
    if left_out.is_some() || mesh.cell_fields.iter().any(|field| !field.values.is_empty()) {
        if mesh.is_grid_alone() {
            memory.take(bytes(dims))?;
        }
        mesh.expand_grid();
    }
    let Some(left_out) = left_out else {
        mesh.input.cells = CellNumbers::equal(count, 6, CUBE);
        let spread = |&value: &f64| [value; 6];
        mesh.cell_fields.iter_mut().for_each(|f| f.values = f.values.iter().flat_map(spread).collect());
        return Ok(mesh);
    };
    // What is left is no regular grid.
    let is_there = |cube: usize| left_out[cube] == 0;
    mesh.grid = None;
    cells::leave_out(
        &left_out.iter().copied().filter(|kind| *kind != 0).collect::<Vec<_>>(),
        &mut mesh.input,
    );
    let kept: Vec<u32> =
        (0..count as u32).filter(|&cube| is_there(cube as usize)).flat_map(|cube| [cube; 6]).collect();
    let mut tet = 0;
    mesh.tets.retain(|_| {
        tet += 1;
        is_there((tet - 1) / 6)
    });
    for field in mesh.cell_fields.iter_mut().filter(|field| !field.values.is_empty()) {
        field.values = kept.iter().map(|&cube| field.values[cube as usize]).collect();
    }
    mesh.input.cells = CellNumbers::each(kept, count, vec![(0, CUBE)]);
    Ok(mesh)
}

/// What the cells of a grid are called in messages.
const CUBE: &str = "cube of the grid";

/// Which points the cubes use that are not left out.
fn used(dims: [u32; 3], left_out: &[i64]) -> Vec<bool> {
    let mut used = vec![false; dims.iter().map(|d| *d as usize).product()];
    for (cube, _) in left_out.iter().enumerate().filter(|(_, kind)| **kind == 0) {
        corners(dims, cube).into_iter().for_each(|point| used[point] = true);
    }
    used
}

/// Reads a document of type `RectilinearGrid` or `StructuredGrid`, or a list of files with the pieces of one, and its time.
pub(super) fn read(
    document: &Document<'_>,
    options: &ReadOptions,
    beside: Beside<'_>,
) -> Result<(TetMesh, Option<f64>), ReadError> {
    let place = || format!("<{}>", document.kind);
    let (whole, dims) = whole(document).at(place)?;
    let mut grid = image::InParts::default();
    let time = for_each_file(document, beside, &options.memory, &mut |file| {
        for (number, piece) in file.full_pieces() {
            let reader = PieceReader { document: file, piece, number, options };
            grid.add(&reader, whole, coordinates(&reader, whole)?)?;
        }
        Ok(())
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

/// The coordinates of a piece as three fields.
fn coordinates(reader: &PieceReader<'_, '_>, whole: Extent) -> Result<Vec<Field>, ReadError> {
    let dims = image::dims_in(image::extent_of(reader, whole)?, whole).at(|| reader.place())?;
    let points = dims.iter().product::<u64>().min(MAX_GRID_POINTS) as usize;
    let coordinates = if reader.document.kind == RECTILINEAR {
        image::expect_values(reader, points, dims)?;
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

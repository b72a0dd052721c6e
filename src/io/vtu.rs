//! VTK XML unstructured grids (`.vtu`), all encodings, any number of pieces. Vertices as cells are left out: what has no
//! others is a mesh of points without tetrahedra.

use crate::io::CellData;
use crate::io::ReadOptions;
use crate::io::cells;
use crate::io::error::At;
use crate::io::error::ReadError;
use crate::io::error::ReadReason;
use crate::io::fields::Collector;
use crate::io::points_from;
use crate::io::xml::Array;
use crate::io::xml::Document;
use crate::io::xml::Piece;
use crate::mesh::Field;
use crate::mesh::TetMesh;

/// Reads a document of type `UnstructuredGrid`. The points of different pieces stay different points.
pub(super) fn read(document: &Document<'_>, options: &ReadOptions) -> Result<TetMesh, ReadError> {
    let mut mesh = TetMesh::default();
    for (i, piece) in document.pieces.iter().enumerate() {
        let part = read_piece(document, piece, i, mesh.positions.len(), options)?;
        join(&mut mesh, part, i == 0).at(|| format!("piece {i}, <PointData>"))?;
    }
    Ok(mesh)
}

fn read_piece(
    document: &Document<'_>,
    piece: &Piece<'_>,
    number: usize,
    first: usize,
    options: &ReadOptions,
) -> Result<TetMesh, ReadError> {
    let place = || format!("piece {number}");
    let points = piece.attributes.count("NumberOfPoints").at(place)?;
    let cells = piece.attributes.count("NumberOfCells").at(place)?;
    let first = points
        .checked_add(first)
        .and_then(|end| u32::try_from(end).ok())
        .map(|_| first as u32)
        .ok_or_else(|| ReadReason::TooLarge { what: "points".into(), limit: u64::from(u32::MAX) })
        .at(place)?;
    let tets = read_cells(document, piece, number, cells, points, first)?;
    let positions = read_points(document, piece, number, points)?;
    let fields = read_fields(document, piece, "PointData", points, options)?;
    // Where all cells were left out, so is what is known of them.
    let (cell_data, cells) =
        if tets.len() < cells { (CellData::LeaveOut, 0) } else { (options.cells, cells) };
    let cell_fields = match cell_data {
        CellData::LeaveOut => Vec::new(),
        CellData::Names => name_fields(piece, "CellData", options)?,
        CellData::Values => read_fields(document, piece, "CellData", cells, options).map_err(at_cell)?,
    };
    Ok(TetMesh { positions, fields, tets, grid: None, cell_fields })
}

/// The fields in a section of a piece, each of `tuples` values.
pub(super) fn read_fields(
    document: &Document<'_>,
    piece: &Piece<'_>,
    section: &str,
    tuples: usize,
    options: &ReadOptions,
) -> Result<Vec<Field>, ReadError> {
    let mut collector = Collector::new(options.fields.as_deref());
    for array in piece.section(section) {
        let Some(number) = array.number_type() else { continue };
        let components = array.components().at(|| array.place())?;
        let Some(claim) = collector.claim(array.name(), components).at(|| array.place())? else { continue };
        let values = document.floats(array, tuples, components).at(|| array.place())?;
        collector.fill(claim, values, number.is_integer(), array.unit()).at(|| array.place())?;
    }
    Ok(collector.fields)
}

/// The same fields without their values.
pub(super) fn name_fields(
    piece: &Piece<'_>,
    section: &str,
    options: &ReadOptions,
) -> Result<Vec<Field>, ReadError> {
    let mut collector = Collector::new(options.fields.as_deref());
    for array in piece.section(section).filter(|array| array.number_type().is_some()) {
        let components = array.components().at(|| array.place())?;
        if let Some(claim) = collector.claim(array.name(), components).at(|| array.place())? {
            collector.keep_names(claim);
        }
    }
    Ok(collector.fields)
}

/// A point that is named in an error about a field at cells is a cell.
pub(super) fn at_cell(error: ReadError) -> ReadError {
    let reason = match error.reason {
        ReadReason::NotFinite { point } => ReadReason::NotFiniteCell { cell: point },
        other => other,
    };
    ReadError { reason, ..error }
}

fn read_points(
    document: &Document<'_>,
    piece: &Piece<'_>,
    number: usize,
    points: usize,
) -> Result<Vec<[f64; 3]>, ReadError> {
    let Some(array) = piece.section("Points").next() else {
        if points == 0 {
            return Ok(Vec::new());
        }
        return Err(ReadReason::Missing("the array of <Points>".into())).at(|| format!("piece {number}"));
    };
    let components = array.components().at(|| array.place())?;
    if components != 3 {
        let (what, found) = ("components of the points".into(), components as u64);
        return Err(ReadReason::Count { what, expected: 3, found }).at(|| array.place());
    }
    let values = document.floats(array, points, 3).at(|| array.place())?;
    points_from(&values).at(|| array.place())
}

fn read_cells(
    document: &Document<'_>,
    piece: &Piece<'_>,
    number: usize,
    cells: usize,
    points: usize,
    first: u32,
) -> Result<Vec<[u32; 4]>, ReadError> {
    if cells == 0 {
        return Ok(Vec::new());
    }
    let find = |name: &str| -> Result<&Array<'_>, ReadError> {
        let found = piece.section("Cells").find(|a| a.name() == name);
        found
            .ok_or_else(|| ReadReason::Missing(format!("array \"{name}\" of <Cells>")))
            .at(|| format!("piece {number}"))
    };
    let types = find("types")?;
    let kinds = document.integers(types, cells).at(|| types.place())?;
    if cells::are_points(&kinds) {
        return Ok(Vec::new());
    }
    cells::only_tetrahedra(&kinds).at(|| types.place())?;
    let offsets = find("offsets")?;
    let ends = document.integers(offsets, cells).at(|| offsets.place())?;
    cells::ends_of_tetrahedra(&ends).at(|| offsets.place())?;
    let connectivity = find("connectivity")?;
    // The offsets were read, so there are fewer cells than bytes in memory and this does not overflow.
    let list = document.integers(connectivity, 4 * cells).at(|| connectivity.place())?;
    cells::tetrahedra(&list, points, first).at(|| connectivity.place())
}

/// Appends a piece, which must have the fields of those before it.
fn join(mesh: &mut TetMesh, part: TetMesh, is_first: bool) -> Result<(), ReadReason> {
    if is_first {
        *mesh = part;
        return Ok(());
    }
    join_fields(&mut mesh.fields, &part.fields)?;
    join_fields(&mut mesh.cell_fields, &part.cell_fields)?;
    mesh.positions.extend(part.positions);
    mesh.tets.extend(part.tets);
    Ok(())
}

fn join_fields(fields: &mut [Field], more: &[Field]) -> Result<(), ReadReason> {
    if let Some(extra) = more.iter().find(|f| !fields.iter().any(|g| g.name == f.name)) {
        return Err(ReadReason::Missing(format!(
            "array \"{}\", which this piece has, in an earlier piece",
            extra.name
        )));
    }
    for Field { name, values, integer, .. } in fields {
        let same = more.iter().find(|f| f.name == *name);
        let same =
            same.ok_or_else(|| ReadReason::Missing(format!("array \"{name}\", which earlier pieces have,")))?;
        values.extend_from_slice(&same.values);
        *integer &= same.integer;
    }
    Ok(())
}

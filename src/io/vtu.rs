//! VTK XML unstructured grids (`.vtu`), all encodings, any number of pieces. Vertices as cells are left out: what has no
//! others is a mesh of points without tetrahedra.

use crate::io::cells;
use crate::io::error::At;
use crate::io::error::ReadError;
use crate::io::error::ReadReason;
use crate::io::fields;
use crate::io::points_from;
use crate::io::xml::Array;
use crate::io::xml::Document;
use crate::io::xml::Piece;
use crate::mesh::Field;
use crate::mesh::TetMesh;

/// Reads a document of type `UnstructuredGrid`. The points of different pieces stay different points.
pub(super) fn read(document: &Document<'_>) -> Result<TetMesh, ReadError> {
    let mut mesh = TetMesh::default();
    for (i, piece) in document.pieces.iter().enumerate() {
        let part = read_piece(document, piece, i, mesh.positions.len())?;
        join(&mut mesh, part, i == 0).at(|| format!("piece {i}, <PointData>"))?;
    }
    Ok(mesh)
}

fn read_piece(
    document: &Document<'_>,
    piece: &Piece<'_>,
    number: usize,
    first: usize,
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
    let mut list = Vec::new();
    for array in piece.section("PointData").filter(|a| a.number_type().is_some()) {
        let components = array.components().at(|| array.place())?;
        let values = document.floats(array, points, components).at(|| array.place())?;
        fields::append(&mut list, array.name(), components, values).at(|| array.place())?;
    }
    Ok(TetMesh { positions, fields: list, tets, grid: None })
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
    if let Some(extra) = part.fields.iter().find(|f| !mesh.fields.iter().any(|g| g.name == f.name)) {
        return Err(ReadReason::Missing(format!(
            "array \"{}\", which this piece has, in an earlier piece",
            extra.name
        )));
    }
    for Field { name, values } in &mut mesh.fields {
        let same = part.fields.iter().find(|f| f.name == *name);
        let same =
            same.ok_or_else(|| ReadReason::Missing(format!("array \"{name}\", which earlier pieces have,")))?;
        values.extend_from_slice(&same.values);
    }
    mesh.positions.extend(part.positions);
    mesh.tets.extend(part.tets);
    Ok(())
}

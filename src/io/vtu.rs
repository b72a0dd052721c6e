//! VTK XML unstructured grids (`.vtu`), all encodings, any number of pieces. Vertices as cells are left out: what has no
//! others is a mesh of points without tetrahedra.

use crate::io::error::{At, ReadError, ReadReason};
use crate::io::fields::Collector;
use crate::io::xml::{Array, Document, Piece};
use crate::io::{CellData, ReadOptions, Survey, cells, points_from};
use crate::mesh::{Field, TetMesh};

/// Reads a document of type `UnstructuredGrid`. The points of different pieces stay different points.
pub(super) fn read(document: &Document<'_>, options: &ReadOptions) -> Result<TetMesh, ReadError> {
    let mut mesh = TetMesh::default();
    for (i, piece) in document.pieces.iter().enumerate() {
        let part = PieceReader { document, piece, number: i, options }.read(mesh.positions.len())?;
        join(&mut mesh, part, i == 0).at(|| format!("piece {i}, <PointData>"))?;
    }
    Ok(mesh)
}

/// Says what a document of type `UnstructuredGrid` contains.
pub(super) fn survey(document: &Document<'_>) -> Result<Survey, ReadError> {
    let (mut points, mut cells) = (0_u64, 0_u64);
    for (i, piece) in document.pieces.iter().enumerate() {
        for (name, sum) in [("NumberOfPoints", &mut points), ("NumberOfCells", &mut cells)] {
            let count = piece.attributes.count(name).at(|| format!("piece {i}"))?;
            *sum = sum.saturating_add(count as u64);
        }
    }
    let [fields, cell_fields] = names(document)?;
    Ok(Survey { format: "vtu", points, cells, grid: None, fields, cell_fields })
}

/// The fields at points and at cells of the first piece, without values.
pub(super) fn names(document: &Document<'_>) -> Result<[Vec<Field>; 2], ReadError> {
    let Some(piece) = document.pieces.first() else { return Ok([Vec::new(), Vec::new()]) };
    let options = &ReadOptions::default();
    let reader = PieceReader { document, piece, number: 0, options };
    Ok([reader.field_names("PointData")?, reader.field_names("CellData")?])
}

/// Reads what is wanted of one piece.
pub(super) struct PieceReader<'a, 'd> {
    pub document: &'a Document<'d>,
    pub piece: &'a Piece<'d>,
    pub number: usize,
    pub options: &'a ReadOptions,
}

impl PieceReader<'_, '_> {
    /// How to call the piece in an error.
    pub fn place(&self) -> String {
        format!("piece {}", self.number)
    }

    /// An unstructured grid, whose first point gets number `first`.
    fn read(&self, first: usize) -> Result<TetMesh, ReadError> {
        let place = || self.place();
        let points = self.piece.attributes.count("NumberOfPoints").at(place)?;
        let cells = self.piece.attributes.count("NumberOfCells").at(place)?;
        let first = points
            .checked_add(first)
            .and_then(|end| u32::try_from(end).ok())
            .map(|_| first as u32)
            .ok_or_else(|| ReadReason::TooLarge { what: "points".into(), limit: u64::from(u32::MAX) })
            .at(place)?;
        let tets = self.cells(cells, points, first)?;
        let positions = self.points(points)?;
        let fields = self.fields("PointData", points)?;
        // Where all cells were left out, so is what is known of them.
        let cell_fields = match self.options.cells {
            _ if tets.len() < cells => Vec::new(),
            CellData::LeaveOut => Vec::new(),
            CellData::Names => self.field_names("CellData")?,
            CellData::Values => self.cell_fields(cells)?,
        };
        Ok(TetMesh { positions, fields, tets, grid: None, cell_fields })
    }

    /// The fields in a section, each of `tuples` values.
    pub fn fields(&self, section: &str, tuples: usize) -> Result<Vec<Field>, ReadError> {
        let mut collector = Collector::new(self.options.fields.as_deref());
        for array in self.piece.section(section) {
            let Some(number) = array.number_type() else { continue };
            let components = array.components().at(|| array.place())?;
            let Some(claim) = collector.claim(array.name(), components).at(|| array.place())? else {
                continue;
            };
            let values = self.document.floats(array, tuples, components).at(|| array.place())?;
            collector.fill(claim, values, number.is_integer(), array.unit()).at(|| array.place())?;
        }
        Ok(collector.fields)
    }

    /// The fields at cells.
    pub fn cell_fields(&self, cells: usize) -> Result<Vec<Field>, ReadError> {
        self.fields("CellData", cells).map_err(|error| match error.reason {
            // A point that is named in an error about a field at cells is a cell.
            ReadReason::NotFinite { point } => {
                ReadError { reason: ReadReason::NotFiniteCell { cell: point }, ..error }
            }
            _ => error,
        })
    }

    /// The fields in a section without their values.
    pub fn field_names(&self, section: &str) -> Result<Vec<Field>, ReadError> {
        let mut collector = Collector::new(self.options.fields.as_deref());
        for array in self.piece.section(section).filter(|array| array.number_type().is_some()) {
            let components = array.components().at(|| array.place())?;
            if let Some(claim) = collector.claim(array.name(), components).at(|| array.place())? {
                collector.keep_names(claim, array.unit());
            }
        }
        Ok(collector.fields)
    }

    fn points(&self, points: usize) -> Result<Vec<[f64; 3]>, ReadError> {
        let Some(array) = self.piece.section("Points").next() else {
            if points == 0 {
                return Ok(Vec::new());
            }
            return Err(ReadReason::Missing("the array of <Points>".into())).at(|| self.place());
        };
        let components = array.components().at(|| array.place())?;
        if components != 3 {
            let (what, found) = ("components of the points".into(), components as u64);
            return Err(ReadReason::Count { what, expected: 3, found }).at(|| array.place());
        }
        let values = self.document.floats(array, points, 3).at(|| array.place())?;
        points_from(&values).at(|| array.place())
    }

    fn cells(&self, cells: usize, points: usize, first: u32) -> Result<Vec<[u32; 4]>, ReadError> {
        if cells == 0 {
            return Ok(Vec::new());
        }
        let find = |name: &str| -> Result<&Array<'_>, ReadError> {
            let found = self.piece.section("Cells").find(|a| a.name() == name);
            let missing = || ReadReason::Missing(format!("array \"{name}\" of <Cells>"));
            found.ok_or_else(missing).at(|| self.place())
        };
        let types = find("types")?;
        let kinds = self.document.integers(types, cells).at(|| types.place())?;
        if cells::are_points(&kinds) {
            return Ok(Vec::new());
        }
        cells::only_tetrahedra(&kinds).at(|| types.place())?;
        let offsets = find("offsets")?;
        let ends = self.document.integers(offsets, cells).at(|| offsets.place())?;
        cells::ends_of_tetrahedra(&ends).at(|| offsets.place())?;
        let connectivity = find("connectivity")?;
        // The offsets were read, so there are fewer cells than bytes in memory and this does not overflow.
        let list = self.document.integers(connectivity, 4 * cells).at(|| connectivity.place())?;
        cells::tetrahedra(&list, points, first).at(|| connectivity.place())
    }
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

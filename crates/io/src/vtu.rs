//! VTK XML unstructured grids (`.vtu`), all encodings, any number of pieces. What has vertices alone as cells is a mesh of
//! points without tetrahedra.

use crate::cells::CellList;
use crate::error::{At, ReadError, ReadReason, expect_count};
use crate::fields::{Collector, check_finite, check_finite_cells};
use crate::ghosts::{GHOST_LEVELS, GHOST_TYPE, HIDDEN_POINT};
use crate::number::points_from;
use crate::numbering::Numbering;
use crate::polyhedra::{self, FaceLists, SharedFaces};
use crate::xml::{Array, Document, Piece};
use crate::{CellData, ReadOptions, cell_types, cells};
use tetralod::mesh::{Field, MeshInput, TetMesh};

/// Reads a document of type `UnstructuredGrid`. The points of different pieces stay different points.
pub(super) fn read(document: &Document<'_>, options: &ReadOptions) -> Result<TetMesh, ReadError> {
    let mut mesh = TetMesh::default();
    for (i, reader) in readers(document, options).enumerate() {
        let first = mesh.positions.len();
        let part = reader.read(&mut |points| {
            Ok(Numbering::From { first: first_number(first, points.len())?, points: points.len() })
        })?;
        join(&mut mesh, part, i == 0).at(|| format!("{}, <PointData>", reader.place()))?;
    }
    Ok(mesh)
}

/// The number of the first of so many points behind others.
pub(super) fn first_number(first: usize, points: usize) -> Result<u32, ReadReason> {
    let end = first.checked_add(points).and_then(|end| u32::try_from(end).ok());
    let too_large = || ReadReason::TooLarge { what: "points".into(), limit: u64::from(u32::MAX) };
    end.map(|_| first as u32).ok_or_else(too_large)
}

/// How many points there are in a document of type `UnstructuredGrid`, and how many tetrahedra at most; of its arrays only the types of
/// cells are decoded.
pub(super) fn counts(document: &Document<'_>) -> Result<[u64; 2], ReadError> {
    let (mut points, mut cells) = (0_u64, 0_u64);
    for reader in readers(document, &ReadOptions::default()) {
        let count = reader.piece.attributes.count("NumberOfPoints").at(|| reader.place())?;
        points = points.saturating_add(count as u64);
        cells = cells.saturating_add(reader.most_tets()?);
    }
    Ok([points, cells])
}

/// The fields at points and at cells of the first piece, without values.
pub(super) fn names(document: &Document<'_>) -> Result<[Vec<Field>; 2], ReadError> {
    let options = &ReadOptions::default();
    let Some(reader) = readers(document, options).next() else { return Ok([Vec::new(), Vec::new()]) };
    Ok([reader.field_names("PointData")?, reader.field_names("CellData")?])
}

/// Reads what is wanted of one piece.
pub(super) struct PieceReader<'a, 'd> {
    pub document: &'a Document<'d>,
    pub piece: &'a Piece<'d>,
    pub number: usize,
    pub options: &'a ReadOptions,
}

/// Readers of the pieces of a document that are not empty.
pub(super) fn readers<'a, 'd>(
    document: &'a Document<'d>,
    options: &'a ReadOptions,
) -> impl Iterator<Item = PieceReader<'a, 'd>> {
    document.full_pieces().map(move |(number, piece)| PieceReader { document, piece, number, options })
}

/// Reads an array of so many components.
pub(super) type ReadArray<'a, E> = &'a mut dyn FnMut(&Array<'_>, usize) -> Result<Vec<f64>, E>;

/// Numbers the points of a piece, given their positions.
pub(super) type NumberPoints<'a> = &'a mut dyn FnMut(&[[f64; 3]]) -> Result<Numbering, ReadReason>;

impl PieceReader<'_, '_> {
    /// How to call the piece in an error.
    pub fn place(&self) -> String {
        format!("piece {}", self.number)
    }

    /// An unstructured grid. Its points are numbered as `numbers` says, which gets their positions.
    pub fn read(&self, numbers: NumberPoints<'_>) -> Result<TetMesh, ReadError> {
        let place = || self.place();
        let points = self.piece.attributes.count("NumberOfPoints").at(place)?;
        let cells = self.piece.attributes.count("NumberOfCells").at(place)?;
        let mut listed = self.cells(cells)?;
        if let (Some(listed), Some(ghosts)) = (&mut listed, self.ghosts("PointData", points)?) {
            listed.hide(&ghosts.iter().map(|flags| flags & HIDDEN_POINT != 0).collect::<Vec<_>>());
        }
        let mut positions = self.points(points)?;
        let [mut fields, other_fields] = self.fields("PointData", points)?;
        let used = || listed.as_ref().map(|listed| listed.used(points));
        check_finite(&positions, &fields, &used).at(place)?;
        // Where all cells were left out, so is what is known of them.
        let [mut cell_fields, other_cell_fields] = match &listed {
            None => Default::default(),
            Some(listed) => {
                let at_cells = self.cell_fields(cells, &fields)?;
                check_finite_cells(&at_cells[0], |cell| {
                    listed.types.get(cell).is_some_and(|kind| !cell_types::is_flat(*kind))
                })
                .at(place)?;
                at_cells
            }
        };
        let numbering = numbers(&positions).at(place)?;
        let memory = &self.options.memory;
        let split =
            listed.map(|listed| listed.split(&numbering, &mut positions, &mut fields, memory)).transpose();
        let split = split.at(|| format!("{}, <Cells>, array \"connectivity\"", place()))?.unwrap_or_default();
        split.spread(&mut cell_fields);
        let mut input = MeshInput { other_fields, other_cell_fields, ..split.input };
        self.document.part_name(self.number).into_iter().for_each(|name| input.cells.name_part(name));
        Ok(TetMesh { positions, fields, tets: split.tets, cell_fields, input, ..TetMesh::default() })
    }

    /// The fields in a section, each of `tuples` values, and the names of those that are not asked for.
    pub fn fields(&self, section: &str, tuples: usize) -> Result<[Vec<Field>; 2], ReadError> {
        self.collect(Collector::new(self.options), section, tuples)
    }

    fn collect(
        &self,
        collector: Collector<'_>,
        section: &str,
        tuples: usize,
    ) -> Result<[Vec<Field>; 2], ReadError> {
        self.collect_by(collector, section, &mut |array, components| {
            self.expect_numbers(tuples.saturating_mul(components)).at(|| array.place())?;
            self.document.floats(array, tuples, components).at(|| array.place())
        })
    }

    /// The fields in a section, whose values `values` reads, given how many components there are.
    pub fn collect_by<E: From<ReadError>>(
        &self,
        mut collector: Collector<'_>,
        section: &str,
        values: ReadArray<'_, E>,
    ) -> Result<[Vec<Field>; 2], E> {
        for array in self.piece.section(section).filter(|array| is_field(array)) {
            let Some(number) = array.number_type() else { continue };
            let components = array.components().at(|| array.place())?;
            let Some(claim) = collector.claim(array.name(), components).at(|| array.place())? else {
                continue;
            };
            collector
                .fill(claim, values(array, components)?, number.is_integer(), array.unit())
                .at(|| array.place())?;
        }
        Ok([collector.fields, collector.others])
    }

    /// The fields at cells, beside these at points, as far as the options ask for them.
    pub fn cell_fields(&self, cells: usize, fields: &[Field]) -> Result<[Vec<Field>; 2], ReadError> {
        match self.options.cells {
            CellData::LeaveOut => Ok([Vec::new(), Vec::new()]),
            CellData::Names => Ok([self.field_names("CellData")?, Vec::new()]),
            CellData::Values => self.collect(Collector::at_cells(self.options, fields), "CellData", cells),
        }
    }

    /// The fields in a section without their values.
    pub fn field_names(&self, section: &str) -> Result<Vec<Field>, ReadError> {
        let mut collector = Collector::of_names();
        for array in self.piece.section(section).filter(|array| is_field(array)) {
            let components = array.components().at(|| array.place())?;
            if let Some(claim) = collector.claim(array.name(), components).at(|| array.place())? {
                collector.keep_names(claim, array.unit());
            }
        }
        Ok(collector.fields)
    }

    /// The array of the points, which there must be where there are some.
    pub fn points_array(&self) -> Result<&Array<'_>, ReadError> {
        let missing = || ReadReason::Missing("the array of <Points>".into());
        let array = self.piece.section("Points").next().ok_or_else(missing).at(|| self.place())?;
        let components = array.components().at(|| array.place())?;
        expect_count("components of the points", 3_u64, components).at(|| array.place())?;
        Ok(array)
    }

    pub fn points(&self, points: usize) -> Result<Vec<[f64; 3]>, ReadError> {
        if points == 0 && self.piece.section("Points").next().is_none() {
            return Ok(Vec::new());
        }
        let array = self.points_array()?;
        self.options.memory.take((points as u64).saturating_mul(24)).at(|| array.place())?;
        self.expect_numbers(points.saturating_mul(3)).at(|| array.place())?;
        let values = self.document.floats(array, points, 3).at(|| array.place())?;
        Ok(points_from(&values))
    }

    /// The cells; none if the piece has points alone.
    fn cells(&self, cells: usize) -> Result<Option<CellList<'_>>, ReadError> {
        if cells == 0 {
            return Ok(Some(CellList::default()));
        }
        let types = self.of_cells("types")?;
        // Types and ends.
        self.expect_numbers(cells.saturating_mul(2)).at(|| types.place())?;
        let mut kinds = self.document.integers(types, cells).at(|| types.place())?;
        if cells::are_points(&kinds) {
            return Ok(None);
        }
        cells::most_tets(&kinds).at(|| types.place())?;
        let offsets = self.of_cells("offsets")?;
        let ends = self.document.integers(offsets, cells).at(|| offsets.place())?;
        let is_old = self.document.is_before([2, 1]);
        let swapped =
            is_old.then(|| kinds.iter().map(|kind| *kind == cell_types::LAGRANGE_HEXAHEDRON).collect());
        cells::resolve_orders(&mut kinds, &ends);
        cells::most_tets(&kinds).at(|| types.place())?;
        let length = cells::checked_ends(&kinds, &ends).at(|| offsets.place())?;
        let connectivity = self.of_cells("connectivity")?;
        self.expect_numbers(length).at(|| connectivity.place())?;
        let list = self.document.indices(connectivity, length).at(|| connectivity.place())?;
        let mut list = CellList { types: kinds, ends, connectivity: list };
        if list.types.contains(&cell_types::POLYHEDRON) {
            let faces = self.faces(cells)?;
            list = list.with_faces(&faces).at(|| format!("{}, <Cells>", self.place()))?;
        }
        if let Some(swapped) = swapped {
            list.order_as_before_9(swapped);
        }
        if let Some(ghosts) = self.ghosts("CellData", cells)? {
            list.leave_out(&ghosts);
        }
        Ok(Some(list))
    }

    /// An array of <Cells>.
    pub fn of_cells(&self, name: &str) -> Result<&Array<'_>, ReadError> {
        let found = self.piece.section("Cells").find(|a| a.name() == name);
        let missing = || ReadReason::Missing(format!("array \"{name}\" of <Cells>"));
        found.ok_or_else(missing).at(|| self.place())
    }

    /// The faces of polyhedra, in the arrays that VTK writes since version 9.4, or in the older ones.
    fn faces(&self, cells: usize) -> Result<FaceLists, ReadError> {
        let numbers = |name: &str, count: Option<usize>| {
            let array = self.of_cells(name)?;
            let numbers = || {
                let count = count.map_or_else(|| self.document.count_of(array), Ok)?;
                self.expect_numbers(count)?;
                self.document.integers(array, count)
            };
            numbers().at(|| array.place())
        };
        let is_new = self.piece.section("Cells").any(|array| array.name() == "polyhedron_to_faces");
        if !is_new {
            return Ok(FaceLists {
                numbers: numbers("faces", None)?,
                ends: numbers("faceoffsets", Some(cells))?,
            });
        }
        let faces = SharedFaces {
            connectivity: numbers("face_connectivity", None)?,
            ends: numbers("face_offsets", None)?,
            of_cells: numbers("polyhedron_to_faces", None)?,
            cell_ends: numbers("polyhedron_offsets", Some(cells))?,
        };
        faces.lists().at(|| format!("{}, <Cells>", self.place()))
    }

    /// Checks that there is room for so many numbers, unpacked and decoded, which are at most eight bytes each.
    fn expect_numbers(&self, count: usize) -> Result<(), ReadReason> {
        self.options.memory.expect((count as u64).saturating_mul(16))
    }

    /// The tetrahedra at most that the cells become.
    pub fn most_tets(&self) -> Result<u64, ReadError> {
        let cells = self.piece.attributes.count("NumberOfCells").at(|| self.place())?;
        let Some(types) = self.piece.section("Cells").find(|a| a.name() == "types").filter(|_| cells > 0)
        else {
            return Ok(0);
        };
        let mut kinds = self.document.integers(types, cells).at(|| types.place())?;
        let mut polyhedra = 0;
        if cells::depend_on_points(&kinds)
            && let Some(offsets) = self.piece.section("Cells").find(|a| a.name() == "offsets")
        {
            let ends = self.document.integers(offsets, cells).at(|| offsets.place())?;
            cells::resolve_orders(&mut kinds, &ends);
            polyhedra = polyhedra::most_tets(&kinds, &ends);
        }
        if cells::are_points(&kinds) {
            return Ok(0);
        }
        Ok(cells::most_tets(&kinds).at(|| types.place())?.saturating_add(polyhedra))
    }

    /// The flags by which VTK marks points or cells that are hidden, or another piece's, if there are any.
    pub fn ghosts(&self, section: &str, tuples: usize) -> Result<Option<Vec<i64>>, ReadError> {
        for array in self.piece.section(section) {
            let to_flags: fn(i64) -> i64 = match array.name() {
                GHOST_TYPE => |flags| flags,
                // Old files say how far a cell is from the piece.
                GHOST_LEVELS => |levels| i64::from(levels != 0),
                _ => continue,
            };
            let flags = self.document.integers(array, tuples).at(|| array.place())?;
            return Ok(Some(flags.into_iter().map(to_flags).collect()));
        }
        Ok(None)
    }
}

/// Whether an array is a field, not a mark of VTK's.
fn is_field(array: &Array<'_>) -> bool {
    array.number_type().is_some() && ![GHOST_TYPE, GHOST_LEVELS].contains(&array.name())
}

/// Appends a piece, which must have the fields of those before it.
pub(super) fn join(mesh: &mut TetMesh, part: TetMesh, is_first: bool) -> Result<(), ReadReason> {
    if is_first {
        *mesh = part;
        return Ok(());
    }
    join_fields(&mut mesh.fields, part.fields)?;
    join_fields(&mut mesh.cell_fields, part.cell_fields)?;
    mesh.input.append(part.input);
    mesh.positions.extend(part.positions);
    mesh.tets.extend(part.tets);
    Ok(())
}

fn join_fields(fields: &mut [Field], more: Vec<Field>) -> Result<(), ReadReason> {
    let more = in_order(fields, more)?;
    for (field, Field { values, integer, .. }) in fields.iter_mut().zip(more) {
        field.values.extend(values);
        field.integer &= integer;
    }
    Ok(())
}

/// The fields of the first of several pieces, without values, at points and at cells.
#[derive(Default)]
pub(super) struct FirstFields(Option<[Vec<Field>; 2]>);

impl FirstFields {
    /// Puts the fields of a piece in the order of those of the first one, which must be the same.
    pub fn order(&mut self, mesh: &mut TetMesh) -> Result<(), ReadReason> {
        let own = [&mut mesh.fields, &mut mesh.cell_fields];
        let Some(first) = &self.0 else {
            self.0 = Some(own.map(|fields| fields.iter().map(Field::without_values).collect()));
            return Ok(());
        };
        for (first, fields) in first.iter().zip(own) {
            *fields = in_order(first, std::mem::take(fields))?;
        }
        Ok(())
    }
}

/// The fields of a piece in the order of those of the first one, which must be the same.
fn in_order(first: &[Field], mut own: Vec<Field>) -> Result<Vec<Field>, ReadReason> {
    let missing = |what: String| Err(ReadReason::Missing(what));
    if let Some(extra) = own.iter().find(|field| !first.iter().any(|known| known.name == field.name)) {
        return missing(format!("array \"{}\", which this piece has, in an earlier piece", extra.name));
    }
    let mut ordered = Vec::with_capacity(first.len());
    for known in first {
        let Some(at) = own.iter().position(|field| field.name == known.name) else {
            return missing(format!("array \"{}\", which earlier pieces have,", known.name));
        };
        // Units and parts of vectors are those of the first piece.
        let Field { values, integer, .. } = own.swap_remove(at);
        ordered.push(Field { values, integer, ..known.without_values() });
    }
    Ok(ordered)
}

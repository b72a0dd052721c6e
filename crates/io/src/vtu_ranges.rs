//! VTK XML unstructured grids by ranges of cells: what the file is on a disk is read by parts, but for its XML text.

use std::ops::Range;
use std::path::Path;

use crate::cells::Indices;
use crate::error::{At, ReadError, ReadReason, Stop};
use crate::fields::{Collector, set_time};
use crate::number::points_from;
use crate::ranges::{Before, Each, Grid, InPieces, Ranges, Rows};
use crate::stored::Stored;
use crate::vtu::{PieceReader, readers};
use crate::xml::Array;
use crate::xml_on_disk::{XmlFile, expect_no_ghosts};
use crate::{CellData, PieceCounts, ReadOptions};
use tetralod::mesh::{MeshInput, TetMesh};

/// A file whose text was read.
#[derive(Debug)]
pub(super) struct VtuFile {
    xml: XmlFile,
    /// Those of each of its pieces.
    pieces: Vec<Ranges>,
    points: u64,
    fields: u64,
}

impl VtuFile {
    /// Opens a file whose ranges become so many tetrahedra at most, or as many as take the least memory; none if it is another one.
    pub fn open(path: &Path, options: &ReadOptions, most: Option<u64>) -> Result<Option<Self>, Stop> {
        let Some(xml) = XmlFile::open(path, "vtu")? else { return Ok(None) };
        let mut opened = Self { xml, pieces: Vec::new(), points: 0, fields: 0 };
        let document = opened.xml.document()?;
        let (mut pieces, mut points, mut fields) = (Vec::new(), 0, 0);
        for reader in readers(&document, options) {
            let grid = opened.grid(&reader)?;
            pieces.push(Ranges::of(&grid, most)?);
            // What cannot be read by parts is found before any is.
            let some = grid.fields(&Rows::Range(0..grid.counts[0].min(1)), options)?;
            points += grid.counts[0];
            fields = some.fields.len() as u64;
        }
        drop(document);
        (opened.pieces, opened.points, opened.fields) = (pieces, points, fields);
        Ok(Some(opened))
    }

    /// All ranges.
    pub fn ranges(&self) -> impl Iterator<Item = &Range<u64>> {
        self.pieces.iter().flat_map(|piece| &piece.ranges)
    }

    fn grid<'a>(&'a self, reader: &'a PieceReader<'a, 'a>) -> Result<VtuGrid<'a>, Stop> {
        let count =
            |name: &str| reader.piece.attributes.count(name).map(|count| count as u64).at(|| reader.place());
        let counts = [count("NumberOfPoints")?, count("NumberOfCells")?];
        expect_no_ghosts(reader)?;
        if counts.contains(&0) {
            return Err(Stop::Whole("it has no cells"));
        }
        let open = |array: &'a Array<'a>, count: u64| {
            let stored = self.xml.stored(reader.document, array, count);
            stored.map(|stored| Of { array, stored })
        };
        let [points, cells] = counts;
        let ends = open(reader.of_cells("offsets")?, cells)?;
        let last = ends.stored.integers(cells - 1..cells).at(|| ends.array.place())?;
        let length = u64::try_from(last.first().copied().unwrap_or(0));
        let length = length.map_err(|_| ReadReason::Syntax(format!("the last cell ends at {last:?}")));
        let length = length.at(|| ends.array.place())?;
        Ok(VtuGrid {
            file: self,
            reader,
            counts,
            types: open(reader.of_cells("types")?, cells)?,
            connectivity: open(reader.of_cells("connectivity")?, length)?,
            positions: open(reader.points_array()?, points.saturating_mul(3))?,
            ends,
        })
    }
}

impl InPieces for VtuFile {
    fn counts(&self) -> PieceCounts {
        let counts = PieceCounts {
            points: self.points,
            tetrahedra: self.pieces.iter().map(|piece| piece.tets).sum(),
            pieces: self.ranges().count() as u64,
            largest: self.pieces.iter().map(|piece| piece.largest).max().unwrap_or(0),
            fields: self.fields,
            ..PieceCounts::default()
        };
        counts.in_layers()
    }

    fn for_each(&self, options: &ReadOptions, each: Each<'_>) -> Result<(), Stop> {
        let document = self.xml.document()?;
        let time = self.xml.time(&document);
        let mut before = Before::default();
        for (reader, ranges) in readers(&document, options).zip(&self.pieces) {
            let grid = self.grid(&reader)?;
            before.for_each(&grid, &ranges.ranges, options, &mut |mut piece| {
                set_time(&mut piece.mesh, time);
                each(piece)
            })?;
        }
        Ok(())
    }
}

/// An array of numbers.
struct Of<'a> {
    array: &'a Array<'a>,
    stored: Stored<'a>,
}

/// A piece of a file.
struct VtuGrid<'a> {
    file: &'a VtuFile,
    reader: &'a PieceReader<'a, 'a>,
    counts: [u64; 2],
    types: Of<'a>,
    ends: Of<'a>,
    connectivity: Of<'a>,
    positions: Of<'a>,
}

impl Of<'_> {
    fn integers(&self, range: Range<u64>) -> Result<Vec<i64>, ReadError> {
        self.stored.integers(range).at(|| self.array.place())
    }
}

/// The values in some rows of an array.
fn rows_of(stored: &Stored<'_>, rows: &Rows<'_>, components: usize) -> Result<Vec<f64>, ReadReason> {
    let each = components as u64;
    rows.values(components, |range| stored.floats(range.start * each..range.end * each))
}

impl Grid for VtuGrid<'_> {
    fn counts(&self) -> [u64; 2] {
        self.counts
    }

    fn types(&self, cells: Range<u64>) -> Result<Vec<i64>, ReadError> {
        self.types.integers(cells)
    }

    fn ends(&self, cells: Range<u64>) -> Result<Vec<i64>, ReadError> {
        self.ends.integers(cells)
    }

    fn points_of_cells(&self, part: Range<u64>) -> Result<Indices<'static>, ReadError> {
        let Of { array, stored } = &self.connectivity;
        stored.indices(part).at(|| array.place())
    }

    fn positions(&self, rows: &Rows<'_>) -> Result<Vec<[f64; 3]>, ReadError> {
        let Of { array, stored } = &self.positions;
        Ok(points_from(&rows_of(stored, rows, 3).at(|| array.place())?))
    }

    fn fields(&self, rows: &Rows<'_>, options: &ReadOptions) -> Result<TetMesh, Stop> {
        let Self { file, reader, counts, .. } = self;
        let read = &mut |array: &Array<'_>, components: usize| {
            let count = counts[0].saturating_mul(components as u64);
            let stored = file.xml.stored(reader.document, array, count)?;
            rows_of(&stored, rows, components).map_err(|reason| Stop::from(reason).at(|| array.place()))
        };
        let [fields, other_fields] = reader.collect_by(Collector::new(options), "PointData", read)?;
        // At cells there are names alone.
        let cell_fields = match options.cells {
            CellData::LeaveOut => Vec::new(),
            _ => reader.field_names("CellData")?,
        };
        let input = MeshInput { other_fields, ..MeshInput::default() };
        Ok(TetMesh { fields, cell_fields, input, ..TetMesh::default() })
    }

    fn place(&self, of: &str) -> String {
        let piece = self.reader.place();
        match of {
            "PointData" | "Points" => format!("{piece}, <{of}>"),
            array => format!("{piece}, <Cells>, array \"{array}\""),
        }
    }
}

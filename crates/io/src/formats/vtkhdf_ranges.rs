//! Unstructured grids of VTKHDF piece by piece: the partitions of a file, or ranges of the cells of its only one.

use std::ops::Range;
use std::path::Path;

use hdf5_reader::{Dataset, Hdf5File};

use crate::cells::Indices;
use crate::error::{At, ReadError, ReadReason, Stop, expect_count};
use crate::fields::set_time;
use crate::formats::hdf5;
use crate::formats::hdf5_values::{floats, integers, row_length};
use crate::formats::vtkhdf::{Piece, ROOT, Reader, UNSTRUCTURED};
use crate::ghosts::GHOST_TYPE;
use crate::number::points_from;
use crate::pvtu::{Identity, bits};
use crate::ranges::{Before, Each, Grid, InPieces, Ranges, Rows};
use crate::shared_points::{SharedPoints, hash};
use crate::{PieceCounts, ReadOptions};
use tetralod::mesh::{MeshInput, TetMesh};

/// A file with an unstructured grid.
pub(crate) struct HdfFile {
    file: Hdf5File,
    pieces: Vec<Piece>,
    /// Those of the only piece.
    ranges: Vec<Range<u64>>,
    counts: PieceCounts,
}

impl std::fmt::Debug for HdfFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("HdfFile").field("pieces", &self.pieces).finish_non_exhaustive()
    }
}

impl HdfFile {
    /// Opens a file whose ranges become so many tetrahedra at most, or as many as take the least memory; none if it is another one, or of one
    /// range.
    pub fn open(path: &Path, options: &ReadOptions, most: Option<u64>) -> Result<Option<Self>, Stop> {
        let Some(file) = hdf5::open_vtkhdf(path, options)? else { return Ok(None) };
        let (reader, kind, _) = Reader::of(&file, options)?;
        if kind != UNSTRUCTURED {
            return Ok(None);
        }
        let pieces = reader.pieces().at(|| ROOT.to_owned())?;
        let (mut counts, mut ranges) = (PieceCounts::default(), Vec::new());
        for (number, piece) in pieces.iter().enumerate() {
            let grid = HdfGrid { reader: &reader, piece, number };
            let [points, cells] = grid.counts();
            counts.points = counts.points.saturating_add(points);
            if cells == 0 {
                continue;
            }
            let most = if pieces.len() == 1 { most } else { Some(u64::MAX) };
            let of_piece = Ranges::of(&grid, most)?;
            counts.tetrahedra = counts.tetrahedra.saturating_add(of_piece.tets);
            counts.largest = counts.largest.max(of_piece.largest);
            ranges.extend(of_piece.ranges);
            let some = grid.fields(&Rows::Range(0..points.min(1)), options)?;
            counts.fields = some.fields.len() as u64;
        }
        if let [piece] = &pieces[..] {
            HdfGrid { reader: &reader, piece, number: 0 }.check()?;
        }
        counts.pieces = ranges.len() as u64;
        let counts = if pieces.len() > 1 { counts.in_boxes() } else { counts.in_layers() };
        drop(reader);
        Ok((ranges.len() > 1).then_some(Self { file, pieces, ranges, counts }))
    }

    /// Passes on the partitions of a file with several, each of which has points of its own.
    fn partitions(&self, options: &ReadOptions, each: Each<'_>) -> Result<(), ReadError> {
        let afresh = || ReadOptions { memory: options.memory.afresh(), ..options.clone() };
        let mut hashes = Vec::new();
        for (number, piece) in self.pieces.iter().enumerate() {
            let options = &afresh();
            let (reader, ..) = Reader::of(&self.file, options)?;
            let points = reader.positions(piece).at(|| format!("piece {number}, {ROOT}/Points"))?;
            hashes.extend(points.into_iter().map(bits).map(hash));
        }
        let mut shared = SharedPoints::of(hashes);
        for (number, piece) in self.pieces.iter().enumerate() {
            let options = &afresh();
            let (reader, _, time) = Reader::of(&self.file, options)?;
            let place = || format!("piece {number}, PointData");
            let mut piece =
                shared.read(Identity::Places, &mut |numbers| reader.piece(piece, number, numbers), &place)?;
            set_time(&mut piece.mesh, time);
            each(piece)?;
        }
        Ok(())
    }
}

impl InPieces for HdfFile {
    fn counts(&self) -> PieceCounts {
        self.counts
    }

    fn for_each(&self, options: &ReadOptions, each: Each<'_>) -> Result<(), Stop> {
        let [piece] = &self.pieces[..] else { return Ok(self.partitions(options, each)?) };
        let (reader, _, time) = Reader::of(&self.file, options)?;
        let grid = HdfGrid { reader: &reader, piece, number: 0 };
        Before::default().for_each(&grid, &self.ranges, options, &mut |mut piece| {
            set_time(&mut piece.mesh, time);
            each(piece)
        })
    }
}

/// A piece of a file.
struct HdfGrid<'a> {
    reader: &'a Reader<'a>,
    piece: &'a Piece,
    number: usize,
}

fn shifted(range: &Range<u64>, first: u64) -> Range<u64> {
    range.start.saturating_add(first)..range.end.saturating_add(first)
}

impl HdfGrid<'_> {
    /// Checks what only a whole has.
    fn check(&self) -> Result<(), Stop> {
        for group in ["PointData", "CellData"] {
            let name = format!("{group}/{GHOST_TYPE}");
            if self.reader.dataset_if(&name).at(|| self.place(&name))?.is_some() {
                return Err(Stop::Whole("it marks cells or points as ghosts"));
            }
        }
        let Piece { offsets, ids, .. } = self.piece;
        let ends = self.reader.dataset("Offsets").and_then(|ends| {
            let first = integers(&ends, offsets.start..offsets.start.saturating_add(1))?;
            let last = integers(&ends, offsets.end.saturating_sub(1)..offsets.end)?;
            if first.first() != Some(&0) {
                return Err(ReadReason::Syntax("the first cell of a piece does not begin at 0".into()));
            }
            let last = last.first().and_then(|&end| u64::try_from(end).ok()).unwrap_or(u64::MAX);
            expect_count("points of cells", ids.end - ids.start, last)
        });
        Ok(ends.at(|| self.place("Offsets"))?)
    }
}

impl Grid for HdfGrid<'_> {
    fn counts(&self) -> [u64; 2] {
        [&self.piece.points, &self.piece.cells].map(|range| range.end - range.start)
    }

    fn types(&self, cells: Range<u64>) -> Result<Vec<i64>, ReadError> {
        let types = self.reader.dataset("Types");
        types
            .and_then(|types| integers(&types, shifted(&cells, self.piece.cells.start)))
            .at(|| self.place("Types"))
    }

    fn ends(&self, cells: Range<u64>) -> Result<Vec<i64>, ReadError> {
        let rows = shifted(&cells, self.piece.offsets.start.saturating_add(1));
        self.reader.dataset("Offsets").and_then(|ends| integers(&ends, rows)).at(|| self.place("Offsets"))
    }

    fn points_of_cells(&self, part: Range<u64>) -> Result<Indices<'static>, ReadError> {
        let rows = shifted(&part, self.piece.ids.start);
        let list = self.reader.dataset("Connectivity").and_then(|ids| integers(&ids, rows));
        list.map(Indices::Listed).at(|| self.place("Connectivity"))
    }

    fn positions(&self, rows: &Rows<'_>) -> Result<Vec<[f64; 3]>, ReadError> {
        let read = || {
            let points = self.reader.dataset("Points")?;
            expect_count("components of the points", 3_u64, row_length(&points)?)?;
            rows.values(3, |range| floats(&points, shifted(&range, self.piece.points.start)))
        };
        Ok(points_from(&read().at(|| self.place("Points"))?))
    }

    fn fields(&self, rows: &Rows<'_>, options: &ReadOptions) -> Result<TetMesh, Stop> {
        let (reader, ..) = Reader::of(self.reader.file, options)?;
        let values = |dataset: &Dataset, components: usize| {
            let what = format!("components of \"{}\"", dataset.name());
            expect_count(what, components, row_length(dataset)?)?;
            let name = dataset.name().rsplit('/').next().unwrap_or_default();
            let own = reader.rows_of("PointData", name, self.piece)?;
            rows.values(components, |range| floats(dataset, shifted(&range, own.start)))
        };
        let [fields, other_fields] = reader.collect("PointData", &[], &values)?;
        let [cell_fields, other_cell_fields] = reader.collect("CellData", &fields, &|_, _| Ok(Vec::new()))?;
        let input = MeshInput { other_fields, other_cell_fields, ..MeshInput::default() };
        Ok(TetMesh { fields, cell_fields, input, ..TetMesh::default() })
    }

    fn place(&self, of: &str) -> String {
        let array = match of {
            "types" => "Types",
            "offsets" => "Types, Offsets and Connectivity",
            "connectivity" => "Connectivity",
            other => other,
        };
        format!("piece {}, {ROOT}/{array}", self.number)
    }
}

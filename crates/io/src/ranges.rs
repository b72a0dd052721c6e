//! Unstructured grids by ranges of their cells: the same mesh as that of the whole, of which no more than a range is in memory, and the points
//! that its cells use.
//!
//! At first come all points, some at a time, in their order; then ranges of cells with the points that they use, which are read again.

use std::collections::BTreeMap;
use std::fmt::Debug;
use std::ops::Range;

use crate::cell_shapes::middles;
use crate::cell_types::{POLYHEDRON, VERTICES, is_flat};
use crate::cells::{self, CellList, Indices, Split};
use crate::error::{ReadError, ReadReason, Stop};
use crate::numbering::Numbering;
use crate::vtu::{FirstFields, first_number};
use crate::{MemoryLimit, PieceCounts, ReadOptions};
use tetralod::mesh::{MeshPiece, TetMesh};

/// Cells whose types are looked at together, and points that come together.
const CELLS: u64 = 1 << 16;
const POINTS: u64 = 1 << 18;
/// Points between the first and the last of which all are read, though some are not needed.
const NEAR: u64 = 1 << 15;
/// Tetrahedra of a range, at least.
const LEAST_TETS: u64 = 1 << 20;

/// Takes a piece.
pub(super) type Each<'a> = &'a mut dyn FnMut(MeshPiece) -> Result<(), ReadError>;

/// A file whose mesh comes in pieces.
pub(super) trait InPieces: Debug {
    fn counts(&self) -> PieceCounts;
    /// Passes on all pieces.
    fn for_each(&self, options: &ReadOptions, each: Each<'_>) -> Result<(), Stop>;
}

/// A grid of which parts are read.
pub(super) trait Grid {
    /// How many points and cells it has.
    fn counts(&self) -> [u64; 2];
    /// The types of these cells.
    fn types(&self, cells: Range<u64>) -> Result<Vec<i64>, ReadError>;
    /// Where these cells end in the list of the points of all.
    fn ends(&self, cells: Range<u64>) -> Result<Vec<i64>, ReadError>;
    /// A part of that list.
    fn points_of_cells(&self, part: Range<u64>) -> Result<Indices<'static>, ReadError>;
    /// The positions of some points.
    fn positions(&self, rows: &Rows<'_>) -> Result<Vec<[f64; 3]>, ReadError>;
    /// A mesh with the fields at some points alone, as the options ask for them, and what is known of others.
    fn fields(&self, rows: &Rows<'_>, options: &ReadOptions) -> Result<TetMesh, Stop>;
    /// Where an error is: in a section, or an array of cells.
    fn place(&self, of: &str) -> String;
}

/// Some rows of arrays.
pub(super) enum Rows<'a> {
    Range(Range<u64>),
    /// Ascending.
    Listed(&'a [u32]),
}

impl Rows<'_> {
    pub fn len(&self) -> usize {
        match self {
            Self::Range(range) => range.end.saturating_sub(range.start) as usize,
            Self::Listed(list) => list.len(),
        }
    }

    /// The values in these rows, of so many components; `read` reads those in a range of rows.
    pub fn values<E>(
        &self,
        components: usize,
        read: impl Fn(Range<u64>) -> Result<Vec<f64>, E>,
    ) -> Result<Vec<f64>, E> {
        let list = match self {
            Self::Range(range) => return read(range.clone()),
            Self::Listed(list) => *list,
        };
        let mut values = Vec::with_capacity(list.len().saturating_mul(components));
        let mut rest = list;
        while let Some(&first) = rest.first() {
            let first = u64::from(first);
            let (near, later) = rest.split_at(rest.partition_point(|&row| u64::from(row) < first + NEAR));
            let end = near.last().map_or(first, |&last| u64::from(last) + 1);
            let read = read(first..end)?;
            let place = |row: u32| (u64::from(row) - first) as usize * components;
            near.iter().for_each(|&row| values.extend_from_slice(&read[place(row)..place(row) + components]));
            rest = later;
        }
        Ok(values)
    }
}

/// The ranges of cells of a grid, and how many tetrahedra they become at most.
#[derive(Clone, Debug, Default)]
pub(super) struct Ranges {
    pub ranges: Vec<Range<u64>>,
    /// Of all, and of the largest one.
    pub tets: u64,
    pub largest: u64,
}

impl Ranges {
    /// Ranges that become `most` tetrahedra or a few more, or as many as take the least memory if nothing is said.
    pub fn of(grid: &dyn Grid, most: Option<u64>) -> Result<Self, Stop> {
        let [_, cells] = grid.counts();
        let mut counts = BTreeMap::<i64, u64>::new();
        let mut blocks: Vec<(Range<u64>, u64)> = Vec::new();
        for start in (0..cells).step_by(most.unwrap_or(CELLS).clamp(1, CELLS) as usize) {
            let block = start..cells.min(start + most.unwrap_or(CELLS).clamp(1, CELLS));
            let mut types = grid.types(block.clone())?;
            if cells::depend_on_points(&types) {
                let before = end_before(grid, start)?;
                let ends: Vec<i64> =
                    grid.ends(block.clone())?.iter().map(|end| end.saturating_sub(before)).collect();
                cells::resolve_orders(&mut types, &ends);
            }
            let mut tets = 0_u64;
            for (kind, count) in cells::counts_of(&types) {
                *counts.entry(kind).or_insert(0) += count;
                // What is refused is so with all that there is.
                let of_kind = cells::most_tets_of(BTreeMap::from([(kind, count)])).unwrap_or(0);
                tets = tets.saturating_add(of_kind);
            }
            blocks.push((block, tets));
        }
        if counts.contains_key(&POLYHEDRON) {
            return Err(Stop::Whole("it has polyhedra"));
        }
        if counts.keys().all(|kind| VERTICES.contains(kind)) {
            return Err(Stop::Whole("it has no cells"));
        }
        // Where such cells fold, points move, by a measure of the whole.
        if counts.keys().any(|kind| !middles(*kind).is_empty()) {
            return Err(Stop::Whole("it has cells of the second order"));
        }
        let all =
            cells::most_tets_of(counts).map_err(|reason| Stop::from(reason).at(|| grid.place("types")))?;
        let most = most.unwrap_or_else(|| balanced(all));
        let mut found = Self { tets: all, ..Self::default() };
        let mut tets_of_last = u64::MAX;
        for (block, tets) in blocks {
            match found.ranges.last_mut() {
                Some(last) if tets_of_last.saturating_add(tets) <= most => {
                    (last.end, tets_of_last) = (block.end, tets_of_last + tets);
                }
                _ => {
                    found.ranges.push(block);
                    tets_of_last = tets;
                }
            }
            found.largest = found.largest.max(tets_of_last);
        }
        Ok(found)
    }
}

/// So many tetrahedra a range take the least memory, of so many in all: ranges that are layers of a volume have as many points in common
/// as the layer has on its sides, and each of these takes as much as some tetrahedra of a range.
fn balanced(all: u64) -> u64 {
    let ranges = 0.4 * libm::pow(all as f64, 1.0 / 6.0);
    LEAST_TETS.max((all as f64 / ranges) as u64)
}

/// Where the cell before number `cell` ends.
fn end_before(grid: &dyn Grid, cell: u64) -> Result<i64, ReadError> {
    if cell == 0 {
        return Ok(0);
    }
    Ok(grid.ends(cell - 1..cell)?.first().copied().unwrap_or(0))
}

/// What is known of the grids of a file so far.
#[derive(Default)]
pub(super) struct Before {
    points: usize,
    fields: FirstFields,
}

impl Before {
    /// Passes on a grid piece by piece, numbered on behind those before.
    pub fn for_each(
        &mut self,
        grid: &dyn Grid,
        ranges: &[Range<u64>],
        options: &ReadOptions,
        each: Each<'_>,
    ) -> Result<(), Stop> {
        let [points, _] = grid.counts();
        let count = usize::try_from(points).unwrap_or(usize::MAX);
        let first = first_number(self.points, count)
            .map_err(|reason| Stop::from(reason).at(|| grid.place("Points")))?;
        for start in (0..points).step_by(POINTS as usize) {
            let end = points.min(start + POINTS);
            let options = &ReadOptions { memory: options.memory.afresh(), ..options.clone() };
            let mesh = self.points(grid, &Rows::Range(start..end), options)?;
            let number = |point: u64| first + point as u32;
            each(MeshPiece { points: (number(start)..number(end)).collect(), mesh })?;
        }
        for range in ranges {
            let memory = options.memory.afresh();
            let numbering = Numbering::From { first, points: count };
            let split = tets_of(grid, range.clone(), &numbering, &memory)?;
            let (mut tets, input) = (split.tets, split.input);
            let mut numbers: Vec<u32> = tets.as_flattened().to_vec();
            numbers.sort_unstable();
            numbers.dedup();
            // Each is there.
            let place = |number: u32| numbers.binary_search(&number).unwrap_or_default() as u32;
            tets.iter_mut().for_each(|tet| *tet = tet.map(place));
            let rows: Vec<u32> = numbers.iter().map(|number| number - first).collect();
            let mut mesh =
                self.points(grid, &Rows::Listed(&rows), &ReadOptions { memory, ..options.clone() })?;
            mesh.tets = tets;
            (mesh.input.cells, mesh.input.notes) = (input.cells, input.notes);
            each(MeshPiece { points: numbers, mesh })?;
        }
        self.points += count;
        Ok(())
    }

    /// Some points, with their fields.
    fn points(&mut self, grid: &dyn Grid, rows: &Rows<'_>, options: &ReadOptions) -> Result<TetMesh, Stop> {
        let place = || grid.place("PointData");
        options.memory.take(24 * rows.len() as u64).map_err(|reason| Stop::from(reason).at(place))?;
        let mut mesh = grid.fields(rows, options)?;
        mesh.positions = grid.positions(rows)?;
        self.fields.order(&mut mesh).map_err(|reason| Stop::from(reason).at(place))?;
        Ok(mesh)
    }
}

/// The tetrahedra of a range of cells, by the numbers of all points.
fn tets_of(
    grid: &dyn Grid,
    range: Range<u64>,
    numbering: &Numbering,
    memory: &MemoryLimit,
) -> Result<Split, Stop> {
    let at = |reason: ReadReason, of: &str| Stop::from(reason).at(|| grid.place(of));
    // Types, ends and the points of tetrahedra, as they are and as they are decoded.
    memory
        .expect((range.end - range.start).saturating_mul(80))
        .map_err(|reason| at(reason, "connectivity"))?;
    let first = range.start;
    let mut types = grid.types(range.clone())?;
    let start = end_before(grid, first)?;
    let mut ends = grid.ends(range)?;
    let in_list = |end: i64| {
        u64::try_from(end).map_err(|_| at(ReadReason::Syntax(format!("a cell ends at {end}")), "offsets"))
    };
    let begun = in_list(start)?;
    let own: Vec<i64> = ends.iter().map(|end| end.saturating_sub(start)).collect();
    cells::resolve_orders(&mut types, &own);
    let end = cells::checked_range(&types, &ends, (first, start)).map_err(|reason| at(reason, "offsets"))?;
    ends = own;
    if types.iter().all(|kind| is_flat(*kind)) {
        let mut split = Split::default();
        cells::leave_out(&types, &mut split.input);
        return Ok(split);
    }
    let connectivity = grid.points_of_cells(begun..in_list(end)?)?;
    let split = CellList { types, ends, connectivity }.split(numbering, &mut Vec::new(), &mut [], memory);
    split.map_err(|reason| at(reason.with_cell(|cell| first.saturating_add(cell)), "connectivity"))
}

//! Cells as files list them, to tetrahedra.
//!
//! Cells with a volume are split by the recipes of `cell_shapes`, and those that list their faces by `polyhedra`; those without one
//! (vertices, lines, polygons), which meshers write beside them for boundaries, are left out. What cannot be split is refused, counted by
//! type.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::mem::take;
use std::ops::Range;

use crate::MemoryLimit;
use crate::cell_shapes::{PYRAMID_14, Recipe, middles, recipe};
use crate::cell_types::{ANY_ORDER, ANY_ORDERS, GHOST, HIDDEN, POLYHEDRON, TETRAHEDRON, VERTICES, is_flat};
use crate::error::{ReadReason, cell_name, names};
use crate::ghosts::{GHOST_CELL, HIDDEN_CELL};
use crate::number::NumberType;
use crate::numbering::Numbering;
use crate::polyhedra::{self, FaceLists, Splitter, TakeFaces};
use tetralod::mesh::{BitSet, CellNumbers, Field, MeshInput, Note};

/// Cells of any order that are those of another type: type, points, and that one.
const SAME_AS: [(i64, i64, i64); 12] = [
    (71, 4, 10),
    (71, 10, 24),
    (72, 8, 12),
    (72, 27, 29),
    (73, 6, 13),
    (73, 18, 32),
    (74, 5, 14),
    (74, 14, PYRAMID_14),
    (78, 4, 10),
    (79, 8, 12),
    (80, 6, 13),
    (81, 5, 14),
];

/// Whether the number of points of cells of these types says what they are, or how many tetrahedra they become.
pub(super) fn depend_on_points(types: &[i64]) -> bool {
    types.iter().any(|kind| ANY_ORDERS.contains(kind) || *kind == POLYHEDRON)
}

/// Gives cells of any order the types that they have with their number of points; those of a higher order get a number of our own.
pub(super) fn resolve_orders(types: &mut [i64], ends: &[i64]) {
    let mut start = 0;
    for (kind, &end) in types.iter_mut().zip(ends) {
        let points = end.saturating_sub(start);
        start = end;
        if ANY_ORDERS.contains(kind) {
            let same = SAME_AS.iter().find(|(of, count, _)| (*of, *count) == (*kind, points));
            *kind = same.map_or(*kind * ANY_ORDER + points.clamp(0, ANY_ORDER - 1), |(.., same)| *same);
        }
    }
}

/// Whether the cells are vertices and poly-vertices alone, as of data sets that are only points.
pub(super) fn are_points(types: &[i64]) -> bool {
    types.iter().all(|t| VERTICES.contains(t))
}

/// How many points a cell without a volume has, where that follows from its type.
fn points_of_flat(kind: i64) -> Option<i64> {
    let known = [(1, 1), (3, 2), (5, 3), (8, 4), (9, 4), (21, 3), (22, 6), (23, 8), (28, 9)];
    known.iter().find(|(flat, _)| *flat == kind).map(|(_, points)| *points)
}

/// The tetrahedra at most that cells of these types become. Refuses types that cannot be split, and cells none of which has a
/// volume, with the number of each type. Polyhedra are not counted: their types do not say how many those become.
pub(super) fn most_tets(types: &[i64]) -> Result<u64, ReadReason> {
    most_tets_of(counts_of(types))
}

/// The same of so many cells of each type.
pub(super) fn most_tets_of(counts: BTreeMap<i64, u64>) -> Result<u64, ReadReason> {
    let mut tets = 0_u64;
    for (&kind, &count) in &counts {
        match recipe(kind) {
            Some(recipe) => tets = tets.saturating_add(count.saturating_mul(recipe.most_tets() as u64)),
            // How many a cell of any order has is known with its points: the most of the second order.
            None if ANY_ORDERS.contains(&kind) => tets = tets.saturating_add(count.saturating_mul(48)),
            None if is_flat(kind) || kind == POLYHEDRON => {}
            None => return Err(ReadReason::CellTypes(counts.into_iter().collect())),
        }
    }
    if tets == 0 && !counts.is_empty() && !counts.contains_key(&POLYHEDRON) {
        return Err(ReadReason::CellTypes(counts.into_iter().collect()));
    }
    Ok(tets)
}

/// How many cells there are of each type.
pub(super) fn counts_of(types: &[i64]) -> BTreeMap<i64, u64> {
    let mut counts = BTreeMap::new();
    // Most files have long runs of one type.
    for run in types.chunk_by(|a, b| a == b) {
        *counts.entry(run[0]).or_insert(0_u64) += run.len() as u64;
    }
    counts
}

/// The number of our own for a cell that VTK's flags leave out.
pub(super) fn left_out_by(flags: i64) -> Option<i64> {
    if flags & HIDDEN_CELL != 0 { Some(HIDDEN) } else { (flags & GHOST_CELL != 0).then_some(GHOST) }
}

/// Notes which cells are left out.
pub(super) fn leave_out(types: &[i64], input: &mut MeshInput) {
    for (kind, count) in counts_of(types).into_iter().filter(|(kind, _)| is_flat(*kind)) {
        let (one, many) = names(kind).unwrap_or(("cell without a volume", "cells without a volume"));
        input.leave_out(count, one, many);
    }
}

/// The points of a cell in the middle of corners, with these.
type Middles = Vec<(u8, &'static [u8])>;

/// Recipes that were looked up, and middles, by type; and the place of the last one, for most cells are of the type of the one before.
#[derive(Default)]
struct Recipes {
    places: BTreeMap<i64, usize>,
    known: Vec<(i64, Option<(Recipe, Middles)>)>,
    last: usize,
}

impl Recipes {
    fn of(&mut self, kind: i64) -> Option<&(Recipe, Middles)> {
        if self.known.get(self.last).is_none_or(|(last, _)| *last != kind) {
            let next = self.known.len();
            self.last = *self.places.entry(kind).or_insert(next);
            if self.last == next {
                self.known.push((kind, recipe(kind).map(|recipe| (recipe, middles(kind)))));
            }
        }
        self.known[self.last].1.as_ref()
    }
}

/// Checks where cells of these types end in the connectivity list; returns its length.
pub(super) fn checked_ends(types: &[i64], ends: &[i64]) -> Result<usize, ReadReason> {
    let length = checked_range(types, ends, (0, 0))?;
    usize::try_from(length).map_err(|_| ReadReason::TooLarge { what: "cells".into(), limit: u64::MAX })
}

/// The same of cells of which the first one has a number, and begins there in the list; returns where the last one ends.
pub(super) fn checked_range(
    types: &[i64],
    ends: &[i64],
    (first, mut start): (u64, i64),
) -> Result<i64, ReadReason> {
    let mut recipes = Recipes::default();
    for (cell, (&kind, &end)) in (first..).zip(types.iter().zip(ends)) {
        let needed =
            recipes.of(kind).map(|(recipe, _)| recipe.points as i64).or_else(|| points_of_flat(kind));
        let found = end.checked_sub(start).filter(|n| *n >= 0);
        let found = found
            .ok_or_else(|| ReadReason::Syntax(format!("cell {cell} ends at {end}, before it begins")))?;
        if let Some(needed) = needed.filter(|needed| *needed != found) {
            let name = cell_name(kind);
            return Err(ReadReason::Syntax(format!(
                "cell {cell}, a {name}, has {found} points, not {needed}"
            )));
        }
        start = end;
    }
    Ok(start)
}

/// The tetrahedra of some cells.
#[derive(Debug, Default)]
pub(super) struct Split {
    pub tets: Vec<[u32; 4]>,
    /// The cell of each tetrahedron; none while they are the same.
    cells: Option<Vec<u32>>,
    /// What is known of the cells.
    pub input: MeshInput,
}

impl Split {
    /// Turns fields at cells into fields at tetrahedra.
    pub fn spread(&self, fields: &mut [Field]) {
        let Some(cells) = &self.cells else { return };
        for field in fields.iter_mut().filter(|field| !field.values.is_empty()) {
            field.values = cells.iter().map(|&cell| field.values[cell as usize]).collect();
        }
    }

    /// Notes that the tetrahedra from number `first` on are those of `cell`.
    fn came_from(&mut self, cell: usize, first: usize) {
        if self.cells.is_none() && first == cell && self.tets.len() == cell + 1 {
            return;
        }
        // As long as cells were tetrahedra, both have the same numbers.
        let cells = self.cells.get_or_insert_with(|| (0..first as u32).collect());
        cells.resize(self.tets.len(), cell as u32);
    }

    /// Keeps for messages which cells the tetrahedra are of.
    fn describe(&mut self, types: &[i64]) {
        leave_out(types, &mut self.input);
        self.input.cells = match &self.cells {
            None => CellNumbers::same(self.tets.len()),
            Some(cells) => CellNumbers::each(cells.clone(), types.len(), runs(types)),
        };
    }
}

/// The first cell of each run of cells of one type, with its name.
fn runs(types: &[i64]) -> Vec<(u32, &'static str)> {
    let mut runs = Vec::new();
    let mut last = None;
    for (cell, &kind) in (0..).zip(types).filter(|(_, kind)| !is_flat(**kind)) {
        if last.replace(kind) != Some(kind) {
            runs.push((cell, names(kind).map_or("cell", |(one, _)| one)));
        }
    }
    runs
}

/// The points of cells, one cell after the other.
#[derive(Debug)]
pub(super) enum Indices<'a> {
    Listed(Vec<i64>),
    /// Integers as a file has them. In a large file they are most of it, and are decoded a few at a time.
    Stored {
        bytes: Cow<'a, [u8]>,
        number: NumberType,
        big: bool,
    },
}

impl Default for Indices<'_> {
    fn default() -> Self {
        Self::Listed(Vec::new())
    }
}

impl Indices<'_> {
    /// Those of a range, as far as there are so many.
    pub fn part(&self, range: Range<usize>) -> Cow<'_, [i64]> {
        let clipped = |len: usize| range.start.min(len)..range.end.min(len).max(range.start.min(len));
        match self {
            Self::Listed(list) => Cow::Borrowed(&list[clipped(list.len())]),
            Self::Stored { bytes, number, big } => {
                let Range { start, end } = clipped(bytes.len() / number.size());
                let bytes = &bytes[start * number.size()..end * number.size()];
                Cow::Owned(number.integers(bytes, *big).unwrap_or_default())
            }
        }
    }

    fn all(&self) -> Cow<'_, [i64]> {
        self.part(0..usize::MAX)
    }

    pub fn into_list(self) -> Vec<i64> {
        match self {
            Self::Listed(list) => list,
            stored => stored.all().into_owned(),
        }
    }
}

/// Cells whose points are decoded at a time.
const BATCH: usize = 1 << 11;

/// Cells as a file lists them, whose ends were checked.
#[derive(Debug, Default)]
pub(super) struct CellList<'a> {
    pub types: Vec<i64>,
    /// Where the points of each cell end in the list of all.
    pub ends: Vec<i64>,
    /// The points of each cell; of polyhedra their faces.
    pub connectivity: Indices<'a>,
}

/// Where a cell ends; where none can if it is negative.
fn end_of(end: &i64) -> usize {
    usize::try_from(*end).unwrap_or(usize::MAX)
}

impl CellList<'_> {
    /// These cells, whose polyhedra list their points, with the faces of those.
    pub fn with_faces(self, faces: &FaceLists) -> Result<Self, ReadReason> {
        let (connectivity, ends) =
            polyhedra::listed(&self.types, &self.ends, &self.connectivity.into_list(), faces)?;
        Ok(Self { types: self.types, ends, connectivity: Indices::Listed(connectivity) })
    }

    /// The tetrahedra at most that the cells become.
    pub fn most_tets(&self) -> Result<u64, ReadReason> {
        let mut tets = most_tets(&self.types)?;
        if self.types.contains(&POLYHEDRON) {
            let listed = self.connectivity.all();
            let polyhedra = self.solid(&listed).filter(|(cell, _)| self.types[*cell] == POLYHEDRON);
            tets = polyhedra.map(|(_, listed)| polyhedra::triangles(listed)).fold(tets, u64::saturating_add);
        }
        Ok(tets)
    }

    /// Splits the cells, and drops them. Appends the points that polyhedra get to these, and to the values at points.
    pub fn split(
        self,
        numbering: &Numbering,
        positions: &mut Vec<[f64; 3]>,
        fields: &mut [Field],
        memory: &MemoryLimit,
    ) -> Result<Split, ReadReason> {
        let types = &self.types;
        let mut split = Split::default();
        if !types.is_empty() && types.iter().all(|kind| [HIDDEN, GHOST].contains(kind)) {
            split.describe(types);
            return Ok(split);
        }
        let tets = self.most_tets()?;
        let room = usize::try_from(tets).unwrap_or(usize::MAX);
        if types.len() > u32::MAX as usize || room > u32::MAX as usize {
            return Err(ReadReason::TooLarge { what: "cells".into(), limit: u64::from(u32::MAX) });
        }
        // With the number of its cell.
        memory.take(20 * tets)?;
        split.tets.reserve_exact(room);
        let mut splitter = types.contains(&POLYHEDRON).then(|| Splitter::new(numbering, positions));
        self.split_all(numbering, splitter.as_mut(), &mut split)?;
        while let Some(splitter) = &mut splitter
            && splitter.again(|each| self.each_with_faces(each))?
        {
            split = Split { tets: take(&mut split.tets), ..Split::default() };
            split.tets.clear();
            self.split_all(numbering, Some(splitter), &mut split)?;
        }
        // Where faces got points in their middle, there are more.
        memory.take(20 * (split.tets.len() as u64).saturating_sub(tets))?;
        if split.tets.len() < split.tets.capacity() / 2 {
            split.tets.shrink_to_fit();
        }
        split.describe(types);
        let added = splitter.map(|splitter| splitter.added).unwrap_or_default();
        if let Some(first) = added.first {
            split.input.notes.push(Note::Added { points: added.len() as u64, cell: first });
        }
        added.append_to(positions, fields, memory)?;
        Ok(split)
    }

    fn split_all(
        &self,
        numbering: &Numbering,
        mut splitter: Option<&mut Splitter<'_>>,
        split: &mut Split,
    ) -> Result<(), ReadReason> {
        let Self { types, ends, connectivity } = self;
        let (mut start, mut recipes) = (0, Recipes::default());
        let (mut vertices, mut known) = (Vec::new(), BitSet::default());
        let (mut points, mut begun) = (Cow::default(), 0);
        for (cell, (&kind, end)) in types.iter().zip(ends).enumerate() {
            if cell % BATCH == 0 {
                let last = &ends[cell..ends.len().min(cell + BATCH)];
                (points, begun) = (connectivity.part(start..last.last().map_or(start, end_of)), start);
            }
            let end = end_of(end);
            let listed = end.checked_sub(begun).and_then(|end| points.get(start - begun..end));
            let listed = listed.ok_or_else(|| ReadReason::Missing(format!("a point of cell {cell}")))?;
            start = end;
            let first = split.tets.len();
            if let Some(splitter) = &mut splitter
                && kind == POLYHEDRON
            {
                splitter.split(cell, listed, &mut split.tets)?;
            } else if let Some((recipe, middles)) = recipes.of(kind) {
                vertices.clear();
                for &point in listed {
                    vertices.push(numbering.of(cell, point)?);
                }
                let is_split = match &mut splitter {
                    Some(splitter) => {
                        splitter.split_beside(cell, recipe, listed, &vertices, &mut split.tets)?
                    }
                    None => false,
                };
                match vertices.as_slice() {
                    _ if is_split => {}
                    &[a, b, c, d] if kind == TETRAHEDRON => split.tets.push([a, b, c, d]),
                    vertices => recipe.split(vertices, &mut split.tets),
                }
                for (point, corners) in middles {
                    let vertex = |p: &u8| vertices[usize::from(*p)];
                    if known.insert(vertex(point)) {
                        split.input.middles.push(vertex(point), corners.iter().map(vertex));
                    }
                }
            }
            split.came_from(cell, first);
        }
        Ok(())
    }

    /// Passes on the faces of all cells that others may share, as those of polyhedra.
    fn each_with_faces(&self, each: TakeFaces<'_>) -> Result<(), ReadReason> {
        let (listed, mut recipes) = (self.connectivity.all(), Recipes::default());
        for (cell, listed) in self.solid(&listed) {
            let kind = self.types[cell];
            if kind == POLYHEDRON {
                each(cell, listed)?;
            } else if let Some(faces) = recipes.of(kind).and_then(|(recipe, _)| recipe.faces(listed)) {
                each(cell, &faces)?;
            }
        }
        Ok(())
    }

    /// Which of so many points cells with a volume use.
    pub fn used(&self, points: usize) -> Vec<bool> {
        let mut used = vec![false; points];
        for (cell, listed) in self.solid(&self.connectivity.all()) {
            let listed = polyhedra::points_of(self.types[cell], listed);
            let listed = listed.filter_map(|point| usize::try_from(point).ok());
            listed.for_each(|point| used.get_mut(point).into_iter().for_each(|used| *used = true));
        }
        used
    }

    /// The cells that have a volume: their numbers and, of these of all, points or faces.
    fn solid<'a>(&self, points: &'a [i64]) -> impl Iterator<Item = (usize, &'a [i64])> {
        let mut start = 0;
        let cells = self.types.iter().zip(&self.ends).enumerate().map(move |(cell, (&kind, end))| {
            let end = end_of(end);
            let listed = points.get(start..end).unwrap_or_default();
            start = end;
            (cell, kind, listed)
        });
        cells.filter(|(_, kind, _)| !is_flat(*kind)).map(|(cell, _, listed)| (cell, listed))
    }

    /// Leaves out the cells that VTK's flags mark as another piece's or as hidden.
    pub fn leave_out(&mut self, flags: &[i64]) {
        for (kind, flags) in self.types.iter_mut().zip(flags).filter(|(kind, _)| !is_flat(**kind)) {
            *kind = left_out_by(*flags).unwrap_or(*kind);
        }
    }

    /// Puts the points of these cells, hexahedra of the second order, into the order that VTK has had since version 9: two edges come in
    /// another one.
    pub fn order_as_before_9(&mut self, cells: Vec<bool>) {
        if !cells.contains(&true) {
            return;
        }
        let (mut start, mut listed) = (0, take(&mut self.connectivity).into_list());
        for (swapped, end) in cells.into_iter().zip(&self.ends) {
            let end = end_of(end);
            if let Some(points @ [_, .., _]) = listed.get_mut(start..end)
                && swapped
                && points.len() == 27
            {
                points.swap(18, 19);
            }
            start = end;
        }
        self.connectivity = Indices::Listed(listed);
    }

    /// Leaves out the cells with a point that is hidden.
    pub fn hide(&mut self, hidden: &[bool]) {
        let is_hidden = |point: i64| {
            usize::try_from(point).ok().and_then(|p| hidden.get(p)).is_some_and(|hidden| *hidden)
        };
        let points = self.connectivity.all();
        let cells: Vec<usize> = self
            .solid(&points)
            .filter(|(cell, listed)| polyhedra::points_of(self.types[*cell], listed).any(is_hidden))
            .map(|(cell, _)| cell)
            .collect();
        cells.into_iter().for_each(|cell| self.types[cell] = HIDDEN);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split_of(cells: CellList<'_>, points: usize) -> Result<Split, ReadReason> {
        let numbering = Numbering::From { first: 100, points };
        cells.split(&numbering, &mut vec![[0.0; 3]; points], &mut [], &MemoryLimit::default())
    }

    #[test]
    fn cells_without_a_volume_are_left_out_and_fields_follow() {
        let types = [5, 10, 12];
        let connectivity: Vec<i64> = (0..3).chain(0..4).chain(0..8).collect();
        let ends = [3, 7, 15];
        assert_eq!(checked_ends(&types, &ends), Ok(15));
        let connectivity = Indices::Listed(connectivity);
        let cells = CellList { types: types.to_vec(), ends: ends.to_vec(), connectivity };
        let split = split_of(cells, 8).unwrap();
        assert_eq!((split.tets.len(), split.tets[0]), (7, [100, 101, 102, 103]));
        let mut fields = [Field::new("m", vec![5.0, 6.0, 7.0]), Field::new("only named", Vec::new())];
        split.spread(&mut fields);
        assert_eq!(fields[0].values, [6.0, 7.0, 7.0, 7.0, 7.0, 7.0, 7.0]);
        assert!(fields[1].values.is_empty());
        let cells = &split.input.cells;
        assert_eq!([0, 6].map(|tet| cells.cell_of(tet).to_string()), ["1 (tetrahedron)", "2 (hexahedron)"]);
        assert_eq!(split.input.lines(), ["left out: 1 triangle"]);
    }

    #[test]
    fn cells_of_any_order_are_known_by_their_points() {
        let (mut types, ends) = ([71, 10, 71, 71, 72], [4, 8, 18, 38, 46]);
        assert!(depend_on_points(&types));
        resolve_orders(&mut types, &ends);
        assert_eq!(types, [10, 10, 24, 710_020, 12]);
        let refused = most_tets(&types).unwrap_err().to_string();
        assert!(refused.contains("1 Lagrange tetrahedron of 20 points"), "{refused}");
    }

    #[test]
    fn cells_that_are_wrong_are_refused() {
        assert_eq!(most_tets(&[10, 41]), Err(ReadReason::CellTypes(vec![(10, 1), (41, 1)])));
        assert_eq!(most_tets(&[5, 5]), Err(ReadReason::CellTypes(vec![(5, 2)])));
        assert_eq!(most_tets(&[]), Ok(0));
        let wrong = |ends: &[i64]| checked_ends(&[10, 12], ends).unwrap_err().to_string();
        assert!(wrong(&[4, 8]).contains("cell 1, a hexahedron, has 4 points, not 8"));
        assert!(wrong(&[5, 13]).contains("cell 0, a tetrahedron, has 5 points, not 4"));
        assert!(wrong(&[-1, 3]).contains("before it begins"));
        let flat = checked_ends(&[1], &[4]).unwrap_err().to_string();
        assert!(flat.contains("cell 0, a vertex, has 4 points, not 1"), "{flat}");
        assert!(wrong(&[4, i64::MIN]).contains("before it begins"));
        let split = |connectivity: &[i64]| {
            let connectivity = Indices::Listed(connectivity.to_vec());
            let cells = CellList { types: vec![10], ends: vec![4], connectivity };
            split_of(cells, 4)
        };
        let missing = |point| split(&[0, 1, 2, point]).unwrap_err();
        assert_eq!(missing(4), ReadReason::MissingPoint { cell: 0, point: 4, points: 4 });
        assert_eq!(missing(-1), ReadReason::MissingPoint { cell: 0, point: -1, points: 4 });
        assert!(matches!(split(&[0, 1]), Err(ReadReason::Missing(_))));
    }
}

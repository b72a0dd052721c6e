//! Cells as files list them, to tetrahedra.
//!
//! Cells with a volume are split by the recipes of `cell_shapes`; those without one (vertices, lines, polygons), which
//! meshers write beside them for boundaries, are left out. What cannot be split is refused, counted by type.

use std::collections::BTreeMap;

use crate::io::cell_shapes::{Recipe, recipe};
use crate::io::error::{ReadReason, cell_name};
use crate::mesh::Field;

/// VTK's number for no cell at all; also that of cells which are to be left out.
pub(super) const EMPTY: i64 = 0;
/// And for a tetrahedron.
pub(super) const TETRAHEDRON: i64 = 10;
/// And for cells that say no more than that there are points.
const VERTICES: [i64; 2] = [1, 2];
/// And for cells without a volume: linear, quadratic, and of any order.
const FLAT: [i64; 22] = [EMPTY, 1, 2, 3, 4, 5, 6, 7, 8, 9, 21, 22, 23, 28, 30, 34, 35, 36, 68, 69, 70, 75];

/// Whether the cells are vertices and poly-vertices alone, as of data sets that are only points.
pub(super) fn are_points(types: &[i64]) -> bool {
    types.iter().all(|t| VERTICES.contains(t))
}

/// How many points a cell without a volume has, where that follows from its type.
fn points_of_flat(kind: i64) -> Option<i64> {
    let known = [(1, 1), (3, 2), (5, 3), (8, 4), (9, 4), (21, 3), (22, 6), (23, 8), (28, 9)];
    known.iter().find(|(flat, _)| *flat == kind).map(|(_, points)| *points)
}

/// Whether a file may list cells of this type, which are then left out.
pub(super) fn is_flat(kind: i64) -> bool {
    FLAT.contains(&kind)
}

/// The tetrahedra at most that cells of these types become. Refuses types that cannot be split, and cells none of which has a
/// volume, with the number of each type.
pub(super) fn most_tets(types: &[i64]) -> Result<u64, ReadReason> {
    let mut counts = BTreeMap::new();
    for kind in types {
        *counts.entry(*kind).or_insert(0_u64) += 1;
    }
    let mut tets = 0_u64;
    for (&kind, &count) in &counts {
        match recipe(kind) {
            Some(recipe) => tets = tets.saturating_add(count.saturating_mul(recipe.most_tets() as u64)),
            None if is_flat(kind) => {}
            None => return Err(ReadReason::CellTypes(counts.into_iter().collect())),
        }
    }
    if tets == 0 && !types.is_empty() {
        return Err(ReadReason::CellTypes(counts.into_iter().collect()));
    }
    Ok(tets)
}

/// Recipes that were looked up.
#[derive(Default)]
struct Recipes(BTreeMap<i64, Option<Recipe>>);

impl Recipes {
    fn of(&mut self, kind: i64) -> Option<&Recipe> {
        self.0.entry(kind).or_insert_with(|| recipe(kind)).as_ref()
    }
}

/// What the points of a part of a file are called in the mesh.
pub(super) enum Numbering {
    /// As many points, of which the first has this number.
    From { first: u32, points: usize },
    /// Each has its own.
    #[cfg(feature = "formats")]
    Each(Vec<u32>),
}

impl Numbering {
    fn points(&self) -> usize {
        match self {
            Self::From { points, .. } => *points,
            #[cfg(feature = "formats")]
            Self::Each(numbers) => numbers.len(),
        }
    }

    fn of(&self, cell: usize, point: i64) -> Result<u32, ReadReason> {
        let index = usize::try_from(point).ok().filter(|p| *p < self.points());
        let number = index.and_then(|p| match self {
            Self::From { first, .. } => u32::try_from(p).ok().and_then(|p| p.checked_add(*first)),
            #[cfg(feature = "formats")]
            Self::Each(numbers) => numbers.get(p).copied(),
        });
        let points = self.points() as u64;
        number.ok_or(ReadReason::MissingPoint { cell: cell as u64, point, points })
    }
}

/// Checks where cells of these types end in the connectivity list; returns its length.
pub(super) fn checked_ends(types: &[i64], ends: &[i64]) -> Result<usize, ReadReason> {
    let (mut start, mut recipes) = (0, Recipes::default());
    for (cell, (&kind, &end)) in types.iter().zip(ends).enumerate() {
        let needed = recipes.of(kind).map(|recipe| recipe.points as i64).or_else(|| points_of_flat(kind));
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
    usize::try_from(start).map_err(|_| ReadReason::TooLarge { what: "cells".into(), limit: u64::MAX })
}

/// The tetrahedra of some cells.
#[derive(Debug, Default)]
pub(super) struct Split {
    pub tets: Vec<[u32; 4]>,
    /// The cell of each tetrahedron; none while they are the same.
    cells: Option<Vec<u32>>,
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
}

/// Cells as a file lists them, whose ends were checked.
#[derive(Debug, Default)]
pub(super) struct CellList {
    pub types: Vec<i64>,
    /// Where the points of each cell end in the list of all.
    pub ends: Vec<i64>,
    pub connectivity: Vec<i64>,
}

impl CellList {
    /// Splits the cells, and drops them.
    pub fn split(self, numbering: &Numbering) -> Result<Split, ReadReason> {
        split(&self, numbering)
    }
}

fn split(
    CellList { types, ends, connectivity }: &CellList,
    numbering: &Numbering,
) -> Result<Split, ReadReason> {
    let tets = most_tets(types)?;
    let room = usize::try_from(tets).unwrap_or(usize::MAX);
    if types.len() > u32::MAX as usize || room > u32::MAX as usize {
        return Err(ReadReason::TooLarge { what: "cells".into(), limit: u64::from(u32::MAX) });
    }
    let mut split = Split { tets: Vec::with_capacity(room), cells: None };
    let (mut start, mut recipes) = (0, Recipes::default());
    let mut vertices = Vec::new();
    for (cell, (&kind, &end)) in types.iter().zip(ends).enumerate() {
        let end = usize::try_from(end).unwrap_or(usize::MAX);
        let listed = connectivity.get(start..end);
        let listed = listed.ok_or_else(|| ReadReason::Missing(format!("a point of cell {cell}")))?;
        start = end;
        let first = split.tets.len();
        if let Some(recipe) = recipes.of(kind) {
            vertices.clear();
            for &point in listed {
                vertices.push(numbering.of(cell, point)?);
            }
            match vertices.as_slice() {
                &[a, b, c, d] if kind == TETRAHEDRON => split.tets.push([a, b, c, d]),
                vertices => recipe.split(vertices, &mut split.tets),
            }
        }
        split.came_from(cell, first);
    }
    if split.tets.len() < split.tets.capacity() / 2 {
        split.tets.shrink_to_fit();
    }
    Ok(split)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbering(points: usize) -> Numbering {
        Numbering::From { first: 100, points }
    }

    #[test]
    fn cells_without_a_volume_are_left_out_and_fields_follow() {
        let types = [5, 10, 12];
        let connectivity: Vec<i64> = (0..3).chain(0..4).chain(0..8).collect();
        let ends = [3, 7, 15];
        assert_eq!(checked_ends(&types, &ends), Ok(15));
        let cells = CellList { types: types.to_vec(), ends: ends.to_vec(), connectivity };
        let split = cells.split(&numbering(8)).unwrap();
        assert_eq!((split.tets.len(), split.tets[0]), (7, [100, 101, 102, 103]));
        let mut fields = [Field::new("m", vec![5.0, 6.0, 7.0]), Field::new("only named", Vec::new())];
        split.spread(&mut fields);
        assert_eq!(fields[0].values, [6.0, 7.0, 7.0, 7.0, 7.0, 7.0, 7.0]);
        assert!(fields[1].values.is_empty());
    }

    #[test]
    fn cells_that_are_wrong_are_refused() {
        assert_eq!(most_tets(&[10, 42]), Err(ReadReason::CellTypes(vec![(10, 1), (42, 1)])));
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
            let cells = CellList { types: vec![10], ends: vec![4], connectivity: connectivity.to_vec() };
            cells.split(&numbering(4))
        };
        let missing = |point| split(&[0, 1, 2, point]).unwrap_err();
        assert_eq!(missing(4), ReadReason::MissingPoint { cell: 0, point: 4, points: 4 });
        assert_eq!(missing(-1), ReadReason::MissingPoint { cell: 0, point: -1, points: 4 });
        assert!(matches!(split(&[0, 1]), Err(ReadReason::Missing(_))));
    }
}

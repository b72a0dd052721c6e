//! Cells as files list them, to tetrahedra. Anything else is refused, counted by type.

use std::collections::BTreeMap;

use crate::io::error::ReadReason;

/// VTK's number for a tetrahedron.
const TETRAHEDRON: i64 = 10;
/// And for cells that say no more than that there are points.
const VERTICES: [i64; 2] = [1, 2];

/// Whether the cells are vertices and poly-vertices alone, as of data sets that are only points.
pub(super) fn are_points(types: &[i64]) -> bool {
    types.iter().all(|t| VERTICES.contains(t))
}

/// Refuses cell types other than tetrahedra, all of them counted.
pub(super) fn only_tetrahedra(types: &[i64]) -> Result<(), ReadReason> {
    if types.iter().all(|t| *t == TETRAHEDRON) {
        return Ok(());
    }
    let mut counts = BTreeMap::new();
    for kind in types {
        *counts.entry(*kind).or_insert(0_u64) += 1;
    }
    Err(ReadReason::NotTetrahedra(counts.into_iter().collect()))
}

/// Checks that the ends of the cells in the connectivity list are those of tetrahedra.
pub(super) fn ends_of_tetrahedra(ends: &[i64]) -> Result<(), ReadReason> {
    match (1_i64..).zip(ends).find(|(i, end)| **end != 4 * i) {
        None => Ok(()),
        Some((i, _)) => Err(ReadReason::Syntax(format!("tetrahedron {} does not have four points", i - 1))),
    }
}

/// Tetrahedra from a list of four indices each; `first` is the index of the first of `points` points.
pub(super) fn tetrahedra(
    connectivity: &[i64],
    points: usize,
    first: u32,
) -> Result<Vec<[u32; 4]>, ReadReason> {
    let (cells, _) = connectivity.as_chunks::<4>();
    let mut tets = Vec::with_capacity(cells.len());
    for (cell, vertices) in (0_u64..).zip(cells) {
        let mut tet = [0; 4];
        for (slot, &point) in tet.iter_mut().zip(vertices) {
            let index = u32::try_from(point).ok().filter(|p| (*p as usize) < points);
            let index = index.and_then(|p| p.checked_add(first));
            *slot = index.ok_or(ReadReason::MissingPoint { cell, point, points: points as u64 })?;
        }
        tets.push(tet);
    }
    Ok(tets)
}

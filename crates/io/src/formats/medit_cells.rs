//! The cells of Medit's meshes: those of the keywords of libMeshb 7, linear and quadratic, in VTK's order.
//!
//! The order of the points of quadratic cells is that which the file states (`TetrahedraP2Ordering` and the like). Where it states none,
//! the places of the points decide: programs differ.

use std::collections::BTreeMap;

use crate::cell_shapes::{HEXAHEDRON_EDGES, PYRAMID_14, PYRAMID_EDGES, TETRAHEDRON_EDGES, WEDGE_EDGES};
use crate::error::{ReadReason, shown};
use crate::formats::draft::Draft;

/// A kind of cells with a volume.
pub(super) struct Kind {
    /// The keyword of the cells in text, and its number in binary.
    pub name: &'static str,
    pub number: i64,
    /// VTK's type.
    vtk: i64,
    pub points: usize,
    /// The section with the order of its points; none of linear cells.
    pub ordering: Option<(&'static str, i64)>,
}

const fn linear(name: &'static str, number: i64, vtk: i64, points: usize) -> Kind {
    Kind { name, number, vtk, points, ordering: None }
}

const fn quadratic(
    name: &'static str,
    number: i64,
    (vtk, points): (i64, usize),
    ordering: (&'static str, i64),
) -> Kind {
    Kind { name, number, vtk, points, ordering: Some(ordering) }
}

/// All kinds that are read.
pub(super) const KINDS: [Kind; 9] = [
    linear("Tetrahedra", 8, 10, 4),
    linear("Prisms", 9, 13, 6),
    linear("Pentahedra", 9, 13, 6),
    linear("Hexahedra", 10, 12, 8),
    linear("Pyramids", 49, 14, 5),
    quadratic("TetrahedraP2", 30, (24, 10), ("TetrahedraP2Ordering", 133)),
    quadratic("HexahedraQ2", 33, (29, 27), ("HexahedraQ2Ordering", 139)),
    quadratic("PrismsP2", 86, (32, 18), ("PrismsP2Ordering", 137)),
    quadratic("PyramidsP2", 87, (PYRAMID_14, 14), ("PyramidsP2Ordering", 135)),
];

/// The section with the order of points that `is_it`, and how many numbers its rows have.
pub(super) fn ordering(is_it: impl Fn((&str, i64)) -> bool) -> Option<(&'static str, usize)> {
    let found = KINDS.iter().find(|kind| kind.ordering.is_some_and(&is_it))?;
    let width = if matches!(found.points, 10 | 18) { 4 } else { 3 };
    found.ordering.map(|(name, _)| (name, width))
}

/// Cells with a volume that are not read, by their numbers in binary.
const REFUSED: [(i64, &str); 9] = [
    (46, "Polyhedra"),
    (96, "TetrahedraP3"),
    (97, "TetrahedraP4"),
    (98, "HexahedraQ3"),
    (99, "HexahedraQ4"),
    (100, "PyramidsP3"),
    (101, "PyramidsP4"),
    (102, "PrismsP3"),
    (103, "PrismsP4"),
];

/// Refuses cells that have a volume but are not read.
pub(super) fn expect_known(name: &str) -> Result<(), ReadReason> {
    let solids = ["Tetrahedra", "Hexahedra", "Prisms", "Pentahedra", "Pyramids", "Polyhedra"];
    if !solids.iter().any(|solid| name.starts_with(solid)) || name.ends_with("Ordering") {
        return Ok(());
    }
    let what = format!("cells in section {}", shown(name));
    Err(ReadReason::unsupported(what, "save the mesh with cells of the first or second order"))
}

/// The name of a section of cells that are refused.
pub(super) fn refused(number: i64) -> Option<&'static str> {
    REFUSED.iter().find(|(known, _)| *known == number).map(|(_, name)| *name)
}

/// Cells as a file lists them, and in which order their points are.
#[derive(Default)]
pub(super) struct Cells {
    /// Of each section, by its place in [`KINDS`], the points of all of its cells.
    quadratic: BTreeMap<usize, Vec<i64>>,
    references_of_quadratic: BTreeMap<usize, Vec<f64>>,
    /// The tables of the sections with orders, by the names of these.
    pub orders: BTreeMap<&'static str, Vec<i64>>,
    references: Vec<f64>,
    /// How many cells each section has.
    pub counts: Vec<(&'static str, usize)>,
    /// Whether points are those of Bezier's.
    pub is_bezier: bool,
}

impl Cells {
    /// Takes a cell with its points, numbered from 0, and its reference.
    pub fn add(&mut self, draft: &mut Draft<'_>, kind: usize, points: &[i64], reference: f64) {
        if KINDS[kind].ordering.is_some() {
            self.quadratic.entry(kind).or_default().extend(points);
            self.references_of_quadratic.entry(kind).or_default().push(reference);
        } else {
            draft.add_cell(KINDS[kind].vtk, points.iter().copied());
            self.references.push(reference);
        }
    }

    /// Gives the draft the quadratic cells, and the references of all.
    pub fn finish(self, draft: &mut Draft<'_>) -> Result<(), ReadReason> {
        let mut references = self.references;
        if self.is_bezier && !self.quadratic.is_empty() {
            let what = "quadratic cells with control points of Bezier's (BezierBasis)";
            return Err(ReadReason::unsupported(what, "save them with points on the cells"));
        }
        for (kind, points) in &self.quadratic {
            let Kind { vtk, points: count, ordering, name, .. } = &KINDS[*kind];
            let places = places(*vtk);
            let stated = ordering.and_then(|(name, _)| self.orders.get(name));
            let order = match stated {
                Some(table) => stated_order(&places, table),
                None => order_by_places(&places, points, &draft.coordinates),
            };
            let order = order.ok_or_else(|| {
                ReadReason::unsupported(
                    format!("the order of the points of {name}"),
                    format!("state it in a section {name}Ordering, or save the cells with straight edges"),
                )
            })?;
            for cell in points.chunks_exact(*count) {
                draft.add_cell(*vtk, order.iter().map(|&p| cell[p]));
            }
            references.extend(self.references_of_quadratic.get(kind).into_iter().flatten());
        }
        draft.at_cells("ref", 1, true, || Ok(references))
    }
}

/// The points of quadratic cells of VTK's type, each as the corners that it is in the middle of.
pub(super) fn places(vtk: i64) -> Vec<Vec<u8>> {
    let (corners, edges, others): (u8, &[[u8; 2]], &[&[u8]]) = match vtk {
        24 => (4, TETRAHEDRON_EDGES, &[]),
        29 => {
            let faces: &[&[u8]] = &[
                &[0, 3, 7, 4],
                &[1, 2, 6, 5],
                &[0, 1, 5, 4],
                &[3, 2, 6, 7],
                &[0, 1, 2, 3],
                &[4, 5, 6, 7],
                &[0, 1, 2, 3, 4, 5, 6, 7],
            ];
            (8, HEXAHEDRON_EDGES, faces)
        }
        32 => (6, WEDGE_EDGES, &[&[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]]),
        _ => (5, PYRAMID_EDGES, &[&[0, 1, 2, 3]]),
    };
    let corners = (0..corners).map(|c| vec![c]);
    let edges = edges.iter().map(|edge| edge.to_vec());
    corners.chain(edges).chain(others.iter().map(|other| other.to_vec())).collect()
}

/// What the tables of orders have for each corner: twice its coordinates, barycentric in tetrahedra and in the triangle of prisms.
fn rows_of_corners(count: usize) -> &'static [&'static [i64]] {
    match count {
        4 => &[&[2, 0, 0, 0], &[0, 2, 0, 0], &[0, 0, 2, 0], &[0, 0, 0, 2]],
        5 => &[&[0, 0, 0], &[2, 0, 0], &[2, 2, 0], &[0, 2, 0], &[0, 0, 2]],
        6 => &[&[2, 0, 0, 0], &[0, 2, 0, 0], &[0, 0, 2, 0], &[2, 0, 0, 2], &[0, 2, 0, 2], &[0, 0, 2, 2]],
        _ => {
            &[&[0, 0, 0], &[2, 0, 0], &[2, 2, 0], &[0, 2, 0], &[0, 0, 2], &[2, 0, 2], &[2, 2, 2], &[0, 2, 2]]
        }
    }
}

/// Which of the file's points is each of VTK's, by the table of the file; none if that is another one.
fn stated_order(places: &[Vec<u8>], table: &[i64]) -> Option<Vec<usize>> {
    let corners = rows_of_corners(places.iter().filter(|place| place.len() == 1).count());
    let width = corners[0].len();
    let rows: Vec<&[i64]> = table.chunks(width).collect();
    let expected = |place: &Vec<u8>| -> Vec<i64> {
        let sum = |i: usize| place.iter().map(|&c| corners[usize::from(c)][i]).sum::<i64>();
        (0..width).map(|i| sum(i) / place.len() as i64).collect()
    };
    let find = |place: &Vec<u8>| rows.iter().position(|row| *row == expected(place));
    places.iter().map(find).collect()
}

/// [`stated_order`] where the file states nothing: corners come first, and each other point of the file is, over all cells, nearest to
/// one place. None if that is not clear.
pub(super) fn order_by_places(places: &[Vec<u8>], points: &[i64], coordinates: &[f64]) -> Option<Vec<usize>> {
    let corners = places.iter().filter(|place| place.len() == 1).count();
    let count = places.len();
    let mut sums = vec![vec![0.0; count]; count];
    let at = |point: i64| -> Option<[f64; 3]> {
        let first = usize::try_from(point).ok()?.checked_mul(3)?;
        coordinates.get(first..first + 3)?.try_into().ok()
    };
    for cell in points.chunks_exact(count) {
        // Points that are not there are refused where cells are split.
        let Some(of_cell) = cell.iter().map(|&point| at(point)).collect::<Option<Vec<_>>>() else { continue };
        let middle = |place: &Vec<u8>| {
            [0, 1, 2]
                .map(|i| place.iter().map(|&c| of_cell[usize::from(c)][i]).sum::<f64>() / place.len() as f64)
        };
        let expected: Vec<[f64; 3]> = places.iter().map(middle).collect();
        for (sums, found) in sums[corners..].iter_mut().zip(&of_cell[corners..]) {
            for (sum, expected) in sums[corners..].iter_mut().zip(&expected[corners..]) {
                *sum += [0, 1, 2].map(|i| (found[i] - expected[i]).powi(2)).iter().sum::<f64>();
            }
        }
    }
    let nearest = |sums: &Vec<f64>| (corners..count).min_by(|&a, &b| sums[a].total_cmp(&sums[b]));
    let mut order: Vec<usize> = (0..corners).collect();
    order.resize(count, usize::MAX);
    for (number, sums) in sums.iter().enumerate().skip(corners) {
        let place = nearest(sums)?;
        if std::mem::replace(&mut order[place], number) != usize::MAX {
            return None;
        }
    }
    Some(order)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell_shapes::recipe;

    #[test]
    fn every_kind_has_the_points_of_its_type() {
        for kind in KINDS {
            assert_eq!(recipe(kind.vtk).unwrap().points, kind.points, "{}", kind.name);
            if kind.ordering.is_some() {
                assert_eq!(places(kind.vtk).len(), kind.points, "{}", kind.name);
            }
        }
    }

    /// The rows of a table of VTK's order, and the points of a cell with these places, corners in a skewed box.
    fn cell(vtk: i64) -> (Vec<Vec<i64>>, Vec<[f64; 3]>) {
        let places = places(vtk);
        let corners = rows_of_corners(places.iter().filter(|place| place.len() == 1).count());
        let row = |place: &Vec<u8>| -> Vec<i64> {
            let sum = |i: usize| place.iter().map(|&c| corners[usize::from(c)][i]).sum::<i64>();
            (0..corners[0].len()).map(|i| sum(i) / place.len() as i64).collect()
        };
        let rows: Vec<Vec<i64>> = places.iter().map(row).collect();
        // Barycentric coordinates count from the first corner.
        let point = |row: &Vec<i64>| {
            let last = [row.len() - 3, row.len() - 2, row.len() - 1].map(|i| row[i] as f64);
            [last[0] + 0.3 * last[1], 2.0 * last[1], last[2] - 0.2 * last[0]]
        };
        let points = rows.iter().map(point).collect();
        (rows, points)
    }

    #[test]
    fn orders_are_found_in_tables_and_by_places() {
        for kind in KINDS.iter().filter(|kind| kind.ordering.is_some()) {
            let (rows, points) = cell(kind.vtk);
            let places = places(kind.vtk);
            let corners = places.iter().filter(|place| place.len() == 1).count();
            // The points behind the corners in the opposite order.
            let file: Vec<usize> = (0..corners).chain((corners..rows.len()).rev()).collect();
            let table: Vec<i64> = file.iter().flat_map(|&p| rows[p].clone()).collect();
            assert_eq!(stated_order(&places, &table), Some(file.clone()), "{}", kind.name);
            assert_eq!(stated_order(&places, &table[1..]), None, "{}", kind.name);
            let coordinates: Vec<f64> = file.iter().flat_map(|&p| points[p]).collect();
            let numbers: Vec<i64> = (0..rows.len() as i64).collect();
            assert_eq!(order_by_places(&places, &numbers, &coordinates), Some(file), "{}", kind.name);
            assert_eq!(
                order_by_places(&places, &numbers, &vec![0.0; coordinates.len()]),
                None,
                "{}",
                kind.name
            );
        }
    }
}

//! Gmsh's types of elements, and the order of their points.

use crate::cell_shapes::PYRAMID_14;

/// A type of elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Element {
    pub points: usize,
    /// VTK's type, and which of Gmsh's points is each of VTK's; none if it has no volume.
    pub cell: Option<(i64, &'static [usize])>,
    /// VTK's type if it has no volume.
    pub flat: i64,
}

const fn flat(points: usize, kind: i64) -> Element {
    Element { points, cell: None, flat: kind }
}

const fn solid(kind: i64, order: &'static [usize]) -> Element {
    Element { points: order.len(), cell: Some((kind, order)), flat: 0 }
}

/// VTK's types of lines, triangles and quadrilaterals of any order.
const LINE: i64 = 68;
const TRIANGLE: i64 = 69;
const QUADRILATERAL: i64 = 70;

/// The type of this number; none if it is not known, or has a volume and an order above two.
pub(super) fn element(kind: i64) -> Option<Element> {
    Some(match kind {
        1 => flat(2, 3),
        2 => flat(3, 5),
        3 => flat(4, 9),
        4 => solid(10, &[0, 1, 2, 3]),
        5 => solid(12, &[0, 1, 2, 3, 4, 5, 6, 7]),
        6 => solid(13, &[0, 1, 2, 3, 4, 5]),
        7 => solid(14, &[0, 1, 2, 3, 4]),
        8 => flat(3, 21),
        9 => flat(6, 22),
        10 => flat(9, 28),
        11 => solid(24, &[0, 1, 2, 3, 4, 5, 6, 7, 9, 8]),
        12 => solid(
            29,
            &[
                0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15, 22, 23, 21, 24, 20, 25,
                26,
            ],
        ),
        13 => solid(32, &[0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11, 15, 17, 16]),
        14 => solid(PYRAMID_14, &[0, 1, 2, 3, 4, 5, 8, 10, 6, 7, 9, 11, 12, 13]),
        15 => flat(1, 1),
        16 => flat(8, 23),
        17 => solid(25, &[0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15]),
        18 => solid(26, &[0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11]),
        19 => solid(27, &[0, 1, 2, 3, 4, 5, 8, 10, 6, 7, 9, 11, 12]),
        20 => flat(9, TRIANGLE),
        21 => flat(10, TRIANGLE),
        22 => flat(12, TRIANGLE),
        23 | 24 => flat(15, TRIANGLE),
        25 => flat(21, TRIANGLE),
        26 => flat(4, LINE),
        27 => flat(5, LINE),
        28 => flat(6, LINE),
        36 => flat(16, QUADRILATERAL),
        37 => flat(25, QUADRILATERAL),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell_shapes::recipe;

    #[test]
    fn every_order_names_each_point_once() {
        for kind in 1..40 {
            let Some(element) = element(kind) else { continue };
            let Some((vtk, order)) = element.cell else { continue };
            let mut sorted = order.to_vec();
            sorted.sort_unstable();
            assert!(sorted.iter().copied().eq(0..element.points), "{kind}");
            assert_eq!(recipe(vtk).unwrap().points, element.points, "{kind}");
        }
    }

    /// Gmsh's edges of quadratic elements, in the order of its points; from its manual.
    const EDGES: [(i64, i64, &[[usize; 2]]); 4] = [
        (11, 24, &[[0, 1], [1, 2], [0, 2], [0, 3], [2, 3], [1, 3]]),
        (
            17,
            25,
            &[[0, 1], [0, 3], [0, 4], [1, 2], [1, 5], [2, 3], [2, 6], [3, 7], [4, 5], [4, 7], [5, 6], [6, 7]],
        ),
        (18, 26, &[[0, 1], [0, 2], [0, 3], [1, 2], [1, 4], [2, 5], [3, 4], [3, 5], [4, 5]]),
        (19, 27, &[[0, 1], [0, 3], [0, 4], [1, 2], [1, 4], [2, 3], [2, 4], [3, 4]]),
    ];

    #[test]
    fn middles_of_edges_are_where_vtk_has_them() {
        let vtk: [(i64, &[[usize; 2]]); 4] = [
            (24, &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]]),
            (
                25,
                &[
                    [0, 1],
                    [1, 2],
                    [2, 3],
                    [3, 0],
                    [4, 5],
                    [5, 6],
                    [6, 7],
                    [7, 4],
                    [0, 4],
                    [1, 5],
                    [2, 6],
                    [3, 7],
                ],
            ),
            (26, &[[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]]),
            (27, &[[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]]),
        ];
        for ((kind, as_vtk, edges), (same, vtk_edges)) in EDGES.into_iter().zip(vtk) {
            assert_eq!(as_vtk, same);
            let (_, order) = element(kind).unwrap().cell.unwrap();
            let corners = order.len() - edges.len();
            for (i, [a, b]) in vtk_edges.iter().enumerate() {
                let mut expected = [order[*a], order[*b]];
                expected.sort_unstable();
                assert_eq!(edges[order[corners + i] - corners], expected, "{kind} {i}");
            }
        }
    }
}

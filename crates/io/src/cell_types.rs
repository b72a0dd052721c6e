//! VTK's numbers for the types of cells, and some of our own.

/// VTK's number for no cell at all; also that of cells which are to be left out.
pub(super) const EMPTY: i64 = 0;
/// And for a tetrahedron.
pub(super) const TETRAHEDRON: i64 = 10;
/// And for a cell that lists its faces.
pub(super) const POLYHEDRON: i64 = 42;
/// And for cells that say no more than that there are points.
pub(super) const VERTICES: [i64; 2] = [1, 2];
/// And for cells without a volume: linear, quadratic, and of any order.
const FLAT: [i64; 31] = [
    EMPTY, HIDDEN, GHOST, 1, 2, 3, 4, 5, 6, 7, 8, 9, 21, 22, 23, 28, 30, 34, 35, 36, 51, 52, 53, 54, 60, 61,
    62, 63, 68, 69, 70,
];
/// And for those of Bezier.
const FLAT_BEZIER: [i64; 3] = [75, 76, 77];
/// Numbers of our own for cells that are marked as hidden, and as those of another piece.
pub(super) const HIDDEN: i64 = -1;
pub(super) const GHOST: i64 = -2;
/// VTK's number for a hexahedron of any order.
pub(super) const LAGRANGE_HEXAHEDRON: i64 = 72;
/// Types of any order, and a number of our own for each with its points: this times the type, and the points.
pub(super) const ANY_ORDERS: [i64; 8] = [71, 72, 73, 74, 78, 79, 80, 81];
pub(super) const ANY_ORDER: i64 = 10_000;

/// Whether a file may list cells of this type, which are then left out.
pub(super) fn is_flat(kind: i64) -> bool {
    FLAT.contains(&kind) || FLAT_BEZIER.contains(&kind)
}

//! The table of marching tetrahedra, for all surfaces that are cut out of a mesh.

/// The crossed edges of each of the 16 cases, as indices into [`EDGES`](crate::mesh::EDGES), in an order that turns counter-clockwise when seen from the inside;
/// bit `i` of the case is set when vertex `i` is inside. Four edges make a quadrilateral.
pub(super) const CASES: [&[usize]; 16] = [
    &[],
    &[0, 2, 1],
    &[0, 3, 4],
    &[1, 3, 4, 2],
    &[1, 5, 3],
    &[2, 5, 3, 0],
    &[0, 1, 5, 4],
    &[2, 5, 4],
    &[2, 4, 5],
    &[0, 4, 5, 1],
    &[3, 5, 2, 0],
    &[1, 3, 5],
    &[1, 2, 4, 3],
    &[0, 4, 3],
    &[0, 1, 2],
    &[],
];

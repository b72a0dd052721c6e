//! Geometry on the lattice: triangulations, angles, what is flat, the nearest triangle of many.

pub(crate) mod delaunay;
pub(crate) mod dihedral;
pub(crate) mod flat;
pub(crate) mod triangle_fan;

//! Pure geometry: exact predicates, lattices, boxes, a camera. Knows no mesh.

mod bounds;
mod camera;
mod lattice;
mod predicates;
mod tet_box;

pub use bounds::Bounds;
pub use camera::{Camera, Ray};
pub use lattice::Lattice;
pub use predicates::{NARROW_BITS, WIDE_BITS, orient3d};
pub use tet_box::{LatticeBox, tet_meets_box};

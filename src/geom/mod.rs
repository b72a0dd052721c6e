//! Pure geometry: exact predicates, lattices, boxes, a camera. Knows no mesh.

mod bounds;
mod camera;
mod lattice;
mod predicates;
mod tet_box;
mod triangle;
#[cfg(feature = "build")]
mod weights;

pub use bounds::Bounds;
pub use camera::{Camera, Ray};
pub use lattice::Lattice;
pub use predicates::{NARROW_BITS, WIDE_BITS, in_conflict, insphere, orient3d};
pub(crate) use predicates::{det_i64, views_of_origin};
pub use tet_box::{LatticeBox, tet_meets_box};
pub use triangle::nearest_on_triangle;
#[cfg(feature = "build")]
pub(crate) use weights::{ON_LATTICE, weights_at};

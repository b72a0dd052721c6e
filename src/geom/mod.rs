//! Pure geometry: exact predicates, lattices, boxes, a camera. Knows no mesh.

mod bits;
mod bounds;
mod camera;
mod dihedral;
mod groups;
mod lattice;
mod morton;
mod point_grid;
mod predicates;
mod single;
mod tet_box;
mod triangle;
mod triangle_grid;
mod weights;

#[doc(hidden)]
pub use bits::bits_of;
pub use bounds::Bounds;
#[doc(hidden)]
pub use bounds::lattice_box;
pub use camera::{Camera, CameraState, Projection, Ray, ViewPreset};
#[doc(hidden)]
pub use camera::{CameraError, Rays};
#[doc(hidden)]
pub use dihedral::sharpness;
#[doc(hidden)]
pub use groups::Groups;
#[doc(hidden)]
pub use lattice::Lattice;
#[doc(hidden)]
pub use morton::morton;
#[doc(hidden)]
pub use point_grid::PointGrid;
#[doc(hidden)]
pub use predicates::{NARROW_BITS, WIDE_BITS, in_conflict, insphere, orient3d};
pub(crate) use predicates::{det_i64, views_of_origin};
#[doc(hidden)]
pub use single::{SinglePoints, SingleValues, keeps_in_single};
#[doc(hidden)]
pub use tet_box::{LatticeBox, tet_meets_box};
#[doc(hidden)]
pub use triangle::{nearest_on_triangle, weights_on_triangle};
#[doc(hidden)]
pub use triangle_grid::TriangleGrid;
#[doc(hidden)]
pub use weights::{ON_LATTICE, TetPlaces};

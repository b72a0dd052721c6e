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
pub use bounds::{Bounds, lattice_box};
pub use camera::{Camera, CameraError, CameraState, Projection, Ray, Rays, ViewPreset};
pub use dihedral::sharpness;
#[doc(hidden)]
pub use groups::Groups;
pub use lattice::Lattice;
#[doc(hidden)]
pub use morton::morton;
#[doc(hidden)]
pub use point_grid::PointGrid;
pub use predicates::{NARROW_BITS, WIDE_BITS, in_conflict, insphere, orient3d};
pub(crate) use predicates::{det_i64, views_of_origin};
pub use single::{SinglePoints, SingleValues, keeps_in_single};
pub use tet_box::{LatticeBox, tet_meets_box};
pub use triangle::nearest_on_triangle;
#[doc(hidden)]
pub use triangle::weights_on_triangle;
#[doc(hidden)]
pub use triangle_grid::TriangleGrid;
#[doc(hidden)]
pub use weights::{ON_LATTICE, TetPlaces};

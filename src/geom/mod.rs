//! Pure geometry: exact predicates, lattices, boxes, a camera. Knows no mesh.

mod bounds;
mod camera;
#[cfg(feature = "build")]
mod dihedral;
mod groups;
mod lattice;
mod morton;
#[cfg(feature = "build")]
mod point_grid;
mod predicates;
mod single;
mod sort;
mod tet_box;
mod triangle;
mod triangle_grid;
#[cfg(feature = "build")]
mod weights;

pub use bounds::{Bounds, lattice_box};
pub use camera::{Camera, CameraError, CameraState, Projection, Ray, Rays, ViewPreset};
#[cfg(feature = "build")]
pub use dihedral::sharpness;
pub(crate) use groups::Groups;
pub use lattice::Lattice;
pub(crate) use morton::morton;
#[cfg(feature = "build")]
pub(crate) use point_grid::PointGrid;
pub use predicates::{NARROW_BITS, WIDE_BITS, in_conflict, insphere, orient3d};
pub(crate) use predicates::{det_i64, views_of_origin};
pub use single::{SinglePoints, SingleValues, keeps_in_single};
pub(crate) use sort::{bits_of, sort_few, total_order};
pub use tet_box::{LatticeBox, tet_meets_box};
pub use triangle::nearest_on_triangle;
pub(crate) use triangle::weights_on_triangle;
pub(crate) use triangle_grid::TriangleGrid;
#[cfg(feature = "build")]
pub(crate) use weights::{ON_LATTICE, TetPlaces};

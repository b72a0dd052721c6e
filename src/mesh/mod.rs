//! The vocabulary of tetrahedral meshes: plain arrays, adjacency, validity.

mod adjacency;
mod bit_set;
mod cell_data;
mod changed_blocks;
mod check;
mod error;
mod field;
mod geometry_field;
mod grow;
mod histogram;
mod input;
mod kuhn;
mod layered_grid;
mod middles;
mod piece;
mod repair;
mod series;
mod straighten;
mod tet;
mod tet_mesh;

#[doc(hidden)]
pub use adjacency::DisjointSets;
#[doc(hidden)]
pub use adjacency::{FaceTable, boundary_faces, match_faces};
pub use adjacency::{Topology, neighbors, topology};
#[doc(hidden)]
pub use bit_set::BitSet;
pub(crate) use changed_blocks::{BLOCK, ChangedBlocks};
pub use check::check;
#[doc(hidden)]
pub use check::check_arrays;
#[doc(hidden)]
pub use check::check_topology;
pub use error::MeshError;
pub use field::{Field, VectorPart};
pub use geometry_field::GeometryField;
#[doc(hidden)]
pub use grow::growth_order;
pub(crate) use grow::{Gate, Growth};
pub use histogram::Histogram;
pub(crate) use histogram::{Sum, volume_of};
pub use input::{CellNumbers, InputCell, MeshInput, Note, SourceFiles};
pub use kuhn::kuhn_tets;
pub use layered_grid::{GridArray, LayeredGrid};
#[doc(hidden)]
pub use middles::Middles;
pub use piece::MeshPiece;
pub use repair::{MeshFindings, RepairLevel, RepairReport, findings, repair, repair_at};
pub use series::StepError;
#[doc(hidden)]
pub use straighten::straighten;
pub use tet::{EDGES, FACES, MAX_TETS, NONE};
pub use tet_mesh::{Grid, TetMesh};

//! The vocabulary of tetrahedral meshes: plain arrays, adjacency, validity.

mod adjacency;
mod bit_set;
mod cell_data;
mod changed_blocks;
mod check;
mod error;
mod extremes;
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

pub(crate) use adjacency::faces;
#[doc(hidden)]
pub use adjacency::{DisjointSets, FaceTable, Topology, boundary_faces, match_faces, neighbors, topology};
#[doc(hidden)]
pub use bit_set::BitSet;
#[doc(hidden)]
pub use cell_data::{COMPONENTS, CellsToPoints};
pub(crate) use changed_blocks::{BLOCK, ChangedBlocks};
#[doc(hidden)]
pub use check::{check, check_arrays, check_topology};
pub use error::MeshError;
pub use extremes::{Averaged, Extreme};
#[doc(hidden)]
pub use extremes::{Difference, Extremes};
pub use field::{Field, VectorPart};
#[doc(hidden)]
pub use field::{MOST_LABELS, default_field, is_number_or_place};
#[doc(hidden)]
pub use geometry_field::GeometryField;
#[doc(hidden)]
pub use grow::growth_order;
pub(crate) use grow::{Gate, Growth};
#[doc(hidden)]
pub use histogram::{Histogram, parting};
pub(crate) use histogram::{Sum, volume_of};
#[doc(hidden)]
pub use input::{CellNumbers, InputCell, MeshInput, Note, SourceFiles};
#[doc(hidden)]
pub use kuhn::kuhn_tets;
#[doc(hidden)]
pub use layered_grid::{GridArray, LayeredGrid};
#[doc(hidden)]
pub use middles::Middles;
#[doc(hidden)]
pub use piece::MeshPiece;
pub use repair::{MeshFindings, RepairLevel, RepairReport, findings, repair, repair_at};
#[doc(hidden)]
pub use series::StepError;
#[doc(hidden)]
pub use straighten::straighten;
#[doc(hidden)]
pub use tet::{EDGES, MAX_TETS, REGION_COLORS};
pub use tet::{FACES, NONE};
#[doc(hidden)]
pub use tet_mesh::Side;
pub use tet_mesh::{Grid, TetMesh};

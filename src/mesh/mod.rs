//! The vocabulary of tetrahedral meshes: plain arrays, adjacency, validity.

mod adjacency;
mod bit_set;
mod cell_data;
mod changed_blocks;
mod check;
mod error;
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
mod tet_mesh;

#[doc(hidden)]
pub use adjacency::DisjointSets;
#[doc(hidden)]
pub use adjacency::{FaceTable, boundary_faces, match_faces};
pub use adjacency::{MAX_TETS, Topology, neighbors, topology};
#[doc(hidden)]
pub use bit_set::BitSet;
pub(crate) use changed_blocks::{BLOCK, ChangedBlocks};
pub use check::check;
#[doc(hidden)]
pub use check::check_arrays;
#[doc(hidden)]
pub use check::check_topology;
pub use error::MeshError;
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
pub use middles::{Middles, straighten};
pub use piece::MeshPiece;
pub use repair::{MeshFindings, RepairLevel, RepairReport, findings, repair, repair_at};
pub use series::StepError;
pub use tet_mesh::{Field, Grid, TetMesh, VectorPart};

/// "No tetrahedron": the neighbour across a boundary face.
pub const NONE: u32 = u32::MAX;

/// The four faces of a positive tetrahedron, face `i` opposite vertex `i`, ordered so that the right-handed
/// normal points outward.
///
/// ```text
///         3
///        /|\          face 0: 1 2 3
///       / | \         face 1: 0 3 2
///      0--|--2        face 2: 0 1 3
///       \ | /         face 3: 0 2 1
///         1
/// ```
pub const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// The six edges of a tetrahedron.
pub const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

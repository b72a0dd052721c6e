//! The Multi-Tessellation itself [§2]: what it is made of and what every kind of it can do.
//!
//! [`EdgeMt`], [`VertexMt`] and [`HalfEdgeMt`] are the compact structures that files hold and programs use; [`ExplicitMt`]
//! lives in memory alone and stores every tetrahedron, as the oracle of tests; [`VertexTreeMt`] has the nodes of the paper in the place of those of [`VertexMt`], to compare
//! them. All are immutable once they are complete. What changes is the [`CurrentMesh`], to which updates
//! are applied through the trait [`ApplyUpdates`].
//!
//! Each kind has a wing, and the paper's node code one that uses that of `vertex`; `mesh` and `pages` know none of them:
//!
//! | here | what it is |
//! |---|---|
//! | `traits` | [`MultiTessellation`] (what can be read), [`UpdatePages`] (what comes and goes), [`ApplyUpdates`] (`u+` and `u−`) |
//! | `ids`, `info` | numbers of updates and vertices; kind, lattices and fields of an MT |
//! | `mesh` | the current mesh: base mesh, tags, changed blocks, stars; it carries the state of a kind as a `KindState` without reading it |
//! | `pages` | updates in pages, for half-edge MTs, which can come in parts |
//! | `edge` | `store`; `predict` and `star` (residuals); `builder` (from plain vertex splits); `apply` |
//! | `half_edge` | `store`; `star_code` (residuals of removers and inner faces); `scratch` and `new_star` (the star of an insertion); `places` (its geometry, prediction of levels); `builder` (appends updates to the mesh of those before, or to patches of it) over `batch` (codes the stars of many at a time), `forest` (near vertices) and `removers`; `from_explicit`; `apply` |
//! | `vertex` | `store`, `limits`; `shape_code`, `cavity`, `cavity_fill`, `sphere_order`, `bit_string` (what an insertion removes); `tet_errors`; `growing` and `streaming` (while updates arrive); `from_explicit`; `apply` |
//! | `vertex_tree` | the paper's node code [§5], in memory alone: `store` (what a node has, and what it cannot say), `tree_code` (the stream 0 / 10 / 11), `rebuild` (T_u from it); `from_explicit`; `apply` |
//! | `explicit` | `store`, `face_occupancy`, `check`, `apply` |
//! | `any` | [`Mt`], an MT of any kind; calls are dispatched by `enum_dispatch` |
//! | `facts` | what is noted of a half-edge MT while it is made, for the encoder |
//! | `reaches` | what updates and all that depend on them touch |
//! | `regions` | parts of the volume that every mesh keeps apart, each tetrahedron being of one |
//! | `convert`, `replay`, `stats`, `update_errors`, `exact`, `margins`, `ranks`, `error` | over all kinds |
//!
//! [`EdgeMt`] stores no DAG: parents and children follow from labels. In [`VertexMt`] and [`VertexTreeMt`] they follow from loops [§5]; these store
//! no tetrahedra but those of the base mesh. [`ExplicitMt`] has a DAG, and is the form in which the builders of vertex-based MTs hand them over.
//! Which update removes a tetrahedron of the current mesh follows from labels in edge-based MTs; in the others the mesh keeps it as a tag.

// Before `any`: then `enum_dispatch` writes the calls there, and the traits need not know [`Mt`].
mod traits;

mod any;
mod convert;
mod convert_error;
mod edge;
mod error;
mod exact;
mod explicit;
mod facts;
mod half_edge;
mod ids;
mod info;
mod margins;
mod mesh;
mod pages;
mod ranks;
mod reaches;
mod regions;
mod replay;
mod stats;
mod update_errors;
mod vertex;
mod vertex_tree;

pub use any::Mt;
#[doc(hidden)]
pub use convert_error::ConvertError;
#[doc(hidden)]
pub use edge::builder::EdgeMtBuilder;
pub use edge::store::EdgeMt;
#[doc(hidden)]
pub use edge::store::{EdgeUpdate, MAX_EDGE, VertexSplit};
pub use error::{ErrorCode, UpdateError};
#[doc(hidden)]
pub use error::{MAX_QUARTERINGS, PageError};
#[doc(hidden)]
pub use exact::{Exact, ExactValues};
#[doc(hidden)]
pub use explicit::check::{MtFault, check_errors};
pub use explicit::store::ExplicitMt;
#[doc(hidden)]
pub use explicit::store::ExplicitUpdate;
pub(crate) use facts::{MtFacts, VOLUME_BINS, level_volumes};
#[doc(hidden)]
pub use half_edge::builder::{Forest, HalfEdgeBuilder, NextUpdate, Patch};
#[doc(hidden)]
pub use half_edge::removers::by_corner;
pub use half_edge::store::HalfEdgeMt;
#[doc(hidden)]
pub use half_edge::store::{BaseMark, ForestChild, HalfEdgeUpdate};
pub use ids::UpdateId;
#[doc(hidden)]
pub use ids::{Applied, VertexId};
#[doc(hidden)]
pub use info::AveragedField;
pub use info::{FieldInfo, MtInfo, MtKind};
#[doc(hidden)]
pub use margins::{Excess, Margins};
#[doc(hidden)]
pub use mesh::base::{BaseMesh, BaseMeshError, MAX_FIELD_BITS, MAX_UPDATES, MAX_VERTICES};
#[doc(hidden)]
pub use mesh::current::mix;
pub use mesh::current::{CurrentMesh, MeshChanges};
#[doc(hidden)]
pub use mesh::limits::{MAX_LINK, MAX_STAR};
pub(crate) use mesh::paged_array::PagedArray;
pub(crate) use mesh::tet::corner_of;
pub(crate) use pages::updates_of_page;
pub(crate) use reaches::{Extent, Reaches, coarser_by};
#[doc(hidden)]
pub use regions::{BaseSides, MAX_REGIONS, further_regions, numbers_of};
pub use regions::{RegionInfo, Regions};
pub(crate) use replay::apply_next;
#[doc(hidden)]
pub use replay::{ReplayError, canonical};
#[doc(hidden)]
pub use stats::{MtStats, stats};
pub use traits::{ApplyUpdates, MultiTessellation};
#[doc(hidden)]
pub use traits::{LookAtTet, UpdatePages};
#[doc(hidden)]
pub use vertex::limits::{MAX_AROUND, MAX_INSERTED, MAX_REMOVED};
#[doc(hidden)]
pub use vertex::store::NodeBits;
pub use vertex::store::VertexMt;
pub(crate) use vertex::streaming::Insertion;
#[doc(hidden)]
pub use vertex_tree::rebuild::MOST_TRIES;
pub use vertex_tree::store::VertexTreeMt;
#[doc(hidden)]
pub use vertex_tree::store::{MostNeighbors, TreeExceptions};

//! The Multi-Tessellation itself [§2]: what it is made of and what every kind of it can do.
//!
//! [`EdgeMt`], [`VertexMt`] and [`HalfEdgeMt`] are the compact structures that files hold and programs use; [`ExplicitMt`]
//! lives in memory alone and stores every tetrahedron, as the oracle of tests; [`VertexTreeMt`] has the nodes of the paper in the place of those of [`VertexMt`], to compare
//! them. All are immutable once they are complete. What changes is the [`CurrentMesh`], to which updates
//! are applied through the trait [`ApplyUpdates`].

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
mod replay;
mod stats;
mod update_errors;
mod vertex;
mod vertex_tree;

pub use any::Mt;
pub use convert_error::ConvertError;
pub use edge::builder::EdgeMtBuilder;
pub use edge::store::{EdgeMt, EdgeUpdate, MAX_EDGE, VertexSplit};
pub use error::{ErrorCode, MAX_QUARTERINGS, PageError, UpdateError};
pub use exact::{Exact, ExactValues};
pub use explicit::check::MtFault;
pub use explicit::check::check_errors;
pub use explicit::store::{ExplicitMt, ExplicitUpdate};
pub(crate) use facts::{MtFacts, VOLUME_BINS, level_volumes};
#[doc(hidden)]
pub use half_edge::builder::{Forest, HalfEdgeBuilder, NextUpdate};
#[doc(hidden)]
pub use half_edge::removers::by_corner;
pub use half_edge::store::{BaseMark, ForestChild, HalfEdgeMt, HalfEdgeUpdate};
pub use ids::{Applied, UpdateId, VertexId};
pub use info::{FieldInfo, MtInfo, MtKind};
#[doc(hidden)]
pub use margins::{Excess, Margins};
pub use mesh::base::{BaseMesh, BaseMeshError, MAX_FIELD_BITS, MAX_UPDATES};
#[doc(hidden)]
pub use mesh::current::mix;
pub use mesh::current::{CurrentMesh, MeshChanges};
pub use mesh::limits::{MAX_LINK, MAX_STAR};
pub(crate) use mesh::paged_array::PagedArray;
pub(crate) use mesh::tet::corner_of;
pub use replay::ReplayError;
#[doc(hidden)]
pub use replay::canonical;
pub use stats::{MtStats, stats};
pub use traits::{ApplyUpdates, LookAtTet, MultiTessellation, UpdatePages};
pub use vertex::limits::{MAX_AROUND, MAX_INSERTED, MAX_REMOVED};
pub use vertex::store::{NodeBits, VertexMt};
pub(crate) use vertex::streaming::Insertion;
pub use vertex_tree::rebuild::MOST_TRIES;
pub use vertex_tree::store::{MostNeighbors, TreeExceptions, VertexTreeMt};

//! An MT of any kind: what files hold and sessions use, without the caller knowing which.

use super::{EdgeMt, ExplicitMt, HalfEdgeMt, MultiTessellation, UpdateError, VertexMt};
use enum_dispatch::enum_dispatch;

/// An MT of any kind.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[enum_dispatch(MultiTessellation, UpdatePages, ApplyUpdates)]
pub enum Mt {
    /// A compact edge-based MT.
    Edge(EdgeMt),
    /// A compact vertex-based MT.
    Vertex(VertexMt),
    /// A compact half-edge MT.
    HalfEdge(HalfEdgeMt),
    /// An explicit MT.
    Explicit(ExplicitMt),
}

impl Mt {
    /// Whether pages of updates can come and go one by one.
    pub fn is_paged(&self) -> bool {
        self.info().kind.is_paged()
    }

    /// The same MT, complete, with `2^bits` updates in each page. Kinds without pages stay as they are.
    ///
    /// # Errors
    /// If an update is not here.
    pub fn in_pages(&self, bits: u32) -> Result<Self, UpdateError> {
        Ok(match self {
            Self::Edge(mt) => mt.in_pages(bits)?.into(),
            Self::HalfEdge(mt) => mt.in_pages(bits)?.into(),
            mt => mt.clone(),
        })
    }
}

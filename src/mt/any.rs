//! An MT of any kind: what files hold and sessions use, without the caller knowing which.

use super::{EdgeMt, ExplicitMt, HalfEdgeMt, MultiTessellation, VertexMt};
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
}

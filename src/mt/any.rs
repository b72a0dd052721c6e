//! An MT of any kind: what files hold and sessions use, without the caller knowing which.

use super::replay::replay;
use super::stats::bounds;
use super::{
    Applied, ApplyUpdates, BaseMesh, BaseMeshError, CurrentMesh, EdgeMt, ErrorCode, HalfEdgeMt, LookAtTet,
    MtInfo, MultiTessellation, PageError, Regions, ReplayError, UpdateError, UpdateId, UpdatePages, VertexMt,
};
use enum_dispatch::enum_dispatch;
use std::ops::Range;

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
}

impl Mt {
    /// Whether pages of updates can come and go one by one.
    pub fn is_paged(&self) -> bool {
        self.info().kind.is_paged()
    }

    /// Finds the box around the reference mesh ([`MtInfo::bounds`](super::MtInfo::bounds)) if it is not known, by applying all updates once.
    ///
    /// # Errors
    /// If one cannot be applied.
    pub fn find_bounds(&mut self) -> Result<(), ReplayError> {
        if self.info().bounds.is_none() {
            let bounds = Some(bounds(&replay(self, |_| {})?));
            match self {
                Self::Edge(mt) => mt.info.bounds = bounds,
                Self::Vertex(mt) => mt.info.bounds = bounds,
                Self::HalfEdge(mt) => mt.info.bounds = bounds,
            }
        }
        Ok(())
    }

    /// The MT, complete, with `2^bits` updates in each page: the blocks of its file. Kinds edge and vertex only note it for that.
    ///
    /// # Errors
    /// If an update is not here.
    pub fn in_pages(&self, bits: u32) -> Result<Self, UpdateError> {
        Ok(match self {
            Self::HalfEdge(mt) => mt.in_pages(bits)?.into(),
            Self::Edge(mt) => {
                let mut mt = mt.clone();
                mt.set_page_bits(bits);
                mt.into()
            }
            Self::Vertex(mt) => {
                let mut mt = mt.clone();
                mt.set_page_bits(bits);
                mt.into()
            }
        })
    }
}

//! An MT of any kind: what files hold and sessions use, without the caller knowing which.

use super::{
    Applied, BaseMesh, BaseMeshError, CurrentMesh, EdgeMt, ErrorCode, ExplicitMt, HalfEdgeMt, LookAtTet,
    MtInfo, MultiTessellation, PageError, UpdateError, UpdateId, VertexMt,
};
use crate::mt::{ApplyUpdates, UpdatePages};
use std::ops::Range;

/// An MT of any kind.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
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

/// Does the same to whichever MT it is.
macro_rules! each {
    ($mt:expr, $inner:ident => $do:expr) => {
        match $mt {
            Mt::Edge($inner) => $do,
            Mt::Vertex($inner) => $do,
            Mt::HalfEdge($inner) => $do,
            Mt::Explicit($inner) => $do,
        }
    };
}

impl From<EdgeMt> for Mt {
    fn from(mt: EdgeMt) -> Self {
        Self::Edge(mt)
    }
}

impl From<VertexMt> for Mt {
    fn from(mt: VertexMt) -> Self {
        Self::Vertex(mt)
    }
}

impl From<HalfEdgeMt> for Mt {
    fn from(mt: HalfEdgeMt) -> Self {
        Self::HalfEdge(mt)
    }
}

impl From<ExplicitMt> for Mt {
    fn from(mt: ExplicitMt) -> Self {
        Self::Explicit(mt)
    }
}

impl Mt {
    /// Tells that no update which is still to come has a larger error than this; until then, any may come. Means
    /// nothing once all are here.
    pub fn set_to_come(&mut self, bound: ErrorCode) {
        each!(self, mt => mt.set_to_come(bound));
    }
}

impl Mt {
    /// Whether pages of updates can come and go one by one.
    pub fn is_paged(&self) -> bool {
        self.info().kind.is_paged()
    }

    /// Takes a page away: see [`EdgeMt::remove_page`] and [`HalfEdgeMt::remove_page`].
    ///
    /// # Errors
    /// As these; for kinds without pages, that it is not here.
    pub fn remove_page(&mut self, page: u32) -> Result<(), PageError> {
        match self {
            Self::Edge(mt) => mt.remove_page(page),
            Self::HalfEdge(mt) => mt.remove_page(page),
            _ => Err(PageError::Absent { page }),
        }
    }

    /// Whether a page is here. False for kinds without pages.
    pub fn has_page(&self, page: u32) -> bool {
        match self {
            Self::Edge(mt) => mt.has_page(page),
            Self::HalfEdge(mt) => mt.has_page(page),
            _ => false,
        }
    }

    /// Bytes of the pages that are here.
    pub fn page_bytes(&self) -> u64 {
        match self {
            Self::Edge(mt) => mt.page_bytes(),
            Self::HalfEdge(mt) => mt.page_bytes(),
            _ => 0,
        }
    }

    /// Bytes of a page, or what it most likely takes if it is not here.
    pub fn bytes_of_page(&self, page: u32) -> u64 {
        let known = match self {
            Self::HalfEdge(mt) => mt.bytes_of_page(page),
            _ => None,
        };
        known.unwrap_or_else(|| self.page_updates(page).len() as u64 * self.update_bytes())
    }

    /// Bytes that an update of a page takes in memory, or most likely does.
    pub fn update_bytes(&self) -> u64 {
        match self {
            Self::HalfEdge(mt) => HalfEdgeMt::usual_update_bytes(mt.info()),
            mt => EdgeMt::update_bytes(mt.info()),
        }
    }

    /// Whether a page can be used only when those on which it depends are here.
    pub fn needs_parents(&self) -> bool {
        !matches!(self, Self::HalfEdge(_))
    }
}

impl MultiTessellation for Mt {
    fn info(&self) -> &MtInfo {
        each!(self, mt => mt.info())
    }

    fn base(&self) -> &BaseMesh {
        each!(self, mt => MultiTessellation::base(mt))
    }

    fn updates(&self) -> u32 {
        each!(self, mt => mt.updates())
    }

    fn bytes(&self) -> u64 {
        each!(self, mt => MultiTessellation::bytes(mt))
    }

    fn always_grows(&self) -> bool {
        each!(self, mt => MultiTessellation::always_grows(mt))
    }

    #[inline]
    fn error(&self, u: UpdateId) -> ErrorCode {
        each!(self, mt => MultiTessellation::error(mt, u))
    }

    #[inline]
    fn errors(&self, u: UpdateId) -> &[ErrorCode] {
        each!(self, mt => MultiTessellation::errors(mt, u))
    }

    fn has_tet_errors(&self) -> bool {
        each!(self, mt => mt.has_tet_errors())
    }

    fn own_fall(&self, u: UpdateId) -> u8 {
        each!(self, mt => MultiTessellation::own_fall(mt, u))
    }

    fn to_come(&self) -> ErrorCode {
        each!(self, mt => mt.to_come())
    }
}

impl UpdatePages for Mt {
    #[inline]
    fn has(&self, u: UpdateId) -> bool {
        each!(self, mt => mt.has(u))
    }

    fn present(&self) -> u32 {
        each!(self, mt => mt.present())
    }

    fn page_updates(&self, page: u32) -> Range<u32> {
        each!(self, mt => mt.page_updates(page))
    }

    #[inline]
    fn awaited(&self, mesh: &CurrentMesh, t: u32) -> Option<UpdateId> {
        each!(self, mt => mt.awaited(mesh, t))
    }

    fn awaited_errors(&self, mesh: &CurrentMesh, t: u32) -> Option<&[ErrorCode]> {
        each!(self, mt => mt.awaited_errors(mesh, t))
    }

    #[inline(never)]
    fn page_inserted(&self, mesh: &mut CurrentMesh, updates: Range<u32>) {
        each!(self, mt => mt.page_inserted(mesh, updates));
    }

    fn page_evicted(&self, mesh: &mut CurrentMesh, updates: Range<u32>) {
        each!(self, mt => mt.page_evicted(mesh, updates));
    }
}

impl ApplyUpdates for Mt {
    #[inline(never)]
    fn start(&self) -> Result<CurrentMesh, BaseMeshError> {
        each!(self, mt => mt.start())
    }

    #[inline]
    fn quarterings(&self, mesh: &CurrentMesh, t: u32) -> u8 {
        each!(self, mt => ApplyUpdates::quarterings(mt, mesh, t))
    }

    #[inline]
    fn remover(&self, mesh: &CurrentMesh, t: u32) -> Option<UpdateId> {
        each!(self, mt => ApplyUpdates::remover(mt, mesh, t))
    }

    #[inline]
    fn refine_marked(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied, UpdateError> {
        each!(self, mt => mt.refine_marked(mesh, u))
    }

    #[inline]
    fn start_at(&self, mesh: &mut CurrentMesh, t: u32) {
        each!(self, mt => mt.start_at(mesh, t));
    }

    #[inline]
    fn creator(&self, mesh: &CurrentMesh, t: u32) -> Option<UpdateId> {
        each!(self, mt => ApplyUpdates::creator(mt, mesh, t))
    }

    #[inline]
    fn may_coarsen(&self, mesh: &CurrentMesh, u: UpdateId) -> bool {
        each!(self, mt => mt.may_coarsen(mesh, u))
    }

    #[inline(never)]
    fn refine(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied, UpdateError> {
        each!(self, mt => mt.refine(mesh, u))
    }

    #[inline(never)]
    fn coarsen(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied, UpdateError> {
        each!(self, mt => mt.coarsen(mesh, u))
    }

    #[inline(never)]
    fn look_at_removed(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        look: LookAtTet<'_>,
    ) -> Result<Applied, UpdateError> {
        each!(self, mt => mt.look_at_removed(mesh, u, look))
    }

    #[inline(never)]
    fn site(&self, mesh: &CurrentMesh, u: UpdateId) -> [i32; 3] {
        each!(self, mt => mt.site(mesh, u))
    }

    #[inline(never)]
    fn find_removed(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        found: &mut Vec<u32>,
    ) -> Result<(), UpdateError> {
        each!(self, mt => mt.find_removed(mesh, u, found))
    }

    #[inline(never)]
    fn find_inserted(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        found: &mut Vec<u32>,
    ) -> Result<(), UpdateError> {
        each!(self, mt => mt.find_inserted(mesh, u, found))
    }
}

/// An MT of any kind, borrowed.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum MtRef<'a> {
    /// A compact edge-based MT.
    Edge(&'a EdgeMt),
    /// A compact vertex-based MT.
    Vertex(&'a VertexMt),
    /// A compact half-edge MT.
    HalfEdge(&'a HalfEdgeMt),
    /// An explicit MT.
    Explicit(&'a ExplicitMt),
}

impl<'a> From<&'a Mt> for MtRef<'a> {
    fn from(mt: &'a Mt) -> Self {
        match mt {
            Mt::Edge(mt) => Self::Edge(mt),
            Mt::Vertex(mt) => Self::Vertex(mt),
            Mt::HalfEdge(mt) => Self::HalfEdge(mt),
            Mt::Explicit(mt) => Self::Explicit(mt),
        }
    }
}

impl<'a> From<&'a EdgeMt> for MtRef<'a> {
    fn from(mt: &'a EdgeMt) -> Self {
        Self::Edge(mt)
    }
}

impl<'a> From<&'a VertexMt> for MtRef<'a> {
    fn from(mt: &'a VertexMt) -> Self {
        Self::Vertex(mt)
    }
}

impl<'a> From<&'a HalfEdgeMt> for MtRef<'a> {
    fn from(mt: &'a HalfEdgeMt) -> Self {
        Self::HalfEdge(mt)
    }
}

impl<'a> From<&'a ExplicitMt> for MtRef<'a> {
    fn from(mt: &'a ExplicitMt) -> Self {
        Self::Explicit(mt)
    }
}

impl MtRef<'_> {
    /// What is known of the MT as a whole.
    pub fn info(&self) -> &MtInfo {
        match self {
            Self::Edge(mt) => mt.info(),
            Self::Vertex(mt) => mt.info(),
            Self::HalfEdge(mt) => mt.info(),
            Self::Explicit(mt) => mt.info(),
        }
    }

    /// The base mesh.
    pub fn base(&self) -> &BaseMesh {
        match self {
            Self::Edge(mt) => mt.base(),
            Self::Vertex(mt) => mt.base(),
            Self::HalfEdge(mt) => mt.base(),
            Self::Explicit(mt) => mt.base_mesh(),
        }
    }

    /// Number of updates so far.
    pub fn updates(&self) -> u32 {
        match self {
            Self::Edge(mt) => mt.updates(),
            Self::Vertex(mt) => mt.updates(),
            Self::HalfEdge(mt) => mt.updates(),
            Self::Explicit(mt) => mt.updates(),
        }
    }

    /// Whether tetrahedra have errors of their own.
    pub fn has_tet_errors(&self) -> bool {
        match self {
            Self::Edge(_) | Self::HalfEdge(_) => false,
            Self::Vertex(mt) => mt.has_tet_errors(),
            Self::Explicit(mt) => mt.has_tet_errors(),
        }
    }

    /// How many updates are here.
    pub fn present(&self) -> u32 {
        match self {
            Self::Edge(mt) => mt.present(),
            Self::HalfEdge(mt) => mt.present(),
            Self::Vertex(mt) => mt.updates(),
            Self::Explicit(mt) => mt.updates(),
        }
    }
}

//! What every kind of MT can do: it is read, its updates come and go in pages, and they are applied to a mesh.

use super::error::{ErrorCode, PageError, UpdateError};
use super::ids::{Applied, UpdateId};
use super::info::MtInfo;
use super::mesh::base::{BaseMesh, BaseMeshError};
use super::mesh::current::CurrentMesh;
use super::pages::updates_of_page;
use super::regions::Regions;
use enum_dispatch::enum_dispatch;
use std::ops::Range;

/// Sees a tetrahedron: positions at its corners and, by field, levels there, on the lattices; and its
/// [quarterings](ApplyUpdates::quarterings) and region, 0 without any. Return true to stop.
pub type LookAtTet<'a> = &'a mut dyn FnMut(&[[i32; 3]; 4], &dyn Fn(usize) -> [i32; 4], u8, u16) -> bool;

/// A Multi-Tessellation of any kind, to be read: what is known of it as a whole, and of each of its updates [§2].
#[enum_dispatch]
pub trait MultiTessellation {
    /// What is known of the MT as a whole.
    fn info(&self) -> &MtInfo;

    /// The base mesh.
    fn base(&self) -> &BaseMesh;

    /// The regions of the volume, which all meshes keep apart; none if it is not parted. Only half-edge MTs have them.
    fn regions(&self) -> Option<&Regions> {
        None
    }

    /// Number of updates so far; they are `UpdateId(0) .. UpdateId(updates)`, parents before children. Where updates come
    /// in pages, some of these may not be here: see [`UpdatePages::has`].
    fn updates(&self) -> u32;

    /// Whether every update inserts more tetrahedra than it removes: a larger consistent set then has a larger mesh.
    fn always_grows(&self) -> bool;

    /// The error `e(u)` of update `u`: bounds that of every tetrahedron `u+` removes, and of every update that depends
    /// on `u`. Numbers say nothing of it. Only a damaged or hostile MT breaks this. With several fields it is the largest
    /// one of theirs. [`ErrorCode::ZERO`] if the update is not here.
    fn error(&self, u: UpdateId) -> ErrorCode;

    /// The error of update `u` in each field. Every one of them has the displacement of the boundary in it, and what is
    /// said of [`MultiTessellation::error`] holds for it alone. Nothing if the update is not here.
    fn errors(&self, u: UpdateId) -> &[ErrorCode];

    /// The error of update `u` in field `field`; [`ErrorCode::ZERO`] if either is not here.
    #[inline]
    fn error_of_field(&self, u: UpdateId, field: usize) -> ErrorCode {
        self.errors(u).get(field).copied().unwrap_or(ErrorCode::ZERO)
    }

    /// Whether tetrahedra have errors of their own, which may be smaller than those of the updates that remove them and do
    /// not fall along the partial order: see [`ApplyUpdates::quarterings`].
    fn has_tet_errors(&self) -> bool {
        false
    }

    /// By how much the errors of update `u` are larger than those that the tetrahedra it removes have by themselves, because of
    /// the updates that depend on it: in 32nds of a factor of 2. 0 where nothing is known.
    fn own_fall(&self, _u: UpdateId) -> u8 {
        0
    }

    /// What bounds the error in a field of a tetrahedron by itself, given the update that removes it and the tetrahedron's
    /// quarterings.
    fn own_error(&self, u: UpdateId, field: usize, quarterings: u8) -> ErrorCode {
        let error = self.error_of_field(u, field);
        let own = error.lowered(self.own_fall(u), quarterings);
        if own == error { error } else { own.max(error.min(self.info().least_own_error(field))) }
    }

    /// No update that is not here (yet) has a larger error; [`ErrorCode::ZERO`] if all are.
    fn to_come(&self) -> ErrorCode;

    /// Bounds the errors in one field of all updates that are not here (yet); may be less than [`Self::to_come`].
    fn to_come_in(&self, _field: usize) -> ErrorCode {
        self.to_come()
    }

    /// Bytes of everything that the MT holds, base mesh and errors included.
    fn bytes(&self) -> u64;
}

/// A Multi-Tessellation whose updates arrive and leave in pages; where none do, all are here as soon as they are known.
#[enum_dispatch]
pub trait UpdatePages: MultiTessellation {
    /// Whether update `u` is here.
    #[inline]
    fn has(&self, u: UpdateId) -> bool {
        u.0 < self.updates()
    }

    /// How many updates are here.
    fn present(&self) -> u32 {
        self.updates()
    }

    /// log2 of the updates of a page, which is a block in a file. Kinds without pages only note it for their files.
    fn page_bits(&self) -> u32;

    /// The updates of page `page`, which come and go together; none if there is no such page.
    fn page_updates(&self, page: u32) -> Range<u32> {
        updates_of_page(self.page_bits(), page, self.info().updates)
    }

    /// Declares that no update which is still to come has larger errors than these, by field; until then, any may come. Without
    /// effect once all are here.
    fn set_to_come(&mut self, bounds: &[ErrorCode]);

    /// Whether page `page` is here. False for kinds without pages.
    fn has_page(&self, _page: u32) -> bool {
        false
    }

    /// Takes the updates of a page away, none of which may be applied to a mesh that is still in use; that mesh must have
    /// been told before, by [`Front::prepare_eviction`](crate::refine::Front::prepare_eviction). Pages are used without those on which they depend.
    ///
    /// # Errors
    /// If the page is not here, as always for kinds without pages. The MT is as it was then.
    fn remove_page(&mut self, page: u32) -> Result<(), PageError> {
        Err(PageError::Absent { page })
    }

    /// Bytes of the pages that are here.
    fn page_bytes(&self) -> u64 {
        0
    }

    /// Bytes of a page, or what it most likely takes if it is not here.
    fn bytes_of_page(&self, _page: u32) -> u64 {
        0
    }

    /// Bytes that an update of a page takes in memory, or most likely does.
    fn update_bytes(&self) -> u64 {
        0
    }

    /// The update that removes tetrahedron `t` of the current mesh where that is known although the update is not here.
    fn awaited(&self, _: &CurrentMesh, _: u32) -> Option<UpdateId> {
        None
    }

    /// What bounds the errors of the update that removes tetrahedron `t`, field by field, where that update is not here; zeros
    /// if it is known that there is none. None where nothing is known.
    fn awaited_errors(&self, _: &CurrentMesh, _: u32) -> Option<&[ErrorCode]> {
        None
    }

    /// Tells the mesh of updates that have arrived since it last knew of `known` of them.
    fn updates_arrived(&self, mesh: &mut CurrentMesh, known: u32) {
        self.page_inserted(mesh, known..self.updates());
    }

    /// Tells the mesh that these updates have arrived, as far as they are here. The tetrahedra that they remove are among
    /// the touched ones then.
    fn page_inserted(&self, mesh: &mut CurrentMesh, updates: Range<u32>);

    /// Tells the mesh that these updates, none of which is applied, will not be here any more.
    fn page_evicted(&self, _: &mut CurrentMesh, _: Range<u32>) {}
}

/// What selective refinement needs of a Multi-Tessellation of any kind [§2.3]: its updates are applied to a
/// [`CurrentMesh`] and undone, and each tetrahedron of that names the updates that create and remove it.
#[enum_dispatch]
pub trait ApplyUpdates: UpdatePages {
    /// How often the errors of the update that removes tetrahedron `t` of the current mesh can be quartered, after
    /// [`own_fall`](MultiTessellation::own_fall), and still bound those of the tetrahedron, at most [`MAX_QUARTERINGS`](super::MAX_QUARTERINGS); 0 where
    /// nothing is known. See [`ErrorCode::lowered`].
    #[inline]
    fn quarterings(&self, _mesh: &CurrentMesh, _t: u32) -> u8 {
        0
    }

    /// The base mesh as a current mesh that updates of this MT can be applied to.
    ///
    /// # Errors
    /// If the base mesh does not fit its description or is not a valid mesh.
    fn start(&self) -> Result<CurrentMesh, BaseMeshError> {
        CurrentMesh::new(self.info(), self.base())
    }

    /// The update that removes tetrahedron `t` of the current mesh; none if that belongs to the reference mesh (as far
    /// as it is known).
    fn remover(&self, mesh: &CurrentMesh, t: u32) -> Option<UpdateId>;

    /// Says that the update which removes tetrahedron `t` is going to be applied, if it can be.
    fn start_at(&self, _: &mut CurrentMesh, _: u32) {}

    /// The update that created tetrahedron `t` of the current mesh in refinement; none if it is of the base mesh.
    fn creator(&self, mesh: &CurrentMesh, t: u32) -> Option<UpdateId>;

    /// The tetrahedra that `u+` removes from a mesh that contains all parents of `u`, but not `u`.
    ///
    /// # Errors
    /// If the MT is damaged, or the mesh is another one.
    fn find_removed(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Vec<u32>, UpdateError>;

    /// The tetrahedra that `u+` inserted into a mesh that contains `u` and none of its children.
    ///
    /// # Errors
    /// If the MT is damaged, or the mesh is another one.
    fn find_inserted(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Vec<u32>, UpdateError>;

    /// Whether all that `u+` created is still in the mesh, as far as its labels show.
    /// False means that some child of `u` is applied, or `u` is not.
    fn may_coarsen(&self, mesh: &CurrentMesh, u: UpdateId) -> bool;

    /// Applies `u+` to a mesh that does not contain `u`, or names a parent that has to come first.
    ///
    /// # Errors
    /// If the MT is damaged; the mesh is unchanged then.
    fn refine(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied, UpdateError>;

    /// [`ApplyUpdates::refine`] for an update that removes a tetrahedron of the mesh, or whose ancestors are all applied
    /// as far as they are here: no other is looked for at length.
    ///
    /// # Errors
    /// As that, and [`UpdateError::Missing`] if what has to come first cannot be named.
    fn refine_marked(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied, UpdateError> {
        self.refine(mesh, u)
    }

    /// Applies `u−` to a mesh that contains `u`, or names a child that has to go first.
    ///
    /// # Errors
    /// If `u` was not applied to this mesh by [`Self::refine`]; the mesh is unchanged then.
    fn coarsen(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied, UpdateError>;

    /// Shows `look` the tetrahedra that `u+` removes until it returns true, in a mesh that contains `u` and none
    /// of its children; or names a child that is in the way. The mesh stays as it is.
    ///
    /// # Errors
    /// If `u` was not applied to this mesh by [`Self::refine`].
    fn look_at_removed(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        look: LookAtTet<'_>,
    ) -> Result<Applied, UpdateError>;

    /// Where in the model update `u` takes place, as well as the mesh can tell: what lies side by side is quicker done one
    /// after the other. Any answer will do. Where all are alike, numbers decide: to find out that an insertion has to wait costs as
    /// much as most of it.
    fn site(&self, _mesh: &CurrentMesh, _u: UpdateId) -> [i32; 3] {
        [0; 3]
    }
}

//! The Multi-Tessellation itself [§2]: what it is made of and what every kind of it can do.
//!
//! [`EdgeMt`], [`VertexMt`] and [`HalfEdgeMt`] are the compact structures that files hold and programs use; [`ExplicitMt`]
//! stores every tetrahedron, as the oracle of tests; [`VertexTreeMt`] has the nodes of the paper in the place of those of [`VertexMt`], to compare
//! them. All are immutable once they are complete. What changes is the [`CurrentMesh`], to which updates
//! are applied through the trait [`ApplyUpdates`].

#[macro_use]
mod pages;
mod any;
mod convert;
mod edge;
mod error;
mod exact;
mod explicit;
mod facts;
mod half_edge;
mod margins;
mod mesh;
mod ranks;
mod replay;
mod stats;
mod update_errors;
mod vertex;
mod vertex_tree;

pub use any::Mt;
pub use convert::ConvertError;
pub use edge::builder::EdgeMtBuilder;
pub use edge::store::{EdgeMt, EdgeUpdate, MAX_EDGE, MAX_LINK, MAX_STAR, VertexSplit};
pub use error::{ErrorCode, PageError, UpdateError};
pub use exact::{Exact, ExactValues};
pub use explicit::check::MtFault;
pub use explicit::check::check_errors;
pub use explicit::store::{ExplicitMt, ExplicitUpdate};
pub(crate) use facts::{MtFacts, VOLUME_BINS, level_volumes};
#[doc(hidden)]
pub use half_edge::builder::{Forest, HalfEdgeBuilder, NextUpdate, by_corner};
pub use half_edge::store::{BaseMark, ForestChild, HalfEdgeMt, HalfEdgeUpdate};
#[doc(hidden)]
pub use margins::{Excess, Margins};
pub use mesh::base::{BaseMesh, BaseMeshError, MAX_FIELD_BITS, MAX_UPDATES};
#[doc(hidden)]
pub use mesh::current::mix;
pub use mesh::current::{CurrentMesh, MeshChanges};
pub(crate) use mesh::paged_array::PagedArray;
pub(crate) use mesh::tet::corner_of;
pub use replay::ReplayError;
#[doc(hidden)]
pub use replay::canonical;
pub use stats::{MtStats, stats};
pub use vertex::limits::{MAX_AROUND, MAX_INSERTED, MAX_REMOVED};
pub use vertex::store::{NodeBits, VertexMt};
pub(crate) use vertex::streaming::Insertion;
pub use vertex::tet_errors::MAX_QUARTERINGS;
pub use vertex_tree::rebuild::MOST_TRIES;
pub use vertex_tree::store::{MostNeighbors, TreeExceptions, VertexTreeMt};

use crate::geom::{Bounds, Lattice, SinglePoints, SingleValues};
use crate::mesh::{Field, VectorPart};
use enum_dispatch::enum_dispatch;
use std::ops::Range;

/// Index of an update (a node of the MT) in coarse-to-fine order: parents come before their children.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct UpdateId(pub u32);

/// A vertex of the MT: one that appears in at least one of its meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VertexId(pub u32);

/// Which kind of update an MT is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MtKind {
    /// Vertex splits whose inverse collapses an edge to its midpoint [§2.1, §4].
    Edge,
    /// Vertex insertions into star-shaped polyhedra; their inverse removes a vertex [§2.2, §5].
    Vertex,
    /// Vertex insertions whose inverse collapses a vertex onto a neighbour, stored so that any part can be read without
    /// the rest.
    HalfEdge,
    /// Updates of any kind, every tetrahedron stored [§3].
    Explicit,
}

impl MtKind {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::HalfEdge, Self::Edge, Self::Vertex, Self::Explicit];

    /// Whether MTs of this kind can come in pages of updates: see [`Mt::is_paged`].
    pub fn is_paged(self) -> bool {
        matches!(self, Self::Edge | Self::HalfEdge)
    }

    /// log2 of the updates that blocks of files have unless somebody says otherwise: fewer where each can be fetched by itself.
    pub fn usual_block_bits(self) -> u32 {
        if self == Self::HalfEdge { 8 } else { 11 }
    }

    /// The kind in one word: `half-edge`, `edge`, `vertex` or `explicit`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Edge => "edge",
            Self::Vertex => "vertex",
            Self::HalfEdge => "half-edge",
            Self::Explicit => "explicit",
        }
    }
}

/// A scalar field of an MT: name, range, and the lattice that its values live on.
///
/// The value of lattice level `q` is `origin + step · q`. Time steps of one field are fields of one name with different
/// times; they have one range and one lattice.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldInfo {
    /// The field's name.
    pub name: String,
    /// Smallest value over the reference vertices and all time steps, in field units.
    pub min: f64,
    /// Largest value over the reference vertices and all time steps, in field units.
    pub max: f64,
    /// Value of level 0.
    pub origin: f64,
    /// Distance between neighbouring levels; positive, also for a constant field.
    pub step: f64,
    /// Levels lie in `0 .. 2^bits`; 1 to 24.
    pub bits: u32,
    /// The unit of the values; empty if it is not known.
    pub unit: String,
    /// Which part of a vector or tensor the field is, if it is one.
    pub vector: Option<VectorPart>,
    /// The time that the values are of, if it is known.
    pub time: Option<f64>,
    /// The largest difference between the input's value at a reference vertex and that of the reference mesh where the input has the
    /// vertex, in field units, rounded up: what the lattice of the values rounds off and, where the lattice of the positions moves
    /// vertices, what the field changes on the way. 0 if all are exact.
    pub quantization: f64,
}

/// A nameless field of one bit, for `..FieldInfo::default()`.
impl Default for FieldInfo {
    fn default() -> Self {
        Self {
            name: String::new(),
            min: 0.0,
            max: 1.0,
            origin: 0.0,
            step: 1.0,
            bits: 1,
            unit: String::new(),
            vector: None,
            time: None,
            quantization: 0.0,
        }
    }
}

impl FieldInfo {
    /// Whether this is, by name and time, a field of the mesh that the MT was built from.
    pub fn is_of(&self, field: &Field) -> bool {
        self.name == field.name && (self.time.is_none() || self.time == field.time)
    }

    /// The value of level `q`.
    #[inline]
    pub fn value(&self, q: i32) -> f64 {
        self.origin + self.step * f64::from(q)
    }

    /// The level nearest to `value`, held inside the lattice.
    pub fn nearest(&self, value: f64) -> i32 {
        let largest = f64::from((1_u32 << self.bits) - 1);
        ((value - self.origin) / self.step).round().clamp(0.0, largest) as i32
    }

    /// `max − min`, or 1 for a constant field: the unit in which errors are relative.
    pub fn range(&self) -> f64 {
        if self.max > self.min { self.max - self.min } else { 1.0 }
    }

    /// How the values are stored in single precision, in all meshes.
    pub fn single_values(&self) -> SingleValues {
        SingleValues::of([self.min, self.max], self.step)
    }
}

/// What is known of an MT before its updates arrive.
#[derive(Clone, Debug, PartialEq)]
pub struct MtInfo {
    /// Which kind of update it is made of.
    pub kind: MtKind,
    /// The lattice of the positions.
    pub lattice: Lattice,
    /// The fields, at least one.
    pub fields: Vec<FieldInfo>,
    /// Vertices of the reference mesh.
    pub vertices: u32,
    /// Tetrahedra of the reference mesh.
    pub tetrahedra: u32,
    /// Updates of the complete MT.
    pub updates: u32,
    /// The displacement of the boundary, in model units, that counts as an error of 1 (where cells are small, less may count as
    /// one). A mesh within error `e` comes
    /// within `e · displacement_per_error` of every reference vertex, and no vertex of its boundary is further than
    /// that from the boundary of the reference mesh.
    pub displacement_per_error: f64,
    /// The largest distance between a reference vertex on the lattice and in the input, in model units, rounded up; 0 if
    /// all are exact.
    pub quantization: f64,
    /// The box around the reference mesh on the lattice, its least and its largest corner: all meshes of the MT are in it, and it is
    /// as small as can be. None if that is not known, as of files of the first minor versions: see
    /// [`find_bounds`](crate::mt::Mt::find_bounds).
    pub bounds: Option<[[i32; 3]; 2]>,
}

impl MtInfo {
    /// How points are stored in single precision, in all meshes.
    pub fn single_points(&self) -> SinglePoints {
        SinglePoints::of(&self.lattice)
    }

    /// [`MtInfo::bounds`] in model units.
    pub fn model_bounds(&self) -> Option<Bounds> {
        self.bounds.map(|[min, max]| Bounds { min: self.lattice.point(min), max: self.lattice.point(max) })
    }

    /// The error of field `field` that is left when every update is applied, as a fraction of its range: what the
    /// lattices round off. Positions count as displacements of the boundary do, not at all where any displacement would
    /// be an infinite error. No error of an update is smaller.
    pub fn floor(&self, field: usize) -> f64 {
        let moved = if self.displacement_per_error > 0.0 {
            self.quantization / self.displacement_per_error
        } else {
            0.0
        };
        self.fields.get(field).map_or(moved, |f| moved.max(f.quantization / f.range()))
    }
}

impl MtInfo {
    /// The smallest and the largest value of a field over all of its time steps, which are the fields of its name: what means the
    /// same at all times.
    ///
    /// # Panics
    /// If there is no such field.
    pub fn range_at_all_times(&self, field: usize) -> [f64; 2] {
        let name = &self.fields[field].name;
        let steps = self.fields.iter().filter(|step| step.name == *name);
        steps.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], step| {
            [low.min(step.min), high.max(step.max)]
        })
    }

    /// The largest error of a field, in its units, at the reference vertices inside a mesh within `error`, where the input has them.
    pub fn field_bound(&self, field: usize, error: f64) -> f64 {
        error.max(self.floor(field)) * self.fields[field].range()
    }

    /// How far the boundaries of a mesh within `error` and of the input are from each other at most, in model units, at the vertices of both
    /// and at the middles of their triangles and edges. Elsewhere on curved boundaries it may be a little more. Builders do not bound it at the
    /// middles of the input's triangles and edges: `docs/promises.md` has what was measured there.
    pub fn boundary_bound(&self, error: f64) -> f64 {
        error * self.displacement_per_error + self.quantization
    }

    /// The smallest error that a tetrahedron has by itself: what rounding alone can amount to, of the values
    /// at corners and of those that are compared with.
    pub fn least_own_error(&self, field: usize) -> ErrorCode {
        ErrorCode::at_least(2.0 * self.floor(field))
    }
}

/// The result of applying or undoing an update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Applied {
    /// The update is applied.
    Done,
    /// Nothing changed: this other update has to be applied (`u+`), or undone (`u−`), first.
    Blocked(UpdateId),
}

/// Sees a tetrahedron: positions at its corners and, by field, levels there, on the lattices; and its
/// [quarterings](ApplyUpdates::quarterings). Return true to stop.
pub type LookAtTet<'a> = &'a mut dyn FnMut(&[[i32; 3]; 4], &dyn Fn(usize) -> [i32; 4], u8) -> bool;

/// A Multi-Tessellation of any kind, to be read: what is known of it as a whole, and of each of its updates [§2].
#[enum_dispatch]
pub trait MultiTessellation {
    /// What is known of the MT as a whole.
    fn info(&self) -> &MtInfo;

    /// The base mesh.
    fn base(&self) -> &BaseMesh;

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

    /// The same in one field, which may be less.
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

    /// log2 of the updates of a page, which is a block in a file. Kinds without pages only know it for their files.
    fn page_bits(&self) -> u32;

    /// The updates of page `page`, which come and go together; none if there is no such page.
    fn page_updates(&self, page: u32) -> Range<u32> {
        let first = u64::from(page) << self.page_bits();
        let end = u64::from(self.info().updates);
        first.min(end) as u32..(first + (1 << self.page_bits())).min(end) as u32
    }

    /// Declares that no update which is still to come has larger errors than these, by field; until then, any may come. Without
    /// effect once all are here.
    fn set_to_come(&mut self, bounds: &[ErrorCode]);

    /// Whether page `page` is here. False for kinds without pages.
    fn has_page(&self, _page: u32) -> bool {
        false
    }

    /// Takes the updates of a page away, none of which may be applied to a mesh that is still in use; that mesh must have
    /// been told before, by [`Front::prepare_eviction`](crate::refine::Front::prepare_eviction). What needs the page must have gone before: see
    /// [`UpdatePages::needs_parents`].
    ///
    /// # Errors
    /// If the page is not here, as always for kinds without pages, or another page needs it. The MT is as it was then.
    fn remove_page(&mut self, page: u32) -> Result<(), PageError> {
        Err(PageError::Absent { page })
    }

    /// Whether a page can be used only when those on which it depends are here.
    fn needs_parents(&self) -> bool {
        true
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
    /// [`own_fall`](MultiTessellation::own_fall), and still bound those of the tetrahedron, at most [`MAX_QUARTERINGS`]; 0 where
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

    /// Appends the tetrahedra that `u+` removes from a mesh that contains all parents of `u`, but not `u`.
    ///
    /// # Errors
    /// If the MT is damaged, or the mesh is another one.
    fn find_removed(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        found: &mut Vec<u32>,
    ) -> Result<(), UpdateError>;

    /// Appends the tetrahedra that `u+` inserted into a mesh that contains `u` and none of its children.
    ///
    /// # Errors
    /// If the MT is damaged, or the mesh is another one.
    fn find_inserted(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        found: &mut Vec<u32>,
    ) -> Result<(), UpdateError>;

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
    /// after the other. Any answer will do.
    fn site(&self, mesh: &CurrentMesh, u: UpdateId) -> [i32; 3];
}

//! Selective refinement [§2.3]: from a request to the coarsest mesh that satisfies it.
//!
//! A [`Request`] says how accurate the mesh must be, and where: the union of some [`Need`]s. A tetrahedron of the
//! current mesh *violates* it when its remover has a larger error than the request allows and the tetrahedron
//! intersects the selected part. That update is then forced, its parents first, until no tetrahedron violates. The set
//! of updates this leads to is the smallest consistent set that satisfies the request, by the errors of the updates in
//! this MT; it depends neither on the order of work nor on the mesh before, because criteria are *monotone*: when a
//! tetrahedron violates, so does one of those that the update which created it removed. (Errors grow towards the base,
//! the selected part is widened by the error, and the builder adds to the error of an update by how much its new values
//! overshoot the range of those it replaces. The selection always uses the place or value at which a function is least,
//! never a bounding volume, so that the parent's tetrahedron at that place is selected, too.)
//!
//! A region and values together ([`Part::Both`]) are not monotone: updates whose tetrahedra violate it may depend on
//! updates without such tetrahedra, and would stay once they are applied. Such a request is refined from the base mesh
//! each time it changes.
//!
//! Where tetrahedra have errors of their own ([`quarterings`](crate::mt::ApplyUpdates::quarterings)), these are used,
//! and no request is monotone: a tetrahedron may have a larger error than those that its creator removed. The result is
//! the least set of updates that holds the parents of each of its members, and the update that removes any tetrahedron
//! which violates the request and is of the base mesh or created by a member. It is unique. But it cannot be reached
//! from a finer mesh by undoing updates: two updates may each be needed only because of a tetrahedron of the other one.
//! So refinement starts from the base mesh whenever the request changes, at a cost that grows with the mesh. Updates
//! that arrive only add to it.
//!
//! **Budgets.** Each violation has an excess, its error as a multiple of the allowed one. With a budget the mesh is
//! that of all updates above a threshold of excess, ties by their number; both decrease along the partial order. The
//! threshold is the smallest one that fits: no mesh within the budget has a smaller largest excess.
//!
//! **Small changes.** [`LodCriterion`] splits each need into a few *atoms*: functions of one tetrahedron and of the error of its remover. Each
//! verdict comes with a slack: how far the request may move, by [`Criterion::distance`], before it can change. [`Front`]
//! evaluates again only what has used up its slack (`timing_wheel`): tetrahedra of the current mesh, which may have come to violate the
//! request, and updates without children, which may not be needed any more. A tetrahedron that violates it forces its remover, parents
//! first; an update that is not needed is undone, and its parents are evaluated (`converge`). So the cost of a request grows with what it
//! changes. Uniform requests find their updates by error, in windows sorted by place (`uniform`, `sweep`). Budgets that are not large
//! enough compare violations in two queues (`ranked`), at a cost that grows with the mesh.
//!
//! **Rounding** could break monotony where two values are equal: regions are widened for each update by a little more than for its
//! children.
//!
//! **Missing updates.** Updates that have not arrived are ignored: the mesh is the smallest that satisfies the request
//! with the others, and the outcome says whether more are needed. When updates arrive, the tetrahedra that they remove
//! are evaluated again. Evicted updates must not be applied ([`Front::page_inserted`], [`Front::prepare_eviction`]).
//!
//! **Steps.** [`Front::step`] can be stopped after any update, with a valid mesh, and continued.

mod camera;
mod converge;
mod criterion;
mod custom;
mod frame;
mod front;
mod lod_criterion;
mod look;
mod pages;
mod palette;
mod quality;
mod ranked;
mod ranked_queues;
mod request;
mod shape;
mod single_updates;
mod steps;
mod sweep;
mod tet_minimax;
mod timing_wheel;
mod uniform;

#[doc(hidden)]
pub use criterion::{ANY, COMPONENTS, Tolerance};
pub use criterion::{BlockData, Criterion, TetData, Verdict};
#[doc(hidden)]
pub use custom::{Custom, Inside};
#[doc(hidden)]
pub use front::{Front, GoOn, Outcome};
#[doc(hidden)]
pub use lod_criterion::LodCriterion;
pub use request::{Budget, Need, Part, Region, Request, RequestError, Transfer, Values, View};

/// The most planes that a [`Region::Convex`] can have.
#[doc(hidden)]
pub const MAX_PLANES: usize = 16;

/// The work of a refinement, and the quality of the mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RefineStats {
    /// Vertices of the current mesh.
    pub vertices: u32,
    /// Tetrahedra of the current mesh.
    pub tetrahedra: u32,
    /// Updates that are applied now.
    pub applied: u32,
    /// Updates applied on the way.
    pub refined: u64,
    /// Updates undone on the way.
    pub coarsened: u64,
    /// Updates applied on the way only because others depend on them.
    pub forced: u64,
    /// Tetrahedra and updates evaluated on the way.
    pub judged: u64,
    /// The error that is guaranteed in the selected part, as a fraction of the field's range, at every vertex of the
    /// reference mesh there. What the lattices round off is part of it: see [`MtInfo::floor`](crate::mt::MtInfo::floor). With
    /// several needs, the largest one of those that measure the field.
    pub error_bound: f64,
    /// The largest ratio of error to allowed error; not above 1 if the request is satisfied.
    pub excess: f64,
    /// For each need the guaranteed error, in its own unit.
    pub bounds: Vec<f64>,
    /// Whether the mesh satisfies the request; false because of the budget, of missing data or of unfinished work.
    pub satisfied: bool,
    /// Whether data is missing: some tetrahedron may violate the request, and its remover has not arrived.
    pub missing: bool,
    /// Whether the work is finished, as far as budget and data allow. Otherwise the bounds are not known yet.
    pub done: bool,
}

impl RefineStats {
    /// Adds the work of the steps before this one.
    pub fn add_work(&mut self, before: &Self) {
        self.refined += before.refined;
        self.coarsened += before.coarsened;
        self.forced += before.forced;
        self.judged += before.judged;
    }
}

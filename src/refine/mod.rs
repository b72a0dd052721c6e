//! Selective refinement [§2.3]: from a request to the coarsest mesh that satisfies it.
//!
//! A [`Request`] says how accurate the mesh must be, and where: the union of some [`Need`]s. A tetrahedron of the current
//! mesh *violates* it when the update that removes it has a larger error than asked for and the tetrahedron meets the
//! selected part. That update is then forced, its parents first, until no tetrahedron violates. The set of updates this
//! leads to is the smallest consistent set that satisfies the request, by the errors that updates have here; it does not depend on the order of work or on the
//! mesh that one starts from, because criteria are *monotone*: when a tetrahedron violates, so does one of those that the
//! update which created it removed. (Errors grow towards the base, the selected part is widened by the error, and the
//! builder adds to the error of an update by how much its new values overshoot the range of those it replaces. What is
//! selected is always told by the place or value at which a function is least, never by a bounding volume, so that the
//! tetrahedron of the parent which holds that place is selected too.)
//!
//! A region and values together ([`Part::Both`]) are not monotone: updates whose tetrahedra violate may depend on none that
//! does, and would keep themselves once they are applied. Such a request is answered from the base mesh each time it changes.
//!
//! Where tetrahedra have errors of their own ([`quarterings`](crate::mt::ApplyUpdates::quarterings)), they are judged by
//! these, and no request is monotone: a tetrahedron may have a larger error than those it was made from. The result is the least
//! set of updates that holds the parents of each of its members, and the update that removes any tetrahedron which violates the
//! request and is of the base mesh or created by a member. It is unique. But from a finer mesh it cannot be told, by undoing
//! updates: two updates may each be there only because of a tetrahedron that the other one makes or needs. So it is found from
//! the base mesh whenever the request changes, at a cost that grows with the mesh. Updates that arrive only add to it.
//!
//! **Budgets.** Each violation has an excess, its error as a multiple of what is wanted there. With a budget the mesh is
//! that of all updates above a threshold of excess, ties by their number; both run against the partial order, never with
//! it. The threshold is the smallest one that fits: no mesh within the budget has a smaller largest excess.
//!
//! **Small changes.** Each verdict comes with a slack: how far the request may move before it can change. [`Front`] judges
//! again what has used up its slack, and nothing else, so that the cost of a request grows with what it changes.
//!
//! **What is not here.** Updates that are not here are no updates: the mesh is the smallest that satisfies the request as far as
//! those that are here go, and the answer tells whether more would be needed. When some arrive, what they remove is judged again;
//! what leaves must not be applied ([`Front::page_inserted`], [`Front::prepare_eviction`]).
//!
//! **Steps.** [`Front::step`] stops whenever it is told to, with a valid mesh, and goes on from there.

mod camera;
mod converge;
mod criterion;
mod custom;
mod front;
mod look;
mod pages;
mod palette;
mod quality;
mod ranked;
mod request;
mod shape;
mod sweep;
mod tet_minimax;
mod timing_wheel;
mod uniform;

pub use criterion::{ANY, COMPONENTS, Criterion, LodCriterion, TetData, Tolerance, Verdict};
pub use custom::Custom;
pub use front::{Front, GoOn, Outcome};
pub use request::{Budget, Need, Part, Region, Request, RequestError, Transfer, Values, View};

/// The most planes that a [`Region::Convex`] can have.
pub const MAX_PLANES: usize = 16;

/// What a refinement did, and how good the mesh is now.
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
    /// Those of the updates applied on the way that were there only because others depend on them.
    pub forced: u64,
    /// Tetrahedra and updates whose place in the request was looked at on the way.
    pub judged: u64,
    /// The error that is guaranteed in the selected part, as a fraction of the field's range, at every vertex of the
    /// reference mesh there. What the lattices round off is part of it: see [`MtInfo::floor`](crate::mt::MtInfo::floor). With
    /// several needs, the largest one of those that measure the field.
    pub error_bound: f64,
    /// How often the error exceeds what was asked for, at most; not above 1 if the request is satisfied.
    pub excess: f64,
    /// For each need the error that is guaranteed where it counts, in its own unit.
    pub bounds: Vec<f64>,
    /// Whether the mesh is what was asked for; false when the budget or missing data stopped it, or there is more to do.
    pub satisfied: bool,
    /// Whether data is missing: some tetrahedron violates the request as far as is known, and what may remove it is not here.
    pub missing: bool,
    /// Whether there is nothing more to do, as far as budget and data allow. Otherwise the bounds are not known yet.
    pub done: bool,
}

impl RefineStats {
    /// Adds what was done in the steps before this one.
    pub fn add_work(&mut self, before: &Self) {
        self.refined += before.refined;
        self.coarsened += before.coarsened;
        self.forced += before.forced;
        self.judged += before.judged;
    }
}

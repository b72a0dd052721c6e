//! Selective refinement [§2.3]: from a request to the coarsest mesh that satisfies it.
//!
//! A request says how accurate the mesh must be, and where. A tetrahedron of the current mesh *violates* it when the
//! update that removes it has a larger error than asked for and the tetrahedron meets the selected part. That update
//! is then forced, its parents first, until no tetrahedron violates. The set of updates this leads to is the
//! smallest consistent set that satisfies the request; it does not depend on the order of work or on the mesh that
//! one starts from, because criteria are *monotone*: when a tetrahedron violates, so does one of those that the
//! update which created it removed. (Errors grow towards the base, the selected part is widened by the error, and
//! the builder adds to the error of an update by how much its new values overshoot the range of those it replaces.)
//!
//! A box and isovalues together are not monotone: updates whose tetrahedra violate may depend on none that does, and
//! would keep themselves once they are applied. Such a request is answered from the base mesh each time.
//!
//! With a budget, updates come in the order of falling error, ties by their number; both run against the partial
//! order, never with it. The result is the mesh of the smallest error threshold that fits the budget: again it
//! depends on the request alone.

mod criterion;
mod front;

pub use criterion::{Criterion, LodCriterion};
pub use front::{Front, Outcome};

use crate::geom::Bounds;

/// What mesh is wanted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Request {
    /// Largest error wanted, as a fraction of the field's range (0.01 is 1 %); 0 is the reference mesh, infinity the
    /// base mesh. It binds all fields of the MT, each relative to its own range. Not negative, not NaN.
    pub error: f64,
    /// Only inside this box, in model units; everywhere else the coarsest mesh will do. None is everywhere.
    pub roi: Option<Bounds>,
    /// Only where the field passes one of these values (field units); everywhere if empty. Together with a box: where
    /// both hold.
    pub isovalues: Vec<f64>,
    /// Which field the isovalues refer to: an index into [`MtInfo::fields`](crate::mt::MtInfo::fields).
    pub field: usize,
    /// At most so many tetrahedra, though never fewer than the base mesh has; no limit if none.
    pub max_tets: Option<u32>,
}

/// What a refinement did, and how good the mesh is now.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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
    /// The error that is guaranteed in the selected part, as a fraction of the field's range, at every vertex of the
    /// reference mesh there. The rounding to the lattices, half a step, is not in it.
    pub error_bound: f64,
    /// Whether that is what was asked for; false when the budget or missing data stopped it.
    pub satisfied: bool,
}

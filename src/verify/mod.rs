//! Does an MT keep its promises? Every one of them, re-checked against the mesh that it was built from.
//!
//! Nothing here trusts what refinement says of itself: meshes are checked from their plain arrays, errors are
//! measured at every reference vertex, and every request is answered twice, from the base mesh and from whatever
//! mesh the request before it left.
//!
//! What is promised and checked, for uniform requests, boxes, isovalues, combinations and budgets:
//! - **Full circle**: error 0 gives the reference mesh, tetrahedron for tetrahedron, on the lattice; error ∞ the base.
//!   Where the MT was built from points, the mesh that it gives at error 0 has those points and no others.
//! - **Valid meshes**: positive tetrahedra, faces shared by at most two, complete and symmetric adjacency, a closed
//!   boundary, the reference mesh's Euler number, no vertex without a tetrahedron.
//! - **Error**: within the bound that is reported, or half a level where that is more, at every selected reference
//!   vertex. Where the boundary has moved, a place on it that is near enough counts: a displacement `d` is an error
//!   of `d / displacement_per_error`.
//! - **Boundary**: no vertex of the extracted boundary is further from the reference boundary than the bound allows.
//! - **Isovalues**: a reference vertex whose error is larger lies on the same side of every isovalue as all of its
//!   tetrahedron, so no part of an isosurface is missed and none is shown that is less accurate than asked for.
//! - **Answers**: `satisfied` and the bound are true, budgets are kept, and the same request gives the same mesh
//!   whatever was asked for before.

mod deviation;
mod mesh_checks;
mod points;
mod queries;
mod same;
mod triangles;

use crate::mesh::TetMesh;
use crate::mt::ErrorCode;
use crate::mt::MultiTessellation;
use crate::refine::Criterion;
use crate::refine::Front;
use crate::refine::LodCriterion;
use crate::refine::Outcome;
use crate::refine::TetLook;
use deviation::Deviation;
use mesh_checks::PlainMesh;
use queries::Query;
use queries::Wish;

/// What came of a verification.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VerifyReport {
    /// Whether every promise was kept.
    pub valid: bool,
    /// Requests that were made, each from the base mesh and from another mesh.
    pub queries: u32,
    /// The largest measured error as a fraction of what was promised there; at most 1 if the promise was kept.
    pub worst_error_ratio: f64,
    /// Promises that were broken: the request, the place and the numbers. At most [`MAX_FAILURES`].
    pub failures: Vec<String>,
}

/// No more failures than this are described.
pub const MAX_FAILURES: usize = 50;

/// What the reference mesh of an MT has in common with the input that it was built from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// Everything: it is the input, tetrahedron for tetrahedron.
    Mesh,
    /// The points, and the volume if the input has tetrahedra: it is a triangulation of the points.
    Points,
}

/// Checks `mt` against `input`, what it was built from (repaired if need be: [`crate::mesh::repair`]).
/// `on_progress` is told how many of how many steps are done.
pub fn run<M: MultiTessellation>(
    mt: &M,
    input: &TetMesh,
    reference: Reference,
    on_progress: &mut dyn FnMut(u32, u32),
) -> VerifyReport {
    let mut report = VerifyReport::default();
    let verified = match reference {
        Reference::Mesh => verify(mt, input, on_progress, &mut report),
        Reference::Points => {
            points::triangulated(mt, input).and_then(|mesh| verify(mt, &mesh, on_progress, &mut report))
        }
    };
    if let Err(failures) = verified {
        report.failures.push(failures);
    }
    report.valid = report.failures.is_empty();
    report
}

/// Failures that leave nothing more to check are returned, the others noted.
fn verify<M: MultiTessellation>(
    mt: &M,
    input: &TetMesh,
    on_progress: &mut dyn FnMut(u32, u32),
    report: &mut VerifyReport,
) -> Result<(), String> {
    let deviation = Deviation::new(mt.info(), input)?;
    let base = fresh(mt)?;
    let reference = check_full_circle(mt, &deviation, report)?;
    let queries = queries::of(mt, input);
    let steps = 2 * queries.len() as u32;
    let mut hashes = Vec::with_capacity(queries.len());
    for (i, query) in (0..).zip(&queries) {
        on_progress(i, steps);
        let mut front = base.clone();
        let outcome = satisfy(mt, &mut front, query)?;
        let exact = Wish { error: 0.0, ..query.wish.clone() };
        let everything = LodCriterion::new(mt.info(), &exact.request());
        let case = Case { mt, query, front: &front, outcome: &outcome, everything };
        case.check(&base, &reference, &deviation, report);
        hashes.push(front.mesh().hash());
        report.queries += 1;
    }
    walk(mt, base, &queries, &hashes, on_progress, report)
}

fn fresh(mt: &impl MultiTessellation) -> Result<Front, String> {
    Front::new(mt).map_err(|error| format!("the base mesh: {error}"))
}

fn satisfy(mt: &impl MultiTessellation, front: &mut Front, query: &Query) -> Result<Outcome, String> {
    let outcome = front.satisfy(mt, &query.criterion(mt.info()), query.wish.budget());
    outcome.map_err(|error| format!("{query}: the MT is damaged: {error}"))
}

fn note(report: &mut VerifyReport, place: &dyn std::fmt::Display, failure: &str) {
    if report.failures.len() < MAX_FAILURES {
        report.failures.push(format!("{place}: {failure}"));
    }
}

/// Refines the base mesh to the reference mesh and coarsens it again. Returns what is to hold of every mesh.
fn check_full_circle(
    mt: &impl MultiTessellation,
    deviation: &Deviation<'_>,
    report: &mut VerifyReport,
) -> Result<mesh_checks::Shape, String> {
    let mut front = fresh(mt)?;
    let base = front.mesh().hash();
    let full = Query::new("full refinement", Wish::default());
    let outcome = satisfy(mt, &mut front, &full)?;
    if !outcome.satisfied || outcome.error != ErrorCode::ZERO || front.applied_count() != mt.updates() {
        let (applied, all) = (front.applied_count(), mt.updates());
        note(report, &full, &format!("{applied} of {all} updates applied, error bound {:?}", outcome.error));
    }
    let extracted = PlainMesh::of(front.mesh());
    if let Err(failure) = same::check(&extracted, &deviation.reference()) {
        note(report, &full, &failure);
    }
    let none = Query::new("full coarsening", Wish { error: f64::INFINITY, ..Wish::default() });
    satisfy(mt, &mut front, &none)?;
    if front.applied_count() != 0 || front.mesh().hash() != base {
        note(report, &none, "what is left is not the base mesh");
    }
    mesh_checks::Shape::of(&deviation.reference()).map_err(|failure| format!("the input: {failure}"))
}

/// Answers all queries again, in an order that jumps about, from the mesh that the query before left.
fn walk(
    mt: &impl MultiTessellation,
    mut front: Front,
    queries: &[Query],
    hashes: &[u64],
    on_progress: &mut dyn FnMut(u32, u32),
    report: &mut VerifyReport,
) -> Result<(), String> {
    let count = queries.len();
    let stride = (count / 3..).find(|&s| s > 0 && coprime(s, count)).unwrap_or(1);
    for step in 0..count {
        on_progress((count + step) as u32, 2 * count as u32);
        let i = step * stride % count;
        satisfy(mt, &mut front, &queries[i])?;
        if front.mesh().hash() != hashes[i] {
            note(report, &queries[i], "the mesh depends on what was asked for before");
            front = fresh(mt)?;
        }
    }
    Ok(())
}

fn coprime(mut a: usize, mut b: usize) -> bool {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a == 1
}

/// One query and its answer.
struct Case<'a, M> {
    mt: &'a M,
    query: &'a Query,
    front: &'a Front,
    outcome: &'a Outcome,
    /// The same part with an error of 0: asks wherever there is any error at all.
    everything: LodCriterion,
}

impl<M: MultiTessellation> Case<'_, M> {
    fn check(
        &self,
        base: &Front,
        reference: &mesh_checks::Shape,
        deviation: &Deviation<'_>,
        report: &mut VerifyReport,
    ) {
        let mesh = PlainMesh::of(self.front.mesh());
        // Without a valid mesh there is nothing to measure.
        if let Err(failure) = mesh.check(reference) {
            return note(report, self.query, &failure);
        }
        let checks = [self.check_answer(&mesh), self.check_budget(&mesh, base)];
        checks.iter().filter_map(|c| c.as_ref().err()).for_each(|failure| note(report, self.query, failure));
        let measured = deviation.measure(&mesh, &self.errors(&mesh), &self.query.wish, self.bound());
        report.worst_error_ratio = report.worst_error_ratio.max(measured.worst_ratio);
        measured.failures.iter().for_each(|failure| note(report, self.query, failure));
    }

    fn bound(&self) -> f64 {
        self.outcome.error.error()
    }

    /// The error of each tetrahedron: that of the update which removes it.
    fn errors(&self, mesh: &PlainMesh<'_>) -> Vec<f64> {
        let error = |t: u32| self.mt.remover(mesh.mesh, t).map_or(0.0, |u| self.mt.error(u).error());
        (0..mesh.tets.len() as u32).map(error).collect()
    }

    /// Is what refinement says of the mesh true?
    fn check_answer(&self, mesh: &PlainMesh<'_>) -> Result<(), String> {
        let mut largest = 0.0_f64;
        for (t, tet) in (0..).zip(mesh.tets) {
            let Some(update) = self.mt.remover(mesh.mesh, t) else { continue };
            let corners = tet.map(|v| mesh.positions[v as usize]);
            let levels = |field: usize| tet.map(|v| mesh.mesh.levels(v)[field]);
            let error = self.mt.error(update);
            let look = TetLook { corners: &corners, levels: &levels, error, update };
            if error.error() > largest && self.everything.judge(&look).asks() {
                largest = error.error();
            }
        }
        let (reported, satisfied) = (self.bound(), self.outcome.satisfied);
        if largest > reported {
            return Err(format!("the error bound is {largest}, not {reported} as reported"));
        }
        if satisfied != (largest <= self.query.wish.error) {
            let answer = if satisfied { "satisfied" } else { "not satisfied" };
            return Err(format!("reported as {answer}, with an error bound of {largest}"));
        }
        if !satisfied && self.query.wish.max_tets.is_none() {
            return Err(format!("nothing stood in the way, but the error bound is {largest}"));
        }
        Ok(())
    }

    fn check_budget(&self, mesh: &PlainMesh<'_>, base: &Front) -> Result<(), String> {
        let least = base.mesh().tet_count();
        match self.query.wish.max_tets {
            Some(budget) if mesh.tets.len() > (budget as usize).max(least) => {
                Err(format!("{} tetrahedra, more than the budget and the base mesh", mesh.tets.len()))
            }
            _ => Ok(()),
        }
    }
}

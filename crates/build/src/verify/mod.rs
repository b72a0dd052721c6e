//! Verification: checks all guarantees of an MT against the mesh that it was built from.
//!
//! Verification does not rely on the results of refinement: it checks meshes from their plain arrays, measures errors
//! at every reference vertex, and compares each mesh with what follows from a list of all tetrahedra of the MT; only which mesh is the best
//! within a budget, it asks of refinement from the base mesh.
//!
//! It checks, for regions, values, views, transfer functions, their unions, and budgets:
//! - **Full circle**: error 0 gives the reference mesh, tetrahedron for tetrahedron, on the lattice; error ∞ the base.
//!   Where the MT was built from points, the mesh that it gives at error 0 has those points and no others.
//! - **Order**: the error of an update is at least that of every update that depends on it, and by as much larger as requests for
//!   values rely on.
//! - **Valid meshes**: positive tetrahedra, faces shared by at most two, complete and symmetric adjacency, a closed
//!   boundary, no vertex without a tetrahedron, and the topology of the reference mesh: its components, the surfaces of its boundary, the
//!   Euler numbers of both (which give its tunnels and cavities), and the vertices at which the boundary touches itself.
//! - **Error**: within the bound of each need, or what the lattices round off ([`MtInfo::floor`](tetralod::mt::MtInfo::floor)) where
//!   that is more, at every reference vertex in its part, where the input has it.
//!   Of those that the boundary has left outside, a place on it that is near enough counts: a displacement `d` is an error
//!   of `d / displacement_per_error`. In a view, the error is compared with the one that fills the pixels at that vertex; with a
//!   transfer function, the colour of the interpolated value with that of the vertex.
//! - **Boundary**: neither boundary, the extracted and the reference one, is further from the other than the bound allows: at its
//!   vertices, and at the middles of its faces and edges.
//! - **Isovalues**: a reference vertex whose error is larger lies on the same side of every range of values as all of
//!   its tetrahedron, so every part of an isosurface is present and as accurate as requested.
//! - **Answers**: `satisfied` and the bounds are true, budgets are kept, a larger budget never has a larger excess, and
//!   the same request gives the same mesh after any other request and in any steps, that of the updates which the request needs; repeating
//!   it changes nothing.
//! - **History**: a hundred more requests, for values all over the range (of large meshes, mostly in parts), for boxes and for cameras that
//!   move, some with budgets, in random order: from the base mesh, from those of other requests, and by way of the reference mesh.
//! - **Steps**: between them the mesh is valid and within the budget.
//!
//! [`run_shown`] checks what a session makes of its meshes.

mod deviation;
mod expected;
mod history;
mod mesh_checks;
mod parts;
mod points;
mod queries;
mod same;
mod samples;
mod shown;
mod surfaces;

pub use samples::{SampleRequest, run_request, samples};
pub use shown::run_shown;

use deviation::{Deviation, TetErrors};
use expected::Expected;
use history::Numbers;
use mesh_checks::PlainMesh;
use queries::Query;
use serde::Serialize;
use std::sync::Arc;
use tetralod::mesh::TetMesh;
use tetralod::mt::{ApplyUpdates, ErrorCode, check_errors};
use tetralod::refine::{Criterion, Front, LodCriterion, Need, Outcome, Part, Request, TetData};

/// The result of a verification.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct VerifyReport {
    /// Whether all checks passed.
    pub valid: bool,
    /// Requests that were made and checked.
    pub queries: u32,
    /// The largest measured error as a fraction of the guaranteed one; at most 1 if the guarantee holds.
    pub worst_error_ratio: f64,
    /// Failed checks: the request, the place and the numbers. At most [`MAX_FAILURES`].
    pub failures: Vec<String>,
}

impl VerifyReport {
    /// Adds what other checks of the same MT have found.
    pub fn add(&mut self, other: Self) {
        self.valid &= other.valid;
        self.queries += other.queries;
        self.worst_error_ratio = self.worst_error_ratio.max(other.worst_error_ratio);
        self.failures.extend(other.failures);
        self.failures.truncate(MAX_FAILURES);
    }
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

/// Checks `mt` against `input`, what it was built from (repaired if need be: [`tetralod::mesh::repair`]), with requests of
/// every kind. `on_progress` gets the number of steps done and of all steps.
pub fn run<M: ApplyUpdates>(
    mt: &M,
    input: &TetMesh,
    reference: Reference,
    on_progress: &mut dyn FnMut(u32, u32),
) -> VerifyReport {
    let plan = |input: &TetMesh| Plan {
        queries: queries::of(mt, input),
        histories: history::requests(mt, input),
        vertices: usize::MAX,
    };
    with(mt, input, reference, &plan, on_progress)
}

/// The extent of a partial verification, for very large meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample {
    /// The most requests of each sort: those whose meshes are checked in full, and those of the history check.
    pub requests: usize,
    /// About so many reference vertices, spread over the mesh, at which errors are measured.
    pub vertices: usize,
}

impl Default for Sample {
    fn default() -> Self {
        Self { requests: 12, vertices: 20_000 }
    }
}

impl Sample {
    /// Some of the queries, from all over the list.
    fn of(&self, queries: Vec<Query>) -> Vec<Query> {
        let count = queries.len();
        let taken = self.requests.min(count);
        // The i-th one of those that are taken is number i * count / taken.
        let is_taken = |i: usize| (i * taken) % count < taken;
        queries.into_iter().enumerate().filter(|(i, _)| is_taken(*i)).map(|(_, query)| query).collect()
    }
}

/// [`run`] on a sample of the requests and of the reference vertices: for very large meshes. Checks that need no
/// request, and the validity of the meshes, are complete.
pub fn run_sample<M: ApplyUpdates>(
    mt: &M,
    input: &TetMesh,
    reference: Reference,
    sample: Sample,
    on_progress: &mut dyn FnMut(u32, u32),
) -> VerifyReport {
    let plan = |input: &TetMesh| Plan {
        queries: sample.of(queries::of(mt, input)),
        histories: sample.of(history::requests(mt, input)),
        vertices: sample.vertices,
    };
    with(mt, input, reference, &plan, on_progress)
}

/// [`run`] with requests of the caller's own.
pub fn run_requests<M: ApplyUpdates>(
    mt: &M,
    input: &TetMesh,
    reference: Reference,
    requests: &[Request],
    on_progress: &mut dyn FnMut(u32, u32),
) -> VerifyReport {
    let named = |(i, request): (usize, &Request)| Query::new(&format!("request {i}"), request.clone());
    let plan = |_: &TetMesh| Plan {
        queries: requests.iter().enumerate().map(named).collect(),
        histories: Vec::new(),
        vertices: usize::MAX,
    };
    with(mt, input, reference, &plan, on_progress)
}

/// The requests to make.
struct Plan {
    /// Requests whose meshes are checked in full.
    queries: Vec<Query>,
    /// Requests for which only is checked that each has the mesh which it needs, whatever was asked for before.
    histories: Vec<Query>,
    /// About how many reference vertices are measured.
    vertices: usize,
}

fn with<M: ApplyUpdates>(
    mt: &M,
    input: &TetMesh,
    reference: Reference,
    plan: &dyn Fn(&TetMesh) -> Plan,
    on_progress: &mut dyn FnMut(u32, u32),
) -> VerifyReport {
    let mut report = VerifyReport::default();
    let mut check = |input: &TetMesh| verify(mt, input, &plan(input), on_progress, &mut report);
    let verified = match reference {
        Reference::Mesh => check(input),
        Reference::Points => points::triangulated(mt, input).and_then(|mesh| check(&mesh)),
    };
    if let Err(failures) = verified {
        report.failures.push(failures);
    }
    report.valid = report.failures.is_empty();
    report
}

/// Returns failures after which nothing can be checked; notes the others.
fn verify<M: ApplyUpdates>(
    mt: &M,
    input: &TetMesh,
    Plan { queries, histories, vertices }: &Plan,
    on_progress: &mut dyn FnMut(u32, u32),
    report: &mut VerifyReport,
) -> Result<(), String> {
    let mut deviation = Deviation::new(mt.info(), input, *vertices)?;
    let untouched = fresh(mt)?;
    let (reference, base) = check_full_circle(mt, &deviation, report)?;
    check_order(mt, report);
    let expected = Expected::of(mt)?;
    let first = queries.len() as u32;
    let steps = first + histories.len() as u32;
    // From a mesh that has never been refined: what others remember of updates must not count.
    let mut walk = Walk { mt, base: &base, shape: &reference, front: untouched.clone(), numbers: Numbers(1) };
    let mut excesses = vec![0.0; queries.len()];
    for (step, i) in (0..).zip(mixed(queries.len())) {
        on_progress(step, steps);
        let query = &queries[i];
        let outcome = walk.answer(query, report)?;
        excesses[i] = outcome.excess;
        report.queries += 1;
        Case { mt, query, front: &walk.front, outcome: &outcome }.check(
            &base,
            &reference,
            &mut deviation,
            report,
        );
        let hash = expected::hash(walk.front.mesh());
        if hash == expected.hash(mt, &base, query)? {
            walk.ask_again(query, hash, report)?;
        } else {
            note(report, query, NOT_EXPECTED);
            walk.front = untouched.clone();
        }
    }
    check_monotone(queries, &excesses, report);
    let fronts = [&untouched, &base];
    history::check(mt, &expected, fronts, histories, &mut |i| on_progress(first + i, steps), report)
}

/// A mesh that is not a function of the request alone.
const NOT_EXPECTED: &str = "the mesh is not that of the updates which the request needs";

/// All numbers below `count`, neighbours far apart.
fn mixed(count: usize) -> impl Iterator<Item = usize> {
    let stride = (count / 3..).find(|&s| s > 0 && coprime(s, count)).unwrap_or(1);
    (0..count).map(move |step| step * stride % count)
}

/// Of two requests that differ in their budgets alone, the one with the larger budget must not have a larger excess.
fn check_monotone(queries: &[Query], excesses: &[f64], report: &mut VerifyReport) {
    let most = |limit: Option<u64>| limit.unwrap_or(u64::MAX);
    for (small, less) in queries.iter().zip(excesses) {
        for (large, more) in queries.iter().zip(excesses) {
            let [a, b] = [small, large].map(|query| &query.request.budget);
            let allows = most(a.tets.map(u64::from)) <= most(b.tets.map(u64::from))
                && most(a.vertices.map(u64::from)) <= most(b.vertices.map(u64::from))
                && most(a.bytes) <= most(b.bytes);
            if allows && more > less && small.request.needs == large.request.needs {
                note(report, large, &format!("an excess of {more}, but one of {less} with a smaller budget"));
            }
        }
    }
}

fn fresh(mt: &impl ApplyUpdates) -> Result<Front, String> {
    Front::new(mt).map_err(|error| format!("the base mesh: {error}"))
}

fn satisfy(mt: &impl ApplyUpdates, front: &mut Front, query: &Query) -> Result<Outcome, String> {
    let outcome = front.satisfy(mt, &query.criterion(mt.info()), query.request.budget);
    outcome.map_err(|error| format!("{query}: the MT is damaged: {error}"))
}

fn note(report: &mut VerifyReport, place: &dyn std::fmt::Display, failure: &str) {
    if report.failures.len() < MAX_FAILURES {
        report.failures.push(format!("{place}: {failure}"));
    }
}

/// Refines the base mesh to the reference mesh and coarsens it again. Returns the properties that every mesh must have, and the base
/// mesh that is left: it remembers what updates do, so that requests from it take less time.
fn check_full_circle(
    mt: &impl ApplyUpdates,
    deviation: &Deviation<'_>,
    report: &mut VerifyReport,
) -> Result<(mesh_checks::Shape, Front), String> {
    let mut front = fresh(mt)?;
    let base = front.mesh().hash();
    let full = Query::new("full refinement", Request::within(0.0));
    let outcome = satisfy(mt, &mut front, &full)?;
    if !outcome.satisfied || outcome.error != ErrorCode::ZERO || front.applied_count() != mt.updates() {
        let (applied, all) = (front.applied_count(), mt.updates());
        note(report, &full, &format!("{applied} of {all} updates applied, error bound {:?}", outcome.error));
    }
    let extracted = PlainMesh::of(front.mesh());
    if let Err(failure) = same::check(&extracted, &deviation.reference()) {
        note(report, &full, &failure);
    }
    let none = Query::new("full coarsening", Request::within(f64::INFINITY));
    satisfy(mt, &mut front, &none)?;
    if front.applied_count() != 0 || front.mesh().hash() != base {
        note(report, &none, "what is left is not the base mesh");
    }
    let shape = mesh_checks::Shape::of(&deviation.reference());
    Ok((shape.map_err(|failure| format!("the input: {failure}"))?, front))
}

/// Checks that errors do not grow from an update to those that depend on it; refinement relies on that.
fn check_order(mt: &impl ApplyUpdates, report: &mut VerifyReport) {
    let place = &"errors along the partial order";
    match check_errors(mt) {
        Ok(None) => {}
        Ok(Some(fault)) => note(report, place, &fault.to_string()),
        Err(error) => note(report, place, &error.to_string()),
    }
}

/// Makes requests in steps, each from the mesh of the one before.
struct Walk<'a, M> {
    mt: &'a M,
    base: &'a Front,
    shape: &'a mesh_checks::Shape,
    front: Front,
    /// For the lengths of steps, from one update to many of them.
    numbers: Numbers,
}

/// The most steps of a request.
const MOST_STEPS: u32 = 5;

impl<M: ApplyUpdates> Walk<'_, M> {
    fn answer(&mut self, query: &Query, report: &mut VerifyReport) -> Result<Outcome, String> {
        let criterion = Arc::new(query.criterion(self.mt.info()));
        self.front.request(self.mt, criterion, query.request.budget);
        for step in 1..MOST_STEPS {
            let most = 1 << (self.numbers.next() % 16);
            let outcome = self.step(query, most)?;
            if outcome.done {
                return Ok(outcome);
            }
            let mesh = PlainMesh::of(self.front.mesh());
            let checked = check_budget(query, &mesh, self.base);
            // A check of the whole mesh takes time: once for each request is enough.
            let checked = if step > 1 { checked } else { checked.and_then(|()| mesh.check(self.shape)) };
            if let Err(failure) = checked {
                note(report, query, &format!("between steps, {failure}"));
            }
        }
        let outcome = self.step(query, u64::MAX)?;
        if !outcome.done {
            note(report, query, "stopped although nothing stood in the way");
        }
        Ok(outcome)
    }

    /// Goes on until so many updates have been applied or undone.
    fn step(&mut self, query: &Query, most: u64) -> Result<Outcome, String> {
        let outcome = self.front.step(self.mt, &mut |done| done.refined + done.coarsened < most);
        outcome.map_err(|error| format!("{query}: the MT is damaged: {error}"))
    }

    /// Makes the request again that has just been answered by the mesh with this hash.
    fn ask_again(&mut self, query: &Query, hash: u64, report: &mut VerifyReport) -> Result<(), String> {
        let again = satisfy(self.mt, &mut self.front, query)?;
        if again.refined + again.coarsened > 0 || expected::hash(self.front.mesh()) != hash {
            note(report, query, "asked for again, the mesh changes");
        }
        Ok(())
    }
}

fn check_budget(query: &Query, mesh: &PlainMesh<'_>, base: &Front) -> Result<(), String> {
    let (vertices, tets) = (mesh.positions.len(), mesh.tets.len());
    let is_base = tets == base.mesh().tet_count() && vertices == base.mesh().vertex_count();
    if is_base || query.request.budget.holds(vertices, tets) {
        return Ok(());
    }
    Err(format!("{tets} tetrahedra and {vertices} vertices, more than the budget and the base mesh"))
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
}

/// The mesh that a query was answered with, and what its MT tells of it.
struct Told<'a> {
    mesh: &'a PlainMesh<'a>,
    errors: &'a TetErrors,
}

/// Errors that are smaller than this, in whatever unit, are judged as this: ratios to 0 mean nothing.
const LEAST: f64 = 1.0 / (1_u64 << 20) as f64;

impl<M: ApplyUpdates> Case<'_, M> {
    fn check(
        &self,
        base: &Front,
        reference: &mesh_checks::Shape,
        deviation: &mut Deviation<'_>,
        report: &mut VerifyReport,
    ) {
        let mesh = PlainMesh::of(self.front.mesh());
        // Without a valid mesh there is nothing to measure.
        if let Err(failure) = mesh.check(reference) {
            return note(report, self.query, &failure);
        }
        let errors = TetErrors::of(self.mt, mesh.mesh);
        let told = Told { mesh: &mesh, errors: &errors };
        let checks = [self.check_answer(&told), check_budget(self.query, &mesh, base)];
        checks.iter().filter_map(|c| c.as_ref().err()).for_each(|failure| note(report, self.query, failure));
        let needs = &self.query.request.needs;
        let bounds: Vec<f64> = needs.iter().map(|need| self.bound(need, &told)).collect();
        let asks = deviation.asks(needs, &bounds);
        let measured = deviation.measure(&mesh, &errors, &asks);
        report.worst_error_ratio = report.worst_error_ratio.max(measured.worst_ratio);
        measured.failures.iter().for_each(|failure| note(report, self.query, failure));
    }

    /// What is guaranteed where a need counts, in its unit.
    fn bound(&self, need: &Need, told: &Told<'_>) -> f64 {
        let reported = self.outcome.error.error();
        match need.part {
            Part::View(_) | Part::Transfer(_) => {
                if self.outcome.satisfied {
                    return need.error;
                }
                let judged = Need { error: need.error.max(LEAST), ..need.clone() };
                judged.error * self.largest(told, judged.into()).1
            }
            _ if self.outcome.satisfied => reported.min(need.error),
            _ if self.query.request.needs.len() == 1 => reported,
            _ => self.largest(told, need.clone().into()).0.max(ErrorCode::at_most(need.error)).error(),
        }
    }

    /// The largest error and the largest excess of all tetrahedra that violate a request; 0 and 1 if none does.
    fn largest(&self, told: &Told<'_>, request: Request) -> (ErrorCode, f64) {
        let criterion = LodCriterion::new(self.mt.info(), &request);
        let mut largest = (ErrorCode::ZERO, 1.0);
        for (t, tet) in (0..).zip(told.mesh.tets) {
            let Some(update) = told.errors.remover(t) else { continue };
            let corners = tet.map(|v| told.mesh.positions[v as usize]);
            let levels = |field: usize| tet.map(|v| told.mesh.mesh.levels(v)[field]);
            let errors = told.errors.of_tet(t);
            let error = errors.iter().max().copied().unwrap_or_default();
            let look = TetData { corners: &corners, levels: &levels, error, errors, update };
            // What it exceeds by costs more, and is asked for only where it exceeds at all.
            if criterion.judge(&look).violates() {
                let error = look.error_of(criterion.field());
                largest = (largest.0.max(error), f64::max(largest.1, criterion.rank(&look).excess));
            }
        }
        largest
    }

    /// Checks the statistics of refinement.
    fn check_answer(&self, told: &Told<'_>) -> Result<(), String> {
        let request = &self.query.request;
        let Outcome { error: reported, excess, satisfied, done, .. } = *self.outcome;
        if !done {
            return Err("stopped although nothing stood in the way".to_owned());
        }
        let (_, violation) =
            self.largest(told, Request { needs: request.needs.clone(), ..Request::default() });
        if satisfied != (violation <= 1.0) || satisfied && excess > 1.0 {
            let answer = if satisfied { "satisfied" } else { "not satisfied" };
            return Err(format!("reported as {answer}, with an excess of {violation}"));
        }
        if !satisfied && excess < violation {
            return Err(format!("the excess is {violation}, not {excess} as reported"));
        }
        if !satisfied && request.budget.is_unlimited() {
            return Err(format!("nothing stood in the way, but the excess is {violation}"));
        }
        let of_field = |need: &&Need| !matches!(need.part, Part::View(_) | Part::Transfer(_));
        let exact = |need: &Need| Need { error: 0.0, ..need.clone() };
        // Each need by itself: they may measure different fields.
        let alone = |need: Need| self.largest(told, need.into()).0;
        let needs = request.needs.iter().filter(of_field).map(exact);
        let largest = needs.map(alone).fold(ErrorCode::ZERO, ErrorCode::max);
        if largest > reported {
            return Err(format!(
                "the error bound is {}, not {} as reported",
                largest.error(),
                reported.error()
            ));
        }
        Ok(())
    }
}

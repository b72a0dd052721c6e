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
//! - **Regions**, if the MT has some: those of the input; and the interface between each two has the same area, as a vector, and the same volume
//!   behind it in all meshes, to the last digit, unless interfaces were allowed to move.
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
//! - **Extremes**: the input has the smallest and the largest value of each field where the MT states them, and averaging fields at cells
//!   has changed as much as it states.
//! - **Steps**: between them the mesh is valid and within the budget.
//!
//! [`run_shown`] checks what a session makes of its meshes.
//!
//! Files that are too large for all that are checked by [`samples()`]: single requests, against the input near them.

mod case;
mod deviation;
mod expected;
mod extremes;
mod fronts;
mod history;
mod mesh_checks;
mod parts;
mod points;
mod queries;
mod regions;
mod report;
mod same;
mod samples;
mod shown;
mod split;
mod surfaces;

#[doc(hidden)]
pub use queries::Query as SampleRequest;
#[doc(hidden)]
pub use report::MAX_FAILURES;
pub use report::VerifyReport;
#[doc(hidden)]
pub use samples::{GridValues, run_request, samples};
#[doc(hidden)]
pub use shown::run_shown;
#[doc(hidden)]
pub use split::split;

use case::{Case, check_budget};
use deviation::Deviation;
use expected::{Expected, NOT_EXPECTED};
use fronts::{fresh, satisfy};
use history::Numbers;
use mesh_checks::PlainMesh;
use queries::Query;
use regions::KeptRegions;
use report::note;
use std::sync::Arc;
use tetralod::mesh::TetMesh;
use tetralod::mt::{ApplyUpdates, ErrorCode, check_errors};
use tetralod::refine::{Front, Outcome, Request};

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
#[doc(hidden)]
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
#[doc(hidden)]
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
#[doc(hidden)]
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
    VerifyReport::of(|report| {
        extremes::check(mt.info(), input, report);
        let mut check = |input: &TetMesh| verify(mt, input, &plan(input), on_progress, report);
        match reference {
            Reference::Mesh => check(input),
            Reference::Points => points::triangulated(mt, input).and_then(|mesh| check(&mesh)),
        }
    })
}

/// Returns failures after which nothing can be checked; notes the others.
fn verify<M: ApplyUpdates>(
    mt: &M,
    input: &TetMesh,
    Plan { queries, histories, vertices }: &Plan,
    on_progress: &mut dyn FnMut(u32, u32),
    report: &mut VerifyReport,
) -> Result<(), String> {
    let mut deviation = Deviation::new(mt.info(), mt.regions(), input, *vertices)?;
    let untouched = fresh(mt)?;
    let kept = mt.regions().map(|regions| KeptRegions::of(regions, &PlainMesh::of(untouched.mesh())));
    let kept = kept.transpose()?;
    let (reference, base) = check_full_circle(mt, &deviation, (kept.as_ref(), input), report)?;
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
        Case { mt, query, front: &walk.front, outcome: &outcome, kept: kept.as_ref() }.check(
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

/// Refines the base mesh to the reference mesh and coarsens it again. Returns the properties that every mesh must have, and the base
/// mesh that is left: it remembers what updates do, so that requests from it take less time.
fn check_full_circle(
    mt: &impl ApplyUpdates,
    deviation: &Deviation<'_>,
    (kept, input): (Option<&KeptRegions<'_>>, &TetMesh),
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
    let checked =
        kept.map_or(Ok(()), |kept| kept.check_reference(&extracted, (&deviation.reference(), input)));
    if let Err(failure) = checked {
        note(report, &full, &failure);
    }
    let none = Query::new("full coarsening", Request::within(f64::INFINITY));
    satisfy(mt, &mut front, &none)?;
    if front.applied_count() != 0 || front.mesh().hash() != base {
        note(report, &none, "what is left is not the base mesh");
    }
    let shape = mesh_checks::Shape::of(&deviation.joined());
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

fn coprime(mut a: usize, mut b: usize) -> bool {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a == 1
}

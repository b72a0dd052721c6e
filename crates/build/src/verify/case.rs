//! A query and its answer: whether the mesh is valid, within its bound, and what refinement said of it.

use super::deviation::{Deviation, TetErrors};
use super::mesh_checks::{self, PlainMesh};
use super::queries::Query;
use super::regions::KeptRegions;
use super::report::{VerifyReport, note};
use tetralod::mt::{ApplyUpdates, ErrorCode};
use tetralod::refine::{Criterion, Front, LodCriterion, Need, Outcome, Part, Request, TetData};

/// Checks that a mesh is within the budget of its query, or the base mesh.
pub(super) fn check_budget(query: &Query, mesh: &PlainMesh<'_>, base: &Front) -> Result<(), String> {
    let (vertices, tets) = (mesh.positions.len(), mesh.tets.len());
    let is_base = tets == base.mesh().tet_count() && vertices == base.mesh().vertex_count();
    if is_base || query.request.budget.holds(vertices, tets) {
        return Ok(());
    }
    Err(format!("{tets} tetrahedra and {vertices} vertices, more than the budget and the base mesh"))
}

/// One query and its answer.
pub(super) struct Case<'a, M> {
    pub mt: &'a M,
    pub query: &'a Query,
    pub front: &'a Front,
    pub outcome: &'a Outcome,
    pub kept: Option<&'a KeptRegions<'a>>,
}

/// The mesh that a query was answered with, and what its MT tells of it.
struct Told<'a> {
    mesh: &'a PlainMesh<'a>,
    errors: &'a TetErrors,
}

/// Errors that are smaller than this, in whatever unit, are judged as this: ratios to 0 mean nothing.
const LEAST: f64 = 1.0 / (1_u64 << 20) as f64;

impl<M: ApplyUpdates> Case<'_, M> {
    pub fn check(
        &self,
        base: &Front,
        reference: &mesh_checks::Shape,
        deviation: &mut Deviation<'_>,
        report: &mut VerifyReport,
    ) {
        let mesh = PlainMesh::of(self.front.mesh());
        // Without a valid mesh there is nothing to measure.
        let regions = || self.kept.map_or(Ok(()), |kept| kept.check(&mesh));
        if let Err(failure) = mesh.check(reference).and_then(|()| regions()) {
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
            let region = told.mesh.mesh.regions().get(t as usize).copied().unwrap_or(0);
            let look = TetData { corners: &corners, levels: &levels, error, errors, update, region };
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

//! Meshes that queries are answered with.

use super::queries::Query;
use tetralod::mt::ApplyUpdates;
use tetralod::refine::{Front, Outcome};

/// The base mesh, to be refined.
pub(super) fn fresh(mt: &impl ApplyUpdates) -> Result<Front, String> {
    Front::new(mt).map_err(|error| format!("the base mesh: {error}"))
}

/// Moves a front to the answer of a query.
pub(super) fn satisfy(mt: &impl ApplyUpdates, front: &mut Front, query: &Query) -> Result<Outcome, String> {
    let outcome = front.satisfy(mt, &query.criterion(mt.info()), query.request.budget);
    outcome.map_err(|error| format!("{query}: the MT is damaged: {error}"))
}

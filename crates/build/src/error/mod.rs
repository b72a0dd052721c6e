//! What a change costs: how far the field and the boundary are from the reference, at every reference vertex concerned.

pub(crate) mod boundary_distance;
pub(crate) mod buckets;
pub(crate) mod centre;
pub(crate) mod cost;
pub(crate) mod fill_cost;
pub(crate) mod hole_points;
pub(crate) mod outside_points;
pub(crate) mod placement;
pub(crate) mod points;
pub(crate) mod reference;
pub(crate) mod stored_points;

//! What must stay beside what a valid mesh needs: regions, their interfaces, points, angles of cells.

pub(crate) mod interface;
pub(crate) mod preserve;
pub(crate) mod region_labels;
pub(crate) mod restrictions;

//! The integer lattices that the input is put on, positions and fields, and where its own points are on them.

pub(crate) mod field_lattice;
pub(crate) mod field_selection;
pub(crate) mod location;
pub(crate) mod places;
pub(crate) mod position_lattice;
pub(crate) mod quantize;
pub(crate) mod sides;

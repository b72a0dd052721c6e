//! A block that arrives field by field.

use crate::format::payload::FieldPart;
use crate::format::payload::half_edge::Insertions;
use std::ops::Range;

/// A block of a half-edge MT of which not all has arrived.
#[derive(Debug)]
pub(super) struct OpenBlock {
    pub(super) block: u32,
    pub(super) updates: Range<u32>,
    pub(super) shared: Insertions,
    /// How many fields have been seen.
    pub(super) seen: usize,
    /// The wanted ones of them.
    pub(super) fields: Vec<Option<FieldPart>>,
}

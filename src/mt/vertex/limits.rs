//! How large an update of a vertex-based MT can be.

/// Most tetrahedra around a vertex when it is inserted.
pub const MAX_INSERTED: usize = 124;

/// Most vertices around a vertex when it is inserted.
pub const MAX_AROUND: usize = 64;

/// Most tetrahedra that an insertion removes.
pub const MAX_REMOVED: usize = 127;

/// Bits of a number of tetrahedra that an insertion removes.
pub(in crate::mt) const COUNT_BITS: u32 = 7;

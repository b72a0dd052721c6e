//! The families of contexts of vertex insertions.

use crate::format::coder::Family;
use crate::format::payload::base;
use crate::format::payload::codec::Parts;

/// By how many codes an error is below the one before.
pub const ERROR: Family = base::LAST.numbers_after(1, 2);
/// Whether all that is removed has the near vertex.
pub const FAN: Family = ERROR.after(1, 2);
/// How a coordinate differs from that of the near vertex: bits of the difference relative to those predicted.
pub const OFFSET: Family = FAN.after(4, 112);
/// Which of the tetrahedra that the new vertex lies in, as seen from the near one, is the first that is removed.
pub const SEED: Family = OFFSET.after(1, 9);
/// Whether a tetrahedron is removed.
pub const GROW: Family = SEED.after(108, 2);
/// Whether a face of the boundary is given up that the new vertex sees.
pub const GIVEN_UP: Family = GROW.after(1, 2);
/// Whether the level is about as far off as the error allows.
pub const FAR: Family = GIVEN_UP.after(20, 2);
/// How much less than the error it is off, then.
pub const SHORT: Family = FAR.numbers_after(1, 0);
/// How far the level is from what is expected.
pub const LEVEL: Family = SHORT.numbers_after(40, 1);

/// All families, with names for what they code.
pub const PARTS: Parts = &[
    ("errors", ERROR),
    ("partial order", FAN),
    ("positions", OFFSET),
    ("partial order", SEED),
    ("partial order", GROW),
    ("partial order", GIVEN_UP),
    ("levels", FAR),
    ("levels", SHORT),
    ("levels", LEVEL),
];

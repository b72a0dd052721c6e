//! The families of contexts that files of all kinds have behind those of their kind, and the list of all that a kind has.

use super::codec::Parts;
use super::{base, edge};
use crate::format::coder::Family;
use crate::mt::MAX_QUARTERINGS;

/// Differences between the levels of base vertices.
pub const BASE_LEVEL: Family = edge::LEVEL.numbers_after(1, 2);

/// Distances between the numbers of vertices that have values.
pub const EXACT_GAP: Family = BASE_LEVEL.numbers_after(1, 1);

/// Bits of what is wrong with a level: how many, then the bits below the first.
pub const EXACT_LENGTH: Family = EXACT_GAP.after(2, 65);

/// How often what is left of the errors of an update can be quartered to bound those of a tetrahedron that it removes; by that of the one
/// before it in the update, and whether the new vertex lies in it.
pub const QUARTERINGS: Family = EXACT_LENGTH.after(8, MAX_QUARTERINGS as u32 + 1);

/// By how many 32nds of a factor of 2 the errors of an update are larger than those of what it removes.
pub const OWN_FALL: Family = QUARTERINGS.after(1, 256);

/// The families of a kind with those of all kinds, in the order of their contexts.
pub fn parts(own: Parts) -> Vec<(&'static str, Family)> {
    let base = base::FAMILIES.into_iter().map(|family| ("base mesh", family));
    let last = [
        ("base mesh", BASE_LEVEL),
        ("exact values", EXACT_GAP),
        ("exact values", EXACT_LENGTH),
        ("errors of tetrahedra", QUARTERINGS),
        ("errors of tetrahedra", OWN_FALL),
    ];
    base.chain(own.iter().copied()).chain(last).collect()
}

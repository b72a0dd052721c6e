//! Stored errors, and what can be wrong with an update.

use thiserror::Error;

/// An error bound in 16 bits, rounded up when stored: 0, or from 3 · 10^-8 (2^-25) to 128 in steps of at most 0.05 %.
///
/// Errors are relative: 1 is the full range of a field. Codes compare as their errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ErrorCode(pub u16);

/// How often the error of a tetrahedron by itself can be quartered at most ([`ErrorCode::lowered`]): it is then at least a 64th of the
/// update's error.
pub const MAX_QUARTERINGS: u8 = 3;

/// Errors that are twice as large have a code larger by this.
const CODES_AN_OCTAVE: u16 = 1 << 11;
/// A 32nd of that.
const CODES_A_FALL: u16 = CODES_AN_OCTAVE / 32;
/// Bits of an `f32` below the eleven of the mantissa that a code keeps.
const DROPPED: u32 = 12;
/// What the kept bits of 2^-25 are. The code of 2^-24 is then 2^11, and the code 0 stays free for zero.
const BIAS: u32 = (127 - 25) << 11;

impl ErrorCode {
    /// No error at all.
    pub const ZERO: Self = Self(0);
    /// The largest error that can be stored: any error may be larger.
    pub const MAX: Self = Self(u16::MAX);

    /// The smallest code whose error is at least `error`; [`ErrorCode::MAX`] if there is none, and for NaN.
    pub fn at_least(error: f64) -> Self {
        if error <= 0.0 {
            return Self::ZERO;
        }
        if error.is_nan() || error > Self::MAX.error() {
            return Self::MAX;
        }
        // The cast to f32 may round down; the next code up repairs that.
        let bits = (error as f32).to_bits() >> DROPPED;
        let code = bits.saturating_sub(BIAS).max(1) as u16;
        if Self(code).error() >= error { Self(code) } else { Self(code + 1) }
    }

    /// The largest code whose error is at most `error`: a node is within `error` iff its code is at most this. Zero for
    /// NaN.
    pub fn at_most(error: f64) -> Self {
        if error.is_nan() || error <= 0.0 {
            return Self::ZERO;
        }
        let code = Self::at_least(error);
        if code.error() > error { Self(code.0 - 1) } else { code }
    }

    /// The next code that is a multiple of 256, or this one: an eighth of a power of two or less above. Builders store no
    /// others, so that an error takes few bits in a file.
    pub fn coarse(self) -> Self {
        Self(self.0.checked_next_multiple_of(1 << 8).unwrap_or(u16::MAX))
    }

    /// The code that is lower by `fall` 32nds of a factor of 2 and then by a factor of 4 so many times, but not that of no
    /// error at all unless this is.
    #[must_use]
    pub fn lowered(self, fall: u8, quarterings: u8) -> Self {
        let octaves = u16::from(quarterings).saturating_mul(2 * CODES_AN_OCTAVE);
        let below = octaves.saturating_add(u16::from(fall) * CODES_A_FALL);
        Self(self.0.saturating_sub(below).max(self.0.min(1)))
    }

    /// The largest fall to a code that is not below another.
    pub fn fall_to(self, other: Self) -> u8 {
        u8::try_from(self.0.saturating_sub(other.0) / CODES_A_FALL).unwrap_or(u8::MAX)
    }

    /// The error of this code.
    pub fn error(self) -> f64 {
        if self.0 == 0 { 0.0 } else { f64::from(f32::from_bits((u32::from(self.0) + BIAS) << DROPPED)) }
    }
}

/// Why an update cannot be stored or applied. Only a damaged or hostile MT leads here.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum UpdateError {
    /// The update splits a vertex that does not exist yet, or that another update splits already.
    #[error("update {update} splits vertex {vertex}, which is not there to be split")]
    Vertex {
        /// The update.
        update: u32,
        /// The vertex it names.
        vertex: u32,
    },
    /// A position or a field level leaves its lattice.
    #[error("update {update} leaves the lattice")]
    OffLattice {
        /// The update.
        update: u32,
    },
    /// What the update inserts does not fit in where it removes something, or it removes what is not there.
    #[error("update {update} does not fill what it removes, or removes what is not there")]
    Cavity {
        /// The update.
        update: u32,
    },
    /// The mask does not part the star of the vertex into two sides.
    #[error("update {update} does not part the star of its vertex in two")]
    Mask {
        /// The update.
        update: u32,
    },
    /// The offset is counted from an edge that the link of the vertex does not have.
    #[error("update {update} names an edge that is not in the link of its vertex")]
    Edge {
        /// The update.
        update: u32,
    },
    /// The update would make a tetrahedron that is flat or turned inside out.
    #[error("update {update} turns a tetrahedron inside out")]
    Inverted {
        /// The update.
        update: u32,
    },
    /// The star of the vertex is larger than an update can describe, or does not hang together through faces.
    #[error("update {update} meets a star of more than 64 tetrahedra or 32 vertices, or in parts")]
    Star {
        /// The update.
        update: u32,
    },
    /// The update arrived, but the mesh that it is applied to was not updated: see
    /// [`updates_arrived`](super::UpdatePages::updates_arrived).
    #[error("update {update} has arrived, but not in the mesh: call updates_arrived first")]
    UnknownToMesh {
        /// The update.
        update: u32,
    },
    /// The update is not here.
    #[error("update {update} is not here")]
    Missing {
        /// The update.
        update: u32,
    },
    /// The update depends on one that comes later, or has not an error for each field.
    #[error("update {update} does not come after those it depends on, or lacks errors")]
    Error {
        /// The update.
        update: u32,
    },
}

/// What comes of an update.
pub(in crate::mt) type Result<T, E = UpdateError> = std::result::Result<T, E>;

/// Why a page of updates cannot come or go; the MT is as it was.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum PageError {
    /// The MT has no such page.
    #[error("there is no page {page}")]
    Beyond {
        /// The page.
        page: u32,
    },
    /// The page is here already.
    #[error("page {page} is here already")]
    Present {
        /// The page.
        page: u32,
    },
    /// The page is not here.
    #[error("page {page} is not here")]
    Absent {
        /// The page.
        page: u32,
    },
    /// The page has another number of updates.
    #[error("page {page} has {expected} updates, no other number")]
    Length {
        /// The page.
        page: u32,
        /// Updates that it has.
        expected: u32,
    },
    /// One of the updates cannot be stored.
    #[error(transparent)]
    Update(#[from] UpdateError),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_is_its_own_error_rounded_either_way() {
        for code in 0..=u16::MAX {
            let error = ErrorCode(code).error();
            assert_eq!(ErrorCode::at_least(error), ErrorCode(code));
            assert_eq!(ErrorCode::at_most(error), ErrorCode(code));
        }
    }

    #[test]
    fn rounding_brackets_every_error_by_neighbouring_codes() {
        let mut error = 1e-12;
        while error < 1e4 {
            let (low, high) = (ErrorCode::at_most(error), ErrorCode::at_least(error));
            assert!(low.error() <= error);
            assert!(high.error() >= error || high == ErrorCode::MAX);
            assert!(high.0 - low.0 <= 1);
            error *= 1.000_37;
        }
        assert_eq!(ErrorCode::at_least(f64::NAN), ErrorCode::MAX);
        assert_eq!(ErrorCode::at_most(f64::NAN), ErrorCode::ZERO);
    }
}

//! The integer lattice on which positions live.

/// Maps integer positions `q` to points of the model: `origin + step · q`, axis by axis.
///
/// Integer positions lie in `0 ..= 2^bits`; arithmetic on them is exact, so refinement gives the same mesh on
/// every platform. A point moves by at most half a `step` per axis when it is put on the lattice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// The point of the model at integer position (0, 0, 0).
    pub origin: [f64; 3],
    /// Distance between neighbouring lattice points along x, y and z, in model units; positive.
    pub step: [f64; 3],
    /// Integer positions lie in `0 ..= 2^bits`; 1 to [`WIDE_BITS`](crate::geom::WIDE_BITS).
    pub bits: u32,
}

impl Lattice {
    /// The point of the model at integer position `q`.
    #[inline]
    pub fn point(&self, q: [i32; 3]) -> [f64; 3] {
        [0, 1, 2].map(|i| self.origin[i] + self.step[i] * f64::from(q[i]))
    }

    /// The integer position nearest to `p`, held inside the lattice.
    pub fn nearest(&self, p: [f64; 3]) -> [i32; 3] {
        let largest = f64::from(1_u32 << self.bits);
        // The cast saturates and maps NaN to 0, but the clamp already keeps finite input in range.
        [0, 1, 2].map(|i| ((p[i] - self.origin[i]) / self.step[i]).round().clamp(0.0, largest) as i32)
    }
}

//! Exact geometric predicates on the integer lattice.

/// Lattices of at most this many bits have their orientations computed in `i64`.
pub const NARROW_BITS: u32 = 20;

/// The finest lattice: orientations are exact (in `i128`) up to this many bits.
pub const WIDE_BITS: u32 = 30;

/// Six times the signed volume of the tetrahedron `(a, b, c, d)`: `(b − a) × (c − a) · (d − a)`, exactly.
///
/// Positive when `d` lies on the side of the plane `abc` to which the right-handed normal of `a → b → c` points.
/// Coordinates must lie in `0 ..= 2^WIDE_BITS`.
///
/// ```
/// use tetralod::geom::orient3d;
/// assert_eq!(orient3d([0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]), 1);
/// assert_eq!(orient3d([0, 0, 0], [0, 1, 0], [1, 0, 0], [0, 0, 1]), -1);
/// ```
#[inline]
pub fn orient3d(a: [i32; 3], b: [i32; 3], c: [i32; 3], d: [i32; 3]) -> i128 {
    let [u, v, w] = [b, c, d].map(|p| [0, 1, 2].map(|i| i64::from(p[i]) - i64::from(a[i])));
    let largest = [u, v, w].iter().flatten().fold(0, |m, x| m | x.unsigned_abs());
    if largest <= 1 << NARROW_BITS {
        // Components up to 2^20 make minors up to 2^41 and a sum of three products up to 3 · 2^61 < 2^63.
        i128::from(det_i64(u, v, w))
    } else {
        det_i128(u, v, w)
    }
}

#[inline]
fn det_i64(u: [i64; 3], v: [i64; 3], w: [i64; 3]) -> i64 {
    (u[1] * v[2] - u[2] * v[1]) * w[0]
        + (u[2] * v[0] - u[0] * v[2]) * w[1]
        + (u[0] * v[1] - u[1] * v[0]) * w[2]
}

#[inline]
fn det_i128(u: [i64; 3], v: [i64; 3], w: [i64; 3]) -> i128 {
    // Differences below 2^31, so the 2×2 minors stay below 2^63: they are formed in i64.
    i128::from(u[1] * v[2] - u[2] * v[1]) * i128::from(w[0])
        + i128::from(u[2] * v[0] - u[0] * v[2]) * i128::from(w[1])
        + i128::from(u[0] * v[1] - u[1] * v[0]) * i128::from(w[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The slow, plain twin: everything in `i128`.
    fn plain(a: [i32; 3], b: [i32; 3], c: [i32; 3], d: [i32; 3]) -> i128 {
        let v = |p: [i32; 3], i: usize| i128::from(p[i]) - i128::from(a[i]);
        let minor = |i: usize, j: usize| v(b, i) * v(c, j) - v(b, j) * v(c, i);
        minor(1, 2) * v(d, 0) + minor(2, 0) * v(d, 1) + minor(0, 1) * v(d, 2)
    }

    #[test]
    fn equals_the_plain_determinant_at_the_corners_of_every_lattice() {
        for bits in [1, 10, NARROW_BITS - 1, NARROW_BITS, NARROW_BITS + 1, 25, WIDE_BITS] {
            for m in [1_i32 << bits, (1_i32 << bits) - 1] {
                let corner = |i: usize| [(i & 1) as i32 * m, (i >> 1 & 1) as i32 * m, (i >> 2) as i32 * m];
                for code in 0..4096 {
                    let [a, b, c, d] = [0, 3, 6, 9].map(|shift| corner(code >> shift & 7));
                    assert_eq!(orient3d(a, b, c, d), plain(a, b, c, d), "bits {bits} code {code}");
                    let near = [d[0] ^ 1, d[1], d[2] ^ 1];
                    assert_eq!(orient3d(a, b, c, near), plain(a, b, c, near), "bits {bits} code {code}");
                }
            }
        }
    }
}

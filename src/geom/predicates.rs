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
    if largest <= 1 << NARROW_BITS { i128::from(det_i64(u, v, w)) } else { det_i128(u, v, w) }
}

/// The determinant of three vectors: their components must be at most 2^[`NARROW_BITS`], which makes minors up to 2^41 and
/// a sum of three products up to 3 · 2^61 < 2^63.
#[inline]
pub(crate) fn det_i64(u: [i64; 3], v: [i64; 3], w: [i64; 3]) -> i64 {
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

/// Squared distances up to this many bits let [`insphere`] work in `i64` alone.
const SHORT_SQUARE_BITS: u32 = 24;

/// Where `e` lies with respect to the sphere through the corners of the positive tetrahedron `(a, b, c, d)`: 1 inside,
/// −1 outside, 0 on it, exactly. For a negative tetrahedron the signs are swapped.
///
/// Coordinates must lie in `0 ..= 2^WIDE_BITS`. Near points are cheap: less than 2^12 apart all is done in `i64`, up to
/// 20 bits in `i64` but for the last sum; beyond, a floating-point filter (Shewchuk 1997) decides most cases.
///
/// ```
/// use tetralod::geom::insphere;
/// let [a, b, c, d] = [[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]];
/// assert_eq!(insphere(a, b, c, d, [1, 1, 1]), 1);
/// assert_eq!(insphere(a, b, c, d, [2, 2, 2]), 0);
/// assert_eq!(insphere(a, b, c, d, [3, 2, 2]), -1);
/// ```
#[inline]
pub fn insphere(a: [i32; 3], b: [i32; 3], c: [i32; 3], d: [i32; 3], e: [i32; 3]) -> i32 {
    let rows = [a, b, c, d].map(|p| [0, 1, 2].map(|i| i64::from(p[i]) - i64::from(e[i])));
    let largest = rows.iter().flatten().fold(0, |m, x| m | x.unsigned_abs());
    if largest <= 1 << NARROW_BITS {
        sphere_side(rows, minors_i64(rows))
    } else {
        insphere_far(rows, largest)
    }
}

/// How the origin lies to a tetrahedron with these corners, none of whose coordinates is beyond ±2^[`NARROW_BITS`]: six times the
/// volume between it and each face, and [`insphere`]. The volumes are positive on the inner sides of the faces if the
/// tetrahedron is.
#[inline]
pub(crate) fn views_of_origin(corners: [[i64; 3]; 4]) -> ([i64; 4], i32) {
    let inward = minors_i64(corners);
    (inward, sphere_side(corners, inward))
}

/// [`insphere`] by differences of at most [`NARROW_BITS`] bits and their cofactors.
#[inline]
fn sphere_side(rows: [[i64; 3]; 4], minors: [i64; 4]) -> i32 {
    let squares = rows.map(square);
    if squares.iter().fold(0, |bits, square| bits | square) < 1 << SHORT_SQUARE_BITS {
        // Vectors shorter than 2^12 have minors up to 2^36 (Hadamard): the four products stay below 2^62.
        let sum = (0..4).map(|i| minors[i] * squares[i]).sum::<i64>();
        sum.signum() as i32
    } else {
        // Minors up to 6 · 2^60 stay below 2^63; they are multiplied into two words.
        let sum = (0..4).map(|i| i128::from(minors[i]) * i128::from(squares[i])).sum::<i128>();
        sum.signum() as i32
    }
}

/// Whether a new point `e` is in conflict with the positive tetrahedron `(a, b, c, d)`: inside its sphere or, where it
/// is on it, inside after an infinitesimal perturbation. The points must be different.
///
/// The perturbation lowers the lifted points: each by infinitely more than the next in lexicographic order, so that no
/// five points stay cospherical and the Delaunay triangulation is unique, without flat tetrahedra (Edelsbrunner and
/// Mücke 1990; Devillers and Teillaud 2011). The corners of a cube get Kuhn's six tetrahedra.
#[inline]
pub fn in_conflict(a: [i32; 3], b: [i32; 3], c: [i32; 3], d: [i32; 3], e: [i32; 3]) -> bool {
    match insphere(a, b, c, d, e) {
        0 => perturbed(a, b, c, d, e),
        sign => sign > 0,
    }
}

fn perturbed(a: [i32; 3], b: [i32; 3], c: [i32; 3], d: [i32; 3], e: [i32; 3]) -> bool {
    let corners = [a, b, c, d];
    let mut order = [0, 1, 2, 3];
    order.sort_unstable_by_key(|&i| corners[i]);
    for i in order {
        if e < corners[i] {
            // Lowering `e` itself moves it inside.
            return true;
        }
        // Lowering a corner lowers the sphere's lifted plane on the corner's own side of the opposite face.
        let mut moved = corners;
        moved[i] = e;
        let [a, b, c, d] = moved;
        match orient3d(a, b, c, d) {
            0 => {}
            side => return side < 0,
        }
    }
    true
}

/// The signed cofactors of the squares in the in-sphere determinant of four rows.
#[inline]
fn minors_i64([a, b, c, d]: [[i64; 3]; 4]) -> [i64; 4] {
    let minor = |u: [i64; 3], v: [i64; 3]| u[0] * v[1] - v[0] * u[1];
    let (ab, bc, cd, da) = (minor(a, b), minor(b, c), minor(c, d), minor(d, a));
    let (ac, bd) = (minor(a, c), minor(b, d));
    [
        b[2] * cd - c[2] * bd + d[2] * bc,
        -(c[2] * da + d[2] * ac + a[2] * cd),
        d[2] * ab + a[2] * bd + b[2] * da,
        -(a[2] * bc - b[2] * ac + c[2] * ab),
    ]
}

#[inline]
fn square(u: [i64; 3]) -> i64 {
    u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
}

/// [`insphere`] for differences of up to 31 bits, `largest` being at least their largest.
fn insphere_far(rows: [[i64; 3]; 4], largest: u64) -> i32 {
    let float = insphere_float(rows);
    // Shewchuk's bound is (16 + 224 ε) ε times the permanent, which is at most 72 m^5.
    let m = largest as f64;
    let bound = 1200.0 * (0.5 * f64::EPSILON) * (m * m * m * m * m);
    if float.abs() > bound {
        return if float > 0.0 { 1 } else { -1 };
    }
    insphere_wide(rows)
}

fn insphere_float(rows: [[i64; 3]; 4]) -> f64 {
    // Differences of 31 bits are exact in floating point.
    let [a, b, c, d] = rows.map(|u| u.map(|x| x as f64));
    let minor = |u: [f64; 3], v: [f64; 3]| u[0] * v[1] - v[0] * u[1];
    let square = |u: [f64; 3]| u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
    let (ab, bc, cd, da) = (minor(a, b), minor(b, c), minor(c, d), minor(d, a));
    let (ac, bd) = (minor(a, c), minor(b, d));
    let bcd = b[2] * cd - c[2] * bd + d[2] * bc;
    let cda = c[2] * da + d[2] * ac + a[2] * cd;
    let dab = d[2] * ab + a[2] * bd + b[2] * da;
    let abc = a[2] * bc - b[2] * ac + c[2] * ab;
    (square(a) * bcd - square(b) * cda) + (square(c) * dab - square(d) * abc)
}

/// The sign of the determinant for differences of up to 30 bits, in three words.
fn insphere_wide(rows: [[i64; 3]; 4]) -> i32 {
    let [a, b, c, d] = rows;
    // Minors up to 6 · 2^90 times squares up to 3 · 2^60: the low word of each minor is multiplied apart, and two such
    // products are added and two are taken away, so that neither sum leaves 127 bits.
    let terms = [
        (det_i128(b, c, d), a, 1),
        (det_i128(c, d, a), b, -1),
        (det_i128(d, a, b), c, 1),
        (det_i128(a, b, c), d, -1),
    ];
    let (mut high, mut low) = (0_i128, 0_i128);
    for (minor, row, sign) in terms {
        let square = i128::from(square(row));
        high += sign * (minor >> 64) * square;
        low += sign * i128::from(minor as u64) * square;
    }
    match high + (low >> 64) {
        0 => i32::from(low as u64 != 0),
        sign => sign.signum() as i32,
    }
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

    /// The slow, plain twin of [`insphere`]: the expansion by minors of Shewchuk's matrix, in integers of any size.
    #[cfg(not(target_arch = "wasm32"))]
    fn plain_insphere(corners: [[i32; 3]; 4], e: [i32; 3]) -> i32 {
        use num_bigint::{BigInt, Sign};
        let rows: Vec<Vec<BigInt>> = corners
            .iter()
            .map(|p| {
                let mut row: Vec<BigInt> =
                    (0..3).map(|i| BigInt::from(i64::from(p[i]) - i64::from(e[i]))).collect();
                row.push(row.iter().map(|x| x * x).sum());
                row
            })
            .collect();
        let mut sum = BigInt::from(0);
        for columns in permutations() {
            let product: BigInt = (0..4).map(|i| rows[i][columns[i]].clone()).product();
            let swaps = (0..4).flat_map(|j| (0..j).map(move |i| (i, j)));
            let odd = swaps.filter(|&(i, j)| columns[i] > columns[j]).count() % 2 == 1;
            sum += if odd { -product } else { product };
        }
        // The matrix's determinant is negative inside for tetrahedra that are positive here.
        match sum.sign() {
            Sign::Plus => -1,
            Sign::NoSign => 0,
            Sign::Minus => 1,
        }
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn permutations() -> impl Iterator<Item = [usize; 4]> {
        let all = (0..256).map(|code| [code & 3, code >> 2 & 3, code >> 4 & 3, code >> 6]);
        all.filter(|p| (0..4).all(|k| p.contains(&k)))
    }

    /// A pseudo-random number below `2^bits` or close to one of the ends.
    #[cfg(not(target_arch = "wasm32"))]
    fn number(state: &mut u64, bits: u32) -> i32 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let near = (*state >> 60) as i64;
        let any = (*state >> 20) as i64 & ((1 << bits) - 1);
        match *state >> 57 & 3 {
            0 => near.min(1 << bits) as i32,
            1 => ((1 << bits) - near).max(0) as i32,
            _ => any as i32,
        }
    }

    #[cfg(not(target_arch = "wasm32"))]
    #[test]
    fn insphere_equals_its_plain_twin_on_every_lattice() {
        let mut state = 1;
        for bits in [1, 3, 11, 12, 13, NARROW_BITS, NARROW_BITS + 1, 25, WIDE_BITS] {
            for _ in 0..3000 {
                let [a, b, c, d, e] = [(); 5].map(|()| [(); 3].map(|()| number(&mut state, bits)));
                assert_eq!(
                    insphere(a, b, c, d, e),
                    plain_insphere([a, b, c, d], e),
                    "{a:?} {b:?} {c:?} {d:?} {e:?}"
                );
                // Corners of a box are cospherical, and their neighbours nearly so.
                let box_corner = |k: i32| [0, 1, 2].map(|i| if k >> i & 1 == 0 { a[i] } else { b[i] });
                let codes = [(); 5].map(|()| number(&mut state, 3) & 7);
                let [p, q, r, s, t] = codes.map(box_corner);
                assert_eq!(insphere(p, q, r, s, t), 0);
                let t = [t[0] ^ 1, t[1], t[2]];
                assert_eq!(
                    insphere(p, q, r, s, t),
                    plain_insphere([p, q, r, s], t),
                    "{p:?} {q:?} {r:?} {s:?} {t:?}"
                );
                assert_eq!(
                    insphere_wide([p, q, r, s].map(|u| [0, 1, 2].map(|i| i64::from(u[i]) - i64::from(t[i])))),
                    plain_insphere([p, q, r, s], t)
                );
            }
        }
    }

    #[test]
    fn perturbation_puts_each_of_five_points_on_a_side_that_fits_the_others() {
        // For five cospherical points either of the two triangulations of their hull is chosen: the tetrahedra that
        // are in conflict with the fifth point are not in it, so some are and some are not.
        let cube = |k: i32| [k & 1, k >> 1 & 1, k >> 2];
        for code in 0..8_i32.pow(5) {
            let five = [0, 1, 2, 3, 4].map(|i| code >> (3 * i) & 7);
            let points = five.map(cube);
            let distinct = (0..5).all(|i| (0..i).all(|j| five[i] != five[j]));
            if !distinct {
                continue;
            }
            let tet = |skip: usize| {
                let mut rest = [[0; 3]; 4];
                let mut others = (0..5).filter(|&k| k != skip).map(|k| points[k]);
                rest.fill_with(|| others.next().unwrap_or_default());
                match orient3d(rest[0], rest[1], rest[2], rest[3]) {
                    0 => None,
                    side if side < 0 => Some([rest[1], rest[0], rest[2], rest[3]]),
                    _ => Some(rest),
                }
            };
            let volume = |empty: bool| -> i128 {
                let tets = (0..5).filter_map(|skip| tet(skip).map(|t| (t, points[skip])));
                let chosen = tets.filter(|&([a, b, c, d], e)| in_conflict(a, b, c, d, e) != empty);
                chosen.map(|([a, b, c, d], _)| orient3d(a, b, c, d)).sum()
            };
            assert_eq!(volume(true), volume(false), "{points:?}");
        }
    }
}

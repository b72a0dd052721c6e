//! What follows from the components of symmetric tensors, such as stresses: von Mises' equivalent value, and the principal values.

/// The endings of the names of what follows from a symmetric tensor: the equivalent value of von Mises (1913), `√(3/2 s : s)` with the
/// deviator `s`, and the principal values (eigenvalues), the largest first.
pub(super) const OF_TENSORS: [&str; 4] = ["von_mises", "principal_1", "principal_2", "principal_3"];

/// A symmetric tensor: xx, yy, zz, xy, yz, xz.
pub(super) struct Symmetric([f64; 6]);

/// Sweeps of Jacobi's method: it converges quadratically, after a few.
const SWEEPS: usize = 16;

impl Symmetric {
    /// The tensor with these components, as arrays have them: six as above, or nine row by row, of which the symmetric part is taken.
    pub fn of(components: &[f64]) -> Option<Self> {
        let mean = |a: f64, b: f64| 0.5 * a + 0.5 * b;
        match *components {
            [xx, yy, zz, xy, yz, xz] => Some(Self([xx, yy, zz, xy, yz, xz])),
            [xx, xy, xz, yx, yy, yz, zx, zy, zz] => {
                Some(Self([xx, yy, zz, mean(xy, yx), mean(yz, zy), mean(xz, zx)]))
            }
            _ => None,
        }
    }

    /// The value that follows from it under an ending of [`OF_TENSORS`], by its number there.
    pub fn value(&self, number: usize) -> f64 {
        // In units of the largest component nothing overflows.
        let largest = self.0.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        if largest == 0.0 {
            return 0.0;
        }
        let unit = Self(self.0.map(|x| x / largest));
        largest * number.checked_sub(1).map_or_else(|| unit.von_mises(), |n| unit.principal()[n])
    }

    fn von_mises(&self) -> f64 {
        let [xx, yy, zz, xy, yz, xz] = self.0;
        let square = |x: f64| x * x;
        let normal = square(xx - yy) + square(yy - zz) + square(zz - xx);
        (0.5 * normal + 3.0 * (square(xy) + square(yz) + square(xz))).sqrt()
    }

    /// The eigenvalues, the largest first, by Jacobi's rotations (1846): with roots and no angles, they are the same on all machines.
    fn principal(&self) -> [f64; 3] {
        let [xx, yy, zz, xy, yz, xz] = self.0;
        let mut m = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        for _ in 0..SWEEPS {
            for (p, q) in [(0, 1), (1, 2), (0, 2)] {
                rotate(&mut m, p, q);
            }
        }
        let mut values = [m[0][0], m[1][1], m[2][2]];
        values.sort_by(|a, b| b.total_cmp(a));
        values
    }
}

/// Turns the axes `p` and `q` so that the component between them is 0.
fn rotate(m: &mut [[f64; 3]; 3], p: usize, q: usize) {
    let off = m[p][q];
    // What does not change the sum of the two does not change the eigenvalues.
    if m[p][p].abs() + off.abs() == m[p][p].abs() && m[q][q].abs() + off.abs() == m[q][q].abs() {
        return;
    }
    let half = (m[q][q] - m[p][p]) / (2.0 * off);
    let tangent = half.signum() / (half.abs() + (half * half + 1.0).sqrt());
    let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
    let sine = tangent * cosine;
    let r = 3 - p - q;
    let [of_p, of_q] = [m[r][p], m[r][q]];
    m[p][p] -= tangent * off;
    m[q][q] += tangent * off;
    [m[p][q], m[q][p]] = [0.0; 2];
    m[r][p] = cosine * of_p - sine * of_q;
    m[r][q] = sine * of_p + cosine * of_q;
    [m[p][r], m[q][r]] = [m[r][p], m[r][q]];
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(components: &[f64]) -> [f64; 4] {
        let tensor = Symmetric::of(components).expect("six or nine");
        [0, 1, 2, 3].map(|number| tensor.value(number))
    }

    #[test]
    fn known_stresses_have_their_values() {
        // Uniaxial, under pressure, and pure shear.
        assert_eq!(values(&[5.0, 0.0, 0.0, 0.0, 0.0, 0.0]), [5.0, 5.0, 0.0, 0.0]);
        assert_eq!(values(&[-2.0, -2.0, -2.0, 0.0, 0.0, 0.0]), [0.0, -2.0, -2.0, -2.0]);
        let [equivalent, first, second, third] = values(&[0.0, 0.0, 0.0, 0.0, 3.0, 0.0]);
        assert!((equivalent - 27_f64.sqrt()).abs() < 1e-15 && second == 0.0);
        assert!((first - 3.0).abs() < 1e-15 && (third + 3.0).abs() < 1e-15);
        // No square overflows.
        assert_eq!(values(&[1e300, 0.0, 0.0, 0.0, 0.0, 0.0])[0], 1e300);
    }

    #[test]
    fn principal_values_have_the_invariants_of_the_tensor() {
        let mut seed = 1_u64;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        for round in 0..1000 {
            let [xx, yy, zz, xy, yz, xz] = std::array::from_fn(|_| next());
            // Also tensors whose values are almost the same.
            let shift = if round % 2 == 0 { 0.0 } else { 1e6 };
            let [von_mises, a, b, c] = values(&[xx + shift, yy + shift, zz + shift, xy, yz, xz]);
            assert!(a >= b && b >= c);
            let near = |x: f64, y: f64| assert!((x - y).abs() < 1e-9 * (1.0 + shift), "{x} is not {y}");
            near(a + b + c, xx + yy + zz + 3.0 * shift);
            let squares = [a, b, c].map(|x| (x - shift) * (x - shift)).iter().sum::<f64>();
            near(squares, xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + xz * xz));
            near(von_mises, (0.5 * ((a - b).powi(2) + (b - c).powi(2) + (c - a).powi(2))).sqrt());
            let determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
            near((a - shift) * (b - shift) * (c - shift), determinant);
        }
    }

    #[test]
    fn of_nine_components_the_symmetric_part_counts() {
        let nine = [1.0, 4.0, 6.5, 6.0, 2.0, 5.0, 5.5, 5.0, 3.0];
        assert_eq!(values(&nine), values(&[1.0, 2.0, 3.0, 5.0, 5.0, 6.0]));
        assert!(Symmetric::of(&[1.0; 5]).is_none());
    }
}

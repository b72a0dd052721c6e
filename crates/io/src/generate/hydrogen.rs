//! Orbitals of the hydrogen atom, in real form, as textbooks of quantum mechanics have them. Lengths are in Bohr radii.

use super::error::GenerateError;
use std::f64::consts::{PI, SQRT_2};
use tetralod::mesh::{Grid, GridArray, LayeredGrid};

/// The quantum numbers of an orbital.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Orbital {
    n: u32,
    l: u32,
    m: i32,
}

impl Default for Orbital {
    /// 4,2,0: two shells of two lobes and a ring each.
    fn default() -> Self {
        Self { n: 4, l: 2, m: 0 }
    }
}

impl Orbital {
    /// The largest principal quantum number.
    pub const MAX_N: u32 = super::error::MAX_N;

    /// The orbital of the principal, azimuthal and magnetic quantum numbers `n`, `l` and `m`.
    ///
    /// # Errors
    /// Unless 1 ≤ `n` ≤ 20, `l` < `n` and |`m`| ≤ `l`.
    pub fn new(n: u32, l: u32, m: i32) -> Result<Self, GenerateError> {
        if (1..=Self::MAX_N).contains(&n) && l < n && m.unsigned_abs() <= l {
            Ok(Self { n, l, m })
        } else {
            Err(GenerateError::Orbital { n, l, m })
        }
    }

    /// Half the width of a cube outside of which next to nothing is: a quarter beyond the place where a classical electron of the
    /// same energy turns round, and some more for small orbitals.
    fn reach(self) -> f64 {
        let [n, l] = [self.n, self.l].map(f64::from);
        1.25 * (n * n + n * (n * n - l * (l + 1.0)).sqrt()) + 3.0
    }

    /// What does not depend on the place: the factor that makes the integral of the density 1, with 2/n for each r of the solid
    /// harmonic.
    fn scale(self) -> f64 {
        let Self { n, l, m } = self;
        let m = m.unsigned_abs();
        let two_over_n = 2.0 / f64::from(n);
        let radial =
            (two_over_n * two_over_n * two_over_n * factorials(n - l - 1, n + l) / f64::from(2 * n)).sqrt();
        let angular = (f64::from(2 * l + 1) / (4.0 * PI) * factorials(l - m, l + m)).sqrt();
        let powers = (0..l).fold(1.0, |power, _| power * two_over_n);
        radial * angular * powers * if m == 0 { 1.0 } else { SQRT_2 }
    }

    /// The wave function at a point, but for [`Self::scale`].
    fn shape(self, [x, y, z]: [f64; 3]) -> f64 {
        let r2 = x * x + y * y + z * z;
        let rho = 2.0 * r2.sqrt() / f64::from(self.n);
        let m = self.m.unsigned_abs();
        let [re, im] = (0..m).fold([1.0, 0.0], |[re, im], _| [re * x - im * y, re * y + im * x]);
        let around = if self.m < 0 { im } else { re };
        libm::exp(-0.5 * rho)
            * laguerre(self.n - self.l - 1, f64::from(2 * self.l + 1), rho)
            * legendre(self.l, m, z, r2)
            * around
    }
}

/// a! / b! where a ≤ b.
fn factorials(a: u32, b: u32) -> f64 {
    (a + 1..=b).fold(1.0, |quotient, i| quotient / f64::from(i))
}

/// The generalised Laguerre polynomial of degree `k`, by its recurrence.
fn laguerre(k: u32, alpha: f64, x: f64) -> f64 {
    let (mut before, mut value) = (0.0, 1.0);
    for j in 0..k {
        let j = f64::from(j);
        let next = ((2.0 * j + 1.0 + alpha - x) * value - (j + alpha) * before) / (j + 1.0);
        (before, value) = (value, next);
    }
    value
}

/// r^(l − m) P_l^m(z / r) / sin^m, a polynomial in z and r², by the recurrence of the associated Legendre functions.
fn legendre(l: u32, m: u32, z: f64, r2: f64) -> f64 {
    let (mut before, mut value) = (0.0, (0..m).fold(1.0, |product, i| product * f64::from(2 * i + 1)));
    for k in m + 1..=l {
        let next = (f64::from(2 * k - 1) * z * value - f64::from(k + m - 1) * r2 * before) / f64::from(k - m);
        (before, value) = (value, next);
    }
    value
}

/// `density`, the square of the wave function, and its `amplitude`.
pub(super) fn layers(size: u32, orbital: Orbital) -> LayeredGrid {
    let reach = orbital.reach();
    let spacing = 2.0 * reach / f64::from(size - 1);
    let grid = Grid { dims: [size; 3], origin: [-reach; 3], spacing: [spacing; 3] };
    let scale = orbital.scale();
    let arrays =
        ["density", "amplitude"].map(|name| GridArray { name, components: 1, is_single: true }).to_vec();
    LayeredGrid::new(grid, arrays, move |array, z, values| {
        for (y, row) in (0..).zip(values.chunks_exact_mut(size as usize)) {
            for (x, value) in (0..).zip(row) {
                let amplitude = scale * orbital.shape(grid.point([x, y, z]));
                *value = if array == 0 { amplitude * amplitude } else { amplitude };
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sum of the products of two orbitals over a grid that both fit in.
    fn overlap(a: Orbital, b: Orbital) -> f64 {
        let size = 61;
        let reach = a.reach().max(b.reach());
        let step = 2.0 * reach / f64::from(size);
        // Points in the middle of cells: none is at the origin, where s orbitals have a cusp.
        let at = |i: u32| (f64::from(i) + 0.5) * step - reach;
        let rows = (0..size).flat_map(|z| (0..size).map(move |y| [y, z]));
        let places = rows.flat_map(|[y, z]| (0..size).map(move |x| [at(x), at(y), at(z)]));
        places.map(|p| a.shape(p) * b.shape(p)).sum::<f64>() * a.scale() * b.scale() * step * step * step
    }

    #[test]
    fn orbitals_are_orthonormal() {
        let numbers = [(1, 0, 0), (2, 0, 0), (2, 1, -1), (3, 2, 1), (3, 2, 2), (4, 2, 0), (4, 3, -3)];
        let orbitals = numbers.map(|(n, l, m)| Orbital::new(n, l, m).unwrap());
        for (i, a) in orbitals.iter().enumerate() {
            let norm = overlap(*a, *a);
            assert!((norm - 1.0).abs() < 0.01, "{a:?}: {norm}");
            for b in &orbitals[..i] {
                assert!(overlap(*a, *b).abs() < 0.01, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn the_smallest_is_the_known_one_and_others_are_refused() {
        let orbital = Orbital::new(1, 0, 0).unwrap();
        let there = orbital.scale() * orbital.shape([0.0, 0.6, -0.8]);
        assert!((there - (-1.0_f64).exp() / PI.sqrt()).abs() < 1e-15);
        assert_eq!(Orbital::new(4, 2, 0), Ok(Orbital::default()));
        for (n, l, m) in [(0, 0, 0), (2, 2, 0), (2, 1, -2), (21, 0, 0), (1, 0, i32::MIN)] {
            assert_eq!(Orbital::new(n, l, m), Err(GenerateError::Orbital { n, l, m }));
        }
        assert!(layers(3, Orbital::new(20, 19, 19).unwrap()).to_mesh().fields[0].values[1].is_finite());
    }
}

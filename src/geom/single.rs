//! Points and values in single precision, for graphics and small files: what they are relative to.
//!
//! Everything else is absolute and in double precision. Graphics take single precision, which has 24 bits:
//! coordinates of some million metres lose half a metre, a field of 1.7e9 + {0 … 3} all of its values. Such numbers are stored relative to
//! an origin near them. It depends on the lattices alone, so it stays the same while a mesh changes.

use crate::geom::{Bounds, Lattice};

/// How points are stored in single precision: as `(point − origin) / unit`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SinglePoints {
    /// What they are relative to, in model units: along each axis 0 unless single precision loses steps of the lattice without it.
    pub origin: [f64; 3],
    /// Model units for each unit of what is stored: 1 for models of usual size; for others a power of two, so that squares of areas
    /// keep their place.
    pub unit: f64,
}

/// How values are stored in single precision: as `(value − offset) / unit`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SingleValues {
    /// What they are relative to, in units of the field: 0 unless single precision loses levels of the field without it.
    pub offset: f64,
    /// Units of the field for each unit of what is stored: 1, or a power of two where values are too large or too small for single
    /// precision.
    pub unit: f64,
}

/// An origin must bring numbers so many times nearer to 0.
const NEARER: f64 = 4.0;

/// Sizes of models of which shaders can take the square of an area.
const USUAL_SIZES: [f64; 2] = [1.0 / 256.0, 65536.0];

/// Sizes of values that single precision has a place for, with all of its bits.
const USUAL_VALUES: [f64; 2] = [1e-30, 1e30];

impl Default for SinglePoints {
    fn default() -> Self {
        Self::PLAIN
    }
}

impl Default for SingleValues {
    fn default() -> Self {
        Self::PLAIN
    }
}

impl SinglePoints {
    /// Points as they are.
    pub const PLAIN: Self = Self { origin: [0.0; 3], unit: 1.0 };

    /// How all points of a lattice are stored.
    pub fn of(lattice: &Lattice) -> Self {
        let last = 1 << lattice.bits;
        let bounds = Bounds { min: lattice.point([0; 3]), max: lattice.point([last; 3]) };
        Self::within(&bounds, lattice.step)
    }

    /// How points of a box are stored, of which differences of a `step` along each axis matter.
    pub fn within(bounds: &Bounds, step: [f64; 3]) -> Self {
        let ends = |i: usize| [bounds.min[i], bounds.max[i]];
        let origin = [0, 1, 2].map(|i| base(ends(i), step[i]));
        let size = (0..3).fold(0.0, |size, i| largest(ends(i).map(|end| end - origin[i])).max(size));
        Self { origin, unit: unit(size, USUAL_SIZES) }
    }

    /// How points are stored from the same origin in model units.
    #[must_use]
    pub fn in_model_units(self) -> Self {
        Self { unit: 1.0, ..self }
    }

    /// A point as it is stored.
    #[inline]
    pub fn store(&self, point: [f64; 3]) -> [f32; 3] {
        self.relative(point).map(|x| x as f32)
    }

    /// A point relative to the origin, in this unit.
    #[inline]
    pub fn relative(&self, point: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|i| (point[i] - self.origin[i]) / self.unit)
    }
}

impl SingleValues {
    /// Values as they are.
    pub const PLAIN: Self = Self { offset: 0.0, unit: 1.0 };

    /// How values of a range are stored, of which differences of a `step` matter.
    ///
    /// ```
    /// use tetralod::geom::SingleValues;
    ///
    /// assert_eq!(SingleValues::of([0.0, 1.0], 1e-6), SingleValues::PLAIN);
    /// let seconds = SingleValues::of([1.7e9, 1.7e9 + 3.0], 1e-5);
    /// assert_eq!((seconds.offset, seconds.unit), (1.7e9 + 2.0, 1.0));
    /// assert_eq!(seconds.store(1.7e9 + 0.75), -1.25);
    /// ```
    pub fn of(range: [f64; 2], step: f64) -> Self {
        let offset = base(range, step);
        Self { offset, unit: unit(largest(range.map(|end| end - offset)), USUAL_VALUES) }
    }

    /// How such values are stored that have no lattice; what is not finite does not count.
    pub fn of_values(values: &[f64]) -> Self {
        let finite = || values.iter().copied().filter(|value| value.is_finite());
        let range = [finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max)];
        // As with 24 bits for the range.
        if range[0] <= range[1] { Self::of(range, (range[1] - range[0]) / 16_777_216.0) } else { Self::PLAIN }
    }

    /// A value as it is stored.
    #[inline]
    pub fn store(&self, value: f64) -> f32 {
        self.relative(value) as f32
    }

    /// A value relative to the offset, in this unit.
    #[inline]
    pub fn relative(&self, value: f64) -> f64 {
        (value - self.offset) / self.unit
    }

    /// All values as they are stored.
    pub fn store_all(&self, values: &[f64]) -> Vec<f32> {
        values.iter().map(|value| self.store(*value)).collect()
    }
}

/// Whether numbers up to `largest` keep differences of `step` in single precision: whether rounding moves them by half a step at most.
/// Files and arrays in single precision hold numbers as they are where this is so.
pub fn keeps_in_single(largest: f64, step: f64) -> bool {
    // Half of the distance between neighbours, for normal numbers and for the smallest ones.
    let moved = (0.5 * f64::from(f32::EPSILON) * largest.abs()).max(0.5 * f64::from(f32::from_bits(1)));
    moved <= 0.5 * step && largest.abs() <= f64::from(f32::MAX)
}

fn largest(range: [f64; 2]) -> f64 {
    range[0].abs().max(range[1].abs())
}

/// What numbers of a range are relative to: 0 if single precision keeps their steps anyway, or would not keep more of them. Else a
/// multiple of a power of two near the middle, from which the differences are exact.
fn base([low, high]: [f64; 2], step: f64) -> f64 {
    let (size, extent) = (largest([low, high]), high - low);
    if extent == 0.0 {
        return if f64::from(low as f32) == low { 0.0 } else { low };
    }
    if keeps_in_single(size, step) || size <= NEARER * extent {
        return 0.0;
    }
    let unit = power_of_two(extent);
    let base = (f64::midpoint(low, high) / unit).round() * unit;
    if base.is_finite() { base } else { low }
}

/// 1 if `size` is a usual one, or there is none; else a power of two near to it.
fn unit(size: f64, [least, most]: [f64; 2]) -> f64 {
    let is_usual = (least..=most).contains(&size) || size == 0.0 || !size.is_finite();
    if is_usual { 1.0 } else { power_of_two(size) }
}

/// The largest power of two that is not larger than a positive number.
fn power_of_two(x: f64) -> f64 {
    let exponent = f64::from_bits(x.to_bits() & f64::INFINITY.to_bits());
    if exponent > 0.0 { exponent } else { f64::MIN_POSITIVE }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattice(origin: [f64; 3], extent: f64, bits: u32) -> Lattice {
        Lattice { origin, step: [extent / f64::from(1_u32 << bits); 3], bits }
    }

    #[test]
    fn usual_models_are_stored_as_they_are() {
        for bits in [10, 16, 21, 24, 26] {
            for lattice in [
                lattice([0.0; 3], 1.0, bits),
                lattice([-100.0, 0.0, 50.0], 300.0, bits),
                lattice([-1e-3; 3], 2.0, bits),
            ] {
                assert_eq!(SinglePoints::of(&lattice), SinglePoints::PLAIN, "{lattice:?}");
            }
        }
    }

    #[test]
    fn points_of_far_models_keep_every_step() {
        for (origin, extent) in
            [([6e5, 5.8e6, -3.0], 0.35), ([1e9, 0.0, -1e12], 1.0), ([0.0, 1e7, 0.0], 35.0)]
        {
            let lattice = lattice(origin, extent, 21);
            let single = SinglePoints::of(&lattice);
            for q in [[0, 0, 0], [1, 2, 3], [1 << 21, 77, 1_000_001], [1 << 20, 1 << 21, 1 << 19]] {
                let point = lattice.point(q);
                let stored = single.store(point).map(f64::from);
                for i in 0..3 {
                    let back = single.origin[i] + single.unit * stored[i];
                    assert!(
                        (back - point[i]).abs() <= 0.5 * lattice.step[i] + 2e-16 * point[i].abs(),
                        "{point:?}"
                    );
                }
            }
            assert_eq!(single.origin[0] != 0.0, origin[0] > 1e5, "axis by axis");
        }
    }

    #[test]
    fn sizes_that_single_precision_has_no_place_for_get_a_unit() {
        for extent in [1e-150, 1e-30, 1e-4, 1e9, 1e38, 1e150] {
            let single = SinglePoints::of(&lattice([0.0; 3], extent, 21));
            let size = extent / single.unit;
            assert!((1.0..2.0).contains(&size) && single.origin == [0.0; 3], "{extent}: {single:?}");
            assert_eq!(single.in_model_units().unit, 1.0);
        }
        for range in [[0.0, 1e39], [-1e300, 1e300], [1e-200, 3e-200]] {
            let single = SingleValues::of(range, (range[1] - range[0]) / 65535.0);
            let stored = range.map(|value| f64::from(single.store(value)));
            let back = stored.map(|value| single.offset + single.unit * value);
            assert!(
                (0..2).all(|i| (back[i] - range[i]).abs() <= 1e-7 * (range[1] - range[0])),
                "{range:?} {back:?}"
            );
        }
        assert_eq!(SingleValues::of([0.0, 3e29], 1e20), SingleValues::PLAIN);
    }

    #[test]
    fn values_of_a_narrow_range_keep_every_level() {
        for (low, range) in [(1.7e9, 3.0), (101_325.0, 2e-4), (-273.15, 1e-5), (1e100, 1e90), (1e39, 1.0)] {
            let step = range / 65535.0;
            let single = SingleValues::of([low, low + range], step);
            for level in [0, 1, 777, 40_000, 65_535] {
                let value = low + step * f64::from(level);
                let back = single.offset + single.unit * f64::from(single.store(value));
                assert!(
                    (back - value).abs() <= 0.5 * step + 2e-16 * value.abs(),
                    "{value} {back} {single:?}"
                );
            }
        }
        // A constant is exact, too.
        assert_eq!(SingleValues::of([0.1; 2], 1.0).store(0.1), 0.0);
        assert_eq!(SingleValues::of([7.0; 2], 1.0), SingleValues::PLAIN);
    }
}

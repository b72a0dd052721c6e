//! How much of a volume has which values of a field, exact for the field that is linear in every tetrahedron.
//!
//! Sums are compensated (Neumaier 1974): they do not depend on how many terms there are.

use glam::DVec3;

/// A compensated sum.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sum {
    sum: f64,
    lost: f64,
}

impl Sum {
    pub fn add(&mut self, x: f64) {
        let sum = self.sum + x;
        self.lost += if self.sum.abs() >= x.abs() { (self.sum - sum) + x } else { (x - sum) + self.sum };
        self.sum = sum;
    }

    pub fn total(self) -> f64 {
        self.sum + self.lost
    }
}

/// How much of the volume has which values.
#[derive(Clone, Debug)]
pub struct Histogram {
    low: f64,
    high: f64,
    bins: Vec<Sum>,
    below: Sum,
    above: Sum,
}

impl Histogram {
    /// An empty histogram of so many equal bins (at least one) between two values. A bin holds its lower end;
    /// the last one its upper end, too.
    ///
    /// # Panics
    /// If the values are not finite and in ascending order.
    pub fn new(low: f64, high: f64, bins: usize) -> Self {
        assert!(low.is_finite() && high.is_finite() && low < high, "the ends of a histogram");
        let bins = vec![Sum::default(); bins.max(1)];
        Self { low, high, bins, below: Sum::default(), above: Sum::default() }
    }

    /// Adds a tetrahedron. Costs as many steps as it has bins.
    pub fn add(&mut self, corners: [[f64; 3]; 4], values: [f64; 4]) {
        let volume = volume_of(corners);
        let mut sorted = values;
        sorted.sort_unstable_by(f64::total_cmp);
        let [min, _, _, max] = sorted;
        let upto = |x: f64| volume * fraction_below(sorted, x);
        // All below the upper end counts: what is at the end has a volume only if all of it is there.
        let upto_high = if max <= self.high { volume } else { upto(self.high) };
        let mut last = upto(self.low);
        self.below.add(last);
        self.above.add(volume - upto_high);
        if min > self.high || max < self.low {
            return;
        }
        let (first, end) = (self.bin_of(min), self.bin_of(max));
        for b in first..=end {
            let edge = b + 1 < self.bins.len();
            let next = if b == end || !edge { upto_high } else { upto(self.edge(b + 1)) };
            self.bins[b].add(next - last);
            last = next;
        }
    }

    /// Adds what another histogram of the same bins has.
    pub(crate) fn merge(&mut self, other: &Self) {
        let own = self.bins.iter_mut().chain([&mut self.below, &mut self.above]);
        for (own, other) in own.zip(other.bins.iter().chain([&other.below, &other.above])) {
            own.add(other.sum);
            own.add(other.lost);
        }
    }

    /// The volume in each bin.
    pub fn volumes(&self) -> Vec<f64> {
        self.bins.iter().map(|bin| bin.total()).collect()
    }

    /// The volume with values below the first and above the last bin.
    pub fn outside(&self) -> [f64; 2] {
        [self.below.total(), self.above.total()]
    }

    /// The value below which this fraction (0 to 1, held; NaN is 0) of the volume has its values; exact if
    /// the volume of each bin is evenly spread over it.
    ///
    /// What lies outside of the bins counts: the answer is the lower end if it is below the first bin, the
    /// upper end if it is above the last one. 0 and 1 give the ends of those bins that are not empty. Without
    /// any volume, all bins are taken to have the same.
    pub fn percentile(&self, fraction: f64) -> f64 {
        let fraction = if fraction > 0.0 { fraction.min(1.0) } else { 0.0 };
        let volumes = self.volumes();
        let [below, above] = self.outside();
        let total = below + volumes.iter().sum::<f64>() + above;
        if total.is_nan() || total <= 0.0 {
            return self.low * (1.0 - fraction) + self.high * fraction;
        }
        let mut left = fraction * total - below;
        if left < 0.0 || (left == 0.0 && below > 0.0) {
            return self.low;
        }
        let mut end = self.low;
        for (b, volume) in volumes.into_iter().enumerate().filter(|(_, volume)| *volume > 0.0) {
            end = self.edge(b + 1);
            if left <= volume {
                let t = left / volume;
                return self.edge(b) * (1.0 - t) + end * t;
            }
            left -= volume;
        }
        if above > 0.0 { self.high } else { end }
    }

    /// Where bin `b` starts; the end of the last one for the number of bins.
    pub fn edge(&self, b: usize) -> f64 {
        if b == self.bins.len() {
            self.high
        } else {
            self.low + (self.high - self.low) * (b as f64 / self.bins.len() as f64)
        }
    }

    /// The bin that holds a value, or the nearest one.
    fn bin_of(&self, x: f64) -> usize {
        let last = self.bins.len() - 1;
        let place = (x - self.low) / (self.high - self.low) * self.bins.len() as f64;
        // The cast saturates.
        let mut b = (place as usize).min(last);
        // Rounding may have put it beside an edge.
        while b > 0 && x < self.edge(b) {
            b -= 1;
        }
        while b < last && x >= self.edge(b + 1) {
            b += 1;
        }
        b
    }
}

/// Where equal bins with these volumes are parted into a lower and an upper group that differ most, as a fraction of their range: the
/// variance between the groups is largest (Otsu 1979). The middle if there are no two groups.
pub fn parting(volumes: &[f64]) -> f64 {
    let middles = || volumes.iter().zip(0_u32..).map(|(volume, b)| (volume, f64::from(b) + 0.5));
    let total: f64 = volumes.iter().sum();
    let moment: f64 = middles().map(|(volume, middle)| volume * middle).sum();
    let (mut below, mut moment_below) = (0.0, 0.0);
    // Between groups that are apart, any edge is as good: the middle one is taken.
    let (mut most, mut first, mut last) = (0.0, 0.5 * volumes.len() as f64, 0.5 * volumes.len() as f64);
    for (volume, middle) in middles() {
        below += volume;
        moment_below += volume * middle;
        let above = total - below;
        if below <= 0.0 || above <= 0.0 {
            continue;
        }
        let apart = (moment - moment_below) / above - moment_below / below;
        let variance = below * above * apart * apart;
        let edge = middle + 0.5;
        if variance > most * (1.0 + 1e-9) {
            (most, first, last) = (variance, edge, edge);
        } else if variance >= most * (1.0 - 1e-9) {
            last = edge;
        }
    }
    if volumes.is_empty() { 0.5 } else { 0.5 * (first + last) / volumes.len() as f64 }
}

/// The fraction of a tetrahedron in which the linear field with these values (ascending) at its corners is
/// less than `x`: a cubic spline in `x`, in terms that are all positive.
fn fraction_below([a, b, c, d]: [f64; 4], x: f64) -> f64 {
    if x <= a {
        return 0.0;
    }
    if x >= d {
        return if x > d || a < d { 1.0 } else { 0.0 };
    }
    // How far along the edge from the corner with value `from` to that with value `to` the field is `x`.
    let along = |from: f64, to: f64| (x - from) / (to - from);
    if x <= b {
        along(a, b) * along(a, c) * along(a, d)
    } else if x < c {
        // A wedge with two corners below, cut into three tetrahedra.
        let [ac, ad, bc, bd] = [along(a, c), along(a, d), along(b, c), along(b, d)];
        ac * ad * (1.0 - bd) + ac * (1.0 - bc) * bd + bc * bd
    } else {
        1.0 - along(d, a) * along(d, b) * along(d, c)
    }
}

pub(crate) fn volume_of(corners: [[f64; 3]; 4]) -> f64 {
    let [a, b, c, d] = corners.map(DVec3::from);
    (b - a).cross(c - a).dot(d - a) / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_grow_from_nothing_to_all_and_mirror() {
        let values = [0.0, 0.0, 1.0, 1.0, 2.0, 3.0, 1e-12, 5.0];
        for code in 0..4096_usize {
            let mut corners = [0, 3, 6, 9].map(|shift| values[code >> shift & 7]);
            corners.sort_unstable_by(f64::total_cmp);
            let [a, .., d] = corners;
            let mut last = 0.0;
            for step in 0..=40 {
                let x = a + (d - a) * f64::from(step) / 40.0;
                let below = fraction_below(corners, x);
                assert!(below >= last - 1e-12 && below <= 1.0 + 1e-12, "{corners:?} at {x}");
                last = below;
                let mirrored = fraction_below([3, 2, 1, 0].map(|i: usize| -corners[i]), -x);
                if a < d && corners.iter().all(|v| *v != x) {
                    assert!((below + mirrored - 1.0).abs() < 1e-12, "{corners:?} at {x}: {below} {mirrored}");
                }
            }
            assert_eq!(fraction_below(corners, d + 1.0), 1.0);
        }
        // Halves of the unit tetrahedron along x: 1 - (1 - x)^3 of it is below x.
        assert!((fraction_below([0.0, 0.0, 0.0, 1.0], 0.5) - 0.875).abs() < 1e-15);
        assert!((fraction_below([0.0, 1.0, 1.0, 1.0], 0.5) - 0.125).abs() < 1e-15);
        assert!((fraction_below([0.0, 0.0, 1.0, 1.0], 0.5) - 0.5).abs() < 1e-15);
    }

    #[test]
    fn a_histogram_is_parted_between_its_groups() {
        assert_eq!(parting(&[1.0, 0.0, 0.0, 1.0]), 0.5);
        assert_eq!(parting(&[9.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0]), 0.45);
        for nothing in [&[] as &[f64], &[0.0; 4], &[0.0, 0.0, 0.0, 1.0]] {
            assert_eq!(parting(nothing), 0.5, "{nothing:?}");
        }
        // By its definition, over random ones: no edge parts them better.
        let mut state = 3_u32;
        for _ in 0..200 {
            let volumes: Vec<f64> = (0..16)
                .map(|_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    f64::from(state >> 24)
                })
                .collect();
            let within = |edge: usize| {
                let spread = |range: std::ops::Range<usize>| {
                    let volume: f64 = volumes[range.clone()].iter().sum();
                    let mean = range.clone().map(|b| volumes[b] * b as f64).sum::<f64>() / volume.max(1e-9);
                    range.map(|b| volumes[b] * (b as f64 - mean).powi(2)).sum::<f64>()
                };
                spread(0..edge) + spread(edge..16)
            };
            let found = within((parting(&volumes) * 16.0) as usize);
            assert!((1..16).all(|edge| found <= within(edge) * (1.0 + 1e-9)), "{volumes:?}");
        }
    }

    /// A histogram with these volumes in bins of width 1.
    fn with(below: f64, bins: &[f64], above: f64) -> Histogram {
        let sum = |x: f64| Sum { sum: x, lost: 0.0 };
        let mut histogram = Histogram::new(0.0, bins.len() as f64, bins.len());
        histogram.bins = bins.iter().copied().map(sum).collect();
        (histogram.below, histogram.above) = (sum(below), sum(above));
        histogram
    }

    #[test]
    fn percentiles_invert_the_distribution() {
        let histogram = with(0.0, &[0.0, 1.0, 0.0, 3.0, 0.0], 0.0);
        let fractions = [-1.0, f64::NAN, 0.0, 0.125, 0.25, 0.4375, 1.0, 7.0];
        assert_eq!(fractions.map(|f| histogram.percentile(f)), [1.0, 1.0, 1.0, 1.5, 2.0, 3.25, 4.0, 4.0]);
        let outside = with(1.0, &[1.0, 1.0], 1.0);
        let fractions = [0.0, 0.2, 0.25, 0.375, 0.5, 0.75, 0.8, 1.0];
        assert_eq!(fractions.map(|f| outside.percentile(f)), [0.0, 0.0, 0.0, 0.5, 1.0, 2.0, 2.0, 2.0]);
        assert_eq!(with(0.0, &[0.0; 4], 0.0).percentile(0.25), 1.0);
        assert_eq!(with(2.0, &[0.0; 4], 0.0).percentile(1.0), 0.0);
    }

    #[test]
    fn sums_keep_what_is_small() {
        let mut sum = Sum::default();
        [1.0, 1e100, 1.0, -1e100].into_iter().for_each(|x| sum.add(x));
        assert_eq!(sum.total(), 2.0);
    }
}

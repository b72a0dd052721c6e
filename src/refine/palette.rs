//! A transfer function, tabulated to bound the change of a picture by an error of the field.

use super::Transfer;
use crate::mt::FieldInfo;

/// Parts that the field's range is cut into.
const BINS: usize = 256;
const LEVELS: usize = BINS.trailing_zeros() as usize + 1;

/// For each bin and power of two, the largest of so many bins from there on.
type Largest = Vec<[f32; BINS]>;

/// A transfer function of one field's levels.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Palette {
    pub field: usize,
    /// Bins per level, and the level where they begin.
    bins_per_level: f64,
    first_level: f64,
    /// Levels of the field's range.
    levels: f64,
    /// Change of a channel per level, at most.
    steepness: Largest,
    /// For each power of two, how much a channel differs at most between a value in a bin and one up to so many bins away.
    contrast: Vec<Largest>,
    /// A change of 1 accumulates to so much.
    weight: f64,
}

impl Palette {
    pub fn new(transfer: &Transfer, field: &FieldInfo) -> Self {
        let levels = field.range() / field.step;
        let width = field.range() / BINS as f64;
        let curve = Curve::new(transfer);
        let edge = |bin: usize| field.min + width * bin as f64;
        let mut bins = [Extent::NONE; BINS];
        let mut steep = [0.0; BINS];
        for (b, (extent, steep)) in bins.iter_mut().zip(&mut steep).enumerate() {
            // Values beyond the ends count to the outermost bins.
            let low = if b == 0 { f64::NEG_INFINITY } else { edge(b) };
            let high = if b + 1 == BINS { f64::INFINITY } else { edge(b + 1) };
            (*extent, *steep) = curve.between(low, high);
            *steep = (f64::from(*steep) * field.step) as f32 * ROUND_UP;
        }
        let joined = doubled(&bins, Extent::join);
        let contrast = |level| doubled(&contrast(&bins, &joined, level), f32::max);
        let contrast = (0..LEVELS).map(contrast).collect();
        Self {
            field: transfer.field,
            bins_per_level: 1.0 / (width / field.step),
            first_level: (field.min - field.origin) / field.step,
            levels,
            steepness: doubled(&steep, f32::max),
            contrast,
            weight: 1.0 / transfer.unit_length,
        }
    }

    /// A bound of how much an error, as a fraction of the field's range, changes the picture of a tetrahedron with
    /// these levels, along a ray through the whole model.
    pub fn change(&self, levels: &[i32; 4], error: f64) -> f64 {
        if error <= 0.0 {
            return 0.0;
        }
        // Half a level: the reference values themselves were rounded to levels.
        let margin = error * self.levels + 0.5;
        let low = f64::from(levels.iter().copied().fold(i32::MAX, i32::min)) - margin;
        let high = f64::from(levels.iter().copied().fold(i32::MIN, i32::max)) + margin;
        // Casts saturate at 0.
        let bin = |level: f64| (((level - self.first_level) * self.bins_per_level) as usize).min(BINS - 1);
        let [from, to] = [bin(low), bin(high)];
        let reach = (margin * self.bins_per_level) as usize + 1;
        let window = (usize::BITS - (reach - 1).leading_zeros()) as usize;
        let contrast = over(&self.contrast[window.min(LEVELS - 1)], from, to);
        // A step has no steepness, but a contrast.
        let [from, to] = [bin(low - margin), bin(high + margin)];
        let gradual = f64::from(over(&self.steepness, from, to)) * margin;
        self.weight * gradual.min(f64::from(contrast))
    }
}

/// Rounding to `f32` must not make a bound too small.
const ROUND_UP: f32 = 1.0 + 2.0 * f32::EPSILON;

/// Smallest and largest value of each channel.
#[derive(Clone, Copy, Debug)]
struct Extent {
    low: [f32; 4],
    high: [f32; 4],
}

impl Extent {
    const NONE: Self = Self { low: [f32::INFINITY; 4], high: [f32::NEG_INFINITY; 4] };

    fn with(mut self, colour: [f64; 4]) -> Self {
        for (c, value) in colour.into_iter().enumerate() {
            self.low[c] = self.low[c].min(value as f32);
            self.high[c] = self.high[c].max(value as f32);
        }
        self
    }

    fn join(mut self, other: Self) -> Self {
        for c in 0..4 {
            self.low[c] = self.low[c].min(other.low[c]);
            self.high[c] = self.high[c].max(other.high[c]);
        }
        self
    }

    /// The largest difference between a channel here and there.
    fn contrast(&self, other: &Self) -> f32 {
        let difference = |c: usize| (self.high[c] - other.low[c]).max(other.high[c] - self.low[c]);
        (0..4).fold(0.0, |m: f32, c| m.max(difference(c)))
    }
}

/// Channels weighted by opacity, linear between points.
struct Curve {
    points: Vec<(f64, [f64; 4])>,
}

impl Curve {
    fn new(transfer: &Transfer) -> Self {
        let weighted = |&(value, [r, g, b, a]): &(f64, [f64; 4])| (value, [r * a, g * a, b * a, a]);
        Self { points: transfer.points.iter().map(weighted).collect() }
    }

    /// The range of the channels from `low` to `high`, and their largest change per unit of the field there.
    fn between(&self, low: f64, high: f64) -> (Extent, f32) {
        let mut extent = Extent::NONE;
        let mut steep = 0.0_f64;
        let (Some(first), Some(last)) = (self.points.first(), self.points.last()) else {
            return (Extent::NONE.with([0.0; 4]), 0.0);
        };
        if low <= first.0 {
            extent = extent.with(first.1);
        }
        if high >= last.0 {
            extent = extent.with(last.1);
        }
        for pair in self.points.windows(2) {
            let [(v, a), (w, b)] = [pair[0], pair[1]];
            if w < low || high < v {
                continue;
            }
            let at = |value: f64| {
                let t = if w > v { ((value - v) / (w - v)).clamp(0.0, 1.0) } else { 0.0 };
                [0, 1, 2, 3].map(|c| a[c] + t * (b[c] - a[c]))
            };
            extent = extent.with(at(low.max(v))).with(at(high.min(w)));
            if w > v {
                let change = (0..4).fold(0.0, |m: f64, c| m.max((b[c] - a[c]).abs()));
                steep = steep.max(change / (w - v));
            } else {
                // A step, both sides of which belong to it.
                extent = extent.with(a).with(b);
                steep = f64::INFINITY;
            }
        }
        (extent, steep as f32)
    }
}

/// For each bin, the largest contrast of its values with those of bins up to `1 << level` away; `joined` has the extents of
/// 1, 2, 4, … bins.
fn contrast(bins: &[Extent; BINS], joined: &[[Extent; BINS]], level: usize) -> [f32; BINS] {
    let window = 1 << level;
    let mut out = [0.0; BINS];
    for (b, out) in out.iter_mut().enumerate() {
        // Windows before and after the bin: their first bins, held inside the range, cover no more than the window.
        let before = joined[level][b.saturating_sub(window)];
        let after = joined[level][(b + 1).min(BINS - 1)];
        *out = bins[b].contrast(&before.join(after).join(bins[b]));
    }
    out
}

/// The union of 1, 2, 4, … bins from each bin on.
fn doubled<T: Copy>(bins: &[T; BINS], union: impl Fn(T, T) -> T) -> Vec<[T; BINS]> {
    let mut levels = vec![*bins];
    for level in 1..LEVELS {
        let half = 1 << (level - 1);
        let last = &levels[level - 1];
        levels.push(std::array::from_fn(|b| union(last[b], last[(b + half).min(BINS - 1)])));
    }
    levels
}

/// The largest from bin `from` to bin `to`, both included.
fn over(largest: &Largest, from: usize, to: usize) -> f32 {
    let level = (to - from + 1).ilog2() as usize;
    let table = &largest[level.min(LEVELS - 1)];
    table[from].max(table[to + 1 - (1 << level)])
}

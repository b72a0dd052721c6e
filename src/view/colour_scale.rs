//! Which colour a value of a field has.

use super::ticks::ticks_at;
use crate::view::{Colormap, Histogram, Tick, end_ticks, linear_ticks, log_ticks};
use thiserror::Error;

/// A colour map over a range of values: which colour a value has.
///
/// ```
/// use tetralod::view::{COOLWARM, ColourScale};
///
/// let scale = ColourScale::new(COOLWARM, [-1.0, 3.0])?.around(0.0)?;
/// assert_eq!(scale.range, [-3.0, 3.0]);
/// assert_eq!(scale.fraction(0.0), 0.5);
/// # Ok::<(), tetralod::view::ScaleError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourScale {
    /// The colours.
    pub map: Colormap,
    /// The values that have the first and the last colour, in the field's units; what is outside has the same
    /// colours. If both are the same, values below have the first colour, values above the last one.
    pub range: [f64; 2],
    /// Whether the colours run backwards: then the smallest value has the last colour of the map.
    pub is_reversed: bool,
    /// Whether colours are even in the logarithm of the value; the range must be positive.
    pub is_log: bool,
    /// How many colours there are, in equal parts of the range from the first to the last of the map; with fewer than 2 they run into
    /// one another.
    pub bands: u8,
}

/// Why a [`ColourScale`] has no colours.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ScaleError {
    /// An end of the range, or the middle that was asked for, is infinite or NaN.
    #[error("a colour scale needs finite numbers, not {0}; give the range of the field, for example")]
    NotFinite(f64),
    /// The range runs backwards.
    #[error(
        "the range of a colour scale must ascend, {0} is larger than {1}; exchange them, and reverse \
         the colours if that is what you want"
    )]
    Descending(f64, f64),
    /// The range of a logarithmic scale, or its middle, is not positive.
    #[error(
        "a logarithmic colour scale needs positive numbers, not {0}; start the range above 0, or \
         make it linear"
    )]
    NotPositive(f64),
}

impl ColourScale {
    /// A linear scale; `range` is in the field's units.
    ///
    /// # Errors
    /// As [`ColourScale::validate`].
    pub fn new(map: Colormap, range: [f64; 2]) -> Result<Self, ScaleError> {
        Self { map, range, is_reversed: false, is_log: false, bands: 0 }.validate()
    }

    /// The scale itself, if its range is finite and ascending, or of one value, and positive if it is
    /// logarithmic.
    ///
    /// # Errors
    /// What is wrong with the range. Scales that are used nevertheless have colours, but no useful ones.
    pub fn validate(self) -> Result<Self, ScaleError> {
        let [low, high] = self.range;
        if let Some(end) = self.range.into_iter().find(|end| !end.is_finite()) {
            return Err(ScaleError::NotFinite(end));
        }
        if low > high {
            return Err(ScaleError::Descending(low, high));
        }
        if self.is_log && low <= 0.0 {
            return Err(ScaleError::NotPositive(low));
        }
        Ok(self)
    }

    /// How far along the range a value is: 0 at its lower end and below, 1 at its upper end and above,
    /// whatever the direction of the colours. NaN is at 0; the only value of a range is at 0.5.
    pub fn fraction(&self, value: f64) -> f64 {
        let [low, high] = self.range;
        if value >= high {
            return if value > high || low < high { 1.0 } else { 0.5 };
        }
        let [value, low, high] = [value, low, high].map(|x| if self.is_log { x.ln() } else { x / 2.0 });
        let fraction = (value - low) / (high - low);
        // NaN, too, where it is not larger than 0.
        if fraction > 0.0 { fraction.min(1.0) } else { 0.0 }
    }

    /// The value at a fraction of the range, which is held to 0 ..= 1: the reverse of
    /// [`ColourScale::fraction`].
    pub fn value(&self, fraction: f64) -> f64 {
        let [low, high] = self.range;
        let t = if fraction > 0.0 { fraction.min(1.0) } else { 0.0 };
        let mix = |a: f64, b: f64| a * (1.0 - t) + b * t;
        let value = if self.is_log { mix(low.ln(), high.ln()).exp() } else { mix(low, high) };
        if low <= high { value.clamp(low, high) } else { value }
    }

    /// The colour of a value, as sRGB components from 0 to 1.
    pub fn colour(&self, value: f64) -> [f32; 3] {
        self.colour_at(self.fraction(value))
    }

    /// The colour at a fraction of the range, as sRGB components from 0 to 1.
    pub fn colour_at(&self, fraction: f64) -> [f32; 3] {
        let banded = match f64::from(self.bands) {
            bands if bands >= 2.0 => (fraction * bands).floor().clamp(0.0, bands - 1.0) / (bands - 1.0),
            _ => fraction,
        } as f32;
        self.map.at(if self.is_reversed { 1.0 - banded } else { banded })
    }

    /// The colours at `N` evenly spaced fractions from 0 to 1, as `RGBA` bytes.
    pub fn table<const N: usize>(&self) -> [[u8; 4]; N] {
        std::array::from_fn(|i| {
            let [r, g, b] =
                self.colour_at(i as f64 / (N.max(2) - 1) as f64).map(|c| (c * 255.0).round() as u8);
            [r, g, b, 255]
        })
    }

    /// At most `count` ticks for a bar with these colours, ascending: the ends of the range, and round numbers with room between
    /// them; where bands meet, if these are no more. A tick belongs at the [`fraction`](ColourScale::fraction) of its value.
    pub fn ticks(&self, count: usize) -> Vec<Tick> {
        let bands = usize::from(self.bands);
        if (2..count).contains(&bands) {
            let edges: Vec<f64> = (0..=bands).map(|i| self.value(i as f64 / bands as f64)).collect();
            return ticks_at(&edges, self.is_log);
        }
        let round =
            |count| if self.is_log { log_ticks(self.range, count) } else { linear_ticks(self.range, count) };
        let Some([low, high]) = end_ticks(self.range, self.is_log).filter(|_| count > 1) else {
            return round(count);
        };
        let room = 0.5 / count as f64;
        let is_between = |tick: &Tick| (room..=1.0 - room).contains(&self.fraction(tick.value));
        // As many as there is room for beside the ends.
        let counts = (count - 2..=count).rev();
        let mut inner = counts.map(|count| round(count).into_iter().filter(is_between).collect::<Vec<_>>());
        let inner = inner.find(|inner| inner.len() + 2 <= count).unwrap_or_default();
        [low].into_iter().chain(inner).chain([high]).collect()
    }

    /// The scale with the smallest range around its own that has `middle` at fraction 0.5: for diverging
    /// maps, usually with 0 in the middle. On a logarithmic scale the ends are the same factor away from the
    /// middle.
    ///
    /// # Errors
    /// If `middle` is infinite or NaN, if it is not positive and the scale is logarithmic, or if an end of
    /// the new range would be too large for a number.
    pub fn around(self, middle: f64) -> Result<Self, ScaleError> {
        let [low, high] = self.validate()?.range;
        if !middle.is_finite() {
            return Err(ScaleError::NotFinite(middle));
        }
        if self.is_log && middle <= 0.0 {
            return Err(ScaleError::NotPositive(middle));
        }
        let range = if self.is_log {
            let factor = (high / middle).max(middle / low).max(1.0);
            [middle / factor, middle * factor]
        } else {
            let away = (high - middle).abs().max((middle - low).abs());
            [middle - away, middle + away]
        };
        Self { range, ..self }.validate()
    }

    /// The scale with the range between two fractions of a volume, as [0.02, 0.98] to leave outliers out: 2 %
    /// of the volume has values below that range, 2 % has values above it. See [`Histogram::percentile`].
    ///
    /// # Errors
    /// If the fractions descend, or if the scale is logarithmic and the lower one of the values is not
    /// positive.
    pub fn over(self, histogram: &Histogram, fractions: [f64; 2]) -> Result<Self, ScaleError> {
        Self { range: fractions.map(|fraction| histogram.percentile(fraction)), ..self }.validate()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::{COOLWARM, GREY, VIRIDIS};

    const LOG: ColourScale =
        ColourScale { map: VIRIDIS, range: [0.01, 100.0], is_reversed: false, is_log: true, bands: 0 };

    #[test]
    fn ticks_begin_and_end_with_the_range() {
        let labels = |scale: ColourScale, count| {
            scale.ticks(count).into_iter().map(|tick| tick.label).collect::<Vec<_>>()
        };
        let linear = ColourScale::new(VIRIDIS, [-0.013, 1.274]).unwrap();
        assert_eq!(labels(linear, 6), ["-0.013", "0.25", "0.50", "0.75", "1.00", "1.274"]);
        assert_eq!(labels(linear, 1), ["0.0"]);
        assert_eq!(labels(LOG, 6), ["0.01", "0.1", "1", "10", "100"]);
        assert_eq!(labels(ColourScale::new(VIRIDIS, [3.0, 3.0]).unwrap(), 6), ["3"]);
        assert_eq!(
            labels(ColourScale::new(VIRIDIS, [1.7e9, 1.7e9 + 3.0]).unwrap(), 6).first().unwrap(),
            "1700000000"
        );
    }

    #[test]
    fn bands_have_one_colour_each_and_ticks_where_they_meet() {
        let scale = ColourScale { bands: 4, ..ColourScale::new(GREY, [0.0, 10.0]).unwrap() };
        let shades = [-1.0, 0.0, 2.4, 2.5, 4.9, 5.0, 7.5, 10.0, 11.0].map(|value| scale.colour(value)[0]);
        let wanted = [0, 0, 0, 1, 1, 2, 3, 3, 3].map(|band| GREY.at(band as f32 / 3.0)[0]);
        assert_eq!(shades, wanted);
        let labels =
            |scale: ColourScale| scale.ticks(6).into_iter().map(|tick| tick.label).collect::<Vec<_>>();
        assert_eq!(labels(scale), ["0.0", "2.5", "5.0", "7.5", "10.0"]);
        assert_eq!(labels(ColourScale { bands: 4, ..LOG }), ["0.01", "0.1", "1", "10", "100"]);
        // Too many to be labelled.
        assert_eq!(labels(ColourScale { bands: 20, ..scale }), labels(ColourScale { bands: 0, ..scale }));
        assert_eq!(ColourScale { bands: 1, ..scale }.table::<9>(), GREY.table::<9>());
    }

    #[test]
    fn values_are_held_and_go_back() {
        let linear = ColourScale::new(VIRIDIS, [-2.0, 6.0]).unwrap();
        let reversed = ColourScale { is_reversed: true, ..linear };
        for scale in [linear, reversed, LOG] {
            for t in [0.0, 0.125, 0.5, 0.75, 1.0] {
                assert!((scale.fraction(scale.value(t)) - t).abs() < 1e-12);
            }
            assert_eq!([f64::NEG_INFINITY, -1e300, f64::NAN].map(|x| scale.fraction(x)), [0.0; 3]);
            assert_eq!([f64::INFINITY, 1e300].map(|x| scale.fraction(x)), [1.0; 2]);
        }
        assert_eq!(linear.fraction(0.0), 0.25);
        assert!((LOG.fraction(1.0) - 0.5).abs() < 1e-12);
        assert_eq!(LOG.fraction(0.0), 0.0);
        let widest = ColourScale { range: [-f64::MAX, f64::MAX], ..linear };
        assert_eq!(widest.fraction(0.0), 0.5);
        assert_eq!(widest.value(0.5), 0.0);
    }

    #[test]
    fn tables_and_colours_agree_and_reverse() {
        let scale = ColourScale { is_reversed: true, ..ColourScale::new(GREY, [0.0, 4.0]).unwrap() };
        assert_eq!((scale.colour(0.0), scale.colour(4.0)), ([1.0; 3], [0.0; 3]));
        let table = scale.table::<5>();
        for (i, entry) in table.iter().enumerate() {
            let bytes = scale.colour(i as f64).map(|c| (c * 255.0).round() as u8);
            assert!((0..3).all(|c| bytes[c].abs_diff(entry[c]) <= 1));
        }
    }

    #[test]
    fn ranges_of_one_value_are_steps() {
        let scale = ColourScale::new(GREY, [3.0, 3.0]).unwrap();
        assert_eq!([2.0, 3.0, 4.0, f64::NAN].map(|x| scale.fraction(x)), [0.0, 0.5, 1.0, 0.0]);
    }

    #[test]
    fn ranges_that_make_no_scale_are_refused() {
        let scale = |range| ColourScale::new(VIRIDIS, range).map(|scale| scale.range);
        assert!(matches!(scale([f64::NAN, 1.0]), Err(ScaleError::NotFinite(_))));
        assert_eq!(scale([0.0, f64::INFINITY]), Err(ScaleError::NotFinite(f64::INFINITY)));
        assert_eq!(scale([2.0, 1.0]), Err(ScaleError::Descending(2.0, 1.0)));
        let zero = ColourScale { range: [0.0, 1.0], ..LOG };
        assert_eq!(zero.validate(), Err(ScaleError::NotPositive(0.0)));
        assert_eq!(LOG.around(0.0), Err(ScaleError::NotPositive(0.0)));
        assert!(LOG.around(f64::NAN).is_err());
    }

    #[test]
    fn symmetric_ranges_contain_the_old_one() {
        let linear = ColourScale::new(COOLWARM, [-1.0, 3.0]).unwrap();
        assert_eq!(linear.around(0.0).unwrap().range, [-3.0, 3.0]);
        assert_eq!(linear.around(5.0).unwrap().range, [-1.0, 11.0]);
        assert_eq!(LOG.around(10.0).unwrap().range, [0.01, 10_000.0]);
        assert!((LOG.around(10.0).unwrap().fraction(10.0) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn ranges_come_from_volumes() {
        // The unit tetrahedron with the field x: 1 - (1 - x)^3 of it is below x.
        let mut histogram = Histogram::new(0.0, 1.0, 1000);
        histogram.add([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [0.0, 1.0, 0.0, 0.0]);
        let scale = ColourScale::new(VIRIDIS, [0.0, 1.0]).unwrap().over(&histogram, [0.25, 0.875]).unwrap();
        assert!((scale.range[0] - (1.0 - 0.75_f64.cbrt())).abs() < 1e-3);
        assert!((scale.range[1] - 0.5).abs() < 1e-3);
        assert!(scale.over(&histogram, [0.9, 0.1]).is_err());
    }
}

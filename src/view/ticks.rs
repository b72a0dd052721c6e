//! Ticks of axes and colour bars: round numbers in a range, with labels.
//!
//! Ticks are made as decimal numbers, an integer times a power of ten, so that their labels are exact.

/// More ticks than these are never made.
const MOST_TICKS: usize = 1000;

/// Steps between ticks as multiples of a power of ten, in tenths.
const STEPS: [i64; 4] = [10, 20, 25, 50];

/// Ticks are at least this fraction of the largest number of the range apart, so that they differ.
const CLOSEST: f64 = 1e-15;

/// No step is smaller than this, so that no power of ten overflows.
const SMALLEST: f64 = 1e-300;

/// Digits of labels of numbers that are not round.
const DIGITS: i32 = 6;

/// A place on an axis, and what is written there.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// The value, in the unit of the axis.
    pub value: f64,
    /// The value as text: a decimal number like `-2.50`, or `2.5e-7`.
    pub label: String,
}

/// At most `count` ticks in a range, ascending, evenly spaced by 1, 2, 2.5 or 5 times a power of ten.
///
/// All are inside the range or at its ends, which may be given in either order. Labels have as many decimals
/// as tell the ticks apart. There is at least one tick if `count` is not 0 and both ends are finite; if the
/// range is empty, or so small that there is no round number in it, it is the lower end, with six digits. No
/// tick if an end is infinite or NaN.
///
/// ```
/// let ticks = tetralod::view::linear_ticks([0.0, 1.1], 6);
/// let labels: Vec<_> = ticks.iter().map(|tick| tick.label.as_str()).collect();
/// assert_eq!(labels, ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
/// ```
pub fn linear_ticks(range: [f64; 2], count: usize) -> Vec<Tick> {
    let count = count.min(MOST_TICKS);
    let Some([low, high]) = ascending(range) else { return Vec::new() };
    if count == 0 {
        return Vec::new();
    }
    let decimals = if low < high { multiples(low, high, count) } else { Vec::new() };
    if decimals.is_empty() {
        return vec![Tick { value: low, label: Decimal::near(low).label() }];
    }
    let values: Vec<_> = decimals.iter().map(Decimal::value).collect();
    values.into_iter().zip(labels_of(decimals)).map(|(value, label)| Tick { value, label }).collect()
}

/// The ends of a range, in ascending order, with as many digits as tell thousandths of it apart, or of a logarithmic axis with
/// six digits: what round ticks leave open.
///
/// None if they are the same, infinite or NaN.
///
/// ```
/// let ends = tetralod::view::end_ticks([1.0 / 3.0, 17.0], false).expect("a range");
/// assert_eq!(ends.map(|tick| tick.label), ["0.33", "17.00"]);
/// ```
pub fn end_ticks(range: [f64; 2], is_log: bool) -> Option<[Tick; 2]> {
    let ends = ascending(range).filter(|[low, high]| low < high)?;
    ticks_at(&ends, is_log).try_into().ok()
}

/// Ticks at these values, two at least, which ascend; with digits as those of [`end_ticks`].
pub(super) fn ticks_at(values: &[f64], is_log: bool) -> Vec<Tick> {
    let labels = match values {
        &[low, .., high] if !is_log => {
            let exponent = (high / 2.0 - low / 2.0).max(SMALLEST).log10().floor() as i32 - 2;
            let exponent = exponent.max(Decimal::last_exponent(low.abs().max(high.abs())));
            let rounded =
                |value: &f64| Decimal { digits: scaled(*value, -exponent).round() as i64, exponent };
            labels_of(values.iter().map(rounded).collect())
        }
        _ => values.iter().map(|value| Decimal::near(*value).label()).collect(),
    };
    values.iter().zip(labels).map(|(&value, label)| Tick { value, label }).collect()
}

/// At most `count` ticks in a range of positive numbers for a logarithmic axis, ascending: powers of ten,
/// with 2 and 5 times these if there is room, or only every second, third or further power if there is none.
///
/// All are inside the range or at its ends, which may be given in either order. A range with fewer than two
/// such numbers gets [`linear_ticks`]. No tick if an end is not positive, infinite or NaN.
///
/// ```
/// let ticks = tetralod::view::log_ticks([0.05, 20.0], 4);
/// let labels: Vec<_> = ticks.iter().map(|tick| tick.label.as_str()).collect();
/// assert_eq!(labels, ["0.1", "1", "10"]);
/// ```
pub fn log_ticks(range: [f64; 2], count: usize) -> Vec<Tick> {
    let count = count.min(MOST_TICKS);
    let Some([low, high]) = ascending(range).filter(|[low, _]| *low > 0.0) else { return Vec::new() };
    // One more on each side, since logarithms are rounded.
    let decades = low.log10().floor() as i32 - 1..=high.log10().ceil() as i32 + 1;
    let inside = |digits: &[i64], every: i32| -> Vec<Decimal> {
        let exponents = decades.clone().filter(|e| e.rem_euclid(every) == 0);
        let all =
            exponents.flat_map(|exponent| digits.iter().map(move |&digits| Decimal { digits, exponent }));
        all.filter(|d| (low..=high).contains(&d.value())).collect()
    };
    let fine = inside(&[1, 2, 5], 1);
    if count == 0 || fine.len() < 2 {
        return linear_ticks(range, count);
    }
    let coarser = (1..=decades.clone().count() as i32).map(|every| inside(&[1], every));
    let fitting = std::iter::once(fine).chain(coarser).find(|ticks| ticks.len() <= count);
    let ticks = fitting.unwrap_or_default();
    if ticks.is_empty() {
        return linear_ticks(range, count);
    }
    ticks.iter().map(|d| Tick { value: d.value(), label: d.label() }).collect()
}

/// The largest number of 1, 2, 2.5 and 5 times a power of ten that is at most `limit`, and its label; 1 if
/// `limit` is not positive and finite.
pub(super) fn nice_below(limit: f64) -> Tick {
    let limit = if limit.is_finite() && limit > 0.0 { limit } else { 1.0 };
    let exponent = limit.log10().floor() as i32;
    for exponent in (exponent - 2..exponent + 2).rev() {
        for digits in STEPS.into_iter().rev() {
            let found = Decimal { digits, exponent };
            if found.value() <= limit && found.value() > 0.0 {
                return Tick { value: found.value(), label: found.shortened().label() };
            }
        }
    }
    Tick { value: limit, label: Decimal::near(limit).label() }
}

/// The ends of a range in ascending order, if they are finite.
fn ascending([a, b]: [f64; 2]) -> Option<[f64; 2]> {
    (a.is_finite() && b.is_finite()).then(|| [a.min(b), a.max(b)])
}

/// The multiples of the smallest round step of which at most `count` are between two numbers. May be none,
/// where the numbers are too close.
fn multiples(low: f64, high: f64, count: usize) -> Vec<Decimal> {
    let largest = low.abs().max(high.abs());
    // No difference of both, which may be infinite.
    let parts = count as f64;
    let step = (high / parts - low / parts).clamp(SMALLEST, f64::MAX).max(largest * CLOSEST);
    let first = step.log10().floor() as i32;
    let steps = (first..first + 4)
        .flat_map(|exponent| STEPS.map(|digits| Decimal { digits, exponent: exponent - 1 }));
    let distinct = steps.filter(|step| step.value() >= largest * CLOSEST);
    let mut ticks = distinct.map(|step| step.multiples_between(low, high));
    ticks.find(|ticks| ticks.len() <= count).unwrap_or_default()
}

/// The labels of ticks of the same axis: with the same last decimal, all with exponents or none.
fn labels_of(mut decimals: Vec<Decimal>) -> Vec<String> {
    shorten(&mut decimals);
    let largest = decimals.iter().max_by_key(|d| d.digits.abs());
    let is_scientific = largest.is_some_and(Decimal::is_scientific);
    decimals.iter().map(|d| d.text(is_scientific)).collect()
}

/// Leaves out decimals that are zero in all.
fn shorten(decimals: &mut [Decimal]) {
    while decimals.iter().any(|d| d.digits != 0) && decimals.iter().all(|d| d.digits % 10 == 0) {
        for d in &mut *decimals {
            *d = Decimal { digits: d.digits / 10, exponent: d.exponent + 1 };
        }
    }
}

/// The number `digits * 10^exponent`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Decimal {
    digits: i64,
    exponent: i32,
}

impl Decimal {
    /// A finite number rounded to six digits.
    fn near(value: f64) -> Self {
        if value == 0.0 {
            return Self { digits: 0, exponent: 0 };
        }
        let exponent = value.abs().log10().floor() as i32 - (DIGITS - 1);
        Self { digits: scaled(value, -exponent).round() as i64, exponent }.shortened()
    }

    /// The place of the last digit that a number has in double precision.
    fn last_exponent(value: f64) -> i32 {
        value.log10().floor() as i32 - 15
    }

    /// The number without zeros at its end.
    fn shortened(self) -> Self {
        let mut one = [self];
        shorten(&mut one);
        one[0]
    }

    fn value(&self) -> f64 {
        scaled(self.digits as f64, self.exponent)
    }

    /// The integer multiples of the number from `low` to `high`. There must be few.
    fn multiples_between(&self, low: f64, high: f64) -> Vec<Self> {
        // Casts saturate.
        let [first, last] = [(low / self.value()).floor(), (high / self.value()).ceil()].map(|i| i as i64);
        let times = |i: i64| Self { digits: i * self.digits, exponent: self.exponent };
        (first..=last).map(times).filter(|d| (low..=high).contains(&d.value())).collect()
    }

    /// The exponent of its first digit.
    fn magnitude(&self) -> i32 {
        self.exponent + self.digits.unsigned_abs().checked_ilog10().unwrap_or(0) as i32
    }

    /// Whether it is long without an exponent, and shorter with one.
    fn is_scientific(&self) -> bool {
        let magnitude = self.magnitude();
        if self.digits == 0 || (-4..6).contains(&magnitude) {
            return false;
        }
        let decimals = (-self.exponent).max(0);
        let plain = magnitude.max(0) + 1 + decimals + i32::from(decimals > 0);
        let digits = magnitude - self.exponent + 1;
        let exponent =
            magnitude.unsigned_abs().checked_ilog10().unwrap_or(0) as i32 + 1 + i32::from(magnitude < 0);
        plain > digits + i32::from(digits > 1) + 1 + exponent + 1
    }

    fn label(&self) -> String {
        self.text(self.is_scientific())
    }

    fn text(&self, is_scientific: bool) -> String {
        if !is_scientific {
            return fixed(self.digits, self.exponent);
        }
        if self.digits == 0 {
            return "0".into();
        }
        let magnitude = self.magnitude();
        format!("{}e{magnitude}", fixed(self.digits, self.exponent - magnitude))
    }
}

/// `digits * 10^exponent` without an exponent.
fn fixed(digits: i64, exponent: i32) -> String {
    let places = exponent.unsigned_abs() as usize;
    if exponent >= 0 {
        let zeros = if digits == 0 { 0 } else { places };
        return format!("{digits}{}", "0".repeat(zeros));
    }
    let sign = if digits < 0 { "-" } else { "" };
    let text = format!("{:0width$}", digits.unsigned_abs(), width = places + 1);
    let (whole, decimals) = text.split_at(text.len() - places);
    format!("{sign}{whole}.{decimals}")
}

/// `x * 10^exponent`; correctly rounded for integers of up to 15 digits and exponents within 22 of zero.
fn scaled(x: f64, exponent: i32) -> f64 {
    // Powers of ten beyond the 308th are infinite.
    let (mut x, mut left) = (x, exponent);
    while left.abs() > 300 && x != 0.0 && x.is_finite() {
        let part = left.clamp(-300, 300);
        x = if part > 0 { x * 1e300 } else { x / 1e300 };
        left -= part;
    }
    let power = 10.0_f64.powi(left.abs().min(300));
    if left >= 0 { x * power } else { x / power }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn labels(ticks: &[Tick]) -> Vec<&str> {
        ticks.iter().map(|tick| tick.label.as_str()).collect()
    }

    #[test]
    fn steps_are_round_and_labels_as_short_as_they_can_be() {
        let linear = |low, high, count| linear_ticks([low, high], count);
        assert_eq!(labels(&linear(0.0, 10.0, 5)), ["0.0", "2.5", "5.0", "7.5", "10.0"]);
        assert_eq!(labels(&linear(0.0, 10.0, 4)), ["0", "5", "10"]);
        assert_eq!(
            labels(&linear(-1.0, 1.0, 9)),
            ["-1.00", "-0.75", "-0.50", "-0.25", "0.00", "0.25", "0.50", "0.75", "1.00"]
        );
        assert_eq!(labels(&linear(0.0, 3.2e7, 4)), ["0", "1e7", "2e7", "3e7"]);
        assert_eq!(labels(&linear(0.0, 3.2e-7, 4)), ["0", "1e-7", "2e-7", "3e-7"]);
        assert_eq!(labels(&linear(9e6, 1.2e7, 4)), ["9e6", "1.0e7", "1.1e7", "1.2e7"]);
        assert_eq!(labels(&linear(5_400_000.0, 5_400_021.0, 3)), ["5400000", "5400010", "5400020"]);
        assert_eq!(labels(&linear(0.0, 2e-4, 3)), ["0.0000", "0.0001", "0.0002"]);
        assert_eq!(linear(0.0, 1.0, 11)[3].value, 0.3);
    }

    #[test]
    fn odd_ranges_are_no_problem() {
        assert_eq!(linear_ticks([3.0, 1.0], 3), linear_ticks([1.0, 3.0], 3));
        assert_eq!(linear_ticks([0.0, 1.0], 0), []);
        assert_eq!(linear_ticks([0.0, f64::INFINITY], 5), []);
        assert_eq!(linear_ticks([f64::NAN, 1.0], 5), []);
        assert_eq!(linear_ticks([0.1, 0.1], 5), [Tick { value: 0.1, label: "0.1".into() }]);
        assert_eq!(labels(&linear_ticks([1.0 / 3.0, 1.0 / 3.0], 5)), ["0.333333"]);
        assert_eq!(labels(&linear_ticks([0.0, 0.0], 5)), ["0"]);
        assert!(!linear_ticks([-f64::MAX, f64::MAX], 5).is_empty());
        assert!(!linear_ticks([0.0, 5e-324], 5).is_empty());
        let wide = linear_ticks([1e16, 1e16 + 400.0], 5);
        assert!(wide.len() > 1 && wide.windows(2).all(|pair| pair[0].label != pair[1].label), "{wide:?}");
        let tiny = [6.162_175_848_910_427e-82, 6.162_175_848_910_422e-82];
        assert!(linear_ticks(tiny, 6).iter().all(|tick| tiny[1] <= tick.value && tick.value <= tiny[0]));
        assert!(linear_ticks([0.0, 1.0], usize::MAX).len() <= MOST_TICKS);
        assert_eq!(log_ticks([-1.0, 10.0], 5), []);
        assert_eq!(log_ticks([0.0, 10.0], 5), []);
        assert!(!log_ticks([5e-324, f64::MAX], 5).is_empty());
        assert_eq!(labels(&log_ticks([4.0, 4.0], 5)), ["4"]);
    }

    #[test]
    fn ends_have_the_digits_that_tell_thousandths_of_the_range_apart() {
        let ends = |low, high| end_ticks([low, high], false).map(|ends| ends.map(|tick| tick.label));
        let words = |low: &str, high: &str| Some([low.to_owned(), high.to_owned()]);
        assert_eq!(ends(0.0, 10.0), words("0", "10"));
        assert_eq!(ends(-1.0 / 3.0, 0.65), words("-0.333", "0.650"));
        assert_eq!(ends(5_800_123.456_7, 5_800_158.456_7), words("5800123.5", "5800158.5"));
        assert_eq!(ends(1.7e9, 1.7e9 + 3.0), words("1700000000", "1700000003"));
        assert_eq!(ends(101_325.0, 101_325.000_1), words("101325.0000", "101325.0001"));
        assert_eq!(ends(-1e-9, 1.0), words("0", "1"));
        assert_eq!(ends(1e-12, 3.25e-12), words("1.00e-12", "3.25e-12"));
        assert_eq!((ends(2.0, 2.0), ends(f64::NAN, 1.0)), (None, None));
        let logarithmic = end_ticks([1.0 / 3.0 * 1e-6, 2e6], true).map(|ends| ends.map(|tick| tick.label));
        assert_eq!(logarithmic, words("3.33333e-7", "2e6"));
        assert!(ends(-f64::MAX, f64::MAX).is_some() && ends(0.0, 5e-324).is_some());
    }

    #[test]
    fn logarithmic_ticks_are_decades_and_what_there_is_room_for() {
        assert_eq!(labels(&log_ticks([1.0, 100.0], 7)), ["1", "2", "5", "10", "20", "50", "100"]);
        assert_eq!(labels(&log_ticks([1.0, 100.0], 6)), ["1", "10", "100"]);
        assert_eq!(labels(&log_ticks([1e-6, 1e6], 6)), ["1e-6", "0.001", "1", "1000", "1e6"]);
        assert_eq!(labels(&log_ticks([3.0, 4.0], 3)), ["3.0", "3.5", "4.0"]);
        assert_eq!(labels(&log_ticks([4.0, 60.0], 1)), ["10"]);
    }

    #[test]
    fn round_lengths_are_the_next_smaller_ones() {
        for (limit, label) in [(1.0, "1"), (0.99, "0.5"), (2.4, "2"), (2.6, "2.5"), (7e8, "5e8"), (0.0, "1")]
        {
            assert_eq!(nice_below(limit).label, label, "below {limit}");
        }
    }

    fn number() -> impl Strategy<Value = f64> {
        (-1.0..1.0_f64, -320..309_i32).prop_map(|(x, e)| scaled(x, e))
    }

    fn range() -> impl Strategy<Value = [f64; 2]> {
        let near = (number(), -1.0..1.0_f64, 0..18_i32).prop_map(|(a, x, e)| [a, a + a * scaled(x, -e)]);
        prop_oneof![(number(), number()).prop_map(|(a, b)| [a, b]), near]
    }

    /// Ascending, inside, at most so many, and every label says its value.
    fn check([a, b]: [f64; 2], count: usize, ticks: &[Tick]) {
        assert!(ticks.len() <= count, "{ticks:?}");
        assert!(ticks.windows(2).all(|pair| pair[0].value < pair[1].value && pair[0].label != pair[1].label));
        for tick in ticks {
            assert!(a.min(b) <= tick.value && tick.value <= a.max(b));
            let said: f64 = tick.label.parse().unwrap();
            let slack = if ticks.len() > 1 { 1e-13 } else { 1e-5 };
            assert!((said - tick.value).abs() <= tick.value.abs() * slack + 1e-307, "{tick:?}");
        }
    }

    fn config() -> ProptestConfig {
        ProptestConfig { failure_persistence: None, cases: 2000, ..ProptestConfig::default() }
    }

    proptest! {
        #![proptest_config(config())]

        #[test]
        fn ticks_of_any_range_keep_their_promise(range in range(), count in 0..30_usize) {
            let [a, b] = range;
            prop_assume!(a.is_finite() && b.is_finite());
            let ticks = linear_ticks(range, count);
            check(range, count, &ticks);
            assert_eq!(ticks.is_empty(), count == 0);
            let (low, high) = (a.min(b), a.max(b));
            if high - low > 1e-9 * low.abs().max(high.abs()) && high - low > 1e-290 {
                let steps: Vec<_> = ticks.windows(2).map(|pair| pair[1].value - pair[0].value).collect();
                assert!(steps.iter().all(|s| (s - steps[0]).abs() <= 1e-4 * steps[0]), "{ticks:?}");
                assert!(count < 6 || ticks.len() * 3 >= count, "{count}: {ticks:?}");
            }
            check([a.abs(), b.abs()], count, &log_ticks([a.abs(), b.abs()], count));
        }
    }
}

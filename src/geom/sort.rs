//! Sorting without a function of its own for each type: a sort of the standard library is some 6 kB of wasm. What is sorted in
//! numbers is `u32`, `u64` or `u128`, into which keys are packed.

/// Sorts a few items where they are; equal ones stay in their order.
#[doc(hidden)]
pub fn sort_few<T: Copy>(items: &mut [T], comes_before: impl Fn(&T, &T) -> bool) {
    for end in 1..items.len() {
        let item = items[end];
        let mut at = end;
        while at > 0 && comes_before(&item, &items[at - 1]) {
            items[at] = items[at - 1];
            at -= 1;
        }
        items[at] = item;
    }
}

/// A key that sorts numbers as [`f64::total_cmp`] does.
#[doc(hidden)]
pub fn total_order(x: f64) -> u64 {
    let bits = x.to_bits();
    if x.is_sign_negative() { !bits } else { bits | 1 << 63 }
}

/// The bits of a number, which are equal where numbers are, though zero has two signs: to look numbers up.
#[doc(hidden)]
pub fn bits_of(x: f64) -> u64 {
    (x + 0.0).to_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_items_come_into_order_and_equal_ones_stay() {
        for code in 0..3_u32.pow(6) {
            let mut items: Vec<(u32, u32)> = (0..6).map(|i| (code / 3_u32.pow(i) % 3, i)).collect();
            let mut expected = items.clone();
            expected.sort_by_key(|item| item.0);
            sort_few(&mut items, |a, b| a.0 < b.0);
            assert_eq!(items, expected);
        }
    }

    #[test]
    fn keys_are_in_the_total_order() {
        let mut numbers = [
            f64::NEG_INFINITY,
            -2.5,
            -f64::MIN_POSITIVE,
            -0.0,
            0.0,
            5e-324,
            1.0,
            1.5,
            f64::INFINITY,
            f64::NAN,
        ];
        numbers.reverse();
        numbers.sort_by_key(|x| total_order(*x));
        assert!(numbers.is_sorted_by(|a, b| a.total_cmp(b).is_lt()), "{numbers:?}");
    }
}

//! Numbers as keys.

/// The bits of a number, which are equal where numbers are, though zero has two signs: to look numbers up.
#[doc(hidden)]
pub fn bits_of(x: f64) -> u64 {
    (x + 0.0).to_bits()
}

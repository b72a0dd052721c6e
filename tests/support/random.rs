//! Reproducible random numbers (SplitMix64), and what `TETRALOD_SEED` in the environment makes of them.

/// The seed that a test uses instead of `own`: another one for each value of the variable `TETRALOD_SEED`, or `own` where it
/// is not set. It is printed, so that every failure shows which one it was.
pub fn seed(own: u64) -> u64 {
    let Ok(text) = std::env::var("TETRALOD_SEED") else {
        println!("the test's own seed {own}; TETRALOD_SEED is not set");
        return own;
    };
    println!("seed {own} of TETRALOD_SEED={text}");
    let given =
        text.parse().unwrap_or_else(|_| panic!("TETRALOD_SEED={text} is not a number from 0 to 2^64 - 1"));
    own ^ Random(given).bits()
}

/// A random number generator that gives the same numbers everywhere.
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    /// Starts with [`seed`].
    pub fn new(own: u64) -> Self {
        Self(seed(own))
    }

    /// The next 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let x = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let x = (x ^ x >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        x ^ x >> 31
    }

    /// A number in `0 .. n`.
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// A number from 0 to 1, without 1.
    pub fn fraction(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A number in `low ..= high`.
    pub fn between(&mut self, low: i32, high: i32) -> i32 {
        low + self.below((i64::from(high) - i64::from(low) + 1) as usize) as i32
    }

    /// True once in `n` times.
    pub fn once_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    /// Puts the items into a random order.
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i + 1));
        }
    }
}

//! How far an update reaches: where all that depends on it lies.
//!
//! ```text
//!    u ──▶ v ──▶ x         ┌───────────────────┐ reach of u: the box around its own star
//!    └───▶ w               │  ┌─────┐     u    │ and the reaches of v and w
//!                          │  │  w  │ ┌──────┐ │
//!   an arrow leads to what │  └─────┘ │ v  x │ │
//!   depends on an update   │          └──────┘ │
//!                          └───────────────────┘
//! ```
//!
//! What must hold: the reach of an update contains that of every update that depends on it. Updates are found as removals of vertices,
//! finest first: each vertex keeps the box of its star and of the reaches of the removals that were there, which is the reach of its own
//! removal.

use crate::lattice::quantize::Quantized;

/// A box on the lattice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Reach {
    low: [i32; 3],
    high: [i32; 3],
}

impl Default for Reach {
    /// Holds nothing.
    fn default() -> Self {
        Self { low: [i32::MAX; 3], high: [i32::MIN; 3] }
    }
}

impl Reach {
    /// The lowest and the highest corner of the box.
    pub fn ends(&self) -> [[i32; 3]; 2] {
        [self.low, self.high]
    }

    pub fn add(&mut self, p: [i32; 3]) {
        self.join(&Self { low: p, high: p });
    }

    pub fn join(&mut self, other: &Self) {
        for i in 0..3 {
            self.low[i] = self.low[i].min(other.low[i]);
            self.high[i] = self.high[i].max(other.high[i]);
        }
    }
}

/// The box of each vertex's star.
pub(crate) fn of_stars(tets: &[[u32; 4]], positions: &[[i32; 3]]) -> Vec<Reach> {
    let mut reaches = vec![Reach::default(); positions.len()];
    for tet in tets {
        let mut own = Reach::default();
        tet.iter().for_each(|&v| own.add(positions[v as usize]));
        tet.iter().for_each(|&v| reaches[v as usize].join(&own));
    }
    reaches
}

/// Measures boxes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ruler {
    /// Steps of the lattice, the smallest being 1.
    steps: [f64; 3],
}

impl Ruler {
    pub fn new(quantized: &Quantized) -> Self {
        let steps = quantized.lattice.step;
        let least = steps.into_iter().fold(f64::INFINITY, f64::min);
        Self { steps: steps.map(|step| step / least) }
    }

    /// Eight times the logarithm to base 2 of the sum of a box's sides, linear between powers of two. It is read off the
    /// number's bits: libraries of different platforms round logarithms differently.
    pub fn size(&self, reach: &Reach) -> u32 {
        let side = |i: usize| (i64::from(reach.high[i]) - i64::from(reach.low[i])) as f64 * self.steps[i];
        let sum = (side(0) + side(1) + side(2)).max(1.0);
        // The exponent, and the first three bits of the mantissa.
        (sum.to_bits() >> 49) as u32 - (1023 << 3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(side: i32) -> Reach {
        let mut reach = Reach::default();
        reach.add([0; 3]);
        reach.add([side, 0, -side]);
        reach.add([0, side, 0]);
        reach
    }

    #[test]
    fn sizes_follow_the_logarithm_of_the_sides() {
        for steps in [[1.0; 3], [1.0, 1.0, 8.0], [0.5; 3]] {
            let ruler = Ruler { steps };
            for side in 1..5000 {
                let sum = steps.iter().sum::<f64>() * f64::from(side);
                let (size, exact) = (f64::from(ruler.size(&cube(side))), 8.0 * sum.log2());
                // Between powers of two a chord of the logarithm, 0.69 below it at most, rounded down.
                assert!(size <= exact + 1e-9 && size > exact - 1.7, "{side}: {size} {exact}");
                assert!(ruler.size(&cube(side + 1)) >= ruler.size(&cube(side)));
                assert_eq!(ruler.size(&cube(2 * side)), ruler.size(&cube(side)) + 8);
            }
            assert!(ruler.size(&cube(i32::MAX)) < 8 * 36);
        }
        assert_eq!(Ruler { steps: [1.0; 3] }.size(&Reach::default()), 0);
    }
}

//! The test signal of Marschner and Lobb, *An Evaluation of Reconstruction Filters for Volume Rendering* (1994): a wave along z, and
//! around it rings that get narrower, in the cube from −1 to 1. A grid of 40³ points has just enough of them for its rings.

use std::f64::consts::{FRAC_PI_2, TAU};
use tetralod::mesh::{Grid, GridArray, LayeredGrid};

/// The frequency of the rings and their strength, as usual.
const FREQUENCY: f64 = 6.0;
const ALPHA: f64 = 0.25;

pub(super) fn layers(size: u32) -> LayeredGrid {
    let spacing = 2.0 / f64::from(size - 1);
    let grid = Grid { dims: [size; 3], origin: [-1.0; 3], spacing: [spacing; 3] };
    let array = GridArray { name: "density", components: 1, is_single: true };
    LayeredGrid::new(grid, vec![array], move |_, z, values| {
        for (y, row) in (0..).zip(values.chunks_exact_mut(size as usize)) {
            for (x, value) in (0..).zip(row) {
                *value = density(grid.point([x, y, z]));
            }
        }
    })
}

fn density([x, y, z]: [f64; 3]) -> f64 {
    let rings = libm::cos(TAU * FREQUENCY * libm::cos(FRAC_PI_2 * (x * x + y * y).sqrt()));
    (1.0 - libm::sin(FRAC_PI_2 * z) + ALPHA * (1.0 + rings)) / (2.0 * (1.0 + ALPHA))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_goes_from_0_to_1_and_has_its_rings() {
        assert!((density([0.0, 0.0, -1.0]) - 1.0).abs() < 1e-15);
        assert!(density([0.0, 0.0, 1.0]) >= 0.0);
        // As many crests from the middle to the face as the frequency says.
        let values: Vec<f64> = (0..=1000).map(|i| density([f64::from(i) / 1000.0, 0.0, 0.0])).collect();
        let crests = values.windows(3).filter(|w| w[1] > w[0] && w[1] > w[2]).count();
        assert_eq!(crests, 5);
    }
}

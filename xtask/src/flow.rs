//! The demo's volume with vectors and time steps: the flow of Arnold, Beltrami and Childress in a cube of one period, which drifts
//! along the diagonal.

use std::f64::consts::TAU;
use std::path::Path;

use anyhow::Result;

use crate::vti::{self, Array, Grid};

/// Points along an edge of the grid.
const POINTS: usize = 21;

/// Time steps; together they drift through a whole period.
pub const STEPS: u32 = 8;

/// The amplitudes that are usual for it.
const AMPLITUDES: [f64; 3] = [1.0, 0.816_496_580_927_726, 0.577_350_269_189_625_8];

/// Writes one time step as a `.vti` file with `pressure` and the vector `velocity`.
pub fn write(path: &Path, step: u32) -> Result<()> {
    let grid = Grid { points: [POINTS; 3], spacing: TAU / (POINTS - 1) as f64 };
    let drift = TAU * f64::from(step) / f64::from(STEPS);
    let velocities: Vec<[f64; 3]> = (0..grid.len()).map(|i| flow(grid.place(i).map(|x| x - drift))).collect();
    // Bernoulli's: the same energy everywhere.
    let pressure = velocities.iter().map(|[u, v, w]| -0.5 * (u * u + v * v + w * w)).collect();
    let arrays = [
        Array { name: "pressure", components: 1, values: pressure },
        Array { name: "velocity", components: 3, values: velocities.into_flattened() },
    ];
    vti::write(path, &grid, &arrays)
}

fn flow([x, y, z]: [f64; 3]) -> [f64; 3] {
    let [a, b, c] = AMPLITUDES;
    [a * z.sin() + c * y.cos(), b * x.sin() + a * z.cos(), c * y.sin() + b * x.cos()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_flow_is_its_own_curl() {
        let h = 1e-4;
        for place in [[0.3, 1.2, 5.0], [4.0, 0.0, 2.5]] {
            let slope = |component: usize, axis: usize| {
                let at = |by: f64| {
                    let mut p: [f64; 3] = place;
                    p[axis] += by;
                    flow(p)[component]
                };
                (at(h) - at(-h)) / (2.0 * h)
            };
            for i in 0..3 {
                let curl = slope((i + 2) % 3, (i + 1) % 3) - slope((i + 1) % 3, (i + 2) % 3);
                assert!((curl - flow(place)[i]).abs() < 1e-6, "{place:?}");
            }
        }
    }
}

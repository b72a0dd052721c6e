//! The flow of Arnold, Beltrami and Childress in a cube of one period, which drifts along the diagonal: vortices in all three
//! directions, a steady solution of Euler's equations that is its own curl.

use std::f64::consts::TAU;
use tetralod::mesh::{Grid, GridArray, LayeredGrid};

/// The amplitudes that are usual for it.
const AMPLITUDES: [f64; 3] = [1.0, 0.816_496_580_927_726, 0.577_350_269_189_625_8];

/// `pressure` and the vector `velocity` where the flow has drifted through the part `phase` of its period.
pub(super) fn layers(size: u32, phase: f64) -> LayeredGrid {
    let spacing = TAU / f64::from(size - 1);
    let grid = Grid { dims: [size; 3], origin: [0.0; 3], spacing: [spacing; 3] };
    let drift = TAU * phase;
    // The same along all axes.
    let waves: Vec<Wave> =
        (0..size).map(|i| f64::from(i) * spacing - drift).map(|x| [libm::sin(x), libm::cos(x)]).collect();
    let arrays = [("pressure", 1), ("velocity", 3)];
    let arrays = arrays.map(|(name, components)| GridArray { name, components, is_single: true });
    LayeredGrid::new(grid, arrays.to_vec(), move |array, z, values| {
        let z = &waves[z as usize];
        let places = waves.iter().flat_map(|y| waves.iter().map(move |x| [x, y, z]));
        if array == 0 {
            values.iter_mut().zip(places).for_each(|(value, place)| *value = rounded(pressure(flow(place))));
        } else {
            let velocities = values.as_chunks_mut().0.iter_mut();
            velocities.zip(places).for_each(|(value, place)| *value = flow(place).map(rounded));
        }
    })
}

/// Sine and cosine of a coordinate.
type Wave = [f64; 2];

fn flow([x, y, z]: [&Wave; 3]) -> [f64; 3] {
    let [a, b, c] = AMPLITUDES;
    [a * z[0] + c * y[1], b * x[0] + a * z[1], c * y[0] + b * x[1]]
}

/// Bernoulli's: the same energy everywhere.
fn pressure([u, v, w]: [f64; 3]) -> f64 {
    -0.5 * (u * u + v * v + w * w)
}

/// To five decimals.
pub(super) fn rounded(value: f64) -> f64 {
    (value * 1e5).round() / 1e5
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
                    let waves = p.map(|x| [x.sin(), x.cos()]);
                    flow(waves.each_ref())[component]
                };
                (at(h) - at(-h)) / (2.0 * h)
            };
            for i in 0..3 {
                let curl = slope((i + 2) % 3, (i + 1) % 3) - slope((i + 1) % 3, (i + 2) % 3);
                let waves = place.map(|x: f64| [x.sin(), x.cos()]);
                assert!((curl - flow(waves.each_ref())[i]).abs() < 1e-6, "{place:?}");
            }
        }
    }

    #[test]
    fn after_a_period_it_is_where_it_was() {
        let meshes = [0.0, 0.25, 1.0].map(|phase| layers(9, phase).to_mesh());
        let names: Vec<_> = meshes[0].fields.iter().map(|field| field.name.as_str()).collect();
        assert_eq!(names, ["pressure", "velocity_x", "velocity_y", "velocity_z"]);
        for (field, later) in meshes[0].fields.iter().zip(&meshes[2].fields) {
            let pairs = || field.values.iter().zip(&later.values);
            assert!(pairs().all(|(a, b)| (a - b).abs() < 2e-5));
        }
        assert_ne!(meshes[0], meshes[1]);
    }
}

//! A bucky ball: see [`super::bucky`].

use tetralod::mesh::{Grid, GridArray, LayeredGrid};

pub(super) fn layers(size: u32) -> LayeredGrid {
    const SIGMA: f64 = 0.055;
    let spacing = 1.0 / f64::from(size - 1);
    let grid = Grid { dims: [size; 3], origin: [0.0; 3], spacing: [spacing; 3] };
    // The exponential of a sum of squares is a product of one factor an axis: 3 · 60 · size of them do.
    let factors = truncated_icosahedron().map(|atom| {
        atom.map(|c| {
            let factor = |i| {
                let d = spacing * f64::from(i) - c;
                libm::exp(-d * d / (2.0 * SIGMA * SIGMA))
            };
            (0..size).map(factor).collect::<Vec<f64>>()
        })
    });
    let array = GridArray { name: "density", components: 1, is_single: false };
    LayeredGrid::new(grid, vec![array], move |_, z, values| {
        for (y, values) in values.chunks_exact_mut(size as usize).enumerate() {
            for [fx, fy, fz] in &factors {
                let factor = fy[y] * fz[z as usize];
                values.iter_mut().zip(fx).for_each(|(value, fx)| *value += factor * fx);
            }
        }
    })
}

/// The vertices of a truncated icosahedron of radius 0.35 around (0.5, 0.5, 0.5): the cyclic permutations of
/// (0, ±1, ±3φ), (±1, ±(2+φ), ±2φ) and (±φ, ±2, ±(2φ+1)), scaled.
fn truncated_icosahedron() -> [[f64; 3]; 60] {
    const RADIUS: f64 = 0.35;
    let phi = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let kinds = [[0.0, 1.0, 3.0 * phi], [1.0, 2.0 + phi, 2.0 * phi], [phi, 2.0, 2.0 * phi + 1.0]];
    let mut vertices = [[0.0; 3]; 60];
    let mut slots = vertices.iter_mut();
    for kind in kinds {
        let length = kind.iter().map(|x| x * x).sum::<f64>().sqrt();
        // A zero has one sign.
        for signs in (0..8).filter(|signs| kind[0] != 0.0 || signs & 1 == 0) {
            let signed = [0, 1, 2].map(|i| if signs >> i & 1 == 0 { kind[i] } else { -kind[i] });
            for turn in 0..3 {
                if let Some(slot) = slots.next() {
                    *slot = [0, 1, 2].map(|i| 0.5 + RADIUS / length * signed[(i + turn) % 3]);
                }
            }
        }
    }
    vertices
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::{bucky, space};
    use tetralod::mesh::check;

    fn plain_density(p: [f64; 3]) -> f64 {
        let terms = truncated_icosahedron().map(|a| {
            let d2: f64 = (0..3).map(|i| (p[i] - a[i]) * (p[i] - a[i])).sum();
            (-d2 / (2.0 * 0.055 * 0.055)).exp()
        });
        terms.iter().sum()
    }

    #[test]
    fn the_icosahedron_is_truncated_and_regular() {
        let atoms = truncated_icosahedron();
        for (i, a) in atoms.iter().enumerate() {
            let mut distances: Vec<f64> = atoms
                .iter()
                .enumerate()
                .filter(|(j, _)| *j != i)
                .map(|(_, b)| (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum::<f64>().sqrt())
                .collect();
            distances.sort_by(f64::total_cmp);
            // Three bonds of one length (circumradius / 2.478), then the next are longer.
            let bond = 0.35 / 2.478_018_66;
            assert!(distances[..3].iter().all(|d| (d - bond).abs() < 1e-8), "{i}: {:?}", &distances[..4]);
            assert!(distances[3] > 1.5 * bond);
            let radius = (0..3).map(|k| (a[k] - 0.5) * (a[k] - 0.5)).sum::<f64>().sqrt();
            assert!((radius - 0.35).abs() < 1e-15);
        }
    }

    #[test]
    fn bucky_follows_its_definition() {
        for size in [2, 3, 9, 16] {
            let mesh = bucky(size).unwrap();
            check(&mesh).unwrap();
            assert_eq!(mesh.tets.len() as u32, 6 * (size - 1).pow(3));
            assert_eq!(mesh.positions.len() as u32, size.pow(3));
            assert!((space(&mesh) - 1.0).abs() < 1e-12);
            assert_eq!(mesh.fields[0].name, "density");
            for (p, value) in mesh.positions.iter().zip(&mesh.fields[0].values) {
                let expected = plain_density(*p);
                assert!((value - expected).abs() <= 1e-13 * expected + 1e-300, "{p:?}: {value} {expected}");
            }
        }
    }
}

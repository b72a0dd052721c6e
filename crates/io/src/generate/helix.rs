//! A model of DNA in its usual form, as the electron densities of its atoms might be. Its proportions are those of textbooks; it is no
//! measured molecule.

use crate::generate::abc_flow::rounded;
use std::f64::consts::PI;
use tetralod::mesh::{Grid, GridArray, LayeredGrid};

/// Of the box, in ångströms; it is 7/3 times as high.
const WIDTH: f64 = 28.0;

/// From one pair of bases to the next: along the axis, and around it.
const RISE: f64 = 3.32;
const TWIST: f64 = 2.0 * PI / 10.5;
/// How far the second strand is around the axis from the first: less than half of a turn, so that one groove is wider.
const GROOVE: f64 = 0.78 * PI;
/// Distances from the axis.
const PHOSPHATE: f64 = 9.3;
const SUGAR: f64 = 7.4;

/// The bases of the first strand, over and over.
const SEQUENCE: &[u8] = b"GATTACAGCCTGAATCGTACCATG";

/// How far an atom's density reaches (the deviation of a Gaussian), and where it is taken to be none.
const SIGMA: f64 = 0.95;
const REACH: f64 = 5.0 * SIGMA;

struct Atom {
    place: [f64; 3],
    weight: f64,
    charge: f64,
}

/// `density` and `charge`, with `size` points across.
pub(super) fn layers(size: u32) -> LayeredGrid {
    let last = size - 1;
    let spacing = WIDTH / f64::from(last);
    let grid = Grid { dims: [size, size, last * 7 / 3 + 1], origin: [0.0; 3], spacing: [spacing; 3] };
    let atoms = atoms(f64::from(grid.dims[2] - 1) * spacing);
    let arrays = ["density", "charge"].map(|name| GridArray { name, components: 1, is_single: true });
    LayeredGrid::new(grid, arrays.to_vec(), move |array, z, values| {
        for Atom { place, weight, charge } in &atoms {
            let [x, y, own_z] = *place;
            let Some((_, factor)) = near(own_z, spacing).find(|(i, _)| *i == z as usize) else { continue };
            let factor = factor * weight * if array == 0 { 1.0 } else { *charge };
            let is_inside = |(i, _): &(usize, f64)| *i < size as usize;
            let xs: Vec<_> = near(x, spacing).filter(is_inside).collect();
            for (y, fy) in near(y, spacing).filter(is_inside) {
                for (x, fx) in &xs {
                    values[x + size as usize * y] += factor * fy * fx;
                }
            }
        }
        values.iter_mut().for_each(|value| *value = rounded(*value));
    })
}

/// The planes across an axis that an atom at `place` reaches, each with the part of its density there.
fn near(place: f64, spacing: f64) -> impl Iterator<Item = (usize, f64)> {
    let first = ((place - REACH) / spacing).ceil().max(0.0) as usize;
    let last = ((place + REACH) / spacing) as usize;
    let factor = move |i: usize| {
        let d = i as f64 * spacing - place;
        (i, libm::exp(-d * d / (2.0 * SIGMA * SIGMA)))
    };
    (first..=last).map(factor)
}

/// The atoms of as many pairs of bases as there is room for.
fn atoms(height: f64) -> Vec<Atom> {
    let pairs = ((height - 2.0 * REACH) / RISE) as usize;
    let bottom = (height - RISE * (pairs - 1) as f64) / 2.0;
    let at = |radius: f64, angle: f64, z: f64| {
        [WIDTH / 2.0 + radius * libm::cos(angle), WIDTH / 2.0 + radius * libm::sin(angle), z]
    };
    let mut atoms = Vec::new();
    for pair in 0..pairs {
        let (angle, z) = (TWIST * pair as f64, bottom + RISE * pair as f64);
        for (strand, direction) in [(angle, 1.0), (angle + GROOVE, -1.0)] {
            // The backbone: a phosphate between two sugars.
            let next = |part: f64| (strand + direction * part * TWIST, z + direction * part * RISE);
            for (part, radius, weight, charge) in [
                (0.0, SUGAR, 1.0, -0.1),
                (0.3, 8.4, 0.9, -0.3),
                (0.5, PHOSPHATE, 1.5, -1.0),
                (0.72, 8.7, 0.9, -0.3),
            ] {
                let (angle, z) = next(part);
                // The chain ends with the last pair.
                if (bottom - 0.1..=height - bottom + 0.1).contains(&z) {
                    atoms.push(Atom { place: at(radius, angle, z), weight, charge });
                }
            }
        }
        atoms.extend(bases(at(6.1, angle, z), at(6.1, angle + GROOVE, z), SEQUENCE[pair % SEQUENCE.len()]));
    }
    atoms
}

/// The atoms of a pair of bases between two sugars: rings of six, and one of five in the larger base.
fn bases(from: [f64; 3], to: [f64; 3], base: u8) -> Vec<Atom> {
    // The charges of the first base and of its partner.
    let (is_large, charges) = match base {
        b'A' => (true, [0.45, 0.15]),
        b'T' => (false, [0.15, 0.45]),
        b'G' => (true, [0.8, 0.3]),
        _ => (false, [0.3, 0.8]),
    };
    let along = [0, 1, 2].map(|i| to[i] - from[i]);
    let length = along.iter().map(|x| x * x).sum::<f64>().sqrt();
    // The larger one takes more of the way.
    let middle = if is_large { 0.56 } else { 0.44 };
    let ring = |centre: f64, count: usize, charge: f64| {
        (0..count).map(move |i| {
            let turn = 2.0 * PI * i as f64 / count as f64;
            let (ahead, aside) = (1.35 * libm::cos(turn) / length, 1.35 * libm::sin(turn) / length);
            let place = [
                from[0] + (centre + ahead) * along[0] - aside * along[1],
                from[1] + (centre + ahead) * along[1] + aside * along[0],
                from[2],
            ];
            Atom { place, weight: 0.62, charge }
        })
    };
    let [one, other] = charges;
    let mut atoms: Vec<Atom> = ring(middle - 0.16, 6, one).chain(ring(middle + 0.17, 6, other)).collect();
    if is_large {
        atoms.extend(ring(middle - 0.38, 5, one));
    } else {
        atoms.extend(ring(middle + 0.39, 5, other));
    }
    atoms
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn atoms_are_inside_and_on_two_strands() {
        let height = WIDTH * 7.0 / 3.0;
        let atoms = atoms(height);
        assert!(atoms.len() > 300, "{}", atoms.len());
        for Atom { place: [x, y, z], .. } in &atoms {
            let radius = (x - WIDTH / 2.0).hypot(y - WIDTH / 2.0);
            assert!(radius + 4.0 * SIGMA < WIDTH / 2.0, "{radius}");
            assert!(*z > 4.0 * SIGMA && *z < height - 4.0 * SIGMA, "{z}");
        }
        let phosphates = atoms.iter().filter(|atom| atom.charge == -1.0).count();
        assert!(phosphates.is_multiple_of(2) && phosphates > 20, "{phosphates}");
    }
}

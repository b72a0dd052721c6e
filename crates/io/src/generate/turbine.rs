//! A wheel with blades in a casing: see [`super::turbine`].

use std::f64::consts::TAU;
use tetralod::mesh::{Field, TetMesh};

/// Smallest and largest size.
pub(super) const SIZES: [u32; 2] = [3, 257];

/// Blades of the wheel.
const BLADES: u32 = 8;

/// Radii where parts meet: the bore of the shaft, hub, feet of the blades, their tips, inside and outside of the casing.
const RADII: [f64; 6] = [0.06, 0.14, 0.3, 0.82, 0.86, 1.0];

/// How far blades are twisted from one end to the other, in parts of the way around.
const TWIST: f64 = 0.09;

/// Half the length.
const HALF: f64 = 0.4;

/// What a cell is of, by its ring between [`RADII`] and where it is around and along the axis, in parts of the whole; none where there is
/// nothing.
///
/// ```text
///   along the axis             across
///   ├──── casing  11 | 12 ──┤     casing 11, from the other end on 12
///   ├ gap ──────────────────┤    ╱╲  ╱╲   blades 3 to 10, and nothing between them
///   │  blades     3 … 10    │   ╱  ╲╱  ╲
///   ├──── hub       2 ──────┤   ( hub 2 )
///   ├──── shaft     1 ──────┤   (shaft 1)
/// ```
fn part(ring: usize, around: u32, along: u32, cells: [u32; 2]) -> Option<u32> {
    let [all_around, all_along] = cells;
    let sector = all_around / BLADES;
    let in_blade = around % sector < sector.div_ceil(3);
    match ring {
        0 => Some(1),
        1 => Some(2),
        2 => in_blade.then_some(3 + around / sector),
        3 => None,
        _ => Some(if 2 * along < all_along { 11 } else { 12 }),
    }
}

pub(super) fn mesh(size: u32) -> TetMesh {
    let along = size - 1;
    let rings: Vec<f64> = radii(size);
    let around = BLADES * (size - 1).max(3);
    let (layers, rows) = (along + 1, rings.len() as u32);
    // Around the axis the last column is the first.
    let point = |k: u32, i: u32, j: u32| (k * rows + i) * around + j % around;
    let place = |k: u32, i: u32, j: u32| {
        let z = f64::from(k) / f64::from(along);
        let r = rings[i as usize];
        // Where there are blades, all turns with them.
        let twist = TWIST * (z - 0.5) * ((r - RADII[1]) / (RADII[3] - RADII[1])).clamp(0.0, 1.0);
        let angle = TAU * (f64::from(j) / f64::from(around) + twist);
        [r * libm::cos(angle), r * libm::sin(angle), HALF * (2.0 * z - 1.0)]
    };
    let mut all = Vec::with_capacity((layers * rows * around) as usize);
    for (k, i) in (0..layers).flat_map(|k| (0..rows).map(move |i| (k, i))) {
        all.extend((0..around).map(|j| place(k, i, j)));
    }
    let (mut tets, mut parts) = (Vec::new(), Vec::new());
    for (k, i, j) in
        (0..along).flat_map(|k| (0..rows - 1).flat_map(move |i| (0..around).map(move |j| (k, i, j))))
    {
        let ring = ring(f64::midpoint(rings[i as usize], rings[i as usize + 1]));
        let Some(part) = part(ring, j, k, [around, along]) else { continue };
        let corner = |bits: u32| point(k + (bits >> 2 & 1), i + (bits & 1), j + (bits >> 1 & 1));
        // Kuhn's six: neighbours agree on the diagonals of their faces, also where the columns close.
        for [a, b] in [[1, 2], [2, 4], [4, 1], [2, 1], [4, 2], [1, 4]] {
            let is_even = [[1, 2], [2, 4], [4, 1]].contains(&[a, b]);
            let path = [corner(0), corner(a), corner(a | b), corner(7)];
            tets.push(if is_even { path } else { [path[0], path[2], path[1], path[3]] });
            parts.push(f64::from(part));
        }
    }
    compact(all, tets, parts)
}

/// The radii of the layers of points: those where parts meet among them.
fn radii(size: u32) -> Vec<f64> {
    let mut radii = vec![RADII[0]];
    for pair in RADII.windows(2) {
        let steps = (f64::from(size - 1) * (pair[1] - pair[0])).ceil().max(1.0);
        let step = |s: u32| pair[0] + (pair[1] - pair[0]) * f64::from(s) / steps;
        radii.extend((1..=steps as u32).map(step));
    }
    radii
}

/// Between which of [`RADII`] a radius is.
fn ring(radius: f64) -> usize {
    RADII.iter().rposition(|r| *r <= radius).unwrap_or(0)
}

/// The mesh without the points that no cell has, with its fields.
fn compact(all: Vec<[f64; 3]>, mut tets: Vec<[u32; 4]>, parts: Vec<f64>) -> TetMesh {
    let mut numbers = vec![u32::MAX; all.len()];
    tets.iter().flatten().for_each(|&v| numbers[v as usize] = 0);
    let mut positions = Vec::new();
    for (number, place) in numbers.iter_mut().zip(all).filter(|(number, _)| **number == 0) {
        *number = positions.len() as u32;
        positions.push(place);
    }
    tets.iter_mut().for_each(|tet| *tet = tet.map(|v| numbers[v as usize]));
    let of = |value: fn(&[f64; 3]) -> f64| positions.iter().map(value).collect::<Vec<f64>>();
    let fields = vec![
        Field { unit: "K".to_owned(), ..Field::new("temperature", of(temperature)) },
        Field::new("stress", of(stress)),
    ];
    let part = Field { integer: true, ..Field::new("part", parts) };
    TetMesh { positions, fields, tets, cell_fields: vec![part], ..TetMesh::default() }
}

/// Hot gas comes in at one end, and cools down on its way; the shaft is cold.
fn temperature([x, y, z]: &[f64; 3]) -> f64 {
    let r = (x * x + y * y).sqrt();
    300.0 + 700.0 * r * libm::exp(-1.2 * (z + HALF)) * (1.0 - 0.35 * r)
}

/// Of a wheel that turns: largest at the feet of the blades.
fn stress([x, y, _]: &[f64; 3]) -> f64 {
    let r = (x * x + y * y).sqrt();
    let foot = (r - RADII[2]) / 0.08;
    (1.0 - r * r) + 0.8 * libm::exp(-foot * foot)
}

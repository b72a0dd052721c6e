//! Which points have to become one so that open seams close.
//!
//! Points within the weld distance of each other are at one *place*. Two faces at the same three places, seen from
//! opposite sides, are the two sides of an open seam: their points become one. So do those of tetrahedra at the same
//! four places, which several parts of a mesh have in common. Points at one place without such a face stay apart:
//! one point instead of two closes nothing there.

use crate::mesh::adjacency::{DisjointSets, FaceTable, HalfFace};
use crate::mesh::{EDGES, MeshError, TetMesh};

/// The pairs of points that have to become one. Cells in errors are numbered as in `mesh`.
pub(super) fn seam_pairs(mesh: &TetMesh, flat: &[bool], distance: f64) -> Result<Vec<(u32, u32)>, MeshError> {
    let TetMesh { positions, tets, .. } = mesh;
    // Otherwise a large distance would compare all points with all others.
    let is_short = |tet: &[u32; 4]| EDGES.iter().any(|&[i, j]| within(positions, tet[i], tet[j], distance));
    if distance > 0.0
        && let Some(t) = tets.iter().position(is_short)
    {
        return Err(MeshError::WeldTooFar { tet: (t as u32).into() });
    }
    let mut used = vec![false; positions.len()];
    tets.iter().flatten().for_each(|&v| used[v as usize] = true);
    let used = (0..).zip(&used).filter(|(_, used)| **used).map(|(v, _)| v).collect();
    let places = places(positions, used, distance);
    let placed: Vec<[u32; 4]> = tets.iter().map(|tet| tet.map(|v| places[v as usize])).collect();
    if placed == *tets {
        return Ok(Vec::new());
    }
    let is_collapsed = |tet: &[u32; 4]| EDGES.iter().any(|&[i, j]| tet[i] == tet[j]);
    if let Some(t) = placed.iter().position(is_collapsed) {
        return Err(MeshError::WeldTooFar { tet: (t as u32).into() });
    }
    let mut pairs = Vec::new();
    FaceTable::new(&placed)?.each_group(|group| {
        let first = group[0].tet() as usize;
        for other in group[1..].iter().filter(|_| meet(group, &placed, flat)) {
            let other = other.tet() as usize;
            for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
                if placed[first][i] == placed[other][j] && tets[first][i] != tets[other][j] {
                    pairs.push((tets[first][i], tets[other][j]));
                }
            }
        }
        Ok::<(), MeshError>(())
    })?;
    Ok(pairs)
}

/// Whether the tetrahedra around a face are one or two, perhaps several times, on opposite sides.
fn meet(group: &[HalfFace], tets: &[[u32; 4]], flat: &[bool]) -> bool {
    let apex = |face: &HalfFace| tets[face.tet() as usize][face.face()];
    let is_flat = |face: &HalfFace| flat[face.tet() as usize];
    let first = &group[0];
    let mut beyond = group.iter().filter(|face| apex(face) != apex(first));
    let Some(second) = beyond.next() else { return true };
    let folded = first.is_odd(tets) == second.is_odd(tets) && !is_flat(first) && !is_flat(second);
    !folded && beyond.all(|face| apex(face) == apex(second))
}

/// The place of each point: the first of `points` within the distance, or within the distance of one that is. All
/// other points have a place of their own.
pub(super) fn places(positions: &[[f64; 3]], mut points: Vec<u32>, distance: f64) -> Vec<u32> {
    let mut places: Vec<u32> = (0..positions.len() as u32).collect();
    let at = |v: u32| positions[v as usize];
    let largest = points.iter().flat_map(|&v| at(v)).fold(0.0_f64, |m, x| m.max(x.abs()));
    // Less than the rounding of coordinates.
    if distance <= largest * 4.0 * f64::EPSILON {
        let order = |a: &u32, b: &u32| at(*a).partial_cmp(&at(*b)).unwrap_or(std::cmp::Ordering::Equal);
        points.sort_unstable_by(|a, b| order(a, b).then(a.cmp(b)));
        for run in points.chunk_by(|&a, &b| at(a) == at(b)) {
            run.iter().for_each(|&v| places[v as usize] = run[0]);
        }
        return places;
    }
    let mut sets = DisjointSets::of(positions.len());
    // Cubes half as large as the distance: points in one of them are at one place, and those that are near are no more than two away.
    let cube = |v: u32| at(v).map(|x| (x / (0.5 * distance)).floor() as i64);
    let mut all: Vec<([i64; 3], u32)> = points.iter().map(|&v| (cube(v), v)).collect();
    all.sort_unstable();
    let cubes: Vec<&[([i64; 3], u32)]> = all.chunk_by(|a, b| a.0 == b.0).collect();
    for &cube in &cubes {
        let ([x, y, z], first) = cube[0];
        cube.iter().for_each(|&(_, v)| sets.join(first as usize, v as usize));
        for [i, j] in
            (0..=2).flat_map(|i| [-2, -1, 0, 1, 2].map(|j| [i, j])).filter(|column| *column >= [0, 0])
        {
            let begin = cubes.partition_point(|other| other[0].0 < [x + i, y + j, z - 2]);
            let column = cubes[begin..].iter().take_while(|other| other[0].0 <= [x + i, y + j, z + 2]);
            for other in column {
                let is_joined = sets.root(first as usize) == sets.root(other[0].1 as usize);
                if !is_joined
                    && cube.iter().any(|v| other.iter().any(|w| within(positions, v.1, w.1, distance)))
                {
                    sets.join(first as usize, other[0].1 as usize);
                }
            }
        }
    }
    points.iter().for_each(|&v| places[v as usize] = sets.root(v as usize) as u32);
    places
}

fn within(positions: &[[f64; 3]], v: u32, w: u32, distance: f64) -> bool {
    let [a, b] = [v, w].map(|v| positions[v as usize]);
    // In units of the distance, so that no square that matters over- or underflows.
    let square = |i: usize| ((a[i] - b[i]) / distance).powi(2);
    square(0) + square(1) + square(2) <= 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_at_one_place_if_they_are_near_or_joined_by_near_ones() {
        let at = |x: f64| [x, -0.0, 7.0];
        let points = [at(0.0), at(1.0), at(-0.0), at(0.2), at(0.4), [1.0, 0.0, 7.0]];
        let all = || (0..6).collect();
        assert_eq!(places(&points, all(), 0.0), [0, 1, 0, 3, 4, 1]);
        assert_eq!(places(&points, all(), 1e-20), [0, 1, 0, 3, 4, 1]);
        assert_eq!(places(&points, all(), 0.21), [0, 1, 0, 0, 0, 1]);
        assert_eq!(places(&points, vec![0, 4, 5], 0.21), [0, 1, 2, 3, 4, 5]);
        assert_eq!(places(&points, all(), 1e300), [0; 6]);
    }

    #[test]
    fn places_are_those_of_all_pairs() {
        let mut seed = 7_u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed >> 8) / f64::from(1 << 24) * 2.0 - 1.0
        };
        let points: Vec<[f64; 3]> = (0..300).map(|_| [random(), random(), random()]).collect();
        for distance in [0.01, 0.05, 0.1, 0.2] {
            let mut sets = DisjointSets::of(300);
            for (v, w) in (0..300).flat_map(|v| (0..v).map(move |w| (v, w))) {
                if within(&points, v, w, distance) {
                    sets.join(v as usize, w as usize);
                }
            }
            let expected: Vec<u32> = (0..300).map(|v| sets.root(v) as u32).collect();
            assert_eq!(places(&points, (0..300).collect(), distance), expected);
        }
    }
}

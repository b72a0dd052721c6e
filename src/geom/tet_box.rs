//! Does a tetrahedron meet a box? Exactly, on the lattice.

/// An axis-aligned box on the lattice, closed on all sides; empty if a minimum exceeds its maximum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LatticeBox {
    /// Smallest coordinates.
    pub min: [i32; 3],
    /// Largest coordinates.
    pub max: [i32; 3],
}

/// The faces of a positive tetrahedron, normals outward; see [`crate::geom::orient3d`].
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// Whether the positive tetrahedron and the box have a point in common, by the separating axis theorem in integers:
/// two convex polyhedra are disjoint iff a face normal of one or a cross product of two edges separates them.
/// Corners must lie in `0 ..= 2^30`.
pub fn tet_meets_box(corners: &[[i32; 3]; 4], region: &LatticeBox) -> bool {
    let inside = |p: &[i32; 3]| (0..3).all(|i| region.min[i] <= p[i] && p[i] <= region.max[i]);
    let span = |i: usize| corners.iter().fold((i32::MAX, i32::MIN), |(l, h), p| (l.min(p[i]), h.max(p[i])));
    let apart = |i: usize| {
        let (low, high) = span(i);
        high < region.min[i] || region.max[i] < low || region.min[i] > region.max[i]
    };
    if (0..3).any(apart) {
        return false;
    }
    if corners.iter().any(inside) {
        return true;
    }
    // What lies outside the tetrahedron's own bounds cannot matter, and clipping keeps the products small.
    let clipped: [[i64; 2]; 3] = [0, 1, 2].map(|i| {
        let (low, high) = span(i);
        [i64::from(region.min[i].max(low)), i64::from(region.max[i].min(high))]
    });
    let points = corners.map(|p| p.map(i64::from));
    !FACES.iter().any(|face| face_separates(&points, face, &clipped))
        && !EDGES.iter().any(|&[i, j]| (0..3).any(|axis| edge_separates(&points, i, j, axis, &clipped)))
}

fn face_separates(points: &[[i64; 3]; 4], face: &[usize; 3], region: &[[i64; 2]; 3]) -> bool {
    let [a, b, c] = face.map(|i| points[i]);
    let (u, v) = ([0, 1, 2].map(|i| b[i] - a[i]), [0, 1, 2].map(|i| c[i] - a[i]));
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    // The box's corner that is furthest inward.
    let height: i128 = (0..3)
        .map(|i| {
            let x = region[i][usize::from(normal[i] < 0)];
            i128::from(normal[i]) * i128::from(x - a[i])
        })
        .sum();
    height > 0
}

fn edge_separates(points: &[[i64; 3]; 4], i: usize, j: usize, axis: usize, region: &[[i64; 2]; 3]) -> bool {
    let (y, z) = ((axis + 1) % 3, (axis + 2) % 3);
    // The cross product of the unit vector of `axis` and the edge has only these two components.
    let (ny, nz) = (points[i][z] - points[j][z], points[j][y] - points[i][y]);
    let heights = points.map(|p| ny * p[y] + nz * p[z]);
    let side = |n: i64, at: usize, largest: bool| n * region[at][usize::from((n > 0) == largest)];
    let (low, high) = (side(ny, y, false) + side(nz, z, false), side(ny, y, true) + side(nz, z, true));
    heights.iter().all(|&h| h < low) || heights.iter().all(|&h| h > high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::orient3d;

    /// The plain twin for tiny coordinates: clips the tetrahedron's edges and faces by the box in rationals would
    /// be long; instead the box and the tetrahedron are scaled up and searched for a common point by linear
    /// programming over the planes' intersection points: a common point exists iff one exists among the
    /// intersections of three of the ten bounding planes.
    fn plain(corners: &[[i32; 3]; 4], region: &LatticeBox) -> bool {
        let mut planes: Vec<([i128; 3], i128)> = Vec::new();
        for face in FACES {
            let [a, b, c] = face.map(|i| corners[i].map(i128::from));
            let (u, v) = ([0, 1, 2].map(|i| b[i] - a[i]), [0, 1, 2].map(|i| c[i] - a[i]));
            let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            planes.push((n, n[0] * a[0] + n[1] * a[1] + n[2] * a[2]));
        }
        for i in 0..3 {
            let unit = |s: i128| [0, 1, 2].map(|k| if k == i { s } else { 0 });
            planes.push((unit(1), i128::from(region.max[i])));
            planes.push((unit(-1), -i128::from(region.min[i])));
        }
        let det = |a: [i128; 3], b: [i128; 3], c: [i128; 3]| {
            a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
                + a[2] * (b[0] * c[1] - b[1] * c[0])
        };
        for i in 0..planes.len() {
            for j in 0..i {
                for k in 0..j {
                    let (p, q, r) = (planes[i], planes[j], planes[k]);
                    let d = det(p.0, q.0, r.0);
                    if d == 0 {
                        continue;
                    }
                    let column = |m: usize| {
                        let swap = |n: [i128; 3], h: i128| [0, 1, 2].map(|x| if x == m { h } else { n[x] });
                        det(swap(p.0, p.1), swap(q.0, q.1), swap(r.0, r.1))
                    };
                    let point = [column(0), column(1), column(2)];
                    let holds = planes.iter().all(|(n, h)| {
                        (n[0] * point[0] + n[1] * point[1] + n[2] * point[2] - h * d) * d.signum() <= 0
                    });
                    if holds {
                        return true;
                    }
                }
            }
        }
        false
    }

    #[test]
    fn equals_the_search_for_a_common_point() {
        let mut state = 1_u64;
        let mut next = |n: i32| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as i32 % n
        };
        let (mut meet, mut apart) = (0, 0);
        while meet < 1500 || apart < 1500 {
            let mut corners = [[0; 3]; 4].map(|p: [i32; 3]| p.map(|_| next(9)));
            let volume = orient3d(corners[0], corners[1], corners[2], corners[3]);
            if volume == 0 {
                continue;
            }
            if volume < 0 {
                corners.swap(0, 1);
            }
            let min = [0; 3].map(|_: i32| next(9));
            let region = LatticeBox { min, max: min.map(|x| x + next(4)) };
            let expected = plain(&corners, &region);
            assert_eq!(tet_meets_box(&corners, &region), expected, "{corners:?} {region:?}");
            *(if expected { &mut meet } else { &mut apart }) += 1;
        }
    }
}

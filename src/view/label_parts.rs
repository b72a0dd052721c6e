//! Surfaces that show labels: triangles are cut where another corner of their tetrahedron becomes the nearest one, so that each part has one
//! label.
//!
//! What holds:
//! - The parts cover the surface, each place once, and a place has the label of the point of the mesh that has the largest barycentric
//!   coordinate there; of several such the smallest.
//! - Triangles whose points all have one label are not cut, but for the sides that they share with one that is: no vertex lies within a side
//!   of another triangle.
//! - Sides that cut a triangle are inner ones: they are no edges of the mesh.

use super::{Slope, Triangles};
use std::collections::HashSet;

/// Where a vertex of a surface is: on an edge between two points of the mesh, or twice the same point, and so far from the first to the second,
/// 0 to 1.
pub type EdgePlace = ([u32; 2], f64);

/// The parts of a surface, each of one label, in arrays as [`Triangles`] has them.
#[derive(Clone, Debug, Default)]
pub struct LabelParts {
    /// Vertices, in model units.
    pub positions: Vec<[f64; 3]>,
    /// A direction a vertex, if the surface has them.
    pub normals: Vec<[f32; 3]>,
    /// The label of each vertex: the three of a triangle have the same.
    pub labels: Vec<f64>,
    /// Triangles.
    pub indices: Vec<[u32; 3]>,
    /// Which sides of each triangle are no edges.
    pub inner_sides: Vec<u8>,
    /// Where each vertex goes, if the surface is displaced.
    pub moves: Vec<[f64; 3]>,
    /// How the moves change around each vertex, if the surface has that.
    pub slopes: Vec<Slope>,
}

/// Barycentric coordinates in a triangle of a surface.
type Weights = [f64; 3];

/// The corners of a triangle.
const CORNERS: [Weights; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// In place of the number of a side of the triangle: a side that cuts it.
const CUT: usize = 3;

/// Differences of barycentric coordinates that are rounding.
const ROUNDING: f64 = 1e-12;

/// The points of the mesh that have a share in a triangle, at most the four corners of a tetrahedron but for rounding.
struct Shares {
    points: [u32; 6],
    count: usize,
    /// The barycentric coordinate of each point at the corners of the triangle.
    at_corners: [Weights; 6],
}

impl Shares {
    fn of(corners: [EdgePlace; 3]) -> Self {
        let mut shares = Self { points: [0; 6], count: 0, at_corners: [[0.0; 3]; 6] };
        for (corner, ([a, b], t)) in corners.into_iter().enumerate() {
            for (point, share) in [(a, 1.0 - t), (b, t)].into_iter().filter(|(_, share)| *share > 0.0) {
                let known = shares.points[..shares.count].iter().position(|&other| other == point);
                let at = known.unwrap_or(shares.count);
                shares.points[at] = point;
                shares.count = shares.count.max(at + 1);
                shares.at_corners[at][corner] += share;
            }
        }
        shares
    }

    /// How much more of point `i` than of point `j` there is at the corners.
    fn more(&self, i: usize, j: usize) -> Weights {
        [0, 1, 2].map(|k| self.at_corners[i][k] - self.at_corners[j][k])
    }

    /// Where along the side from corner `k` to the next another point becomes the nearest one, ascending.
    fn changes(&self, k: usize) -> Vec<f64> {
        let ends = [k, (k + 1) % 3];
        let share = |i: usize, s: f64| {
            let [from, to] = ends.map(|end| self.at_corners[i][end]);
            from + s * (to - from)
        };
        let mut found = Vec::new();
        for i in 0..self.count {
            for j in 0..i {
                let [from, to] = ends.map(|end| self.more(i, j)[end]);
                if from * to < 0.0 {
                    let s = from / (from - to);
                    let most = (0..self.count).map(|point| share(point, s)).fold(0.0, f64::max);
                    found.extend((share(i, s) >= most - ROUNDING).then_some(s));
                }
            }
        }
        found.sort_by(f64::total_cmp);
        found.dedup_by(|a, b| (*a - *b).abs() < ROUNDING);
        found
    }
}

/// A vertex of a polygon in a triangle, and on which side of the triangle the polygon goes on from there.
type Corner = (Weights, usize);

fn dot(a: Weights, b: Weights) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The part of a convex polygon where a linear function, given at the corners of the triangle, is not negative (Sutherland and Hodgman 1974).
fn clipped(polygon: &[Corner], function: Weights) -> Vec<Corner> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, &(p, side)) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()].0;
        let [at_p, at_q] = [p, q].map(|place| dot(function, place));
        let crossing = || {
            let t = at_p / (at_p - at_q);
            [0, 1, 2].map(|k| p[k] * (1.0 - t) + q[k] * t)
        };
        if at_p > 0.0 && at_q < 0.0 {
            kept.extend([(p, side), (crossing(), CUT)]);
        } else if at_p >= 0.0 {
            kept.push((p, if at_q < 0.0 { CUT } else { side }));
        } else if at_q > 0.0 {
            kept.push((crossing(), side));
        }
    }
    kept
}

impl LabelParts {
    /// The parts of a surface, given where each of its vertices is and the label of each point of the mesh.
    ///
    /// # Panics
    /// If the surface names vertices, or the places points, that are not there.
    pub fn of(surface: &Triangles<'_>, places: &[EdgePlace], labels: &[f64]) -> Self {
        let shares: Vec<Shares> =
            surface.indices.iter().map(|triangle| Shares::of(triangle.map(|v| places[v as usize]))).collect();
        let label = |shares: &Shares, i: usize| labels[shares.points[i] as usize];
        let is_cut = |shares: &Shares| (1..shares.count).any(|i| label(shares, i) != label(shares, 0));
        let cut: Vec<bool> = shares.iter().map(is_cut).collect();
        let side = |triangle: &[u32; 3], k: usize| {
            let [a, b] = [triangle[k], triangle[(k + 1) % 3]];
            [a.min(b), a.max(b)]
        };
        let of_cut = surface.indices.iter().zip(&cut).filter(|(_, cut)| **cut);
        let sides: HashSet<[u32; 2]> =
            of_cut.flat_map(|(triangle, _)| [0, 1, 2].map(|k| side(triangle, k))).collect();
        let mut parts = Self::default();
        let mut vertex_of: Vec<Option<u32>> = vec![None; surface.positions.len()];
        for (t, (triangle, shares)) in surface.indices.iter().zip(&shares).enumerate() {
            let part = Triangle {
                surface,
                corners: *triangle,
                inner: surface.inner_sides.get(t).copied().unwrap_or(0),
            };
            if cut[t] {
                parts.cut(&part, shares, |i| label(shares, i));
                continue;
            }
            let changes = [0, 1, 2].map(|k| match sides.contains(&side(triangle, k)) {
                true => shares.changes(k),
                false => Vec::new(),
            });
            if changes.iter().any(|changes| !changes.is_empty()) {
                parts.fan(&part, &changes, label(shares, 0));
                continue;
            }
            let corners = [0, 1, 2].map(|k| {
                let known =
                    vertex_of[triangle[k] as usize].filter(|&v| parts.labels[v as usize] == label(shares, 0));
                known.unwrap_or_else(|| parts.vertex(&part, CORNERS[k], label(shares, 0)))
            });
            (0..3).for_each(|k| vertex_of[triangle[k] as usize] = Some(corners[k]));
            parts.push(corners, part.inner);
        }
        parts
    }

    /// The parts as triangles.
    pub fn triangles(&self) -> Triangles<'_> {
        Triangles {
            positions: &self.positions,
            normals: &self.normals,
            values: &self.labels,
            indices: &self.indices,
            inner_sides: &self.inner_sides,
            moves: &self.moves,
            slopes: &self.slopes,
            ..Triangles::default()
        }
    }

    /// The parts of a triangle, one for each point that is the nearest one somewhere.
    fn cut(&mut self, of: &Triangle<'_>, shares: &Shares, label: impl Fn(usize) -> f64) {
        for i in 0..shares.count {
            let mut polygon: Vec<Corner> = CORNERS.into_iter().zip(0..3).collect();
            for j in (0..shares.count).filter(|&j| j != i) {
                let more = shares.more(i, j);
                // Where both are as near everywhere, it is the part of the smaller label.
                let comes_first = label(i).total_cmp(&label(j)).then(i.cmp(&j)).is_lt();
                if more.iter().all(|x| x.abs() < ROUNDING) {
                    if !comes_first {
                        polygon.clear();
                    }
                } else {
                    polygon = clipped(&polygon, more);
                }
            }
            if area(&polygon) > ROUNDING {
                let vertices: Vec<u32> =
                    polygon.iter().map(|(at, _)| self.vertex(of, *at, label(i))).collect();
                for k in 1..vertices.len() - 1 {
                    let mut inner = 0;
                    for (bit, from, is_side) in
                        [(0, 0, k == 1), (1, k, true), (2, k + 1, k + 2 == vertices.len())]
                    {
                        let side = polygon[from].1;
                        let is_inner = !is_side || side == CUT || of.inner >> side & 1 == 1;
                        inner |= u8::from(is_inner) << bit;
                    }
                    self.push([vertices[0], vertices[k], vertices[k + 1]], inner);
                }
            }
        }
    }

    /// A triangle of one label with vertices on its sides, around its middle.
    fn fan(&mut self, of: &Triangle<'_>, changes: &[Vec<f64>; 3], label: f64) {
        let mut ring: Vec<(u32, usize)> = Vec::new();
        for k in 0..3 {
            ring.push((self.vertex(of, CORNERS[k], label), k));
            for &s in &changes[k] {
                let mut at = [0.0; 3];
                (at[k], at[(k + 1) % 3]) = (1.0 - s, s);
                ring.push((self.vertex(of, at, label), k));
            }
        }
        let middle = self.vertex(of, [1.0 / 3.0; 3], label);
        for (i, &(v, side)) in ring.iter().enumerate() {
            let next = ring[(i + 1) % ring.len()].0;
            self.push([middle, v, next], 0b101 | (of.inner >> side & 1) << 1);
        }
    }

    fn push(&mut self, triangle: [u32; 3], inner: u8) {
        self.indices.push(triangle);
        self.inner_sides.push(inner);
    }

    /// A new vertex at these barycentric coordinates of a triangle.
    fn vertex(&mut self, of: &Triangle<'_>, at: Weights, label: f64) -> u32 {
        let Triangle { surface, corners, .. } = of;
        let mix = |all: &[[f64; 3]]| {
            let [a, b, c] = corners.map(|v| all[v as usize]);
            [0, 1, 2].map(|axis| at[0] * a[axis] + at[1] * b[axis] + at[2] * c[axis])
        };
        let v = self.positions.len() as u32;
        self.positions.push(mix(surface.positions));
        self.labels.push(label);
        if !surface.normals.is_empty() {
            let sum = corners.iter().zip(at).fold(glam::DVec3::ZERO, |sum, (&v, share)| {
                sum + share * glam::DVec3::from(surface.normals[v as usize].map(f64::from))
            });
            self.normals.push(sum.normalize_or_zero().as_vec3().to_array());
        }
        if !surface.moves.is_empty() {
            self.moves.push(mix(surface.moves));
        }
        if !surface.slopes.is_empty() {
            let [a, b, c] = corners.map(|v| surface.slopes[v as usize]);
            let mixed = |i: usize, k: usize| at[0] * a[i][k] + at[1] * b[i][k] + at[2] * c[i][k];
            self.slopes.push([0, 1, 2].map(|i| [0, 1, 2].map(|k| mixed(i, k))));
        }
        v
    }
}

/// A triangle of a surface.
struct Triangle<'a> {
    surface: &'a Triangles<'a>,
    corners: [u32; 3],
    inner: u8,
}

/// Which part of the triangle a polygon in it is.
fn area(polygon: &[Corner]) -> f64 {
    let cross = |(a, _): &Corner, (b, _): &Corner| a[0] * b[1] - a[1] * b[0];
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).map(|(a, b)| cross(a, b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle whose corners are points, in the plane z = 0.
    fn corner_places() -> [EdgePlace; 3] {
        [0, 1, 2].map(|v| ([v, v], 0.0))
    }

    fn size(parts: &LabelParts, label: f64) -> f64 {
        let of = |triangle: &&[u32; 3]| parts.labels[triangle[0] as usize] == label;
        crate::view::area(&parts.positions, &parts.indices.iter().filter(of).copied().collect::<Vec<_>>())
    }

    #[test]
    fn each_corner_of_a_triangle_has_a_third() {
        let positions = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
        let surface = Triangles { positions: &positions, indices: &[[0, 1, 2]], ..Triangles::default() };
        let parts = LabelParts::of(&surface, &corner_places(), &[7.0, -2.0, 7.0]);
        assert!((size(&parts, 7.0) - 4.0).abs() < 1e-12 && (size(&parts, -2.0) - 2.0).abs() < 1e-12);
        assert!(
            parts
                .indices
                .iter()
                .all(|t| t.iter().all(|v| parts.labels[*v as usize] == parts.labels[t[0] as usize]))
        );
        // Each half of each side is an edge once, and nothing else is.
        let is_edge = |(triangle, inner): (&[u32; 3], &u8)| {
            let ends = (0..3).filter(|k| inner >> k & 1 == 0).map(|k| [triangle[k], triangle[(k + 1) % 3]]);
            ends.map(|end| end.map(|v| parts.positions[v as usize])).collect::<Vec<_>>()
        };
        let edges: Vec<[[f64; 3]; 2]> =
            parts.indices.iter().zip(&parts.inner_sides).flat_map(is_edge).collect();
        let length: f64 = edges.iter().map(|[a, b]| (a[0] - b[0]).hypot(a[1] - b[1])).sum();
        assert_eq!(edges.len(), 6);
        assert!((length - 12.0).abs() < 1e-12);
        // One label leaves it whole.
        let whole = LabelParts::of(&surface, &corner_places(), &[7.0; 3]);
        assert_eq!((whole.indices.len(), whole.labels), (1, vec![7.0; 3]));
    }

    #[test]
    fn a_triangle_beside_one_that_is_cut_has_its_vertices() {
        let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
        let indices = [[0, 1, 2], [1, 3, 2]];
        let surface = Triangles { positions: &positions, indices: &indices, ..Triangles::default() };
        let places = [0, 1, 2, 3].map(|v| ([v, v], 0.0));
        let parts = LabelParts::of(&surface, &places, &[1.0, 5.0, 5.0, 5.0]);
        let places = |v: u32| parts.positions[v as usize].map(|x| (x * 1e9).round() as i64);
        // Inside every side has its opposite; those of the square have none.
        let sides: Vec<[[i64; 3]; 2]> = parts
            .indices
            .iter()
            .flat_map(|t| [0, 1, 2].map(|k| [places(t[k]), places(t[(k + 1) % 3])]))
            .collect();
        let alone = sides.iter().filter(|[a, b]| !sides.contains(&[*b, *a]));
        let is_outside =
            |[a, b]: &&[[i64; 3]; 2]| (0..2).any(|axis| a[axis] == b[axis] && a[axis] % 1_000_000_000 == 0);
        assert!(alone.clone().all(|side| is_outside(&side)), "{:?}", alone.collect::<Vec<_>>());
        assert!(
            (size(&parts, 1.0) - 1.0 / 6.0).abs() < 1e-12 && (size(&parts, 5.0) - 5.0 / 6.0).abs() < 1e-12
        );
    }

    #[test]
    fn a_point_may_be_nearest_inside_alone() {
        // A section close to three corners that are alike, with the fourth in the middle.
        let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let surface = Triangles { positions: &positions, indices: &[[0, 1, 2]], ..Triangles::default() };
        let places = [0, 1, 2].map(|v| ([3, v], 0.7));
        let parts = LabelParts::of(&surface, &places, &[1.0, 1.0, 1.0, 8.0]);
        // The fourth has 0.3 everywhere, the others 0.7 of their coordinate: nearest where all are below 3/7.
        let island = 3.0 * (3.0 / 7.0) - 1.0_f64;
        assert!((size(&parts, 8.0) - 0.5 * island * island).abs() < 1e-12);
        assert!((size(&parts, 8.0) + size(&parts, 1.0) - 0.5).abs() < 1e-12);
        // On a plane between two points both are as near: the smaller label has it.
        let places = [([0, 1], 0.5), ([2, 2], 0.0), ([3, 3], 0.0)];
        let parts = LabelParts::of(&surface, &places, &[6.0, 4.0, 9.0, 9.0]);
        assert_eq!(size(&parts, 6.0), 0.0);
        assert!(size(&parts, 4.0) > 0.0 && (size(&parts, 4.0) + size(&parts, 9.0) - 0.5).abs() < 1e-12);
    }
}

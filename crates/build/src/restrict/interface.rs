//! Curved interfaces between regions, which may move within a tolerance.
//!
//! A vertex in the middle of a sheet, where two regions meet and nothing else, may be moved along an edge of the sheet if that leaves
//! the topology of all interfaces as it is, and both distances within the tolerance: that of the new triangles from the interfaces of
//! the reference mesh, measured at middles of triangles and edges, and that of the reference's vertices from the new triangles. Each
//! of these vertices belongs to the triangle that was nearest to it when its own was replaced. So in every consistent set, one of
//! the triangles that it has ever belonged to is in the mesh, and is within the tolerance of it.
//!
//! Where a sheet ends, at the boundary or at a third region, it stays.

use crate::change::hole::{Hole, sorted};
use crate::change::work_mesh::{LARGEST_STAR, TetSet, WorkMesh};
use crate::error::boundary_distance::BoundaryDistance;
use crate::error::points::as_vec;
use crate::lattice::quantize::Quantized;
use glam::DVec3;
use std::collections::BTreeMap;
use tetralod::geom::nearest_on_triangle;
use tetralod::mesh::FACES;

/// The interfaces of the reference mesh, and what has become of their vertices.
pub(crate) struct Interface {
    /// In model units.
    tolerance: f64,
    /// Of a step of the lattice.
    step: DVec3,
    reference: BoundaryDistance,
    positions: Vec<DVec3>,
    /// The removed vertices that belong to each triangle of the mesh.
    points: BTreeMap<[u32; 3], Vec<u32>>,
    /// How far any has moved, in model units.
    pub deviation: f64,
}

impl Interface {
    /// Of tetrahedra in these regions.
    pub fn new(tolerance: f64, tets: &[[u32; 4]], regions: &[u32], quantized: &Quantized) -> Self {
        let positions = (0..quantized.positions.len() as u32).map(|v| quantized.scaled(v)).collect();
        let reference = BoundaryDistance::of(interfaces(tets, regions), quantized.positions.len(), quantized);
        let step = DVec3::from_array(quantized.lattice.step);
        Self { tolerance, step, reference, positions, points: BTreeMap::new(), deviation: 0.0 }
    }

    /// Whether the vertex of a hole may be moved to `b`: it is in the middle of a sheet with these edges around it, of which `b` is one
    /// corner.
    pub fn may_move(
        &self,
        (hole, b): (&Hole, u32),
        edges: &[[u32; 2]],
        (mesh, regions): (&WorkMesh, &[u32]),
        positions: &[[i32; 3]],
    ) -> bool {
        is_sheet(edges)
            && keeps_topology((hole, b), edges, mesh, regions)
            && self.distance(hole.a, b, edges, positions).is_some()
    }

    /// The vertex `a` has been moved to `b`; `edges` are opposite it in triangles of interfaces.
    pub fn moved(&mut self, a: u32, b: u32, edges: &[[u32; 2]], positions: &[[i32; 3]]) {
        // What moves within a flat part is no farther away than before.
        let distance = self.distance(a, b, edges, positions).unwrap_or(0.0);
        self.deviation = self.deviation.max(distance);
        let new = self.triangles(b, edges, positions);
        let mut points = vec![a];
        for &[x, y] in edges {
            points.extend(self.points.remove(&sorted([a, x, y])).into_iter().flatten());
        }
        for point in points {
            let p = self.positions[point as usize];
            let squared = |corners: [DVec3; 3]| p.distance_squared(nearest_on_triangle(p, corners));
            let nearest = new.iter().min_by(|x, y| squared(x.1).total_cmp(&squared(y.1)));
            if let Some((triangle, _)) = nearest {
                self.points.entry(*triangle).or_default().push(point);
            }
        }
    }

    /// The new triangles once these edges are seen from `b`.
    fn triangles(&self, b: u32, edges: &[[u32; 2]], positions: &[[i32; 3]]) -> Vec<([u32; 3], [DVec3; 3])> {
        let new = edges.iter().filter(|edge| !edge.contains(&b)).map(|&[x, y]| [b, x, y]);
        let place = |v: u32| as_vec(positions[v as usize]) * self.step;
        new.map(|corners| (sorted(corners), corners.map(place))).collect()
    }

    /// The larger one of both distances; none if it is above the tolerance.
    fn distance(&self, a: u32, b: u32, edges: &[[u32; 2]], positions: &[[i32; 3]]) -> Option<f64> {
        let new = self.triangles(b, edges, positions);
        let old = edges.iter().filter_map(|&[x, y]| self.points.get(&sorted([a, x, y])));
        let mut largest = 0.0_f64;
        for point in old.flatten().copied().chain([a]) {
            let p = self.positions[point as usize];
            let squared =
                |(_, corners): &([u32; 3], [DVec3; 3])| p.distance_squared(nearest_on_triangle(p, *corners));
            largest = largest.max(new.iter().map(squared).fold(f64::INFINITY, f64::min).sqrt());
            if largest > self.tolerance {
                return None;
            }
        }
        for (vertices, [a, b, c]) in &new {
            for p in [(a + b + c) / 3.0, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5] {
                largest = largest.max(self.beside_reference(p, *vertices, largest));
                if largest > self.tolerance {
                    return None;
                }
            }
        }
        Some(largest)
    }

    /// How far a place is from the interfaces of the reference mesh, which is looked for from these vertices on until it is as near as
    /// `enough`.
    fn beside_reference(&self, p: DVec3, vertices: [u32; 3], enough: f64) -> f64 {
        let mut least = f64::INFINITY;
        for v in vertices {
            if let Some(&from) = self.reference.at(v).first().filter(|_| least > enough) {
                least = least.min(self.reference.walk(p, from, enough).1);
            }
        }
        least
    }
}

/// The triangles between tetrahedra of different regions.
fn interfaces(tets: &[[u32; 4]], regions: &[u32]) -> Vec<[u32; 3]> {
    let mut faces: Vec<([u32; 3], u32)> = Vec::with_capacity(4 * tets.len());
    for (tet, region) in tets.iter().zip(regions) {
        faces.extend(FACES.map(|face| (sorted(face.map(|k| tet[k])), *region)));
    }
    faces.sort_unstable();
    let is_between = |pair: &&[([u32; 3], u32)]| pair[0].0 == pair[1].0 && pair[0].1 != pair[1].1;
    faces.windows(2).filter(is_between).map(|pair| pair[0].0).collect()
}

/// Whether edges form a single closed polygon.
fn is_sheet(edges: &[[u32; 2]]) -> bool {
    let next = |i: usize, v: u32| {
        let mut others = (0..edges.len()).filter(|&j| j != i && edges[j].contains(&v));
        others.next().filter(|_| others.next().is_none())
    };
    let [first, mut v] = edges[0];
    let (mut i, mut walked) = (0, 1);
    while v != first {
        let Some(j) = next(i, v).filter(|_| walked < edges.len()) else { return false };
        v = if edges[j][0] == v { edges[j][1] } else { edges[j][0] };
        (i, walked) = (j, walked + 1);
    }
    walked == edges.len() && next(i, first) == Some(0)
}

/// The link condition of the edge to `b` for interfaces and boundary alone: what is next to both ends is next to the edge. Otherwise two
/// sheets would be laid onto each other.
fn keeps_topology((hole, b): (&Hole, u32), edges: &[[u32; 2]], mesh: &WorkMesh, regions: &[u32]) -> bool {
    let mut star = Vec::new();
    let Some(first) = hole.star.iter().map(|s| s.tet).find(|&t| mesh.tets[t as usize].contains(&b)) else {
        return false;
    };
    if !mesh.star_from(first, b, LARGEST_STAR, &mut TetSet::default(), &mut star) {
        return false;
    }
    let beside: Vec<u32> =
        edges.iter().filter(|edge| edge.contains(&b)).flatten().copied().filter(|&v| v != b).collect();
    let around_a = |v: u32| edges.iter().any(|edge| edge.contains(&v));
    for s in &star {
        let (tet, around) = (mesh.tets[s.tet as usize], mesh.neighbors[s.tet as usize]);
        for (k, &n) in around.iter().enumerate() {
            let is_interface = regions.get(n as usize) != Some(&regions[s.tet as usize]);
            if k == usize::from(s.corner) || !is_interface || tet[k] == b {
                continue;
            }
            let mut rest = (0..4).filter(|&l| l != k && l != usize::from(s.corner)).map(|l| tet[l]);
            let (Some(x), Some(y)) = (rest.next(), rest.next()) else { continue };
            if x == hole.a || y == hole.a {
                continue;
            }
            let is_new = |v: u32| around_a(v) && !beside.contains(&v);
            if is_new(x) || is_new(y) || edges.iter().any(|&edge| edge == [x, y] || edge == [y, x]) {
                return false;
            }
        }
    }
    beside.len() == 2
}

#[cfg(test)]
mod tests {
    use super::{interfaces, is_sheet};

    #[test]
    fn a_sheet_is_a_single_closed_polygon() {
        assert!(is_sheet(&[[1, 2], [2, 3], [3, 1]]));
        assert!(is_sheet(&[[1, 2], [3, 2], [4, 1], [3, 4]]));
        assert!(!is_sheet(&[[1, 2], [2, 3], [3, 4]]), "open");
        assert!(!is_sheet(&[[1, 2], [2, 3], [3, 1], [4, 5], [5, 6], [6, 4]]), "two");
        assert!(!is_sheet(&[[1, 2], [2, 3], [3, 1], [1, 5], [5, 6], [6, 1]]), "two that touch");
        assert!(!is_sheet(&[[1, 2]]));
    }

    #[test]
    fn interfaces_are_between_different_regions() {
        let tets = [[0, 1, 2, 3], [0, 1, 2, 4], [0, 1, 4, 5]];
        assert_eq!(interfaces(&tets, &[0, 0, 1]), [[0, 1, 4]]);
        assert_eq!(interfaces(&tets, &[0, 1, 1]), [[0, 1, 2]]);
        assert!(interfaces(&tets, &[2, 2, 2]).is_empty());
    }
}

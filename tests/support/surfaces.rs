//! Isosurfaces the plain way: crossed edges, their components, distances. Nothing of the library's own isosurface code.

use glam::DVec3;
use std::collections::BTreeMap;
use tetralod::geom::nearest_on_triangle;
use tetralod::mt::{CurrentMesh, MtInfo};

/// A mesh in model units with its first field.
pub struct Mesh {
    pub positions: Vec<DVec3>,
    pub values: Vec<f64>,
    pub tets: Vec<[u32; 4]>,
}

impl Mesh {
    pub fn of(info: &MtInfo, mesh: &CurrentMesh) -> Self {
        let slots = 0..mesh.positions().len() as u32;
        Self {
            positions: mesh.positions().iter().map(|&q| DVec3::from(info.lattice.point(q))).collect(),
            values: slots.map(|slot| info.fields[0].value(mesh.levels(slot)[0])).collect(),
            tets: mesh.tets().to_vec(),
        }
    }

    fn corners(&self, tet: [u32; 4]) -> [DVec3; 4] {
        tet.map(|v| self.positions[v as usize])
    }

    pub fn values_of(&self, tet: [u32; 4]) -> [f64; 4] {
        tet.map(|v| self.values[v as usize])
    }
}

/// An isosurface: the edges from values below to values above it, and the triangles between them.
pub struct Surface {
    /// The ends of each crossed edge, the smaller value first.
    pub edges: Vec<[u32; 2]>,
    /// Where each edge is crossed.
    pub points: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    /// For each edge, the number of the component that it belongs to.
    pub component: Vec<u32>,
    pub components: usize,
}

impl Surface {
    pub fn of(mesh: &Mesh, iso: f64) -> Self {
        let mut numbers: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        let mut surface = Self {
            edges: Vec::new(),
            points: Vec::new(),
            triangles: Vec::new(),
            component: Vec::new(),
            components: 0,
        };
        let mut joined: Vec<u32> = Vec::new();
        for tet in &mesh.tets {
            let is_below = |v: &u32| mesh.values[*v as usize] < iso;
            let (below, above): (Vec<u32>, Vec<u32>) = tet.iter().copied().partition(is_below);
            let mut crossing = |a: u32, b: u32| {
                *numbers.entry([a, b]).or_insert_with(|| {
                    let [f, g] = [a, b].map(|v| mesh.values[v as usize]);
                    let [p, q] = [a, b].map(|v| mesh.positions[v as usize]);
                    surface.edges.push([a, b]);
                    surface.points.push(p.lerp(q, (iso - f) / (g - f)));
                    joined.push(joined.len() as u32);
                    joined.len() as u32 - 1
                })
            };
            let ring: Vec<u32> = match (&below[..], &above[..]) {
                (&[a, b], &[c, d]) => vec![crossing(a, c), crossing(a, d), crossing(b, d), crossing(b, c)],
                (below, above) => below
                    .iter()
                    .flat_map(|a| above.iter().map(|b| (*a, *b)))
                    .map(|(a, b)| crossing(a, b))
                    .collect(),
            };
            for pair in ring.windows(2) {
                join(&mut joined, pair[0], pair[1]);
            }
            for i in 2..ring.len() {
                surface.triangles.push([ring[0], ring[i - 1], ring[i]]);
            }
        }
        surface.number_components(&mut joined);
        surface
    }

    fn number_components(&mut self, joined: &mut [u32]) {
        let mut names: BTreeMap<u32, u32> = BTreeMap::new();
        for edge in 0..self.edges.len() as u32 {
            let next = names.len() as u32;
            self.component.push(*names.entry(root(joined, edge)).or_insert(next));
        }
        self.components = names.len();
    }

    /// How far the points of this surface are from another one, at most; infinite if that is empty.
    pub fn distance_to(&self, other: &Self) -> f64 {
        let corners = |t: &[u32; 3]| t.map(|v| other.points[v as usize]);
        let triangles: Vec<[DVec3; 3]> = other.triangles.iter().map(corners).collect();
        let grid = Grid::new(&triangles);
        self.points.iter().map(|&p| grid.distance(&triangles, p)).fold(0.0, f64::max)
    }
}

fn root(joined: &mut [u32], mut i: u32) -> u32 {
    while joined[i as usize] != i {
        joined[i as usize] = joined[joined[i as usize] as usize];
        i = joined[i as usize];
    }
    i
}

fn join(joined: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(joined, a), root(joined, b));
    joined[a.max(b) as usize] = a.min(b);
}

/// Things with corners, sorted into the cells of a regular grid.
pub struct Grid {
    low: DVec3,
    side: f64,
    cells: [usize; 3],
    lists: Vec<Vec<u32>>,
}

impl Grid {
    pub fn new<const N: usize>(things: &[[DVec3; N]]) -> Self {
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        things.iter().flatten().for_each(|p| (low, high) = (low.min(*p), high.max(*p)));
        let extent = (high - low).max(DVec3::splat(f64::MIN_POSITIVE));
        let wanted = (things.len() as f64).cbrt().clamp(1.0, 64.0);
        let side = extent.max_element() / wanted;
        let cells = extent.to_array().map(|e| (e / side) as usize + 1);
        let mut grid = Self { low, side, cells, lists: vec![Vec::new(); cells.iter().product()] };
        for (i, corners) in (0..).zip(things) {
            let low = corners.iter().fold(DVec3::INFINITY, |m, p| m.min(*p));
            let high = corners.iter().fold(DVec3::NEG_INFINITY, |m, p| m.max(*p));
            for cell in grid.between(low, high) {
                grid.lists[cell].push(i);
            }
        }
        grid
    }

    fn between(&self, low: DVec3, high: DVec3) -> Vec<usize> {
        let along = |x: f64, axis: usize| {
            ((x - self.low[axis]) / self.side).clamp(0.0, (self.cells[axis] - 1) as f64) as usize
        };
        let range = |axis: usize| along(low[axis], axis)..=along(high[axis], axis);
        let mut cells = Vec::new();
        for z in range(2) {
            for y in range(1) {
                cells.extend(range(0).map(|x| (z * self.cells[1] + y) * self.cells[0] + x));
            }
        }
        cells
    }

    /// The distance of a point from the nearest of the triangles that the grid was made of.
    fn distance(&self, triangles: &[[DVec3; 3]], p: DVec3) -> f64 {
        if triangles.is_empty() {
            return f64::INFINITY;
        }
        let mut radius = self.side / 2.0;
        loop {
            let reach = DVec3::splat(radius);
            let near = self.between(p - reach, p + reach).into_iter().flat_map(|cell| &self.lists[cell]);
            let nearest = near
                .map(|&i| p.distance(nearest_on_triangle(p, triangles[i as usize])))
                .fold(f64::INFINITY, f64::min);
            if nearest <= radius {
                return nearest;
            }
            radius *= 2.0;
        }
    }
}

/// The interpolated field of a mesh.
pub struct Interpolant<'a> {
    mesh: &'a Mesh,
    grid: Grid,
}

impl<'a> Interpolant<'a> {
    pub fn new(mesh: &'a Mesh) -> Self {
        let corners: Vec<[DVec3; 4]> = mesh.tets.iter().map(|&tet| mesh.corners(tet)).collect();
        Self { mesh, grid: Grid::new(&corners) }
    }

    /// The value at a point; none outside of the mesh, up to rounding.
    pub fn at(&self, p: DVec3) -> Option<f64> {
        let (tet, weights) = self.find(p)?;
        Some(self.mesh.values_of(tet).iter().zip(weights).map(|(v, w)| v * w).sum())
    }

    /// The tetrahedron that a point lies in, and the point's barycentric coordinates there.
    pub fn find(&self, p: DVec3) -> Option<([u32; 4], [f64; 4])> {
        let cells = self.grid.between(p, p);
        let near = cells.iter().flat_map(|&cell| &self.grid.lists[cell]);
        let weighted = near.map(|&t| {
            let tet = self.mesh.tets[t as usize];
            (tet, barycentric(self.mesh.corners(tet), p))
        });
        weighted.into_iter().find(|(_, weights)| weights.iter().all(|&w| w >= -1e-9))
    }
}

fn barycentric([a, b, c, d]: [DVec3; 4], p: DVec3) -> [f64; 4] {
    let six = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| (b - a).cross(c - a).dot(d - a);
    let whole = six(a, b, c, d);
    [six(p, b, c, d), six(a, p, c, d), six(a, b, p, d), six(a, b, c, p)].map(|part| part / whole)
}

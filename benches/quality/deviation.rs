//! The difference of a mesh's field from the reference, at each reference vertex.
//!
//! A vertex is compared with the linear interpolants of all cells that contain it, turned over or not, of which the nearest value
//! counts. One that no cell contains is compared with the nearest point of the mesh's boundary, and it counts as outside if that is
//! farther away than rounding to a lattice explains.

use crate::Result;
use glam::DVec3;
use std::collections::HashMap;
use tetralod::geom::nearest_on_triangle;
use tetralod::mesh::TetMesh;

/// A vertex farther from the mesh than this part of the diagonal is outside of it: 16 bits round by up to 1.3e-5.
const OUTSIDE: f64 = 2e-5;

/// What rounding may make of a weight of 0.
const TINY: f64 = 1e-9;

/// The largest difference and the root of the mean square of all, in parts of the field's range; the vertices outside, and how far the
/// farthest is, in parts of the diagonal. As members of a JSON object.
pub fn report(reference: &TetMesh, mesh: &TetMesh) -> Result<String> {
    let field = &reference.fields[0];
    let other = mesh.fields.iter().find(|other| other.name == field.name);
    let values = &other.ok_or_else(|| format!("there is no field '{}'", field.name))?.values;
    let points: Vec<DVec3> = reference.positions.iter().copied().map(DVec3::from).collect();
    let mut least = vec![f64::INFINITY; points.len()];
    let grid = Grid::new(&points);
    for tet in &mesh.tets {
        let corners = corners(mesh, *tet);
        let edges = [1, 2, 3].map(|i| corners[i] - corners[0]);
        let volume = edges[0].dot(edges[1].cross(edges[2]));
        if volume == 0.0 {
            continue;
        }
        grid.visit(&corners, |i| {
            let p = points[i as usize] - corners[0];
            let [x, y, z] = [(1, 2), (2, 0), (0, 1)].map(|(j, k)| p.dot(edges[j].cross(edges[k])) / volume);
            let weights = [1.0 - x - y - z, x, y, z];
            if weights.iter().all(|w| *w >= -TINY) {
                let value: f64 = weights.iter().zip(tet).map(|(w, &v)| w * values[v as usize]).sum();
                let own = &mut least[i as usize];
                *own = own.min((value - field.values[i as usize]).abs());
            }
        });
    }
    let boundary = Boundary::new(mesh);
    let (low, high) = (grid.low, points.iter().copied().fold(grid.low, DVec3::max));
    let diagonal = low.distance(high);
    let (mut outside, mut farthest) = (0_usize, 0.0_f64);
    for (i, least) in least.iter_mut().enumerate().filter(|(_, least)| least.is_infinite()) {
        let (value, distance) = boundary.nearest(points[i], values);
        *least = (value - field.values[i]).abs();
        outside += usize::from(distance > OUTSIDE * diagonal);
        farthest = farthest.max(distance);
    }
    let range = field.values.iter().fold(f64::NEG_INFINITY, |high, v| high.max(*v))
        - field.values.iter().fold(f64::INFINITY, |low, v| low.min(*v));
    let largest = least.iter().copied().fold(0.0, f64::max) / range;
    let mean = least.iter().map(|d| d * d).sum::<f64>() / least.len() as f64;
    let (rms, farthest) = (mean.sqrt() / range, farthest / diagonal);
    let count = points.len();
    Ok(format!(
        "\"points\": {count}, \"max\": {largest:e}, \"rms\": {rms:e}, \"outside\": {outside}, \"farthest\": {farthest:e}"
    ))
}

fn corners<const N: usize>(mesh: &TetMesh, cell: [u32; N]) -> [DVec3; N] {
    cell.map(|v| DVec3::from(mesh.positions[v as usize]))
}

/// Points sorted into the cells of a regular grid.
struct Grid {
    low: DVec3,
    side: f64,
    cells: [usize; 3],
    /// Where the points of each cell begin in `points`.
    starts: Vec<u32>,
    points: Vec<u32>,
}

impl Grid {
    fn new(points: &[DVec3]) -> Self {
        let low = points.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = points.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let extent = high - low;
        // About two points in a cell, if they filled the box.
        let side = extent.max_element() / (points.len() as f64 / 2.0).cbrt().clamp(1.0, 256.0);
        let cells = extent.to_array().map(|e| (e / side) as usize + 1);
        let mut grid = Self {
            low,
            side,
            cells,
            starts: vec![0; cells.iter().product::<usize>() + 1],
            points: Vec::new(),
        };
        let of: Vec<usize> = points.iter().map(|p| grid.number(grid.cell(*p))).collect();
        of.iter().for_each(|&cell| grid.starts[cell + 1] += 1);
        (1..grid.starts.len()).for_each(|i| grid.starts[i] += grid.starts[i - 1]);
        let mut next = grid.starts.clone();
        grid.points = vec![0; points.len()];
        for (i, cell) in of.into_iter().enumerate() {
            grid.points[next[cell] as usize] = i as u32;
            next[cell] += 1;
        }
        grid
    }

    fn cell(&self, p: DVec3) -> [usize; 3] {
        let place = ((p - self.low) / self.side).to_array();
        [0, 1, 2].map(|axis| (place[axis].max(0.0) as usize).min(self.cells[axis] - 1))
    }

    fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.cells[1] + y) * self.cells[0] + x
    }

    /// Calls `visit` with all points in the box around the corners, and some beside it.
    fn visit(&self, corners: &[DVec3; 4], mut visit: impl FnMut(u32)) {
        let slack = DVec3::splat(TINY * self.side);
        let from = self.cell(corners.iter().copied().fold(DVec3::INFINITY, DVec3::min) - slack);
        let to = self.cell(corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max) + slack);
        for z in from[2]..=to[2] {
            for y in from[1]..=to[1] {
                let row = [from[0], to[0] + 1].map(|x| self.starts[self.number([0, y, z]) + x] as usize);
                self.points[row[0]..row[1]].iter().for_each(|&i| visit(i));
            }
        }
    }
}

/// The triangles that belong to one cell alone, with the centres and radii of spheres around them.
struct Boundary {
    triangles: Vec<([u32; 3], [DVec3; 3])>,
    spheres: Vec<(DVec3, f64)>,
}

impl Boundary {
    fn new(mesh: &TetMesh) -> Self {
        let mut found: HashMap<[u32; 3], u32> = HashMap::new();
        for tet in &mesh.tets {
            for left_out in 0..4 {
                let mut face = [0, 1, 2].map(|i| tet[(left_out + 1 + i) % 4]);
                face.sort_unstable();
                *found.entry(face).or_default() += 1;
            }
        }
        let mut faces: Vec<[u32; 3]> =
            found.into_iter().filter(|(_, n)| *n == 1).map(|(face, _)| face).collect();
        faces.sort_unstable();
        let triangles: Vec<_> = faces.into_iter().map(|face| (face, corners(mesh, face))).collect();
        let sphere = |(_, [a, b, c]): &([u32; 3], [DVec3; 3])| {
            let centre = (a + b + c) / 3.0;
            (centre, centre.distance(*a).max(centre.distance(*b)).max(centre.distance(*c)))
        };
        Self { spheres: triangles.iter().map(sphere).collect(), triangles }
    }

    /// The value at the nearest point of the boundary, and how far that is.
    fn nearest(&self, p: DVec3, values: &[f64]) -> (f64, f64) {
        let mut best = (f64::INFINITY, DVec3::ZERO, 0);
        for (i, (centre, radius)) in self.spheres.iter().enumerate() {
            let reach = best.0 + radius;
            if p.distance_squared(*centre) > reach * reach {
                continue;
            }
            let q = nearest_on_triangle(p, self.triangles[i].1);
            let distance = p.distance(q);
            if distance < best.0 {
                best = (distance, q, i);
            }
        }
        let (face, corners) = &self.triangles[best.2];
        let weights = weights(best.1, corners);
        (face.iter().zip(weights).map(|(&v, w)| w * values[v as usize]).sum(), best.0)
    }
}

/// The barycentric weights of a point of a triangle.
fn weights(q: DVec3, [a, b, c]: &[DVec3; 3]) -> [f64; 3] {
    let normal = (b - a).cross(c - a);
    let square = normal.length_squared();
    if square == 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let [y, z] = [(c, a), (a, b)].map(|(u, v)| (u - q).cross(v - q).dot(normal) / square);
    [1.0 - y - z, y, z]
}

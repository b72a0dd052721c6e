//! Values at the vertices of a mesh that fit the values of its reference at all vertices of that.
//!
//! A half-edge MT has the reference's own values at the vertices that it keeps, so the linear interpolants of a coarse mesh lie mostly on
//! one side of a field that is bent. Other values at the same vertices have a mean error that is some fifth less. Which are best depends on the
//! measure: the least mean square has larger single differences, the least largest one has a larger mean square. Between them lies
//! the least sum of cubes, which is found here as the least of a weighted sum of squares whose weights are the differences
//! (iteratively reweighted least squares); each of these by conjugate gradients.

use super::Reference;
use glam::DVec3;
use tetralod::geom::{PointGrid, TetPlaces, TriangleGrid, weights_on_triangle};
use tetralod::mesh::boundary_faces;
use tetralod::mt::{CurrentMesh, MtInfo};

/// How often weights are taken from the differences.
const ROUNDS: usize = 8;
/// Steps of conjugate gradients in each round, at most. All rounds go on from the values before.
const STEPS: usize = 40;
/// A round ends when the residual is this part of what it was.
const CONVERGED: f64 = 1e-4;
/// Differences count as no less than this part of the largest one, so that each vertex keeps some weight.
const LEAST_WEIGHT: f64 = 1e-3;
/// What moving a vertex's value by one unit costs, in differences of one unit: values do not depend on few and far points alone.
const INERTIA: f64 = 4e-4;

/// Values at the vertices of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fit {
    /// For each vertex of the mesh its value, in field units.
    pub values: Vec<f64>,
    /// The differences with the values that the mesh has.
    pub before: Differences,
    /// Those with [`Fit::values`].
    pub after: Differences,
}

/// How far linear interpolants are from the values at the reference vertices, in field units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Differences {
    /// The largest one.
    pub largest: f64,
    /// The root of the mean square.
    pub root_mean_square: f64,
}

impl Differences {
    fn of(differences: &[f64]) -> Self {
        let squares: f64 = differences.iter().map(|d| d * d).sum();
        let largest = differences.iter().fold(0.0, |most: f64, d| most.max(d.abs()));
        Self { largest, root_mean_square: (squares / differences.len().max(1) as f64).sqrt() }
    }
}

/// Fits the values of a field at the vertices of `mesh` to those of the reference. A reference vertex is compared with the linear interpolant
/// in a tetrahedron that contains it or, if there is none, at the nearest place of the boundary.
///
/// The same mesh and reference give the same values. Positions and tetrahedra stay, and so do bounds of the boundary's displacement; bounds of the field's
/// error are those of the values that the mesh has, while [`Fit::after`] is measured.
pub fn fit(info: &MtInfo, mesh: &CurrentMesh, reference: &Reference<'_>) -> Fit {
    let field = &info.fields[reference.field];
    let start: Vec<f64> = (0..mesh.positions().len() as u32)
        .map(|slot| field.value(mesh.levels(slot)[reference.field]))
        .collect();
    let system = System::new(info, mesh, reference);
    let mut values = start.clone();
    let mut differences = system.differences(&values);
    let before = Differences::of(&differences);
    let mut weights = vec![1.0; system.rows.len()];
    for round in 0..ROUNDS {
        let largest = Differences::of(&differences).largest;
        if largest == 0.0 {
            break;
        }
        if round > 0 {
            let weight = |d: &f64| (d.abs() / largest).max(LEAST_WEIGHT);
            weights.iter_mut().zip(&differences).for_each(|(w, d)| *w = weight(d));
            let mean = weights.iter().sum::<f64>() / weights.len() as f64;
            weights.iter_mut().for_each(|w| *w /= mean);
        }
        // Of cubes, half the way to the least of the weighted squares is the step of Newton's method.
        let way = if round == 0 { 1.0 } else { 0.5 };
        let step = system.solve(&weights, &differences, &values, &start);
        values.iter_mut().zip(step).for_each(|(value, step)| *value += way * step);
        differences = system.differences(&values);
    }
    Fit { after: Differences::of(&differences), values, before }
}

/// The value of the mesh at each reference vertex is a weighted mean of values at the mesh's vertices.
struct System {
    rows: Vec<([u32; 4], [f64; 4])>,
    wanted: Vec<f64>,
}

impl System {
    fn new(info: &MtInfo, mesh: &CurrentMesh, reference: &Reference<'_>) -> Self {
        let [origin, step] = [info.lattice.origin, info.lattice.step].map(DVec3::from);
        let places = reference.positions;
        let grid = PointGrid::new(places.iter().map(|&p| info.lattice.nearest(p)).collect());
        let mut found: Vec<Option<([u32; 4], [f64; 4])>> = vec![None; places.len()];
        for &tet in mesh.tets() {
            let corners = tet.map(|slot| mesh.positions()[slot as usize]);
            let at_tet = TetPlaces::new(corners);
            grid.near_tet(&corners, |i| {
                let row = &mut found[i as usize];
                if row.is_none() {
                    let place = (DVec3::from(places[i as usize]) - origin) / step;
                    *row = at_tet.weights(grid.points()[i as usize], place).map(|weights| (tet, weights));
                }
            });
        }
        let (mut rows, mut wanted) = (Vec::new(), Vec::new());
        let mut boundary = None;
        for ((row, &place), &value) in found.into_iter().zip(places).zip(reference.values) {
            let beside = || boundary.get_or_insert_with(|| Boundary::new(info, mesh)).nearest(place.into());
            if let Some(row) = row.or_else(beside) {
                rows.push(row);
                wanted.push(value);
            }
        }
        Self { rows, wanted }
    }

    /// What is missing to the wanted values.
    fn differences(&self, values: &[f64]) -> Vec<f64> {
        self.rows.iter().zip(&self.wanted).map(|(row, wanted)| wanted - at(row, values)).collect()
    }

    /// The change of `values` for which the weighted sum of the squares of the differences is least, together with that of the
    /// distances from `start`.
    fn solve(&self, weights: &[f64], differences: &[f64], values: &[f64], start: &[f64]) -> Vec<f64> {
        let mut residual: Vec<f64> = start.iter().zip(values).map(|(s, v)| INERTIA * (s - v)).collect();
        let weighted: Vec<f64> = differences.iter().zip(weights).map(|(d, w)| d * w).collect();
        self.add_back(&weighted, &mut residual);
        let mut change = vec![0.0; values.len()];
        let mut direction = residual.clone();
        let mut square = dot(&residual, &residual);
        let enough = square * CONVERGED * CONVERGED;
        for _ in 0..STEPS {
            if square <= enough {
                break;
            }
            let mut image: Vec<f64> = direction.iter().map(|d| INERTIA * d).collect();
            let along: Vec<f64> =
                self.rows.iter().zip(weights).map(|(row, w)| w * at(row, &direction)).collect();
            self.add_back(&along, &mut image);
            let way = square / dot(&direction, &image);
            change.iter_mut().zip(&direction).for_each(|(c, d)| *c += way * d);
            residual.iter_mut().zip(&image).for_each(|(r, i)| *r -= way * i);
            let next = dot(&residual, &residual);
            direction.iter_mut().zip(&residual).for_each(|(d, r)| *d = r + next / square * *d);
            square = next;
        }
        change
    }

    /// Adds to each vertex what its rows have, by their weights.
    fn add_back(&self, of_rows: &[f64], sums: &mut [f64]) {
        for ((corners, weights), own) in self.rows.iter().zip(of_rows) {
            corners.iter().zip(weights).for_each(|(&v, weight)| sums[v as usize] += weight * own);
        }
    }
}

/// The value of a row.
fn at((corners, weights): &([u32; 4], [f64; 4]), values: &[f64]) -> f64 {
    corners.iter().zip(weights).map(|(&v, weight)| weight * values[v as usize]).sum()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The boundary of the mesh.
struct Boundary {
    faces: Vec<[u32; 3]>,
    triangles: TriangleGrid,
}

impl Boundary {
    fn new(info: &MtInfo, mesh: &CurrentMesh) -> Self {
        let faces: Vec<[u32; 3]> =
            boundary_faces(mesh.tets(), mesh.neighbors()).map(|(_, face)| face).collect();
        let at = |slot: u32| DVec3::from(info.lattice.point(mesh.positions()[slot as usize]));
        Self { triangles: TriangleGrid::new(faces.iter().map(|face| face.map(at)).collect()), faces }
    }

    /// The nearest place.
    fn nearest(&self, place: DVec3) -> Option<([u32; 4], [f64; 4])> {
        let (i, q) = self.triangles.nearest(place)?;
        let [x, y, z] = self.faces[i as usize];
        let [a, b, c] = weights_on_triangle(q, self.triangles.corners[i as usize]);
        Some(([x, y, z, x], [a, b, c, 0.0]))
    }
}

//! The exact error of a collapse: what the field and the boundary lose, at every reference vertex concerned.
//!
//! Each reference vertex that is not a vertex of the mesh lives in the bucket of one tetrahedron: the one that
//! contains it or, where the boundary has moved, the one with the nearest boundary triangle. A collapse takes it from
//! a tetrahedron that it removes to one that it creates. So for every consistent set S, some tetrahedron of Σ_S had
//! the vertex in its bucket, and the error recorded then bounds what Σ_S has there.

use super::plan::Plan;
use super::quantize::Quantized;
use super::work_mesh::WorkMesh;
use crate::geom::nearest_on_triangle;
use crate::geom::orient3d;
use crate::mesh::NONE;
use glam::DMat3;
use glam::DVec3;

/// What is known of each vertex, input and created.
pub(super) struct VertexData {
    pub positions: Vec<[i32; 3]>,
    pub levels: Vec<i32>,
    /// The error of the update whose collapse made the vertex; 0 for reference vertices.
    pub error: Vec<f64>,
    /// Length of the longest chain of collapses that led to the vertex.
    pub height: Vec<u32>,
    /// How far the vertex may lie from the reference boundary, in model units.
    pub drift: Vec<f64>,
}

/// The reference vertices inside each tetrahedron, as linked lists.
pub(super) struct Buckets {
    first: Vec<u32>,
    next: Vec<u32>,
}

impl Buckets {
    pub fn new(tets: usize, points: usize) -> Self {
        Self { first: vec![NONE; tets], next: vec![NONE; points] }
    }

    fn take(&mut self, t: u32) {
        self.first[t as usize] = NONE;
    }

    fn put(&mut self, t: u32, point: u32) {
        self.next[point as usize] = std::mem::replace(&mut self.first[t as usize], point);
    }

    fn iter(&self, t: u32) -> impl Iterator<Item = u32> {
        let step = |p: u32| (p != NONE).then_some(p);
        std::iter::successors(step(self.first[t as usize]), move |&p| step(self.next[p as usize]))
    }
}

/// The reference mesh and the units of its errors.
pub(super) struct Reference<'a> {
    pub quantized: &'a Quantized,
    pub points: u32,
    /// Model units of displacement that count as an error of 1.
    pub displacement_per_error: f64,
}

/// One tetrahedron of the star after the collapse.
struct Cell {
    /// `(λ_x, λ_y, λ_z)` of a point are this times its position relative to the centre.
    barycentric: DMat3,
    others: [u32; 3],
    tet: u32,
}

/// Evaluates collapses; holds scratch space.
#[derive(Default)]
pub(super) struct Evaluator {
    cells: Vec<Cell>,
    /// Boundary triangles of the cells, with [`CENTRE`] for the centre.
    border: Vec<(u32, [u32; 3])>,
    border_known: bool,
    old_border: Vec<[u32; 3]>,
    /// Where each point goes: point and cell.
    moves: Vec<(u32, u32)>,
    /// The levels of the new vertex.
    pub levels: Vec<i32>,
    /// The levels' offsets.
    pub level_offsets: Vec<i32>,
    pub drift: f64,
    pub height: u32,
}

/// Stands for the new vertex, which has no number yet.
const CENTRE: u32 = NONE;

/// Barycentric coordinates this far below zero are rounding errors of a point on a face.
const SLACK: f64 = 1e-9;

impl Evaluator {
    /// The error of the planned collapse; any value above `limit` may be returned early once it is exceeded, then
    /// as a lower bound.
    pub fn evaluate(
        &mut self,
        plan: &Plan,
        mesh: &WorkMesh,
        data: &VertexData,
        buckets: &Buckets,
        reference: &Reference<'_>,
        limit: f64,
    ) -> f64 {
        self.halve_levels(plan, data, reference);
        let (inherited, newest) = self.inherit(plan, mesh, data);
        let overshoot = self.overshoot(plan, data, reference);
        self.cells.clear();
        self.cells
            .extend(plan.stay.iter().map(|&(s, _)| Cell::new(s.tet, s.corner as usize, plan, mesh, data)));
        let step = self.move_boundary(plan, mesh, data, reference);
        let mut error = inherited;
        if newest {
            error += overshoot.max(step / reference.displacement_per_error);
        }
        error = error.max(self.drift / reference.displacement_per_error);
        self.moves.clear();
        let stars = plan.stay.iter().enumerate().map(|(i, (s, _))| (s.tet, i));
        let fans = plan.fan.iter().map(|&(tet, ..)| (tet, 0));
        for (tet, cell) in stars.chain(fans) {
            for point in buckets.iter(tet) {
                error = error.max(self.place(point, cell, plan, mesh, data, reference));
                if error > limit {
                    return error;
                }
            }
        }
        for end in [plan.a, plan.b].into_iter().filter(|&end| end < reference.points) {
            error = error.max(self.place(end, 0, plan, mesh, data, reference));
        }
        error
    }

    /// Moves the points to the buckets where [`Evaluator::evaluate`] found them to belong.
    pub fn settle(&self, plan: &Plan, buckets: &mut Buckets) {
        plan.stay.iter().for_each(|(s, _)| buckets.take(s.tet));
        plan.fan.iter().for_each(|&(tet, ..)| buckets.take(tet));
        self.moves.iter().for_each(|&(point, cell)| buckets.put(self.cells[cell as usize].tet, point));
    }

    fn halve_levels(&mut self, plan: &Plan, data: &VertexData, reference: &Reference<'_>) {
        let fields = reference.quantized.fields.len();
        let [a, b] = [plan.a, plan.b].map(|v| &data.levels[v as usize * fields..][..fields]);
        self.level_offsets.clear();
        self.level_offsets.extend(a.iter().zip(b).map(|(a, b)| a - b));
        self.levels.clear();
        self.levels.extend(b.iter().zip(&self.level_offsets).map(|(b, d)| b + (d >> 1)));
    }

    /// The largest error among the updates that this one will be a parent of, and whether there are any.
    /// A tetrahedron was made by the collapse that made its newest vertex.
    fn inherit(&mut self, plan: &Plan, mesh: &WorkMesh, data: &VertexData) -> (f64, bool) {
        let (mut error, mut height) = (0.0_f64, 0);
        let stay = plan.stay.iter().map(|(s, _)| s.tet);
        for tet in stay.chain(plan.fan.iter().map(|&(tet, ..)| tet)) {
            let newest = mesh.tets[tet as usize].into_iter().fold(0, u32::max) as usize;
            error = error.max(data.error[newest]);
            height = height.max(data.height[newest]);
        }
        self.height = height + 1;
        (error, height > 0)
    }

    /// How much the ends exceed the range of values around the new vertex, as a fraction of the field's range.
    /// Added to the inherited error it makes the selection by isovalue monotone.
    fn overshoot(&self, plan: &Plan, data: &VertexData, reference: &Reference<'_>) -> f64 {
        let fields = &reference.quantized.fields;
        let level = |v: u32, f: usize| data.levels[v as usize * fields.len() + f];
        let mut largest = 0.0_f64;
        for (f, field) in fields.iter().enumerate() {
            let own = self.levels[f];
            let (low, high) =
                plan.link.iter().map(|&v| level(v, f)).fold((own, own), |(l, h), x| (l.min(x), h.max(x)));
            let (a, b) = (level(plan.a, f), level(plan.b, f));
            let beyond = (a.max(b) - high).max(low - a.min(b)).max(0);
            largest = largest.max(f64::from(beyond) * field.step / field.range());
        }
        largest * (1.0 + 1e-9)
    }

    /// Finds how the boundary moves: sets the drift of the new vertex, returns how far the ends are from the new
    /// boundary.
    fn move_boundary(
        &mut self,
        plan: &Plan,
        mesh: &WorkMesh,
        data: &VertexData,
        reference: &Reference<'_>,
    ) -> f64 {
        self.border_known = false;
        self.drift = data.drift[plan.a as usize].max(data.drift[plan.b as usize]);
        if !plan.on_boundary {
            return 0.0;
        }
        self.collect_old_border(plan, mesh);
        if self.is_flat(plan, data) {
            return 0.0;
        }
        self.collect_border(plan, mesh);
        let scaled = |q: [i32; 3]| reference.scaled(q);
        let at = |v: u32| scaled(data.positions[v as usize]);
        let centre = scaled(plan.position);
        let nearest = |p: DVec3, triangles: &mut dyn Iterator<Item = [DVec3; 3]>| {
            triangles.map(|t| p.distance(nearest_on_triangle(p, t))).fold(f64::INFINITY, f64::min)
        };
        self.drift += nearest(centre, &mut self.old_border.iter().map(|t| t.map(at)));
        let new = |v: u32| if v == CENTRE { centre } else { at(v) };
        [plan.a, plan.b]
            .map(|end| nearest(at(end), &mut self.border.iter().map(|(_, t)| t.map(new))))
            .into_iter()
            .fold(0.0, f64::max)
    }

    fn collect_old_border(&mut self, plan: &Plan, mesh: &WorkMesh) {
        self.old_border.clear();
        let mut old = |tet: u32, ends: &[usize]| {
            let (corners, around) = (mesh.tets[tet as usize], mesh.neighbors[tet as usize]);
            for k in (0..4).filter(|k| around[*k] == NONE) {
                // Triangles at either end: those not opposite the only end that the tetrahedron has.
                if ends.iter().any(|&end| end != k) {
                    self.old_border.push(crate::mesh::FACES[k].map(|l| corners[l]));
                }
            }
        };
        plan.fan.iter().for_each(|&(tet, i, j)| old(tet, &[i as usize, j as usize]));
        plan.stay.iter().for_each(|&(s, _)| old(s.tet, &[s.corner as usize]));
    }

    /// All boundary triangles of the cells, also those opposite the centre.
    fn collect_border(&mut self, plan: &Plan, mesh: &WorkMesh) {
        self.border_known = true;
        self.border.clear();
        for (i, &(s, _)) in plan.stay.iter().enumerate() {
            let mut corners = mesh.tets[s.tet as usize];
            corners[s.corner as usize] = CENTRE;
            let around = mesh.neighbors[s.tet as usize];
            for k in (0..4).filter(|&k| around[k] == NONE) {
                self.border.push((i as u32, crate::mesh::FACES[k].map(|l| corners[l])));
            }
        }
    }

    /// Whether the boundary stays where it is: around both ends it is flat, and in the same plane.
    fn is_flat(&self, plan: &Plan, data: &VertexData) -> bool {
        let at = |v: u32| data.positions[v as usize];
        let Some(plane) = self.old_border.first().map(|t| t.map(at)) else { return false };
        let in_plane = |p: [i32; 3]| orient3d(plane[0], plane[1], plane[2], p) == 0;
        in_plane(plan.position) && self.old_border.iter().flatten().all(|&v| in_plane(at(v)))
    }

    /// Finds the cell for a point, looking at `hint` first, and the error there.
    #[expect(clippy::too_many_arguments, reason = "one point in the light of all that evaluate was given")]
    fn place(
        &mut self,
        point: u32,
        hint: usize,
        plan: &Plan,
        mesh: &WorkMesh,
        data: &VertexData,
        reference: &Reference<'_>,
    ) -> f64 {
        let position = as_vec(reference.quantized.positions[point as usize]);
        let centre = as_vec(plan.position);
        let relative = position - centre;
        let (mut cell, mut lambda, mut depth) = (hint, DVec3::ZERO, f64::NEG_INFINITY);
        let order = std::iter::once(hint).chain((0..self.cells.len()).filter(|&i| i != hint));
        for i in order {
            let l = self.cells[i].barycentric * relative;
            let inside = l.min_element().min(1.0 - l.element_sum());
            if inside > depth {
                (cell, lambda, depth) = (i, l, inside);
            }
            if inside >= 0.0 {
                break;
            }
        }
        let mut displaced = 0.0;
        if depth < -SLACK {
            if !self.border_known {
                self.collect_border(plan, mesh);
            }
            // Without a boundary nothing is outside; what seems so is rounding.
            if let Some(nearest) = self.nearest_on_border(point, plan, data, reference) {
                (cell, lambda, displaced) = nearest;
            }
        }
        self.moves.push((point, cell as u32));
        let lambda = clamped(lambda);
        self.field_error(point, cell, lambda, data, reference)
            .max(displaced / reference.displacement_per_error)
    }

    /// The cell with the boundary triangle nearest to a point outside, the coordinates of the nearest point, and the
    /// distance in model units.
    fn nearest_on_border(
        &self,
        point: u32,
        plan: &Plan,
        data: &VertexData,
        reference: &Reference<'_>,
    ) -> Option<(usize, DVec3, f64)> {
        let p = reference.scaled(reference.quantized.positions[point as usize]);
        let centre = reference.scaled(plan.position);
        let at = |v: u32| if v == CENTRE { centre } else { reference.scaled(data.positions[v as usize]) };
        let (mut best, mut found, mut nearest) = (f64::INFINITY, None, centre);
        for &(cell, triangle) in &self.border {
            let q = nearest_on_triangle(p, triangle.map(at));
            if p.distance_squared(q) < best {
                (best, found, nearest) = (p.distance_squared(q), Some(cell as usize), q);
            }
        }
        let found = found?;
        let step = DVec3::from_array(reference.quantized.lattice.step);
        Some((found, self.cells[found].barycentric * ((nearest - centre) / step), best.sqrt()))
    }

    fn field_error(
        &self,
        point: u32,
        cell: usize,
        lambda: DVec3,
        data: &VertexData,
        reference: &Reference<'_>,
    ) -> f64 {
        let fields = &reference.quantized.fields;
        let own = 1.0 - lambda.element_sum();
        let mut largest = 0.0_f64;
        for (f, field) in fields.iter().enumerate() {
            let [x, y, z] =
                self.cells[cell].others.map(|v| f64::from(data.levels[v as usize * fields.len() + f]));
            let value = own * f64::from(self.levels[f]) + lambda.x * x + lambda.y * y + lambda.z * z;
            let exact = reference.quantized.exact[point as usize * fields.len() + f];
            largest = largest.max((value - exact).abs() * field.step / field.range());
        }
        largest
    }
}

impl Cell {
    fn new(tet: u32, centre: usize, plan: &Plan, mesh: &WorkMesh, data: &VertexData) -> Self {
        let corners = mesh.tets[tet as usize];
        let [i, j, k] = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]][centre];
        let others = [corners[i], corners[j], corners[k]];
        let [x, y, z] = others.map(|v| as_vec(data.positions[v as usize]) - as_vec(plan.position));
        // The orientation was found positive, so the matrix is regular.
        Self { barycentric: DMat3::from_cols(x, y, z).inverse(), others, tet }
    }
}

impl Reference<'_> {
    /// A lattice point in model units, from the lattice's origin.
    fn scaled(&self, q: [i32; 3]) -> DVec3 {
        as_vec(q) * DVec3::from_array(self.quantized.lattice.step)
    }
}

fn as_vec(q: [i32; 3]) -> DVec3 {
    DVec3::from_array(q.map(f64::from))
}

/// Barycentric coordinates of a point just outside, moved inside.
fn clamped(lambda: DVec3) -> DVec3 {
    let inside = lambda.max(DVec3::ZERO);
    let sum = inside.element_sum();
    if sum > 1.0 { inside / sum } else { inside }
}

//! The exact error of a removal: what the field and the boundary lose when a hole is filled, at every reference vertex
//! concerned.
//!
//! Buckets are those of [`super::cost`]. A removal takes points from tetrahedra that it removes to tetrahedra that it
//! makes; all other tetrahedra keep theirs, and their errors.

use super::cost::{Buckets, Face, Reference, largest, nearest_face, raise};
use super::hole::{Filling, Hole};
use super::points::{SLACK, as_vec, barycentric, bounds, clamped, locate};
use crate::mesh::NONE;
use glam::{DMat3, DVec3};

/// The removals so far.
#[derive(Default)]
pub(super) struct Removals {
    /// The removal that made each tetrahedron; [`NONE`] for those of the reference mesh.
    pub makers: Vec<u32>,
    /// The errors of each removal, field by field.
    pub errors: Vec<f64>,
}

/// What a removal costs whatever fills its hole.
#[derive(Clone, Debug, Default)]
pub(super) struct HoleCost {
    /// The largest error of each field among the removals that this one depends on.
    pub inherited: Vec<f64>,
    /// Whether there are any.
    pub depends: bool,
    /// The least error of this removal in each field.
    pub errors: Vec<f64>,
}

/// A hole, a filling of it, and what it is compared with.
#[derive(Clone, Copy)]
pub(super) struct Input<'a> {
    pub hole: &'a Hole,
    pub filling: &'a Filling,
    pub reference: &'a Reference<'a>,
}

/// One tetrahedron of a filling.
#[derive(Clone, Copy)]
struct Cell {
    /// `(λ_1, λ_2, λ_3)` of a point are this times its position relative to corner 0.
    barycentric: DMat3,
    origin: DVec3,
}

/// The cost of one filling, and where the points go; reused from filling to filling.
#[derive(Default)]
pub(super) struct FillCost {
    cells: Vec<Cell>,
    /// The border of the filling in model units, made when it is first needed.
    faces: Vec<Face>,
    flat: bool,
    /// Where each point goes: point, cell, and whether it is outside.
    moves: Vec<(u32, u32, bool)>,
    /// Points of other buckets that are inside: point and cell.
    foreign: Vec<(u32, u32)>,
    border_moves: Vec<(u32, u32)>,
    /// How far the boundary moves, as an error.
    pub step: f64,
    /// The error of each field.
    pub errors: Vec<f64>,
}

impl Removals {
    pub fn new(tets: usize) -> Self {
        Self { makers: vec![NONE; tets], ..Self::default() }
    }

    /// What the hole's tetrahedra leave to the removal of its vertex.
    pub fn hole_cost(&self, hole: &Hole, reference: &Reference<'_>) -> HoleCost {
        let fields = reference.quantized.fields.len();
        let mut inherited = vec![0.0_f64; fields];
        let mut depends = false;
        for s in &hole.star {
            let maker = self.makers[s.tet as usize];
            if maker != NONE {
                let errors = &self.errors[maker as usize * fields..][..fields];
                inherited.iter_mut().zip(errors).for_each(|(error, made)| *error = error.max(*made));
                depends = true;
            }
        }
        let mut errors = inherited.clone();
        if depends {
            let overshoot = |f: usize| reference.quantized.overshoot(hole.a, &hole.link, f);
            errors.iter_mut().enumerate().for_each(|(f, error)| *error += overshoot(f));
        }
        HoleCost { inherited, depends, errors }
    }
}

impl FillCost {
    /// The error of the removal with this filling; any value above `limit` may be returned early once it is exceeded,
    /// then as a lower bound.
    pub fn evaluate(&mut self, hole_cost: &HoleCost, buckets: &Buckets, limit: f64, input: Input<'_>) -> f64 {
        let Input { hole, filling, reference } = input;
        self.step = 0.0;
        self.faces.clear();
        self.moves.clear();
        let positions = &reference.quantized.positions;
        self.cells.clear();
        self.cells
            .extend(filling.tets.iter().map(|tet| Cell::new(tet.map(|v| as_vec(positions[v as usize])))));
        self.errors.clone_from(&hole_cost.errors);
        self.look_at_centre(hole.a, input);
        if largest(&self.errors) > limit {
            return largest(&self.errors);
        }
        self.flat = !hole.on_boundary() || hole.keeps_boundary(filling, positions);
        if !self.flat {
            self.step = reference.least_error_of(self.step_of_boundary(input));
            if hole_cost.depends {
                let Self { errors, step, .. } = self;
                let inherited = errors.iter_mut().zip(&hole_cost.inherited);
                inherited.for_each(|(error, own)| *error = error.max(*own + *step));
            }
            if largest(&self.errors) > limit {
                return largest(&self.errors);
            }
            let border = self.place_on_border(buckets, input);
            raise(&mut self.errors, border);
            if largest(&self.errors) > limit {
                return largest(&self.errors);
            }
            raise(&mut self.errors, chords(filling, reference));
        }
        let mut error = largest(&self.errors);
        let mut hint = 0;
        for s in &hole.star {
            for point in buckets.inside.iter(s.tet) {
                let (own, cell) = self.place(point, hint, input);
                hint = cell;
                error = error.max(own);
                if error > limit {
                    return error;
                }
            }
        }
        error.max(self.compare_foreign(buckets, input))
    }

    /// Compares the field at the removed vertex first: the error is mostly largest there. If the lattice has moved the
    /// vertex, it is in a bucket already.
    fn look_at_centre(&mut self, a: u32, input: Input<'_>) {
        if !input.reference.quantized.is_moved(a) {
            self.place(a, 0, input);
            return;
        }
        let (cell, lambda, depth) = self.locate(a, 0, input.reference);
        if depth >= -SLACK {
            self.deviate(a, cell, lambda, input);
        }
    }

    /// The error at points of other buckets that the filling contains.
    fn compare_foreign(&mut self, buckets: &Buckets, input: Input<'_>) -> f64 {
        let Input { hole, reference, .. } = input;
        self.foreign.clear();
        let mut error = 0.0_f64;
        let rim = hole.border.iter().flatten().chain([&hole.a]);
        let changed = (!self.flat).then(|| bounds(rim.map(|&v| reference.quantized.positions[v as usize])));
        for point in buckets.outside_points.candidates(hole.star.iter().map(|s| s.tet), changed) {
            error = error.max(self.compare_point(point, input));
        }
        error
    }

    fn compare_point(&mut self, point: u32, input: Input<'_>) -> f64 {
        let (cell, lambda, depth) = self.locate(point, 0, input.reference);
        if depth < -SLACK {
            return 0.0;
        }
        self.foreign.push((point, cell as u32));
        self.deviate(point, cell, lambda, input)
    }

    /// Moves the points to the buckets where [`FillCost::evaluate`] found them to belong. `slots` are the numbers of the
    /// new tetrahedra.
    pub fn move_points(&mut self, buckets: &mut Buckets, slots: &[u32], input: Input<'_>) {
        self.border_moves.clear();
        let has_border = input.hole.star.iter().any(|s| buckets.border.iter(s.tet).next().is_some());
        if has_border || input.hole.on_boundary() {
            self.place_on_border(buckets, input);
        }
        let tets = input.hole.star.iter().map(|s| s.tet).chain(slots.iter().copied());
        tets.for_each(|t| buckets.clear(t));
        for &(point, cell, outside) in &self.moves {
            buckets.inside.put(slots[cell as usize], point);
            buckets.outside_points.set_outside(point, outside);
        }
        let foreign = self.foreign.iter();
        foreign.for_each(|&(point, cell)| buckets.outside_points.add_foreign(slots[cell as usize], point));
        self.border_moves.iter().for_each(|&(point, cell)| buckets.border.put(slots[cell as usize], point));
    }

    /// How far the old boundary is from the new one.
    fn step_of_boundary(&mut self, input: Input<'_>) -> f64 {
        let Input { hole, filling, reference } = input;
        let at = |v: u32| reference.scaled(reference.quantized.positions[v as usize]);
        let centre = at(hole.a);
        let mut largest = self.nearest(centre, filling.moved, input).2;
        // Between the vertex and the link the new boundary may be further away than at either. Each edge is the first one
        // of one triangle.
        for &[x, _] in &hole.border {
            let middle = (centre + at(x)) * 0.5;
            largest = largest.max(self.nearest(middle, filling.moved, input).2);
        }
        largest
    }

    /// Finds where the reference vertices of the boundary go. Returns the largest error of their distances.
    fn place_on_border(&mut self, buckets: &Buckets, input: Input<'_>) -> f64 {
        let Input { hole, reference, .. } = input;
        self.border_moves.clear();
        let mut largest = 0.0_f64;
        let own = hole.on_boundary().then_some(hole.a);
        for point in hole.star.iter().flat_map(|s| buckets.border.iter(s.tet)).chain(own) {
            let p = reference.scaled(reference.quantized.positions[point as usize]);
            let (cell, _, distance) = self.nearest(p, usize::MAX, input);
            self.border_moves.push((point, cell));
            largest = largest.max(reference.error_at(point, distance));
        }
        largest
    }

    /// The nearest of the first `count` boundary triangles of the filling: its cell, the nearest point, and the distance.
    fn nearest(&mut self, p: DVec3, count: usize, input: Input<'_>) -> (u32, DVec3, f64) {
        let Input { filling, reference, .. } = input;
        if self.faces.is_empty() {
            let at = |v: u32| reference.scaled(reference.quantized.positions[v as usize]);
            self.faces.extend(filling.border.iter().map(|&(_, triangle)| Face::new(triangle.map(at))));
        }
        let (face, q, distance) = nearest_face(p, &self.faces[..count.min(self.faces.len())]);
        (filling.border.get(face).map_or(0, |&(cell, _)| cell), q, distance)
    }

    /// Finds the cell for a point, looking at `hint` first. Returns the error there and the cell.
    fn place(&mut self, point: u32, hint: usize, input: Input<'_>) -> (f64, usize) {
        let Input { filling, reference, .. } = input;
        let (mut cell, mut lambda, depth) = self.locate(point, hint, reference);
        let mut displaced = 0.0;
        // The point stays outside of the mesh where no boundary is near, too: it was not in the star from the start.
        let outside = depth < -SLACK;
        if outside && !filling.border.is_empty() {
            let (p, moved) = reference.place(point);
            let (found, q, distance) = self.nearest(p, usize::MAX, input);
            cell = found as usize;
            let Cell { barycentric, origin } = self.cells[cell];
            lambda = barycentric * (q / DVec3::from_array(reference.quantized.lattice.step) - origin);
            displaced = distance - moved;
        }
        self.moves.push((point, cell as u32, outside));
        let displaced = reference.error_at(point, displaced);
        raise(&mut self.errors, displaced);
        (self.deviate(point, cell, lambda, input).max(displaced), cell)
    }

    /// The cell that contains a point, or is nearest to it: see [`locate`].
    fn locate(&self, point: u32, hint: usize, reference: &Reference<'_>) -> (usize, DVec3, f64) {
        let position = reference.quantized.places[point as usize];
        locate(self.cells.len(), hint, |i| {
            let Cell { barycentric, origin } = self.cells[i];
            barycentric * (position - origin)
        })
    }

    fn deviate(&mut self, point: u32, cell: usize, lambda: DVec3, input: Input<'_>) -> f64 {
        let Input { filling, reference, .. } = input;
        let corners = |f: usize| filling.tets[cell].map(|v| reference.quantized.level(v, f));
        reference.quantized.deviation(point, clamped(lambda), corners, &mut self.errors)
    }
}

/// How far the middles of the new boundary triangles and of their edges are from the reference boundary, as an error.
/// Their corners are on it.
fn chords(filling: &Filling, reference: &Reference<'_>) -> f64 {
    let mut largest = 0.0_f64;
    for &(_, triangle) in &filling.border[..filling.moved] {
        let [a, b, c] = triangle.map(|v| reference.scaled(reference.quantized.positions[v as usize]));
        for p in [(a + b + c) / 3.0, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5] {
            let mut least = f64::INFINITY;
            for v in triangle {
                if let Some(&from) = reference.boundary.at(v).first().filter(|_| least > largest) {
                    let (foot, distance) =
                        reference.boundary.walk(p, from, largest * reference.allowance_from(from));
                    least = least.min(reference.error_from(foot, distance));
                }
            }
            largest = largest.max(least);
        }
    }
    largest
}

impl Cell {
    fn new(corners: [DVec3; 4]) -> Self {
        Self { barycentric: barycentric(corners), origin: corners[0] }
    }
}

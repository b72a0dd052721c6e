//! The exact error of a collapse: what the field and the boundary lose, at every reference vertex concerned.
//!
//! Each reference vertex that is not a vertex of the mesh is in the bucket of one tetrahedron: the one that contains it
//! or, where the boundary has moved, the one with the nearest boundary triangle. A collapse takes it from a tetrahedron
//! that it removes to one that it creates. So for every consistent set S, some tetrahedron of Σ_S had the vertex in its
//! bucket, and the error recorded then bounds what Σ_S has there. A created tetrahedron is also compared with those
//! that it contains but that are in other buckets ([`crate::error::outside_points`]). The buckets are in [`crate::error::buckets`].
//!
//! The boundary is kept track of in both directions. A created vertex is compared with the reference boundary itself:
//! its distance from the mesh before says nothing, as step after step along chords would fill any hollow. And each
//! reference vertex of the boundary has a second bucket, of the boundary triangle that is nearest to it.

use crate::change::collapse_check::CheckedCollapse;
use crate::change::work_mesh::WorkMesh;
use crate::error::buckets::Buckets;
use crate::error::placement::{Placement, Replacement};
use crate::error::points::{SLACK, as_vec, bounds};
use crate::error::reference::Reference;
use glam::DVec3;
use tetralod::geom::orient3d;
use tetralod::mesh::{FACES, NONE};

/// The vertices of the input, and those that collapses create.
pub(crate) struct VertexData {
    pub positions: Vec<[i32; 3]>,
    pub levels: Vec<i32>,
    /// `errors[vertex * fields + f]`: those of the update whose collapse made the vertex; 0 for reference vertices.
    pub errors: Vec<f64>,
    /// Length of the longest chain of collapses that led to the vertex.
    pub height: Vec<u32>,
    /// The triangle of the reference boundary that a boundary vertex is near to; [`NONE`] inside.
    pub foot: Vec<u32>,
}

/// A collapse to evaluate, and what it is compared with.
#[derive(Clone, Copy)]
pub(crate) struct Input<'a> {
    pub collapse: &'a CheckedCollapse,
    pub mesh: &'a WorkMesh,
    pub data: &'a VertexData,
    pub reference: &'a Reference<'a>,
}

/// Evaluates collapses; holds scratch space.
#[derive(Default)]
pub(crate) struct Evaluator {
    pub star: NewStar,
    pub placement: Placement,
    at_centre: usize,
    flat: bool,
    old_border: Vec<[u32; 3]>,
    /// The largest error of each field among the updates that this one will be a parent of.
    inherited: Vec<f64>,
    /// The triangle of the reference boundary near the new vertex.
    pub foot: u32,
    pub height: u32,
    /// How far the boundary at each end is outside of the new one, as an error; 0 if no updates depend on this one.
    pub steps: [f64; 2],
}

/// The star of the new vertex.
#[derive(Default)]
pub(crate) struct NewStar {
    /// For each tetrahedron its other corners.
    others: Vec<[u32; 3]>,
    /// Boundary triangles: the tetrahedron and the corners, [`NONE`] for the new vertex. Those at the new vertex first.
    border: Vec<(u32, [u32; 3])>,
    /// The levels of the new vertex.
    pub levels: Vec<i32>,
}

impl Replacement for (Input<'_>, &NewStar) {
    fn reference(&self) -> &Reference<'_> {
        self.0.reference
    }

    fn border(&self) -> &[(u32, [u32; 3])] {
        &self.1.border
    }

    fn corner(&self, v: u32) -> DVec3 {
        let Input { collapse, data, reference, .. } = self.0;
        reference.scaled(if v == NONE { collapse.position } else { data.positions[v as usize] })
    }

    fn corners(&self, cell: usize) -> [DVec3; 4] {
        let Input { collapse, data, .. } = self.0;
        let [x, y, z] = self.1.others[cell].map(|v| as_vec(data.positions[v as usize]));
        [as_vec(collapse.position), x, y, z]
    }

    fn levels(&self, cell: usize, field: usize) -> [i32; 4] {
        let NewStar { others, levels, .. } = self.1;
        let [x, y, z] = others[cell].map(|v| self.0.data.levels[v as usize * levels.len() + field]);
        [levels[field], x, y, z]
    }

    fn relative(&self, q: DVec3, _: DVec3) -> DVec3 {
        let Input { collapse, reference, .. } = self.0;
        (q - reference.scaled(collapse.position)) / DVec3::from_array(reference.quantized.lattice.step)
    }
}

/// The largest error of all fields.
pub(crate) fn largest(errors: &[f64]) -> f64 {
    errors.iter().copied().fold(0.0, f64::max)
}

/// Errors below this are far below the smallest that is stored.
const NO_DISTANCE: f64 = 1e-8;

impl Evaluator {
    /// The largest error of all fields; once it exceeds `limit`, any lower bound above `limit` may be returned.
    pub fn evaluate(&mut self, buckets: &Buckets<'_>, limit: f64, input: Input<'_>) -> f64 {
        let Input { collapse, reference, .. } = input;
        self.steps = [0.0; 2];
        self.halve_levels(input);
        let newest = self.inherit(input);
        self.lay_out_star(input);
        self.flat = self.is_flat(input);
        if newest {
            self.add_overshoot(input);
        }
        let foot = self.find_foot(input);
        self.placement.raise(foot);
        if newest && largest(&self.placement.errors) <= limit {
            let steps = self.steps_of_boundary(input);
            self.steps = steps.map(|distance| reference.least_error_of(distance));
            let step = self.steps[0].max(self.steps[1]);
            let errors = self.placement.errors.iter_mut().zip(&self.inherited);
            errors.for_each(|(error, own)| *error = error.max(*own + step));
        }
        if collapse.on_boundary && !self.flat && largest(&self.placement.errors) <= limit {
            // Where it is flat, no point of the boundary gets further away than it is.
            let border = self.place_on_border(buckets, input);
            self.placement.raise(border);
            if largest(&self.placement.errors) <= limit {
                let chords = self.chords(input);
                self.placement.raise(chords);
            }
        }
        let Self { placement, star, old_border, .. } = self;
        let new = (input, &*star);
        let mut error = largest(&placement.errors);
        if error > limit {
            return error;
        }
        let stars = collapse.stay.iter().enumerate().map(|(i, (s, _))| (s.tet, i));
        let fans = collapse.fan.iter().map(|&(tet, ..)| (tet, 0));
        for (tet, cell) in stars.chain(fans) {
            for point in buckets.inside.iter(tet) {
                error = error.max(placement.place(point, cell, &new).0);
                if error > limit {
                    return error;
                }
            }
        }
        // Those that the lattice has moved are in a bucket already.
        let is_new = |end: &u32| *end < reference.points && !reference.quantized.is_moved(*end);
        for end in [collapse.a, collapse.b].into_iter().filter(is_new) {
            error = error.max(placement.place(end, 0, &new).0);
        }
        let rim = old_border.iter().flatten().map(|&v| input.data.positions[v as usize]);
        let changed = (collapse.on_boundary && !self.flat).then(|| bounds(rim.chain([collapse.position])));
        let candidates = buckets.outside_points.candidates(removed(collapse), changed);
        error.max(placement.place_foreign(candidates.map(|id| (id, id as u32)), &new))
    }

    /// Moves the points to the buckets where [`Evaluator::evaluate`] found them to belong.
    pub fn move_points(&mut self, buckets: &mut Buckets<'_>, input: Input<'_>) {
        let collapse = input.collapse;
        if collapse.on_boundary && self.flat {
            self.place_on_border(buckets, input);
        }
        for tet in removed(collapse) {
            buckets.inside.take(tet);
            buckets.outside_points.clear(tet);
            if collapse.on_boundary {
                buckets.border.take(tet);
            }
        }
        self.placement.move_points(buckets, input.reference, |cell| collapse.stay[cell as usize].0.tet);
    }

    fn halve_levels(&mut self, input: Input<'_>) {
        let Input { collapse, data, reference, .. } = input;
        let fields = reference.quantized.fields.len();
        let [a, b] = [collapse.a, collapse.b].map(|v| &data.levels[v as usize * fields..][..fields]);
        self.star.levels.clear();
        self.star.levels.extend(a.iter().zip(b).map(|(a, b)| b + ((a - b) >> 1)));
    }

    /// Starts with the errors of the updates that this one will be a parent of; returns whether there are any. A
    /// tetrahedron was made by the collapse that made its newest vertex.
    fn inherit(&mut self, input: Input<'_>) -> bool {
        let Input { collapse, mesh, data, .. } = input;
        let (fields, mut height) = (self.star.levels.len(), 0);
        self.inherited.clear();
        self.inherited.resize(fields, 0.0);
        for tet in removed(collapse) {
            let newest = mesh.tets[tet as usize].into_iter().fold(0, u32::max) as usize;
            let errors = &data.errors[newest * fields..][..fields];
            self.inherited.iter_mut().zip(errors).for_each(|(error, made)| *error = error.max(*made));
            height = height.max(data.height[newest]);
        }
        self.height = height + 1;
        self.placement.errors.clone_from(&self.inherited);
        height > 0
    }

    /// Adds how much the ends exceed the range of values around the new vertex, as a fraction of the field's range: this
    /// makes the selection by isovalue monotone.
    fn add_overshoot(&mut self, input: Input<'_>) {
        let Input { collapse, data, reference, .. } = input;
        let fields = &reference.quantized.fields;
        let level = |v: u32, f: usize| data.levels[v as usize * fields.len() + f];
        for (f, field) in fields.iter().enumerate() {
            let own = self.star.levels[f];
            let (low, high) =
                collapse.link.iter().map(|&v| level(v, f)).fold((own, own), |(l, h), x| (l.min(x), h.max(x)));
            let (a, b) = (level(collapse.a, f), level(collapse.b, f));
            let beyond = (a.max(b) - high).max(low - a.min(b)).max(0);
            self.placement.errors[f] += f64::from(beyond) * field.step / field.range() * (1.0 + 1e-9);
        }
    }

    /// How far the mesh at each end is outside of the new boundary. The tetrahedra that the split creates may be nearer
    /// to a region by so much than those that it removes.
    fn steps_of_boundary(&mut self, input: Input<'_>) -> [f64; 2] {
        let Input { collapse, data, .. } = input;
        let mut steps = [0.0_f64; 2];
        if !collapse.on_boundary || self.flat {
            return steps;
        }
        let at = |v: u32| as_vec(data.positions[v as usize]);
        for (step, end) in steps.iter_mut().zip([collapse.a, collapse.b]) {
            *step = self.outside(at(end), input);
        }
        // Between the ends and the link the new boundary may be further away than at either.
        // The two triangles of an edge have it in opposite directions; one is enough.
        for i in 0..self.old_border.len() {
            let [x, y, z] = self.old_border[i];
            for [x, y] in [[x, y], [y, z], [z, x]] {
                let at_end = [collapse.a, collapse.b].map(|end| end == x || end == y);
                if x < y && at_end.contains(&true) {
                    let distance = self.outside((at(x) + at(y)) * 0.5, input);
                    for (step, _) in steps.iter_mut().zip(at_end).filter(|(_, at_end)| *at_end) {
                        *step = step.max(distance);
                    }
                }
            }
        }
        steps
    }

    /// How far a place, in steps of the lattice, is from the new boundary; 0 if a tetrahedron of the new star holds it.
    fn outside(&mut self, place: DVec3, input: Input<'_>) -> f64 {
        if self.placement.locate(place, 0, &(input, &self.star)).2 >= -SLACK {
            return 0.0;
        }
        let step = DVec3::from_array(input.reference.quantized.lattice.step);
        self.placement.nearest(place * step, self.at_centre, &(input, &self.star)).2
    }

    /// Finds the part of the reference boundary that the new vertex is near to. Returns the distance as an error.
    fn find_foot(&mut self, input: Input<'_>) -> f64 {
        let Input { collapse, data, reference, .. } = input;
        self.foot = NONE;
        if !collapse.on_boundary {
            return 0.0;
        }
        let centre = reference.scaled(collapse.position);
        let enough = NO_DISTANCE * reference.displacement_per_error;
        let (foot, distance) = reference.boundary.walk(centre, data.foot[collapse.a as usize], enough);
        self.foot = foot;
        if distance <= enough {
            return 0.0;
        }
        let (other, less) = reference.boundary.walk(centre, data.foot[collapse.b as usize], enough);
        if less < distance {
            self.foot = other;
        }
        reference.error_from(self.foot, less.min(distance))
    }

    /// How far the middles of the new boundary triangles and of their edges are from the reference boundary, as an error.
    fn chords(&self, input: Input<'_>) -> f64 {
        let Input { data, reference, .. } = input;
        let foot = |v: u32| if v == NONE { self.foot } else { data.foot[v as usize] };
        let new = (input, &self.star);
        self.star.border[..self.at_centre].iter().fold(0.0, |largest, &(_, triangle)| {
            reference.chord(triangle.map(|v| new.corner(v)), triangle.map(foot), largest)
        })
    }

    /// Finds where the reference vertices of the boundary go. Returns the largest error of their distances.
    fn place_on_border(&mut self, buckets: &Buckets<'_>, input: Input<'_>) -> f64 {
        let Input { collapse, reference, .. } = input;
        let ends = [collapse.a, collapse.b].into_iter().filter(|&end| end < reference.points);
        let points = removed(collapse).flat_map(|tet| buckets.border.iter(tet)).chain(ends);
        self.placement.place_on_border(points, &(input, &self.star))
    }

    /// The star of the new vertex, and the boundary triangles at the ends before.
    fn lay_out_star(&mut self, input: Input<'_>) {
        let Input { collapse, mesh, .. } = input;
        let Self { star: NewStar { others, border, .. }, placement, .. } = self;
        others.clear();
        others.extend(collapse.stay.iter().map(|(s, _)| {
            let corners = mesh.tets[s.tet as usize];
            [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]][s.corner as usize].map(|i: usize| corners[i])
        }));
        placement.start(others.len());
        border.clear();
        self.old_border.clear();
        self.at_centre = 0;
        if collapse.on_boundary {
            self.collect_border_at_centre(input);
            self.at_centre = self.star.border.len();
        }
        for (i, &(s, _)) in collapse.stay.iter().enumerate() {
            if mesh.neighbors[s.tet as usize][s.corner as usize] == NONE {
                self.star.border.push((i as u32, self.star.others[i]));
            }
        }
    }

    fn collect_border_at_centre(&mut self, input: Input<'_>) {
        let Input { collapse, mesh, .. } = input;
        for &(tet, ..) in &collapse.fan {
            let (corners, around) = (mesh.tets[tet as usize], mesh.neighbors[tet as usize]);
            let faces = (0..4).filter(|&k| around[k] == NONE);
            self.old_border.extend(faces.map(|k| FACES[k].map(|l| corners[l])));
        }
        for (i, &(s, _)) in collapse.stay.iter().enumerate() {
            let (corners, around) = (mesh.tets[s.tet as usize], mesh.neighbors[s.tet as usize]);
            let centre = s.corner as usize;
            for k in (0..4).filter(|&k| k != centre && around[k] == NONE) {
                self.old_border.push(FACES[k].map(|l| corners[l]));
                self.star
                    .border
                    .push((i as u32, FACES[k].map(|l| if l == centre { NONE } else { corners[l] })));
            }
        }
    }

    /// Whether the boundary stays where it is: around both ends it is flat, and in the same plane.
    fn is_flat(&self, input: Input<'_>) -> bool {
        let Input { collapse, data, .. } = input;
        let at = |v: u32| data.positions[v as usize];
        let Some(plane) = self.old_border.first().map(|t| t.map(at)) else { return false };
        let in_plane = |p: [i32; 3]| orient3d(plane[0], plane[1], plane[2], p) == 0;
        in_plane(collapse.position) && self.old_border.iter().flatten().all(|&v| in_plane(at(v)))
    }
}

/// The tetrahedra that a collapse removes.
fn removed(collapse: &CheckedCollapse) -> impl Iterator<Item = u32> {
    collapse.stay.iter().map(|(s, _)| s.tet).chain(collapse.fan.iter().map(|&(tet, ..)| tet))
}

//! The exact error of a removal: what the field and the boundary lose when a hole is filled, at every reference vertex
//! concerned.
//!
//! Buckets are those of [`crate::error::reference`]. A removal takes points from tetrahedra that it removes to tetrahedra that it
//! makes; all other tetrahedra keep theirs, and their errors.

use crate::change::hole::{Filling, Hole};
use crate::change::sides::{FaceSet, rank};
use crate::error::centre::Seat;
use crate::error::cost::largest;
use crate::error::placement::{Placement, Replacement};
use crate::error::points::{SLACK, bounds};
use crate::error::reference::{Buckets, Reference};
use glam::DVec3;
use tetralod::mesh::NONE;
use tetralod::mt::ErrorCode;

/// The removals so far.
#[derive(Default)]
pub(crate) struct Removals {
    /// The removal that made each tetrahedron; [`NONE`] for those of the reference mesh.
    pub makers: Vec<u32>,
    /// The errors of each removal, field by field.
    pub errors: Vec<ErrorCode>,
}

/// What a removal costs whatever fills its hole.
#[derive(Clone, Debug, Default)]
pub(crate) struct HoleCost {
    /// The largest error of each field among the removals that this one depends on.
    pub inherited: Vec<f64>,
    /// Whether there are any.
    pub depends: bool,
    /// The least error of this removal in each field.
    pub errors: Vec<f64>,
    /// The points in the buckets of its tetrahedra and their numbers in the star, once they are [`gathered`](HoleCost::gather). What put
    /// a filling beyond its limit comes first: it is likely to do the same to the next one.
    points: Vec<(u32, u8)>,
    is_gathered: bool,
    /// Scratch space: the removals that it depends on.
    makers: Vec<u32>,
}

/// A hole, a filling of it, and what it is compared with.
#[derive(Clone, Copy)]
pub(crate) struct Input<'a> {
    pub hole: &'a Hole,
    pub filling: &'a Filling,
    pub reference: &'a Reference<'a>,
    /// Where fields jump, the region of each cell of the filling.
    pub regions: &'a [u32],
}

impl Replacement for Input<'_> {
    fn reference(&self) -> &Reference<'_> {
        self.reference
    }

    fn border(&self) -> &[(u32, [u32; 3])] {
        &self.filling.border
    }

    fn corner(&self, v: u32) -> DVec3 {
        self.reference.position(v)
    }

    fn corners(&self, cell: usize) -> [DVec3; 4] {
        self.filling.tets[cell].map(|v| self.reference.quantized.rounded(v))
    }

    fn levels(&self, cell: usize, field: usize) -> [i32; 4] {
        self.reference.quantized.levels_of(self.filling.tets[cell], self.region(cell), field)
    }

    fn region(&self, cell: usize) -> Option<u32> {
        self.regions.get(cell).copied()
    }

    fn relative(&self, q: DVec3, origin: DVec3) -> DVec3 {
        q / DVec3::from_array(self.reference.quantized.lattice.step) - origin
    }
}

/// The cost of one filling, and where the points go; reused from filling to filling.
#[derive(Default)]
pub(crate) struct FillCost {
    pub placement: Placement,
    /// Scratch space: for each tetrahedron of the star where to look first for its points.
    hints: Vec<usize>,
    flat: bool,
    /// How far the boundary moves, as an error.
    pub step: f64,
}

impl Removals {
    pub fn new(tets: usize) -> Self {
        Self { makers: vec![NONE; tets], ..Self::default() }
    }

    /// What the hole's tetrahedra, which are in these regions if fields jump, leave to the removal of its vertex.
    pub fn find_hole_cost(
        &self,
        (hole, regions): (&Hole, &[u32]),
        reference: &Reference<'_>,
        cost: &mut HoleCost,
    ) {
        let fields = reference.quantized.fields.len();
        let HoleCost { inherited, depends, errors, makers, is_gathered, .. } = cost;
        *is_gathered = false;
        inherited.clear();
        // All are read before any is looked at: the memory delivers several at a time.
        makers.clear();
        makers.extend(hole.star.iter().map(|s| self.makers[s.tet as usize]));
        makers.retain(|&maker| maker != NONE);
        *depends = !makers.is_empty();
        for f in 0..fields {
            let of = |&maker: &u32| self.errors[maker as usize * fields + f];
            inherited.push(makers.iter().map(of).max().unwrap_or(ErrorCode::ZERO).error());
        }
        errors.clone_from(inherited);
        if *depends {
            let overshoot = |f: usize| hole.overshoot(reference.quantized, regions, f);
            errors.iter_mut().enumerate().for_each(|(f, error)| *error += overshoot(f));
        }
    }
}

impl HoleCost {
    /// Reads the lists of points once for all fillings of a hole.
    fn gather(&mut self, hole: &Hole, buckets: &Buckets) {
        if !std::mem::replace(&mut self.is_gathered, true) {
            buckets.inside.gather(hole.star.iter().map(|s| s.tet), &mut self.points);
        }
    }
}

impl FillCost {
    /// Whether the boundary stays where it is.
    pub fn is_flat(&self) -> bool {
        self.flat
    }

    /// The largest error of all fields; once it exceeds `limit`, any lower bound above `limit` may be returned. `cells`: the faces of the
    /// hole that the tetrahedra of a filling by contraction have, in their order; none for other fillings. `seat`: where the removed
    /// vertex is in it, if that is known.
    pub fn evaluate(
        &mut self,
        hole_cost: &mut HoleCost,
        buckets: &Buckets,
        limit: f64,
        input: Input<'_>,
        (cells, seat): (FaceSet, Option<Seat>),
    ) -> f64 {
        let Input { hole, filling, reference, .. } = input;
        let seat = seat.map(|Seat { face, lambda }| (rank(cells, face), lambda));
        let positions = &reference.quantized.positions;
        self.step = 0.0;
        self.placement.start(filling.tets.len());
        self.placement.errors.clone_from(&hole_cost.errors);
        self.compare_centre(input, seat);
        if largest(&self.placement.errors) > limit {
            return largest(&self.placement.errors);
        }
        self.flat = !hole.on_boundary() || hole.keeps_boundary(filling, positions);
        if !self.flat {
            self.step = reference.least_error_of(self.step_of_boundary(input));
            let Self { placement, step, .. } = self;
            if hole_cost.depends {
                let inherited = placement.errors.iter_mut().zip(&hole_cost.inherited);
                inherited.for_each(|(error, own)| *error = error.max(*own + *step));
            }
            if largest(&placement.errors) > limit {
                return largest(&placement.errors);
            }
            let border = placement.place_on_border(border_points(buckets, hole), &input);
            placement.raise(border);
            if largest(&placement.errors) > limit {
                return largest(&placement.errors);
            }
            placement.raise(chords(filling, reference));
        }
        let Self { placement, hints, .. } = self;
        let mut error = largest(&placement.errors);
        hints.clear();
        hints.extend((0..hole.star.len()).map(|tet| first_hint(hole, cells, tet)));
        hole_cost.gather(hole, buckets);
        for i in 0..hole_cost.points.len() {
            let (point, tet) = hole_cost.points[i];
            let hint = &mut hints[usize::from(tet)];
            let own;
            (own, *hint) = placement.place(point, *hint, &input);
            error = error.max(own);
            if error > limit {
                hole_cost.points.swap(0, i);
                return error;
            }
        }
        let rim = hole.border.iter().flatten().chain([&hole.a]);
        let changed = (!self.flat).then(|| bounds(rim.map(|&v| positions[v as usize])));
        let candidates = buckets.outside_points.candidates(hole.star.iter().map(|s| s.tet), changed);
        error.max(placement.place_foreign(candidates, &input))
    }

    /// Compares the field at the removed vertex first: the error is mostly largest there. If the lattice has moved the vertex, it is in a
    /// bucket.
    fn compare_centre(&mut self, input: Input<'_>, seat: Option<(usize, DVec3)>) {
        let (a, quantized) = (input.hole.a, input.reference.quantized);
        if quantized.sides.has_several(a) {
            let further = quantized.sides.further(a).map(|(point, _)| point);
            std::iter::once(a).chain(further).for_each(|point| _ = self.placement.place(point, 0, &input));
            return;
        }
        if let Some((cell, lambda)) = seat {
            if !quantized.is_moved(a) {
                self.placement.moved_to(a, cell);
            }
            self.placement.compare(a, cell, lambda, &input);
            return;
        }
        if !quantized.is_moved(a) {
            self.placement.place(a, 0, &input);
            return;
        }
        let (cell, lambda, depth) = self.placement.locate(quantized.places.at(a), 0, &input);
        if depth >= -SLACK {
            self.placement.compare(a, cell, lambda, &input);
        }
    }

    /// Moves the points to the buckets where [`FillCost::evaluate`] found them to belong. `slots` are the numbers of the
    /// new tetrahedra.
    pub fn move_points(&mut self, buckets: &mut Buckets, slots: &[u32], input: Input<'_>) {
        self.placement.place_on_border(border_points(buckets, input.hole), &input);
        let tets = input.hole.star.iter().map(|s| s.tet).chain(slots.iter().copied());
        tets.for_each(|t| buckets.clear(t));
        self.placement.move_points(buckets, |cell| slots[cell as usize]);
    }

    /// How far the old boundary is from the new one.
    fn step_of_boundary(&mut self, input: Input<'_>) -> f64 {
        let Input { hole, filling, reference, .. } = input;
        let centre = reference.position(hole.a);
        let mut largest = self.placement.nearest(centre, filling.moved, &input).2;
        // Between the vertex and the link the new boundary may be further away than at either. Each edge is the first one
        // of one triangle.
        for &[x, _] in &hole.border {
            let middle = (centre + reference.position(x)) * 0.5;
            largest = largest.max(self.placement.nearest(middle, filling.moved, &input).2);
        }
        largest
    }
}

/// What was between a face and the vertex is mostly between it and the neighbour that the vertex is moved to; what was at the edge between
/// both, beside it.
fn first_hint(hole: &Hole, cells: FaceSet, tet: usize) -> usize {
    let own = 1 << tet;
    let likely = if cells & own != 0 { own } else { hole.faces_beside(tet) & cells };
    if likely == 0 { 0 } else { rank(cells, likely.trailing_zeros() as usize) }
}

/// The reference vertices of the boundary at a hole.
fn border_points(buckets: &Buckets, hole: &Hole) -> impl Iterator<Item = u32> {
    let own = hole.on_boundary().then_some(hole.a);
    hole.star.iter().flat_map(|s| buckets.border.iter(s.tet)).chain(own)
}

/// How far the middles of the new boundary triangles and of their edges are from the reference boundary, as an error.
/// Their corners are on it.
fn chords(filling: &Filling, reference: &Reference<'_>) -> f64 {
    filling.border[..filling.moved].iter().fold(0.0, |largest, &(_, triangle)| {
        let from = triangle.map(|v| reference.boundary.at(v).first().copied().unwrap_or(NONE));
        reference.chord(triangle.map(|v| reference.position(v)), from, largest)
    })
}

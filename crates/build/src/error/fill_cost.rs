//! The exact error of a removal: what the field and the boundary lose when a hole is filled, at every reference vertex
//! concerned.
//!
//! Buckets are those of [`crate::error::buckets`]. A removal takes points from tetrahedra that it removes to tetrahedra that it
//! makes; all other tetrahedra keep theirs, and their errors.

use crate::change::hole::{Filling, Hole};
use crate::change::sides::{FaceSet, rank};
use crate::error::buckets::Buckets;
use crate::error::centre::Seat;
use crate::error::cost::largest;
use crate::error::hole_points::{HolePoints, Place};
use crate::error::outside_points::Known;
use crate::error::placement::{Found, Placement, Replacement};
use crate::error::points::{SLACK, bounds};
use crate::error::reference::Reference;
use crate::error::stored_points::{Extent, SortedPoints, StoredPoint, StoredPoints};
use glam::DVec3;
use std::borrow::Borrow;
use std::ops::ControlFlow;
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
    /// The same where points are stored.
    pub stored: HolePoints,
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
    /// The faces of the hole that the tetrahedra of the filling have.
    cells: FaceSet,
    /// Where points are stored, their order.
    exchanged: Vec<Place>,
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
    fn gather(&mut self, hole: &Hole, buckets: &Buckets<'_>) {
        if std::mem::replace(&mut self.is_gathered, true) {
            return;
        }
        match &buckets.stored {
            Some(stored) => self.stored.start(hole.star.iter().map(|s| s.tet), stored),
            None => buckets.inside.gather(hole.star.iter().map(|s| s.tet), &mut self.points),
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
        buckets: &Buckets<'_>,
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
        self.cells = cells;
        hole_cost.gather(hole, buckets);
        let inside = match &buckets.stored {
            Some(stored) => self.evaluate_stored(&mut hole_cost.stored, stored, limit, input),
            None => self.evaluate_listed(&mut hole_cost.points, limit, input),
        };
        let error = match inside {
            ControlFlow::Continue(error) => error,
            ControlFlow::Break(error) => return error,
        };
        let placement = &mut self.placement;
        let rim = hole.border.iter().flatten().chain([&hole.a]);
        let changed = (!self.flat).then(|| bounds(rim.map(|&v| positions[v as usize])));
        let candidates = buckets.outside_points.candidates(hole.star.iter().map(|s| s.tet), changed);
        error.max(match &buckets.stored {
            Some(stored) => {
                let record = |id| StoredPoint::new(buckets.outside_points.record(id), stored.layout);
                placement.place_foreign(candidates.map(|id| (id, record(id))), &input)
            }
            None => placement.place_foreign(candidates.map(|id| (id, id as u32)), &input),
        })
    }

    /// Starts to look for the points of each tetrahedron of the star.
    fn start_hints(&mut self, hole: &Hole) {
        self.hints.clear();
        self.hints.extend((0..hole.star.len()).map(|tet| first_hint(hole, self.cells, tet)));
    }

    /// The largest error with those at these points, unless it exceeds the limit.
    fn evaluate_listed(
        &mut self,
        points: &mut [(u32, u8)],
        limit: f64,
        input: Input<'_>,
    ) -> ControlFlow<f64, f64> {
        self.start_hints(input.hole);
        let mut error = largest(&self.placement.errors);
        for i in 0..points.len() {
            let (point, tet) = points[i];
            let hint = &mut self.hints[usize::from(tet)];
            let own;
            (own, *hint) = self.placement.place(point, *hint, &input);
            error = error.max(own);
            if error > limit {
                points.swap(0, i);
                return ControlFlow::Break(error);
            }
        }
        ControlFlow::Continue(error)
    }

    /// [`FillCost::evaluate_listed`] where points are stored: it does not note where they go.
    fn evaluate_stored(
        &mut self,
        points: &mut HolePoints,
        stored: &StoredPoints<'_>,
        limit: f64,
        input: Input<'_>,
    ) -> ControlFlow<f64, f64> {
        self.exchanged.clone_from(&points.exchanged);
        let mut error = largest(&self.placement.errors);
        let tets = input.hole.star.iter().map(|s| s.tet);
        let found = self.find_stored(points, &mut &*stored, input, |_, _, found| {
            error = error.max(found.error);
            if error > limit { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        match found {
            ControlFlow::Break(found) => {
                points.exchange(found, tets, stored);
                ControlFlow::Break(error)
            }
            ControlFlow::Continue(()) => ControlFlow::Continue(error),
        }
    }

    /// Finds where the stored points of a hole belong, in their order, until `visit` breaks off.
    fn find_stored<'s, S: Borrow<StoredPoints<'s>>>(
        &mut self,
        points: &mut HolePoints,
        stored: &mut S,
        input: Input<'_>,
        mut visit: impl FnMut(&mut S, &[u8], Found) -> ControlFlow<()>,
    ) -> ControlFlow<Place> {
        self.start_hints(input.hole);
        let Self { placement, hints, exchanged, .. } = self;
        let tets = input.hole.star.iter().map(|s| s.tet);
        let layout = (*stored).borrow().layout;
        points.visit(tets, stored, exchanged, |stored, tet, record| {
            let hint = &mut hints[usize::from(tet)];
            let found = placement.find(StoredPoint::new(record, layout), *hint, &input);
            *hint = found.cell;
            visit(stored, record, found)
        })
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
    pub fn move_points(
        &mut self,
        points: &mut HolePoints,
        buckets: &mut Buckets<'_>,
        slots: &[u32],
        input: Input<'_>,
    ) {
        self.placement.place_on_border(border_points(buckets, input.hole), &input);
        let stored = self.sort_stored(points, buckets, slots.len(), input);
        let tets = input.hole.star.iter().map(|s| s.tet).chain(slots.iter().copied());
        tets.for_each(|t| buckets.clear(t));
        if let Some(of_buckets) = &mut buckets.stored {
            slots.iter().zip(stored).for_each(|(&t, extents)| of_buckets.put(t, extents));
        }
        self.placement.move_points(buckets, input.reference, |cell| slots[cell as usize]);
    }

    /// Stores the points of a hole anew, those of each cell together, and says where they are; nothing where points are not stored.
    fn sort_stored(
        &mut self,
        points: &mut HolePoints,
        buckets: &mut Buckets<'_>,
        cells: usize,
        input: Input<'_>,
    ) -> Vec<Vec<Extent>> {
        let Some(stored) = buckets.stored.take() else { return Vec::new() };
        let layout = stored.layout;
        let mut sorted = SortedPoints::new(stored, cells);
        let mut put = |sorted: &mut SortedPoints<'_>, record: &[u8], cell: usize, outside: bool| {
            sorted.put(record, cell, outside);
            let point = StoredPoint::new(record, layout);
            let known = || Known::at(point.own_place()).with(record);
            buckets.outside_points.set_outside(point.id(), outside, known);
        };
        let mut own = Vec::new();
        for (point, cell, outside) in self.placement.moves() {
            own.clear();
            sorted.stored.record(point, input.reference, outside, &mut own);
            put(&mut sorted, &own, cell, outside);
        }
        _ = self.find_stored(points, &mut sorted, input, |sorted, record, found| {
            put(sorted, record, found.cell, found.outside);
            ControlFlow::Continue(())
        });
        let (stored, extents) = sorted.finish();
        buckets.stored = Some(stored);
        extents
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
fn border_points(buckets: &Buckets<'_>, hole: &Hole) -> impl Iterator<Item = u32> {
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

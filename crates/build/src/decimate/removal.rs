//! The removal of a vertex: the best filling of its hole, and its error.
//!
//! A search reads [`State`] and writes only to its own [`RemovalSearch`], so candidates are evaluated in parallel.

use crate::change::gift_wrap::{Around, GiftWrap, is_new};
use crate::change::half_edge::{Nearby, contract, keeps_topology, may_contract};
use crate::change::hole::{Filling, Hole};
use crate::change::work_mesh::WorkMesh;
use crate::decimate::candidate_queue::{Key, Levels};
use crate::error::cost::largest;
use crate::error::fill_cost::{FillCost, HoleCost, Input, Removals};
use crate::error::points::{as_vec, squared_length};
use crate::error::reference::{Buckets, Reference};
use crate::lattice::quantize::Quantized;
use crate::order::reach;
use crate::order::reach::{Reach, Ruler};
use crate::restrict::restrictions::Restrictions;
use glam::DVec3;
use tetralod::mesh::NONE;

/// What removals leave besides the mesh.
pub(crate) struct History {
    pub buckets: Buckets,
    pub removals: Removals,
    /// See [`State::reaches`].
    pub reaches: Vec<Reach>,
}

/// What the evaluation of a candidate reads.
pub(crate) struct State<'a> {
    pub mesh: WorkMesh,
    /// Average gradient of each field at each vertex, in levels per lattice step.
    pub gradients: Vec<DVec3>,
    pub reference: Reference<'a>,
    pub frozen: Vec<bool>,
    /// Vertices that belong to a part of the domain that is built elsewhere, too: their stars are not all here. Empty where there is none.
    pub open: Vec<bool>,
    pub buckets: Buckets,
    pub removals: Removals,
    /// Counts the changes around each vertex.
    pub versions: Vec<u32>,
    /// Tetrahedra around each vertex.
    pub degrees: Vec<u32>,
    /// Where the removal of each vertex, and all those that it would depend on, take place.
    pub reaches: Vec<Reach>,
    pub ruler: Ruler,
    pub levels: Levels,
    pub restrictions: Restrictions,
}

impl<'a> State<'a> {
    pub fn new(mesh: WorkMesh, reference: Reference<'a>, frozen: Vec<bool>, levels: Levels) -> Self {
        let quantized = reference.quantized;
        let history = History {
            buckets: Buckets::new(mesh.tets.len(), quantized),
            removals: Removals::new(mesh.tets.len()),
            reaches: reach::of_stars(&mesh.tets, &quantized.positions),
        };
        Self::resume(mesh, reference, frozen, levels, history)
    }

    /// Of a mesh that is what removals have left.
    pub fn resume(
        mesh: WorkMesh,
        reference: Reference<'a>,
        frozen: Vec<bool>,
        levels: Levels,
        history: History,
    ) -> Self {
        let quantized = reference.quantized;
        let History { buckets, removals, reaches } = history;
        Self {
            gradients: quantized.gradients(&mesh.tets),
            reference,
            frozen,
            open: Vec::new(),
            buckets,
            removals,
            versions: vec![0; quantized.positions.len()],
            degrees: mesh.degrees(),
            reaches,
            ruler: Ruler::new(quantized),
            levels,
            restrictions: Restrictions::default(),
            mesh,
        }
    }

    /// How often the star of a vertex has changed; 0 for [`NONE`].
    fn version(&self, v: u32) -> u32 {
        self.versions.get(v as usize).copied().unwrap_or(0)
    }

    /// Whether a vertex belongs to a part that is built elsewhere, too.
    fn is_open(&self, v: u32) -> bool {
        self.open.get(v as usize).copied().unwrap_or(false)
    }

    /// What orders removals of one level, by [`Key::second`]: what reaches less far comes first, and then what leaves fewer
    /// tetrahedra. Eight of these count as much as an eighth of a power of two of reach.
    pub fn second(&self, a: u32, tets: u32) -> u32 {
        8 * self.ruler.size(&self.reaches[a as usize]) + tets
    }
}

/// The evaluation of one candidate: its hole, and the best filling. Reused from candidate to candidate.
pub(crate) struct RemovalSearch {
    /// None where holes are filled by contracting edges.
    gift_wrap: Option<GiftWrap>,
    pub hole: Hole,
    hole_cost: HoleCost,
    nearby: Nearby,
    around: Around,
    /// Whether the filling that `best` is depends on tetrahedra outside of the hole.
    looked_around: bool,
    /// Link vertices with the predicted error of contracting the edge to them, and their places in the link: see [`end`].
    ends: Vec<u128>,
    /// The filling that is evaluated, and the best one so far.
    now: Candidate,
    pub best: Candidate,
    /// The vertex that `best` moves the removed one to; [`NONE`] if it is another filling.
    pub best_end: u32,
    /// How often the star of `best_end` had changed when it was looked at.
    version_of_end: u32,
}

/// A filling and its cost.
#[derive(Default)]
pub(crate) struct Candidate {
    pub filling: Filling,
    pub cost: FillCost,
    /// The largest error, which decides the level.
    error: f64,
}

impl Candidate {
    fn evaluate(&mut self, hole: &Hole, hole_cost: &HoleCost, state: &State<'_>, limit: f64) {
        let input = Input { hole, filling: &self.filling, reference: &state.reference };
        self.error = self.cost.evaluate(hole_cost, &state.buckets, limit, input);
    }
}

impl RemovalSearch {
    pub fn new(gift_wrap: Option<GiftWrap>) -> Self {
        Self {
            gift_wrap,
            hole: Hole::default(),
            hole_cost: HoleCost::default(),
            nearby: Nearby::default(),
            around: Around::default(),
            looked_around: false,
            ends: Vec::new(),
            now: Candidate::default(),
            best: Candidate::default(),
            best_end: NONE,
            version_of_end: 0,
        }
    }

    /// Evaluates a removal, and gets ready to carry it out. False if its level is above `level` now, or it cannot be made.
    pub fn prepare(&mut self, state: &State<'_>, key: Key, level: u16) -> bool {
        let found = self.at(state, key.a, key.b, level);
        let is_due = found.is_some_and(|found| found.level() <= level);
        if is_due {
            self.hole.sort_faces();
            self.hole.link_filling(&mut self.best.filling);
            self.version_of_end = state.version(self.best_end);
        }
        is_due
    }

    /// Whether removals since it was prepared may have changed the result, although they have left the star alone.
    pub fn is_stale(&self, state: &State<'_>) -> bool {
        // What is kept apart, and what the boundary moves over, may be anywhere; the topology depends on the star of the other end.
        state.restrictions.look_beyond_holes()
            || self.looked_around
            || !self.best.cost.is_flat()
            || state.version(self.best_end) != self.version_of_end
    }

    /// Evaluates the removal of `a`, by moving it to `end` unless that is [`NONE`]. Returns its key; none if it cannot
    /// be removed. If the key's level is above `level`, it is a lower bound; else `best` is the filling to be made.
    pub fn at(&mut self, state: &State<'_>, a: u32, end: u32, level: u16) -> Option<Key> {
        if state.restrictions.keeps(a) {
            return None;
        }
        self.hole.feature = state.restrictions.feature;
        self.hole.open(&state.mesh, &state.reference.quantized.positions, a).ok()?;
        if self.hole.star.len() < state.degrees[a as usize] as usize {
            // The tetrahedra around it are not connected through faces: the input overlaps itself.
            return None;
        }
        state.removals.find_hole_cost(&self.hole, &state.reference, &mut self.hole_cost);
        let least = state.levels.of(largest(&self.hole_cost.errors));
        if least > level {
            return Some(Key::new(least, 0, 0.0, a, NONE));
        }
        if self.gift_wrap.is_none() { self.find_end(state, end, level) } else { self.wrap(state, level) }
    }

    /// Finds the best edge to contract: the one to `known` unless that is [`NONE`]. Its filling becomes `best`.
    fn find_end(&mut self, state: &State<'_>, known: u32, level: u16) -> Option<Key> {
        self.hole.find_sides();
        self.list_ends(state, known);
        let a = self.hole.a;
        let least = state.levels.of(largest(&self.hole_cost.errors));
        // What it is but for the tetrahedra that are left.
        let (centre, second) = (state.reference.quantized.positions[a as usize], state.second(a, 0));
        let mut found: Option<Key> = None;
        for at in 0..self.ends.len() {
            let (b, i) = vertex_and_place(self.ends[at]);
            let second = second + self.hole.left_at(i);
            let length = squared_length(centre, self.hole.points[i]);
            // Its error is at least that of the hole. So most ends cannot be better than the best one so far, whatever
            // their own is.
            let is_worse = |found| Key::new(least, second, length, a, b) > found;
            if found.is_some_and(is_worse) || !self.contract(state, i) {
                continue;
            }
            let limit = state.levels.largest(found.map_or(level, |found| found.level().min(level)));
            let Self { hole, hole_cost, now, .. } = self;
            now.evaluate(hole, hole_cost, state, limit);
            let key = Key::new(state.levels.of(self.now.error), second, length, a, b);
            if found.is_none_or(|found| key < found) {
                found = Some(key);
                self.best_end = b;
                std::mem::swap(&mut self.now, &mut self.best);
            }
        }
        found
    }

    /// Lists the ends to try, those with the least predicted error first: `known` alone unless that is [`NONE`]. Most do not make
    /// positive tetrahedra, and are left out.
    fn list_ends(&mut self, state: &State<'_>, known: u32) {
        let Self { ends, hole, .. } = self;
        ends.clear();
        if known != NONE {
            let place = hole.place(known).filter(|&i| may_contract(hole, i));
            ends.extend(place.map(|i| end(0.0, known, i)));
            return;
        }
        let own = Prediction::new(&state.reference, &state.gradients, hole.a);
        let seen = (0..hole.link.len()).filter(|&i| may_contract(hole, i));
        ends.extend(seen.map(|i| end(own.error_at(hole.link[i], hole.points[i]), hole.link[i], i)));
        ends.sort_unstable();
    }

    /// Fills the hole by moving its vertex to link vertex `i`, one of the ends, if that may be.
    fn contract(&mut self, state: &State<'_>, i: usize) -> bool {
        let Self { hole, now, nearby, .. } = self;
        let positions = &state.reference.quantized.positions;
        if !contract(hole, i, &mut now.filling) || hole.tilts_flat(&now.filling, positions) {
            return false;
        }
        let b = hole.link[i];
        if !state.restrictions.allow_contraction((hole, b), &now.filling, &state.mesh, positions) {
            return false;
        }
        // Inside, positive tetrahedra are all it takes.
        if state.reference.boundary.at(b).is_empty() {
            return true;
        }
        // Whether the topology is kept depends on the whole star of `b`.
        let stays = state.is_open(b) || hole.on_boundary() && state.frozen[b as usize];
        !stays && keeps_topology(hole, &state.mesh, &state.degrees, nearby, i)
    }

    /// Fills the hole by the Delaunay criterion; the filling becomes `best`.
    fn wrap(&mut self, state: &State<'_>, level: u16) -> Option<Key> {
        let Self { hole, hole_cost, best, gift_wrap, around, looked_around, .. } = self;
        let positions = &state.reference.quantized.positions;
        if !gift_wrap.as_mut()?.fill(hole, positions, &mut best.filling)
            || hole.tilts_flat(&best.filling, positions)
            || !state.restrictions.allow_filling(hole, &best.filling, positions)
        {
            return None;
        }
        // A removal must make the mesh smaller: a finer mesh is then a larger one, which budgets rely on.
        if best.filling.tets.len() >= hole.star.len() {
            return None;
        }
        let on_boundary = |v: u32| !state.reference.boundary.at(v).is_empty();
        let mesh = (&state.mesh, &state.degrees[..]);
        let is_new = is_new((hole, &best.filling), mesh, on_boundary, around);
        *looked_around = is_new.is_some();
        if is_new == Some(false) {
            return None;
        }
        let limit = state.levels.largest(level);
        best.evaluate(hole, hole_cost, state, limit);
        let (error, tets) = (state.levels.of(self.best.error), self.best.filling.tets.len() as u32);
        Some(Key::new(error, state.second(self.hole.a, tets), 0.0, self.hole.a, NONE))
    }
}

/// A neighbour and its place in the link as a number: by predicted error, which is not negative, then by vertex.
#[inline]
fn end(error: f64, vertex: u32, place: usize) -> u128 {
    // Bits of floats that are not negative compare as the floats do.
    u128::from(error.to_bits()) << 64 | u128::from(vertex) << 32 | place as u128
}

/// The vertex of an end, and its place.
#[inline]
fn vertex_and_place(end: u128) -> (u32, usize) {
    ((end >> 32) as u32, end as u32 as usize)
}

/// Predicts what it costs to contract edges at one vertex.
struct Prediction<'a> {
    quantized: &'a Quantized,
    position: DVec3,
    levels: &'a [i32],
    gradients: &'a [DVec3],
}

impl<'a> Prediction<'a> {
    fn new(reference: &Reference<'a>, gradients: &'a [DVec3], a: u32) -> Self {
        let quantized = reference.quantized;
        let fields = quantized.fields.len();
        let own = a as usize * fields..(a as usize + 1) * fields;
        let (levels, gradients) = (&quantized.levels[own.clone()], &gradients[own]);
        Self { quantized, position: quantized.rounded(a), levels, gradients }
    }

    /// The second difference of the fields along the edge to `b`, which is at `q`, as an error.
    #[inline]
    fn error_at(&self, b: u32, q: [i32; 3]) -> f64 {
        let Self { quantized, position, levels, gradients } = *self;
        let apart = as_vec(q) - position;
        let mut largest = 0.0_f64;
        for (f, field) in quantized.fields.iter().enumerate() {
            let rise = f64::from(quantized.level(b, f) - levels[f]);
            largest = largest.max((rise - gradients[f].dot(apart)).abs() * field.step / field.range());
        }
        largest
    }
}

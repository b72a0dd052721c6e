//! The removal of a vertex: the best filling of its hole, and its error.
//!
//! A search reads [`State`] and writes only to its own [`RemovalSearch`], so candidates are evaluated in parallel.

use crate::change::gift_wrap::{Around, GiftWrap, is_new};
use crate::change::half_edge::{Nearby, contract, keeps_topology, may_contract};
use crate::change::hole::{Filling, Hole};
use crate::change::sides::{FaceSet, bits};
use crate::change::work_mesh::WorkMesh;
use crate::decimate::candidate_queue::{Key, Levels};
use crate::error::buckets::Buckets;
use crate::error::centre::{Centre, Seat};
use crate::error::cost::largest;
use crate::error::fill_cost::{FillCost, HoleCost, Input, Removals};
use crate::error::points::squared_length;
use crate::error::reference::Reference;
use crate::order::reach;
use crate::order::reach::{Reach, Ruler};
use crate::restrict::restrictions::Restrictions;
use tetralod::mesh::NONE;

/// What removals leave besides the mesh.
pub(crate) struct History<'s> {
    pub buckets: Buckets<'s>,
    pub removals: Removals,
    /// See [`State::reaches`].
    pub reaches: Vec<Reach>,
}

/// What the evaluation of a candidate reads.
pub(crate) struct State<'a, 's> {
    pub mesh: WorkMesh,
    pub reference: Reference<'a>,
    pub frozen: Vec<bool>,
    /// Vertices that belong to a part of the domain that is built elsewhere, too: their stars are not all here. Empty where there is none.
    pub open: Vec<bool>,
    pub buckets: Buckets<'s>,
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

impl<'a, 's> State<'a, 's> {
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
        history: History<'s>,
    ) -> Self {
        let quantized = reference.quantized;
        let History { buckets, removals, reaches } = history;
        Self {
            reference,
            frozen,
            open: Vec::new(),
            buckets,
            removals,
            versions: vec![0; mesh.incident.len()],
            degrees: mesh.degrees(),
            reaches,
            ruler: Ruler::new(quantized),
            levels,
            restrictions: Restrictions::default(),
            mesh,
        }
    }

    /// The regions of the tetrahedra of a hole, where fields jump.
    fn regions_of(&self, hole: &Hole) -> impl Iterator<Item = u32> {
        let is_needed = !self.reference.quantized.sides.is_empty();
        let star = hole.star.iter().filter(move |_| is_needed);
        star.filter_map(|s| self.restrictions.regions().get(s.tet as usize).copied())
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
    /// Where fields jump, the regions of its tetrahedra.
    pub regions: Vec<u32>,
    pub hole_cost: HoleCost,
    nearby: Nearby,
    around: Around,
    /// Whether the filling that `best` is depends on tetrahedra outside of the hole.
    looked_around: bool,
    centre: Centre,
    /// The neighbours that the vertex may be moved to.
    ends: Vec<End>,
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
    /// Where fields jump, the regions of its cells.
    pub regions: Vec<u32>,
    /// The largest error, which decides the level.
    error: f64,
}

impl Candidate {
    fn evaluate(
        &mut self,
        (hole, hole_cost): (&Hole, &mut HoleCost),
        state: &State<'_, '_>,
        limit: f64,
        contraction: (FaceSet, Option<Seat>),
    ) {
        self.regions.clear();
        if !state.reference.quantized.sides.is_empty() {
            // Those of a contraction are in the order of their faces.
            self.regions.extend(
                bits(contraction.0).filter_map(|face| {
                    state.restrictions.regions().get(hole.star[face].tet as usize).copied()
                }),
            );
        }
        let input =
            Input { hole, filling: &self.filling, reference: &state.reference, regions: &self.regions };
        self.error = self.cost.evaluate(hole_cost, &state.buckets, limit, input, contraction);
    }
}

impl RemovalSearch {
    pub fn new(gift_wrap: Option<GiftWrap>) -> Self {
        Self {
            gift_wrap,
            hole: Hole::default(),
            regions: Vec::new(),
            hole_cost: HoleCost::default(),
            nearby: Nearby::default(),
            around: Around::default(),
            looked_around: false,
            centre: Centre::default(),
            ends: Vec::new(),
            now: Candidate::default(),
            best: Candidate::default(),
            best_end: NONE,
            version_of_end: 0,
        }
    }

    /// Evaluates a removal, and gets ready to carry it out. False if its level is above `level` now, or it cannot be made.
    pub fn prepare(&mut self, state: &State<'_, '_>, key: Key, level: u16) -> bool {
        let found = self.at(state, key.a, key.b, level);
        let is_due = found.is_some_and(|found| found.level() <= level);
        if is_due {
            self.hole.sort_faces();
            match self.hole.place(self.best_end) {
                Some(end) => self.hole.link_contraction(end, &mut self.best.filling.across),
                None => self.hole.link_filling(&mut self.best.filling),
            }
            self.version_of_end = state.version(self.best_end);
        }
        is_due
    }

    /// Whether removals since it was prepared may have changed the result, although they have left the star alone.
    pub fn is_stale(&self, state: &State<'_, '_>) -> bool {
        // What is kept apart, and what the boundary moves over, may be anywhere; the topology depends on the star of the other end.
        state.restrictions.look_beyond_holes()
            || self.looked_around
            || !self.best.cost.is_flat()
            || state.version(self.best_end) != self.version_of_end
    }

    /// Evaluates the removal of `a`, by moving it to `end` unless that is [`NONE`]. Returns its key; none if it cannot
    /// be removed. If the key's level is above `level`, it is a lower bound; else `best` is the filling to be made.
    pub fn at(&mut self, state: &State<'_, '_>, a: u32, end: u32, level: u16) -> Option<Key> {
        if state.restrictions.keeps(a) {
            return None;
        }
        self.hole.feature = state.restrictions.feature;
        self.hole.open(&state.mesh, &state.reference.quantized.positions, a).ok()?;
        if self.hole.star.len() < state.degrees[a as usize] as usize {
            // The tetrahedra around it are not connected through faces: the input overlaps itself.
            return None;
        }
        self.regions.clear();
        self.regions.extend(state.regions_of(&self.hole));
        let hole = (&self.hole, &self.regions[..]);
        state.removals.find_hole_cost(hole, &state.reference, &mut self.hole_cost);
        let least = state.levels.of(largest(&self.hole_cost.errors));
        if least > level {
            return Some(Key::new(least, 0, 0.0, a, NONE));
        }
        if self.gift_wrap.is_none() { self.find_end(state, end, level) } else { self.wrap(state, level) }
    }

    /// Finds the best edge to contract: the one to `known` unless that is [`NONE`]. Its filling becomes `best`.
    fn find_end(&mut self, state: &State<'_, '_>, known: u32, level: u16) -> Option<Key> {
        self.hole.find_sides();
        self.list_ends(state, known);
        let mut found: Option<Key> = None;
        for at in 0..self.ends.len() {
            let End { least, place, seat } = self.ends[at];
            if found.is_some_and(|found| least > found) {
                break;
            }
            if !self.contract(state, place) {
                continue;
            }
            if least.level() > level {
                // So are all that come after it.
                return Some(least);
            }
            let limit = state.levels.largest(found.map_or(level, |found| found.level().min(level)));
            let Self { hole, hole_cost, now, .. } = self;
            now.evaluate((hole, hole_cost), state, limit, (hole.others(place), seat));
            let key = least.at_level(state.levels.of(self.now.error));
            if found.is_none_or(|found| key < found) {
                found = Some(key);
                self.best_end = key.b;
                std::mem::swap(&mut self.now, &mut self.best);
            }
        }
        found
    }

    /// Lists the ends to try, those with the least lower bound of their key first: `known` alone unless that is [`NONE`]. Most do not
    /// make positive tetrahedra, and are left out.
    fn list_ends(&mut self, state: &State<'_, '_>, known: u32) {
        let Self { ends, hole, hole_cost, centre, regions, .. } = self;
        ends.clear();
        let reference = &state.reference;
        let (a, own) = (hole.a, largest(&hole_cost.errors));
        // What it is but for the tetrahedra that are left.
        let (at, second) = (reference.quantized.positions[a as usize], state.second(a, 0));
        let places = match known {
            NONE => 0..hole.link.len(),
            _ => hole.place(known).map_or(0..0, |i| i..i + 1),
        };
        centre.start(hole, reference);
        for i in places.filter(|&i| may_contract(hole, i)) {
            let seat = centre.seat(hole, i);
            // The error at the removed vertex is mostly the largest.
            let error =
                seat.map_or(own, |seat| own.max(centre.error_at(seat, (hole, regions), i, reference)));
            let length = squared_length(at, hole.points[i]);
            let least = Key::new(state.levels.of(error), second + hole.left_at(i), length, a, hole.link[i]);
            ends.push(End { least, place: i, seat });
        }
        ends.sort_unstable_by_key(|end| end.least);
    }

    /// Fills the hole by moving its vertex to link vertex `i`, one of the ends, if that may be.
    fn contract(&mut self, state: &State<'_, '_>, i: usize) -> bool {
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
    fn wrap(&mut self, state: &State<'_, '_>, level: u16) -> Option<Key> {
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
        best.evaluate((hole, hole_cost), state, limit, (0, None));
        let (error, tets) = (state.levels.of(self.best.error), self.best.filling.tets.len() as u32);
        Some(Key::new(error, state.second(self.hole.a, tets), 0.0, self.hole.a, NONE))
    }
}

/// A neighbour that the vertex may be moved to.
#[derive(Clone, Copy)]
struct End {
    /// A lower bound of its key.
    least: Key,
    /// Its place in the link.
    place: usize,
    /// Where the vertex is in the filling, unless it is outside.
    seat: Option<Seat>,
}

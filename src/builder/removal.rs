//! The removal of a vertex: the best filling of its hole, and its error.
//!
//! A search reads [`State`] and writes only to its own [`RemovalSearch`], so candidates could be evaluated in parallel.

use super::candidate_queue::{Key, Levels};
use super::cost::{Buckets, Reference, largest};
use super::fill_cost::{FillCost, HoleCost, Input, Removals};
use super::gift_wrap::GiftWrap;
use super::half_edge::{Nearby, contract, keeps_topology};
use super::hole::{Filling, Hole};
use super::points::squared_length;
use super::quantize::Quantized;
use super::reach;
use super::reach::{Reach, Ruler};
use super::work_mesh::WorkMesh;
use crate::mesh::NONE;
use glam::DVec3;

/// What the evaluation of a candidate reads.
pub(super) struct State<'a> {
    pub mesh: WorkMesh,
    /// Average gradient of each field at each vertex, in levels per lattice step.
    pub gradients: Vec<DVec3>,
    pub reference: Reference<'a>,
    pub frozen: Vec<bool>,
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
}

impl<'a> State<'a> {
    pub fn new(mesh: WorkMesh, reference: Reference<'a>, frozen: Vec<bool>, levels: Levels) -> Self {
        let quantized = reference.quantized;
        let points = quantized.positions.len();
        Self {
            gradients: quantized.gradients(&mesh.tets),
            reference,
            frozen,
            buckets: Buckets::new(mesh.tets.len(), quantized),
            removals: Removals::new(mesh.tets.len()),
            versions: vec![0; points],
            degrees: mesh.degrees(),
            reaches: reach::of_stars(&mesh.tets, &quantized.positions),
            ruler: Ruler::new(quantized),
            levels,
            mesh,
        }
    }

    /// What orders removals of one level, by [`Key::second`]: what reaches less far comes first, and then what leaves fewer
    /// tetrahedra. Eight of these count as much as an eighth of a power of two of reach.
    pub fn second(&self, a: u32, tets: u32) -> u32 {
        8 * self.ruler.size(&self.reaches[a as usize]) + tets
    }
}

/// The evaluation of one candidate: its hole, and the best filling. Reused from candidate to candidate.
pub(super) struct RemovalSearch {
    /// None where holes are filled by contracting edges.
    gift_wrap: Option<GiftWrap>,
    pub hole: Hole,
    hole_cost: HoleCost,
    nearby: Nearby,
    /// Link vertices with the predicted error of contracting the edge to them.
    ends: Vec<(f64, u32)>,
    /// The filling that is evaluated, and the best one so far.
    now: Candidate,
    pub best: Candidate,
    /// The vertex that `best` moves the removed one to; [`NONE`] if it is another filling.
    pub best_end: u32,
}

/// A filling and its cost.
#[derive(Default)]
pub(super) struct Candidate {
    pub filling: Filling,
    pub cost: FillCost,
    error: f64,
}

impl Candidate {
    fn evaluate(&mut self, hole: &Hole, hole_cost: &HoleCost, state: &State<'_>, limit: f64) {
        let input = Input { hole, filling: &self.filling, reference: &state.reference };
        self.error = self.cost.evaluate(hole_cost, &state.buckets, limit, input);
    }
}

impl RemovalSearch {
    pub fn new(gift_wrap: Option<GiftWrap>, points: usize) -> Self {
        Self {
            gift_wrap,
            hole: Hole::default(),
            hole_cost: HoleCost::default(),
            nearby: Nearby::new(points),
            ends: Vec::new(),
            now: Candidate::default(),
            best: Candidate::default(),
            best_end: NONE,
        }
    }

    /// Evaluates the removal of `a`, by moving it to `end` unless that is [`NONE`]. Returns its key; none if it cannot
    /// be removed. If the key's level is above `level`, it is a lower bound; else `best` is the filling to be made.
    pub fn at(&mut self, state: &State<'_>, a: u32, end: u32, level: u16) -> Option<Key> {
        self.hole.open(&state.mesh, &state.reference.quantized.positions, a).ok()?;
        if self.hole.star.len() < state.degrees[a as usize] as usize {
            // The tetrahedra around it are not connected through faces: the input overlaps itself.
            return None;
        }
        self.hole_cost = state.removals.hole_cost(&self.hole, &state.reference);
        let least = state.levels.of(largest(&self.hole_cost.errors));
        if least > level {
            return Some(Key::new(least, 0, 0.0, a, NONE));
        }
        if self.gift_wrap.is_none() { self.find_end(state, end, level) } else { self.wrap(state, level) }
    }

    /// The key of a filling of the hole with so many tetrahedra and this error.
    fn key(&self, state: &State<'_>, tets: usize, error: f64, b: u32) -> Key {
        let positions = &state.reference.quantized.positions;
        let length =
            positions.get(b as usize).map_or(0.0, |&q| squared_length(positions[self.hole.a as usize], q));
        let second = state.second(self.hole.a, tets as u32);
        Key::new(state.levels.of(error), second, length, self.hole.a, b)
    }

    /// Finds the best edge to contract: the one to `known` unless that is [`NONE`]. Its filling becomes `best`.
    fn find_end(&mut self, state: &State<'_>, known: u32, level: u16) -> Option<Key> {
        self.ends.clear();
        if known != NONE {
            self.ends.push((0.0, known));
        } else {
            let ends = self
                .hole
                .link
                .iter()
                .map(|&b| (predicted(&state.reference, &state.gradients, self.hole.a, b), b));
            self.ends.extend(ends);
            self.ends.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        }
        let mut found: Option<Key> = None;
        let least = largest(&self.hole_cost.errors);
        for i in 0..self.ends.len() {
            let b = self.ends[i].1;
            // Its error is at least that of the hole. So most ends cannot be better than the best one so far, whatever
            // their own is.
            let is_worse = |found| self.key(state, self.hole.left_at(b), least, b) > found;
            if found.is_some_and(is_worse) || !self.contract(state, b) {
                continue;
            }
            let limit = state.levels.largest(found.map_or(level, |found| found.level().min(level)));
            let Self { hole, hole_cost, now, .. } = self;
            now.evaluate(hole, hole_cost, state, limit);
            let key = self.key(state, self.now.filling.tets.len(), self.now.error, b);
            if found.is_none_or(|found| key < found) {
                found = Some(key);
                self.best_end = b;
                std::mem::swap(&mut self.now, &mut self.best);
            }
        }
        found
    }

    /// Fills the hole by moving its vertex to `b`, if that may be.
    fn contract(&mut self, state: &State<'_>, b: u32) -> bool {
        let Self { hole, now, nearby, .. } = self;
        let positions = &state.reference.quantized.positions;
        if !contract(hole, positions, b, &mut now.filling) || hole.tilts_flat(&now.filling, positions) {
            return false;
        }
        // Inside, positive tetrahedra are all it takes.
        if state.reference.boundary.at(b).is_empty() {
            return true;
        }
        let stays = hole.on_boundary() && state.frozen[b as usize];
        !stays && keeps_topology(hole, &state.mesh, nearby, b)
    }

    /// Fills the hole by the Delaunay criterion; the filling becomes `best`.
    fn wrap(&mut self, state: &State<'_>, level: u16) -> Option<Key> {
        let Self { hole, hole_cost, best, gift_wrap, .. } = self;
        let positions = &state.reference.quantized.positions;
        if !gift_wrap.as_mut()?.fill(hole, positions, &mut best.filling)
            || hole.tilts_flat(&best.filling, positions)
        {
            return None;
        }
        // A removal must make the mesh smaller: a finer mesh is then a larger one, which budgets rely on.
        if best.filling.tets.len() >= hole.star.len() {
            return None;
        }
        let limit = state.levels.largest(level);
        best.evaluate(hole, hole_cost, state, limit);
        Some(self.key(state, self.best.filling.tets.len(), self.best.error, NONE))
    }
}

/// The second difference of the fields along an edge that is to be contracted to `b`, as an error.
fn predicted(reference: &Reference<'_>, gradients: &[DVec3], a: u32, b: u32) -> f64 {
    let Quantized { positions, levels, fields, .. } = reference.quantized;
    let [p, q] = [a, b].map(|v| DVec3::from_array(positions[v as usize].map(f64::from)));
    let mut largest = 0.0_f64;
    for (f, field) in fields.iter().enumerate() {
        let [u, v] = [a, b].map(|v| v as usize * fields.len() + f);
        let rise = f64::from(levels[v] - levels[u]);
        largest = largest.max((rise - gradients[u].dot(q - p)).abs() * field.step / field.range());
    }
    largest
}

//! From fine to coarse: pick a vertex, remove it, record it [§2.2, §5].

pub(crate) mod append;
pub(crate) mod candidate_queue;
pub(crate) mod collapses;
pub(crate) mod removal;
pub(crate) mod rounds;
pub(crate) mod searches;

use crate::change::gift_wrap::GiftWrap;
use crate::change::hole::{Filling, Hole};
use crate::change::work_mesh::{WorkMesh, keep};
use crate::decimate::candidate_queue::{Key, Levels};
use crate::decimate::removal::{RemovalSearch, State};
use crate::decimate::rounds::{Later, Rounds};
use crate::decimate::searches::Searches;
use crate::error::fill_cost::Input;
use crate::error::reference::Reference;
use crate::lattice::field_selection;
use crate::lattice::quantize;
use crate::lattice::quantize::Quantized;
use crate::order::reach::Reach;
use crate::restrict::restrictions::Restrictions;
use crate::{BuildConfig, BuildCriterion, BuildError, BuildProgress, OnProgress, Purpose};
use std::borrow::Cow;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::mem;
use tetralod::geom::Bounds;
use tetralod::mesh;
use tetralod::mesh::{NONE, TetMesh, Topology};
use tetralod::mt::{ErrorCode, MAX_UPDATES, MtInfo, Regions};

/// The candidates of a round are evaluated in so many batches.
const BATCHES: usize = 64;

/// Batches are at least so large.
const SMALLEST_BATCH: usize = 64;

/// A hole has about so many tetrahedra.
const USUAL_HOLE: u32 = 24;

/// An edge that is contracted has about so many tetrahedra around it, at most.
const LARGEST_FAN: u32 = 10;

/// The result of [`decimate`].
pub(crate) struct Decimated<R> {
    pub record: R,
    pub quantized: Quantized,
    /// What is known of the MT; not how many updates it has.
    pub info: MtInfo,
    /// How far interfaces between regions have moved, in model units.
    pub interface_deviation: f64,
    /// The regions that are kept apart, with those of the tetrahedra that are left.
    pub regions: Option<Regions>,
}

/// Takes down the removals in the order in which they are made.
pub(crate) trait Record {
    /// Begins, without removals yet, for a mesh of so many tetrahedra.
    fn start(&mut self, info: &MtInfo, tets: usize);

    /// How many removals there are.
    fn len(&self) -> usize;

    /// Adds a removal that has just been carried out.
    fn add(&mut self, removed: &Removed<'_>, quantized: &Quantized);

    /// Tetrahedra have new numbers: their places in this list of the old ones, which ascend.
    fn renumber(&mut self, live: &[u32]);

    /// Ends with the tetrahedra that are left, those that begin with [`NONE`] being dead; and the removal that made each.
    fn finish(&mut self, tets: &[[u32; 4]], makers: &[u32]);
}

/// A removal.
pub(crate) struct Removed<'a> {
    pub hole: &'a Hole,
    pub filling: &'a Filling,
    /// Where fields jump, the regions of the tetrahedra of the hole.
    pub regions: &'a [u32],
    /// The tetrahedra in which the filling is now.
    pub slots: &'a [u32],
    /// The removals that made the tetrahedra of the mesh before, [`NONE`] for those of the reference mesh.
    pub makers: &'a [u32],
    /// The neighbour that the vertex was moved to; [`NONE`] where the hole was filled otherwise.
    pub end: u32,
    /// Whether that may not count as another one: where interfaces of regions move, which region is where depends on it.
    pub only_end: bool,
    /// The error of each field.
    pub errors: &'a [ErrorCode],
    /// How far the boundary has moved, as an error.
    pub step: f64,
    /// Where it and all that it depends on take place.
    pub reach: Reach,
}

/// Removes vertices of `mesh`, cheapest first, until no more can be removed. `mesh` must be valid: see
/// [`tetralod::mesh::repair`]. Of a mesh that is owned only the fields are left then whose exact values are kept.
///
/// # Errors
/// As [`crate::edge_mt`].
pub(crate) fn decimate<R: Record + Default>(
    mesh: &mut Cow<'_, TetMesh>,
    config: &BuildConfig,
    how: (BuildCriterion, Purpose),
    progress: OnProgress<'_>,
) -> Result<Decimated<R>, BuildError> {
    let mut record = R::default();
    let (quantized, info, interface_deviation, regions) =
        decimate_into(&mut record, mesh, config, how, progress)?;
    Ok(Decimated { record, quantized, info, interface_deviation, regions })
}

/// [`decimate`] for any record, compiled once.
fn decimate_into(
    record: &mut dyn Record,
    mesh: &mut Cow<'_, TetMesh>,
    config: &BuildConfig,
    (criterion, purpose): (BuildCriterion, Purpose),
    progress: OnProgress<'_>,
) -> Result<(Quantized, MtInfo, f64, Option<Regions>), BuildError> {
    if mesh.positions.len() > MAX_UPDATES as usize {
        return Err(BuildError::TooLarge);
    }
    if mesh.tets.is_empty() {
        return Err(BuildError::Empty);
    }
    let Topology { neighbors, non_manifold, .. } = mesh::check_topology(mesh)?;
    let quantized = quantize::quantize_cells(mesh, config)?;
    let gift_wrap = match criterion {
        BuildCriterion::HalfEdge => None,
        BuildCriterion::Delaunay => Some(GiftWrap::new(&quantized.positions)),
    };
    let restrictions = Restrictions::of(config, mesh, &quantized, criterion)?;
    let displacement_per_error = config.displacement * Bounds::of(&mesh.positions).diagonal();
    let tetrahedra = mesh.tets.len();
    let points = mesh.positions.len();
    let work = WorkMesh::new(take_tets(mesh, config), neighbors, points);
    let levels = Levels::of_purpose(purpose);
    let reference = Reference::new(&quantized, &work, displacement_per_error, config.displacement_edges);
    let mut state = State::new(work, reference, non_manifold, levels);
    state.restrictions = restrictions;
    let info = quantized.info(tetrahedra as u64, displacement_per_error);
    record.start(&info, state.mesh.tets.len());
    let mut decimator = Decimator::new(state, gift_wrap, record);
    decimator.remove_all(progress)?;
    let mut state = decimator.finish();
    let interface_deviation = state.restrictions.interface_deviation();
    let regions = state.restrictions.take_regions(&state.mesh.tets);
    drop(state);
    Ok((quantized, info, interface_deviation, regions))
}

/// Takes the tetrahedra out of a mesh that is owned, and frees what is not needed any more.
fn take_tets(mesh: &mut Cow<'_, TetMesh>, config: &BuildConfig) -> Vec<[u32; 4]> {
    match mesh {
        Cow::Borrowed(mesh) => mesh.tets.clone(),
        Cow::Owned(mesh) => {
            mesh.positions = Vec::new();
            if !field_selection::keeps_exact_values(config) {
                mesh.fields = Vec::new();
            }
            mem::take(&mut mesh.tets)
        }
    }
}

pub(crate) struct Decimator<'a, 's, R: ?Sized> {
    pub state: State<'a, 's>,
    rounds: Rounds,
    searches: Searches,
    slots: Vec<u32>,
    /// The removals so far.
    pub record: &'a mut R,
}

/// A candidate of a round.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Prospect {
    /// A lower bound of [`Key::second`].
    guess: u32,
    vertex: u32,
    /// The best end to move it to; [`NONE`] if that is not known.
    end: u32,
}

impl<'a, 's, R: Record + ?Sized> Decimator<'a, 's, R> {
    pub fn new(state: State<'a, 's>, gift_wrap: Option<GiftWrap>, record: &'a mut R) -> Self {
        let points = state.versions.len();
        let mut rounds = Rounds::new(state.levels.of(0.0), state.levels.last(), points);
        let free = (0..points as u32).filter(|&v| state.mesh.has(v) && !state.frozen[v as usize]);
        free.for_each(|v| rounds.wait(v));
        let searches = Searches::new(gift_wrap);
        Self { state, rounds, searches, slots: Vec::new(), record }
    }

    pub fn remove_all(&mut self, progress: OnProgress<'_>) -> Result<(), BuildError> {
        self.remove_until(0, progress)
    }

    /// Removes vertices until no more can be removed, or a round leaves at most so many tetrahedra.
    pub fn remove_until(&mut self, enough: u32, progress: OnProgress<'_>) -> Result<(), BuildError> {
        let points = self.state.mesh.incident.len() as u32;
        let vertices = (0..points).filter(|&v| self.state.mesh.has(v)).count();
        loop {
            let before = self.record.len();
            self.round(progress)?;
            self.compact();
            let after = self.record.len();
            if !self.rounds.end(after - before, vertices - after) || self.state.mesh.live() <= enough {
                return Ok(());
            }
        }
    }

    /// Ends the record, and returns what is left.
    pub fn finish(self) -> State<'a, 's> {
        self.record.finish(&self.state.mesh.tets, &self.state.removals.makers);
        self.state
    }

    /// Frees what belongs to tetrahedra that are gone, if they are many, and what takes too much with those that are left.
    fn compact(&mut self) {
        let State { mesh, buckets, removals, restrictions, .. } = &mut self.state;
        if let Some(live) = mesh.compact() {
            buckets.renumber(&live);
            keep(&mut removals.makers, &live);
            restrictions.renumber(&live);
            self.record.renumber(&live);
        }
        if let Some(stored) = &mut buckets.stored {
            // Searches have few of them in memory.
            stored.tidy();
            return;
        }
        let of_a_tet = self.state.reference.points / self.state.mesh.live().max(1);
        self.searches.limit((USUAL_HOLE * of_a_tet) as usize);
    }

    /// Evaluates the candidates of a round in batches and removes vertices in the order of the keys. Between batches,
    /// candidates that are now too near to a removal drop out.
    fn round(&mut self, progress: OnProgress<'_>) -> Result<(), BuildError> {
        let candidates = self.candidates();
        let size = (candidates.len() / BATCHES).max(SMALLEST_BATCH);
        let mut ready = BinaryHeap::new();
        for batch in candidates.chunks(size) {
            let done = self.record.len() as u64;
            let total = u64::from(self.state.reference.points);
            let tetrahedra = Some(self.state.mesh.live());
            BuildProgress { stage: "remove", done, total, tetrahedra }.tell(progress)?;
            self.remove_before(batch[0].guess, &mut ready);
            self.look_at(batch, &mut ready);
        }
        self.remove_before(u32::MAX, &mut ready);
        Ok(())
    }

    /// The candidates of the next round, in about the order of their keys.
    fn candidates(&mut self) -> Vec<Prospect> {
        let (waiting, later) = self.rounds.start();
        let state = &self.state;
        let unchanged =
            later.into_iter().filter(|later| state.versions[later.vertex as usize] == later.version);
        let known = unchanged.map(|later| (later.vertex, later.end));
        let prospect = |(vertex, end): (u32, u32)| {
            let tets = state.degrees[vertex as usize].saturating_sub(LARGEST_FAN);
            Prospect { guess: state.second(vertex, tets), vertex, end }
        };
        let all = known.chain(waiting.into_iter().map(|v| (v, NONE)));
        let mut all: Vec<Prospect> = all.map(prospect).collect();
        all.sort_unstable();
        all
    }

    /// Evaluates candidates, and queues or defers each. A vertex that cannot be removed waits until its neighbourhood
    /// changes.
    fn look_at(&mut self, batch: &[Prospect], ready: &mut BinaryHeap<Reverse<Key>>) {
        let left = batch.iter().filter(|prospect| !self.rounds.waits(prospect.vertex));
        let candidates: Vec<(u32, u32)> = left.map(|&Prospect { vertex, end, .. }| (vertex, end)).collect();
        let level = self.rounds.level();
        let keys = self.searches.at(&self.state, &candidates, level);
        for ((vertex, _), key) in candidates.into_iter().zip(keys) {
            match key {
                Some(key) if key.level() <= level => ready.push(Reverse(key.no_earlier_than(level))),
                Some(key) => {
                    let version = self.state.versions[vertex as usize];
                    self.rounds.put_off(key.level(), Later { vertex, end: key.b, version });
                }
                None => {}
            }
        }
    }

    /// Removes the vertices that are due before those with this guess, unless the round has changed their stars. Some are prepared at
    /// a time; what one of them changes decides again about those that come after it.
    fn remove_before(&mut self, guess: u32, ready: &mut BinaryHeap<Reverse<Key>>) {
        let mut keys = Vec::new();
        loop {
            keys.clear();
            while keys.len() < self.searches.ahead.len()
                && ready.peek().is_some_and(|Reverse(key)| key.second() < guess)
            {
                keys.extend(ready.pop().map(|Reverse(key)| key).filter(|key| !self.rounds.waits(key.a)));
            }
            if keys.is_empty() {
                return;
            }
            let due = self.searches.prepare(&self.state, &keys, self.rounds.level());
            let before = self.record.len();
            for (i, (&key, is_due)) in keys.iter().zip(due).enumerate() {
                if !self.rounds.waits(key.a) {
                    self.settle(i, key, is_due, self.record.len() > before);
                }
            }
        }
    }

    /// Carries out the `i`-th of the prepared removals if it is due. `changed`: others have been carried out since it was prepared.
    fn settle(&mut self, i: usize, key: Key, is_due: bool, changed: bool) {
        // The star and the error are unchanged. The star of the other end may have changed, and the topology check depends on it.
        let search = &mut self.searches.ahead[i];
        let is_due = match changed && (!is_due || search.is_stale(&self.state)) {
            true => search.prepare(&self.state, key, self.rounds.level()),
            false => is_due,
        };
        if is_due { self.remove(i) } else { self.rounds.wait(key.a) }
    }

    /// Carries out the `i`-th of the prepared removals.
    fn remove(&mut self, i: usize) {
        let Self { state, searches, rounds, slots, record, .. } = self;
        let RemovalSearch { hole, hole_cost, best, best_end, regions, .. } = &mut searches.ahead[i];
        let (hole, end) = (&*hole, *best_end);
        let State { mesh, removals, degrees, reference, reaches, restrictions, .. } = state;
        // Never zero: error 0 is to mean the reference mesh, with every vertex in.
        let stored = |error: &f64| ErrorCode::at_least(*error).max(ErrorCode(1));
        let errors: Vec<ErrorCode> = best.cost.placement.errors.iter().map(stored).collect();
        let removal = (removals.errors.len() / errors.len()) as u32;
        hole.replace(mesh, &best.filling, slots);
        let reach = reaches[hole.a as usize];
        let removed = Removed {
            hole,
            filling: &best.filling,
            regions,
            slots,
            makers: &removals.makers,
            end,
            only_end: restrictions.may_move_interfaces(),
            errors: &errors,
            step: best.cost.step,
            reach,
        };
        restrictions.contracted(hole, end, slots, &reference.quantized.positions);
        record.add(&removed, reference.quantized);
        removals.errors.extend(errors);
        slots.iter().for_each(|&t| removals.makers[t as usize] = removal);
        let input = Input { hole, filling: &best.filling, reference, regions: &best.regions };
        best.cost.move_points(&mut hole_cost.stored, &mut state.buckets, slots, input);
        let star = hole.faces.iter().flat_map(|(face, _)| face);
        star.for_each(|&v| degrees[v as usize] -= 1);
        degrees[hole.a as usize] -= hole.star.len() as u32;
        best.filling.tets.iter().flatten().for_each(|&v| degrees[v as usize] += 1);
        // The neighbours have other stars now, and may have become cheaper.
        for &v in &hole.link {
            state.versions[v as usize] = state.versions[v as usize].wrapping_add(1);
            // What was in the star of v, and is not any more, lies within the reach of this removal.
            reaches[v as usize].join(&reach);
            if !state.frozen[v as usize] {
                rounds.wait(v);
            }
        }
    }
}

#[cfg(test)]
mod tests;

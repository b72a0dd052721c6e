//! Vertex-based MTs from fine to coarse: pick a vertex, remove it, record it [§2.2, §5].

use super::BuildConfig;
use super::BuildError;
use super::BuildProgress;
use super::Criterion;
use super::OnProgress;
use super::agenda::Agenda;
use super::agenda::Key;
use super::agenda::Levels;
use super::cost::Buckets;
use super::cost::Reference;
use super::cost::largest;
use super::fill_cost::FillCost;
use super::fill_cost::Legacy;
use super::fill_cost::Past;
use super::gift_wrap::GiftWrap;
use super::half_edge::contract;
use super::half_edge::keeps_topology;
use super::hole::Filling;
use super::hole::Hole;
use super::plan::VertexMarks;
use super::quantize;
use super::quantize::Quantized;
use super::sequence::Insertion;
use super::sequence::Sequence;
use super::skin::Skin;
use super::work_mesh::StarTet;
use super::work_mesh::WorkMesh;
use crate::geom::Bounds;
use crate::mesh;
use crate::mesh::NONE;
use crate::mesh::TetMesh;
use crate::mesh::Topology;
use crate::mt::ErrorCode;
use crate::mt::MAX_UPDATES;
use glam::DVec3;

/// How errors are grouped. Finer levels than those of edge collapses give smaller meshes here, and deeper orders.
const LEVELS: Levels = Levels::QUARTERS;

/// What [`decimate`] hands over.
pub(super) struct Decimated {
    pub sequence: Sequence,
    pub quantized: Quantized,
    /// Model units of displacement that count as an error of 1.
    pub displacement_per_error: f64,
}

/// Removes vertices of `mesh`, cheapest first, until no more can be removed. `mesh` must be valid: see
/// [`crate::mesh::repair`].
///
/// # Errors
/// As [`super::edge_mt`].
pub(super) fn decimate(
    mesh: &TetMesh,
    config: &BuildConfig,
    criterion: Criterion,
    progress: OnProgress<'_>,
) -> Result<Decimated, BuildError> {
    if mesh.positions.len() > MAX_UPDATES as usize {
        return Err(BuildError::TooLarge);
    }
    if mesh.tets.is_empty() {
        return Err(BuildError::Empty);
    }
    mesh::check(mesh).map_err(BuildError::Mesh)?;
    let Topology { neighbors, non_manifold, .. } =
        mesh::topology(mesh.positions.len(), &mesh.tets).map_err(BuildError::Mesh)?;
    let quantized = quantize::quantize(mesh, config)?;
    let gift_wrap = match criterion {
        Criterion::HalfEdge => None,
        Criterion::Delaunay => Some(GiftWrap::new(&quantized.positions)),
    };
    let displacement_per_error = config.displacement * Bounds::of(&mesh.positions).diagonal();
    let work = WorkMesh::new(mesh.tets.clone(), neighbors, mesh.positions.len());
    let mut decimator = Decimator::new(work, &quantized, displacement_per_error, non_manifold, gift_wrap);
    decimator.remove_all(progress)?;
    let Decimator { mesh: base, mut sequence, .. } = decimator;
    sequence.base = base.tets.iter().copied().filter(|tet| tet[0] != NONE).collect();
    turn_round(&mut sequence);
    Ok(Decimated { sequence, quantized, displacement_per_error })
}

/// Makes insertions, coarse to fine, of removals in the order in which they were made.
fn turn_round(sequence: &mut Sequence) {
    let all = sequence.tets.len();
    sequence.tets.reverse();
    sequence.steps.reverse();
    for step in &mut sequence.steps {
        for range in [&mut step.removed, &mut step.inserted] {
            *range = all - range.end..all - range.start;
        }
    }
}

struct Decimator<'a> {
    mesh: WorkMesh,
    /// Average gradient of each field at each vertex, in levels per lattice step.
    gradients: Vec<DVec3>,
    reference: Reference<'a>,
    frozen: Vec<bool>,
    /// None where holes are filled by contracting edges.
    gift_wrap: Option<GiftWrap>,
    buckets: Buckets,
    marks: VertexMarks,
    past: Past,
    /// Counts the changes around each vertex.
    versions: Vec<u32>,
    /// The version that a vertex had when it was looked at last.
    seen: Vec<u32>,
    /// Tetrahedra around each vertex.
    degrees: Vec<u32>,
    agenda: Agenda,
    /// The one candidate in the agenda that counts for each vertex.
    entries: Vec<Option<Key>>,
    hole: Hole,
    star: Vec<StarTet>,
    /// Link vertices by what is predicted of contracting the edge to them.
    ends: Vec<(f64, u32)>,
    /// The filling that is looked at, and the best one so far.
    now: Candidate,
    best: Candidate,
    slots: Vec<u32>,
    /// The removals so far: each with the star in `inserted` and the filling in `removed`.
    sequence: Sequence,
}

/// A filling and its cost.
#[derive(Default)]
struct Candidate {
    filling: Filling,
    cost: FillCost,
    error: f64,
}

impl<'a> Decimator<'a> {
    fn new(
        mesh: WorkMesh,
        quantized: &'a Quantized,
        displacement_per_error: f64,
        frozen: Vec<bool>,
        gift_wrap: Option<GiftWrap>,
    ) -> Self {
        let points = quantized.positions.len();
        let step = DVec3::from_array(quantized.lattice.step);
        let scaled = |q: &[i32; 3]| DVec3::from_array(q.map(f64::from)) * step;
        let places: Vec<DVec3> = quantized.positions.iter().map(scaled).collect();
        let skin = Skin::new(&mesh.tets, &mesh.neighbors, &places);
        let mut degrees = vec![0; points];
        mesh.tets.iter().flatten().for_each(|&v| degrees[v as usize] += 1);
        Self {
            gradients: quantized.gradients(&mesh.tets),
            reference: Reference { quantized, points: points as u32, skin, displacement_per_error },
            frozen,
            gift_wrap,
            buckets: Buckets::new(mesh.tets.len(), points),
            marks: VertexMarks::new(points),
            past: Past::new(mesh.tets.len()),
            versions: vec![0; points],
            seen: vec![u32::MAX; points],
            degrees,
            agenda: Agenda::default(),
            entries: vec![None; points],
            hole: Hole::default(),
            star: Vec::new(),
            ends: Vec::new(),
            now: Candidate::default(),
            best: Candidate::default(),
            slots: Vec::new(),
            sequence: Sequence::default(),
            mesh,
        }
    }

    fn remove_all(&mut self, progress: OnProgress<'_>) -> Result<(), BuildError> {
        for v in 0..self.reference.points {
            if self.mesh.has(v) && !self.frozen[v as usize] {
                self.push(self.guess(v, 0));
            }
        }
        let mut steps = 0_u64;
        loop {
            steps += 1;
            if steps.is_multiple_of(1024) {
                let done = self.sequence.steps.len() as u64;
                let total = u64::from(self.reference.points);
                if progress(BuildProgress { stage: "remove", done, total }).is_break() {
                    return Err(BuildError::Stopped);
                }
            }
            match self.agenda.pop() {
                Some(key) => self.try_remove(key),
                None if self.agenda.next_level() => {}
                None => return Ok(()),
            }
        }
    }

    /// Makes a candidate the one that counts for its vertex.
    fn push(&mut self, key: Key) {
        self.entries[key.a as usize] = Some(key);
        self.agenda.push(key);
    }

    /// A key to be looked at soon: the error may be that of the level that is worked on.
    fn guess(&self, a: u32, height: u32) -> Key {
        let second = height + self.degrees[a as usize];
        Key::new(self.agenda.level().max(LEVELS.of(0.0)), second, 0.0, a, NONE)
    }

    /// Looks at a candidate. What cannot be removed is left alone until its neighbourhood changes.
    fn try_remove(&mut self, key: Key) {
        let a = key.a;
        if self.entries[a as usize] != Some(key) {
            return;
        }
        self.entries[a as usize] = None;
        let version = self.versions[a as usize];
        if self.hole.open(&mut self.mesh, &self.reference.quantized.positions, a).is_err() {
            return;
        }
        if self.hole.star.len() < self.degrees[a as usize] as usize {
            // What is around it touches itself elsewhere, which only an input that overlaps itself leads to.
            return;
        }
        let legacy = self.past.legacy(&self.hole, &self.reference);
        let least = LEVELS.of(largest(&legacy.errors));
        if least > key.level() {
            self.push(Key::new(least, legacy.height, 0.0, a, NONE));
            return;
        }
        let known = self.seen[a as usize] == version && key.b != NONE;
        self.seen[a as usize] = version;
        let exact = match self.gift_wrap {
            None => self.find_end(key, &legacy, known),
            Some(_) => self.wrap(key, &legacy),
        };
        match exact {
            None => {}
            Some(exact) if exact.urgency() > key.urgency() => self.push(exact),
            Some(_) => self.perform(&legacy),
        }
    }

    /// The key of a filling of the hole: among equal errors shallow chains and few tetrahedra come first.
    fn key(&self, candidate: &Candidate, height: u32, b: u32) -> Key {
        let length = if b == NONE { 0.0 } else { self.squared_length(self.hole.a, b) };
        let second = height + candidate.filling.tets.len() as u32;
        Key::new(LEVELS.of(candidate.error), second, length, self.hole.a, b)
    }

    fn squared_length(&self, a: u32, b: u32) -> f32 {
        let [p, q] = [a, b].map(|v| self.reference.quantized.positions[v as usize]);
        (0..3).map(|i| (i64::from(p[i]) - i64::from(q[i])) as f32).map(|d| d * d).sum()
    }

    /// Finds the best edge to contract; only the one in `key` if that is `known` to be it. Its filling becomes `best`.
    fn find_end(&mut self, key: Key, legacy: &Legacy, known: bool) -> Option<Key> {
        self.ends.clear();
        if known {
            self.ends.push((0.0, key.b));
        } else {
            let ends = self
                .hole
                .link
                .iter()
                .map(|&b| (predicted(&self.reference, &self.gradients, self.hole.a, b), b));
            self.ends.extend(ends);
            self.ends.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        }
        let mut found: Option<Key> = None;
        for i in 0..self.ends.len() {
            let b = self.ends[i].1;
            let positions = &self.reference.quantized.positions;
            if !contract(&self.hole, positions, b, &mut self.now.filling)
                || self.hole.tilts_flat(&self.now.filling, positions)
            {
                continue;
            }
            if !self.reference.skin.at(b).is_empty() {
                let Self { hole, mesh, marks, star, frozen, .. } = self;
                let stays = hole.on_boundary() && frozen[b as usize];
                if stays || !keeps_topology(hole, mesh, marks, star, b) {
                    continue;
                }
            }
            let limit = LEVELS.largest(found.map_or(key.level(), |found| found.level().min(key.level())));
            let Self { hole, now, buckets, reference, .. } = self;
            now.error = now.cost.evaluate(hole, &now.filling, legacy, buckets, reference, limit);
            let exact = self.key(&self.now, legacy.height, b);
            if found.is_none_or(|found| exact < found) {
                found = Some(exact);
                std::mem::swap(&mut self.now, &mut self.best);
            }
        }
        found
    }

    /// Fills the hole by the Delaunay criterion; the filling becomes `best`.
    fn wrap(&mut self, key: Key, legacy: &Legacy) -> Option<Key> {
        let Self { hole, best, buckets, reference, gift_wrap, .. } = self;
        if !gift_wrap.as_mut()?.fill(hole, &reference.quantized.positions, &mut best.filling) {
            return None;
        }
        if hole.tilts_flat(&best.filling, &reference.quantized.positions) {
            return None;
        }
        // A removal must make the mesh smaller: a finer mesh is then a larger one, which budgets rely on.
        if best.filling.tets.len() >= hole.star.len() {
            return None;
        }
        let limit = LEVELS.largest(key.level());
        best.error = best.cost.evaluate(hole, &best.filling, legacy, buckets, reference, limit);
        Some(self.key(&self.best, legacy.height, NONE))
    }

    fn perform(&mut self, legacy: &Legacy) {
        // Never zero: error 0 is to mean the reference mesh, with every vertex in.
        let stored = |error: &f64| ErrorCode::at_least(*error).max(ErrorCode(1)).error();
        let errors: Vec<f64> = self.best.cost.errors.iter().map(stored).collect();
        let Self { mesh, hole, best, slots, past, sequence, .. } = self;
        let start = sequence.tets.len();
        sequence.tets.extend(hole.star.iter().map(|s| mesh.tets[s.tet as usize]));
        let middle = sequence.tets.len();
        sequence.tets.extend_from_slice(&best.filling.tets);
        let end = sequence.tets.len();
        let step = best.cost.step;
        let removal = sequence.steps.len() as u32;
        sequence.steps.push(Insertion {
            vertex: hole.a,
            removed: middle..end,
            inserted: start..middle,
            errors: errors.clone(),
            step,
        });
        hole.replace(mesh, &best.filling, slots);
        past.errors.extend(errors);
        past.heights.push(legacy.height);
        past.makers.resize(mesh.tets.len(), NONE);
        slots.iter().for_each(|&t| past.makers[t as usize] = removal);
        best.cost.settle(hole, &best.filling, &mut self.buckets, &self.reference, slots);
        let stars = &sequence.tets[start..middle];
        stars.iter().flatten().for_each(|&v| self.degrees[v as usize] -= 1);
        best.filling.tets.iter().flatten().for_each(|&v| self.degrees[v as usize] += 1);
        self.look_again_around(legacy.height);
    }

    /// The neighbours have other stars now, and may have become cheaper.
    fn look_again_around(&mut self, height: u32) {
        for i in 0..self.hole.link.len() {
            let v = self.hole.link[i];
            self.versions[v as usize] = self.versions[v as usize].wrapping_add(1);
            let key = self.guess(v, height + 1);
            if !self.frozen[v as usize] && self.entries[v as usize].is_none_or(|entry| key < entry) {
                self.push(key);
            }
        }
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

#[cfg(test)]
mod tests;

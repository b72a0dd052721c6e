//! Edge-based MTs by collapses: choose an edge, check it, collapse it, record it.

pub(crate) mod history;

use crate::change::collapse_check::{CheckedCollapse, Refusal, VertexMarks};
use crate::change::work_mesh::WorkMesh;
use crate::collapse::history::Collapse;
use crate::decimate::candidate_queue::{CandidateQueue, Key, Levels};
use crate::error::buckets::Buckets;
use crate::error::cost::{Evaluator, Input, VertexData, largest};
use crate::error::points::squared_length;
use crate::error::reference::Reference;
use crate::geometry::dihedral::LeastAngle;
use crate::geometry::flat::Feature;
use crate::lattice::field_selection;
use crate::lattice::quantize;
use crate::restrict::preserve::kept_points;
use crate::restrict::restrictions::cannot_preserve;
use crate::{BuildConfig, BuildError, BuildProgress, BuildResult, BuildSummary, Method, OnProgress};
use tetralod::geom::Bounds;
use tetralod::mesh;
use tetralod::mesh::{EDGES, TetMesh, Topology};
use tetralod::mt::{EdgeMt, ErrorCode, MAX_UPDATES, MtInfo, MultiTessellation};

/// Builds an edge-based MT of `mesh`, which must be valid: see [`tetralod::mesh::repair`].
///
/// Works on one thread and calls `progress` now and then.
///
/// # Errors
/// If the mesh is not valid, lacks a configured field, or does not fit the lattice; if an option is out of its range;
/// if `progress` stops the work.
pub fn edge_mt(
    mesh: &TetMesh,
    config: &BuildConfig,
    progress: OnProgress<'_>,
) -> Result<BuildResult<EdgeMt>, BuildError> {
    if mesh.positions.len() > MAX_UPDATES as usize {
        return Err(BuildError::TooLarge);
    }
    if mesh.tets.is_empty() {
        return Err(BuildError::Empty);
    }
    mesh::check(mesh)?;
    if !config.preserve.is_empty() {
        return Err(cannot_preserve(format!("method {}", Method::Collapse.name())));
    }
    let Topology { neighbors, non_manifold: mut frozen, .. } =
        mesh::topology(mesh.positions.len(), &mesh.tets)?;
    let quantized = quantize::quantize_cells(mesh, config)?;
    frozen.iter_mut().zip(kept_points(config, mesh)?).for_each(|(frozen, kept)| *frozen |= kept);
    let diagonal = Bounds::of(&mesh.positions).diagonal();
    let info = quantized.info(mesh.tets.len() as u64, config.displacement * diagonal);
    let work = WorkMesh::new(mesh.tets.clone(), neighbors, mesh.positions.len());
    let reference = Reference::new(&quantized, &work, info.displacement_per_error, config.displacement_edges);
    let mut builder = Builder::new(work, reference, &info, frozen);
    builder.collapse.feature = Feature::of(config)?;
    builder.collapse.angle = LeastAngle::of(config, &quantized)?;
    builder.collapse_all(progress)?;
    let Builder { mesh: base, data, history, .. } = builder;
    let depth = data.height.iter().copied().max().unwrap_or(0);
    let (mt, vertices) = history::edge_mt(info, &base, &data, &history, config.block_bits, progress)?;
    let summary = BuildSummary::of(mt.info(), mt.base(), depth);
    let exact = field_selection::exact_values(mesh, config, &vertices)?;
    Ok(BuildResult { mt, summary, vertices, exact })
}

/// The levels of error.
const LEVELS: Levels = Levels::HALVES;

struct Builder<'a> {
    mesh: WorkMesh,
    data: VertexData,
    /// Average gradient of each field at each vertex, in levels per lattice step.
    gradients: Vec<glam::DVec3>,
    reference: Reference<'a>,
    frozen: Vec<bool>,
    buckets: Buckets<'a>,
    marks: VertexMarks,
    /// Counts the changes around each vertex.
    versions: Vec<u32>,
    queue: CandidateQueue,
    /// Edges that could not be collapsed, with the sum of their ends' versions then.
    blocked: Vec<(u32, u32, u32)>,
    collapse: CheckedCollapse,
    evaluator: Evaluator,
    history: Vec<Collapse>,
    /// Tetrahedra around each vertex.
    degrees: Vec<u32>,
    /// The rounding errors of the lattices.
    floors: Vec<f64>,
}

impl<'a> Builder<'a> {
    fn new(mesh: WorkMesh, reference: Reference<'a>, info: &MtInfo, frozen: Vec<bool>) -> Self {
        let quantized = reference.quantized;
        let points = quantized.positions.len();
        let foot = |v: u32| reference.boundary.at(v).first().copied().unwrap_or(tetralod::mesh::NONE);
        let data = VertexData {
            positions: quantized.positions.to_vec(),
            levels: quantized.levels.clone(),
            errors: vec![0.0; points * quantized.fields.len()],
            height: vec![0; points],
            foot: (0..points as u32).map(foot).collect(),
        };
        Self {
            gradients: quantized.gradients(&mesh.tets),
            buckets: Buckets::new(mesh.tets.len(), quantized),
            marks: VertexMarks::new(points),
            versions: vec![0; points],
            degrees: mesh.degrees(),
            mesh,
            data,
            reference,
            frozen,
            queue: CandidateQueue::default(),
            blocked: Vec::new(),
            collapse: CheckedCollapse::default(),
            evaluator: Evaluator::default(),
            history: Vec::new(),
            floors: quantize::floors(info),
        }
    }

    fn collapse_all(&mut self, progress: OnProgress<'_>) -> Result<(), BuildError> {
        self.push_all_edges();
        let mut steps = 0_u64;
        loop {
            steps += 1;
            if steps.is_multiple_of(1024) {
                let done = self.history.len() as u64;
                let total = u64::from(self.reference.points);
                let tetrahedra = Some(self.mesh.live());
                BuildProgress { stage: "collapse", done, total, tetrahedra }.tell(progress)?;
            }
            let Some(key) = self.queue.pop() else {
                if self.next_level() {
                    continue;
                }
                return Ok(());
            };
            self.try_collapse(key);
        }
    }

    fn push_all_edges(&mut self) {
        let mut edges: Vec<(u32, u32)> = Vec::with_capacity(self.mesh.tets.len() * 6);
        for tet in &self.mesh.tets {
            edges.extend(EDGES.map(|[i, j]| (tet[i].min(tet[j]), tet[i].max(tet[j]))));
        }
        edges.sort_unstable();
        edges.dedup();
        for (a, b) in edges {
            self.queue.push(self.predicted_key(a, b));
        }
    }

    /// Moves to the next level that has candidates, and retries blocked edges. False if no candidates are left.
    fn next_level(&mut self) -> bool {
        let more = self.queue.next_level();
        self.retry_blocked() || more
    }

    /// Requeues the blocked edges whose neighbourhood has changed. Returns whether there were any.
    fn retry_blocked(&mut self) -> bool {
        let mut still = std::mem::take(&mut self.blocked);
        let before = still.len();
        still.retain(|&(a, b, versions)| {
            if !self.mesh.has(a) || !self.mesh.has(b) {
                return false;
            }
            if self.edge_version(a, b) == versions {
                return true;
            }
            let key = self.predicted_key(a, b).no_earlier_than(self.queue.level());
            self.queue.push(key);
            false
        });
        self.blocked = still;
        self.blocked.len() < before
    }

    fn edge_version(&self, a: u32, b: u32) -> u32 {
        self.versions[a as usize].wrapping_add(self.versions[b as usize])
    }

    fn key(&self, error: f64, height: u32, star: u32, a: u32, b: u32) -> Key {
        let (p, q) = (self.data.positions[a as usize], self.data.positions[b as usize]);
        Key::new(LEVELS.of(error), height + star, squared_length(p, q), a, b)
    }

    /// A predicted key: from second differences of the fields, and from the errors and depths of the ends.
    fn predicted_key(&self, a: u32, b: u32) -> Key {
        let fields = &self.reference.quantized.fields;
        let (i, j) = (a as usize, b as usize);
        let [p, q] = [i, j].map(|v| glam::DVec3::from_array(self.data.positions[v].map(f64::from)));
        let errors = |v: usize| largest(&self.data.errors[v * fields.len()..][..fields.len()]);
        let mut error = errors(i).max(errors(j));
        for (f, field) in fields.iter().enumerate() {
            let [u, v] = [i, j].map(|v| v * fields.len() + f);
            let rise = f64::from(self.data.levels[v] - self.data.levels[u]);
            let bend =
                [u, v].map(|w| (rise - self.gradients[w].dot(q - p)).abs()).into_iter().fold(0.0, f64::max);
            error = error.max(0.5 * bend * field.step / field.range());
        }
        // About six tetrahedra around the edge are in both stars and are removed.
        let star = (self.degrees[i] + self.degrees[j]).saturating_sub(12);
        self.key(error, self.data.height[i].max(self.data.height[j]) + 1, star, a, b)
    }

    fn try_collapse(&mut self, key: Key) {
        let Key { a, b, .. } = key;
        match self.collapse.make(&self.mesh, &mut self.marks, &self.data.positions, &self.frozen, a, b) {
            Ok(()) => {}
            Err(Refusal::Blocked) => {
                self.blocked.push((a, b, self.edge_version(a, b)));
                return;
            }
            Err(Refusal::Gone | Refusal::Never) => return,
        }
        let Self { collapse, mesh, data, buckets, reference, evaluator, .. } = self;
        let limit = LEVELS.largest(key.level());
        let error = evaluator.evaluate(buckets, limit, Input { collapse, mesh, data, reference });
        let exact = self.key(error, self.evaluator.height, self.collapse.stay.len() as u32, a, b);
        if exact.urgency() > key.urgency() {
            self.queue.push(exact);
            return;
        }
        self.perform();
    }

    fn perform(&mut self) {
        // Never zero: error 0 is to mean the reference mesh, with every update applied.
        let stored = |error: &f64, floor: &f64| ErrorCode::at_least(error.max(*floor)).max(ErrorCode(1));
        let errors = self.evaluator.placement.errors.iter().zip(&self.floors);
        let errors: Vec<ErrorCode> = errors.map(|(error, floor)| stored(error, floor)).collect();
        let code = errors.iter().copied().fold(ErrorCode::ZERO, ErrorCode::max);
        let v = self.data.positions.len() as u32;
        let Self { collapse, mesh, data, evaluator, .. } = self;
        self.history.push(Collapse::new(collapse, mesh, code, evaluator.steps));
        data.positions.push(collapse.position);
        data.levels.extend_from_slice(&evaluator.star.levels);
        data.errors.extend(errors.iter().map(|code| code.error()));
        data.height.push(evaluator.height);
        data.foot.push(evaluator.foot);
        let input = Input { collapse, mesh, data, reference: &self.reference };
        evaluator.move_points(&mut self.buckets, input);
        for f in 0..evaluator.star.levels.len() {
            let fields = evaluator.star.levels.len();
            let [g, h] = [collapse.a, collapse.b].map(|w| self.gradients[w as usize * fields + f]);
            self.gradients.push((g + h) * 0.5);
        }
        self.degrees.push(collapse.stay.len() as u32);
        for &(tet, i, j) in &collapse.fan {
            mesh.tets[tet as usize].iter().for_each(|&v| self.degrees[v as usize] -= 1);
            mesh.close(tet, i as usize, j as usize);
        }
        let mut first = tetralod::mesh::NONE;
        for (s, _) in &collapse.stay {
            mesh.tets[s.tet as usize][s.corner as usize] = v;
            first = s.tet;
        }
        mesh.incident.push(first);
        mesh.incident[collapse.a as usize] = tetralod::mesh::NONE;
        mesh.incident[collapse.b as usize] = tetralod::mesh::NONE;
        self.marks.push();
        self.versions.push(0);
        for i in 0..self.collapse.link.len() {
            let x = self.collapse.link[i];
            self.versions[x as usize] = self.versions[x as usize].wrapping_add(1);
            let key = self.predicted_key(x, v);
            self.queue.push(key);
        }
    }
}

//! From recorded collapses to the updates of an MT.

use super::BuildError;
use super::BuildProgress;
use super::OnProgress;
use super::cost::VertexData;
use super::plan::Plan;
use super::work_mesh::WorkMesh;
use crate::mesh::NONE;
use crate::mt::Applied;
use crate::mt::BaseMesh;
use crate::mt::CurrentMesh;
use crate::mt::EdgeMt;
use crate::mt::ErrorCode;
use crate::mt::MtInfo;
use crate::mt::MultiTessellation;
use crate::mt::UpdateError;
use crate::mt::VertexId;
use crate::mt::VertexSplit;
use std::cmp::Reverse;

/// One collapse in the builder's own numbers: the `i`-th one makes vertex `points + i`.
pub(super) struct Collapse {
    ends: [u32; 2],
    /// Sides of the star in ascending order of the builder's sorted numbers of the opposite faces.
    sides: u64,
    /// The largest one of all fields.
    error: ErrorCode,
}

impl Collapse {
    /// Records a plan that is about to be carried out in `mesh`.
    pub fn new(plan: &Plan, mesh: &WorkMesh, error: ErrorCode) -> Self {
        let mut star: Vec<([u32; 3], u8)> = Vec::with_capacity(plan.stay.len());
        for &(s, side) in &plan.stay {
            let tet = mesh.tets[s.tet as usize];
            let [i, j, k] = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]][s.corner as usize];
            let mut face = [tet[i], tet[j], tet[k]];
            face.sort_unstable();
            star.push((face, side));
        }
        star.sort_unstable();
        let sides = star.iter().enumerate().fold(0, |bits, (i, &(_, side))| bits | u64::from(side) << i);
        Self { ends: [plan.a, plan.b], sides, error }
    }
}

/// The MT of a history. Updates come in the order of falling error, as far as equal errors leave it open in the
/// order of the collapses reversed: errors are monotone, so this extends the partial order, and a prefix of the
/// updates is the best mesh for its size.
pub(super) fn edge_mt(
    mut info: MtInfo,
    base: &WorkMesh,
    data: &VertexData,
    history: &[Collapse],
    progress: OnProgress<'_>,
) -> Result<EdgeMt, BuildError> {
    let points = info.vertices as usize;
    info.updates = history.len() as u32;
    let fields = info.fields.len();
    let (base_mesh, mut number) = number_base(base, data, fields);
    let mut order: Vec<u32> = (0..history.len() as u32).rev().collect();
    order.sort_by_key(|&i| Reverse(history[i as usize].error));

    let mut mesh = CurrentMesh::new(&info, &base_mesh)
        .map_err(|_| BuildError::Internal(UpdateError::Vertex { update: 0, vertex: 0 }))?;
    let mut mt = EdgeMt::new(info, base_mesh);
    // The builder's number of each vertex of the MT.
    let mut built: Vec<u32> = vec![0; number.len()];
    number.iter().enumerate().filter(|(_, v)| **v != NONE).for_each(|(i, &v)| built[v as usize] = i as u32);
    let mut next = mt.base().positions.len() as u32;
    let mut field_offsets = vec![0; fields];
    let mut errors = vec![ErrorCode::ZERO; fields];
    for (done, &i) in order.iter().enumerate() {
        if done % 4096 == 0 {
            let step = BuildProgress { stage: "order", done: done as u64, total: history.len() as u64 };
            if progress(step).is_break() {
                return Err(BuildError::Stopped);
            }
        }
        let Collapse { ends: [a, b], sides, .. } = history[i as usize];
        let vertex = number[points + i as usize];
        for end in [a, b] {
            number[end as usize] = next;
            if built.len() <= next as usize {
                built.resize(next as usize + 1, 0);
            }
            built[next as usize] = end;
            next += 1;
        }
        let stored = &data.errors[(points + i as usize) * fields..][..fields];
        errors.iter_mut().zip(stored).for_each(|(code, &error)| *code = ErrorCode::at_least(error));
        for (f, offset) in field_offsets.iter_mut().enumerate() {
            *offset = data.levels[a as usize * fields + f] - data.levels[b as usize * fields + f];
        }
        let offset = [0, 1, 2].map(|k| data.positions[a as usize][k] - data.positions[b as usize][k]);
        let mask = mesh
            .reorder_mask(VertexId(vertex), sides, |v| built[v.0 as usize])
            .ok_or(BuildError::Internal(UpdateError::Mask { update: done as u32 }))?;
        let split = VertexSplit {
            vertex: VertexId(vertex),
            offset,
            field_offsets: &field_offsets,
            mask,
            errors: &errors,
        };
        let update = mt.push(&split).map_err(BuildError::Internal)?;
        mt.announce(&mut mesh, update.0);
        match mt.refine(&mut mesh, update).map_err(BuildError::Internal)? {
            // Nobody asks what was touched.
            Applied::Done => mesh.clear_touched(),
            Applied::Blocked(_) => return Err(BuildError::Internal(UpdateError::Error { update: update.0 })),
        }
    }
    Ok(mt)
}

/// The base mesh, and the MT's number for each of the builder's vertices ([`NONE`] while it has none).
fn number_base(base: &WorkMesh, data: &VertexData, fields: usize) -> (BaseMesh, Vec<u32>) {
    let mut number = vec![NONE; data.positions.len()];
    let mut mesh = BaseMesh::default();
    for v in (0..data.positions.len() as u32).filter(|&v| base.has(v)) {
        number[v as usize] = mesh.positions.len() as u32;
        mesh.positions.push(data.positions[v as usize]);
        mesh.values.extend_from_slice(&data.levels[v as usize * fields..][..fields]);
    }
    for t in (0..base.tets.len() as u32).filter(|&t| base.is_live(t)) {
        mesh.tets.push(base.tets[t as usize].map(|v| number[v as usize]));
    }
    (mesh, number)
}

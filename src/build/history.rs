//! From recorded collapses to the updates of an MT.

use super::BuildError;
use super::BuildProgress;
use super::OnProgress;
use super::base::Numbered;
use super::base::number_base;
use super::cost::VertexData;
use super::order::Updates;
use super::plan::Plan;
use super::work_mesh::WorkMesh;
use crate::mesh::NONE;
use crate::mt::Applied;
use crate::mt::CurrentMesh;
use crate::mt::EdgeMt;
use crate::mt::ErrorCode;
use crate::mt::MtInfo;
use crate::mt::MultiTessellation;
use crate::mt::UpdateError;
use crate::mt::UpdateId;
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

/// The MT of a history, with its updates in the order that [`Updates::order`] gives them, and its vertex for each reference
/// point. Blocks have `2^block_bits` updates, 4 to 16 bits.
pub(super) fn edge_mt(
    mut info: MtInfo,
    base: &WorkMesh,
    data: &VertexData,
    history: &[Collapse],
    block_bits: u32,
    progress: OnProgress<'_>,
) -> Result<(EdgeMt, Vec<VertexId>), BuildError> {
    info.updates = history.len() as u32;
    // Errors are monotone, so this extends the partial order, as far as equal errors leave it open by the collapses
    // reversed.
    let mut falling: Vec<u32> = (0..history.len() as u32).rev().collect();
    falling.sort_by_key(|&i| Reverse(history[i as usize].error));
    let replay = Replay { base, data, history };
    let bits = info.lattice.bits;
    let mut found = Found::default();
    let (first, _) = replay.make(info.clone(), &falling, Some(&mut found), progress)?;
    let updates = Updates {
        base: first.base().positions.len() as u32,
        vertices: &found.vertices,
        starts: &found.starts,
        parents: &found.parents,
        sites: &found.sites,
        bits,
        created: 2,
    };
    let order: Vec<u32> =
        updates.order(block_bits.clamp(4, 16)).into_iter().map(|u| falling[u as usize]).collect();
    drop(first);
    replay.make(info, &order, None, progress)
}

/// What a first replay of a history finds out for [`Updates`].
#[derive(Default)]
struct Found {
    vertices: Vec<u32>,
    starts: Vec<u32>,
    parents: Vec<u32>,
    sites: Vec<[i32; 3]>,
}

impl Found {
    /// Takes note of an update that is about to be applied.
    fn note(&mut self, mt: &EdgeMt, mesh: &mut CurrentMesh, u: UpdateId) -> Result<(), UpdateError> {
        let vertex = mt.split(u).vertex;
        let mut star = Vec::new();
        mt.find_removed(mesh, u, &mut star)?;
        let corners = star.iter().filter_map(|&t| mesh.tet(t)).flatten();
        let mut parents: Vec<u32> =
            corners.filter_map(|slot| mt.created_by(mesh.vertex(slot))).map(|p| p.0).collect();
        parents.sort_unstable();
        parents.dedup();
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        self.parents.extend_from_slice(&parents);
        self.starts.push(self.parents.len() as u32);
        self.vertices.push(vertex.0);
        self.sites.push(mesh.slot(vertex).map_or([0; 3], |slot| mesh.positions()[slot as usize]));
        Ok(())
    }
}

/// Collapses that are to become updates.
struct Replay<'a> {
    base: &'a WorkMesh,
    data: &'a VertexData,
    history: &'a [Collapse],
}

impl Replay<'_> {
    /// The MT whose updates are the collapses in this order, which extends the partial order.
    fn make(
        &self,
        info: MtInfo,
        order: &[u32],
        mut found: Option<&mut Found>,
        progress: OnProgress<'_>,
    ) -> Result<(EdgeMt, Vec<VertexId>), BuildError> {
        let (data, history) = (self.data, self.history);
        let (points, fields) = (info.vertices as usize, info.fields.len());
        let live = (0..self.base.tets.len() as u32).filter(|&t| self.base.is_live(t));
        let tets: Vec<[u32; 4]> = live.map(|t| self.base.tets[t as usize]).collect();
        let Numbered { mesh: base_mesh, mut number, .. } =
            number_base(&data.positions, &data.levels, fields, &tets);
        let mut mesh = CurrentMesh::new(&info, &base_mesh)
            .map_err(|_| BuildError::Internal(UpdateError::Vertex { update: 0, vertex: 0 }))?;
        let mut mt = EdgeMt::new(info, base_mesh);
        // The builder's number of each vertex of the MT.
        let mut built: Vec<u32> = vec![0; number.len()];
        number
            .iter()
            .enumerate()
            .filter(|(_, v)| **v != NONE)
            .for_each(|(i, &v)| built[v as usize] = i as u32);
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
            let Collapse { ends: [mut a, mut b], sides, .. } = history[i as usize];
            let vertex = number[points + i as usize];
            // Which end is which is free: the offset begins with a positive number, so files need not tell its sign.
            let difference = |a: u32, b: u32| {
                [0, 1, 2].map(|k| data.positions[a as usize][k] - data.positions[b as usize][k])
            };
            let is_turned = difference(a, b).into_iter().find(|&d| d != 0).is_some_and(|d| d < 0);
            if is_turned {
                (a, b) = (b, a);
            }
            for end in [a, b] {
                number[end as usize] = next;
                if built.len() <= next as usize {
                    built.resize(next as usize + 1, 0);
                }
                built[next as usize] = end;
                next += 1;
            }
            let stored = &data.errors[(points + i as usize) * fields..][..fields];
            errors
                .iter_mut()
                .zip(stored)
                .for_each(|(code, &error)| *code = ErrorCode::at_least(error).coarse());
            for (f, offset) in field_offsets.iter_mut().enumerate() {
                *offset = data.levels[a as usize * fields + f] - data.levels[b as usize * fields + f];
            }
            let mask = mesh
                .reorder_mask(VertexId(vertex), sides, is_turned, |v| built[v.0 as usize])
                .ok_or(BuildError::Internal(UpdateError::Mask { update: done as u32 }))?;
            let split = VertexSplit {
                vertex: VertexId(vertex),
                offset: difference(a, b),
                edge: 0,
                field_offsets: &field_offsets,
                mask,
                errors: &errors,
            };
            let update = mt.push(&split).map_err(BuildError::Internal)?;
            mt.announce(&mut mesh, update.0);
            if let Some(found) = &mut found {
                found.note(&mt, &mut mesh, update).map_err(BuildError::Internal)?;
            }
            match mt.refine(&mut mesh, update).map_err(BuildError::Internal)? {
                // Nobody asks what was touched.
                Applied::Done => mesh.clear_touched(),
                Applied::Blocked(_) => {
                    return Err(BuildError::Internal(UpdateError::Error { update: update.0 }));
                }
            }
        }
        number.truncate(points);
        Ok((mt, number.into_iter().map(VertexId).collect()))
    }
}

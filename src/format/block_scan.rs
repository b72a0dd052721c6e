//! A run through an MT from the base to the reference mesh, for what its file says of each block.

use super::payload::index::BlockInfo;
use super::{EncodeError, EncodeOptions};
use crate::mt::{
    Applied, ApplyUpdates, CurrentMesh, EdgeMt, Excess, HalfEdgeMt, Margins, Mt, MtRef, UpdateError, UpdateId,
};
use std::collections::BTreeSet;

/// What a run through an MT has found.
pub struct BlockScan {
    /// The blocks of `2^block_bits` updates; their lengths are not known yet.
    pub blocks: Vec<BlockInfo>,
    /// The MT in the form that files have, if it was not in that form.
    pub coded: Option<Mt>,
    /// For each vertex of the reference mesh, ascending, its number and its levels.
    pub reference: Vec<(u32, Vec<i32>)>,
}

impl BlockScan {
    pub fn of(mt: MtRef<'_>, options: &EncodeOptions) -> Result<Self, EncodeError> {
        match mt {
            MtRef::Edge(mt) => scan_edge(mt, options),
            MtRef::Vertex(mt) => run(mt, options, &mut |_, _| Ok(())),
            MtRef::HalfEdge(mt) => scan_half_edge(mt, options),
            MtRef::Explicit(mt) => run(mt, options, &mut |_, _| Ok(())),
        }
    }
}

fn scan_edge(mt: &EdgeMt, options: &EncodeOptions) -> Result<BlockScan, EncodeError> {
    if mt.is_coded() {
        return run(mt, options, &mut |_, _| Ok(()));
    }
    let mut coded = EdgeMt::coded(mt.info().clone(), mt.base().clone(), options.block_bits);
    let mut residuals = Vec::new();
    let scan =
        run(mt, options, &mut |mesh, u| coded.push(&mt.to_residuals(mesh, u, &mut residuals)?).map(drop))?;
    Ok(BlockScan { coded: Some(coded.into()), ..scan })
}

/// Blocks are pages without lists of those on which they depend: each can be used without.
fn scan_half_edge(mt: &HalfEdgeMt, options: &EncodeOptions) -> Result<BlockScan, EncodeError> {
    let bits = options.block_bits;
    let coded = (mt.page_bits() != bits).then(|| mt.in_pages(bits));
    let coded = coded.transpose().map_err(EncodeError::Update)?.map(Mt::from);
    let mut scan = run(mt, options, &mut |_, _| Ok(()))?;
    scan.blocks.iter_mut().for_each(|block| block.parents.clear());
    Ok(BlockScan { coded, ..scan })
}

/// Called before each update with the mesh that has all of its parents.
type Before<'a> = &'a mut dyn FnMut(&mut CurrentMesh, UpdateId) -> Result<(), UpdateError>;

fn run(
    mt: &impl ApplyUpdates,
    options: &EncodeOptions,
    before: Before<'_>,
) -> Result<BlockScan, EncodeError> {
    let mut mesh = mt.start().map_err(EncodeError::Base)?;
    mt.updates_arrived(&mut mesh, 0);
    let mut margins = Margins::new(mt.info());
    let mut blocks = Vec::new();
    let mut first = 0;
    while first < mt.updates() {
        let end = mt.updates().min(first + (1 << options.block_bits));
        blocks.push(scan_block(mt, &mut mesh, first..end, options, &mut margins, before)?);
        first = end;
    }
    mesh.compact();
    let slots = 0..mesh.positions().len() as u32;
    let mut reference: Vec<(u32, Vec<i32>)> =
        slots.map(|slot| (mesh.vertex(slot).0, mesh.levels(slot).to_vec())).collect();
    reference.sort_unstable();
    Ok(BlockScan { blocks, coded: None, reference })
}

fn scan_block(
    mt: &impl ApplyUpdates,
    mesh: &mut CurrentMesh,
    updates: std::ops::Range<u32>,
    options: &EncodeOptions,
    margins: &mut Margins,
    before: Before<'_>,
) -> Result<BlockInfo, EncodeError> {
    let fields = mt.info().fields.len();
    let mut block = BlockInfo {
        bounds: [[i32::MAX; 3], [i32::MIN; 3]],
        errors: vec![crate::mt::ErrorCode::ZERO; fields],
        ranges: vec![[i32::MAX, i32::MIN]; fields],
        ..BlockInfo::default()
    };
    let own = updates.start >> options.block_bits;
    let mut parents = BTreeSet::new();
    let mut tets = Vec::new();
    for u in updates.map(UpdateId) {
        before(mesh, u).map_err(EncodeError::Update)?;
        for (f, error) in block.errors.iter_mut().enumerate() {
            *error = (*error).max(mt.error_of_field(u, f));
        }
        tets.clear();
        mt.find_removed(mesh, u, &mut tets).map_err(EncodeError::Update)?;
        if let Some(excess) = margins.check(mt, mesh, u, &tets) {
            let Excess { parent, field, larger, .. } = excess;
            if larger || options.check_margins {
                return Err(EncodeError::Order { update: u.0, parent: parent.0, field });
            }
        }
        parents.extend(tets.iter().filter_map(|&t| mt.creator(mesh, t)).map(|p| p.0 >> options.block_bits));
        widen(&mut block, mesh, &tets);
        match mt.refine(mesh, u).map_err(EncodeError::Update)? {
            Applied::Done => {}
            Applied::Blocked(_) => return Err(EncodeError::Update(UpdateError::Error { update: u.0 })),
        }
        mesh.clear_touched();
        tets.clear();
        mt.find_inserted(mesh, u, &mut tets).map_err(EncodeError::Update)?;
        widen(&mut block, mesh, &tets);
    }
    parents.remove(&own);
    block.parents = parents.into_iter().collect();
    Ok(block)
}

/// Takes tetrahedra of the mesh into the bounds of a block.
fn widen(block: &mut BlockInfo, mesh: &CurrentMesh, tets: &[u32]) {
    for v in tets.iter().filter_map(|&t| mesh.tet(t)).flatten() {
        let position = mesh.positions()[v as usize];
        let [low, high] = &mut block.bounds;
        for ((low, high), x) in low.iter_mut().zip(high).zip(position) {
            (*low, *high) = ((*low).min(x), (*high).max(x));
        }
        for (range, &level) in block.ranges.iter_mut().zip(mesh.levels(v)) {
            *range = [range[0].min(level), range[1].max(level)];
        }
    }
}

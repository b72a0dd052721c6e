//! A run through an MT from the base to the reference mesh, for what its file says of each block.

use super::payload::codec::Codec;
use super::payload::histogram::Histograms;
use super::payload::index::BlockInfo;
use super::{EncodeError, EncodeOptions};
use crate::mt::{
    ApplyUpdates, CurrentMesh, ErrorCode, Excess, Margins, MtFacts, UpdateId, apply_next, level_volumes,
};

/// What a run through an MT has found.
pub struct BlockScan {
    /// The blocks, which are the pages of the MT; their lengths are not known yet.
    pub blocks: Vec<BlockInfo>,
    /// For each vertex of the reference mesh, ascending, its number and its levels; empty if no exact values are to be written.
    pub reference: Vec<(u32, Vec<i32>)>,
    /// Of that mesh, if they are to be written.
    pub histograms: Option<Histograms>,
}

impl BlockScan {
    pub fn of(mt: &impl Codec, options: &EncodeOptions) -> Result<Self, EncodeError> {
        match mt.known_facts().filter(|_| options.exact.is_empty()) {
            Some(facts) => by_facts(mt, facts, options),
            None => run(mt, options),
        }
    }
}

/// What a run would find that was made before.
fn by_facts(mt: &impl Codec, facts: &MtFacts, options: &EncodeOptions) -> Result<BlockScan, EncodeError> {
    let excess = if options.check_margins { facts.excess } else { facts.larger };
    if let Some(excess) = excess {
        return Err(out_of_order(excess));
    }
    let fields = mt.info().fields.len();
    let block = |(block, &bounds): (usize, &[[i32; 3]; 2])| {
        let updates = mt.page_updates(block as u32);
        let largest = |f: usize| updates.clone().map(|u| mt.error_of_field(UpdateId(u), f)).max();
        BlockInfo {
            bounds,
            errors: (0..fields).map(|f| largest(f).unwrap_or(ErrorCode::ZERO)).collect(),
            ranges: facts.ranges[block * fields..][..fields].to_vec(),
            lengths: Vec::new(),
        }
    };
    Ok(BlockScan {
        blocks: facts.bounds.iter().enumerate().map(block).collect(),
        reference: Vec::new(),
        histograms: options.histograms.then(|| Histograms::of(&facts.volumes)),
    })
}

fn out_of_order(Excess { update, parent, field, .. }: Excess) -> EncodeError {
    EncodeError::Order { update: update.0, parent: parent.0, field }
}

fn run(mt: &impl ApplyUpdates, options: &EncodeOptions) -> Result<BlockScan, EncodeError> {
    let mut mesh = mt.start().map_err(EncodeError::Base)?;
    mesh.make_room(mt.info());
    mt.updates_arrived(&mut mesh, 0);
    let mut margins = Margins::new(mt.info());
    let mut blocks = Vec::new();
    for page in 0..mt.updates().div_ceil(1 << mt.page_bits()) {
        blocks.push(scan_block(mt, &mut mesh, mt.page_updates(page), options, &mut margins)?);
    }
    mesh.compact();
    let histograms = options.histograms.then(|| Histograms::of(&level_volumes(mt.info(), &mesh)));
    // For exact values alone.
    let slots = 0..if options.exact.is_empty() { 0 } else { mesh.positions().len() as u32 };
    let mut reference: Vec<(u32, Vec<i32>)> =
        slots.map(|slot| (mesh.vertex(slot).0, mesh.levels(slot).to_vec())).collect();
    reference.sort_unstable();
    Ok(BlockScan { blocks, reference, histograms })
}

fn scan_block(
    mt: &impl ApplyUpdates,
    mesh: &mut CurrentMesh,
    updates: std::ops::Range<u32>,
    options: &EncodeOptions,
    margins: &mut Margins,
) -> Result<BlockInfo, EncodeError> {
    let fields = mt.info().fields.len();
    let mut block = BlockInfo {
        bounds: [[i32::MAX; 3], [i32::MIN; 3]],
        errors: vec![ErrorCode::ZERO; fields],
        ranges: vec![[i32::MAX, i32::MIN]; fields],
        lengths: Vec::new(),
    };
    for u in updates.map(UpdateId) {
        for (f, error) in block.errors.iter_mut().enumerate() {
            *error = (*error).max(mt.error_of_field(u, f));
        }
        let removed = mt.find_removed(mesh, u).map_err(EncodeError::Update)?;
        if let Some(excess) = margins.check(mt, mesh, u, &removed)
            && (excess.larger || options.check_margins)
        {
            return Err(out_of_order(excess));
        }
        widen(&mut block, mesh, &removed);
        apply_next(mt, mesh, u).map_err(EncodeError::Update)?;
        let inserted = mt.find_inserted(mesh, u).map_err(EncodeError::Update)?;
        widen(&mut block, mesh, &inserted);
    }
    Ok(block)
}

/// Takes tetrahedra of the mesh into the bounds of a block.
fn widen(block: &mut BlockInfo, mesh: &CurrentMesh, tets: &[u32]) {
    let mut vertices: Vec<u32> = tets.iter().filter_map(|&t| mesh.tet(t)).flatten().collect();
    // Each is a corner of many.
    vertices.sort_unstable();
    vertices.dedup();
    for v in vertices {
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

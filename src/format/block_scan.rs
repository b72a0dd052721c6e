//! A run through an MT from the base to the reference mesh, for what its file says of each block.

use super::payload::codec::Codec;
use super::payload::histogram::Histograms;
use super::payload::index::BlockInfo;
use super::{EncodeError, EncodeOptions};
use crate::mt::{
    ApplyUpdates, CurrentMesh, ErrorCode, Excess, Extent, Margins, MtFacts, Reaches, UpdateId, apply_next,
    level_volumes,
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
    check_order(facts, options)?;
    Ok(BlockScan {
        blocks: blocks(mt, facts.reaches.clone()),
        reference: Vec::new(),
        histograms: options.histograms.then(|| Histograms::of(&facts.volumes)),
    })
}

/// Checks that errors fall along the partial order.
pub fn check_order(facts: &MtFacts, options: &EncodeOptions) -> Result<(), EncodeError> {
    let excess = if options.check_margins { facts.excess } else { facts.larger };
    excess.map_or(Ok(()), |excess| Err(out_of_order(excess)))
}

/// What the index says of a page, given what it reaches, and its largest errors.
pub fn block_info(Extent { bounds, ranges, regions }: Extent, errors: Vec<ErrorCode>) -> BlockInfo {
    BlockInfo { lengths: Vec::new(), bounds, errors, ranges, regions }
}

/// The largest errors of the updates of a page, field by field.
pub fn largest_errors(mt: &impl ApplyUpdates, page: u32) -> Vec<ErrorCode> {
    let largest = |f: usize| mt.page_updates(page).map(|u| mt.error_of_field(UpdateId(u), f)).max();
    (0..mt.info().fields.len()).map(|f| largest(f).unwrap_or(ErrorCode::ZERO)).collect()
}

/// What the index says of each page, given what it reaches.
fn blocks(mt: &impl ApplyUpdates, reaches: Vec<Extent>) -> Vec<BlockInfo> {
    (0..).zip(reaches).map(|(page, extent)| block_info(extent, largest_errors(mt, page))).collect()
}

fn out_of_order(Excess { update, parent, field, .. }: Excess) -> EncodeError {
    EncodeError::Order { update: update.0, parent: parent.0, field }
}

fn run(mt: &impl ApplyUpdates, options: &EncodeOptions) -> Result<BlockScan, EncodeError> {
    let mut mesh = mt.start().map_err(EncodeError::Base)?;
    mesh.make_room(mt.info());
    mt.updates_arrived(&mut mesh, 0);
    let mut margins = Margins::new(mt.info());
    let mut reaches = Reaches::new(mt.info(), mt.page_bits());
    for u in (0..mt.updates()).map(UpdateId) {
        scan(mt, &mut mesh, u, options, (&mut margins, &mut reaches))?;
    }
    mesh.compact();
    let histograms = options.histograms.then(|| Histograms::of(&level_volumes(mt.info(), &mesh)));
    // For exact values alone.
    let slots = 0..if options.exact.is_empty() { 0 } else { mesh.positions().len() as u32 };
    let mut reference: Vec<(u32, Vec<i32>)> =
        slots.map(|slot| (mesh.vertex(slot).0, mesh.levels(slot).to_vec())).collect();
    reference.sort_unstable();
    Ok(BlockScan { blocks: blocks(mt, reaches.finish()), reference, histograms })
}

/// Looks at the next update, and applies it.
fn scan(
    mt: &impl ApplyUpdates,
    mesh: &mut CurrentMesh,
    u: UpdateId,
    options: &EncodeOptions,
    (margins, reaches): (&mut Margins, &mut Reaches),
) -> Result<(), EncodeError> {
    let removed = mt.find_removed(mesh, u).map_err(EncodeError::Update)?;
    let (mut parents, mut beyond) = (Vec::new(), Vec::new());
    margins.next(mt, mesh, &removed, &mut parents, &mut beyond);
    let fault = margins.fault(u, &parents, &beyond, |u, field| mt.error_of_field(u, field));
    if let Some(excess) = fault.filter(|excess| excess.larger || options.check_margins) {
        return Err(out_of_order(excess));
    }
    let mut own = Extent::empty(mt.info().fields.len());
    widen(&mut own, mesh, &removed);
    let regions = mesh.regions_of(&removed);
    apply_next(mt, mesh, u).map_err(EncodeError::Update)?;
    let inserted = mt.find_inserted(mesh, u).map_err(EncodeError::Update)?;
    widen(&mut own, mesh, &inserted);
    reaches.push(u, own.bounds, &own.ranges, &parents);
    if mt.regions().is_some() {
        // What it inserts is in the same ones.
        reaches.push_regions(u, regions);
    }
    Ok(())
}

/// Takes tetrahedra of the mesh into an extent.
fn widen(extent: &mut Extent, mesh: &CurrentMesh, tets: &[u32]) {
    let mut vertices: Vec<u32> = tets.iter().filter_map(|&t| mesh.tet(t)).flatten().collect();
    // Each is a corner of many.
    vertices.sort_unstable();
    vertices.dedup();
    vertices.into_iter().for_each(|v| extent.add(mesh.positions()[v as usize], mesh.levels(v)));
}

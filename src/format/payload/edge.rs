//! `UPDT` of an edge-based MT: a block of vertex splits, and what they do to each field.
//!
//! Nothing here needs a mesh. Offsets, sides and levels are residuals, see [`EdgeUpdate`](crate::mt::EdgeUpdate); vertices
//! are coded as a forest: a split is listed with the split in the same block that created its
//! vertex, or else among the roots.

use super::base;
use super::changes::{FieldPart, put_changes, range_of, read_changes};
use super::codec::{Codec, Head, InOrder, Parts, Started};
use crate::format::Limits;
use crate::format::coder::{Family, Put, Source};
use crate::format::error::Result;
use crate::format::header::Kind;
use crate::format::limits::check_bytes;
use crate::mt::{
    BaseMesh, BaseMeshError, EdgeMt, EdgeUpdate, ErrorCode, MAX_EDGE, Mt, MtInfo, MtKind, MultiTessellation,
    UpdateError, UpdateId, VertexId,
};
use std::collections::BTreeMap;
use std::ops::Range;

/// Distances from the vertex of one root to that of the next.
const GAP: Family = base::LAST.numbers_after(1, 1);
/// The runs that the roots are in.
const RUN: Family = GAP.numbers_after(1, 3);
/// Which of the two vertices that a split creates are split in the same block.
const CHILDREN: Family = RUN.after(1, 4);
/// How many runs later that is, beyond the next.
const RISE: Family = CHILDREN.numbers_after(1, 3);
/// The edge of the link that an offset is counted from, by whether that one split higher is from one.
const EDGE: Family = RISE.numbers_after(3, 3);
/// Components of offsets, by the length of the same component one split higher; apart for those counted from an edge.
const OFFSET: Family = EDGE.numbers_after(68, 2);
/// One more than the last place where a guess of sides is wrong.
const LAST_WRONG: Family = OFFSET.after(1, 65);
/// Whether the guess is wrong at a place before that.
const WRONG: Family = LAST_WRONG.after(WRONG_ROWS * WRONG_COLUMNS, 2);
/// How far the upper byte of an error is below the largest of its block, by that of the split before.
const ERROR: Family = WRONG.after(16, 256);
/// What is wrong with the guess of a field's offset, by error.
pub const LEVEL: Family = ERROR.numbers_after(128, 1);

/// All families, with names for what they tell.
const PARTS: Parts = &[
    ("partial order", GAP),
    ("partial order", RUN),
    ("partial order", CHILDREN),
    ("partial order", RISE),
    ("offsets", EDGE),
    ("offsets", OFFSET),
    ("masks", LAST_WRONG),
    ("masks", WRONG),
    ("errors", ERROR),
    ("levels", LEVEL),
];

const WRONG_ROWS: u32 = 12;
const WRONG_COLUMNS: u32 = 11;

/// The context for place `place` in front of the last wrong one, `last`.
fn wrong_context(last: u32, place: u32) -> u32 {
    let row = range_of(last, &[1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 24]);
    row * WRONG_COLUMNS + range_of(place, &[0, 1, 2, 3, 4, 5, 6, 7, 11, 15])
}

impl Codec for EdgeMt {
    const KIND: MtKind = MtKind::Edge;
    const NUMBER: u8 = 0;
    const SECTION: Kind = Kind::UPDT;
    const PARTS: Parts = PARTS;

    /// A split turns one vertex into two, and vertex numbers are 32-bit words of which one means "none".
    fn check_counts(info: &MtInfo, base_vertices: u64) -> Result<(), BaseMeshError> {
        let updates = u64::from(info.updates);
        if base_vertices + updates != u64::from(info.vertices) {
            return Err(BaseMeshError::Info(
                "base vertices and updates do not add up to the reference vertices",
            ));
        }
        if base_vertices + 2 * updates >= u64::from(u32::MAX) {
            return Err(BaseMeshError::Info("more vertices than 32 bits can number"));
        }
        Ok(())
    }

    fn least_update_bytes(info: &MtInfo) -> u64 {
        38 + 6 * info.fields.len() as u64
    }

    fn put_head(&self, _: &mut impl Put) {}

    fn read_head(_: &mut Source<'_>, _: &MtInfo, _: [u32; 2], _: u32, _: &Limits) -> Result<Box<dyn Head>> {
        Ok(Box::new(Splitting))
    }

    type Writing = ();

    fn writing(&self) -> Result<(), BaseMeshError> {
        Ok(())
    }

    fn put_block(&self, out: &mut impl Put, updates: Range<u32>, _: &mut ()) -> Result<(), UpdateError> {
        put_splits(out, self, updates.clone());
        for field in 0..self.info().fields.len() {
            put_changes(out, [ERROR, LEVEL], updates.clone().map(UpdateId), |u| {
                (self.error_of_field(u, field), self.level_residuals(u).nth(field).unwrap_or(0))
            });
        }
        Ok(())
    }
}

/// Nothing stands behind the base mesh, and nothing is kept from one block to the next.
#[derive(Debug)]
struct Splitting;

impl Head for Splitting {
    fn start(self: Box<Self>, info: MtInfo, base: BaseMesh, block_bits: u32, _: bool) -> Result<Started> {
        let mut mt = EdgeMt::new(info, base);
        mt.set_page_bits(block_bits);
        Ok((mt.into(), Some(self)))
    }
}

impl InOrder for Splitting {
    fn read(&mut self, source: &mut Source<'_>, mt: &mut Mt, count: u32, limits: &Limits) -> Result<()> {
        match mt {
            Mt::Edge(mt) => read(source, mt, count, limits),
            _ => Err(source.corrupt("a section is out of place")),
        }
    }
}

/// The splits of a block without what they do to fields.
#[derive(Clone, Debug, Default)]
struct Splits {
    vertices: Vec<u32>,
    /// With the edges that they are counted from.
    offsets: Vec<Offset>,
    masks: Vec<u64>,
}

/// The vertices that splits before the block have created, and those of the base mesh.
fn vertices_before(mt: &EdgeMt, first: u32) -> u32 {
    mt.base().positions.len() as u32 + 2 * first
}

/// For each split of a block the run that it is in: within a run vertices ascend, and none is created in it.
fn runs(mt: &EdgeMt, first: u32, vertices: &[u32]) -> Vec<u32> {
    let old = vertices_before(mt, first);
    let (mut runs, mut run, mut last) = (Vec::with_capacity(vertices.len()), 0, None);
    for &v in vertices {
        let is_new_run = last.is_some_and(|last| v <= last)
            || v.checked_sub(old).is_some_and(|at| runs.get(at as usize / 2) == Some(&run));
        run += u32::from(is_new_run);
        last = Some(v);
        runs.push(run);
    }
    runs
}

/// Puts updates without what they do to fields.
fn put_splits(out: &mut impl Put, mt: &EdgeMt, updates: Range<u32>) {
    let vertices: Vec<u32> = updates.clone().map(|k| mt.split_vertex(UpdateId(k)).0).collect();
    put_vertices(out, mt, updates.start, &vertices);
    let leads = |k| {
        let (offset, edge) = offset_of(mt, UpdateId(k));
        edge != 0 || offset.into_iter().find(|&d| d != 0).is_none_or(|d| d > 0)
    };
    let all_lead = updates.clone().all(leads);
    out.bits(u32::from(all_lead), 1);
    for k in updates {
        let update = mt.update_without_levels(UpdateId(k));
        let above = mt.created_by(update.vertex).map(|u| offset_of(mt, u));
        put_offset(out, above, offset_of(mt, UpdateId(k)), all_lead);
        put_mask(out, update.wrong_sides);
    }
}

fn put_vertices(out: &mut impl Put, mt: &EdgeMt, first: u32, vertices: &[u32]) {
    let old = vertices_before(mt, first);
    let runs = runs(mt, first, vertices);
    let mut roots: Vec<(u32, u32)> = Vec::new();
    let mut run_of = BTreeMap::new();
    for (&v, &run) in vertices.iter().zip(&runs) {
        if v < old {
            roots.push((v, run));
        } else {
            run_of.insert(v, run);
        }
    }
    roots.sort_unstable();
    out.bits(roots.len() as u32, 32);
    let mut next = 0;
    for (v, run) in roots {
        out.number(GAP, 0, v - next);
        out.number(RUN, 0, run);
        next = v + 1;
    }
    for (at, &run) in (0..).zip(&runs) {
        let children = [0, 1].map(|half| run_of.get(&(old + 2 * at + half)));
        let mask = u32::from(children[0].is_some()) | u32::from(children[1].is_some()) << 1;
        out.symbol(CHILDREN, 0, mask);
        for child in children.into_iter().flatten() {
            out.number(RISE, 0, child - run - 1);
        }
    }
}

/// An offset, and the edge of the link that it is counted from.
type Offset = ([i32; 3], u8);

fn offset_of(mt: &EdgeMt, u: UpdateId) -> Offset {
    let update = mt.update_without_levels(u);
    (update.offset_residual, update.edge)
}

/// The context of the edge of an offset, by that of the split above.
fn edge_context(above: Option<Offset>) -> u32 {
    above.map_or(2, |(_, edge)| u32::from(edge != 0))
}

/// The context of one component of an offset that is counted from `edge`, by that of the split above.
fn offset_context(above: Option<Offset>, edge: u8, axis: usize) -> u32 {
    let length = above.map_or(33, |(offset, _)| u32::BITS - offset[axis].unsigned_abs().leading_zeros());
    length + if edge == 0 { 0 } else { 34 }
}

fn put_offset(out: &mut impl Put, above: Option<Offset>, (offset, edge): Offset, leads: bool) {
    out.number(EDGE, edge_context(above), u32::from(edge));
    let mut has_sign = !leads || edge != 0;
    for (axis, d) in offset.into_iter().enumerate() {
        out.number(OFFSET, offset_context(above, edge, axis), d.unsigned_abs());
        if d != 0 && has_sign {
            out.bits(u32::from(d < 0), 1);
        }
        has_sign |= d != 0;
    }
}

fn put_mask(out: &mut impl Put, mask: u64) {
    let last = u64::BITS - mask.leading_zeros();
    out.symbol(LAST_WRONG, 0, last);
    for place in 0..last.saturating_sub(1) {
        out.symbol(WRONG, wrong_context(last, place), (mask >> place & 1) as u32);
    }
}

/// Reads the next `count` updates into the MT.
fn read(source: &mut Source<'_>, mt: &mut EdgeMt, count: u32, limits: &Limits) -> Result<()> {
    let fields = mt.info().fields.len();
    check_bytes(mt.bytes() + u64::from(count) * EdgeMt::least_update_bytes(mt.info()), limits)?;
    let splits = read_splits(source, mt, count)?;
    let changes: Vec<FieldPart> =
        (0..fields).map(|_| read_changes(source, [ERROR, LEVEL], count)).collect::<Result<_, _>>()?;
    for k in 0..count as usize {
        let level_residuals: Vec<i32> = changes.iter().map(|field| field.residuals[k]).collect();
        let errors: Vec<ErrorCode> = changes.iter().map(|field| field.errors[k]).collect();
        let (offset_residual, edge) = splits.offsets[k];
        mt.push(&EdgeUpdate {
            vertex: VertexId(splits.vertices[k]),
            offset_residual,
            edge,
            level_residuals: level_residuals.into(),
            wrong_sides: splits.masks[k],
            errors: &errors,
        })?;
    }
    Ok(())
}

/// Reads updates without what they do to fields.
fn read_splits(source: &mut Source<'_>, mt: &EdgeMt, count: u32) -> Result<Splits> {
    let first = mt.updates();
    let mut splits = Splits { vertices: read_vertices(source, mt, first, count)?, ..Splits::default() };
    let leads = source.bits(1)? == 1;
    let old = vertices_before(mt, first);
    for at in 0..splits.vertices.len() {
        let v = splits.vertices[at];
        let above = match v.checked_sub(old) {
            Some(inside) => splits.offsets.get(inside as usize / 2).copied(),
            None => mt.created_by(VertexId(v)).map(|u| offset_of(mt, u)),
        };
        let offset = read_offset(source, above, leads)?;
        splits.offsets.push(offset);
        splits.masks.push(read_mask(source)?);
    }
    Ok(splits)
}

fn read_vertices(source: &mut Source<'_>, mt: &EdgeMt, first: u32, count: u32) -> Result<Vec<u32>> {
    let old = vertices_before(mt, first);
    let roots = source.bits(32)?;
    if roots > count {
        return Err(source.corrupt("a block has more roots than splits"));
    }
    // What is known to come in each run.
    let mut waiting: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    let mut next = 0_u32;
    for _ in 0..roots {
        let v = next.checked_add(source.number(GAP, 0)?).filter(|&v| v < old);
        let v = v.ok_or_else(|| source.corrupt("an update splits a vertex that is not there yet"))?;
        waiting.entry(source.number(RUN, 0)?).or_default().push(v);
        next = v + 1;
    }
    let mut vertices = Vec::new();
    while let Some((run, mut ready)) = waiting.pop_first() {
        ready.sort_unstable();
        for v in ready {
            if vertices.len() as u32 >= count {
                return Err(source.corrupt("a block has more splits than its header says"));
            }
            let created = old + 2 * vertices.len() as u32;
            vertices.push(v);
            let children = source.symbol(CHILDREN, 0)?;
            for half in (0..2).filter(|half| children >> half & 1 == 1) {
                let rise = source.number(RISE, 0)?;
                let child = run.checked_add(rise).and_then(|run| run.checked_add(1));
                let child = child.ok_or_else(|| source.corrupt("a run has too large a number"))?;
                waiting.entry(child).or_default().push(created + half);
            }
        }
    }
    if vertices.len() as u32 != count {
        return Err(source.corrupt("a block has fewer splits than its header says"));
    }
    Ok(vertices)
}

fn read_offset(source: &mut Source<'_>, above: Option<Offset>, leads: bool) -> Result<Offset> {
    let edge = u8::try_from(source.number(EDGE, edge_context(above))?).ok().filter(|&edge| edge <= MAX_EDGE);
    let edge =
        edge.ok_or_else(|| source.corrupt("an offset is counted from an edge that cannot be named"))?;
    let (mut offset, mut has_sign) = ([0; 3], !leads || edge != 0);
    for (axis, d) in offset.iter_mut().enumerate() {
        let size = source.number(OFFSET, offset_context(above, edge, axis))?;
        let size = i32::try_from(size).map_err(|_| source.corrupt("an offset has more than 32 bits"))?;
        let is_negative = size != 0 && has_sign && source.bits(1)? == 1;
        *d = if is_negative { -size } else { size };
        has_sign |= size != 0;
    }
    Ok((offset, edge))
}

fn read_mask(source: &mut Source<'_>) -> Result<u64> {
    let last = source.symbol(LAST_WRONG, 0)?;
    let mut mask = if last == 0 { 0 } else { 1 << (last - 1) };
    for place in 0..last.saturating_sub(1) {
        mask |= u64::from(source.symbol(WRONG, wrong_context(last, place))?) << place;
    }
    Ok(mask)
}

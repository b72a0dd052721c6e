//! `UPDT` of an edge-based MT: a block of vertex splits, and `FLDU`: what they do to one field.
//!
//! Nothing here needs a mesh. Offsets, sides and levels are residuals, see [`EdgeUpdate`](crate::mt::EdgeUpdate); vertices
//! are coded as a forest: a split is listed with the split in the same block that created its
//! vertex, or else among the roots.

use super::base;
use crate::format::FormatError;
use crate::format::coder::{Family, Put, Source};
use crate::mt::{
    BaseMeshError, EdgeMt, ErrorCode, MAX_EDGE, MtInfo, MultiTessellation, PageError, UpdateId, UpdatePages,
    VertexId,
};
use std::collections::BTreeMap;

/// Distances from the vertex of one root to that of the next.
pub const GAP: Family = base::LAST.numbers_after(1, 1);
/// The runs that the roots are in.
pub const RUN: Family = GAP.numbers_after(1, 3);
/// Which of the two vertices that a split creates are split in the same block.
pub const CHILDREN: Family = RUN.after(1, 4);
/// How many runs later that is, beyond the next.
pub const RISE: Family = CHILDREN.numbers_after(1, 3);
/// The edge of the link that an offset is counted from, by whether that one split higher is from one.
pub const EDGE: Family = RISE.numbers_after(3, 3);
/// Components of offsets, by the length of the same component one split higher; apart for those counted from an edge.
pub const OFFSET: Family = EDGE.numbers_after(68, 2);
/// One more than the last place where a guess of sides is wrong.
pub const LAST_WRONG: Family = OFFSET.after(1, 65);
/// Whether the guess is wrong at a place before that.
pub const WRONG: Family = LAST_WRONG.after(WRONG_ROWS * WRONG_COLUMNS, 2);
/// How far the upper byte of an error is below the largest of its block, by that of the split before.
pub const ERROR: Family = WRONG.after(16, 256);
/// What is wrong with the guess of a field's offset, by error.
pub const LEVEL: Family = ERROR.numbers_after(128, 1);

/// All families, with names for what they tell.
pub const PARTS: [(&str, Family); 10] = [
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

/// Which of the ranges that end with these numbers a number is in; what is larger is in one more.
pub fn range_of(number: u32, ends: &[u32]) -> u32 {
    ends.partition_point(|&end| end < number) as u32
}

/// The context for place `place` in front of the last wrong one, `last`.
fn wrong_context(last: u32, place: u32) -> u32 {
    let row = range_of(last, &[1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 24]);
    row * WRONG_COLUMNS + range_of(place, &[0, 1, 2, 3, 4, 5, 6, 7, 11, 15])
}

/// Bytes that an update takes in memory.
pub fn update_bytes(fields: u64) -> u64 {
    38 + 6 * fields
}

/// A split turns one vertex into two, and vertex numbers are 32-bit words of which one means "none".
pub fn check_counts(info: &MtInfo, base_vertices: u64) -> Result<(), BaseMeshError> {
    let updates = u64::from(info.updates);
    if base_vertices + updates != u64::from(info.vertices) {
        return Err(BaseMeshError::Info("base vertices and updates do not add up to the reference vertices"));
    }
    if base_vertices + 2 * updates >= u64::from(u32::MAX) {
        return Err(BaseMeshError::Info("more vertices than 32 bits can number"));
    }
    Ok(())
}

/// The splits of a block without what they do to fields.
#[derive(Clone, Debug, Default)]
pub struct Splits {
    pub vertices: Vec<u32>,
    /// With the edges that they are counted from.
    pub offsets: Vec<Offset>,
    pub masks: Vec<u64>,
}

/// What updates of a block do to one field.
#[derive(Clone, Debug, Default)]
pub struct FieldPart {
    pub errors: Vec<ErrorCode>,
    pub residuals: Vec<i32>,
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

/// Puts the splits `first .. end` of an MT.
pub fn put(out: &mut impl Put, mt: &EdgeMt, first: u32, end: u32) {
    let vertices: Vec<u32> = (first..end).map(|k| mt.split_vertex(UpdateId(k)).0).collect();
    put_vertices(out, mt, first, &vertices);
    let leads = |k| {
        let (offset, edge) = offset_of(mt, UpdateId(k));
        edge != 0 || offset.into_iter().find(|&d| d != 0).is_none_or(|d| d > 0)
    };
    let all_lead = (first..end).all(leads);
    out.bits(u32::from(all_lead), 1);
    for k in first..end {
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
pub type Offset = ([i32; 3], u8);

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

/// Puts what the splits `first .. end` of an MT do to a field.
pub fn put_field(out: &mut impl Put, mt: &EdgeMt, first: u32, end: u32, field: usize) {
    put_changes(out, [ERROR, LEVEL], (first..end).map(UpdateId), |u| {
        (mt.error_of_field(u, field), mt.level_residuals(u).nth(field).unwrap_or(0))
    });
}

/// Puts errors and residuals of levels, update by update, by the families of both.
pub fn put_changes(
    out: &mut impl Put,
    [error, level]: [Family; 2],
    updates: impl Iterator<Item = UpdateId> + Clone,
    change: impl Fn(UpdateId) -> (ErrorCode, i32),
) {
    let codes = updates.clone().map(|u| change(u).0.0);
    let (largest, is_fine) =
        codes.fold((0, false), |(largest, fine), code| (largest.max(code >> 8), fine || code & 0xFF != 0));
    out.bits(u32::from(largest), 8);
    out.bits(u32::from(is_fine), 1);
    let mut before = 0;
    for (ErrorCode(code), residual) in updates.map(change) {
        let fall = u32::from(largest - (code >> 8));
        out.symbol(error, before, fall);
        if is_fine {
            out.bits(u32::from(code & 0xFF), 8);
        }
        before = fall;
        out.signed(level, u32::from(code >> 9), residual);
    }
}

/// Reads the splits `first .. first + count`; the blocks in which their vertices were created must be in the MT.
pub fn read(source: &mut Source<'_>, mt: &EdgeMt, first: u32, count: u32) -> Result<Splits, FormatError> {
    let mut splits = Splits { vertices: read_vertices(source, mt, first, count)?, ..Splits::default() };
    let leads = source.bits(1)? == 1;
    let old = vertices_before(mt, first);
    for at in 0..splits.vertices.len() {
        let v = splits.vertices[at];
        let above = match v.checked_sub(old) {
            Some(inside) => splits.offsets.get(inside as usize / 2).copied(),
            None => offset_above(mt, first, VertexId(v))?,
        };
        let offset = read_offset(source, above, leads)?;
        splits.offsets.push(offset);
        splits.masks.push(read_mask(source)?);
    }
    Ok(splits)
}

/// The offset of the split that created a vertex before block `first` began; none for a vertex of the base mesh.
fn offset_above(mt: &EdgeMt, first: u32, vertex: VertexId) -> Result<Option<Offset>, FormatError> {
    let Some(creator) = mt.created_by(vertex) else { return Ok(None) };
    if mt.has(creator) {
        return Ok(Some(offset_of(mt, creator)));
    }
    let [page, other] = [first, creator.0].map(|u| u >> mt.page_bits());
    Err(FormatError::Page(PageError::Needs { page, other }))
}

fn read_vertices(
    source: &mut Source<'_>,
    mt: &EdgeMt,
    first: u32,
    count: u32,
) -> Result<Vec<u32>, FormatError> {
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

fn read_offset(source: &mut Source<'_>, above: Option<Offset>, leads: bool) -> Result<Offset, FormatError> {
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

fn read_mask(source: &mut Source<'_>) -> Result<u64, FormatError> {
    let last = source.symbol(LAST_WRONG, 0)?;
    let mut mask = if last == 0 { 0 } else { 1 << (last - 1) };
    for place in 0..last.saturating_sub(1) {
        mask |= u64::from(source.symbol(WRONG, wrong_context(last, place))?) << place;
    }
    Ok(mask)
}

/// Reads what [`put_changes`] puts of `count` updates.
pub fn read_changes(
    source: &mut Source<'_>,
    [error, level]: [Family; 2],
    count: u32,
) -> Result<FieldPart, FormatError> {
    let largest = source.bits(8)?;
    let is_fine = source.bits(1)? == 1;
    let (mut part, mut before) = (FieldPart::default(), 0);
    for _ in 0..count {
        let fall = source.symbol(error, before)?;
        let upper = largest.checked_sub(fall).ok_or_else(|| source.corrupt("an error is below zero"))?;
        let lower = if is_fine { source.bits(8)? } else { 0 };
        before = fall;
        part.errors.push(ErrorCode((upper << 8 | lower) as u16));
        part.residuals.push(source.signed(level, upper >> 1)?);
    }
    Ok(part)
}

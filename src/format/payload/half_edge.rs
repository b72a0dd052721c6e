//! `HALF` of a half-edge MT: a block of vertex insertions, without what they do to fields.
//!
//! Nothing here needs a mesh, or another block. The vertex forest is coded from the near vertex down: each update lists the
//! updates whose near vertex is its own. What removes the tetrahedra of its star is coded as residuals: see
//! `mt/half_edge/star_code.rs`.

use super::base;
use super::changes::{FieldPart, put_changes, range_of, read_changes};
use super::codec::{Codec, Head, Parts, Started};
use crate::format::coder::{Counts, Family, Models, Put, Source, Writer};
use crate::format::error::Result;
use crate::format::header::Kind;
use crate::format::limits::check_bytes;
use crate::format::section::{FoundSection, Section, find_section};
use crate::format::{EncodeError, FormatError, Limits};
use crate::mesh::NONE;
use crate::mt::{
    BaseMark, BaseMesh, BaseMeshError, BaseSides, ErrorCode, ForestChild, HalfEdgeMt, HalfEdgeUpdate,
    MtFacts, MtInfo, MtKind, MultiTessellation, UpdateError, UpdateId, UpdatePages, VertexId,
    further_regions,
};
use crate::threads;
use std::ops::Range;

/// One more than the update that removes a base tetrahedron.
const REMOVER: Family = base::LAST.numbers_after(1, 1);
/// Which faces of a base tetrahedron go with it.
const BASE_INNER: Family = REMOVER.after(1, 16);
/// How many forest children a vertex has.
const CHILDREN: Family = BASE_INNER.numbers_after(1, 2);
/// How many other blocks have been named since the block of a child was named last, 0 for a new one.
const BLOCK: Family = CHILDREN.numbers_after(1, 2);
/// How far a new block lies behind that of the near vertex, or behind the last new one.
const NEW_BLOCK: Family = BLOCK.numbers_after(1, 1);
/// Distances between children in a block.
const GAP: Family = NEW_BLOCK.numbers_after(1, 2);
/// Components of offsets: the first by the length of the last offset, the others by that of those before.
const OFFSET: Family = GAP.numbers_after(3 * LENGTHS, 2);
/// How many symbols a star has.
const SYMBOLS: Family = OFFSET.after(1, 256);
/// The symbols by their number and place.
const SYMBOL: Family = SYMBOLS.after(ROWS * COLUMNS, 16);
/// How many bits a star has.
const BITS: Family = SYMBOL.numbers_after(1, 4);
/// The bits by their number and place.
const BIT: Family = BITS.after(ROWS * COLUMNS, 2);
/// How far the upper byte of an error is below the largest of its block, by that of the update before.
const ERROR: Family = BIT.after(16, 256);
/// Residuals of levels, by error.
const LEVEL: Family = ERROR.numbers_after(128, 1);
/// In how many further regions a vertex has levels of its own, by whether the one before has any.
const SIDES: Family = LEVEL.numbers_after(2, 2);
/// Residuals of these levels; and, of the base mesh, what each is above the one before.
const SIDE: Family = SIDES.numbers_after(2, 1);

/// Lengths of offsets in bits that have contexts of their own; longer ones use the last.
const LENGTHS: u32 = 22;

/// All families, with names for what they code.
const PARTS: Parts = &[
    ("base mesh", REMOVER),
    ("base mesh", BASE_INNER),
    ("partial order", CHILDREN),
    ("partial order", BLOCK),
    ("partial order", NEW_BLOCK),
    ("partial order", GAP),
    ("offsets", OFFSET),
    ("removers", SYMBOLS),
    ("removers", SYMBOL),
    ("inner faces", BITS),
    ("inner faces", BIT),
    ("errors", ERROR),
    ("levels", LEVEL),
    ("values for each region", SIDES),
    ("values for each region", SIDE),
];

// Families of what all kinds have follow those of edge-based MTs.
const _: () = assert!(SIDE.first + SIDE.contexts <= super::BASE_LEVEL.first);

const ROWS: u32 = 8;
const COLUMNS: u32 = 8;

/// The context for place `place` of `count`.
fn place_context(count: u32, place: u32) -> u32 {
    let row = range_of(count, &[1, 2, 4, 6, 9, 13, 19]);
    row * COLUMNS + range_of(place, &[0, 1, 2, 4, 7, 11, 16])
}

/// Bytes that an update takes in memory besides its children and its star code: where these begin, where its near vertex
/// is noted, levels and errors.
fn own_bytes(fields: u64) -> u64 {
    8 + 4 + 6 * fields
}

/// So many blocks are counted together: each table of counts takes memory.
const COUNTED: usize = 16;

impl Codec for HalfEdgeMt {
    const KIND: MtKind = MtKind::HalfEdge;
    const NUMBER: u8 = 3;
    const SECTION: Kind = Kind::HALF;
    const PARTS: Parts = PARTS;

    /// Every update inserts one vertex.
    fn check_counts(info: &MtInfo, base_vertices: u64) -> Result<(), BaseMeshError> {
        if base_vertices + u64::from(info.updates) != u64::from(info.vertices) {
            return Err(BaseMeshError::Info("vertices are not as many as base vertices and updates"));
        }
        Ok(())
    }

    /// Every update is the child of one vertex.
    fn least_update_bytes(info: &MtInfo) -> u64 {
        own_bytes(info.fields.len() as u64) + size_of::<ForestChild>() as u64
    }

    /// Puts what removes the base tetrahedra, and the forest children of the base vertices.
    fn put_head(&self, out: &mut impl Put) {
        for mark in self.base_marks() {
            out.number(REMOVER, 0, mark.remover.wrapping_add(1));
            if mark.remover != NONE {
                out.symbol(BASE_INNER, 0, u32::from(mark.inner));
            }
        }
        let mut named = Named::behind(0);
        for v in (0..self.base().positions.len() as u32).map(VertexId) {
            put_children(out, &mut named, self.children_of(v), self.page_bits());
        }
    }

    fn read_head(
        source: &mut Source<'_>,
        info: &MtInfo,
        [vertices, tets]: [u32; 2],
        block_bits: u32,
        limits: &Limits,
    ) -> Result<Box<dyn Head>> {
        let mut head = BaseHead::default();
        for _ in 0..tets {
            let remover = source.number(REMOVER, 0)?.wrapping_sub(1);
            let inner = if remover == NONE { 0 } else { source.symbol(BASE_INNER, 0)? as u8 };
            head.marks.push(BaseMark { remover, inner });
        }
        let (mut named, mut left) = (Named::behind(0), most_children(info, limits));
        for _ in 0..vertices {
            let children = read_children(source, &mut named, block_bits, left)?;
            left -= children.len() as u32;
            head.children.push(children);
        }
        Ok(Box::new(head))
    }

    type Writing = ();

    fn writing(&self) -> Result<(), BaseMeshError> {
        Ok(())
    }

    fn put_block(&self, out: &mut impl Put, updates: Range<u32>, _: &mut ()) -> Result<(), UpdateError> {
        let rows: Vec<HalfEdgeUpdate<'_>> =
            updates.clone().filter_map(|u| self.update(UpdateId(u))).collect();
        put(out, &rows, updates.start >> self.page_bits(), self.page_bits());
        for field in 0..self.info().fields.len() {
            put_field(out, &rows, field, self.jumps().is_some_and(|jumps| jumps[field]));
        }
        Ok(())
    }

    /// The index says how large errors are.
    fn put_updates(&self, out: &mut impl Put) -> Result<(), EncodeError> {
        (0..blocks(self) as u32)
            .try_for_each(|block| self.put_block(out, self.page_updates(block), &mut ()))
            .map_err(EncodeError::Update)
    }

    /// Blocks do not depend on each other.
    fn count_updates(&self) -> Result<Counts, EncodeError> {
        let of_ranges = threads::map(blocks(self), COUNTED, |blocks| {
            let mut counts = Counts::default();
            let mut pages = blocks.map(|block| self.page_updates(block as u32));
            let put = pages.try_for_each(|updates| self.put_block(&mut counts, updates, &mut ()));
            put.map(|()| counts).map_err(EncodeError::Update)
        });
        of_ranges.into_iter().try_fold(Counts::default(), |mut all, counts| {
            all.add(&counts?);
            Ok(all)
        })
    }

    fn known_facts(&self) -> Option<&MtFacts> {
        self.facts()
    }

    fn sections(&self, models: &Models) -> Result<Vec<Vec<Section>>, EncodeError> {
        let of_block = |blocks: Range<usize>| sections_of(self, blocks.start as u32, models);
        threads::map(blocks(self), 1, of_block).into_iter().collect()
    }
}

/// How many blocks an MT has.
fn blocks(mt: &HalfEdgeMt) -> usize {
    mt.updates().div_ceil(1 << mt.page_bits()) as usize
}

/// The sections of a block: one that all fields share, and one for each field.
pub fn sections_of(mt: &HalfEdgeMt, block: u32, models: &Models) -> Result<Vec<Section>, EncodeError> {
    let updates = mt.page_updates(block).filter_map(|u| mt.update(UpdateId(u)));
    sections_of_rows(&updates.collect::<Vec<_>>(), block, mt, models)
}

/// [`sections_of`] these updates, which need not be in the MT.
fn sections_of_rows(
    updates: &[HalfEdgeUpdate<'_>],
    block: u32,
    mt: &HalfEdgeMt,
    models: &Models,
) -> Result<Vec<Section>, EncodeError> {
    let put = |out: &mut Writer<'_>| put(out, updates, block, mt.page_bits());
    let shared = Section::coded(HalfEdgeMt::SECTION, &[block], models, put);
    let of_field = |field: usize| {
        let jumps = mt.jumps().is_some_and(|jumps| jumps[field]);
        let put = |out: &mut Writer<'_>| put_field(out, updates, field, jumps);
        Section::coded(Kind::FLDU, &[block, field as u32], models, put)
    };
    std::iter::once(shared).chain((0..mt.info().fields.len()).map(of_field)).collect()
}

/// The sections of a block by other tables, given those that [`sections_of`] has made by `before`, one behind the other.
pub fn recoded(
    bytes: &[u8],
    block: u32,
    mt: &HalfEdgeMt,
    [before, models]: [&Models; 2],
) -> Result<Vec<Section>, EncodeError> {
    let (shared, fields) = reread(bytes, block, mt, before).map_err(EncodeError::Kept)?;
    let mut sections = Ok(Vec::new());
    let made = shared.with_rows(&fields, |updates| {
        sections = sections_of_rows(updates, block, mt, models);
        Ok(())
    });
    made.map_err(EncodeError::Kept)?;
    sections
}

/// What stands in the sections of a block.
fn reread(
    bytes: &[u8],
    block: u32,
    mt: &HalfEdgeMt,
    models: &Models,
) -> Result<(Insertions, Vec<FieldPart>)> {
    let (info, updates) = (mt.info(), mt.page_updates(block));
    let (mut rest, limits) = (bytes, Limits::default());
    let (mut shared, mut fields) = (Insertions::default(), Vec::new());
    for part in 0..=info.fields.len() {
        let short = || FormatError::Truncated { offset: (bytes.len() - rest.len()) as u64 };
        let FoundSection { mut content, behind, .. } = find_section(rest, 0, short)?;
        rest = behind;
        (0..=usize::from(part > 0)).try_for_each(|_| content.varint().map(drop))?;
        let mut source = Source::new(content, models)?;
        match part.checked_sub(1) {
            None => shared = read(&mut source, info, mt.page_bits(), updates.clone(), &limits)?,
            Some(field) => {
                let jumps = mt.jumps().is_some_and(|jumps| jumps[field]);
                fields.push(read_field(&mut source, updates.len() as u32, jumps)?);
            }
        }
        source.end()?;
    }
    Ok((shared, fields))
}

/// What forest children are coded relative to: the blocks named so far, the last first, each with the last child in it.
#[derive(Default)]
struct Named {
    blocks: Vec<(u32, u32)>,
    newest: u32,
    length: u32,
}

impl Named {
    fn behind(block: u32) -> Self {
        Self { blocks: Vec::new(), newest: block, length: 0 }
    }

    /// Makes a block the one that was named last.
    fn name_again(&mut self, at: usize) {
        self.blocks[..=at].rotate_right(1);
    }
}

fn length(d: i32) -> u32 {
    (u32::BITS - d.unsigned_abs().leading_zeros()).min(LENGTHS - 1)
}

fn zigzag(gap: i64) -> u32 {
    ((gap << 1) ^ (gap >> 63)) as u32
}

fn unzigzag(code: u32) -> i64 {
    i64::from(code >> 1) ^ -i64::from(code & 1)
}

fn put_children(out: &mut impl Put, named: &mut Named, children: &[ForestChild], block_bits: u32) {
    out.number(CHILDREN, 0, children.len() as u32);
    for child in children {
        let block = child.update >> block_bits;
        let known = named.blocks.iter().position(|&(known, _)| known == block);
        out.number(BLOCK, 0, known.map_or(0, |at| at as u32 + 1));
        match known {
            Some(at) => {
                let gap = i64::from(child.update) - i64::from(named.blocks[at].1) - 1;
                out.number(GAP, 0, zigzag(gap));
                named.name_again(at);
            }
            None => {
                out.number(NEW_BLOCK, 0, zigzag(i64::from(block) - i64::from(named.newest)));
                out.bits(child.update & ((1 << block_bits) - 1), block_bits);
                named.newest = block;
                named.blocks.insert(0, (block, 0));
            }
        }
        named.blocks[0].1 = child.update;
        put_offset(out, named, child.offset);
    }
}

fn put_offset(out: &mut impl Put, named: &mut Named, offset: [i32; 3]) {
    let mut context = named.length;
    let mut longest = 0;
    for (axis, d) in (0..).zip(offset) {
        out.signed(OFFSET, context, d);
        longest = longest.max(length(d));
        context = LENGTHS * (axis + 1) + longest;
    }
    named.length = longest;
}

fn read_offset(source: &mut Source<'_>, named: &mut Named) -> Result<[i32; 3]> {
    let mut context = named.length;
    let (mut offset, mut longest) = ([0; 3], 0);
    for (axis, d) in (0..).zip(&mut offset) {
        *d = source.signed(OFFSET, context)?;
        longest = longest.max(length(*d));
        context = LENGTHS * (axis + 1) + longest;
    }
    named.length = longest;
    Ok(offset)
}

fn read_children(
    source: &mut Source<'_>,
    named: &mut Named,
    block_bits: u32,
    most: u32,
) -> Result<Vec<ForestChild>> {
    let count = source.number(CHILDREN, 0)?;
    if count > most {
        return Err(source.corrupt("a vertex has more children than there are updates"));
    }
    let mut children = Vec::new();
    for _ in 0..count {
        let at = source.number(BLOCK, 0)? as usize;
        let wrong = |source: &Source<'_>| source.corrupt("a child is no update of the MT");
        let update = if at == 0 {
            let block = i64::from(named.newest) + unzigzag(source.number(NEW_BLOCK, 0)?);
            let place = source.bits(block_bits)?;
            let block = u32::try_from(block).ok().filter(|block| u64::from(*block) << block_bits < 1 << 32);
            let block = block.ok_or_else(|| wrong(source))?;
            named.newest = block;
            named.blocks.insert(0, (block, 0));
            block << block_bits | place
        } else {
            let gap = unzigzag(source.number(GAP, 0)?);
            let &(_, last) = named.blocks.get(at - 1).ok_or_else(|| wrong(source))?;
            named.name_again(at - 1);
            u32::try_from(i64::from(last) + 1 + gap).map_err(|_| wrong(source))?
        };
        named.blocks[0].1 = update;
        children.push(ForestChild { update, offset: read_offset(source, named)? });
    }
    Ok(children)
}

/// Forest children that can be held. Symbols may take no bits, so what arrives does not bound their number.
fn most_children(info: &MtInfo, limits: &Limits) -> u32 {
    let held = limits.memory_bytes / size_of::<ForestChild>() as u64;
    info.updates.min(u32::try_from(held).unwrap_or(u32::MAX))
}

/// What stands in front of the updates besides the base mesh.
#[derive(Debug, Default)]
struct BaseHead {
    marks: Vec<BaseMark>,
    children: Vec<Vec<ForestChild>>,
}

impl Head for BaseHead {
    fn start(self: Box<Self>, info: MtInfo, base: BaseMesh, block_bits: u32, _: bool) -> Result<Started> {
        Ok((HalfEdgeMt::new(info, base, self.marks, &self.children, block_bits)?.into(), None))
    }
}

fn put_star(out: &mut impl Put, star: &[u8]) {
    let (count, rest) = star.split_first().map_or((0, star), |(&count, rest)| (count, rest));
    out.symbol(SYMBOLS, 0, u32::from(count));
    let (symbols, bits) = rest.split_at(usize::from(count));
    for (place, &symbol) in (0..).zip(symbols) {
        out.symbol(SYMBOL, place_context(u32::from(count), place), u32::from(symbol));
    }
    let used = bits
        .iter()
        .rposition(|&byte| byte != 0)
        .map_or(0, |last| 8 * last as u32 + u8::BITS - bits[last].leading_zeros());
    out.number(BITS, 0, used);
    for place in 0..used.saturating_sub(1) {
        let bit = bits[place as usize / 8] >> (place % 8) & 1;
        out.symbol(BIT, place_context(used, place), u32::from(bit));
    }
}

/// Most bits that the star of an update can have: three faces of each tetrahedron.
const MOST_BITS: u32 = 3 * 128;

fn read_star(source: &mut Source<'_>, star: &mut Vec<u8>) -> Result<()> {
    let count = source.symbol(SYMBOLS, 0)?;
    star.push(count as u8);
    for place in 0..count {
        star.push(source.symbol(SYMBOL, place_context(count, place))? as u8);
    }
    let used = source.number(BITS, 0)?;
    if used > MOST_BITS {
        return Err(source.corrupt("a star has more faces than it can have"));
    }
    let mut byte = 0_u8;
    for place in 0..used {
        let bit = place + 1 == used || source.symbol(BIT, place_context(used, place))? == 1;
        byte |= u8::from(bit) << (place % 8);
        if place % 8 == 7 || place + 1 == used {
            star.push(byte);
            byte = 0;
        }
    }
    if star.len() == 1 && count == 0 {
        star.clear();
    }
    Ok(())
}

/// Puts updates that are a block of `2^bits`, without what they do to fields.
fn put(out: &mut impl Put, updates: &[HalfEdgeUpdate<'_>], block: u32, bits: u32) {
    let mut named = Named::behind(block);
    for update in updates {
        put_children(out, &mut named, update.children, bits);
        put_star(out, update.star);
    }
}

/// Updates of a block, without what they do to fields.
#[derive(Clone, Debug, Default)]
pub struct Insertions {
    children: Vec<Vec<ForestChild>>,
    stars: Vec<Vec<u8>>,
}

impl Insertions {
    /// Adds them to an MT as a page, with what they do to each of its fields.
    pub fn insert(self, mt: &mut HalfEdgeMt, page: u32, fields: &[FieldPart], limits: &Limits) -> Result<()> {
        check_bytes(mt.bytes() + self.bytes(fields.len() as u64), limits)?;
        self.with_rows(fields, |updates| Ok(mt.insert_page(page, updates)?))
    }

    /// Uses them with what they do to each field.
    fn with_rows<T>(
        &self,
        fields: &[FieldPart],
        with: impl FnOnce(&[HalfEdgeUpdate<'_>]) -> Result<T>,
    ) -> Result<T> {
        let stride = fields.len().max(1);
        let rows = 0..self.stars.len();
        let residuals: Vec<i32> =
            rows.clone().flat_map(|k| fields.iter().map(move |field| field.residuals[k])).collect();
        let sides = sides_of_all(fields, self.stars.len())?;
        let errors: Vec<ErrorCode> =
            rows.clone().flat_map(|k| fields.iter().map(move |field| field.errors[k])).collect();
        let changes = rows.zip(residuals.chunks(stride).zip(errors.chunks(stride)));
        let updates: Vec<HalfEdgeUpdate<'_>> = changes
            .map(|(k, (level_residuals, errors))| HalfEdgeUpdate {
                children: &self.children[k],
                level_residuals,
                side_residuals: sides.get(k).map_or(&[], |own| own),
                star: &self.stars[k],
                errors,
            })
            .collect();
        with(&updates)
    }

    /// Bytes that they take in memory, in an MT of so many fields.
    fn bytes(&self, fields: u64) -> u64 {
        let children: usize = self.children.iter().map(|row| size_of_val(&row[..])).sum();
        let stars: usize = self.stars.iter().map(Vec::len).sum();
        (children + stars) as u64 + self.stars.len() as u64 * own_bytes(fields)
    }
}

/// Reads updates that are a block.
pub fn read(
    source: &mut Source<'_>,
    info: &MtInfo,
    block_bits: u32,
    updates: Range<u32>,
    limits: &Limits,
) -> Result<Insertions> {
    let mut insertions = Insertions::default();
    let (mut named, mut left) = (Named::behind(updates.start >> block_bits), most_children(info, limits));
    for _ in updates {
        let children = read_children(source, &mut named, block_bits, left)?;
        left -= children.len() as u32;
        insertions.children.push(children);
        let mut star = Vec::new();
        read_star(source, &mut star)?;
        insertions.stars.push(star);
    }
    Ok(insertions)
}

/// Puts what updates do to a field; `jumps`: at interfaces, too.
fn put_field(out: &mut impl Put, updates: &[HalfEdgeUpdate<'_>], field: usize, jumps: bool) {
    let change = |update: &HalfEdgeUpdate<'_>| (update.errors[field], update.level_residuals[field]);
    put_changes(out, [ERROR, LEVEL], updates.iter(), change);
    if jumps {
        let mut before = 0;
        for update in updates {
            let fields = update.errors.len();
            let count = (update.side_residuals.len() / fields) as u32;
            out.number(SIDES, before, count);
            before = count;
            let own = update.side_residuals.iter().skip(field).step_by(fields);
            own.for_each(|&residual| out.signed(SIDE, 0, residual));
        }
    }
}

/// Reads what the `count` updates of a block do to a field; `jumps`: at interfaces, too.
pub fn read_field(source: &mut Source<'_>, count: u32, jumps: bool) -> Result<FieldPart> {
    let mut part = read_changes(source, [ERROR, LEVEL], count)?;
    if jumps {
        let mut before = 0;
        let mut all = Vec::new();
        for _ in 0..count {
            let count = source.number(SIDES, before)?;
            if count > MOST_SIDES {
                return Err(source.corrupt("a vertex has more regions than it can have"));
            }
            before = count;
            all.push((0..count).map(|_| source.signed(SIDE, 0)).collect::<Result<Vec<i32>>>()?);
        }
        part.sides = Some(all);
    }
    Ok(part)
}

/// Regions of a vertex besides its first: no more than tetrahedra that an update removes.
const MOST_SIDES: u32 = 127;

/// The residuals in further regions of each of so many updates, region by region and field by field; nothing if no field jumps.
fn sides_of_all(fields: &[FieldPart], updates: usize) -> Result<Vec<Vec<i32>>> {
    let Some(first) = fields.iter().find_map(|field| field.sides.as_ref()) else { return Ok(Vec::new()) };
    let own = |k: usize| {
        let all = || fields.iter().map(|field| field.sides.as_ref().map(|sides| &sides[k]));
        let count = first[k].len();
        if all().flatten().any(|own| own.len() != count) {
            let what = "a vertex does not have as many regions in each field that jumps";
            return Err(FormatError::Corrupt { offset: 0, what });
        }
        // In other fields it has the same level in all regions.
        Ok((0..count).flat_map(|i| all().map(move |own| own.map_or(0, |own| own[i]))).collect())
    };
    (0..updates).map(own).collect()
}

/// Which fields jump, and the levels of base vertices in further regions, given these of each field that jumps. None if they are not as many.
pub fn base_sides(base: &BaseMesh, of_base: &[u16], of_fields: &[Option<Vec<i32>>]) -> Option<BaseSides> {
    if of_fields.iter().all(Option::is_none) {
        return Some(BaseSides::default());
    }
    let rows = further_regions(base.positions.len(), &base.tets, of_base);
    if of_fields.iter().flatten().any(|levels| levels.len() != rows.len()) {
        return None;
    }
    let fields = of_fields.len();
    let level = |(row, &(v, _)): (usize, &(u32, u16)), field: usize| {
        of_fields[field].as_ref().map_or(base.values[v as usize * fields + field], |levels| levels[row])
    };
    let levels = rows.iter().enumerate().flat_map(|row| (0..fields).map(move |field| level(row, field)));
    Some(BaseSides { jumps: of_fields.iter().map(Option::is_some).collect(), levels: levels.collect() })
}

/// Puts the levels of one field that jumps at the base vertices, in each of their regions but the first.
pub fn put_base_sides(out: &mut impl Put, levels: &[i32], fields: usize, field: usize) {
    let mut last = 0;
    out.number(SIDES, 0, (levels.len() / fields) as u32);
    for &level in levels.iter().skip(field).step_by(fields) {
        out.signed(SIDE, 1, level - last);
        last = level;
    }
}

/// Reads what [`put_base_sides`] puts, of a base mesh with so many tetrahedra.
pub fn read_base_sides(source: &mut Source<'_>, tets: usize) -> Result<Vec<i32>> {
    let count = source.number(SIDES, 0)?;
    // Each is of a corner.
    if u64::from(count) > 4 * tets as u64 {
        return Err(source.corrupt("base vertices have more regions than they can have"));
    }
    let (mut levels, mut last) = (Vec::new(), 0_i32);
    for _ in 0..count {
        last = last.wrapping_add(source.signed(SIDE, 1)?);
        levels.push(last);
    }
    Ok(levels)
}

//! Updates of explicit MTs, coded: numbers with a context for each kind of number.

use super::{check_bytes, put_errors, put_quarterings, read_errors, read_quarterings, vertex};
use crate::format::coder::{Family, Put, Source};
use crate::format::{FormatError, Limits};
use crate::mt::{
    BaseMeshError, ErrorCode, ExplicitMt, ExplicitUpdate, MultiTessellation, UpdateId, UpdatePages, VertexId,
};
use std::ops::Range;

/// By how many codes an error is below the one before.
const ERROR: Family = vertex::LAST.numbers_after(1, 2);
/// How many vertices are created; how many tetrahedra removed; how many inserted.
const COUNT: Family = ERROR.numbers_after(3, 3);
/// A coordinate less that of the vertex before, by axis.
const STEP: Family = COUNT.numbers_after(3, 1);
/// A level less that of the vertex before.
const LEVEL: Family = STEP.numbers_after(1, 1);
/// How far below the one before, or the newest one, a removed tetrahedron is.
const REMOVED: Family = LEVEL.numbers_after(2, 2);
/// Steps between the corners of inserted tetrahedra.
const CORNER: Family = REMOVED.numbers_after(4, 4);
/// All families, with names for what they code.
pub const PARTS: [(&str, Family); 6] = [
    ("errors", ERROR),
    ("partial order", COUNT),
    ("positions", STEP),
    ("levels", LEVEL),
    ("partial order", REMOVED),
    ("tetrahedra", CORNER),
];

/// Bytes that every update takes in memory, however small it is: one removed and one inserted tetrahedron.
pub fn least_update_bytes() -> u64 {
    bytes_of(0, 0, 1, 1)
}

/// Bytes that an update takes in memory, at most.
pub fn bytes_of(vertices: usize, fields: usize, removed: usize, inserted: usize) -> u64 {
    let vertex = 12 + 4 * fields;
    // What is removed names a parent each, at most.
    (18 + vertices * vertex + 8 * removed + 20 * inserted) as u64
}

/// The vertices that an update can use: those of what it removes, and those that appear with it; ascending.
pub fn at_hand(mt: &ExplicitMt, removed: &[u32], created: Range<u32>) -> Vec<u32> {
    let mut vertices: Vec<u32> = removed.iter().flat_map(|&t| mt.tets()[t as usize]).collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices.extend(created);
    vertices
}

/// The reference mesh must have as many vertices and tetrahedra as the description says.
pub fn check_reference(mt: &ExplicitMt) -> Result<(), BaseMeshError> {
    let info = mt.info();
    if mt.reference_counts() != [info.vertices, info.tetrahedra] {
        return Err(BaseMeshError::Info("the reference mesh has another size than the description says"));
    }
    Ok(())
}

/// Puts the updates `first .. end`.
pub fn put(out: &mut impl Put, mt: &ExplicitMt, first: u32, end: u32) {
    let mut errors = vec![ErrorCode::MAX; mt.fields()];
    let (mut position, mut levels) = ([0; 3], vec![0; mt.fields()]);
    for u in (first..end).map(UpdateId) {
        put_errors(out, ERROR, &mut errors, mt.errors(u));
        let created = mt.created(u);
        out.number(COUNT, 0, created.len() as u32);
        for v in created.map(VertexId) {
            for (k, (before, x)) in (0..).zip(position.iter_mut().zip(mt.position(v))) {
                out.signed(STEP, k, x.wrapping_sub(*before));
                *before = x;
            }
            for (before, &level) in levels.iter_mut().zip(mt.levels(v)) {
                out.signed(LEVEL, 0, level.wrapping_sub(*before));
                *before = level;
            }
        }
        put_removed(out, mt, u);
        if mt.quarterings().is_some() {
            let own = mt.removed(u).iter().rev().map(|&t| (mt.quarterings_of(t), false));
            put_quarterings(out, mt.own_fall(u), own);
        }
        put_inserted(out, mt, u);
    }
}

/// Backwards from the newest; the MT has checked that they are there, and sorted them.
fn put_removed(out: &mut impl Put, mt: &ExplicitMt, u: UpdateId) {
    out.number(COUNT, 1, mt.removed(u).len() as u32);
    let newest = mt.inserted(u).start;
    let mut above = newest;
    for &t in mt.removed(u).iter().rev() {
        out.number(REMOVED, u32::from(above < newest), above - 1 - t);
        above = t;
    }
}

/// Corners are coded by their places among the vertices at hand, which ascend. The first two corners of a tetrahedron
/// ascend, too, and are the lowest; so do the tetrahedra.
fn put_inserted(out: &mut impl Put, mt: &ExplicitMt, u: UpdateId) {
    let range = mt.inserted(u);
    let vertices = at_hand(mt, mt.removed(u), mt.created(u));
    out.number(COUNT, 2, range.len() as u32);
    let mut last = 0;
    for tet in &mt.tets()[range.start as usize..range.end as usize] {
        // The MT has checked that they are at hand.
        let [a, b, c, d] = tet.map(|v| vertices.partition_point(|&other| other < v));
        for (k, step) in (0..).zip([a - last, b - a, c - b, d - b]) {
            out.number(CORNER, k, step as u32);
        }
        last = a;
    }
}

/// What has been read of an update; reused from one to the next.
struct Parts {
    positions: Vec<[i32; 3]>,
    levels: Vec<i32>,
    removed: Vec<u32>,
    inserted: Vec<[u32; 4]>,
    errors: Vec<ErrorCode>,
    /// Of what is removed, where the file contains them.
    quarterings: Vec<u8>,
    own_fall: u8,
    /// The last vertex of the update before.
    position: [i32; 3],
    level: Vec<i32>,
}

/// Reads `count` updates into the MT.
pub fn read(
    source: &mut Source<'_>,
    mt: &mut ExplicitMt,
    count: u32,
    limits: &Limits,
) -> Result<(), FormatError> {
    let mut parts = Parts {
        positions: Vec::new(),
        levels: Vec::new(),
        removed: Vec::new(),
        inserted: Vec::new(),
        errors: vec![ErrorCode::MAX; mt.fields()],
        quarterings: Vec::new(),
        own_fall: 0,
        position: [0; 3],
        level: vec![0; mt.fields()],
    };
    for _ in 0..count {
        parts.read(source, mt, limits)?;
        let Parts { positions, levels, removed, inserted, errors, quarterings, .. } = &parts;
        let update = mt.push(&ExplicitUpdate { positions, levels, removed, inserted, errors })?;
        mt.set_own_fall(update, parts.own_fall);
        removed.iter().zip(quarterings).for_each(|(&t, &own)| mt.set_quarterings_of(t, own));
    }
    mt.set_to_come(&parts.errors);
    Ok(())
}

impl Parts {
    /// Reads an update. Symbols may take no bits, so what the counts make of it is held within the limits.
    fn read(&mut self, source: &mut Source<'_>, mt: &ExplicitMt, limits: &Limits) -> Result<(), FormatError> {
        read_errors(source, ERROR, &mut self.errors)?;
        let fits = |vertices: u32, removed: u32, inserted: u32| {
            let [vertices, removed, inserted] = [vertices, removed, inserted].map(|count| count as usize);
            check_bytes(mt.bytes() + bytes_of(vertices, mt.fields(), removed, inserted), limits)
        };
        let created = source.number(COUNT, 0)?;
        fits(created, 0, 0)?;
        self.read_created(source, created)?;
        let removed = source.number(COUNT, 1)?;
        fits(created, removed, 0)?;
        self.read_removed(source, removed, mt.tets().len() as u32)?;
        if mt.quarterings().is_some() {
            let none_is_home = (0..removed).map(|_| false);
            self.own_fall = read_quarterings(source, &mut self.quarterings, none_is_home)?;
        }
        let first = mt.vertices();
        let Some(end) = first.checked_add(created) else {
            return Err(source.corrupt("there are more vertices than 32 bits can number"));
        };
        let vertices = at_hand(mt, &self.removed, first..end);
        let inserted = source.number(COUNT, 2)?;
        fits(created, removed, inserted)?;
        self.read_inserted(source, inserted, &vertices)
    }

    fn read_created(&mut self, source: &mut Source<'_>, count: u32) -> Result<(), FormatError> {
        self.positions.clear();
        self.levels.clear();
        for _ in 0..count {
            for (k, x) in (0..).zip(&mut self.position) {
                *x = x.wrapping_add(source.signed(STEP, k)?);
            }
            self.positions.push(self.position);
            for level in &mut self.level {
                *level = level.wrapping_add(source.signed(LEVEL, 0)?);
            }
            self.levels.extend_from_slice(&self.level);
        }
        Ok(())
    }

    fn read_removed(&mut self, source: &mut Source<'_>, count: u32, newest: u32) -> Result<(), FormatError> {
        self.removed.clear();
        let mut above = newest;
        for _ in 0..count {
            let distance = source.number(REMOVED, u32::from(above < newest))?;
            let t = above.checked_sub(1).and_then(|newest| newest.checked_sub(distance));
            above = t.ok_or_else(|| source.corrupt("an update removes a tetrahedron that is not there"))?;
            self.removed.push(above);
        }
        Ok(())
    }

    fn read_inserted(
        &mut self,
        source: &mut Source<'_>,
        count: u32,
        vertices: &[u32],
    ) -> Result<(), FormatError> {
        self.inserted.clear();
        let mut last = 0;
        for _ in 0..count {
            let mut next = |corner: u32, from: usize| {
                let place = from.saturating_add(source.number(CORNER, corner)? as usize);
                let unknown = "an update uses a vertex that is neither new nor of what it removes";
                let vertex = vertices.get(place).copied();
                vertex.map(|v| (place, v)).ok_or_else(|| source.corrupt(unknown))
            };
            let (first, a) = next(0, last)?;
            let (second, b) = next(1, first)?;
            let [(_, c), (_, d)] = [next(2, second)?, next(3, second)?];
            self.inserted.push([a, b, c, d]);
            last = first;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::vertex::tests::delaunay;
    use super::*;
    use crate::format::coder::{Counts, Models, Writer};
    use crate::format::read::Reader;
    use crate::mt::{MtInfo, MtKind};

    fn sample() -> ExplicitMt {
        let mt = ExplicitMt::of(&delaunay(80)).unwrap();
        assert_eq!(mt.info().kind, MtKind::Explicit);
        mt
    }

    fn coded(mt: &ExplicitMt) -> (Models, [Vec<u8>; 2]) {
        let mut counts = Counts::default();
        put(&mut counts, mt, 0, 60);
        put(&mut counts, mt, 60, mt.updates());
        let models = Models::new(&counts);
        let blocks = [(0, 60), (60, mt.updates())].map(|(first, end)| {
            let mut writer = Writer::new(&models);
            put(&mut writer, mt, first, end);
            let mut block = Vec::new();
            writer.finish(&mut block);
            block
        });
        (models, blocks)
    }

    fn decoded(
        models: &Models,
        blocks: &[Vec<u8>],
        mt: &ExplicitMt,
        limits: Limits,
    ) -> Result<ExplicitMt, FormatError> {
        let mut new = ExplicitMt::new(MtInfo::clone(mt.info()), mt.base().clone());
        for block in blocks {
            let mut source = Source::new(Reader::new(block, 0), models)?;
            let count = 60.min(mt.updates() - new.updates());
            read(&mut source, &mut new, count, &limits)?;
            source.end()?;
        }
        Ok(new)
    }

    #[test]
    fn all_comes_back_and_damage_does_no_harm() {
        let mt = sample();
        let (models, blocks) = coded(&mt);
        assert!(decoded(&models, &blocks, &mt, Limits::default()).as_ref() == Ok(&mt));
        for cut in 0..blocks[0].len() {
            assert!(decoded(&models, &[blocks[0][..cut].to_vec()], &mt, Limits::default()).is_err());
        }
        for bit in 0..8 * blocks[0].len() {
            let mut damaged = blocks.clone();
            damaged[0][bit / 8] ^= 1 << (bit % 8);
            assert!(decoded(&models, &damaged, &mt, Limits::default()).as_ref() != Ok(&mt));
        }
        let limits = Limits { memory_bytes: mt.bytes() / 2, ..Limits::default() };
        let refused = decoded(&models, &blocks, &mt, limits);
        assert!(matches!(refused, Err(FormatError::Limit { .. })));
    }
}

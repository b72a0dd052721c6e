//! `EXPL`: a block of updates that are spelled out.

use super::check_bytes;
use super::largest;
use super::read_delta;
use super::read_errors;
use super::write_deltas;
use super::write_errors;
use super::write_positions;
use crate::format::FormatError;
use crate::format::Limits;
use crate::format::read::Reader;
use crate::format::write;
use crate::mt::BaseMeshError;
use crate::mt::ErrorCode;
use crate::mt::ExplicitMt;
use crate::mt::ExplicitUpdate;
use crate::mt::UpdateId;
use crate::mt::VertexId;
use std::ops::Range;

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

/// Writes the columns of the updates `first .. end`.
pub fn write(out: &mut Vec<u8>, mt: &ExplicitMt, first: u32, end: u32) {
    let scratch = &mut Vec::new();
    let updates = || (first..end).map(UpdateId);
    let created = |u| {
        let range = mt.created(u);
        (range.start..range.end).map(VertexId)
    };
    write::column(out, scratch, |out| {
        updates().for_each(|u| write::varint(out, created(u).len() as u64));
    });
    write_positions(out, scratch, updates().flat_map(created).map(|v| mt.position(v)));
    write::column(out, scratch, |out| {
        for u in updates() {
            write::varint(out, mt.removed(u).len() as u64);
            // Backwards from the newest; `push` has checked that they are there, and sorted them.
            let mut above = mt.inserted(u).start;
            for &t in mt.removed(u).iter().rev() {
                write::varint(out, u64::from(above - 1 - t));
                above = t;
            }
        }
    });
    write::column(out, scratch, |out| updates().for_each(|u| write_inserted(out, mt, u)));
    write_errors(out, scratch, updates().map(|u| mt.errors(u)));
    for field in 0..mt.fields() {
        let levels = updates().flat_map(created).map(|v| mt.levels(v)[field]);
        write::column(out, scratch, |out| write_deltas(out, levels));
    }
}

/// Corners are told by their places among the vertices at hand, which ascend. The first two corners of a tetrahedron
/// ascend, too, and are the lowest; so do the tetrahedra.
fn write_inserted(out: &mut Vec<u8>, mt: &ExplicitMt, u: UpdateId) {
    let range = mt.inserted(u);
    let vertices = at_hand(mt, mt.removed(u), mt.created(u));
    write::varint(out, range.len() as u64);
    let mut last = 0;
    for tet in &mt.tets()[range.start as usize..range.end as usize] {
        // `push` has checked that they are at hand.
        let [a, b, c, d] = tet.map(|v| vertices.partition_point(|&other| other < v));
        for step in [a - last, b - a, c - b, d - b] {
            write::varint(out, step as u64);
        }
        last = a;
    }
}

/// The vertices that an update can use: those of what it removes, and those that appear with it; ascending.
pub fn at_hand(mt: &ExplicitMt, removed: &[u32], created: Range<u32>) -> Vec<u32> {
    let mut vertices: Vec<u32> = removed.iter().flat_map(|&t| mt.tets()[t as usize]).collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices.extend(created);
    vertices
}

/// The columns of a block that are read update by update.
struct Columns<'a> {
    created: Reader<'a>,
    positions: Reader<'a>,
    removed: Reader<'a>,
    inserted: Reader<'a>,
    errors: Reader<'a>,
    fields: Vec<Reader<'a>>,
}

/// What has been read of an update; reused from one to the next.
#[derive(Default)]
struct Parts {
    positions: Vec<[i32; 3]>,
    levels: Vec<i32>,
    removed: Vec<u32>,
    inserted: Vec<[u32; 4]>,
    /// The last vertex of the update before.
    position: [i32; 3],
    level: Vec<i32>,
}

/// Reads `count` updates into the MT.
pub fn read(
    mut reader: Reader<'_>,
    mt: &mut ExplicitMt,
    count: u32,
    limits: &Limits,
) -> Result<(), FormatError> {
    let mut columns = Columns {
        created: reader.column()?,
        positions: reader.column()?,
        removed: reader.column()?,
        inserted: reader.column()?,
        errors: reader.column()?,
        fields: (0..mt.fields()).map(|_| reader.column()).collect::<Result<_, _>>()?,
    };
    reader.end()?;
    let mut parts = Parts { level: vec![0; mt.fields()], ..Parts::default() };
    let mut last = vec![ErrorCode::MAX; mt.fields()];
    for _ in 0..count {
        read_errors(&mut columns.errors, &mut last)?;
        parts.read(&mut columns, mt)?;
        let Parts { positions, levels, removed, inserted, .. } = &parts;
        let grows = bytes_of(positions.len(), mt.fields(), removed.len(), inserted.len());
        check_bytes(mt.held_bytes() + grows, limits)?;
        mt.push(&ExplicitUpdate { positions, levels, removed, inserted, errors: &last })?;
    }
    mt.set_to_come(largest(&last));
    let Columns { created, positions, removed, inserted, errors, fields } = columns;
    [created, positions, removed, inserted, errors].into_iter().chain(fields).try_for_each(Reader::end)
}

impl Parts {
    /// Reads an update. Vectors grow with the bytes that are there: a count alone reserves nothing.
    fn read(&mut self, columns: &mut Columns<'_>, mt: &ExplicitMt) -> Result<(), FormatError> {
        self.positions.clear();
        self.levels.clear();
        for _ in 0..columns.created.varint()? {
            self.position.iter_mut().try_for_each(|x| read_delta(&mut columns.positions, x).map(drop))?;
            self.positions.push(self.position);
            for (level, column) in self.level.iter_mut().zip(&mut columns.fields) {
                read_delta(column, level)?;
            }
            self.levels.extend_from_slice(&self.level);
        }
        self.read_removed(&mut columns.removed, mt.tets().len() as u32)?;
        let first = mt.vertices();
        let vertices = at_hand(mt, &self.removed, first..first + self.positions.len() as u32);
        self.read_inserted(&mut columns.inserted, &vertices)
    }

    fn read_removed(&mut self, column: &mut Reader<'_>, mut above: u32) -> Result<(), FormatError> {
        self.removed.clear();
        for _ in 0..column.varint()? {
            let distance = column.varint()?;
            let t = above.checked_sub(1).and_then(|newest| newest.checked_sub(distance));
            above = t.ok_or_else(|| column.corrupt("an update removes a tetrahedron that is not there"))?;
            self.removed.push(above);
        }
        Ok(())
    }

    fn read_inserted(&mut self, column: &mut Reader<'_>, vertices: &[u32]) -> Result<(), FormatError> {
        self.inserted.clear();
        let mut last = 0;
        for _ in 0..column.varint()? {
            let mut next = |from: usize| {
                let place = from + column.varint()? as usize;
                let vertex = vertices.get(place).copied();
                let unknown = "an update uses a vertex that is neither new nor of what it removes";
                vertex.map(|v| (place, v)).ok_or_else(|| column.corrupt(unknown))
            };
            let (first, a) = next(last)?;
            let (second, b) = next(first)?;
            let [(_, c), (_, d)] = [next(second)?, next(second)?];
            self.inserted.push([a, b, c, d]);
            last = first;
        }
        Ok(())
    }
}

/// The reference mesh must have as many vertices and tetrahedra as the description tells.
pub fn check_reference(mt: &ExplicitMt) -> Result<(), BaseMeshError> {
    let info = mt.info();
    if mt.reference_counts() != [info.vertices, info.tetrahedra] {
        return Err(BaseMeshError::Info("the reference mesh has another size than the description tells"));
    }
    Ok(())
}

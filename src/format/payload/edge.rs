//! `UPDT`: a block of vertex splits.

use super::largest;
use super::read_errors;
use super::write_errors;
use crate::format::FormatError;
use crate::format::read::Reader;
use crate::format::write;
use crate::mt::BaseMeshError;
use crate::mt::EdgeMt;
use crate::mt::ErrorCode;
use crate::mt::MtInfo;
use crate::mt::UpdateId;
use crate::mt::VertexId;
use crate::mt::VertexSplit;

/// Bytes that an update takes in memory.
pub fn update_bytes(fields: u64) -> u64 {
    34 + 4 * fields
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

/// Writes the columns of the updates `first .. end`.
pub fn write(out: &mut Vec<u8>, mt: &EdgeMt, first: u32, end: u32) {
    let scratch = &mut Vec::new();
    let splits = || (first..end).map(|k| mt.split(UpdateId(k)));
    let newest = (mt.base().positions.len() as u32).wrapping_sub(1);
    write::column(out, scratch, |out| {
        for (k, split) in (first..end).zip(splits()) {
            // `push` has checked that the vertex is older than the update.
            write::varint(out, u64::from(newest.wrapping_add(2 * k).wrapping_sub(split.vertex.0)));
        }
    });
    write::column(out, scratch, |out| {
        splits().for_each(|split| split.offset.iter().for_each(|&d| write::zigzag(out, d)));
    });
    write::column(out, scratch, |out| splits().for_each(|split| write::varint(out, split.mask)));
    write_errors(out, scratch, splits().map(|split| split.errors));
    for field in 0..mt.info().fields.len() {
        write::column(out, scratch, |out| {
            splits().for_each(|split| write::zigzag(out, split.field_offsets[field]));
        });
    }
}

/// Reads `count` updates into the MT.
pub fn read(mut reader: Reader<'_>, mt: &mut EdgeMt, count: u32) -> Result<(), FormatError> {
    let (mut vertices, mut offsets) = (reader.column()?, reader.column()?);
    let (mut masks, mut errors) = (reader.column()?, reader.column()?);
    let mut fields = (0..mt.info().fields.len()).map(|_| reader.column()).collect::<Result<Vec<_>, _>>()?;
    reader.end()?;
    let mut field_offsets = vec![0; fields.len()];
    let mut last = vec![ErrorCode::MAX; fields.len()];
    for _ in 0..count {
        read_errors(&mut errors, &mut last)?;
        for (offset, column) in field_offsets.iter_mut().zip(&mut fields) {
            *offset = column.zigzag()?;
        }
        mt.push(&VertexSplit {
            vertex: read_vertex(&mut vertices, mt)?,
            offset: [offsets.zigzag()?, offsets.zigzag()?, offsets.zigzag()?],
            field_offsets: &field_offsets,
            mask: masks.varint64()?,
            errors: &last,
        })?;
    }
    mt.set_to_come(largest(&last));
    [vertices, offsets, masks, errors].into_iter().chain(fields).try_for_each(Reader::end)
}

/// The vertex that the next update splits, told as its distance from the newest.
fn read_vertex(column: &mut Reader<'_>, mt: &EdgeMt) -> Result<VertexId, FormatError> {
    let vertices = mt.base().positions.len() as u32 + 2 * mt.updates();
    let distance = column.varint()?;
    let vertex = vertices.checked_sub(1).and_then(|newest| newest.checked_sub(distance));
    vertex.map(VertexId).ok_or_else(|| column.corrupt("an update splits a vertex that is not there yet"))
}

//! `INSV`: a block of vertex insertions, and what the base mesh tells besides itself.

use super::check_bytes;
use super::largest;
use super::read_errors;
use super::write_errors;
use crate::format::FormatError;
use crate::format::Limits;
use crate::format::read::Reader;
use crate::format::write;
use crate::mesh::NONE;
use crate::mt::BaseMesh;
use crate::mt::BaseMeshError;
use crate::mt::ErrorCode;
use crate::mt::MtInfo;
use crate::mt::MultiTessellation;
use crate::mt::NodeBits;
use crate::mt::UpdateId;
use crate::mt::VertexMt;

/// Nodes are written in units of so many bits.
const UNIT: u32 = 4;

/// Most units of a node.
const MAX_UNITS: u32 = (1 << 13) - 1;

/// Bytes that every update takes in memory: a vertex, its own loop, the size of what it removes.
pub fn least_update_bytes(info: &MtInfo) -> u64 {
    let levels: u64 = info.fields.iter().map(|field| u64::from(field.bits)).sum();
    (3 * u64::from(info.lattice.bits) + levels + 9) / 8 + 4
}

/// An insertion adds one vertex.
pub fn check_counts(info: &MtInfo, base_vertices: u64) -> Result<(), BaseMeshError> {
    let vertices = base_vertices + u64::from(info.updates);
    if vertices != u64::from(info.vertices) {
        return Err(BaseMeshError::Info("base vertices and updates do not add up to the reference vertices"));
    }
    if vertices >= u64::from(u32::MAX) {
        return Err(BaseMeshError::Info("more vertices than 32 bits can number"));
    }
    Ok(())
}

/// Writes the column that follows those of the base mesh: whether every update makes the mesh larger, how many children
/// an update has at most, and which update removes each base tetrahedron.
pub fn write_base(out: &mut Vec<u8>, mt: &VertexMt) {
    write::column(out, &mut Vec::new(), |out| {
        write::varint(out, u64::from(mt.always_grows()));
        write::varint(out, u64::from(mt.most_children()));
        // NONE becomes 0.
        mt.base_removers().iter().for_each(|u| write::varint(out, u64::from(u.wrapping_add(1))));
    });
}

/// Reads that column.
pub fn read_base(mut column: Reader<'_>, info: MtInfo, base: BaseMesh) -> Result<VertexMt, FormatError> {
    let always_grows = match column.varint()? {
        0 => false,
        1 => true,
        _ => return Err(column.corrupt("whether updates make the mesh larger is neither 0 nor 1")),
    };
    let most_children = column.varint()?;
    let mut removers = Vec::new();
    for _ in 0..base.tets.len() {
        removers.push(match column.varint()? {
            0 => NONE,
            u => u - 1,
        });
    }
    let damaged = column.corrupt("a base tetrahedron is removed by an update that there is not");
    column.end()?;
    VertexMt::new(info, base, removers, most_children, always_grows).map_err(|_| damaged)
}

/// Writes the columns of the updates `first .. end`.
pub fn write(out: &mut Vec<u8>, mt: &VertexMt, first: u32, end: u32) {
    let scratch = &mut Vec::new();
    let updates = || (first..end).map(UpdateId);
    let mut nodes = NodeBits::default();
    write::column(out, scratch, |out| {
        for node in updates().map(|u| mt.node(u)) {
            write::varint(out, node.len() / u64::from(UNIT));
            nodes.extend(&node);
        }
    });
    write::column(out, scratch, |out| {
        out.extend((0..nodes.len()).step_by(8).map(|at| nodes.get(at, 8) as u8));
    });
    write_errors(out, scratch, updates().map(|u| mt.errors_of(u)));
}

/// Reads `count` updates into the MT.
pub fn read(
    mut reader: Reader<'_>,
    mt: &mut VertexMt,
    count: u32,
    limits: &Limits,
) -> Result<(), FormatError> {
    let (mut lengths, mut nodes, mut errors) = (reader.column()?, reader.column()?, reader.column()?);
    reader.end()?;
    let mut all = NodeBits::default();
    while !nodes.is_empty() {
        all.push(u64::from(nodes.u8()?), 8);
    }
    let (mut at, mut last) = (0, vec![ErrorCode::MAX; mt.info().fields.len()]);
    let mut node = NodeBits::default();
    for _ in 0..count {
        read_errors(&mut errors, &mut last)?;
        let units = lengths.varint()?;
        let bits = u64::from(units * UNIT);
        if units > MAX_UNITS || at + bits > all.len() {
            return Err(lengths.corrupt("a node is longer than what there is of it"));
        }
        node.clear();
        for start in (0..bits).step_by(32) {
            let width = (bits - start).min(32) as u32;
            node.push(all.get(at + start, width), width);
        }
        at += bits;
        check_bytes(mt.bytes() + bits / 8 + 16, limits)?;
        mt.push(&node, &last)?;
    }
    mt.set_to_come(largest(&last));
    if all.len() - at >= 8 || all.get(at, 8) != 0 {
        return Err(nodes.corrupt("something follows the last node"));
    }
    [lengths, nodes, errors].into_iter().try_for_each(Reader::end)
}

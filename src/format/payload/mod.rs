//! What is in each kind of section: one writer and one reader a kind, side by side. Each kind of MT has a file of its own, and
//! the rest knows of it what [`codec`] says.

mod base;
pub mod bounds;
mod changes;
pub mod codec;
pub mod edge;
pub mod exact;
pub mod extremes;
mod families;
pub mod half_edge;
pub mod histogram;
pub mod index;
mod info;
pub mod kind_codec;
pub mod regions;
mod vertex;

use super::coder::{Models, Put, Source};
use super::limits::check_bytes;
use super::read::Reader;
use super::{FormatError, Limits, write};
use crate::mt::{BaseMesh, MtInfo};
pub use changes::FieldPart;
use codec::{Codec, Head, Started};
use families::BASE_LEVEL;
pub use families::parts;
pub use info::{Metadata, has_many_tets, read_info, write_info};
use kind_codec::KindCodec;

/// Puts what is coded of the base mesh.
pub fn put_base(out: &mut impl Put, mt: &impl Codec) {
    base::put(out, mt.base());
    mt.put_head(out);
}

/// Puts the levels of one field at the base vertices.
pub fn put_base_field(out: &mut impl Put, mt: &impl Codec, field: usize) {
    let mut last = 0;
    // Levels stand vertex by vertex; those of this field begin at its own place in the first one.
    for &level in mt.base().values.iter().skip(field).step_by(mt.info().fields.len()) {
        out.signed(BASE_LEVEL, 0, level - last);
        last = level;
    }
    let jumping = mt.regions().filter(|regions| regions.has_sides()).map(|regions| &regions.sides);
    if let Some(sides) = jumping.filter(|sides| sides.jumps[field]) {
        half_edge::put_base_sides(out, &sides.levels, sides.jumps.len(), field);
    }
}

/// Appends what stands in front of the coded part of a `BASE` section.
pub fn write_base_head(out: &mut Vec<u8>, mt: &impl Codec) {
    write::varint(out, mt.base().positions.len() as u64);
    write::varint(out, mt.base().tets.len() as u64);
    // Else the index says it.
    if !mt.info().kind.is_paged() {
        out.push(mt.page_bits() as u8);
    }
}

/// A base mesh whose levels have not all arrived.
#[derive(Debug)]
pub struct BaseParts {
    base: BaseMesh,
    head: Box<dyn Head>,
    /// log2 of the updates of a block.
    pub block_bits: u32,
    levels: Vec<Vec<i32>>,
    /// For each field that has arrived the levels of its base vertices in further regions, if it jumps.
    sides: Vec<Option<Vec<i32>>>,
}

/// Vertices and tetrahedra that a byte of a base mesh can stand for at most. Symbols may take no bits: without this, a few
/// bytes could claim what fills all memory that is allowed.
const MOST_IN_A_BYTE: u64 = 4096;

/// Whether a base mesh of so many bytes can be so large.
pub fn is_backed([vertices, tets]: [u64; 2], bytes: usize) -> bool {
    vertices + tets <= MOST_IN_A_BYTE * (bytes as u64 + 1)
}

/// Reads a `BASE` section of an MT of which so many updates are going to be in memory at once. `block_bits` is what the index says,
/// if there is one.
pub fn read_base(
    mut reader: Reader<'_>,
    (info, codec): (&MtInfo, &KindCodec),
    models: &Models,
    updates: u32,
    block_bits: Option<u32>,
    limits: &Limits,
) -> Result<BaseParts, FormatError> {
    let [vertices, tets] = [reader.varint()?, reader.varint()?];
    (codec.check_counts)(info, u64::from(vertices))?;
    let counts = [vertices, tets].map(u64::from);
    check_memory((info, codec), counts, updates, limits)?;
    let block_bits = match block_bits {
        Some(bits) => bits,
        None => index::read_block_bits(&mut reader)?,
    };
    if !is_backed(counts, reader.len()) {
        return Err(reader.corrupt("the base mesh is larger than its bytes can code"));
    }
    let mut source = Source::new(reader, models)?;
    let base = base::read(&mut source, vertices, tets)?;
    let head = (codec.read_head)(&mut source, info, [vertices, tets], block_bits, limits)?;
    source.end()?;
    Ok(BaseParts { base, head, block_bits, levels: Vec::new(), sides: Vec::new() })
}

impl BaseParts {
    /// Fields that have arrived.
    pub fn fields(&self) -> usize {
        self.levels.len()
    }

    /// Reads the levels of the next field; `jumps`: at interfaces, too.
    pub fn read_field(
        &mut self,
        reader: Reader<'_>,
        models: &Models,
        jumps: bool,
    ) -> Result<(), FormatError> {
        let mut source = Source::new(reader, models)?;
        let (mut levels, mut last) = (Vec::new(), 0_i32);
        for _ in 0..self.base.positions.len() {
            last = last.wrapping_add(source.signed(BASE_LEVEL, 0)?);
            levels.push(last);
        }
        let tets = self.base.tets.len();
        let sides = jumps.then(|| half_edge::read_base_sides(&mut source, tets)).transpose()?;
        source.end()?;
        self.levels.push(levels);
        self.sides.push(sides);
        Ok(())
    }

    /// For each field the levels of base vertices in further regions, if it jumps.
    pub fn take_sides(&mut self) -> Vec<Option<Vec<i32>>> {
        std::mem::take(&mut self.sides)
    }

    /// The MT without updates, when all levels are there.
    pub fn start(self, info: MtInfo, tet_errors: bool) -> Result<Started, FormatError> {
        let Self { mut base, head, block_bits, levels, .. } = self;
        let vertices = base.positions.len();
        base.values = (0..vertices).flat_map(|v| levels.iter().map(move |levels| levels[v])).collect();
        base.check(&info)?;
        head.start(info, base, block_bits, tet_errors)
    }
}

/// Whether an MT with so many base vertices, base tetrahedra and updates fits the limits. Counts are checked against what
/// arrives, so it cannot grow beyond; kinds whose updates differ in size check each of these as well.
pub fn check_memory(
    (info, codec): (&MtInfo, &KindCodec),
    [vertices, tets]: [u64; 2],
    updates: u32,
    limits: &Limits,
) -> Result<(), FormatError> {
    let fields = info.fields.len() as u64;
    let base = vertices * (16 + 4 * fields) + tets * 16;
    check_bytes(base + u64::from(updates) * (codec.least_update_bytes)(info), limits)
}

/// The totals at the end of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Totals {
    pub updates: u32,
    pub sections: u32,
    /// Checksum of the sections' checksums.
    pub crc: u32,
}

pub fn write_end(out: &mut Vec<u8>, totals: Totals) {
    [totals.updates, totals.sections, totals.crc].into_iter().for_each(|number| write::u32(out, number));
}

pub fn read_end(mut reader: Reader<'_>) -> Result<Totals, FormatError> {
    let totals = Totals { updates: reader.u32()?, sections: reader.u32()?, crc: reader.u32()? };
    reader.end()?;
    Ok(totals)
}

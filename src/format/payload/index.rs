//! `INDX`: what is in each block and where, so that a client can fetch just the blocks that it needs.

use super::changes::{bound_of, upper_byte};
use crate::format::header::HEAD_BYTES;
use crate::format::read::Reader;
use crate::format::{FormatError, write};
use crate::mt::{ErrorCode, MtInfo, updates_of_page};
use std::ops::Range;

/// What the index of a file says of one block of updates.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BlockInfo {
    /// Bytes of its sections, heads included: what all fields share, then field by field.
    pub lengths: Vec<u32>,
    /// A box on the lattice that holds all tetrahedra that its updates, and all that depend on them, remove or insert: least and
    /// largest corner.
    pub bounds: [[i32; 3]; 2],
    /// For each field the largest error of its updates, or a little more: what depends on them has no larger one.
    pub errors: Vec<ErrorCode>,
    /// For each field the least and the largest level in these tetrahedra, or a little less and more.
    pub ranges: Vec<[i32; 2]>,
    /// The regions of these tetrahedra, ascending; empty if the MT has none.
    pub regions: Vec<u16>,
}

/// Far more than what stands between index and blocks can take, and far less than places in a file can be.
const MAX_SHARED: u64 = 1 << 48;

impl BlockInfo {
    /// Bytes of all its sections.
    pub fn len(&self) -> u64 {
        self.lengths.iter().map(|&length| u64::from(length)).sum()
    }

    /// Whether it has no sections, which no block of a file is like.
    pub fn is_empty(&self) -> bool {
        self.lengths.is_empty()
    }
}

/// The index of a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Index {
    /// log2 of the updates of a block; the last one may have fewer.
    pub block_bits: u32,
    /// Bytes of the sections between the index and the first block.
    pub shared: u64,
    /// The blocks, coarse to fine.
    pub blocks: Vec<BlockInfo>,
}

impl Index {
    /// For each block the bytes of the blocks in front of it; at last the bytes of all.
    pub fn block_starts(&self) -> Vec<u64> {
        let mut end = 0_u64;
        let ends = self.blocks.iter().map(|block| {
            end = end.saturating_add(block.len());
            end
        });
        std::iter::once(0).chain(ends).collect()
    }

    /// The updates of a block of an MT of so many.
    pub fn updates(&self, block: u32, updates: u32) -> Range<u32> {
        updates_of_page(self.block_bits, block, updates)
    }

    /// Widens the numbers of the blocks to those that the file can hold.
    pub fn round(&mut self, info: &MtInfo) {
        let (space, levels) = (shift(info.lattice.bits), info.fields.iter().map(|field| shift(field.bits)));
        let levels: Vec<u32> = levels.collect();
        for block in &mut self.blocks {
            for axis in 0..3 {
                block.bounds[0][axis] = block.bounds[0][axis] >> space << space;
                block.bounds[1][axis] = (((block.bounds[1][axis] - 1).max(0) >> space) + 1) << space;
            }
            for (range, &level) in block.ranges.iter_mut().zip(&levels) {
                range[0] = range[0] >> level << level;
                range[1] = (((range[1] - 1).max(0) >> level) + 1) << level;
            }
            for error in &mut block.errors {
                *error = bound_of(upper_byte(*error));
            }
        }
    }

    /// Appends the index; [`Index::round`] must have been called.
    pub fn write(&self, out: &mut Vec<u8>, info: &MtInfo) {
        out.push(self.block_bits as u8);
        write::varint(out, self.shared);
        write::varint(out, self.blocks.len() as u64);
        let space = shift(info.lattice.bits);
        for block in &self.blocks {
            block.lengths.iter().for_each(|&length| write::varint(out, u64::from(length)));
            let [low, high] = block.bounds;
            for (low, high) in low.into_iter().zip(high) {
                write::varint(out, (low >> space) as u64);
                write::varint(out, ((high - low) >> space) as u64);
            }
            for ((field, error), [low, high]) in info.fields.iter().zip(&block.errors).zip(&block.ranges) {
                out.push(upper_byte(*error));
                let level = shift(field.bits);
                write::varint(out, (low >> level) as u64);
                write::varint(out, ((high - low) >> level) as u64);
            }
            write::varint(out, RESERVED);
        }
    }

    /// Bytes that [`Index::read_start`] reads at most.
    pub const START_BYTES: u64 = 11;

    /// Reads what comes in front of the number of blocks: `block_bits` and `shared`.
    pub fn read_start(reader: &mut Reader<'_>) -> Result<(u32, u64), FormatError> {
        let block_bits = read_block_bits(reader)?;
        let shared = reader.varint64()?;
        if shared > MAX_SHARED {
            return Err(reader.corrupt("what the blocks share is longer than sections can be"));
        }
        Ok((block_bits, shared))
    }

    /// Reads the index of an MT.
    pub fn read(mut reader: Reader<'_>, info: &MtInfo) -> Result<Self, FormatError> {
        let (block_bits, shared) = Self::read_start(&mut reader)?;
        let count = reader.varint()?;
        if u64::from(count) != u64::from(info.updates).div_ceil(1 << block_bits) {
            return Err(reader.corrupt("the index does not have as many blocks as there are updates for"));
        }
        let mut index = Self { block_bits, shared, blocks: Vec::new() };
        for _ in 0..count {
            index.blocks.push(read_block(&mut reader, info)?);
        }
        reader.end()?;
        Ok(index)
    }
}

/// Behind what is said of a block.
const RESERVED: u64 = 0;

/// What block sizes may be.
pub const MIN_BLOCK_BITS: u32 = 4;
pub const MAX_BLOCK_BITS: u32 = 16;

/// Places in the index are on a lattice of eight bits.
fn shift(bits: u32) -> u32 {
    bits.saturating_sub(8)
}

/// log2 of the updates of a block.
pub fn read_block_bits(reader: &mut Reader<'_>) -> Result<u32, FormatError> {
    let bits = u32::from(reader.u8()?);
    if !(MIN_BLOCK_BITS..=MAX_BLOCK_BITS).contains(&bits) {
        return Err(reader.corrupt("a block must hold 2^4 to 2^16 updates"));
    }
    Ok(bits)
}

fn read_block(reader: &mut Reader<'_>, info: &MtInfo) -> Result<BlockInfo, FormatError> {
    let mut block = BlockInfo::default();
    for _ in 0..=info.fields.len() {
        let length = reader.varint()?;
        // Each is of a section. What had no length would be asked for, and never come.
        if (length as usize) < HEAD_BYTES {
            return Err(reader.corrupt("a part of a block is shorter than the head of a section"));
        }
        block.lengths.push(length);
    }
    let span = |reader: &mut Reader<'_>, bits: u32| -> Result<[i32; 2], FormatError> {
        let (low, size) = (reader.varint()?, reader.varint()?);
        let high = u64::from(low) + u64::from(size);
        if high > 1 << bits.min(8) {
            return Err(reader.corrupt("a block lies outside its lattice"));
        }
        Ok([low, high as u32].map(|x| (x << shift(bits)) as i32))
    };
    for axis in 0..3 {
        let [low, high] = span(reader, info.lattice.bits)?;
        (block.bounds[0][axis], block.bounds[1][axis]) = (low, high);
    }
    for field in &info.fields {
        block.errors.push(bound_of(reader.u8()?));
        block.ranges.push(span(reader, field.bits)?);
    }
    if reader.varint64()? != RESERVED {
        return Err(reader.corrupt("what is said of a block does not end with 0"));
    }
    Ok(block)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Lattice;
    use crate::mt::{FieldInfo, MtKind};

    fn info() -> MtInfo {
        MtInfo {
            kind: MtKind::HalfEdge,
            lattice: Lattice { origin: [0.0; 3], step: [1.0; 3], bits: 10 },
            fields: vec![FieldInfo { bits: 12, ..FieldInfo::default() }],
            vertices: 0,
            tetrahedra: 0,
            updates: 40,
            displacement_per_error: 1.0,
            quantization: 0.0,
            bounds: None,
        }
    }

    /// The index of 40 updates in blocks of 16.
    fn index() -> Index {
        let block = BlockInfo {
            lengths: vec![100, 20],
            bounds: [[0, 4, 8], [1024, 8, 12]],
            errors: vec![ErrorCode(3 << 8)],
            ranges: vec![[16, 4096]],
            regions: Vec::new(),
        };
        Index { block_bits: 4, shared: 1 << 40, blocks: vec![block; 3] }
    }

    fn read(index: &Index) -> Result<Index, FormatError> {
        let mut bytes = Vec::new();
        index.write(&mut bytes, &info());
        Index::read(Reader::new(&bytes, 0), &info())
    }

    #[test]
    fn an_index_comes_back() {
        assert_eq!(read(&index()), Ok(index()));
    }

    #[test]
    fn what_no_writer_can_mean_is_refused() {
        type Fault = (&'static str, fn(&mut Index));
        let faults: [Fault; 7] = [
            ("blocks of 2^3 updates", |index| index.block_bits = 3),
            ("blocks of 2^17 updates", |index| index.block_bits = 17),
            ("too much between index and blocks", |index| index.shared = MAX_SHARED + 1),
            ("too few blocks", |index| drop(index.blocks.pop())),
            ("too many blocks", |index| index.blocks.push(BlockInfo::clone(&index.blocks[2]))),
            ("a box beyond the lattice", |index| index.blocks[1].bounds[1][2] = 1028),
            ("levels beyond the lattice", |index| index.blocks[2].ranges[0][1] = 4112),
        ];
        for (what, fault) in faults {
            let mut index = index();
            fault(&mut index);
            assert!(matches!(read(&index), Err(FormatError::Corrupt { .. })), "{what}");
        }
        let mut bytes = Vec::new();
        index().write(&mut bytes, &info());
        *bytes.last_mut().expect("some bytes") = 1;
        let read = Index::read(Reader::new(&bytes, 0), &info());
        assert!(matches!(read, Err(FormatError::Corrupt { .. })), "another reserved number");
    }
}

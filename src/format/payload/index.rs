//! `INDX`: what is in each block and where, so that a client can fetch just the blocks that it needs.

use crate::format::read::Reader;
use crate::format::{FormatError, write};
use crate::mt::{ErrorCode, MtInfo, MtKind};
use std::ops::Range;

/// Most blocks that a block may depend on directly, so that an index is not larger than its file.
const MAX_PARENTS: u32 = 1 << 20;

/// What the index of a file says of one block of updates.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BlockInfo {
    /// Bytes of its sections, heads included: what all fields share, then field by field.
    pub lengths: Vec<u32>,
    /// A box on the lattice that holds all tetrahedra that its updates remove or insert: least and largest corner.
    pub bounds: [[i32; 3]; 2],
    /// For each field the largest error of its updates, or a little more.
    pub errors: Vec<ErrorCode>,
    /// For each field the least and the largest level in the tetrahedra that its updates remove or insert, or a little
    /// less and more.
    pub ranges: Vec<[i32; 2]>,
    /// The blocks that it depends on directly, ascending; all come before it.
    pub parents: Vec<u32>,
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
    /// The updates of a block of an MT of so many.
    pub fn updates(&self, block: u32, updates: u32) -> Range<u32> {
        let first = u64::from(block) << self.block_bits;
        let end = u64::from(updates);
        first.min(end) as u32..(first + (1 << self.block_bits)).min(end) as u32
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
                *error = ErrorCode(error.0.checked_next_multiple_of(1 << 8).unwrap_or(u16::MAX));
            }
        }
    }

    /// Appends the index; [`Index::round`] must have been called.
    pub fn write(&self, out: &mut Vec<u8>, info: &MtInfo) {
        out.push(self.block_bits as u8);
        write::varint(out, self.shared);
        write::varint(out, self.blocks.len() as u64);
        let space = shift(info.lattice.bits);
        for (at, block) in (0..).zip(&self.blocks) {
            block.lengths.iter().for_each(|&length| write::varint(out, u64::from(length)));
            let [low, high] = block.bounds;
            for (low, high) in low.into_iter().zip(high) {
                write::varint(out, (low >> space) as u64);
                write::varint(out, ((high - low) >> space) as u64);
            }
            for ((field, error), [low, high]) in info.fields.iter().zip(&block.errors).zip(&block.ranges) {
                out.push(error.0.div_ceil(1 << 8).min(0xFF) as u8);
                let level = shift(field.bits);
                write::varint(out, (low >> level) as u64);
                write::varint(out, ((high - low) >> level) as u64);
            }
            // From the newest one back: most are near.
            write::varint(out, block.parents.len() as u64);
            let mut next: u32 = at;
            for &parent in block.parents.iter().rev() {
                write::varint(out, u64::from(next - 1 - parent));
                next = parent;
            }
        }
    }

    /// Reads the index of an MT.
    pub fn read(mut reader: Reader<'_>, info: &MtInfo, parts: usize) -> Result<Self, FormatError> {
        let block_bits = u32::from(reader.u8()?);
        if !(MIN_BLOCK_BITS..=MAX_BLOCK_BITS).contains(&block_bits) {
            return Err(reader.corrupt("a block must hold 2^4 to 2^16 updates"));
        }
        let shared = reader.varint64()?;
        if shared > MAX_SHARED {
            return Err(reader.corrupt("what the blocks share is longer than sections can be"));
        }
        let count = reader.varint()?;
        if u64::from(count) != u64::from(info.updates).div_ceil(1 << block_bits) {
            return Err(reader.corrupt("the index does not have as many blocks as there are updates for"));
        }
        let mut index = Self { block_bits, shared, blocks: Vec::new() };
        for at in 0..count {
            index.blocks.push(read_block(&mut reader, info, parts, at)?);
        }
        reader.end()?;
        Ok(index)
    }
}

/// What block sizes may be.
pub const MIN_BLOCK_BITS: u32 = 4;
pub const MAX_BLOCK_BITS: u32 = 16;

/// Places in the index are on a lattice of eight bits.
fn shift(bits: u32) -> u32 {
    bits.saturating_sub(8)
}

fn read_block(
    reader: &mut Reader<'_>,
    info: &MtInfo,
    parts: usize,
    at: u32,
) -> Result<BlockInfo, FormatError> {
    let mut block = BlockInfo::default();
    for _ in 0..parts {
        block.lengths.push(reader.varint()?);
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
        let upper = reader.u8()?;
        block.errors.push(ErrorCode(if upper == 0xFF { u16::MAX } else { u16::from(upper) << 8 }));
        block.ranges.push(span(reader, field.bits)?);
    }
    let count = reader.varint()?;
    if info.kind == MtKind::HalfEdge && count > 0 {
        return Err(reader.corrupt("a block of a half-edge MT names blocks that it depends on"));
    }
    if count > at.min(MAX_PARENTS) {
        return Err(reader.corrupt("a block depends on more blocks than come before it"));
    }
    let mut next = at;
    for _ in 0..count {
        let parent = next.checked_sub(1).and_then(|last| last.checked_sub(reader.varint().ok()?));
        next = parent.ok_or_else(|| reader.corrupt("a block depends on one that does not come before it"))?;
        block.parents.push(next);
    }
    block.parents.reverse();
    Ok(block)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Lattice;
    use crate::mt::FieldInfo;

    fn info(kind: MtKind) -> MtInfo {
        MtInfo {
            kind,
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
        let block = |parents: &[u32]| BlockInfo {
            lengths: vec![100, 20],
            bounds: [[0, 4, 8], [1024, 8, 12]],
            errors: vec![ErrorCode(3 << 8)],
            ranges: vec![[16, 4096]],
            parents: parents.to_vec(),
        };
        Index { block_bits: 4, shared: 1 << 40, blocks: vec![block(&[]), block(&[0]), block(&[0, 1])] }
    }

    fn read(index: &Index, kind: MtKind) -> Result<Index, FormatError> {
        let mut bytes = Vec::new();
        index.write(&mut bytes, &info(kind));
        Index::read(Reader::new(&bytes, 0), &info(kind), 2)
    }

    #[test]
    fn an_index_comes_back() {
        assert_eq!(read(&index(), MtKind::Edge), Ok(index()));
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
            assert!(matches!(read(&index, MtKind::Edge), Err(FormatError::Corrupt { .. })), "{what}");
        }
        assert!(
            matches!(read(&index(), MtKind::HalfEdge), Err(FormatError::Corrupt { .. })),
            "half-edge MTs have no parents"
        );
        // The last block depends on two: these numbers are at the end.
        let mut bytes = Vec::new();
        index().write(&mut bytes, &info(MtKind::Edge));
        assert!(bytes.ends_with(&[2, 0, 0]));
        let parents: [(&str, &[u8]); 3] = [
            ("more blocks to depend on than come before", &[3, 0, 0]),
            ("one before the first", &[1, 2]),
            ("one before the first, as the second", &[2, 0, 1]),
        ];
        for (what, parents) in parents {
            let bytes = [&bytes[..bytes.len() - 3], parents].concat();
            let read = Index::read(Reader::new(&bytes, 0), &info(MtKind::Edge), 2);
            assert!(matches!(read, Err(FormatError::Corrupt { .. })), "{what}");
        }
        let mut free = index();
        free.blocks.iter_mut().for_each(|block| block.parents.clear());
        assert_eq!(read(&free, MtKind::HalfEdge), Ok(free));
    }
}

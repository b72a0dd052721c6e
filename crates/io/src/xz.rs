//! The `.xz` container around LZMA2 data, as VTK's LZMA compressor writes it: one block, one filter.
//!
//! The frame is walked here so that the unpacked size is known and bounded before anything is unpacked.

use crate::error::ReadReason;

const MAGIC: &[u8] = b"\xfd7zXZ\0";
const LZMA2: u8 = 0x21;
/// The check that VTK stores: CRC32.
const CHECK_CRC32: u8 = 1;
/// Bytes of the check after a block, by its kind.
const CHECK_SIZES: [usize; 16] = [0, 4, 4, 4, 8, 8, 8, 16, 16, 16, 32, 32, 32, 64, 64, 64];

/// Appends the `expected` bytes of the single block of an `.xz` stream to `data`.
pub(super) fn decompress(stream: &[u8], expected: usize, data: &mut Vec<u8>) -> Result<(), ReadReason> {
    let (check, after_header) = stream_header(stream).ok_or_else(|| damaged("no stream header"))?;
    let packed = block_body(after_header)?;
    let (length, unpacked) = lzma2_extent(packed).ok_or_else(|| damaged("a chunk is cut short"))?;
    if unpacked != expected {
        return Err(damaged("a block has another size than stated"));
    }
    let start = data.len();
    lzma_rs::lzma2_decompress(&mut &packed[..length], data).map_err(|e| damaged(&e.to_string()))?;
    // The check comes after the data, padded to a multiple of four bytes.
    let padded = packed.get(length.next_multiple_of(4)..);
    let stored = padded.and_then(|p| p.get(..CHECK_SIZES[usize::from(check)]));
    let stored = stored.ok_or_else(|| damaged("the check is cut short"))?;
    if check == CHECK_CRC32 && stored != crc32fast::hash(&data[start..]).to_le_bytes() {
        return Err(damaged("the check sum is wrong"));
    }
    Ok(())
}

fn damaged(what: &str) -> ReadReason {
    ReadReason::Damaged(format!("LZMA: {what}"))
}

/// The kind of check, and what follows the header.
fn stream_header(stream: &[u8]) -> Option<(u8, &[u8])> {
    let rest = stream.strip_prefix(MAGIC)?;
    let (flags, rest) = rest.split_first_chunk::<2>()?;
    let (crc, rest) = rest.split_first_chunk::<4>()?;
    let valid = flags[0] == 0 && flags[1] < 16 && crc32fast::hash(flags).to_le_bytes() == *crc;
    valid.then_some((flags[1], rest))
}

/// What follows the header of the first block, whose only filter must be LZMA2.
fn block_body(blocks: &[u8]) -> Result<&[u8], ReadReason> {
    let size = 4 * (usize::from(*blocks.first().ok_or_else(|| damaged("no block"))?) + 1);
    let header = blocks.get(..size).ok_or_else(|| damaged("the block header is cut short"))?;
    let (fields, crc) = header.split_at(size - 4);
    if size < 8 || crc32fast::hash(fields).to_le_bytes() != *crc {
        return Err(damaged("the block header is wrong"));
    }
    let flags = fields[1];
    let mut fields = &fields[2..];
    for optional_size in [0x40, 0x80] {
        if flags & optional_size != 0 {
            skip_number(&mut fields).ok_or_else(|| damaged("the block header is wrong"))?;
        }
    }
    if flags & 3 != 0 || fields.first() != Some(&LZMA2) {
        return Err(damaged("a filter other than LZMA2"));
    }
    Ok(&blocks[size..])
}

/// Steps over a number of variable length: seven bits a byte, the last one below 128.
fn skip_number(bytes: &mut &[u8]) -> Option<()> {
    let length = bytes.iter().position(|b| *b < 0x80)? + 1;
    *bytes = &bytes[length..];
    Some(())
}

/// How long the LZMA2 data at the start of `bytes` is, and how many bytes its chunks say they unpack to.
fn lzma2_extent(bytes: &[u8]) -> Option<(usize, usize)> {
    let (mut at, mut unpacked) = (0_usize, 0_usize);
    let pair = |at: usize| Some(usize::from(*bytes.get(at)?) << 8 | usize::from(*bytes.get(at + 1)?));
    loop {
        let control = *bytes.get(at)?;
        let size = match control {
            0 => return Some((at + 1, unpacked)),
            1 | 2 => {
                unpacked = unpacked.checked_add(pair(at + 1)? + 1)?;
                3 + pair(at + 1)? + 1
            }
            3..0x80 => return None,
            _ => {
                unpacked = unpacked.checked_add((usize::from(control & 0x1f) << 16) + pair(at + 1)? + 1)?;
                let properties = usize::from(control >= 0xc0);
                5 + properties + pair(at + 3)? + 1
            }
        };
        at += size;
    }
}

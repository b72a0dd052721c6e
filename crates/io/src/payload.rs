//! The data blocks of VTK XML files: length headers, base64, compression.
//!
//! A block is `[bytes][data]`, or with a compressor `[blocks][block size][last size][compressed sizes...][data]`,
//! all header numbers 32 or 64 bits wide. In base64 the header and the data may be padded separately.
//! Sizes in headers are compared with what is needed before they size anything.

use std::borrow::Cow;
use std::io::Read;

use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use base64::{Engine, alphabet};

use crate::error::{ReadReason, expect_count};
use crate::{shares, xz};

/// How the blocks of a file are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Compressor {
    Zlib,
    Lz4,
    Lzma,
}

/// How the blocks of a file are framed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Framing {
    /// Whether numbers have their most significant byte first.
    pub big: bool,
    /// Whether header numbers are 64 bits wide.
    pub wide: bool,
    /// How blocks are compressed, if they are.
    pub compressor: Option<Compressor>,
}

impl Framing {
    /// Bytes of a header number.
    pub fn width(self) -> usize {
        if self.wide { 8 } else { 4 }
    }

    /// A header number of these bytes.
    pub fn number(self, bytes: &[u8]) -> u64 {
        let fold = |n: u64, b: &u8| n << 8 | u64::from(*b);
        if self.big { bytes.iter().fold(0, fold) } else { bytes.iter().rev().fold(0, fold) }
    }
}

/// Where the bytes of a block come from.
pub(super) enum Source<'a> {
    /// The bytes themselves.
    Raw(&'a [u8]),
    /// Base64 text, and decoded bytes that were not asked for yet.
    Base64 { text: &'a [u8], rest: Vec<u8> },
}

impl<'a> Source<'a> {
    /// Base64 text.
    pub fn base64(text: &'a [u8]) -> Self {
        Self::Base64 { text, rest: Vec::new() }
    }

    /// The next `count` bytes.
    fn take(&mut self, count: usize) -> Result<Cow<'a, [u8]>, ReadReason> {
        match self {
            Self::Raw(bytes) => {
                let taken = bytes.split_off(..count).ok_or_else(|| truncated(count, bytes.len()))?;
                Ok(Cow::Borrowed(taken))
            }
            Self::Base64 { text, rest } => {
                while rest.len() < count {
                    let missing = count - rest.len();
                    let group = next_groups(text, missing);
                    if group.is_empty() {
                        return Err(truncated(count, rest.len()));
                    }
                    let before = rest.len();
                    decode_groups(&group, rest)?;
                    if rest.len() == before {
                        return Err(ReadReason::Damaged("base64: an empty group".into()));
                    }
                }
                let later = rest.split_off(count);
                Ok(Cow::Owned(std::mem::replace(rest, later)))
            }
        }
    }
}

const BASE64: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// Groups of four characters that a thread decodes at a time.
const GROUPS: usize = 1 << 15;

/// Appends to `bytes` what groups of four characters stand for.
pub(super) fn decode_groups(groups: &[u8], bytes: &mut Vec<u8>) -> Result<(), ReadReason> {
    let damaged = |error| ReadReason::Damaged(format!("base64: {error}"));
    if groups.len() <= 4 * GROUPS {
        return BASE64.decode_vec(groups, bytes).map_err(damaged);
    }
    bytes.reserve(groups.len() / 4 * 3);
    shares::append(bytes, groups.len() / 4, GROUPS, |share| {
        BASE64.decode(&groups[4 * share.start..4 * share.end]).map_err(damaged)
    })
}

/// The place of the first byte of a kind. Chunks without any are passed over as a whole, which compilers make vector instructions of.
pub(super) fn find(bytes: &[u8], is_it: impl Fn(u8) -> bool) -> Option<usize> {
    let (chunks, _) = bytes.as_chunks::<64>();
    let without = |chunk: &&[u8; 64]| !chunk.iter().fold(false, |found, byte| found | is_it(*byte));
    let start = 64 * chunks.iter().take_while(without).count();
    bytes[start..].iter().position(|byte| is_it(*byte)).map(|at| start + at)
}

/// Cuts whole groups of four characters off `text`: as many as `bytes` bytes need, or up to padding.
fn next_groups<'a>(text: &mut &'a [u8], bytes: usize) -> Cow<'a, [u8]> {
    *text = text.trim_ascii_start();
    let wanted = bytes.div_ceil(3).saturating_mul(4).min(text.len());
    let run = &text[..wanted];
    let end = find(run, |c| c <= b' ' || c == b'=').unwrap_or(wanted);
    let whole = end - end % 4;
    if whole > 0 {
        let (groups, after) = text.split_at(whole);
        *text = after;
        return Cow::Borrowed(groups);
    }
    // The group at hand is padded or cut by white space: collect it character by character.
    let mut group = Vec::with_capacity(4);
    while group.len() < 4
        && let Some((c, after)) = text.split_first()
    {
        *text = after;
        if !c.is_ascii_whitespace() {
            group.push(*c);
        }
    }
    Cow::Owned(group)
}

fn truncated(needed: usize, found: usize) -> ReadReason {
    ReadReason::Truncated { needed: needed as u64, found: found as u64 }
}

/// How many bytes a block holds, as it says.
pub(super) fn stated_bytes(mut source: Source<'_>, framing: Framing) -> Result<u64, ReadReason> {
    let first = header_number(&mut source, framing)?;
    if framing.compressor.is_none() {
        return Ok(first);
    }
    let (_, total) = block_sizes(&mut source, framing, first)?;
    Ok(total)
}

/// The bytes of each of so many compressed blocks, of the last one if it is smaller (else 0), and of all, unpacked.
fn block_sizes(
    source: &mut Source<'_>,
    framing: Framing,
    blocks: u64,
) -> Result<([u64; 2], u64), ReadReason> {
    let size = header_number(source, framing)?;
    let last = header_number(source, framing)?;
    let full = blocks.checked_sub(u64::from(last != 0));
    let total = full.and_then(|n| n.checked_mul(size)).and_then(|n| n.checked_add(last));
    Ok(([size, last], total.unwrap_or(u64::MAX)))
}

/// Reads one block that must hold exactly `needed` bytes.
pub(super) fn read_block<'a>(
    mut source: Source<'a>,
    framing: Framing,
    needed: usize,
) -> Result<Cow<'a, [u8]>, ReadReason> {
    let Some(compressor) = framing.compressor else {
        let stated = header_number(&mut source, framing)?;
        expect_count("bytes of data", needed, stated)?;
        return source.take(needed);
    };
    let blocks = header_number(&mut source, framing)?;
    let ([block_size, last_size], total) = block_sizes(&mut source, framing, blocks)?;
    let partial = u64::from(last_size != 0);
    expect_count("bytes of data", needed, total)?;
    let mut sizes = Vec::new();
    for _ in 0..blocks {
        sizes.push(header_number(&mut source, framing)?);
    }
    let packed = sizes.iter().map(|&size| source.take(to_usize(size)?)).collect::<Result<Vec<_>, _>>()?;
    let mut data = Vec::new();
    shares::append(&mut data, packed.len(), BLOCKS, |share| {
        let mut part = Vec::new();
        for i in share {
            let expected = to_usize(if i as u64 + partial < blocks { block_size } else { last_size })?;
            unpack(compressor, i, &packed[i], expected, &mut part)?;
        }
        Ok(part)
    })?;
    Ok(Cow::Owned(data))
}

/// Compressed blocks that a thread unpacks at a time. VTK's have 32 KiB each.
pub(super) const BLOCKS: usize = 4;

pub(super) fn to_usize(n: u64) -> Result<usize, ReadReason> {
    usize::try_from(n).map_err(|_| ReadReason::Truncated { needed: n, found: 0 })
}

fn header_number(source: &mut Source<'_>, framing: Framing) -> Result<u64, ReadReason> {
    Ok(framing.number(&source.take(framing.width())?))
}

/// Appends the `expected` bytes of compressed block number `i` to `data`.
pub(super) fn unpack(
    compressor: Compressor,
    i: usize,
    compressed: &[u8],
    expected: usize,
    data: &mut Vec<u8>,
) -> Result<(), ReadReason> {
    let before = data.len();
    decompress(compressor, compressed, expected, data)?;
    let found = data.len() - before;
    if found != expected {
        let what = format!("block {i} unpacks to {found} bytes instead of {expected}");
        return Err(ReadReason::Damaged(what));
    }
    Ok(())
}

/// Appends the `expected` bytes of a compressed block to `data`; at most one more when the block is damaged.
fn decompress(
    compressor: Compressor,
    compressed: &[u8],
    expected: usize,
    data: &mut Vec<u8>,
) -> Result<(), ReadReason> {
    match compressor {
        Compressor::Zlib => {
            let mut decoder = flate2::bufread::ZlibDecoder::new(compressed).take(expected as u64 + 1);
            decoder.read_to_end(data).map_err(|e| ReadReason::Damaged(format!("zlib: {e}")))?;
        }
        Compressor::Lz4 => {
            // A byte of LZ4 stands for at most 255: a block that claims more must not size the buffer.
            if expected / 255 > compressed.len() {
                return Err(ReadReason::Damaged("LZ4: a block too short for its size".into()));
            }
            let start = data.len();
            data.resize(start + expected, 0);
            let written = lz4_flex::block::decompress_into(compressed, &mut data[start..])
                .map_err(|e| ReadReason::Damaged(format!("LZ4: {e}")))?;
            data.truncate(start + written);
        }
        Compressor::Lzma => xz::decompress(compressed, expected, data)?,
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{BASE64, Source, find};
    use base64::Engine;

    #[test]
    fn long_base64_is_decoded_like_short_one() {
        let bytes: Vec<u8> = (0..500_000_u32).map(|x| (x.wrapping_mul(x) >> 7) as u8).collect();
        let text = BASE64.encode(&bytes);
        let lines: Vec<u8> = text.as_bytes().chunks(76).collect::<Vec<_>>().join(&b"\r\n"[..]);
        for text in [text.as_bytes(), &lines] {
            let mut source = Source::base64(text);
            assert_eq!(source.take(7).as_deref(), Ok(&bytes[..7]));
            assert_eq!(source.take(499_990).as_deref(), Ok(&bytes[7..499_997]));
            assert!(source.take(4).is_err());
            let mut damaged = text.to_vec();
            damaged[400_000] = b'!';
            assert!(Source::base64(&damaged).take(500_000).is_err());
        }
    }

    #[test]
    fn the_first_byte_of_a_kind_is_found_wherever_it_is() {
        let mut bytes = [b'a'; 200];
        assert_eq!(find(&bytes, |byte| byte == b'='), None);
        for at in (0..200).rev() {
            bytes[at] = b'=';
            assert_eq!(find(&bytes, |byte| byte == b'='), Some(at));
        }
    }
}

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
use crate::xz;

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
                    let decoded =
                        BASE64.decode(&group).map_err(|e| ReadReason::Damaged(format!("base64: {e}")))?;
                    if decoded.is_empty() {
                        return Err(ReadReason::Damaged("base64: an empty group".into()));
                    }
                    rest.extend_from_slice(&decoded);
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

/// Cuts whole groups of four characters off `text`: as many as `bytes` bytes need, or up to padding.
fn next_groups<'a>(text: &mut &'a [u8], bytes: usize) -> Cow<'a, [u8]> {
    *text = text.trim_ascii_start();
    let wanted = bytes.div_ceil(3).saturating_mul(4).min(text.len());
    let run = &text[..wanted];
    let end = run.iter().position(|c| *c == b'=' || c.is_ascii_whitespace()).unwrap_or(wanted);
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
    let block_size = header_number(&mut source, framing)?;
    let last_size = header_number(&mut source, framing)?;
    let partial = u64::from(last_size != 0);
    let full_blocks = blocks.checked_sub(partial);
    let total = full_blocks.and_then(|n| n.checked_mul(block_size)).and_then(|n| n.checked_add(last_size));
    expect_count("bytes of data", needed, total.unwrap_or(u64::MAX))?;
    let mut sizes = Vec::new();
    for _ in 0..blocks {
        sizes.push(header_number(&mut source, framing)?);
    }
    let mut data = Vec::new();
    for (i, size) in (0_u64..).zip(sizes) {
        let compressed = source.take(to_usize(size)?)?;
        let expected = to_usize(if i + partial < blocks { block_size } else { last_size })?;
        let before = data.len();
        decompress(compressor, &compressed, expected, &mut data)?;
        if data.len() - before != expected {
            let found = data.len() - before;
            return Err(ReadReason::Damaged(format!(
                "block {i} unpacks to {found} bytes instead of {expected}"
            )));
        }
    }
    Ok(Cow::Owned(data))
}

fn to_usize(n: u64) -> Result<usize, ReadReason> {
    usize::try_from(n).map_err(|_| ReadReason::Truncated { needed: n, found: 0 })
}

fn header_number(source: &mut Source<'_>, framing: Framing) -> Result<u64, ReadReason> {
    let bytes = source.take(if framing.wide { 8 } else { 4 })?;
    let fold = |n: u64, b: &u8| n << 8 | u64::from(*b);
    Ok(if framing.big { bytes.iter().fold(0, fold) } else { bytes.iter().rev().fold(0, fold) })
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
            let mut decoder = flate2::read::ZlibDecoder::new(compressed).take(expected as u64 + 1);
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

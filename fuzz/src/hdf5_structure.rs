//! Mutations of files in HDF5 and netCDF, field by field, behind checksums that are put right.
//!
//! Bytes at random hardly ever get past the checksums, nor lead anywhere: most of a file are addresses, sizes and counts. Structures of
//! HDF5 begin with a signature, and those of later versions end with a checksum of what is before. Nothing else is known of them here:
//! where a checksum is follows from the bytes, which it fits before they are mutated.

use hdf5_core::jenkins_lookup3;
use std::ops::Range;

/// What structures begin with; headers of objects in version 1 have nothing like it.
const SIGNATURES: [&[u8; 4]; 23] = [
    b"\x89HDF", b"OHDR", b"OCHK", b"TREE", b"SNOD", b"HEAP", b"GCOL", b"FRHP", b"FHDB", b"FHIB", b"FSHD",
    b"FSSE", b"BTHD", b"BTIN", b"BTLF", b"SMTB", b"SMLI", b"FAHD", b"FADB", b"EAHD", b"EAIB", b"EASB",
    b"EADB",
];

/// Those of the oldest version, of which no structure has a checksum.
const NO_CHECKSUM: [&[u8; 4]; 4] = [b"TREE", b"SNOD", b"HEAP", b"GCOL"];

/// What netCDF's own formats begin with, whose numbers are big-endian.
const CLASSIC: &[u8] = b"CDF";

/// The most bytes of a structure with a checksum.
const LONGEST: usize = 1 << 11;

/// The sizes of blocks of heaps that are looked at.
const HEAP_BLOCKS: [usize; 3] = [512, 1024, 2048];

/// A number from another one: xorshift.
struct Random(u64);

impl Random {
    /// Below `end`, which is not 0.
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % end
    }
}

/// Mutates the first `size` bytes of `data`, to no more than `most`; returns how many there are then. `otherwise` mutates bytes without
/// knowing what they are.
pub fn mutate(
    data: &mut [u8],
    size: usize,
    most: usize,
    seed: u32,
    otherwise: fn(&mut [u8], usize, usize) -> usize,
) -> usize {
    let mut random = Random(u64::from(seed) << 32 | 0x9E37_79B9);
    let checksums = checksums(&data[..size]);
    let mut size = size;
    for _ in 0..=random.below(4) {
        size = match random.below(12) {
            0 => otherwise(data, size, most),
            1 => copy_structure(data, size, most, &mut random),
            2..=4 => {
                change_address(&mut data[..size], &mut random);
                size
            }
            5..=8 => {
                change_field(&mut data[..size], &mut random);
                size
            }
            _ => {
                change_number(&mut data[..size], &mut random);
                size
            }
        };
    }
    repair(&mut data[..size], &checksums);
    size
}

/// Where structures begin.
fn starts(bytes: &[u8]) -> Vec<usize> {
    // Few bytes are any signature's first: comparisons are slow where coverage is counted.
    let may_start = |byte: u8| byte.is_ascii_uppercase() || byte == SIGNATURES[0][0];
    let is_signature = |found: &[u8; 4]| SIGNATURES.contains(&found);
    let found = bytes.array_windows::<4>().enumerate();
    found.filter(|(_, found)| may_start(found[0]) && is_signature(found)).map(|(at, _)| at).collect()
}

/// A checksum: the bytes that it is of, and where it is. In blocks of heaps it is among them, as zeros.
struct Checksum {
    of: Range<usize>,
    at: usize,
}

impl Checksum {
    fn value(&self, bytes: &[u8]) -> u32 {
        if !self.of.contains(&self.at) {
            return jenkins_lookup3(&bytes[self.of.clone()]);
        }
        let mut block = bytes[self.of.clone()].to_vec();
        block[self.at - self.of.start..][..4].fill(0);
        jenkins_lookup3(&block)
    }

    fn is_right(&self, bytes: &[u8]) -> bool {
        self.of.end.max(self.at + 4) <= bytes.len()
            && bytes[self.at..self.at + 4] == self.value(bytes).to_le_bytes()
    }
}

/// The checksums of a file that are right.
fn checksums(bytes: &[u8]) -> Vec<Checksum> {
    let found = |start: usize| {
        if let Some(end) = end_of_header(bytes, start) {
            return Some(Checksum { of: start..end, at: end });
        }
        if bytes[start..].starts_with(b"FHDB") {
            return checksum_of_heap_block(bytes, start);
        }
        if NO_CHECKSUM.iter().any(|signature| bytes[start..].starts_with(*signature)) {
            return None;
        }
        let ends = start + 4..(start + LONGEST).min(bytes.len().saturating_sub(4));
        ends.map(|end| Checksum { of: start..end, at: end }).find(|checksum| checksum.is_right(bytes))
    };
    starts(bytes).into_iter().filter_map(found).collect()
}

/// In blocks of heaps the checksum follows the address of the heap and the place of the block, of some bytes.
fn checksum_of_heap_block(bytes: &[u8], start: usize) -> Option<Checksum> {
    let places = (2..=8).flat_map(|place| HEAP_BLOCKS.map(|size| (place, size)));
    let checksum = |(place, size)| Checksum { of: start..start + size, at: start + 13 + place };
    places.map(checksum).find(|checksum| checksum.is_right(bytes))
}

/// Where the checksum of an object's header is, if there is one at this place.
fn end_of_header(bytes: &[u8], start: usize) -> Option<usize> {
    let header = bytes[start..].strip_prefix(b"OHDR")?;
    let flags = *header.get(1)?;
    let before = 6 + if flags & 0x20 != 0 { 16 } else { 0 } + if flags & 0x10 != 0 { 4 } else { 0 };
    let width = 1 << (flags & 3);
    let size = bytes.get(start + before..start + before + width)?;
    let size = size.iter().rev().fold(0_usize, |size, byte| size << 8 | usize::from(*byte));
    let end = start.checked_add(before + width)?.checked_add(size)?;
    (end.checked_add(4)? <= bytes.len()).then_some(end)
}

/// Puts checksums right: those that were there, and those of headers, whose sizes may have changed.
fn repair(bytes: &mut [u8], checksums: &[Checksum]) {
    let headers = starts(bytes).into_iter().filter_map(|start| {
        let end = end_of_header(bytes, start)?;
        Some(Checksum { of: start..end, at: end })
    });
    let headers: Vec<Checksum> = headers.collect();
    for checksum in checksums.iter().chain(&headers) {
        if checksum.of.end.max(checksum.at + 4) <= bytes.len() {
            let value = checksum.value(bytes);
            bytes[checksum.at..checksum.at + 4].copy_from_slice(&value.to_le_bytes());
        }
    }
}

/// A number that may be wrong where `old` is right.
fn other_number(old: u64, bytes: &[u8], random: &mut Random) -> u64 {
    match random.below(12) {
        0 => 0,
        1 => 1,
        2 => u64::MAX,
        3 => bytes.len() as u64,
        4 => starts(bytes).get(random.below(64)).map_or(old, |start| *start as u64),
        5 => old.wrapping_add(1),
        6 => old.wrapping_sub(1),
        7 => old.wrapping_mul(2),
        8 => 1 << random.below(64),
        9 => old ^ 1 << random.below(64),
        10 => (1 << random.below(63)) - 1,
        _ => random.below(256) as u64,
    }
}

/// Changes the number in so many bytes.
fn change(bytes: &mut [u8], at: usize, width: usize, random: &mut Random) {
    let Some(place) = bytes.get(at..at + width) else { return };
    let is_big = bytes.starts_with(CLASSIC);
    let mut old = [0; 8];
    old[..width].copy_from_slice(place);
    if is_big {
        old[..width].reverse();
    }
    let mut new = other_number(u64::from_le_bytes(old), bytes, random).to_le_bytes();
    if is_big {
        new[..width].reverse();
    }
    bytes[at..at + width].copy_from_slice(&new[..width]);
}

/// Changes a field of a structure: near its beginning there are versions, sizes and counts.
fn change_field(bytes: &mut [u8], random: &mut Random) {
    let starts = starts(bytes);
    if starts.is_empty() {
        return change_number(bytes, random);
    }
    let start = starts[random.below(starts.len())];
    let reach = [16, 64, 512][random.below(3)];
    change(bytes, start + 4 + random.below(reach), 1 << random.below(4), random);
}

/// Changes what looks like an address.
fn change_address(bytes: &mut [u8], random: &mut Random) {
    let first = random.below(bytes.len().max(1));
    let is_address = |at: &usize| {
        let value = bytes
            .get(*at..*at + 8)
            .map(|place| place.iter().rev().fold(0, |sum, byte| sum << 8 | u64::from(*byte)));
        value.is_some_and(|value| (8..bytes.len() as u64).contains(&value))
    };
    if let Some(at) = (first..bytes.len()).find(is_address) {
        change(bytes, at, 8, random);
    }
}

/// Changes a number at any place that is a multiple of its width, or a few bytes behind it.
fn change_number(bytes: &mut [u8], random: &mut Random) {
    let width = 1 << random.below(4);
    let at = random.below(bytes.len().max(1)) / width * width;
    let at = if bytes.starts_with(CLASSIC) { at } else { at + random.below(2) * 4 };
    change(bytes, at, width, random);
}

/// Copies a structure over another one, or behind all.
fn copy_structure(data: &mut [u8], size: usize, most: usize, random: &mut Random) -> usize {
    let starts = starts(&data[..size]);
    if starts.is_empty() {
        return size;
    }
    let from = starts[random.below(starts.len())];
    let length = (1 << (3 + random.below(8))).min(size - from);
    let to = if random.below(4) == 0 { size } else { starts[random.below(starts.len())] };
    let end = (to + length).min(most).min(data.len());
    if end <= to {
        return size;
    }
    data.copy_within(from..from + (end - to), to);
    size.max(end)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn checksums_are_right_after_a_mutation() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/io/tests/data");
        for (name, least) in
            [("steps.vtkhdf", 20), ("netcdf4.exo", 10), ("dense.vtkhdf", 10), ("pieces.vtkhdf", 0)]
        {
            let file = fs::read(format!("{folder}/{name}")).expect("a file");
            let found = checksums(&file).len();
            assert!(found >= least, "{name}: {found}");
            for seed in 1..50 {
                let mut data = file.clone();
                data.resize(file.len() + 4096, 0);
                let most = data.len();
                let size = mutate(&mut data, file.len(), most, seed, |_, size, _| size);
                let headers = starts(&data[..size]).into_iter().filter_map(|start| {
                    let end = end_of_header(&data[..size], start)?;
                    Some(Checksum { of: start..end, at: end })
                });
                assert!(
                    headers.filter(|header| !header.is_right(&data[..size])).count() <= 1,
                    "{name} {seed}"
                );
            }
        }
    }
}

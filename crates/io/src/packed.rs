//! Files that are packed as a whole: gzip is unpacked, whatever is in it; others are refused by name.

use std::borrow::Cow;
use std::io::Read;

use flate2::read::MultiGzDecoder;

use crate::error::ReadReason;
use crate::memory::{FileBytes, Held, MemoryLimit};

/// The first bytes of a file in gzip.
const GZIP: &[u8] = b"\x1f\x8b\x08";

/// Most bytes that a file becomes.
const MOST_BYTES: u64 = if usize::BITS < 64 { u32::MAX as u64 / 2 } else { 1 << 38 };
/// Bytes that are unpacked at a time.
const STEP: usize = 1 << 20;

/// First bytes of other packed files, what packs them, and what unpacks them.
const OTHERS: [(&[u8], &str, &str); 9] = [
    (b"BZh", "bzip2", "bunzip2"),
    (b"\xfd7zXZ\0", "xz", "unxz"),
    (b"\x28\xb5\x2f\xfd", "Zstandard", "unzstd"),
    (b"PK\x03\x04", "ZIP", "unzip"),
    (b"7z\xbc\xaf\x27\x1c", "7-Zip", "7z x"),
    (b"\x04\x22\x4d\x18", "LZ4", "unlz4"),
    (b"\x78\x01", "zlib", "zlib-flate -uncompress"),
    (b"\x78\x9c", "zlib", "zlib-flate -uncompress"),
    (b"\x78\xda", "zlib", "zlib-flate -uncompress"),
];

/// Whether these are the first bytes of a file in gzip.
pub(super) fn is_gzip(bytes: &[u8]) -> bool {
    bytes.starts_with(GZIP)
}

/// The bytes of a file, unpacked if it is in gzip.
pub(super) fn unpacked<'a>(bytes: &'a [u8], memory: &MemoryLimit) -> Result<FileBytes<'a>, ReadReason> {
    if is_gzip(bytes) {
        return unpack(bytes, MOST_BYTES, memory);
    }
    match OTHERS.iter().find(|(first, ..)| bytes.starts_with(first)) {
        Some((_, packer, command)) => Err(ReadReason::unsupported(
            format!("a file that is packed with {packer}"),
            format!("unpack it first (with {command}, for example); of packed files gzip is read"),
        )),
        None => Ok(FileBytes::new(bytes, Held::default())),
    }
}

/// The first bytes of what a file holds, as many as say what it is.
pub(super) fn head(bytes: &[u8]) -> Cow<'_, [u8]> {
    if !is_gzip(bytes) {
        return Cow::Borrowed(bytes);
    }
    let mut head = Vec::new();
    // What is damaged later is for those who read the whole.
    let _ = MultiGzDecoder::new(bytes).take(STEP as u64).read_to_end(&mut head);
    Cow::Owned(head)
}

/// How many bytes a file has when it is unpacked, as it says itself, or more.
pub(super) fn stated_size(bytes: &[u8]) -> u64 {
    let stated = bytes.last_chunk::<4>().filter(|_| is_gzip(bytes)).map(|size| u32::from_le_bytes(*size));
    (bytes.len() as u64).saturating_add(stated.map_or(0, u64::from))
}

/// Unpacks a file, by steps so that no more is allocated than there is.
fn unpack(bytes: &[u8], most: u64, memory: &MemoryLimit) -> Result<FileBytes<'static>, ReadReason> {
    let damaged = |error: std::io::Error| ReadReason::Damaged(format!("gzip: {error}"));
    let too_large = || ReadReason::TooLarge { what: "bytes when it is unpacked".into(), limit: most };
    let mut decoder = MultiGzDecoder::new(bytes);
    let (mut data, mut held) = (Vec::new(), memory.hold(0)?);
    loop {
        let before = data.len();
        held.grow(STEP as u64)?;
        // Doubled, so that few are moved; but not more than fits.
        data.try_reserve(STEP).map_err(|_| too_large())?;
        (&mut decoder).take(STEP as u64).read_to_end(&mut data).map_err(damaged)?;
        if data.len() as u64 > most {
            return Err(too_large());
        }
        if data.len() == before {
            return Ok(FileBytes::new(data, held));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::Compression;
    use flate2::write::GzEncoder;
    use std::io::Write;

    fn packed(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    #[test]
    fn gzip_is_unpacked_and_bounded() {
        let file = vec![7; 3 * STEP + 5];
        let unpacked = |bytes: &[u8]| unpacked(bytes, &MemoryLimit::default()).map(|file| file.to_vec());
        let mut members = packed(&file[..STEP]);
        assert_eq!(unpacked(&members).unwrap().len(), STEP);
        assert_eq!(stated_size(&members), (members.len() + STEP) as u64);
        members.extend(packed(&file[STEP..]));
        assert_eq!(unpacked(&members).unwrap(), file);
        assert_eq!(head(&members).as_ref(), &file[..STEP]);
        let no_limit = &MemoryLimit::default();
        assert!(matches!(unpack(&members, STEP as u64, no_limit), Err(ReadReason::TooLarge { .. })));
        let least = (file.len() + 2 * STEP) as u64;
        assert!(unpack(&members, MOST_BYTES, &MemoryLimit::of(least)).is_ok());
        assert!(matches!(
            unpack(&members, MOST_BYTES, &MemoryLimit::of(least / 2)),
            Err(ReadReason::Memory { .. })
        ));
        for length in 3..members.len() {
            assert!(!unpacked(&members[..length]).is_ok_and(|bytes| bytes.len() == file.len()), "{length}");
        }
        assert_eq!(unpacked(b"plain").unwrap(), b"plain");
    }

    #[test]
    fn other_packers_are_named() {
        let refused = |bytes: &[u8]| unpacked(bytes, &MemoryLimit::default()).unwrap_err().to_string();
        assert!(refused(b"BZh91AY").contains("bzip2"));
        assert!(refused(b"PK\x03\x04").contains("ZIP"));
        assert!(refused(b"\x78\x9c\0").contains("zlib"));
    }
}

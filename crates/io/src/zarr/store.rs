//! Where the objects of a Zarr store are: files in a folder, or objects on a server.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use zarrs::storage::byte_range::{ByteRange, ByteRangeIterator};
use zarrs::storage::{Bytes, MaybeBytesIterator, ReadableStorageTraits, StorageError, StoreKey};

use crate::error::ReadReason;
use crate::memory::MemoryLimit;
#[cfg(feature = "http")]
use crate::zarr::server::Server;

/// Most bytes of an object with metadata.
const MOST_METADATA: u64 = 1 << 26;
/// Between ranges that are as near, the bytes are read, too.
const NEAR: u64 = 1 << 16;
/// Most bytes of several ranges that are read at once.
const MOST_AT_ONCE: u64 = 1 << 22;

/// A folder, or what is below an address.
#[derive(Debug)]
pub(super) struct Store {
    place: Place,
    memory: MemoryLimit,
}

#[derive(Debug)]
enum Place {
    Folder(PathBuf),
    #[cfg(feature = "http")]
    Server(Box<Server>),
}

/// Whether a path is an address on a server.
pub(super) fn is_address(path: &Path) -> bool {
    let schemes = ["http://", "https://", "s3://"];
    cfg!(feature = "http")
        && path.to_str().is_some_and(|path| schemes.iter().any(|scheme| path.starts_with(scheme)))
}

/// Whether a path is called as the root of a hierarchy is.
pub(super) fn is_root(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("zarr"))
}

impl Store {
    /// What is at a path or an address. An object must not be larger than reading may take.
    pub fn of(path: &Path, memory: &MemoryLimit) -> Result<Self, ReadReason> {
        #[cfg(feature = "http")]
        if is_address(path) {
            let place = Place::Server(Box::new(Server::of(&path.to_string_lossy())?));
            return Ok(Self { place, memory: memory.clone() });
        }
        Ok(Self { place: Place::Folder(path.to_owned()), memory: memory.clone() })
    }

    /// An object with metadata; none if there is no such object.
    pub fn metadata(&self, key: &str) -> Result<Option<Vec<u8>>, ReadReason> {
        if self.size(key)?.is_some_and(|size| size > MOST_METADATA) {
            return Err(ReadReason::TooLarge { what: "bytes of metadata".into(), limit: MOST_METADATA });
        }
        Ok(self.ranges(key, &[ByteRange::FromStart(0, None)])?.and_then(|mut ranges| ranges.pop()))
    }

    /// The names of the folders in a folder, in their order; none on servers, which need not list what they have.
    pub fn folders(&self) -> Result<Option<Vec<String>>, ReadReason> {
        let folder = match &self.place {
            Place::Folder(folder) => folder,
            #[cfg(feature = "http")]
            Place::Server(_) => return Ok(None),
        };
        let failed = |error: io::Error| ReadReason::Io(error.to_string());
        let mut names = Vec::new();
        for entry in folder.read_dir().map_err(failed)? {
            let entry = entry.map_err(failed)?;
            if entry.path().is_dir()
                && let Ok(name) = entry.file_name().into_string()
            {
                names.push(name);
            }
        }
        names.sort_unstable();
        Ok(Some(names))
    }

    fn size(&self, key: &str) -> Result<Option<u64>, ReadReason> {
        match &self.place {
            Place::Folder(folder) => {
                Ok(open(&folder.join(key)).map_err(|error| failed(key, &error))?.map(|(_, size)| size))
            }
            #[cfg(feature = "http")]
            Place::Server(server) => server.size(key),
        }
    }

    /// Ranges of an object; none if there is no such object.
    fn ranges(&self, key: &str, ranges: &[ByteRange]) -> Result<Option<Vec<Vec<u8>>>, ReadReason> {
        let is_whole = matches!(ranges, [ByteRange::FromStart(0, None)]);
        match &self.place {
            Place::Folder(folder) => {
                let failed = |error| failed(key, &error);
                let Some((mut file, size)) = open(&folder.join(key)).map_err(failed)? else {
                    return Ok(None);
                };
                self.memory.expect(if is_whole { size } else { 0 })?;
                read_ranges(ranges, size, &mut |start, length| {
                    let mut bytes = Vec::new();
                    file.seek(SeekFrom::Start(start)).map_err(failed)?;
                    file.by_ref().take(length).read_to_end(&mut bytes).map_err(failed)?;
                    Ok(bytes)
                })
                .map(Some)
            }
            #[cfg(feature = "http")]
            Place::Server(server) if is_whole => Ok(server.whole(key)?.map(|bytes| vec![bytes])),
            #[cfg(feature = "http")]
            Place::Server(server) => {
                let Some(size) = server.size(key)? else { return Ok(None) };
                read_ranges(ranges, size, &mut |start, length| server.range(key, start..start + length))
                    .map(Some)
            }
        }
    }
}

/// The file at a path and its length; none if there is none. A pipe might never end.
fn open(path: &Path) -> io::Result<Option<(File, u64)>> {
    let is_missing =
        |error: &io::Error| matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory);
    let known = match path.metadata() {
        Err(error) if is_missing(&error) => return Ok(None),
        known => known?,
    };
    if !known.is_file() {
        return Err(io::Error::other("it is no file"));
    }
    Ok(Some((File::open(path)?, known.len())))
}

fn failed(key: &str, error: &io::Error) -> ReadReason {
    ReadReason::Io(format!("\"{key}\": {error}"))
}

/// Reads ranges of an object of this size; those that are near one another by one call of `read`.
fn read_ranges(
    ranges: &[ByteRange],
    size: u64,
    read: &mut dyn FnMut(u64, u64) -> Result<Vec<u8>, ReadReason>,
) -> Result<Vec<Vec<u8>>, ReadReason> {
    let mut places: Vec<(u64, u64, usize)> = Vec::with_capacity(ranges.len());
    for (number, range) in ranges.iter().enumerate() {
        let (start, length) = match *range {
            ByteRange::FromStart(start, Some(length)) => (start, length),
            ByteRange::FromStart(start, None) => (start, size.saturating_sub(start)),
            ByteRange::Suffix(length) => (size.saturating_sub(length), length),
        };
        let end = start.saturating_add(length);
        if end > size {
            return Err(ReadReason::Truncated { needed: end, found: size });
        }
        places.push((start, end, number));
    }
    places.sort_unstable();
    let mut found = vec![Vec::new(); ranges.len()];
    let mut rest = &places[..];
    while let Some(&(start, mut end, _)) = rest.first() {
        let mut count = 0;
        // What is read at once is in memory twice.
        while let Some(&(next, next_end, _)) = rest.get(count)
            && next <= end.saturating_add(NEAR)
            && (count == 0 || next_end <= start.saturating_add(MOST_AT_ONCE))
        {
            (end, count) = (end.max(next_end), count + 1);
        }
        let bytes = read(start, end - start)?;
        if bytes.len() as u64 != end - start {
            return Err(ReadReason::Truncated { needed: end - start, found: bytes.len() as u64 });
        }
        for &(from, to, number) in &rest[..count] {
            found[number] = bytes[(from - start) as usize..(to - start) as usize].to_vec();
        }
        rest = &rest[count..];
    }
    Ok(found)
}

/// Reasons pass through the crate as text.
fn as_text(reason: &ReadReason) -> StorageError {
    StorageError::Other(reason.to_string())
}

impl ReadableStorageTraits for Store {
    fn get_partial_many<'a>(
        &'a self,
        key: &StoreKey,
        byte_ranges: ByteRangeIterator<'a>,
    ) -> Result<MaybeBytesIterator<'a>, StorageError> {
        let ranges: Vec<ByteRange> = byte_ranges.collect();
        let found = self.ranges(key.as_str(), &ranges).map_err(|reason| as_text(&reason))?;
        Ok(found.map(|found| -> Box<dyn Iterator<Item = Result<Bytes, StorageError>>> {
            Box::new(found.into_iter().map(|bytes| Ok(Bytes::from(bytes))))
        }))
    }

    fn size_key(&self, key: &StoreKey) -> Result<Option<u64>, StorageError> {
        self.size(key.as_str()).map_err(|reason| as_text(&reason))
    }

    fn supports_get_partial(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_that_are_near_are_read_at_once() {
        let object: Vec<u8> = (0..300_000_u32).map(|i| (i % 251) as u8).collect();
        let mut reads = Vec::new();
        let ranges = [
            ByteRange::Suffix(4),
            ByteRange::FromStart(10, Some(5)),
            ByteRange::FromStart(0, Some(3)),
            ByteRange::FromStart(12, Some(0)),
        ];
        let found = read_ranges(&ranges, object.len() as u64, &mut |start, length| {
            reads.push((start, length));
            Ok(object[start as usize..(start + length) as usize].to_vec())
        });
        let expected = [&object[299_996..], &object[10..15], &object[..3], &[]];
        assert_eq!(found.expect("all are in it"), expected.map(<[u8]>::to_vec));
        assert_eq!(reads, [(0, 15), (299_996, 4)]);
        let beyond = read_ranges(&[ByteRange::FromStart(2, Some(9))], 4, &mut |_, _| Ok(Vec::new()));
        assert_eq!(beyond, Err(ReadReason::Truncated { needed: 11, found: 4 }));
    }
}

//! Ranges that were fetched before, in a folder: one file a range, by address and version of what they come from.
//!
//! Nothing depends on it: what cannot be read or does not match its checksum is fetched again, what cannot be written
//! is not kept. Several programs may use one folder.

use sha2::{Digest, Sha256};
use std::collections::BTreeSet;
use std::fs;
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use tempfile::NamedTempFile;

/// A folder of ranges that takes no more than so many bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CacheFolder {
    /// The folder; it is made when something is to be kept.
    pub path: PathBuf,
    /// Most bytes in it, those of other files included.
    pub max_bytes: u64,
}

/// The ranges of one version of one file.
#[derive(Debug)]
pub struct Cache {
    folder: PathBuf,
    /// By start and end.
    known: BTreeSet<(u64, u64)>,
    room: u64,
}

impl Cache {
    /// What is kept of `version` of the file at `url`. Older versions go, as does what was used least lately when the
    /// folder is full.
    pub fn open(options: &CacheFolder, url: &str, version: &str) -> Self {
        let of_url = options.path.join(hash(url));
        let folder = of_url.join(hash(version));
        for other in entries(&of_url).filter(|other| *other != folder) {
            let _ = fs::remove_dir_all(other);
        }
        let room = make_room(&options.path, options.max_bytes);
        let names = entries(&folder).filter_map(|path| parse_name(path.file_name()?.to_str()?));
        let known = names.collect();
        Self { folder, known, room }
    }

    /// The bytes of `range`, if they are kept.
    pub fn get(&mut self, range: &Range<u64>) -> Option<Vec<u8>> {
        let key = (range.start, range.end);
        if !self.known.contains(&key) {
            return None;
        }
        let path = self.folder.join(name(range));
        let found = fs::read(&path).ok().and_then(checked);
        match &found {
            // Used just now: it is the last to go.
            Some(_) => drop(fs::File::open(&path).and_then(|file| file.set_modified(SystemTime::now()))),
            None => {
                self.known.remove(&key);
                let _ = fs::remove_file(&path);
            }
        }
        found
    }

    /// Keeps the bytes of `range`, if there is room.
    pub fn put(&mut self, range: &Range<u64>, bytes: &[u8]) {
        let size = bytes.len() as u64 + 4;
        let key = (range.start, range.end);
        if size <= self.room && !self.known.contains(&key) && self.write(range, bytes).is_ok() {
            self.room -= size;
            self.known.insert(key);
        }
    }

    fn write(&self, range: &Range<u64>, bytes: &[u8]) -> std::io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        let mut partial = NamedTempFile::new_in(&self.folder)?;
        partial.write_all(&crc32fast::hash(bytes).to_le_bytes())?;
        partial.write_all(bytes)?;
        // Whole or not at all, for other programs too.
        partial.persist(self.folder.join(name(range)))?;
        Ok(())
    }
}

fn name(range: &Range<u64>) -> String {
    format!("{}-{}", range.start, range.end)
}

fn parse_name(name: &str) -> Option<(u64, u64)> {
    let (start, end) = name.split_once('-')?;
    Some((start.parse().ok()?, end.parse().ok()?))
}

/// The bytes behind their checksum, if it is theirs.
fn checked(mut bytes: Vec<u8>) -> Option<Vec<u8>> {
    let sum = u32::from_le_bytes(*bytes.first_chunk()?);
    bytes.drain(..4);
    (crc32fast::hash(&bytes) == sum).then_some(bytes)
}

/// Names a folder. Nobody can find another address or version with the same hash: what one server sent is never taken for what another has.
fn hash(text: &str) -> String {
    Sha256::digest(text).iter().map(|byte| format!("{byte:02x}")).collect()
}

fn entries(folder: &Path) -> impl Iterator<Item = PathBuf> {
    fs::read_dir(folder).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path()))
}

/// Removes what was used least lately until `folder` takes no more than three quarters of `max_bytes`, if it takes more
/// than all of it; says how much room there is then.
fn make_room(folder: &Path, max_bytes: u64) -> u64 {
    let files = entries(folder).flat_map(|url| entries(&url).collect::<Vec<_>>());
    let files = files.flat_map(|version| entries(&version).collect::<Vec<_>>());
    let mut files: Vec<_> = files
        .filter_map(|path| {
            let found = fs::metadata(&path).ok()?;
            Some((found.modified().ok()?, found.len(), path))
        })
        .collect();
    let mut size: u64 = files.iter().map(|(_, size, _)| size).sum();
    if size > max_bytes {
        files.sort();
        for (_, bytes, path) in files {
            if size <= max_bytes / 4 * 3 {
                break;
            }
            if fs::remove_file(path).is_ok() {
                size -= bytes;
            }
        }
    }
    max_bytes.saturating_sub(size)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> CacheFolder {
        let path = std::env::temp_dir().join(format!("tetralod-cache-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        CacheFolder { path, max_bytes: 1000 }
    }

    #[test]
    fn what_is_kept_is_found_again_by_address_and_version() {
        let options = folder("found");
        let open = |url, version| Cache::open(&options, url, version);
        let mut cache = open("http://x/a", "\"one\"");
        assert_eq!(cache.get(&(0..3)), None);
        cache.put(&(0..3), b"abc");
        assert_eq!(cache.get(&(0..3)), Some(b"abc".to_vec()));
        assert_eq!(open("http://x/a", "\"one\"").get(&(0..3)), Some(b"abc".to_vec()));
        assert_eq!(open("http://x/b", "\"one\"").get(&(0..3)), None);
        assert_eq!(open("http://x/a", "\"two\"").get(&(0..3)), None);
        assert_eq!(open("http://x/a", "\"one\"").get(&(0..3)), None, "the older version is gone");
        let _ = fs::remove_dir_all(&options.path);
    }

    #[test]
    fn damaged_files_are_not_believed_and_the_folder_stays_within_its_size() {
        let options = folder("size");
        let mut cache = Cache::open(&options, "u", "v");
        cache.put(&(0..500), &[1; 500]);
        cache.put(&(500..900), &[2; 400]);
        cache.put(&(900..1000), &[3; 100]);
        assert_eq!(cache.get(&(900..1000)), None, "there is no room");
        let damaged = cache.folder.join("500-900");
        fs::write(damaged, [0; 404]).expect("it can be written");
        assert_eq!(cache.get(&(500..900)), None);
        assert_eq!(cache.get(&(0..500)), Some(vec![1; 500]));
        let smaller = CacheFolder { max_bytes: 400, ..options.clone() };
        assert_eq!(Cache::open(&smaller, "u", "v").get(&(0..500)), None, "it had to go");
        let _ = fs::remove_dir_all(&options.path);
    }

    #[test]
    fn a_folder_that_is_too_large_gets_room_for_more() {
        let options = folder("room");
        let mut cache = Cache::open(&options, "u", "v");
        (0..10).for_each(|i| cache.put(&(96 * i..96 * (i + 1)), &[1; 96]));
        // With their checksums they take all of 1000 bytes. Of 900 a quarter has to be free, not a byte.
        let smaller = CacheFolder { max_bytes: 900, ..options.clone() };
        let cache = Cache::open(&smaller, "u", "v");
        assert_eq!((cache.known.len(), cache.room), (6, 300));
        let _ = fs::remove_dir_all(&options.path);
    }
}

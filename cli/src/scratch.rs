//! Files for what is not kept in memory, in folders that are not kept. After an interruption, which removes such a folder, no file appears any
//! more.

use super::files;
use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};
use tetralod::format::BlockShelf;
use tetralod_build::parts::Scratch;

/// A folder of such files, by their names.
pub struct ScratchFolder<'a> {
    folder: &'a Path,
    /// The files that were written at places: what lies there is read bit by bit.
    open: RwLock<BTreeMap<String, File>>,
}

impl<'a> ScratchFolder<'a> {
    /// Of the files in this folder.
    pub fn new(folder: &'a Path) -> Self {
        Self { folder, open: RwLock::default() }
    }

    fn open(&self) -> RwLockReadGuard<'_, BTreeMap<String, File>> {
        self.open.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn change(&self) -> RwLockWriteGuard<'_, BTreeMap<String, File>> {
        self.open.write().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Scratch for ScratchFolder<'_> {
    fn write(&self, name: &str, bytes: &[u8]) -> io::Result<()> {
        files::uninterrupted(|| fs::write(self.folder.join(name), bytes))
    }

    fn append(&self, name: &str, bytes: &[u8]) -> io::Result<()> {
        append(&self.folder.join(name), bytes)
    }

    fn write_at(&self, name: &str, at: u64, bytes: &[u8]) -> io::Result<()> {
        let mut open = self.change();
        if !open.contains_key(name) {
            let mut options = OpenOptions::new();
            options.read(true).write(true).create(true).truncate(false);
            let file = files::uninterrupted(|| options.open(self.folder.join(name)))?;
            open.insert(name.to_owned(), file);
        }
        let mut file = open.get(name).ok_or(io::ErrorKind::NotFound)?;
        file.seek(SeekFrom::Start(at))?;
        files::uninterrupted(|| file.write_all(bytes))
    }

    fn read(&self, name: &str) -> io::Result<Vec<u8>> {
        fs::read(self.folder.join(name))
    }

    fn read_at(&self, name: &str, at: u64, bytes: &mut [u8]) -> io::Result<()> {
        match self.open().get(name) {
            Some(file) => read_at(file, at, bytes),
            None => read_at(&File::open(self.folder.join(name))?, at, bytes),
        }
    }

    fn remove(&self, name: &str) -> io::Result<()> {
        self.change().remove(name);
        fs::remove_file(self.folder.join(name))
    }
}

fn append(path: &Path, bytes: &[u8]) -> io::Result<()> {
    files::uninterrupted(|| OpenOptions::new().append(true).create(true).open(path)?.write_all(bytes))
}

/// Several threads may read at a time.
#[cfg(unix)]
fn read_at(file: &File, at: u64, bytes: &mut [u8]) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, bytes, at)
}

/// Several threads may read at a time: each read has its place.
#[cfg(windows)]
fn read_at(file: &File, mut at: u64, mut bytes: &mut [u8]) -> io::Result<()> {
    while !bytes.is_empty() {
        match std::os::windows::fs::FileExt::seek_read(file, bytes, at)? {
            0 => return Err(io::ErrorKind::UnexpectedEof.into()),
            read => (bytes, at) = (&mut std::mem::take(&mut bytes)[read..], at + read as u64),
        }
    }
    Ok(())
}

/// Blocks of an MT file that is written while the MT is made: two files, of blocks that were put there once, and twice.
pub struct BlockFiles {
    paths: [PathBuf; 2],
    ends: [u64; 2],
    /// Of each block the file, the place in it, and the length.
    places: Vec<Option<(usize, u64, usize)>>,
}

impl BlockFiles {
    /// In this folder.
    pub fn new(folder: &Path) -> Self {
        let paths = ["blocks-aside", "blocks"].map(|name| folder.join(name));
        Self { paths, ends: [0; 2], places: Vec::new() }
    }
}

impl BlockShelf for BlockFiles {
    fn put(&mut self, block: u32, bytes: &[u8]) -> io::Result<()> {
        let block = block as usize;
        if self.places.len() <= block {
            self.places.resize(block + 1, None);
        }
        let file = usize::from(self.places[block].is_some());
        append(&self.paths[file], bytes)?;
        self.places[block] = Some((file, self.ends[file], bytes.len()));
        self.ends[file] += bytes.len() as u64;
        Ok(())
    }

    fn get(&self, block: u32) -> io::Result<Vec<u8>> {
        match self.places.get(block as usize) {
            Some(&Some((file, at, len))) => {
                let mut bytes = vec![0; len];
                read_at(&File::open(&self.paths[file])?, at, &mut bytes)?;
                Ok(bytes)
            }
            _ => Err(io::ErrorKind::NotFound.into()),
        }
    }
}

//! Files for what is not kept in memory, in folders that are not kept. After an interruption, which removes such a folder, no file appears any
//! more.

use super::files;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use tetralod::format::BlockShelf;
use tetralod_build::parts::Scratch;

/// A folder of such files, by their names.
pub struct ScratchFolder<'a>(pub &'a Path);

impl Scratch for ScratchFolder<'_> {
    fn write(&self, name: &str, bytes: &[u8]) -> io::Result<()> {
        files::uninterrupted(|| fs::write(self.0.join(name), bytes))
    }

    fn append(&self, name: &str, bytes: &[u8]) -> io::Result<()> {
        append(&self.0.join(name), bytes)
    }

    fn read(&self, name: &str) -> io::Result<Vec<u8>> {
        fs::read(self.0.join(name))
    }

    fn read_at(&self, name: &str, at: u64, len: usize) -> io::Result<Vec<u8>> {
        read_at(&self.0.join(name), at, len)
    }

    fn remove(&self, name: &str) -> io::Result<()> {
        fs::remove_file(self.0.join(name))
    }
}

fn append(path: &Path, bytes: &[u8]) -> io::Result<()> {
    files::uninterrupted(|| OpenOptions::new().append(true).create(true).open(path)?.write_all(bytes))
}

fn read_at(path: &Path, at: u64, len: usize) -> io::Result<Vec<u8>> {
    let mut file = File::open(path)?;
    file.seek(SeekFrom::Start(at))?;
    let mut bytes = Vec::with_capacity(len);
    file.take(len as u64).read_to_end(&mut bytes)?;
    if bytes.len() == len { Ok(bytes) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
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
            Some(&Some((file, at, len))) => read_at(&self.paths[file], at, len),
            _ => Err(io::ErrorKind::NotFound.into()),
        }
    }
}

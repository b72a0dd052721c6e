//! Files that another file names, or that come in pairs.

use std::cell::RefCell;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::error::{At, ReadError, ReadReason};
use crate::in_memory::FilesInMemory;
use crate::listed::{elsewhere, expect_below};
use crate::memory::{FileBytes, Held, MemoryLimit};

/// Where files are.
#[derive(Clone, Copy, Debug)]
pub(super) enum Source<'a> {
    /// On the disk; their bytes count in the limit.
    Disk,
    /// In memory, with the number of the given one.
    Memory(&'a FilesInMemory, usize),
    /// There is one, with these bytes.
    Bytes(&'a [u8]),
}

/// The files of a mesh: the one that was given, and those beside it as they are read.
pub(super) struct FilesOf<'a> {
    pub given: &'a Path,
    pub source: Source<'a>,
    memory: &'a MemoryLimit,
    read: RefCell<Vec<PathBuf>>,
}

impl<'a> FilesOf<'a> {
    pub fn new(given: &'a Path, source: Source<'a>, memory: &'a MemoryLimit) -> Self {
        Self { given, source, memory, read: RefCell::new(vec![given.to_owned()]) }
    }

    pub fn on_disk(given: &'a Path, memory: &'a MemoryLimit) -> Self {
        Self::new(given, Source::Disk, memory)
    }

    /// What the given file is called in errors.
    pub fn name(&self) -> String {
        self.given.display().to_string()
    }

    /// Reads the file that the given one calls `name`.
    pub fn load(&self, name: &str) -> Result<FileBytes<'a>, ReadReason> {
        match self.source {
            Source::Disk => {
                let path = place(self.given, name)?;
                let bytes = self.bytes_of(&path, |e| ReadReason::Io(format!("\"{name}\": {e}")));
                self.read.borrow_mut().push(path);
                bytes
            }
            Source::Memory(files, given) => {
                let found = files.find(given, name)?;
                self.read.borrow_mut().push(files.name(found).into());
                Ok(in_memory(files.bytes(found)))
            }
            Source::Bytes(_) => {
                let what = format!("a file that needs another (\"{name}\")");
                Err(ReadReason::unsupported(what, "give it by its path, with the other beside it"))
            }
        }
    }

    /// Reads the given file.
    pub fn load_given(&self) -> Result<FileBytes<'a>, ReadError> {
        match self.source {
            Source::Disk => {
                self.bytes_of(self.given, |e| ReadReason::Io(e.to_string())).in_file(&self.name())
            }
            Source::Memory(files, given) => Ok(in_memory(files.bytes(given))),
            Source::Bytes(bytes) => Ok(in_memory(bytes)),
        }
    }

    /// Reads the given file, or the one of this name beside it.
    pub fn load_one(&self, path: &Path) -> Result<FileBytes<'a>, ReadError> {
        if path == self.given {
            return self.load_given();
        }
        let bytes = match path.file_name().and_then(|name| name.to_str()) {
            Some(name) => self.load(name),
            None => self.bytes_of(path, |e| ReadReason::Io(e.to_string())),
        };
        let of = if matches!(self.source, Source::Disk) { path } else { self.given };
        bytes.in_file(&of.display().to_string())
    }

    /// The first bytes of the given file, at most so many; none where it cannot be read, which is for its reader to say.
    pub fn head(&self, most: usize) -> Vec<u8> {
        let first = |bytes: &[u8]| bytes[..bytes.len().min(most)].to_vec();
        match self.source {
            // What is read of a pipe is gone.
            Source::Disk if !self.given.is_file() => Vec::new(),
            Source::Disk => {
                let mut head = Vec::new();
                let read = File::open(self.given).map(|file| file.take(most as u64).read_to_end(&mut head));
                if matches!(read, Ok(Ok(_))) { head } else { Vec::new() }
            }
            Source::Memory(files, given) => first(files.bytes(given)),
            Source::Bytes(bytes) => first(bytes),
        }
    }

    fn bytes_of(
        &self,
        path: &Path,
        reason: impl Fn(std::io::Error) -> ReadReason,
    ) -> Result<FileBytes<'a>, ReadReason> {
        // Pipes have no length.
        let length = std::fs::metadata(path).map_err(&reason)?.len();
        let held = self.memory.hold(length)?;
        Ok(FileBytes::new(std::fs::read(path).map_err(&reason)?, held))
    }

    /// Notes that another file than the given one is read.
    #[cfg(feature = "hdf5")]
    pub fn note(&self, path: PathBuf) {
        self.read.borrow_mut().push(path);
    }

    /// The one that was read last.
    pub fn last(&self) -> Option<PathBuf> {
        self.read.borrow().last().cloned()
    }

    /// All that were read.
    pub fn all_read(&self) -> Vec<PathBuf> {
        self.read.borrow().clone()
    }
}

/// The bytes of a file that is in memory already.
fn in_memory(bytes: &[u8]) -> FileBytes<'_> {
    FileBytes::new(bytes, Held::default())
}

/// Where the file is that the one at `path` calls `name`: in its folder or below, also where links lead. It must be a file, for a pipe or a
/// device that a file of others names might never end.
pub(super) fn place(path: &Path, name: &str) -> Result<PathBuf, ReadReason> {
    expect_below(name)?;
    let folder = path.with_file_name("");
    let found = folder.join(name);
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { &folder };
    // What is not there is for the reader to say.
    if let (Ok(folder), Ok(target)) = (here.canonicalize(), found.canonicalize()) {
        if !target.starts_with(folder) {
            let target = target.display();
            return Err(elsewhere(format!(
                "a link to a file in another folder (\"{name}\", which is {target})"
            )));
        }
        if !target.is_file() {
            return Err(elsewhere(format!("\"{name}\", which is not a file,")));
        }
    }
    Ok(found)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::fs;
    use std::os::unix::fs::symlink;

    #[test]
    fn files_beside_are_files_in_the_folder_or_below() {
        let folder = std::env::temp_dir().join(format!("tetralod-beside-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(folder.join("case/sub")).expect("a folder");
        for file in ["outside", "case/a", "case/sub/b"] {
            fs::write(folder.join(file), file).expect("a file");
        }
        let case = folder.join("case");
        symlink("sub/b", case.join("inner")).expect("a link");
        symlink("../outside", case.join("outer")).expect("a link");
        symlink("/dev/zero", case.join("device")).expect("a link");
        symlink("..", case.join("up")).expect("a link");
        let (list, memory) = (case.join("list"), MemoryLimit::of(12));
        let files = FilesOf::on_disk(&list, &memory);
        let content = |name| files.load(name).map(|file| file.to_vec());
        assert_eq!(content("a").expect("a file"), b"case/a");
        assert_eq!(content("./sub/b").expect("a file"), b"case/sub/b");
        assert_eq!(content("inner").expect("a link within the folder"), b"case/sub/b");
        let held = files.load("a").expect("a file");
        assert_eq!(files.load("sub/b").err(), Some(ReadReason::Memory { limit: 12 }));
        drop(held);
        for name in ["outer", "device", "up/outside", "sub", "../outside", "/dev/zero", ""] {
            assert!(matches!(files.load(name), Err(ReadReason::Unsupported { .. })), "{name}");
        }
        assert!(matches!(files.load("none"), Err(ReadReason::Io(_))));
        assert_eq!(files.all_read().len(), 7);
        let _ = fs::remove_dir_all(&folder);
    }
}

//! Files that another file names, or that come in pairs.

use std::cell::RefCell;
use std::path::{Component, Path, PathBuf};

use crate::error::{At, ReadError, ReadReason};
use crate::memory::{FileBytes, MemoryLimit};

/// The files of a mesh: the one that was given, and those beside it as they are read.
pub(super) struct FilesOf<'a> {
    given: &'a Path,
    memory: &'a MemoryLimit,
    read: RefCell<Vec<PathBuf>>,
}

impl<'a> FilesOf<'a> {
    /// Their bytes count in the limit.
    pub fn new(given: &'a Path, memory: &'a MemoryLimit) -> Self {
        Self { given, memory, read: RefCell::new(vec![given.to_owned()]) }
    }

    /// Reads the file that the given one calls `name`.
    pub fn load(&self, name: &str) -> Result<FileBytes<'static>, ReadReason> {
        let path = place(self.given, name)?;
        let bytes = self.bytes_of(&path, |e| ReadReason::Io(format!("\"{name}\": {e}")));
        self.read.borrow_mut().push(path);
        bytes
    }

    /// Reads the given file, or the one of this name beside it.
    pub fn load_one(&self, path: &Path) -> Result<FileBytes<'static>, ReadError> {
        let bytes = match path.file_name().and_then(|name| name.to_str()) {
            Some(name) if path != self.given => self.load(name),
            _ => self.bytes_of(path, |e| ReadReason::Io(e.to_string())),
        };
        bytes.in_file(&path.display().to_string())
    }

    fn bytes_of(
        &self,
        path: &Path,
        reason: impl Fn(std::io::Error) -> ReadReason,
    ) -> Result<FileBytes<'static>, ReadReason> {
        // Pipes have no length.
        let length = std::fs::metadata(path).map_err(&reason)?.len();
        let held = self.memory.hold(length)?;
        Ok(FileBytes::new(std::fs::read(path).map_err(&reason)?, held))
    }

    /// The one that was read last.
    pub fn last(&self) -> Option<PathBuf> {
        self.read.borrow().last().cloned()
    }

    /// All that were read.
    pub fn into_read(self) -> Vec<PathBuf> {
        self.read.into_inner()
    }
}

/// Where the file is that the one at `path` calls `name`: in its folder or below, also where links lead. It must be a file, for a pipe or a
/// device that a file of others names might never end.
pub(super) fn place(path: &Path, name: &str) -> Result<PathBuf, ReadReason> {
    let refused = |what: String| {
        let remedy = "put the files beside the one that refers to them, or below it".into();
        Err(ReadReason::Unsupported { what, remedy })
    };
    let below = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
    if name.is_empty() || !Path::new(name).components().all(below) {
        return refused(format!("a file in another folder (\"{name}\")"));
    }
    let folder = path.with_file_name("");
    let found = folder.join(name);
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { &folder };
    // What is not there is for the reader to say.
    if let (Ok(folder), Ok(target)) = (here.canonicalize(), found.canonicalize()) {
        if !target.starts_with(folder) {
            return refused(format!(
                "a link to a file in another folder (\"{name}\", which is {})",
                target.display()
            ));
        }
        if !target.is_file() {
            return refused(format!("\"{name}\", which is not a file,"));
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
        let files = FilesOf::new(&list, &memory);
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
        assert_eq!(files.into_read().len(), 7);
        let _ = fs::remove_dir_all(&folder);
    }
}

/// The bytes of one file.
pub(super) fn load<'a>(path: &Path, memory: &MemoryLimit) -> Result<FileBytes<'a>, ReadError> {
    FilesOf::new(path, memory).load_one(path)
}

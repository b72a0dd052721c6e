//! Files that are in memory, as a page has them, in place of a disk.

use std::collections::HashMap;
use std::sync::Arc;

use crate::error::ReadReason;
use crate::listed::expect_below;
use crate::packed;

/// Files that are in memory, under their names: they are read as those on a disk are, by the same readers.
///
/// A name may have folders, with `/`. A file that another one names is found where that says, as far as its own name goes: `case/0.vtu` as
/// `case/0.vtu`, and also as `0.vtu` alone.
///
/// ```
/// use tetralod_io::{FilesInMemory, ReadOptions};
///
/// let mut files = FilesInMemory::default();
/// files.add("a.mhd", b"NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = a.raw\n");
/// files.add("a.raw", b"ABCDEFGH");
/// let steps = files.steps()?;
/// assert_eq!((steps.len(), files.read(&steps[0], &ReadOptions::default())?.tets.len()), (1, 6));
/// # Ok::<_, tetralod_io::ReadError>(())
/// ```
#[derive(Debug, Default)]
pub struct FilesInMemory {
    files: Vec<InMemory>,
    /// The numbers of files, by the last part of their names.
    by_last: HashMap<String, Vec<usize>>,
}

#[derive(Debug)]
struct InMemory {
    name: String,
    bytes: Shared,
}

/// Bytes that readers of parts share.
#[derive(Clone, Debug, Default)]
pub(super) struct Shared(Arc<Vec<u8>>);

impl AsRef<[u8]> for Shared {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}

impl FilesInMemory {
    /// Adds a file.
    pub fn add(&mut self, name: impl Into<String>, bytes: &[u8]) {
        self.begin(name.into());
        self.last_mut().into_iter().for_each(|(_, file)| file.extend_from_slice(bytes));
    }

    /// Begins a file, whose bytes can be [appended](Self::last_mut).
    #[doc(hidden)]
    pub fn begin(&mut self, name: String) {
        let last = parts(&name).last().copied().unwrap_or_default().to_owned();
        self.by_last.entry(last).or_default().push(self.files.len());
        self.files.push(InMemory { name, bytes: Shared::default() });
    }

    /// The name and the bytes of the file that was begun last.
    #[doc(hidden)]
    pub fn last_mut(&mut self) -> Option<(&str, &mut Vec<u8>)> {
        let InMemory { name, bytes } = self.files.last_mut()?;
        Some((name, Arc::make_mut(&mut bytes.0)))
    }

    /// How many bytes of memory the files take while they are read, beside what is read of them: themselves, and what they become where
    /// they are in gzip.
    #[doc(hidden)]
    pub fn held_bytes(&self) -> u64 {
        let held = self.files.iter().map(|file| packed::stated_size(file.bytes.as_ref()));
        held.fold(0, u64::saturating_add)
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.files.len()
    }

    /// Drops the bytes of a file.
    pub(super) fn forget(&mut self, file: usize) {
        self.files[file].bytes = Shared::default();
    }

    pub(super) fn name(&self, file: usize) -> &str {
        &self.files[file].name
    }

    pub(super) fn bytes(&self, file: usize) -> &[u8] {
        self.files[file].bytes.as_ref()
    }

    #[cfg(feature = "hdf5")]
    pub(super) fn shared(&self, file: usize) -> Shared {
        self.files[file].bytes.clone()
    }

    /// The number of the file that another one calls `name`.
    pub(super) fn find(&self, by: usize, name: &str) -> Result<usize, ReadReason> {
        expect_below(name)?;
        let mut wanted = parts(self.name(by));
        wanted.pop();
        wanted.extend(parts(name));
        let last = wanted.last().copied().unwrap_or_default();
        let alike = self.by_last.get(last).map_or(&[][..], Vec::as_slice);
        let length = |file: &usize| {
            Some(parts(self.name(*file))).filter(|own| wanted.ends_with(own)).map(|own| own.len())
        };
        let longest = alike.iter().filter_map(length).max();
        let mut found = alike.iter().filter(|file| longest.is_some() && length(file) == longest);
        match (found.next(), found.next()) {
            (Some(file), None) => Ok(*file),
            (None, _) => Err(ReadReason::NotGiven(name.to_owned())),
            (Some(_), Some(_)) => Err(ReadReason::SeveralGiven(name.to_owned())),
        }
    }
}

/// The folders of a name, and its last part.
pub(super) fn parts(name: &str) -> Vec<&str> {
    name.split('/').filter(|part| !part.is_empty() && *part != ".").collect()
}

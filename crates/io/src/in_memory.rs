//! Files that are in memory, as a page has them, in place of a disk.

use std::collections::{BTreeSet, HashMap};
use std::path::Path;
use std::sync::Arc;

use crate::beside::{FilesOf, Source, expect_below};
use crate::contents::Survey;
use crate::error::{ReadError, ReadReason};
use crate::file_kind::{lower_extension, without_gz, without_mark};
use crate::xml::Document;
use crate::{MemoryLimit, ReadOptions, format_of, formats, listed, packed, pvd, raw, read_files, survey};
use tetralod::geom::Bounds;
use tetralod::mesh::TetMesh;

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

/// A time step in [`FilesInMemory`], or the whole mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct StepInMemory {
    /// The number of the file, and those of all that it needs.
    file: usize,
    needed: BTreeSet<usize>,
    /// The name of the file.
    pub name: String,
    /// The time, if a list contains it, or the file contains several; a file with one step may, too.
    pub time: Option<f64>,
    /// Which of the steps in the file it is.
    number: usize,
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

    /// The time steps, in the order in which files were added: each file that no other one names, with those that it needs; those that a
    /// `.pvd` lists; or those in a file that has several, as [`steps`](crate::steps) has them.
    ///
    /// # Errors
    /// As [`steps`](crate::steps); if a list names a file that is not there.
    pub fn steps(&self) -> Result<Vec<StepInMemory>, ReadError> {
        let named: Vec<BTreeSet<usize>> = (0..self.files.len()).map(|file| self.named_by(file)).collect();
        let all_named: BTreeSet<usize> = named.iter().flatten().copied().collect();
        let of_none: Vec<usize> = (0..self.files.len()).filter(|file| !all_named.contains(file)).collect();
        let (mut given, _) = self.parted(&of_none);
        if given.is_empty() {
            // Each names another one: what is wrong with that is for their readers to say.
            given = (0..self.files.len()).collect();
        }
        let mut steps = Vec::new();
        for file in given {
            let memory = MemoryLimit::default();
            let step = |file: usize, time, number| StepInMemory {
                file,
                needed: needed(file, &named),
                name: self.name(file).to_owned(),
                time,
                number,
            };
            steps.extend(pvd::steps_of(
                &self.files_of(file, &memory),
                |name| self.find(file, name),
                step,
                file,
            )?);
        }
        Ok(steps)
    }

    /// The names of files that came in a folder with others and belong to no mesh.
    #[doc(hidden)]
    pub fn left_out(&self) -> Vec<String> {
        let all_named: BTreeSet<usize> = (0..self.files.len()).flat_map(|file| self.named_by(file)).collect();
        let of_none: Vec<usize> = (0..self.files.len()).filter(|file| !all_named.contains(file)).collect();
        self.parted(&of_none).1.into_iter().map(|file| self.name(file).to_owned()).collect()
    }

    /// Parts files that no other one names in those that are read, and those in folders that are of no format that is known: what lies in a
    /// folder need not be of the mesh.
    fn parted(&self, of_none: &[usize]) -> (Vec<usize>, Vec<usize>) {
        let is_in_folder = |file: usize| parts(self.name(file)).len() > 1 && !self.name(file).contains("://");
        let (read, left): (Vec<_>, Vec<_>) =
            of_none.iter().partition(|&&file| !is_in_folder(file) || self.is_known(file));
        if read.is_empty() { (left, read) } else { (read, left) }
    }

    /// Whether a file is of a format that is known.
    fn is_known(&self, file: usize) -> bool {
        let (name, bytes) = (self.name(file), self.bytes(file));
        match lower_extension(Path::new(name)).as_str() {
            "raw" | "node" | "ele" => true,
            "json" => raw::Sidecar::parse(bytes).is_ok(),
            _ => pvd::is_list(name) || format_of(bytes).is_some(),
        }
    }

    /// Reads what is wanted of a time step, whatever [`ReadOptions::step`] says, otherwise as [`read_with`](crate::read_with).
    ///
    /// # Errors
    /// As [`read_with`](crate::read_with); [`ReadReason::NotGiven`] if a file is needed that is not there.
    pub fn read(&self, step: &StepInMemory, options: &ReadOptions) -> Result<TetMesh, ReadError> {
        let options = ReadOptions { step: step.number, ..options.clone() };
        read_files(&self.files_of(step.file, &options.memory), &options)
    }

    /// Says what a time step contains, and between what its points lie where they had to be read for that.
    #[doc(hidden)]
    pub fn survey(
        &self,
        step: &StepInMemory,
        memory: &MemoryLimit,
    ) -> Result<(Survey, Option<Bounds>), ReadError> {
        survey::survey_files(&self.files_of(step.file, memory), memory)
    }

    /// Drops the bytes of all files but those that these steps need.
    pub fn keep(&mut self, steps: &[StepInMemory]) {
        for (file, InMemory { bytes, .. }) in self.files.iter_mut().enumerate() {
            if !steps.iter().any(|step| step.needed.contains(&file)) {
                *bytes = Shared::default();
            }
        }
    }

    /// How many bytes of memory the files take while they are read, beside what is read of them: themselves, and what they become where
    /// they are in gzip.
    #[doc(hidden)]
    pub fn held_bytes(&self) -> u64 {
        let held = self.files.iter().map(|file| packed::stated_size(file.bytes.as_ref()));
        held.fold(0, u64::saturating_add)
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

    fn files_of<'a>(&'a self, file: usize, memory: &'a MemoryLimit) -> FilesOf<'a> {
        FilesOf::new(Path::new(self.name(file)), Source::Memory(self, file), memory)
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

    /// The files that one names, as far as they are there.
    fn named_by(&self, by: usize) -> BTreeSet<usize> {
        let found = self.names_in(by).into_iter().filter_map(|name| self.find(by, &name).ok());
        found.filter(|file| *file != by).collect()
    }

    /// The names of files that one needs, or may have beside it. What is wrong with it is for its reader to say.
    fn names_in(&self, file: usize) -> Vec<String> {
        let (name, bytes) = (self.name(file), self.bytes(file));
        if pvd::is_list(name) {
            let listed = pvd::listed(bytes).unwrap_or_default();
            return listed.into_iter().map(|(_, file)| file).collect();
        }
        match lower_extension(Path::new(name)).as_str() {
            "raw" => return vec![formats::sibling(name, "json")],
            "json" => {
                return raw::Sidecar::parse(bytes)
                    .ok()
                    .and_then(|sidecar| sidecar.file)
                    .into_iter()
                    .collect();
            }
            "node" => {
                return formats::tetgen::BESIDE_NODES.map(|ending| formats::sibling(name, ending)).to_vec();
            }
            _ => {}
        }
        let head = packed::head(bytes);
        if !without_mark(&head).starts_with(b"<") {
            return formats::named_by(without_gz(name), &head);
        }
        if !format_of(&head).is_some_and(|format| format.starts_with('p')) {
            return Vec::new();
        }
        let Ok(list) = packed::unpacked(bytes, &MemoryLimit::of(pvd::MOST_BYTES)) else { return Vec::new() };
        Document::parse(without_mark(&list)).map_or_else(|_| Vec::new(), |list| listed::names(&list))
    }
}

/// A file and all that it needs, given what each names.
fn needed(file: usize, named: &[BTreeSet<usize>]) -> BTreeSet<usize> {
    let (mut all, mut new) = (BTreeSet::from([file]), vec![file]);
    while let Some(next) = new.pop() {
        new.extend(named[next].iter().filter(|file| all.insert(**file)));
    }
    all
}

/// The folders of a name, and its last part.
fn parts(name: &str) -> Vec<&str> {
    name.split('/').filter(|part| !part.is_empty() && *part != ".").collect()
}

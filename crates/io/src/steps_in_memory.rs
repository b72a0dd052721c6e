//! The time steps in files that are in memory: which files belong together, and what they contain.

use std::collections::BTreeSet;
use std::path::Path;

use crate::beside::{FilesOf, Source};
use crate::contents::Survey;
use crate::error::ReadError;
use crate::file_kind::{lower_extension, without_gz, without_mark};
use crate::in_memory::{FilesInMemory, parts};
use crate::reading::read_files;
use crate::xml::Document;
use crate::{MemoryLimit, ReadOptions, format_of, formats, listed, packed, pvd, raw, survey};
use tetralod::geom::Bounds;
use tetralod::mesh::TetMesh;

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
    /// The time steps, in the order in which files were added: each file that no other one names, with those that it needs; those that a
    /// `.pvd` lists; or those in a file that has several, as [`steps`](crate::steps) has them.
    ///
    /// # Errors
    /// As [`steps`](crate::steps); if a list names a file that is not there.
    pub fn steps(&self) -> Result<Vec<StepInMemory>, ReadError> {
        let named: Vec<BTreeSet<usize>> = (0..self.count()).map(|file| self.named_by(file)).collect();
        let all_named: BTreeSet<usize> = named.iter().flatten().copied().collect();
        let of_none: Vec<usize> = (0..self.count()).filter(|file| !all_named.contains(file)).collect();
        let (mut given, _) = self.parted(&of_none);
        if given.is_empty() {
            // Each names another one: what is wrong with that is for their readers to say.
            given = (0..self.count()).collect();
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
        let all_named: BTreeSet<usize> = (0..self.count()).flat_map(|file| self.named_by(file)).collect();
        let of_none: Vec<usize> = (0..self.count()).filter(|file| !all_named.contains(file)).collect();
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
    /// As [`read_with`](crate::read_with); [`ReadReason::NotGiven`](crate::ReadReason::NotGiven) if a file is needed that is not there.
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
        for file in 0..self.count() {
            if !steps.iter().any(|step| step.needed.contains(&file)) {
                self.forget(file);
            }
        }
    }

    fn files_of<'a>(&'a self, file: usize, memory: &'a MemoryLimit) -> FilesOf<'a> {
        FilesOf::new(Path::new(self.name(file)), Source::Memory(self, file), memory)
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
        if let Some(pieces) = formats::pieces_beside(name, &head) {
            return pieces;
        }
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

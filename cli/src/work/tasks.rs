//! The tasks of a folder of parts: a step for each node, the last of which writes the MT file; which are done, and what workers have written
//! down of them. Where a mesh is to be parted later, that is one task, before all others are known.

use super::request::{Awaited, REQUEST, Request};
use crate::parts::{Folder, PLAN, command_for};
use crate::{files, shards};
use anyhow::{Context, Result, ensure};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{BufReader, ErrorKind};
use std::path::{Path, PathBuf};
use tetralod_build::parts::{Node, Part, Plan};

/// The folder, in that of the parts, in which workers write down what they do.
const NOTES: &str = "work";

/// The MT file, in the folder of the parts.
const FILE: &str = "built.mt";

/// What is to be done in a folder. A task has the level and the number of the node that it makes; that which writes the file is above all.
pub struct Tasks {
    folder: PathBuf,
    known: Known,
    /// How many tasks each level has.
    counts: Vec<u32>,
}

/// What is known of the parts.
enum Known {
    Plan(Plan),
    /// Nothing: the one task is to part the mesh.
    Request(Request),
}

/// A task that is done.
#[derive(Serialize, Deserialize)]
pub struct Done {
    pub seconds: f64,
    /// The most memory that its process had, in bytes.
    pub peak_memory: Option<u64>,
    pub host: String,
}

/// A try of a task that failed.
#[derive(Serialize, Deserialize)]
pub struct Failed {
    pub error: String,
    /// How many tries the worker allowed that noted it.
    pub tries: u32,
    #[serde(flatten)]
    pub done: Done,
}

/// The files that are there at a time.
pub struct Files {
    parts: BTreeSet<OsString>,
    notes: BTreeSet<OsString>,
}

/// Tasks that are not done.
#[derive(Default)]
pub struct Open {
    /// All that they need is done.
    pub ready: BTreeSet<Node>,
    /// All that they need is done, or can be done.
    later: BTreeSet<Node>,
    pub failed: Vec<Node>,
}

impl Open {
    fn has(&self, task: Node) -> bool {
        self.ready.contains(&task) || self.later.contains(&task)
    }
}

impl Tasks {
    /// # Errors
    /// If there is no plan and nothing is asked for, or by another version.
    pub fn of(folder: &Path) -> Result<Self> {
        let request = if folder.join(PLAN).exists() { None } else { Request::of(folder)? };
        let (known, counts) = if let Some(request) = request {
            (Known::Request(request), vec![1])
        } else {
            let plan = Folder(folder).checked_plan()?;
            let counts = plan.levels().into_iter().chain([1]).collect();
            (Known::Plan(plan), counts)
        };
        Ok(Self { folder: folder.to_owned(), known, counts })
    }

    /// Whether the parts are known: otherwise there is one task, which makes the plan.
    pub fn are_planned(&self) -> bool {
        matches!(self.known, Known::Plan(_))
    }

    /// Which pieces are there of a mesh that is to be parted later.
    pub fn pieces(&self) -> Result<Option<Awaited>> {
        match &self.known {
            Known::Plan(_) => Ok(None),
            Known::Request(request) => request.pieces().map(Some),
        }
    }

    /// All tasks, those first that others have to be done for.
    pub fn all(&self) -> impl Iterator<Item = Node> {
        let of_level = |(level, &count)| (0..count).map(move |index| Node { level, index });
        (0..).zip(&self.counts).flat_map(of_level)
    }

    pub fn levels(&self) -> &[u32] {
        &self.counts
    }

    /// The tasks that have to be done before.
    pub fn needed(&self, task: Node) -> Vec<Node> {
        if task == self.last() {
            self.all().filter(|other| *other != task).collect()
        } else {
            // Parts need none.
            self.plan().and_then(|plan| plan.children(task).ok()).unwrap_or_default()
        }
    }

    fn plan(&self) -> Option<&Plan> {
        match &self.known {
            Known::Plan(plan) => Some(plan),
            Known::Request(_) => None,
        }
    }

    /// What of the tasks that are not done can be done, where some have failed too often.
    pub fn open(&self, done: &BTreeSet<Node>, has_failed: impl Fn(Node) -> bool) -> Open {
        let mut open = Open::default();
        for task in self.all().filter(|task| !done.contains(task)) {
            let needed = self.needed(task);
            if has_failed(task) {
                open.failed.push(task);
            } else if needed.iter().all(|other| done.contains(other)) {
                open.ready.insert(task);
            } else if needed.iter().all(|other| done.contains(other) || open.has(*other)) {
                open.later.insert(task);
            }
        }
        open
    }

    /// The one that writes the file.
    pub fn last(&self) -> Node {
        Node { level: self.counts.len() as u32 - 1, index: 0 }
    }

    /// What it does, for people.
    pub fn name(&self, task: Node) -> String {
        let Node { level, index } = task;
        match level {
            _ if !self.are_planned() => "part the mesh".to_owned(),
            0 => format!("build {index}/{}", self.counts[0]),
            _ if task == self.last() => "write the file".to_owned(),
            _ => format!("join {level}/{index}"),
        }
    }

    /// The file that it writes.
    pub fn result(&self, task: Node) -> PathBuf {
        match &self.known {
            Known::Request(_) => self.folder.join(PLAN),
            Known::Plan(_) if task == self.last() => self.folder.join(FILE),
            Known::Plan(_) => Folder(&self.folder).built(task),
        }
    }

    /// The file of a note about it.
    pub fn note(&self, task: Node, what: &str) -> PathBuf {
        let name = match &self.known {
            Known::Request(_) => format!("part.{what}"),
            Known::Plan(_) => format!("{}-{}.{what}", task.level, task.index),
        };
        self.folder.join(NOTES).join(name)
    }

    /// Makes the place for notes.
    pub fn make_place(&self) -> Result<()> {
        let place = self.folder.join(NOTES);
        fs::create_dir_all(&place).with_context(|| format!("{} could not be made", place.display()))
    }

    pub fn files(&self) -> Result<Files> {
        let names = |folder: &Path| -> Result<BTreeSet<OsString>> {
            let all = || -> std::io::Result<_> {
                fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name())).collect()
            };
            match all() {
                // Nobody has begun.
                Err(error) if error.kind() == ErrorKind::NotFound => Ok(BTreeSet::new()),
                names => names.with_context(|| folder.display().to_string()),
            }
        };
        Ok(Files { parts: names(&self.folder)?, notes: names(&self.folder.join(NOTES))? })
    }

    /// Notes which tasks are done, of those whose results may be among these files. What is noted as done is not read again.
    ///
    /// # Errors
    /// As [`Self::is_done`].
    pub fn look(&self, files: &Files, done: &mut BTreeSet<Node>) -> Result<()> {
        for task in self.all() {
            let is_known = done.contains(&task);
            if !files.has_result(&self.result(task)) {
                // It may have been lost.
                done.remove(&task);
            } else if !is_known && self.is_done(task)? {
                done.insert(task);
            }
        }
        Ok(())
    }

    /// Whether a task is done: its result is there, as it is put in place whole.
    ///
    /// # Errors
    /// If that is damaged, or of another plan.
    pub fn is_done(&self, task: Node) -> Result<bool> {
        let path = self.result(task);
        let Some(plan) = self.plan().filter(|_| task != self.last()) else {
            let is_there = path.exists();
            ensure!(
                !is_there || !self.are_planned() || shards::is_whole(&path),
                "{} is cut off: remove it, and `tetralod work {}` writes it again",
                path.display(),
                self.folder.display()
            );
            return Ok(is_there);
        };
        let file = match File::open(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(false),
            file => file.with_context(|| path.display().to_string())?,
        };
        let again =
            || format!("{}: remove it, and {} makes it again", path.display(), command_for(task, plan));
        let (its_plan, node) = Part::survey(&mut BufReader::new(file)).with_context(again)?;
        ensure!(
            its_plan == *plan && node == task,
            "{} is of another plan: remove it, or part the mesh into another folder",
            path.display()
        );
        Ok(true)
    }

    /// How often a task has failed.
    pub fn tries(&self, task: Node, files: &Files) -> u32 {
        let is_noted = |number: &u32| files.has_note(&self.failed(task, *number));
        (1..).take_while(is_noted).last().unwrap_or(0)
    }

    fn failed(&self, task: Node, number: u32) -> PathBuf {
        self.note(task, &format!("failed-{number}"))
    }

    /// What was noted of a try.
    pub fn failure(&self, task: Node, number: u32) -> Option<Failed> {
        read(&self.failed(task, number))
    }

    /// What was noted when it was done.
    pub fn done(&self, task: Node) -> Option<Done> {
        read(&self.note(task, "done"))
    }

    pub fn note_done(&self, task: Node, done: &Done) -> Result<()> {
        files::write_file(&self.note(task, "done"), |out| Ok(serde_json::to_writer(out, done)?))
    }

    /// Notes a try that failed, beside those that others note at the same time.
    pub fn note_failure(&self, task: Node, failed: &Failed) -> Result<()> {
        for number in 1.. {
            let path = self.failed(task, number);
            match File::create_new(&path) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists => (),
                file => {
                    let write = || -> Result<()> { Ok(serde_json::to_writer(file?, failed)?) };
                    return write().with_context(|| format!("{} could not be written", path.display()));
                }
            }
        }
        Ok(())
    }

    /// Removes what was noted of tries that failed.
    pub fn forget_failures(&self) -> Result<()> {
        let files = self.files()?;
        for task in self.all() {
            for number in (1..=self.tries(task, &files)).rev() {
                fs::remove_file(self.failed(task, number))?;
            }
        }
        Ok(())
    }
}

impl Files {
    /// Whether the result of a task is there.
    fn has_result(&self, result: &Path) -> bool {
        self.parts.contains(result.file_name().unwrap_or_default())
    }

    pub fn has_note(&self, note: &Path) -> bool {
        self.notes.contains(note.file_name().unwrap_or_default())
    }
}

/// Removes what workers have made of the plan before, and what was asked of them: the file, and their notes. Parts that are built are kept: they
/// tell their plan.
pub fn forget(folder: &Path) -> Result<()> {
    let gone = |done: std::io::Result<()>, path: &Path| match done {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            Err(error).with_context(|| path.display().to_string())
        }
        _ => Ok(()),
    };
    let notes = folder.join(NOTES);
    for file in [REQUEST, FILE].map(|name| folder.join(name)) {
        gone(fs::remove_file(&file), &file)?;
    }
    gone(fs::remove_dir_all(&notes), &notes)
}

/// A note, if it is there and whole.
fn read<T: DeserializeOwned>(path: &Path) -> Option<T> {
    serde_json::from_slice(&fs::read(path).ok()?).ok()
}

//! What is asked of workers before the pieces of a mesh are there: to part it as soon as they are.

use crate::files;
use crate::parts::check_version;
use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use tetralod_io::{Pieces, ReadOptions};

/// The file, in the folder of the parts, that says what is to be parted.
pub const REQUEST: &str = "later.json";

/// So many pieces that are missing are named to people.
const NAMED: usize = 3;

/// A list of pieces that is to be parted, and how.
#[derive(Serialize, Deserialize)]
pub struct Request {
    /// That of the program that will part it.
    version: String,
    /// The list, as all machines find it.
    list: PathBuf,
    /// Where the arguments were given: paths in them may begin there.
    pub directory: PathBuf,
    /// Those of `tetralod part`.
    pub arguments: Vec<String>,
}

/// The pieces that a list names.
#[derive(Serialize)]
pub struct Awaited {
    list: String,
    /// How many there are; none as long as there is no list.
    pieces: Option<usize>,
    /// The files that are not there.
    missing: Vec<String>,
}

impl Request {
    /// To part the pieces of this list, by these arguments of `tetralod part`.
    pub fn new(list: &Path, arguments: &[OsString], version: &str) -> Result<Self> {
        let text = |word: &OsString| {
            let word = word.to_str().with_context(|| format!("{} is no UTF-8", word.display()))?;
            Ok(word.to_owned())
        };
        Ok(Self {
            version: version.to_owned(),
            list: std::path::absolute(list)?,
            directory: std::env::current_dir().context("the current folder")?,
            arguments: arguments.iter().map(text).collect::<Result<_>>()?,
        })
    }

    /// What is asked for in this folder, if something is.
    ///
    /// # Errors
    /// If another version was asked.
    pub fn of(folder: &Path) -> Result<Option<Self>> {
        let path = folder.join(REQUEST);
        let text = match fs::read(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            text => text.with_context(|| path.display().to_string())?,
        };
        let again = || format!("{} is of another version; give `tetralod part` again", path.display());
        let request: Self = serde_json::from_slice(&text).with_context(again)?;
        check_version(folder, &request.version)?;
        Ok(Some(request))
    }

    pub fn write(&self, folder: &Path) -> Result<()> {
        files::write_file(&folder.join(REQUEST), |out| Ok(serde_json::to_writer_pretty(out, self)?))
    }

    /// Which pieces are there. A file that is there is taken to be complete.
    ///
    /// # Errors
    /// If the list is damaged.
    pub fn pieces(&self) -> Result<Awaited> {
        let list = self.list.display().to_string();
        if !is_there(&self.list)? {
            return Ok(Awaited { missing: vec![list.clone()], list, pieces: None });
        }
        let Some(pieces) = Pieces::open(&self.list, &ReadOptions::default())? else {
            bail!("{list} is no list of the pieces of an unstructured grid (.pvtu)")
        };
        let files = pieces.files()?;
        let mut missing = Vec::new();
        for file in &files {
            if !is_there(file)? {
                missing.push(file.display().to_string());
            }
        }
        Ok(Awaited { list, pieces: Some(files.len()), missing })
    }
}

impl Awaited {
    pub fn are_there(&self) -> bool {
        self.missing.is_empty()
    }

    /// How many are missing; the list is none of them.
    pub fn missing(&self) -> usize {
        self.missing.len()
    }

    pub fn words(&self) -> String {
        let Some(pieces) = self.pieces else { return format!("{} is not there yet", self.list) };
        let missing = self.missing.len();
        if missing == 0 {
            return format!("all {pieces} of {} are there", self.list);
        }
        let named = self.missing.iter().take(NAMED).cloned().collect::<Vec<_>>().join(", ");
        let more = if missing > NAMED { format!(" and {} more", missing - NAMED) } else { String::new() };
        format!("{missing} of {pieces} of {} are missing: {named}{more}", self.list)
    }
}

fn is_there(path: &Path) -> Result<bool> {
    path.try_exists().with_context(|| path.display().to_string())
}

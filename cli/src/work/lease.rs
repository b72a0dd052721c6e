//! Leases: which worker is at which task.
//!
//! They save work and promise nothing: a result is put in its place by one rename, and is the same whoever makes it, so two workers at one
//! task lose time alone. So a lease may be taken from a worker that is slow and not gone.
//!
//! A lease is a file that is created where there must be none, which one worker alone can do, on NFS, too. Its first line says whose it is; now
//! and then the worker appends a byte, the heartbeat. Others see that the file changes, by the clock of their own machine: no two clocks are
//! compared. If it has not changed for as long as the line says, it is stale, and the next lease of the task is created, `lease-1` after `lease-0`:
//! again one worker alone can do that. A stale lease is removed with the one that followed it.

use super::tasks::{Files, Tasks};
use crate::files::Transient;
use crate::machine;
use crate::parts::VERSION;
use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};
use tetralod_build::parts::Node;

/// So many heartbeats fit into the time after which a lease without one is stale.
const BEATS: f64 = 6.0;

/// Who has a lease.
#[derive(Clone, Serialize, Deserialize)]
pub struct Holder {
    pub host: String,
    pub process: u32,
    version: String,
    /// When it was taken, in seconds since 1970 by the clock there: for people.
    pub since: f64,
    /// Seconds without a heartbeat after which others may take the task.
    pub stale_after: f64,
}

/// What a worker knows of leases.
pub struct Leases {
    stale_after: f64,
    /// What leases of others were when they were seen to change.
    seen: HashMap<PathBuf, (Vec<u8>, Instant)>,
}

/// A task that this worker is at.
pub struct Lease {
    file: Transient,
    /// When it had its heartbeat.
    beaten: Instant,
    every: Duration,
    /// Stale ones of the same task.
    stale: Vec<PathBuf>,
}

impl Leases {
    pub fn new(stale_after: f64) -> Self {
        Self { stale_after, seen: HashMap::new() }
    }

    /// How often a lease has its heartbeat.
    pub fn beat(&self) -> Duration {
        Duration::from_secs_f64(self.stale_after / BEATS)
    }

    /// Takes a task, if no other worker is at it.
    pub fn take(&mut self, tasks: &Tasks, task: Node) -> Result<Option<Lease>> {
        let holder = Holder {
            host: machine::name(),
            process: std::process::id(),
            version: VERSION.to_owned(),
            since: now(),
            stale_after: self.stale_after,
        };
        let line = serde_json::to_string(&holder)? + "\n";
        let mut stale = Vec::new();
        loop {
            let path = path(tasks, task, stale.len());
            match Transient::create(path.clone(), line.as_bytes()) {
                Ok(file) => {
                    return Ok(Some(Lease { file, beaten: Instant::now(), every: self.beat(), stale }));
                }
                Err(error) if error.kind() != ErrorKind::AlreadyExists => {
                    return Err(error).with_context(|| format!("{} could not be written", path.display()));
                }
                Err(_) if self.is_stale(&path)? => stale.push(path),
                Err(_) => return Ok(None),
            }
        }
    }

    /// Whether a lease has not changed for too long.
    fn is_stale(&mut self, path: &Path) -> Result<bool> {
        let found = match fs::read(path) {
            // It ends just now.
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(false),
            found => found.with_context(|| path.display().to_string())?,
        };
        // Of a worker that was killed before it could write the line.
        let stale_after = holder(&found).map_or(self.stale_after, |holder| holder.stale_after);
        match self.seen.get(path) {
            Some((before, when)) if *before == found => Ok(when.elapsed().as_secs_f64() >= stale_after),
            _ => {
                self.seen.insert(path.to_owned(), (found, Instant::now()));
                Ok(false)
            }
        }
    }
}

impl Lease {
    /// The heartbeat, when it is time for one.
    pub fn beat(&mut self) {
        if self.beaten.elapsed() >= self.every {
            self.beaten = Instant::now();
            // Without it, others may take the task, too: that costs time alone.
            let _ = self.file.append(b".");
        }
    }
}

impl Drop for Lease {
    fn drop(&mut self) {
        // They may be gone already.
        self.stale.iter().for_each(|path| drop(fs::remove_file(path)));
    }
}

/// Who has the lease of a task, and how many seconds ago it had its heartbeat, by the clock of the file system: for people.
pub fn last_of(tasks: &Tasks, task: Node, files: &Files) -> Option<(Holder, f64)> {
    let all = (0..).map(|number| path(tasks, task, number)).take_while(|path| files.has_note(path));
    let path = all.last()?;
    let changed = fs::metadata(&path).and_then(|found| found.modified()).ok()?;
    let silent = SystemTime::now().duration_since(changed).unwrap_or_default();
    Some((holder(&fs::read(&path).ok()?)?, silent.as_secs_f64()))
}

fn path(tasks: &Tasks, task: Node, number: usize) -> PathBuf {
    tasks.note(task, &format!("lease-{number}"))
}

/// What the first line says.
fn holder(bytes: &[u8]) -> Option<Holder> {
    serde_json::from_slice(bytes.split(|&byte| byte == b'\n').next()?).ok()
}

/// Seconds since 1970.
pub fn now() -> f64 {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_secs_f64()
}

//! `tetralod work`: builds what has been parted, together with other processes that do the same.

pub mod lease;
pub mod request;
pub mod tasks;

use self::lease::{Lease, Leases};
use self::tasks::{Done, Failed, Files, Tasks};
use super::output::{self, Verbosity};
use super::progress::progress_bar;
use super::shards::Sharding;
use super::{files, join, machine, parse, part, parts};
use anyhow::{Context, Result, bail, ensure};
use indicatif::ProgressBar;
use serde::Serialize;
use std::collections::BTreeSet;
use std::ffi::OsString;
use std::io::{self, Read, Seek};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::slice;
use std::time::{Duration, Instant};
use tetralod_build::parts::Node;

/// Builds what `tetralod part` has parted, and writes `built.mt` into its folder: any number of these, on any machines that share the folder,
/// take one task after the other, and end when the file is there. `tetralod status` shows how far they are.
#[derive(clap::Args)]
pub struct Arguments {
    /// The folder that `tetralod part` has written.
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
    /// Threads of each task, all cores if not given. The file does not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// How often a task that failed is tried again, by whichever worker.
    #[arg(long, value_name = "N", default_value = "2")]
    retries: u32,
    /// Try again what has failed too often, when its cause is gone.
    #[arg(long)]
    retry_failed: bool,
    /// Wait for the pieces of a mesh that is to be parted later, instead of ending if some are missing.
    #[arg(long)]
    wait: bool,
    /// After how many seconds without a heartbeat of this worker others may take its task; it has six in that time.
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = parse::parse_positive)]
    stale_after: f64,
    /// Do one task, as long as the standard input is open: what a worker starts for each.
    #[arg(long, value_name = "L/K", value_parser = parts::node, hide = true)]
    task: Option<Node>,
    /// The same for the task of parting a mesh.
    #[arg(long, hide = true)]
    parting: bool,
    #[command(flatten)]
    verbosity: Verbosity,
}

/// How long is waited at first for a process, or for other workers, and for a process at most.
const SHORT: Duration = Duration::from_millis(1);
const LONG: Duration = Duration::from_millis(50);

/// How long is waited for other workers, or for pieces, at most.
const PATIENCE: Duration = Duration::from_secs(5);

/// The summary as programs get it.
#[derive(Serialize)]
struct Report {
    file: String,
    /// How many tasks this worker has done, of so many.
    tasks: u32,
    all_tasks: u32,
    /// How many tries failed here.
    failures: u32,
    /// The most memory that one of them took, in bytes.
    peak_memory: Option<u64>,
    seconds: f64,
}

/// One worker.
struct Worker<'a> {
    arguments: &'a Arguments,
    tasks: Tasks,
    /// The program, with its first arguments.
    again: &'a [OsString],
    leases: Leases,
    /// What is known to be done, by whichever worker.
    done: BTreeSet<Node>,
    report: Report,
    bar: ProgressBar,
}

pub fn run(arguments: &Arguments, again: &[OsString]) -> Result<()> {
    let start = Instant::now();
    let Arguments { folder, threads, stale_after, verbosity, .. } = arguments;
    let tasks = Tasks::of(folder)?;
    if arguments.parting || arguments.task.is_some() {
        end_with_the_worker();
        machine::set_threads(*threads)?;
        return arguments.task.map_or_else(|| part::part_now(folder), |task| perform(folder, &tasks, task));
    }
    tasks.make_place()?;
    if arguments.retry_failed {
        tasks.forget_failures()?;
    }
    let bar = progress_bar(verbosity, "{pos}/{len}  ")?;
    let report =
        Report { file: String::new(), tasks: 0, all_tasks: 0, failures: 0, peak_memory: None, seconds: 0.0 };
    let (leases, done) = (Leases::new(*stale_after), BTreeSet::new());
    let mut worker = Worker { arguments, tasks, again, leases, done, report, bar };
    worker.begin();
    worker.work()?;
    worker.bar.finish_and_clear();
    let report = Report { seconds: start.elapsed().as_secs_f64(), ..worker.report };
    verbosity.print(
        &report,
        &[
            ("file", report.file.clone()),
            ("tasks", format!("{} of {} by this worker", report.tasks, report.all_tasks)),
            ("memory", report.peak_memory.map_or("not known".to_owned(), output::bytes)),
            ("time", format!("{:.2} s", report.seconds)),
        ],
    )
}

/// Ends this process when the worker that has started it is gone.
fn end_with_the_worker() {
    std::thread::spawn(|| {
        // Whatever it is: nothing more comes.
        let _ = io::copy(&mut io::stdin(), &mut io::sink());
        files::interrupt();
    });
}

/// Does a task in this process.
fn perform(folder: &PathBuf, tasks: &Tasks, task: Node) -> Result<()> {
    let verbosity = Verbosity { quiet: true, ..Verbosity::default() };
    match task.level {
        0 => parts::build_part(slice::from_ref(folder), [task.index, tasks.levels()[0]], &verbosity),
        _ if task == tasks.last() => {
            join::finish(folder, &tasks.result(task), Sharding::default(), &verbosity)
        }
        _ => parts::join_node(folder, task, &verbosity),
    }
}

impl Worker<'_> {
    /// Counts the tasks that are known now.
    fn begin(&mut self) {
        let count: u32 = self.tasks.levels().iter().sum();
        self.bar.set_length(count.into());
        self.report.all_tasks += count;
        self.report.file = self.tasks.result(self.tasks.last()).display().to_string();
    }

    /// Works until the file is there.
    fn work(&mut self) -> Result<()> {
        let mut pause = SHORT;
        loop {
            let files = self.tasks.files()?;
            self.tasks.look(&files, &mut self.done)?;
            self.bar.set_position(self.done.len() as u64);
            if self.done.contains(&self.tasks.last()) {
                if self.tasks.are_planned() {
                    return Ok(());
                }
                self.tasks = Tasks::of(&self.arguments.folder)?;
                self.done.clear();
                self.begin();
                continue;
            }
            if let Some(pieces) = self.tasks.pieces()?.filter(|pieces| !pieces.are_there()) {
                let (words, folder) = (pieces.words(), self.arguments.folder.display());
                ensure!(
                    self.arguments.wait,
                    "{words}. `tetralod work {folder} --wait` waits until all are there"
                );
                self.bar.set_message(format!("wait for {} pieces", pieces.missing()));
                std::thread::sleep(pause);
                pause = (2 * pause).min(PATIENCE);
                continue;
            }
            if let Some((task, lease)) = self.take(&files)? {
                self.perform_apart(task, lease)?;
                pause = SHORT;
            } else {
                self.bar.set_message("wait");
                std::thread::sleep(pause);
                pause = (2 * pause).min(self.leases.beat()).min(PATIENCE);
            }
        }
    }

    /// Takes a task that others wait for, if there is one that nobody is at.
    fn take(&mut self, files: &Files) -> Result<Option<(Node, Lease)>> {
        let tries = |task| self.tasks.tries(task, files);
        let open = self.tasks.open(&self.done, |task| tries(task) > self.arguments.retries);
        // What can be done later needs something that is ready.
        if open.ready.is_empty() {
            bail!(self.failure(&open.failed, files));
        }
        let mut ready: Vec<Node> = open.ready.into_iter().rev().collect();
        // What has failed is left to others, as they may have more memory, while there is something else.
        ready.sort_by_key(|&task| tries(task));
        for task in ready {
            let Some(lease) = self.leases.take(&self.tasks, task)? else { continue };
            // It may have been done since the files were looked at.
            if !self.tasks.is_done(task)? {
                return Ok(Some((task, lease)));
            }
        }
        Ok(None)
    }

    /// Does a task in a process of its own, which may take all memory, and may have to be ended.
    fn perform_apart(&mut self, task: Node, mut lease: Lease) -> Result<()> {
        let Arguments { folder, threads, retries, verbosity, .. } = self.arguments;
        let name = self.tasks.name(task);
        self.bar.set_message(name.clone());
        let start = Instant::now();
        let mut stderr = tempfile::tempfile().context("no temporary file")?;
        let (program, first) = self.again.split_first().context("no program")?;
        let mut command = Command::new(program);
        command.args(first).arg("work").arg(folder);
        if self.tasks.are_planned() {
            command.arg(format!("--task={}/{}", task.level, task.index));
        } else {
            command.arg("--parting");
        }
        command.args(threads.map(|threads| format!("--threads={threads}")));
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(stderr.try_clone()?);
        let mut child = command.spawn().with_context(|| format!("{name} could not be started"))?;
        let (mut peak_memory, mut pause) = (None, SHORT);
        let status = loop {
            peak_memory = machine::peak_memory(child.id()).or(peak_memory);
            if let Some(status) = child.try_wait()? {
                break status;
            }
            lease.beat();
            std::thread::sleep(pause);
            pause = (2 * pause).min(LONG);
        };
        let done = Done { seconds: start.elapsed().as_secs_f64(), peak_memory, host: machine::name() };
        let memory = peak_memory.map_or("memory not known".to_owned(), output::bytes);
        let costs = format!("{:.2} s, {memory}", done.seconds);
        self.report.peak_memory = self.report.peak_memory.max(peak_memory);
        let mut said = || -> Result<String> {
            let mut said = Vec::new();
            stderr.rewind()?;
            stderr.read_to_end(&mut said)?;
            Ok(String::from_utf8_lossy(&said).into_owned())
        };
        let words = if status.success() {
            self.tasks.note_done(task, &done)?;
            self.report.tasks += 1;
            self.done.insert(task);
            // What was found and mended of a mesh, before the rest.
            let notes = said()?;
            format!("{notes}{name}: {costs}")
        } else if status.code() == Some(files::INTERRUPTED) {
            files::interrupt();
        } else {
            let error = output::failure(&said()?, status);
            let words = format!("{name} failed: {error} ({costs})");
            self.report.failures += 1;
            self.tasks.note_failure(task, &Failed { error, tries: retries.saturating_add(1), done })?;
            words
        };
        if !verbosity.quiet {
            self.bar.suspend(|| output::note(&words));
        }
        Ok(())
    }

    /// Why nothing can be done any more.
    fn failure(&self, failed: &[Node], files: &Files) -> String {
        let folder = self.arguments.folder.display();
        let words = |&task: &Node| {
            let tries = self.tasks.tries(task, files);
            let error = self.tasks.failure(task, tries).map_or("not known".to_owned(), |failed| failed.error);
            format!("{} has failed {tries} times, at last: {error}", self.tasks.name(task))
        };
        let first = failed.first().map(words).unwrap_or_default();
        let more = match failed.len() {
            0 | 1 => String::new(),
            more => format!(" `tetralod status {folder}` lists {} more.", more - 1),
        };
        format!("{first}.{more} When the cause is gone, `tetralod work {folder} --retry-failed` goes on")
    }
}

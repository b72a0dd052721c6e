//! `tetralod status`: how far workers are.

use super::output;
use super::work::lease::{self, Holder};
use super::work::request::Awaited;
use super::work::tasks::{Done, Failed, Files, Tasks};
use anyhow::{Context, Result};
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;
use std::collections::BTreeSet;
use std::io::{self, IsTerminal};
use std::path::PathBuf;
use std::time::{Duration, Instant};
use tetralod_build::parts::Node;

/// Shows how far the workers of a folder are (`tetralod work`); changes nothing there.
#[derive(clap::Args)]
pub struct Arguments {
    /// The folder that `tetralod part` has written.
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
    /// Show it again whenever it has changed, until nothing is left to be done.
    #[arg(long)]
    watch: bool,
    /// Print it as a JSON object, with --watch one a line.
    #[arg(long)]
    json: bool,
}

/// How often a folder is looked at, at most.
const LOOK: Duration = Duration::from_secs(1);

/// What is shown, as programs get it.
#[derive(Serialize)]
struct Status {
    folder: String,
    /// The MT file, if it is there.
    file: Option<String>,
    /// Whether there is something that workers can do, now or when pieces are there.
    goes_on: bool,
    /// The pieces of a mesh that is to be parted later.
    pieces: Option<Awaited>,
    levels: Vec<Level>,
    running: Vec<Running>,
    failed: Vec<FailedTask>,
    /// Tasks that have been done, of which there are notes.
    finished: Vec<Finished>,
    /// As the workers there are do tasks of those kinds that have been finished; none if none has.
    tasks_per_minute: Option<f64>,
    /// Of the same kinds: more if there are others.
    seconds_left: Option<f64>,
}

/// The tasks of one level.
#[derive(Default, Serialize)]
struct Level {
    what: String,
    tasks: u32,
    done: u32,
    /// With a lease that is not stale.
    running: u32,
    /// Failed too often.
    failed: u32,
    waiting: u32,
    /// The mean of one.
    seconds_each: Option<f64>,
    /// The largest of one, in bytes.
    peak_memory: Option<u64>,
}

#[derive(Serialize)]
struct Running {
    task: String,
    #[serde(skip)]
    level: u32,
    #[serde(flatten)]
    holder: Holder,
    seconds: f64,
    /// Since its heartbeat.
    silent_seconds: f64,
    is_stale: bool,
}

#[derive(Serialize)]
struct FailedTask {
    task: String,
    /// How often.
    times: u32,
    /// Whether no worker tries it again.
    is_final: bool,
    #[serde(flatten)]
    last: Failed,
}

#[derive(Serialize)]
struct Finished {
    task: String,
    #[serde(skip)]
    level: u32,
    #[serde(flatten)]
    done: Done,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let (mut tasks, mut done) = (Tasks::of(&arguments.folder)?, BTreeSet::new());
    if !arguments.watch {
        let status = Status::of(arguments, &tasks, &mut done)?;
        return output::result(arguments.json, &status, &status.rows());
    }
    let is_bar = !arguments.json && io::stdout().is_terminal();
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stdout());
    bar.set_style(ProgressStyle::with_template("{msg}").context("the style of the table")?);
    let mut shown = None;
    loop {
        let start = Instant::now();
        let status = Status::of(arguments, &tasks, &mut done)?;
        let (is_last, key) = (!status.goes_on, status.key());
        if is_bar && !is_last {
            bar.set_message(output::printable(&output::lines(&status.rows())).into_owned());
        } else if shown.as_ref() != Some(&key) {
            bar.finish_and_clear();
            if arguments.json {
                output::print(&serde_json::to_string(&status)?)?;
            } else {
                output::print(&output::lines(&status.rows()))?;
            }
            shown = Some(key);
        }
        if is_last {
            return Ok(());
        }
        if !tasks.are_planned() {
            (tasks, done) = (Tasks::of(&arguments.folder)?, BTreeSet::new());
        }
        // Looking takes a tenth of the time at most.
        std::thread::sleep(LOOK.max(10 * start.elapsed()));
    }
}

impl Status {
    /// `done` is what was done when it was looked at before.
    fn of(arguments: &Arguments, tasks: &Tasks, done: &mut BTreeSet<Node>) -> Result<Self> {
        let (files, last) = (tasks.files()?, tasks.last());
        tasks.look(&files, done)?;
        let has_file = tasks.are_planned() && done.contains(&last);
        let mut status = Self {
            folder: arguments.folder.display().to_string(),
            file: has_file.then(|| tasks.result(last).display().to_string()),
            goes_on: false,
            pieces: tasks.pieces()?,
            levels: tasks.levels().iter().map(|&tasks| Level { tasks, ..Level::default() }).collect(),
            running: Vec::new(),
            failed: Vec::new(),
            finished: Vec::new(),
            tasks_per_minute: None,
            seconds_left: None,
        };
        let mut failed = BTreeSet::new();
        for task in tasks.all() {
            if done.contains(&task) {
                status.add_done(tasks, task);
            } else if status.add_open(tasks, task, &files) {
                failed.insert(task);
            }
        }
        let has_ready = || !tasks.open(done, |task| failed.contains(&task)).ready.is_empty();
        // With the plan come other tasks.
        let is_parted_just_now = !tasks.are_planned() && done.contains(&last);
        status.goes_on = is_parted_just_now || status.file.is_none() && has_ready();
        for (level, number) in status.levels.iter_mut().zip(0..) {
            level.what = match number {
                _ if !tasks.are_planned() => "part".to_owned(),
                0 => "build".to_owned(),
                _ if number == last.level => "file".to_owned(),
                _ => format!("join {number}"),
            };
            let known = || status.finished.iter().filter(|task| task.level == number).map(|task| &task.done);
            let count = known().count();
            level.seconds_each =
                (count > 0).then(|| known().map(|done| done.seconds).sum::<f64>() / count as f64);
            level.peak_memory = known().filter_map(|done| done.peak_memory).max();
        }
        status.forecast();
        Ok(status)
    }

    /// Counts a task that is done.
    fn add_done(&mut self, tasks: &Tasks, task: Node) {
        let (name, level) = (tasks.name(task), task.level);
        self.levels[level as usize].done += 1;
        self.finished.extend(tasks.done(task).map(|done| Finished { task: name, level, done }));
    }

    /// Counts one that is not; returns true if it has failed too often.
    fn add_open(&mut self, tasks: &Tasks, task: Node, files: &Files) -> bool {
        let (name, level) = (tasks.name(task), task.level);
        let counts = &mut self.levels[level as usize];
        let (times, holder) = (tasks.tries(task, files), lease::last_of(tasks, task, files));
        let last = tasks.failure(task, times);
        let is_final = last.as_ref().is_some_and(|last| times >= last.tries);
        let is_stale = |(holder, silent): &(Holder, f64)| *silent > holder.stale_after;
        let (has_failed, count) = match &holder {
            Some(lease) if !is_stale(lease) => (false, &mut counts.running),
            _ if is_final => (true, &mut counts.failed),
            _ => (false, &mut counts.waiting),
        };
        *count += 1;
        self.failed.extend(last.map(|last| FailedTask { task: name.clone(), times, is_final, last }));
        self.running.extend(holder.map(|lease| Running {
            task: name,
            level,
            seconds: (lease::now() - lease.0.since).max(0.0),
            silent_seconds: lease.1,
            is_stale: is_stale(&lease),
            holder: lease.0,
        }));
        has_failed
    }

    /// Says how long the rest will take by what finished tasks of the same kinds have taken.
    fn forecast(&mut self) {
        let each = |level: u32| self.levels[level as usize].seconds_each;
        let at_work = || self.running.iter().filter(|task| !task.is_stale);
        let rates: Vec<f64> = at_work().filter_map(|task| Some(60.0 / each(task.level)?)).collect();
        let begun = at_work().filter_map(|task| Some(task.seconds.min(each(task.level)?))).sum::<f64>();
        let rest = |level: &Level| Some(f64::from(level.tasks - level.done) * level.seconds_each?);
        let rest = self.levels.iter().filter_map(rest).sum::<f64>() - begun;
        if !rates.is_empty() {
            self.tasks_per_minute = Some(rates.iter().sum());
            self.seconds_left = Some(rest / at_work().count() as f64);
        }
    }

    /// What has to change before it is shown again.
    fn key(&self) -> Vec<u32> {
        let of_level = |level: &Level| [level.done, level.running, level.failed];
        let failures = self.failed.iter().map(|task| task.times);
        let missing = self.pieces.iter().map(|pieces| pieces.missing() as u32);
        self.levels.iter().flat_map(of_level).chain(failures).chain(missing).collect()
    }

    fn rows(&self) -> Vec<(String, String)> {
        let mut rows = vec![("folder".to_owned(), self.folder.clone())];
        rows.extend(self.pieces.iter().map(|pieces| ("pieces".to_owned(), pieces.words())));
        rows.extend(self.levels.iter().map(|level| (level.what.clone(), level.words(self.file.as_ref()))));
        rows.extend(self.running.iter().map(|task| ("running".to_owned(), task.words())));
        rows.extend(self.failed.iter().map(|task| ("failed".to_owned(), task.words())));
        rows.extend(
            self.tasks_per_minute.map(|rate| ("rate".to_owned(), format!("{rate:.1} tasks per minute"))),
        );
        rows.extend(self.seconds_left.map(|left| {
            let is_known = |level: &Level| level.done == level.tasks || level.seconds_each.is_some();
            let more = if self.levels.iter().all(is_known) { "about" } else { "more than" };
            ("time left".to_owned(), format!("{more} {}", duration(left)))
        }));
        rows
    }
}

impl Level {
    fn words(&self, file: Option<&String>) -> String {
        let Self { tasks, done, running, failed, waiting, .. } = *self;
        let mut words = match file {
            Some(file) if self.what == "file" => file.clone(),
            _ => format!("{done} of {tasks} done"),
        };
        for (count, what) in [(running, "running"), (failed, "failed"), (waiting, "waiting")] {
            if count > 0 {
                words += &format!(", {count} {what}");
            }
        }
        if let Some(seconds) = self.seconds_each {
            words += &format!("; {seconds:.2} s each");
        }
        if let Some(bytes) = self.peak_memory {
            words += &format!(", at most {}", output::bytes(bytes));
        }
        words
    }
}

impl Running {
    fn words(&self) -> String {
        let Self { task, holder: Holder { host, process, .. }, .. } = self;
        let stale = match self.is_stale {
            true => format!(", stale: no heartbeat for {}", duration(self.silent_seconds)),
            false => String::new(),
        };
        format!("{task} on {host}, process {process}, for {}{stale}", duration(self.seconds))
    }
}

impl FailedTask {
    fn words(&self) -> String {
        let Self { task, times, last: Failed { error, .. }, .. } = self;
        let next = if self.is_final { "left" } else { "to be tried again" };
        format!("{task}, {times} times, {next}: {error}")
    }
}

/// Seconds, for people.
fn duration(seconds: f64) -> String {
    HumanDuration(Duration::try_from_secs_f64(seconds).unwrap_or_default()).to_string()
}

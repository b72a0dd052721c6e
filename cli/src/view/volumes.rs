//! The volumes that a page shows, and what becomes of their files.

use super::cache::{Cache, Seen};
use crate::files;
use crate::output::{self, Verbosity};
use crate::progress::progress_bar;
use anyhow::{Context, Result, bail, ensure};
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tetralod::mt::MtInfo;

/// How often files are looked at.
const LOOK: Duration = Duration::from_millis(500);

/// How often the page asks for the list, in ms.
const ASK: u64 = 1000;

/// How an MT file begins.
const MT: [u8; 8] = *b"\x89TLOD\r\n\x1a";

/// The volumes that are shown, in the order in which they were given.
pub struct Volumes {
    all: Mutex<Vec<Volume>>,
    cache: Cache,
    /// What runs this command in another process: a program, and its first arguments.
    again: Vec<OsString>,
    /// The build that is under way; none is begun once `stop` was called.
    building: Mutex<Building>,
}

#[derive(Default)]
struct Building {
    child: Option<Child>,
    is_stopped: bool,
}

/// One volume.
struct Volume {
    /// What the user has given.
    given: PathBuf,
    /// The MT file that is shown, if there is one.
    shown: Option<Shown>,
    /// What is shown was made of these files; when one changes, it is made again.
    inputs: Vec<Seen>,
    /// The files as they were when they were last seen to differ: a file that grows is not yet there.
    differing: Option<Vec<Seen>>,
    state: State,
}

#[derive(Clone, PartialEq)]
enum State {
    /// Something is to be done.
    Due,
    /// How far the build is.
    Building(Step),
    Done,
    Failed(String),
}

/// A line of `tetralod build --progress json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Step {
    stage: String,
    done: u64,
    total: u64,
}

/// An MT file, and what the page lists of it.
#[derive(Clone)]
struct Shown {
    path: PathBuf,
    version: String,
    vertices: u32,
    tetrahedra: u64,
    fields: usize,
    bytes: u64,
}

impl Shown {
    fn of(path: &Path) -> Result<Self> {
        let seen = Seen::now(path);
        let opened = files::Opened::of(files::open_parts(path).with_context(|| path.display().to_string())?);
        let &MtInfo { vertices, tetrahedra, ref fields, .. } = opened.info()?;
        let (version, fields) = (seen.version(), fields.len());
        Ok(Self { path: path.to_owned(), version, vertices, tetrahedra, fields, bytes: opened.bytes })
    }
}

/// What the page gets.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub struct List {
    volumes: Vec<Listed>,
    pending: Vec<Pending>,
    failed: Vec<Failed>,
    /// How often it is to be asked for, in ms.
    look: u64,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Listed {
    url: String,
    title: String,
    sentence: String,
    scene: &'static str,
    is_shown: bool,
    /// Another one when the file has changed.
    version: String,
    vertices: u32,
    tetrahedra: u64,
    fields: usize,
    bytes: u64,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Pending {
    title: String,
    is_shown: bool,
    #[serde(flatten)]
    step: Step,
}

#[derive(Serialize)]
struct Failed {
    title: String,
    message: String,
}

impl Volumes {
    /// Those of these files.
    pub fn of(given: &[PathBuf], cache: Cache, again: &[OsString]) -> Result<Self> {
        for path in given {
            ensure!(
                files::scheme(path).is_none(),
                "{}: an address; give the page a link to it: #url=ADDRESS",
                path.display()
            );
            fs::metadata(path).with_context(|| path.display().to_string())?;
        }
        let volume = |given: &PathBuf| Volume {
            given: given.clone(),
            shown: None,
            inputs: Vec::new(),
            differing: None,
            state: State::Due,
        };
        let all = Mutex::new(given.iter().map(volume).collect());
        Ok(Self { all, cache, again: again.to_vec(), building: Mutex::default() })
    }

    fn all(&self) -> MutexGuard<'_, Vec<Volume>> {
        // Each change of a volume is whole.
        self.all.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn building(&self) -> MutexGuard<'_, Building> {
        self.building.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The MT file of a volume.
    pub fn file(&self, number: usize) -> Option<PathBuf> {
        self.all().get(number)?.shown.as_ref().map(|shown| shown.path.clone())
    }

    pub fn list(&self) -> List {
        let all = self.all();
        let title = |volume: &Volume| {
            volume.given.file_name().unwrap_or(volume.given.as_os_str()).to_string_lossy().into_owned()
        };
        let listed = |(number, volume): (usize, &Volume)| {
            let shown = volume.shown.clone()?;
            let name = title(volume);
            let stem = name.rsplit_once('.').map_or(&*name, |(stem, _)| stem);
            let stem = percent_encoding::utf8_percent_encode(stem, percent_encoding::NON_ALPHANUMERIC);
            Some(Listed {
                url: format!("files/{number}/{stem}.mt"),
                sentence: volume.given.display().to_string(),
                title: name,
                scene: "",
                is_shown: true,
                version: shown.version,
                vertices: shown.vertices,
                tetrahedra: shown.tetrahedra,
                fields: shown.fields,
                bytes: shown.bytes,
            })
        };
        let pending = |volume: &Volume| {
            let step = match &volume.state {
                State::Due => Step { stage: "wait".to_owned(), ..Step::default() },
                State::Building(step) => step.clone(),
                State::Done | State::Failed(_) => return None,
            };
            Some(Pending { title: title(volume), is_shown: true, step })
        };
        let failed = |volume: &Volume| {
            let State::Failed(message) = &volume.state else { return None };
            Some(Failed { title: title(volume), message: message.clone() })
        };
        List {
            volumes: all.iter().enumerate().filter_map(listed).collect(),
            pending: all.iter().filter_map(pending).collect(),
            failed: all.iter().filter_map(failed).collect(),
            look: ASK,
        }
    }

    /// Brings volumes up to date, and keeps them so, until `stop` is called.
    pub fn keep_up(&self) {
        while !self.building().is_stopped {
            let due = self.all().iter().position(|volume| volume.state == State::Due);
            match due {
                Some(number) => self.make(number),
                None => {
                    std::thread::sleep(LOOK);
                    self.all().iter_mut().for_each(Volume::look);
                }
            }
        }
    }

    /// Makes or finds the MT file of a volume.
    fn make(&self, number: usize) {
        let Some(given) = self.all().get(number).map(|volume| volume.given.clone()) else { return };
        // As they are before they are read: what is written meanwhile counts as a change.
        let made = self.shown_of(number, &given);
        if self.building().is_stopped {
            return;
        }
        if let Err(error) = &made {
            output::note(&format!("error: {error:#}"));
        }
        if let Some(volume) = self.all().get_mut(number) {
            match made {
                Ok((shown, inputs)) => {
                    (volume.shown, volume.inputs, volume.state) = (Some(shown), inputs, State::Done)
                }
                Err(error) => {
                    // Until the file is another one.
                    (volume.inputs, volume.state) =
                        (vec![Seen::now(&given)], State::Failed(format!("{error:#}")));
                }
            }
        }
    }

    fn shown_of(&self, number: usize, given: &Path) -> Result<(Shown, Vec<Seen>)> {
        let seen = Seen::now(given);
        if is_mt(given)? {
            return Ok((Shown::of(given)?, vec![seen]));
        }
        let place = self.cache.place(given);
        let inputs = match Cache::inputs(&place) {
            Some(inputs) => inputs,
            None => self.build(number, given, &place)?,
        };
        Ok((Shown::of(&place)?, inputs))
    }

    /// Builds an MT file of `given`, by this command in a process of its own: that may need all memory, and may have to be ended.
    fn build(&self, number: usize, given: &Path, place: &Path) -> Result<Vec<Seen>> {
        let before = Seen::now(given);
        let workplace = self.cache.workplace()?;
        let [built, report] = ["built.mt", "report.json"].map(|name| workplace.path().join(name));
        let (program, first) = self.again.split_first().context("no program")?;
        let mut command = Command::new(program);
        command.args(first).arg("build").arg(given).args(&self.cache.options).arg("-o").arg(&built);
        command.args(["--json", "--progress", "json"]).stdin(Stdio::null());
        command.stdout(fs::File::create(&report)?).stderr(Stdio::piped());
        let Some(stderr) = self.begin(&mut command)? else { bail!("stopped") };
        let mut said = String::new();
        let bar = progress_bar(&Verbosity::default(), "")?;
        for line in BufReader::new(stderr).lines() {
            let line = line?;
            if let Ok(step) = serde_json::from_str::<Step>(&line) {
                bar.set_length(step.total);
                bar.set_position(step.done);
                bar.set_message(step.stage.clone());
                self.tell(number, step);
                continue;
            }
            // Words about an error may go on.
            if output::is_error(&line) || !said.is_empty() {
                said += &format!("{line}\n");
            } else {
                bar.suspend(|| output::note(&line));
            }
        }
        bar.finish_and_clear();
        let Some(mut child) = self.building().child.take() else { bail!("stopped") };
        let status = child.wait()?;
        if !status.success() {
            bail!(output::failure(&said, status));
        }
        let Report { inputs } =
            serde_json::from_slice(&fs::read(&report)?).context("the report of the build")?;
        // The report names files in text, so one whose name is none is not found there.
        let others = inputs.iter().map(|path| Seen::now(path));
        let others = others.filter(|seen| seen.is_there() && !is_same(seen.path(), given));
        let inputs: Vec<Seen> = [before].into_iter().chain(others).collect();
        self.cache.keep(&built, place, &inputs)?;
        Ok(inputs)
    }

    /// Starts a process, and gives what it says; nothing if all is to end.
    fn begin(&self, command: &mut Command) -> Result<Option<std::process::ChildStderr>> {
        let mut building = self.building();
        if building.is_stopped {
            return Ok(None);
        }
        let mut child = command.spawn().context("the build could not be started")?;
        let stderr = child.stderr.take();
        building.child = Some(child);
        Ok(stderr)
    }

    fn tell(&self, number: usize, step: Step) {
        if let Some(volume) = self.all().get_mut(number) {
            volume.state = State::Building(step);
        }
    }

    /// Ends what is under way.
    pub fn stop(&self) {
        let mut building = self.building();
        building.is_stopped = true;
        if let Some(mut child) = building.child.take() {
            // It may have ended by itself.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// What is needed of the report of a build.
#[derive(Deserialize)]
struct Report {
    inputs: Vec<PathBuf>,
}

impl Volume {
    /// Notes that something is to be done, once files have changed and change no longer.
    fn look(&mut self) {
        if !matches!(self.state, State::Done | State::Failed(_)) {
            return;
        }
        let now: Vec<Seen> = self.inputs.iter().map(|seen| Seen::now(seen.path())).collect();
        // A file that is being replaced may be away for a moment.
        if now == self.inputs || !now.iter().all(Seen::is_there) {
            self.differing = None;
        } else if self.differing.as_ref() == Some(&now) {
            (self.state, self.differing) = (State::Due, None);
        } else {
            self.differing = Some(now);
        }
    }
}

fn is_mt(path: &Path) -> Result<bool> {
    let mut start = [0; MT.len()];
    let read = fs::File::open(path).and_then(|mut file| std::io::Read::read(&mut file, &mut start));
    let length = read.with_context(|| path.display().to_string())?;
    Ok(length == MT.len() && start == MT)
}

fn is_same(a: &Path, b: &Path) -> bool {
    matches!((fs::canonicalize(a), fs::canonicalize(b)), (Ok(a), Ok(b)) if a == b)
}

//! Building in parts: a folder of files, and the steps from file to file.

use super::files;
use super::output::{self, Verbosity};
use super::progress::{progress_bar, with_progress};
use super::remedies::failed;
use super::scratch::{BlockFiles, ScratchFolder};
use super::shards::Sharding;
use anyhow::{Context, Result, bail, ensure};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};
use tetralod::format::{BlockEncoder, EncodeOptions};
use tetralod::mesh::TetMesh;
use tetralod::mt::{Exact, Mt};
use tetralod_build::parts::{
    self, Assembled, GridValues, Node, Part, PartUpdates, PartsError, Piecewise, Plan, PointBox,
};
use tetralod_build::{BuildConfig, BuildProgress, BuildSummary, OnProgress};
use tetralod_io::{GridInParts, Pieces};

/// Parses `I/N`: a part and how many there are.
pub fn of_all(text: &str) -> Result<[u32; 2]> {
    numbers(text).filter(|[i, n]| i < n).context("it must be I/N, as 0/8 for the first of eight")
}

/// Parses `L/K`: a level and a number there.
pub fn node(text: &str) -> Result<Node> {
    let [level, index] = numbers(text).context("it must be L/K, as 1/0 for the first of level 1")?;
    Ok(Node { level, index })
}

/// Two numbers with a slash between them.
fn numbers(text: &str) -> Option<[u32; 2]> {
    let (one, other) = text.split_once('/')?;
    Some([one.trim().parse().ok()?, other.trim().parse().ok()?])
}

/// The file that says which steps there are.
pub const PLAN: &str = "plan.json";

/// The version of this program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The folder in which steps hand each other files.
pub struct Folder<'a>(pub &'a Path);

/// What [`PLAN`] says, for programs that plan the steps.
#[derive(Serialize, Deserialize)]
pub struct PlanFile {
    /// That of the program that has parted the mesh: another one may build other bytes.
    version: String,
    pub parts: u32,
    /// How many files each level has: `built-L-K.part`. As many of one level make one of the next as there are more of them.
    pub levels: Vec<u32>,
    pub tetrahedra: u64,
    vertices: u64,
}

impl PlanFile {
    pub fn of(plan: &Plan) -> Self {
        let [vertices, tetrahedra] = plan.counts();
        let version = VERSION.to_owned();
        Self { version, parts: plan.parts(), levels: plan.levels(), tetrahedra, vertices }
    }

    /// The first of those that are joined to a node.
    fn first_child(&self, node: Node) -> Result<Node> {
        let level =
            node.level.checked_sub(1).context("parts of level 0 are made by `tetralod build --part`")?;
        let [below, own] = [level, node.level].map(|level| self.levels.get(level as usize).copied());
        let (Some(below), Some(own)) = (below, own.filter(|&own| node.index < own)) else {
            return Err(PartsError::NoNode { level: node.level, index: node.index }.into());
        };
        Ok(Node { level, index: node.index * (below / own) })
    }
}

impl Folder<'_> {
    fn parted(&self, index: u32) -> PathBuf {
        self.0.join(format!("input-{index}.part"))
    }

    pub fn built(&self, node: Node) -> PathBuf {
        self.0.join(format!("built-{}-{}.part", node.level, node.index))
    }

    /// Parts a mesh.
    pub fn part(
        &self,
        mesh: &TetMesh,
        config: &BuildConfig,
        count: u32,
        metadata: BTreeMap<String, String>,
    ) -> Result<Plan> {
        let plan = parts::part(mesh, config, count, metadata, &mut |part| self.keep_parted(&part));
        let plan = plan.map_err(said)?;
        self.keep_plan(&plan)?;
        Ok(plan)
    }

    /// Parts a mesh piece by piece; none, with the reason, if that takes the whole.
    pub fn part_pieces(
        &self,
        input: &InPieces<'_>,
        config: &BuildConfig,
        count: u32,
        metadata: BTreeMap<String, String>,
    ) -> Result<Result<Plan, PartsError>> {
        if let Some(grid) = input.pieces.grid() {
            return self.part_grid((input, grid), config, count, metadata);
        }
        // Beside the parts, and gone afterwards.
        files::in_folder_beside(&self.0.join("pieces"), |folder| {
            let scratch = ScratchFolder::new(folder);
            let part = || -> Result<Plan> {
                let mut parting = Piecewise::new(config, count, &scratch)?;
                input.pieces.for_each::<anyhow::Error>(&mut |mut piece| {
                    (input.prepare)(&mut piece.mesh)?;
                    Ok(parting.add(piece)?)
                })?;
                let plan = parting.part(metadata.clone(), &mut |part| self.keep_parted(&part))?;
                self.keep_plan(&plan)?;
                Ok(plan)
            };
            match part() {
                Ok(plan) => Ok(Ok(plan)),
                Err(error) => match error.downcast::<PartsError>() {
                    Ok(error @ PartsError::NeedsWhole { .. }) => Ok(Err(error)),
                    Ok(error) => Err(said(error)),
                    Err(error) => Err(error),
                },
            }
        })
    }

    /// Parts a grid of which boxes are read.
    fn part_grid(
        &self,
        (input, grid): (&InPieces<'_>, &GridInParts),
        config: &BuildConfig,
        count: u32,
        metadata: BTreeMap<String, String>,
    ) -> Result<Result<Plan, PartsError>> {
        let read = |field: usize, points: PointBox| {
            grid.values(field, points).map_err(|error| PartsError::other(input.pieces.named(error)))
        };
        let values = GridValues { mesh: grid.mesh().clone(), layers: grid.layers(), read: &read };
        let prepare = |mesh: &mut TetMesh| (input.prepare)(mesh).map_err(PartsError::other);
        match parts::part_grid(&values, &prepare, config, count, metadata, &mut |part| {
            self.keep_parted(&part)
        }) {
            Ok(plan) => self.keep_plan(&plan).map(|()| Ok(plan)),
            Err(error @ PartsError::NeedsWhole { .. }) => Ok(Err(error)),
            Err(error) => Err(said(error)),
        }
    }

    /// The plan, as its first part has it, if this version has made it.
    pub fn checked_plan(&self) -> Result<Plan> {
        self.plan_file()?;
        read(&self.parted(0), "`tetralod part`", |file| Plan::read(file))
    }

    fn plan_file(&self) -> Result<PlanFile> {
        let (folder, path) = (self.0.display(), self.0.join(PLAN));
        let text = match std::fs::read(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                bail!("{folder} has no {PLAN}: `tetralod part INPUT --parts N -o {folder}` writes it")
            }
            text => text.with_context(|| path.display().to_string())?,
        };
        let file: PlanFile = serde_json::from_slice(&text)
            .with_context(|| format!("{} is no plan of this version; part the mesh again", path.display()))?;
        check_version(self.0, &file.version)?;
        Ok(file)
    }

    fn keep_parted(&self, part: &Part<'_>) -> Result<(), PartsError> {
        let write = |out: &mut dyn std::io::Write| Ok(part.write(out)?);
        files::write_file(&self.parted(part.node().index), |out| write(out)).map_err(PartsError::other)
    }

    fn keep_plan(&self, plan: &Plan) -> Result<()> {
        let file = PlanFile::of(plan);
        // Last: with it the parts are complete.
        files::write_file(&self.0.join(PLAN), |out| Ok(serde_json::to_writer_pretty(out, &file)?))
    }

    /// Builds a part.
    fn build(&self, index: u32, progress: OnProgress<'_>) -> Result<Step> {
        self.with_scratch(Node { level: 0, index }, |scratch| {
            let part = self.read(&self.parted(index), "`tetralod part`", scratch)?;
            let before = part.tetrahedra();
            self.keep(before, parts::build_part(part, scratch, progress).map_err(said)?)
        })
    }

    /// Joins the parts of a node.
    fn join(&self, node: Node, plan: &Plan, progress: OnProgress<'_>) -> Result<Step> {
        self.with_scratch(node, |scratch| {
            let mut left = Vec::new();
            for child in plan.children(node).map_err(said)? {
                left.push(self.read(&self.built(child), &command_for(child, plan), scratch)?);
            }
            let before = left.iter().map(Part::tetrahedra).sum();
            self.keep(before, parts::join(node, left, scratch, progress).map_err(said)?)
        })
    }

    /// Makes a node with a folder beside it for what is not kept in memory.
    fn with_scratch(
        &self,
        node: Node,
        make: impl FnOnce(&ScratchFolder<'_>) -> Result<Step>,
    ) -> Result<Step> {
        files::in_folder_beside(&self.built(node), |folder| make(&ScratchFolder::new(folder)))
    }

    /// Builds or joins all nodes of a level, so many of them at a time, each by one thread; a node that is alone, by all.
    fn make_level(
        &self,
        plan: &Plan,
        (level, nodes): (u32, u32),
        at_a_time: u32,
        verbosity: &Verbosity,
    ) -> Result<()> {
        let side_by_side = at_a_time.min(nodes);
        let bar = progress_bar(verbosity, "")?;
        bar.set_length(u64::from(nodes) * PER_NODE);
        bar.set_message(if level == 0 { "build parts" } else { "join parts" });
        let make = |index: u32| {
            let mut told = 0;
            let mut tell = |share: u64| {
                bar.inc(share.saturating_sub(told));
                told = told.max(share);
            };
            let on_progress: OnProgress<'_> = &mut |progress: BuildProgress| {
                tell(progress.done * PER_NODE / progress.total.max(1));
                ControlFlow::Continue(())
            };
            let step = match level {
                0 => self.build(index, on_progress),
                _ => self.join(Node { level, index }, plan, on_progress),
            };
            tell(PER_NODE);
            step
        };
        if side_by_side == 1 {
            return (0..nodes).try_for_each(|index| make(index).map(drop));
        }
        let next = AtomicU32::new(0);
        let failure = Mutex::new(None);
        let work = || -> Result<()> {
            let pool =
                rayon::ThreadPoolBuilder::new().num_threads(1).build().context("starting the threads")?;
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                if index >= nodes {
                    return Ok(());
                }
                pool.install(|| make(index))?;
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..side_by_side {
                scope.spawn(|| {
                    if let Err(error) = work() {
                        // The others have nothing left to do.
                        next.store(nodes, Ordering::Relaxed);
                        failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                    }
                });
            }
        });
        failure.into_inner().unwrap_or_else(PoisonError::into_inner).map_or(Ok(()), Err)
    }

    fn keep(&self, before: usize, (part, updates): (Part<'_>, PartUpdates)) -> Result<Step> {
        let path = self.built(part.node());
        files::write_file(&path, |out| Ok(part.write_built(&updates, out)?))?;
        Ok(Step {
            file: path.display().to_string(),
            tetrahedra: before,
            left: part.tetrahedra(),
            updates: updates.len(),
        })
    }

    /// Writes the MT file of all that has been built.
    fn assemble(&self, plan: &Plan, to: &Output<'_>, verbosity: &Verbosity) -> Result<Written> {
        let updates = |node: Node| {
            let path = self.built(node);
            let file = File::open(&path).map_err(PartsError::Io);
            file.and_then(|file| PartUpdates::read(&mut BufReader::new(file))).map_err(|error| {
                PartsError::other(
                    anyhow::Error::from(error).context(missing(&path, &command_for(node, plan))),
                )
            })
        };
        let left = |node: Node| {
            let path = self.built(node);
            read(&path, &command_for(node, plan), Part::read_mesh).map_err(PartsError::other)
        };
        files::in_folder_beside(to.path, |folder| {
            let mut shelf = BlockFiles::new(folder);
            let mut encoder = BlockEncoder::new(&mut shelf);
            let take = &mut |builder: &mut _| encoder.take_blocks(builder).map_err(PartsError::other);
            let scratch = ScratchFolder::new(folder);
            let made = with_progress(verbosity, |progress| {
                parts::assemble_blocks(plan, (&left, &updates), &scratch, take, progress)
            });
            let Assembled { builder, summary, exact } = made?.map_err(said)?;
            let (options, mut mt) = (EncodeOptions::complete(Vec::new(), to.metadata.clone()), None);
            let bytes = to.sharding.write(to.path, |path| {
                files::write_file(path, |out| {
                    let (written, bytes) =
                        encoder.finish(builder, || exact.tables(Exact::IN_A_SECTION), &options, out)?;
                    mt = Some(written.into());
                    Ok(bytes)
                })
            })?;
            let mt = mt.context("nothing was written")?;
            Ok(Written { mt, summary, bytes })
        })
    }

    fn read<'s>(&self, path: &Path, made_by: &str, scratch: &'s ScratchFolder<'_>) -> Result<Part<'s>> {
        read(path, made_by, |file| Part::read(file, scratch))
    }

    /// The plan, as any of the parts has it: this one.
    fn plan(&self, of: Node) -> Result<Plan> {
        let step = if of.level == 0 { "`tetralod build --part`" } else { "`tetralod join --node`" };
        read(&self.built(of), step, |file| Plan::read(file))
    }
}

/// Refuses what another version has written, or was asked.
pub fn check_version(folder: &Path, version: &str) -> Result<()> {
    ensure!(
        version == VERSION,
        "{} was written by tetralod {version}, and this is {VERSION}, which may build other bytes: take tetralod {version}, or part the mesh \
         again by this one",
        folder.display()
    );
    Ok(())
}

/// Reads a file that another step has made.
fn read<T>(
    path: &Path,
    made_by: &str,
    read: impl FnOnce(&mut BufReader<File>) -> Result<T, PartsError>,
) -> Result<T> {
    let what = || missing(path, made_by);
    let file = File::open(path).with_context(what)?;
    read(&mut BufReader::new(file)).with_context(what)
}

fn missing(path: &Path, made_by: &str) -> String {
    format!("{} (written by {made_by})", path.display())
}

/// The command that writes the file of a node.
pub fn command_for(node: Node, plan: &Plan) -> String {
    match node {
        Node { level: 0, index } => format!("`tetralod build --part {index}/{}`", plan.parts()),
        Node { level, index } => format!("`tetralod join --node {level}/{index}`"),
    }
}

/// An error of building names the option that helps.
fn said(error: PartsError) -> anyhow::Error {
    match error {
        PartsError::Build(error) => failed(error),
        PartsError::Other(error) => anyhow::Error::from_boxed(error),
        error => error.into(),
    }
}

/// The summary of a step.
#[derive(Serialize)]
struct Step {
    file: String,
    tetrahedra: usize,
    left: usize,
    updates: usize,
}

impl Step {
    fn print(&self, verbosity: &Verbosity) -> Result<()> {
        let count = |n: usize| output::count(n as u64);
        verbosity.print(
            self,
            &[
                ("file", self.file.clone()),
                ("tetrahedra", format!("{}, of which {} are left", count(self.tetrahedra), count(self.left))),
                ("updates", count(self.updates)),
            ],
        )
    }
}

/// Builds one part of a folder: `tetralod build --part`.
pub fn build_part(inputs: &[PathBuf], [index, all]: [u32; 2], verbosity: &Verbosity) -> Result<()> {
    let [folder] = inputs else { bail!("--part takes one folder, the one that `tetralod part` has written") };
    let folder = Folder(folder);
    let plan = read(&folder.parted(index), "`tetralod part`", |file| Plan::read(file))?;
    if plan.parts() != all {
        bail!("{} has {} parts, not {all}", folder.0.display(), plan.parts());
    }
    with_progress(verbosity, |progress| folder.build(index, progress))??.print(verbosity)
}

/// Joins parts of a folder: `tetralod join --node`.
pub fn join_node(folder: &Path, node: Node, verbosity: &Verbosity) -> Result<()> {
    let folder = Folder(folder);
    // No part is read but those that are joined: others may be on other machines.
    let child = folder.plan_file()?.first_child(node)?;
    let plan = folder.plan(child)?;
    with_progress(verbosity, |progress| folder.join(node, &plan, progress))??.print(verbosity)
}

/// Writes the MT file of a folder in which all parts are built and joined.
pub fn assemble(folder: &Path, path: &Path, sharding: Sharding, verbosity: &Verbosity) -> Result<Written> {
    let folder = Folder(folder);
    let plan = folder.plan(Node { level: 0, index: 0 })?;
    folder.assemble(&plan, &Output { path, sharding, metadata: plan.metadata() }, verbosity)
}

/// A mesh in several files, and what is to be done to each piece.
pub struct InPieces<'a> {
    pub pieces: Pieces,
    pub prepare: &'a dyn Fn(&mut TetMesh) -> Result<()>,
}

/// The MT file to write, and what it is to say of itself.
pub struct Output<'a> {
    pub path: &'a Path,
    pub sharding: Sharding,
    pub metadata: &'a BTreeMap<String, String>,
}

/// An MT file that has been written: its MT, which need not have its updates, and its bytes.
pub struct Written {
    pub mt: Mt,
    pub summary: BuildSummary,
    pub bytes: u64,
}

/// What a part, or a join, counts as in the progress of its level.
const PER_NODE: u64 = 1000;

/// What is parted.
pub enum Whole<'a> {
    Mesh(Box<TetMesh>),
    Pieces(InPieces<'a>),
}

/// Builds a mesh in so many parts by one process, as many at a time as there are threads and with so many joins at a time, in a folder beside the
/// output that is gone afterwards, and writes its MT file.
///
/// None, with the reason, if pieces of it cannot be parted one by one.
pub fn build(
    whole: Whole<'_>,
    config: &BuildConfig,
    [count, joins]: [u32; 2],
    output: &Output<'_>,
    verbosity: &Verbosity,
) -> Result<Result<Written, PartsError>> {
    let metadata = || output.metadata.clone();
    files::in_folder_beside(output.path, |path| {
        let folder = Folder(path);
        let plan = match whole {
            Whole::Mesh(mesh) => folder.part(&mesh, config, count, metadata())?,
            Whole::Pieces(input) => match folder.part_pieces(&input, config, count, metadata())? {
                Ok(plan) => plan,
                Err(why) => return Ok(Err(why)),
            },
        };
        let threads = rayon::current_num_threads() as u32;
        for (level, nodes) in (0..).zip(plan.levels()) {
            let at_a_time = if level == 0 { threads } else { joins };
            folder.make_level(&plan, (level, nodes), at_a_time, verbosity)?;
        }
        folder.assemble(&plan, output, verbosity).map(Ok)
    })
}

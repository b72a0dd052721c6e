//! `tetralod part`: a mesh to parts that are built each on its own.

use super::build::options::BuildOptions;
use super::build::way::Way;
use super::files;
use super::output::{self, Verbosity};
use super::parts::{Folder, PLAN, PlanFile, VERSION};
use super::refuse_usage;
use super::work::request::{Awaited, Request};
use super::work::tasks;
use anyhow::{Context, Result, ensure};
use clap::{Args, FromArgMatches};
use serde::Serialize;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use tetralod_build::Construction;
use tetralod_build::parts::{MOST_PARTS, PartsError, Plan};

/// Parts a mesh in space, so that each part is built on its own (`tetralod build --part`) and all are joined to one MT file (`tetralod
/// join`): for meshes that one machine cannot hold, and for clusters.
#[derive(clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    options: BuildOptions,
    /// How many parts: a power of two, at most 4096.
    #[arg(long, value_name = "N")]
    parts: u32,
    /// The folder to write the parts into; it is made if need be.
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// Do not part the mesh now: have `tetralod work` do it as soon as all pieces of the list (.pvtu) are there, which a simulation
    /// may still be writing.
    #[arg(long)]
    later: bool,
    #[command(flatten)]
    verbosity: Verbosity,
}

/// The summary as programs get it.
#[derive(Serialize)]
struct Report {
    folder: String,
    #[serde(flatten)]
    plan: PlanFile,
}

/// What is asked of workers, as programs get it.
#[derive(Serialize)]
struct Later {
    folder: String,
    #[serde(flatten)]
    pieces: Awaited,
}

/// `words` are the arguments as they were given.
pub fn run(arguments: &Arguments, words: &[OsString]) -> Result<()> {
    if arguments.later {
        ask(arguments, words)
    } else {
        part(arguments, &|| tasks::forget(&arguments.output))
    }
}

/// Writes down for workers what is to be parted later.
fn ask(arguments: &Arguments, words: &[OsString]) -> Result<()> {
    let Arguments { options, parts, output, verbosity, .. } = arguments;
    let list = match &options.inputs[..] {
        [list] if files::ending(list) == "pvtu" => list,
        _ => refuse_usage("--later goes with one list of pieces, a .pvtu"),
    };
    // What is wrong without the mesh is said at once.
    let config = options.config();
    options.restrictions.points()?;
    ensure!(matches!(config.construction, Construction::HalfEdge { .. }), PartsError::Kind);
    ensure!(parts.is_power_of_two() && *parts <= MOST_PARTS, PartsError::Count { parts: *parts });
    let request = Request::new(list, words, VERSION)?;
    let pieces = request.pieces()?;
    let failed = || format!("{} could not be written", output.display());
    fs::create_dir_all(output).with_context(failed)?;
    tasks::forget(output)?;
    let plan = output.join(PLAN);
    if plan.exists() {
        fs::remove_file(&plan).with_context(failed)?;
    }
    request.write(output)?;
    let report = Later { folder: output.display().to_string(), pieces };
    verbosity.print(&report, &[("folder", report.folder.clone()), ("pieces", report.pieces.words())])
}

/// Parts in this process what was asked for in a folder.
pub fn part_now(folder: &Path) -> Result<()> {
    let request =
        Request::of(folder)?.with_context(|| format!("{}: nothing is to be parted", folder.display()))?;
    let folder = std::path::absolute(folder)?;
    let words = std::iter::once("part").chain(request.arguments.iter().map(String::as_str));
    let matches = Arguments::augment_args(clap::Command::new("part")).try_get_matches_from(words)?;
    let mut arguments = Arguments::from_arg_matches(&matches)?;
    // As others may see the folder in another place.
    arguments.output = folder;
    arguments.verbosity = Verbosity::default();
    let there = || format!("{}, where `tetralod part --later` was given", request.directory.display());
    std::env::set_current_dir(&request.directory).with_context(there)?;
    // The notes are of the workers that wait for it.
    part(&arguments, &|| Ok(()))
}

/// Parts a mesh; `forget` removes what was made of the plan before.
fn part(arguments: &Arguments, forget: &dyn Fn() -> Result<()>) -> Result<()> {
    let Arguments { options, parts, output, verbosity, .. } = arguments;
    let mut config = options.config();
    config.keep_points = options.restrictions.points()?;
    let metadata = options.metadata(&config);
    let fill = |part: &dyn Fn(&Path) -> Result<Plan>| {
        files::fill_folder(output, Path::new(PLAN), |folder| {
            let plan = part(folder)?;
            forget()?;
            Ok(plan)
        })
    };
    let by_pieces = options.in_pieces(&config, None, verbosity, |input| {
        let part = |folder: &Path| {
            Folder(folder).part_pieces(&input, &config, *parts, metadata.clone())?.map_err(Into::into)
        };
        match fill(&part) {
            Ok(plan) => Ok(Some(plan)),
            Err(error) => match error.downcast::<PartsError>()? {
                why @ PartsError::NeedsWhole { .. } => {
                    options.tell(&why, verbosity);
                    Ok(None)
                }
                error => Err(error.into()),
            },
        }
    });
    let plan = if let Some(plan) = by_pieces.with_context(|| options.name())? {
        plan
    } else {
        let (mesh, repaired) = options.read(&config, options.repair.level(), None)?;
        options.repair_of(&mesh, &repaired, Way::parts(*parts), verbosity)?;
        let part = |folder: &Path| Folder(folder).part(&mesh, &config, *parts, metadata.clone());
        fill(&part).with_context(|| options.name())?
    };
    let report = Report { folder: output.display().to_string(), plan: PlanFile::of(&plan) };
    let levels: Vec<String> = report.plan.levels.iter().map(u32::to_string).collect();
    verbosity.print(
        &report,
        &[
            ("folder", report.folder.clone()),
            ("tetrahedra", output::count(report.plan.tetrahedra)),
            ("parts", levels.join(", then ")),
        ],
    )
}

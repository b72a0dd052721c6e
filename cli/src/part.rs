//! `tetralod part`: a mesh to parts that are built each on its own.

use super::build::options::BuildOptions;
use super::build::way::Way;
use super::files;
use super::output::{self, Verbosity};
use super::parts::{Folder, PLAN, PlanFile};
use super::work::tasks;
use anyhow::{Context, Result};
use serde::Serialize;
use std::path::{Path, PathBuf};
use tetralod_build::parts::{PartsError, Plan};

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

pub fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { options, parts, output, verbosity } = arguments;
    let mut config = options.config();
    config.keep_points = options.restrictions.points()?;
    let metadata = options.metadata(&config);
    let fill = |part: &dyn Fn(&Path) -> Result<Plan>| {
        files::fill_folder(output, Path::new(PLAN), |folder| {
            let plan = part(folder)?;
            tasks::forget(output)?;
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
        let (mesh, repaired) = options.read(&config, options.repair.level(), None, true)?;
        options.repair_of(&mesh, &repaired, Way::Parts(*parts), verbosity)?;
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

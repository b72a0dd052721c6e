//! `tetralod build`: a mesh to an MT file.

pub mod options;
mod reading;
pub mod report;
pub mod way;

use self::options::BuildOptions;
use self::report::{Report, rows};
use self::way::{Asked, Way, kept_fields, way};
use super::output::Verbosity;
use super::parts::{Output, Written};
use super::progress::with_progress;
use super::remedies::failed;
use super::restrictions::Angles;
use super::shards::Sharding;
use super::{extremes, files, input, machine, parse, parts};
use anyhow::{Context, Result, anyhow};
use std::path::{Path, PathBuf};
use std::time::Instant;
use tetralod::mesh::TetMesh;
use tetralod::mt::MultiTessellation;
use tetralod_build::{BuildConfig, BuildCriterion, BuildResult};
use tetralod_io::PieceCounts;

/// Turns a tetrahedral mesh or a regular grid into an MT file.
#[derive(clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    options: BuildOptions,
    /// The MT file to write.
    #[arg(short, long, value_name = "FILE", required_unless_present = "part")]
    output: Option<PathBuf>,
    /// Build one part of N of what `tetralod part` has parted; INPUT is its folder then. The first part is 0.
    #[arg(long, value_name = "I/N", conflicts_with_all = ["output", "memory"], value_parser = parts::of_all)]
    part: Option<[u32; 2]>,
    /// Threads to build with, all cores if not given. The file does not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Build in so many parts, a power of two, as many at a time as there are threads: on several cores this is faster, and takes less
    /// memory, than one part. The file depends on it; it is a little larger.
    #[arg(long, value_name = "N", conflicts_with = "part")]
    parts: Option<u32>,
    /// The most memory that reading and building may take, as 8G: what needs more, by its counts, is built in parts (kind half-edge), in a
    /// folder beside the output that is removed afterwards; what needs more than that is refused, as soon as its size is known. K, M and G
    /// are powers of 1024. If nothing is said: the memory of the machine, of which half is for reading; nothing is parted.
    #[arg(long, value_name = "BYTES", value_parser = parse::parse_bytes)]
    memory: Option<u64>,
    #[command(flatten)]
    sharding: Sharding,
    #[command(flatten)]
    verbosity: Verbosity,
}

impl Arguments {
    fn asked(&self) -> Asked<'_> {
        let &Self { ref options, parts, memory, ref verbosity, .. } = self;
        Asked { options, parts, memory, verbosity }
    }
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let start = Instant::now();
    let Arguments { options, verbosity, .. } = arguments;
    machine::set_threads(arguments.threads)?;
    if let Some([index, all]) = arguments.part {
        return parts::build_part(&options.inputs, [index, all], verbosity);
    }
    let Some(output) = &arguments.output else { return Err(anyhow!("-o FILE is missing")) };
    let mut config = options.config();
    config.keep_points = options.restrictions.points()?;
    files::check_ending(output, "mt")?;
    files::check_output(output, &options.inputs)?;
    let level = options.repair.level();
    if let Some(built) = build_pieces(arguments, &config, output)? {
        return finish(arguments, &config, (built, start), Report::default());
    }
    let (mut mesh, mut repaired) = options.read(&config, level, arguments.memory)?;
    // Inputs may name others.
    files::check_output(output, &[])?;
    let [points, tetrahedra] = mesh.counts();
    let way = way(&arguments.asked(), &config, [points, tetrahedra, kept_fields(&config, &mesh)], None)?;
    if way == Way::Whole && mesh.is_grid_alone() {
        input::expand(&mut mesh, &options.inputs[0])?;
        (mesh, repaired) = input::mend(mesh, level, &options.inputs[0])?;
    }
    let repair = options.repair_of(&mesh, &repaired, way, verbosity)?;
    let notes = mesh.notes.clone();
    let mut angles = config.min_dihedral.map(|_| Angles::of_reference(&mesh));
    let metadata = options.metadata(&config);
    let to = Output { path: output, sharding: arguments.sharding, metadata: &metadata };
    let written = match way {
        Way::Whole => {
            let BuildResult { mt, summary, exact, .. } = build(arguments, &config, mesh)?;
            let write = |path: &Path| files::write_mt(path, &mt, exact, metadata.clone());
            let bytes = to.sharding.write(to.path, write)?;
            Written { mt, summary, bytes }
        }
        Way::Parts { parts: count, joins } => {
            let whole = parts::Whole::Mesh(Box::new(mesh));
            let built = parts::build(whole, &config, [count, joins], &to, verbosity);
            built.with_context(|| options.name())??
        }
    };
    angles.iter_mut().for_each(|angles| angles.add_base(&written.mt));
    let known = Report { repaired: repaired.to_string(), repair, angles, notes, ..Report::default() };
    finish(arguments, &config, (written, start), known)
}

/// Says what there is; `known` has what is known of the repair and the angles.
fn finish(
    arguments: &Arguments,
    config: &BuildConfig,
    (written, start): (Written, Instant),
    known: Report,
) -> Result<()> {
    let Arguments { verbosity, output, .. } = arguments;
    let Some(output) = output else { return Err(anyhow!("-o FILE is missing")) };
    let Written { mt, summary, bytes: file_bytes } = written;
    let report = Report {
        kind: config.construction.kind().name(),
        method: config.construction.method().name(),
        criterion: config.construction.criterion().map(BuildCriterion::name),
        counts: summary,
        regions: (!config.preserve.is_empty()).then(|| mt.regions().map_or(0, |regions| regions.all.len())),
        interface_deviation: (config.preserve_within > 0.0).then_some(summary.interface_deviation),
        file_bytes,
        shards: arguments.sharding.count(file_bytes),
        bytes_per_vertex: file_bytes as f64 / f64::from(summary.vertices.max(1)),
        seconds: start.elapsed().as_secs_f64(),
        averaged: mt.info().averaged_fields(),
        size: extremes::size(mt.info()),
        inputs: files::read_inputs(),
        ..known
    };
    verbosity.print(&report, &rows(output, &report))
}

/// Builds a mesh in several files in parts, without reading it as a whole; none if it is another one, or is not to be built in parts.
fn build_pieces(arguments: &Arguments, config: &BuildConfig, output: &Path) -> Result<Option<Written>> {
    let Arguments { options, verbosity, .. } = arguments;
    let is_whole = arguments.parts == Some(1) || arguments.parts.is_none() && arguments.memory.is_none();
    // Angles are told of the whole.
    if is_whole || config.min_dihedral.is_some() {
        return Ok(None);
    }
    options.in_pieces(config, arguments.memory, verbosity, |input| {
        let way = match arguments.parts {
            Some(count) => Way::parts(count),
            None => {
                let PieceCounts { points, tetrahedra, largest, fields, meeting, .. } =
                    input.pieces.counts()?;
                let fields = if config.all_fields { fields } else { (config.fields.len() as u64).max(1) };
                way(&arguments.asked(), config, [points, tetrahedra, fields], Some([meeting, largest]))?
            }
        };
        let Way::Parts { parts: count, joins } = way else { return Ok(None) };
        let metadata = options.metadata(config);
        let to = Output { path: output, sharding: arguments.sharding, metadata: &metadata };
        let built = parts::build(parts::Whole::Pieces(input), config, [count, joins], &to, verbosity);
        match built.with_context(|| options.name())? {
            Ok(built) => Ok(Some(built)),
            Err(why) => {
                options.tell(&why, verbosity);
                Ok(None)
            }
        }
    })
}

fn build(arguments: &Arguments, config: &BuildConfig, mesh: TetMesh) -> Result<BuildResult> {
    let result =
        with_progress(&arguments.verbosity, |progress| tetralod_build::build_with(mesh, config, progress))?;
    result.map_err(failed).with_context(|| arguments.options.name())
}

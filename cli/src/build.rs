//! `tetralod build`: a mesh to an MT file.

use super::files;
use super::input;
use super::output::{self, Verbosity, bytes, count};
use super::parse;
use super::repair::{Repair, RepairOptions};
use anyhow::{Context, Result, anyhow};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Instant;
use tetralod::builder::{
    BuildConfig, BuildCriterion, BuildError, BuildProgress, BuildResult, BuildSummary, Construction,
    ConstructionChoice, FieldPrecision, Method, Purpose, Remedy, memory_needed,
};
use tetralod::format::{EncodeOptions, encode_to};
use tetralod::io::{CellData, FieldSelection};
use tetralod::mesh::{Field, RepairLevel, RepairReport, TetMesh};
use tetralod::mt::MtKind;

/// Turns a tetrahedral mesh or a regular grid into an MT file.
#[derive(clap::Args)]
pub struct Arguments {
    /// Mesh or grid: .vtu, .vti, .vts, .vtr, the lists .pvtu, .pvti, .pvts and .pvtr, .vtk, .vtkhdf, Exodus .exo, .ex2 or .e, Gmsh .msh,
    /// Medit .mesh or .meshb, TetGen .node or .ele, Netgen .vol, .nrrd, .mha or .mhd, or .raw with a .json beside it; - is the
    /// standard input. Points without cells go with --method insert. Several, a .pvd, and what a file has of them are time steps over
    /// one mesh.
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// The format of the standard input, which is refused if its content is another one: vtu, vti, vts, vtr, vtk, vtkhdf,
    /// exodus, gmsh, medit, netgen, nrrd or metaimage [default: what its content says].
    #[arg(long, value_name = "FORMAT")]
    format: Option<String>,
    /// Build one of the time steps alone; the first one is 0.
    #[arg(long, value_name = "N")]
    step: Option<usize>,
    /// The MT file to write.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// The kind of MT: half-edge (the best for regions), edge, vertex or explicit [default: what goes with the other options, else half-edge].
    #[arg(long, value_name = "KIND", value_parser = kind)]
    kind: Option<MtKind>,
    /// How it is built: collapse (edges, for kind edge), insert or decimate (vertices, for kind vertex); any for kind
    /// explicit [default: collapse, decimate for kinds vertex and half-edge].
    #[arg(long, value_name = "METHOD", value_parser = method)]
    method: Option<Method>,
    /// By what criterion vertices go or come: delaunay, or half-edge with decimate alone [default: half-edge with
    /// decimate].
    #[arg(long, value_name = "CRITERION", value_parser = criterion)]
    criterion: Option<BuildCriterion>,
    /// What it is for, with decimate: uniform, the fewest tetrahedra at one error everywhere, or regions, which then take
    /// less around them with them [default: uniform].
    #[arg(long = "for", value_name = "PURPOSE", value_parser = purpose)]
    purpose: Option<Purpose>,
    /// Keep for each tetrahedron how far its own error is below that of the update that removes it: requests take fewer
    /// tetrahedra, but every one is answered from the base mesh. With --method insert only.
    #[arg(long)]
    tet_errors: bool,
    /// A field to keep (repeatable, in this order), or a vector with all its components; the first field if not given. Where the
    /// input has none of these names: distance (from the middle of the bounding box), x, y, z, or none, for the shape alone.
    #[arg(long = "field", value_name = "NAME")]
    fields: Vec<String>,
    /// Keep all fields but the lengths of vectors.
    #[arg(long)]
    all_fields: bool,
    /// Turn fields at cells into fields at points: the mean of the cells around, weighted by volume.
    #[arg(long)]
    cell_to_point: bool,
    #[command(flatten)]
    repair: RepairOptions,
    /// The unit of a field or vector (repeatable).
    #[arg(long = "unit", value_name = "NAME=UNIT", value_parser = last_pair)]
    units: Vec<(String, String)>,
    /// An entry for the file's metadata (repeatable).
    #[arg(long = "meta", value_name = "KEY=VALUE", value_parser = first_pair)]
    metadata: Vec<(String, String)>,
    /// Bits of the position lattice, 1 to 30; as few as the thinnest cells allow, at least 16, if not given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=30))]
    position_bits: Option<u32>,
    /// How far positions may be rounded, in the units of the model: as few bits as keep within it.
    #[arg(long, value_name = "X", conflicts_with = "position_bits")]
    position_tolerance: Option<f64>,
    /// Bits of the field lattices, of all fields or (repeatable) of one, 1 to 24 [default: 16; integers are exact].
    #[arg(long, value_name = "[NAME=]N", value_parser = bits)]
    field_bits: Vec<Precision>,
    /// How far the values of all fields or (repeatable) of one may be rounded, in its units or in % of its range: as few
    /// bits as keep within it.
    #[arg(long, value_name = "[NAME=]X[%]", value_parser = tolerance)]
    field_tolerance: Vec<Precision>,
    /// Keep the exact values of all fields or (repeatable) of one.
    #[arg(long, value_name = "NAME", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    lossless: Vec<String>,
    /// The displacement of the boundary that counts as an error of 100 %, in % of the domain's diagonal [default: 20%].
    #[arg(long, value_name = "X%", value_parser = share)]
    displacement: Option<f64>,
    /// The same in lengths of the shortest edge of the input at each place, where that is less; inf where cells do not matter
    /// [default: 10].
    #[arg(long, value_name = "N", value_parser = lengths)]
    displacement_edges: Option<f64>,
    /// Updates in a block, the least that can be fetched of the file by itself: a power of two, 16 to 65536 [default: 2048, 256 for kind
    /// half-edge].
    #[arg(long, value_name = "N", value_parser = block_bits)]
    block_updates: Option<u32>,
    /// Threads to build with, all cores if not given. The file does not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// The most memory that building may take, as 8G: what needs more, by its counts, is refused before the work begins. K, M and G
    /// are powers of 1024.
    #[arg(long, value_name = "BYTES", value_parser = parse::parse_bytes)]
    memory: Option<u64>,
    #[command(flatten)]
    verbosity: Verbosity,
}

/// Parses the name of a kind of MT.
pub fn kind(text: &str) -> Result<MtKind> {
    named(text, &MtKind::ALL.map(|kind| (kind.name(), kind)))
}

/// How finely the values of a field are kept, or of all without a name.
#[derive(Clone, Debug)]
struct Precision {
    name: Option<String>,
    precision: FieldPrecision,
}

fn bits(text: &str) -> Result<Precision> {
    let (name, number) = named_number(text);
    let bits = number.parse().ok().filter(|bits| (1..=24).contains(bits));
    let bits = bits.context("it must be 1 to 24, or NAME= and that")?;
    Ok(Precision { name, precision: FieldPrecision::Bits(bits) })
}

fn tolerance(text: &str) -> Result<Precision> {
    let (name, number) = named_number(text);
    let (number, unit): (&str, fn(f64) -> FieldPrecision) = match number.strip_suffix('%') {
        Some(percent) => (percent, |x| FieldPrecision::Fraction(x / 100.0)),
        None => (number, FieldPrecision::Units),
    };
    let number = number.trim().parse().ok().filter(|x: &f64| *x >= 0.0 && x.is_finite());
    let number = number.context("it must be a number, or a percentage as 1%, or NAME= and that")?;
    Ok(Precision { name, precision: unit(number) })
}

/// A part of the diagonal.
fn share(text: &str) -> Result<f64> {
    let percent = text.trim().strip_suffix('%').and_then(|number| number.trim().parse().ok());
    let percent = percent.filter(|x: &f64| *x >= 0.0 && x.is_finite());
    Ok(percent.context("it must be a percentage of the diagonal, as 20%")? / 100.0)
}

/// How many edges.
fn lengths(text: &str) -> Result<f64> {
    text.trim().parse().ok().filter(|x: &f64| *x >= 0.0).context("it must be a number of at least 0, or inf")
}

/// log2 of the updates of a block.
fn block_bits(text: &str) -> Result<u32> {
    let updates: Option<u32> = text.trim().parse().ok();
    let updates = updates.filter(|n| n.is_power_of_two() && (16..=1 << 16).contains(n));
    Ok(updates.context("it must be a power of two from 16 to 65536")?.ilog2())
}

/// The name in front of the last `=`, if there is one, and what comes behind it.
fn named_number(text: &str) -> (Option<String>, &str) {
    text.rsplit_once('=').map_or((None, text), |(name, number)| (Some(name.to_owned()), number))
}

/// Names may hold `=`, units do not.
fn last_pair(text: &str) -> Result<(String, String)> {
    let (name, unit) = text.rsplit_once('=').context("it must be NAME=UNIT")?;
    Ok((name.to_owned(), unit.to_owned()))
}

/// Keys do not hold `=`, values may.
fn first_pair(text: &str) -> Result<(String, String)> {
    let (key, value) = text.split_once('=').context("it must be KEY=VALUE")?;
    let [method, criterion] = Construction::METADATA_KEYS;
    let repair = RepairLevel::METADATA_KEY;
    if key.is_empty() || [method, criterion, repair].contains(&key) {
        anyhow::bail!("a key must not be empty, '{method}', '{criterion}' or '{repair}'");
    }
    Ok((key.to_owned(), value.to_owned()))
}

fn method(text: &str) -> Result<Method> {
    named(text, &Method::ALL.map(|method| (method.name(), method)))
}

fn criterion(text: &str) -> Result<BuildCriterion> {
    named(text, &BuildCriterion::ALL.map(|criterion| (criterion.name(), criterion)))
}

fn purpose(text: &str) -> Result<Purpose> {
    named(text, &Purpose::ALL.map(|purpose| (purpose.name(), purpose)))
}

/// What has this name.
pub fn named<T: Copy>(text: &str, all: &[(&str, T)]) -> Result<T> {
    let found = all.iter().find(|(name, _)| *name == text).map(|&(_, value)| value);
    let names: Vec<&str> = all.iter().map(|(name, _)| *name).collect();
    found.with_context(|| format!("it must be one of: {}", names.join(", ")))
}

/// The summary as programs get it.
#[derive(Serialize)]
struct Report {
    kind: &'static str,
    method: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    criterion: Option<&'static str>,
    vertices: u32,
    tetrahedra: u32,
    base_vertices: u32,
    base_tetrahedra: u32,
    updates: u32,
    depth: u32,
    position_bits: u32,
    file_bytes: u64,
    bytes_per_vertex: f64,
    seconds: f64,
    /// What was done in words; the same and more is in `repair`.
    repaired: String,
    /// Of points without cells nothing is repaired.
    repair: Option<Repair>,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let start = Instant::now();
    let config = config(arguments);
    if let Some(threads) = arguments.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into());
        pool.build_global().context("starting the threads")?;
    }
    files::check_ending(&arguments.output, "mt")?;
    files::check_output(&arguments.output, &arguments.inputs)?;
    let level = arguments.repair.level();
    let (mesh, repaired) = read(arguments, &config, level)?;
    let repair = Repair::of(&mesh, level, &repaired)?;
    let repaired = repaired.to_string();
    for line in [Some(&repaired), repair.as_ref().map(|repair| &repair.kept)].into_iter().flatten() {
        if !line.is_empty() && !arguments.verbosity.quiet {
            eprintln!("{}: {line}", arguments.inputs[0].display());
        }
    }
    expect_memory(arguments, &config, &mesh)?;
    let BuildResult { mt, summary, exact, .. } = build(arguments, &config, mesh)?;
    let built = config.construction.metadata().into_iter().chain(level.metadata());
    let metadata = built.chain(arguments.metadata.iter().cloned()).collect();
    let options = EncodeOptions {
        block_bits: config.block_bits,
        check_margins: true,
        exact,
        histograms: true,
        metadata,
    };
    let file_bytes = files::write_file(&arguments.output, |out| Ok(encode_to(&mt, &options, out)?))?;
    let seconds = start.elapsed().as_secs_f64();
    let report = Report { repair, ..report(&config, &summary, file_bytes, seconds, repaired) };
    arguments.verbosity.print(&report, &rows(arguments, &report))
}

/// Reads what is wanted of the input.
fn read(arguments: &Arguments, config: &BuildConfig, level: RepairLevel) -> Result<(TetMesh, RepairReport)> {
    let cells = if arguments.cell_to_point { CellData::Values } else { CellData::Names };
    let wanted = FieldSelection { names: &config.fields, all: config.all_fields, cells };
    input::expect_format(&arguments.inputs, arguments.format.as_deref());
    let format = arguments.format.as_deref();
    let (mut mesh, repaired) = input::read_as(&arguments.inputs, &wanted, level, (format, arguments.step))?;
    if config.construction.method().keeps_the_mesh() {
        input::expect_cells(&mesh, &arguments.inputs[0])?;
    }
    for (name, unit) in &arguments.units {
        let is_meant = |field: &&mut Field| {
            field.name == *name || field.vector.as_ref().is_some_and(|vector| vector.name == *name)
        };
        let mut found = 0;
        mesh.fields.iter_mut().filter(is_meant).for_each(|field| {
            field.unit.clone_from(unit);
            found += 1;
        });
        if found == 0 {
            anyhow::bail!("--unit {name}={unit}: there is no field '{name}'");
        }
    }
    Ok((mesh, repaired))
}

/// From so much memory on, the command says what it needs.
const MUCH_MEMORY: u64 = 1 << 30;

/// Says how much memory building takes where that is much, and refuses what needs more than is allowed.
fn expect_memory(arguments: &Arguments, config: &BuildConfig, mesh: &TetMesh) -> Result<()> {
    let (points, tetrahedra) = (mesh.positions.len() as u64, mesh.tets.len() as u64);
    let is_kept = |field: &&Field| config.fields.iter().any(|name| field.answers_to(name));
    let fields = match config.all_fields {
        true => mesh.fields.len(),
        false => mesh.fields.iter().filter(is_kept).count(),
    };
    let needed = memory_needed(config.construction, points, tetrahedra, fields.max(1) as u64);
    let what = format!("building {} tetrahedra takes about {}", count(tetrahedra), bytes(needed));
    match arguments.memory {
        Some(most) if needed > most => Err(anyhow!(
            "{what} of memory, more than --memory allows ({}): allow more, keep fewer fields, or build a coarser mesh",
            bytes(most)
        ))
        .with_context(|| arguments.inputs[0].display().to_string()),
        _ => {
            if needed >= MUCH_MEMORY && !arguments.verbosity.quiet {
                eprintln!("{}: {what} of memory at most", arguments.inputs[0].display());
            }
            Ok(())
        }
    }
}

/// How to build. Ends the program if the options contradict each other.
fn config(arguments: &Arguments) -> BuildConfig {
    let &Arguments { kind, method, criterion, purpose, tet_errors, .. } = arguments;
    let choice = ConstructionChoice { kind, method, criterion, purpose, tet_errors };
    let default = BuildConfig::of(choice.kind());
    let precision: Vec<&Precision> = arguments.field_bits.iter().chain(&arguments.field_tolerance).collect();
    let for_all: Vec<FieldPrecision> =
        precision.iter().filter(|p| p.name.is_none()).map(|p| p.precision).collect();
    if for_all.len() > 1 {
        super::refuse_usage(
            "--field-bits and --field-tolerance without a name are for all fields: give one of them",
        );
    }
    let of_one = |p: &&Precision| p.name.clone().map(|name| (name, p.precision));
    BuildConfig {
        construction: construction(&choice).unwrap_or_else(|wrong| super::refuse_usage(&wrong)),
        fields: arguments.fields.clone(),
        all_fields: arguments.all_fields,
        position_bits: arguments.position_bits,
        position_tolerance: arguments.position_tolerance,
        field_precision: for_all.first().copied().unwrap_or(default.field_precision),
        precision_of: precision.iter().filter_map(of_one).collect(),
        lossless: arguments.lossless.iter().filter(|name| !name.is_empty()).cloned().collect(),
        all_lossless: arguments.lossless.iter().any(String::is_empty),
        displacement: arguments.displacement.unwrap_or(default.displacement),
        displacement_edges: arguments.displacement_edges.unwrap_or(default.displacement_edges),
        block_bits: arguments.block_updates.unwrap_or(default.block_bits),
    }
}

/// How an MT is built, or why the options contradict each other, by the names of the options where that says more.
fn construction(choice: &ConstructionChoice) -> Result<Construction, String> {
    let refused = |error: BuildError| error.to_string();
    let by_collapse = choice.method() == Method::Collapse;
    let criterion = choice.criterion.filter(|_| !by_collapse);
    let (kind, method) = (Some(choice.kind()), Some(choice.method()));
    let choice_without = ConstructionChoice { kind, method, criterion, purpose: None, ..*choice };
    choice_without.construction().map_err(refused)?;
    if by_collapse && choice.criterion.is_some() {
        return Err("--criterion goes with --method insert or decimate, not with collapse".to_owned());
    }
    choice.construction().map_err(|_| "--for goes with --method decimate".to_owned())
}

fn build(arguments: &Arguments, config: &BuildConfig, mesh: TetMesh) -> Result<BuildResult> {
    // Drawn on stderr, and only on a terminal.
    let bar = if arguments.verbosity.quiet { ProgressBar::hidden() } else { ProgressBar::new(0) };
    let style = "{msg:<12} {wide_bar} {percent:>3} %  {pos}/{len}  {elapsed_precise}  about {eta} left";
    bar.set_style(ProgressStyle::with_template(style).context("the style of the progress bar")?);
    let mut stage = "";
    let result = tetralod::builder::build_owned(mesh, config, &mut |progress: BuildProgress| {
        bar.set_length(progress.total.max(1));
        if progress.stage != stage {
            stage = progress.stage;
            // Every stage has its own speed.
            bar.reset();
            bar.set_message(stage);
        }
        bar.set_position(progress.done);
        ControlFlow::Continue(())
    });
    bar.finish_and_clear();
    let failed = |error: BuildError| match error.remedy().and_then(options_of) {
        Some(option) => anyhow!("{error} ({option})"),
        None => error.into(),
    };
    result.map_err(failed).with_context(|| arguments.inputs[0].display().to_string())
}

/// The options that do what a remedy says. `Remedy` may grow.
fn options_of(remedy: Remedy) -> Option<&'static str> {
    Some(match remedy {
        Remedy::Insert => "--method insert",
        Remedy::Decimate => "--method decimate",
        Remedy::Field => "--field",
        Remedy::CellsToPoints => "--cell-to-point",
        Remedy::FieldTolerance => "--field-tolerance, --lossless",
        Remedy::PositionTolerance => "--position-tolerance",
        Remedy::PositionBits => "--position-bits",
        _ => return None,
    })
}

fn report(
    config: &BuildConfig,
    summary: &BuildSummary,
    file_bytes: u64,
    seconds: f64,
    repaired: String,
) -> Report {
    Report {
        kind: config.construction.kind().name(),
        method: config.construction.method().name(),
        criterion: config.construction.criterion().map(BuildCriterion::name),
        vertices: summary.vertices,
        tetrahedra: summary.tetrahedra,
        base_vertices: summary.base_vertices,
        base_tetrahedra: summary.base_tetrahedra,
        updates: summary.updates,
        depth: summary.depth,
        position_bits: summary.position_bits,
        file_bytes,
        bytes_per_vertex: file_bytes as f64 / f64::from(summary.vertices.max(1)),
        seconds,
        repaired,
        repair: None,
    }
}

fn rows(arguments: &Arguments, report: &Report) -> Vec<(&'static str, String)> {
    let removed = f64::from(report.tetrahedra.saturating_sub(report.base_tetrahedra));
    vec![
        ("file", arguments.output.display().to_string()),
        ("reference mesh", output::mesh(report.vertices, report.tetrahedra)),
        ("base mesh", output::mesh(report.base_vertices, report.base_tetrahedra)),
        (
            "updates",
            format!("{}, at most {} deep", output::count(report.updates), output::count(report.depth)),
        ),
        ("position bits", report.position_bits.to_string()),
        ("file size", output::bytes(report.file_bytes)),
        ("bytes per vertex", format!("{:.2}", report.bytes_per_vertex)),
        (
            "time",
            format!(
                "{:.2} s ({:.0} tetrahedra removed per second)",
                report.seconds,
                removed / report.seconds
            ),
        ),
    ]
}

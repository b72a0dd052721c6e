//! `tetralod build`: a mesh to an MT file.

use super::files;
use super::input;
use super::machine;
use super::output::{self, Verbosity, bytes, count};
use super::parse;
use super::parts::{self, InPieces};
use super::repair::{Repair, RepairOptions};
use super::restrictions::{Angles, RestrictionOptions};
use anyhow::{Context, Result, anyhow};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;
use tetralod::format::{EncodeOptions, encode_to};
use tetralod::mesh::{Field, GeometryField, RepairLevel, RepairReport, TetMesh};
use tetralod::mt::MtKind;
use tetralod_build::parts::PartsError;
use tetralod_build::{
    BuildConfig, BuildCriterion, BuildError, BuildProgress, BuildResult, BuildSummary, Construction,
    ConstructionChoice, FieldPrecision, Method, OnProgress, Purpose, Remedy, memory_needed,
};
use tetralod_io::{CellData, FieldSelection, PieceCounts, Pieces, ReadOptions};

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
    verbosity: Verbosity,
}

/// What is built, and how: the same for a whole and for parts.
#[derive(clap::Args)]
pub struct BuildOptions {
    /// Mesh or grid: .vtu, .vti, .vts, .vtr, the lists .pvtu, .pvti, .pvts and .pvtr, .vtk, .vtkhdf, Exodus .exo, .ex2 or .e, Gmsh .msh,
    /// Medit .mesh or .meshb, TetGen .node or .ele, Netgen .vol, .nrrd, .mha or .mhd, or .raw with a .json beside it; - is the
    /// standard input. Points without cells go with --method insert. Several, a .pvd, and what a file has of them are time steps over
    /// one mesh.
    #[arg(required = true, value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    /// The format of the standard input, which is refused if its content is another one: vtu, vti, vts, vtr, vtk, vtkhdf,
    /// exodus, gmsh, medit, netgen, nrrd or metaimage [default: what its content says].
    #[arg(long, value_name = "FORMAT")]
    format: Option<String>,
    /// Build one of the time steps alone; the first one is 0.
    #[arg(long, value_name = "N")]
    step: Option<usize>,
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
    /// What it is for, with decimate: uniform, the fewest tetrahedra at one error everywhere; or regions, which then take
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
    pub repair: RepairOptions,
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
    #[command(flatten)]
    pub restrictions: RestrictionOptions,
    /// Updates in a block, the least that can be fetched of the file by itself: a power of two, 16 to 65536 [default: 2048, 256 for kind
    /// half-edge].
    #[arg(long, value_name = "N", value_parser = block_bits)]
    block_updates: Option<u32>,
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
pub fn block_bits(text: &str) -> Result<u32> {
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
#[derive(Default, Serialize)]
struct Report {
    kind: &'static str,
    method: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    criterion: Option<&'static str>,
    #[serde(flatten)]
    counts: BuildSummary,
    /// How far interfaces between regions have moved, in model units, if they may.
    #[serde(skip_serializing_if = "Option::is_none")]
    interface_deviation: Option<f64>,
    file_bytes: u64,
    bytes_per_vertex: f64,
    seconds: f64,
    /// What was done in words; the same and more is in `repair`.
    repaired: String,
    /// Of points without cells nothing is repaired.
    repair: Option<Repair>,
    /// With a bound for them.
    #[serde(skip_serializing_if = "Option::is_none")]
    angles: Option<Angles>,
    /// What the reader left out of the input or changed, in words.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    notes: Vec<String>,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let start = Instant::now();
    let Arguments { options, verbosity, .. } = arguments;
    if let Some(threads) = arguments.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into());
        pool.build_global().context("starting the threads")?;
    }
    if let Some([index, all]) = arguments.part {
        return parts::build_part(&options.inputs, [index, all], verbosity);
    }
    let Some(output) = &arguments.output else { return Err(anyhow!("-o FILE is missing")) };
    let mut config = options.config();
    config.keep_points = options.restrictions.points()?;
    files::check_ending(output, "mt")?;
    files::check_output(output, &options.inputs)?;
    let level = options.repair.level();
    let may_part = arguments.parts.is_some() || arguments.memory.is_some();
    if let Some(built) = build_pieces(arguments, &config, output)? {
        return finish(arguments, &config, (built, start), repaired_as(String::new()));
    }
    let (mut mesh, mut repaired) = options.read(&config, level, arguments.memory, may_part)?;
    // Inputs may name others.
    files::check_output(output, &[])?;
    let [points, tetrahedra] = mesh.counts();
    let way = way(arguments, &config, [points, tetrahedra, kept_fields(&config, &mesh)], None)?;
    if way == Way::Whole && mesh.is_grid_alone() {
        mesh.expand_grid();
        (mesh, repaired) = input::mend(mesh, level, &options.inputs[0])?;
    }
    let repair = options.repair_of(&mesh, &repaired, way, verbosity)?;
    let notes = mesh.notes.clone();
    let mut angles = config.min_dihedral.map(|_| Angles::of_reference(&mesh));
    let result = match way {
        Way::Whole => build(arguments, &config, mesh)?,
        Way::Parts(count) => {
            let whole = parts::Whole::Mesh(Box::new(mesh));
            let side_by_side = rayon::current_num_threads().min(count as usize);
            let metadata = options.metadata(&config);
            let parting = parts::Parting { whole, config: &config, count, metadata, side_by_side };
            parting.build(output, verbosity).with_context(|| options.name())??
        }
    };
    angles.iter_mut().for_each(|angles| angles.add_base(&result.mt));
    finish(
        arguments,
        &config,
        (result, start),
        Report { repair, angles, notes, ..repaired_as(repaired.to_string()) },
    )
}

/// A report of nothing but what was repaired.
fn repaired_as(repaired: String) -> Report {
    Report { repaired, ..Report::default() }
}

/// Writes the MT, and says what there is; `known` has what is known of the repair and the angles.
fn finish(
    arguments: &Arguments,
    config: &BuildConfig,
    (result, start): (BuildResult, Instant),
    known: Report,
) -> Result<()> {
    let Arguments { options, verbosity, output, .. } = arguments;
    let Some(output) = output else { return Err(anyhow!("-o FILE is missing")) };
    let BuildResult { mt, summary, exact, .. } = result;
    let metadata = options.metadata(config);
    let options = EncodeOptions { check_margins: true, exact, histograms: true, metadata };
    let file_bytes = files::write_file(output, |out| Ok(encode_to(&mt, &options, out)?))?;
    let seconds = start.elapsed().as_secs_f64();
    let Report { repaired, repair, angles, notes, .. } = known;
    let report = Report { repair, angles, notes, ..report(config, &summary, file_bytes, seconds, repaired) };
    verbosity.print(&report, &rows(output, &report))
}

/// Builds a mesh in several files in parts, without reading it as a whole; none if it is another one, or is not to be built in parts.
fn build_pieces(arguments: &Arguments, config: &BuildConfig, output: &Path) -> Result<Option<BuildResult>> {
    let Arguments { options, verbosity, .. } = arguments;
    let is_whole = arguments.parts == Some(1) || arguments.parts.is_none() && arguments.memory.is_none();
    // Angles are told of the whole.
    if is_whole || config.min_dihedral.is_some() {
        return Ok(None);
    }
    options.in_pieces(config, arguments.memory, |input| {
        let way = match arguments.parts {
            Some(count) => Way::Parts(count),
            None => {
                let PieceCounts { points, tetrahedra, pieces, largest, fields } = input.pieces.counts()?;
                let fields = if config.all_fields { fields } else { (config.fields.len() as u64).max(1) };
                way(arguments, config, [points, tetrahedra, fields], Some([pieces, largest]))?
            }
        };
        let Way::Parts(count) = way else { return Ok(None) };
        let side_by_side = rayon::current_num_threads().min(count as usize);
        let metadata = options.metadata(config);
        let whole = parts::Whole::Pieces(input);
        let parting = parts::Parting { whole, config, count, metadata, side_by_side };
        match parting.build(output, verbosity).with_context(|| options.name())? {
            Ok(built) => Ok(Some(built)),
            Err(why) => {
                options.tell(&why, verbosity);
                Ok(None)
            }
        }
    })
}

/// How a mesh is built.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Way {
    Whole,
    /// In so many parts.
    Parts(u32),
}

impl BuildOptions {
    /// The name of the input, for messages.
    pub fn name(&self) -> String {
        input::name(&self.inputs[0])
    }

    /// What the file is to say of itself.
    pub fn metadata(&self, config: &BuildConfig) -> BTreeMap<String, String> {
        let built = config.construction.metadata().into_iter().chain(self.repair.level().metadata());
        built.chain(self.metadata.iter().cloned()).collect()
    }

    /// Tells what was repaired, and what was found.
    pub fn repair_of(
        &self,
        mesh: &TetMesh,
        repaired: &RepairReport,
        way: Way,
        verbosity: &Verbosity,
    ) -> Result<Option<Repair>> {
        // To look through a grid takes more memory than its parts do, and nothing is wrong with it.
        let is_sound = way != Way::Whole && mesh.grid.is_some();
        let repair = if is_sound { None } else { Repair::of(mesh, self.repair.level(), repaired)? };
        let repaired = repaired.to_string();
        for line in [Some(&repaired), repair.as_ref().map(|repair| &repair.kept)].into_iter().flatten() {
            if !line.is_empty() && !verbosity.quiet {
                output::note(&format!("{}: {line}", self.name()));
            }
        }
        Ok(repair)
    }

    /// Reads what is wanted of the input, in so much memory at most.
    ///
    /// If it may be built in parts, a regular grid comes without points and tetrahedra where only its values are needed.
    pub fn read(
        &self,
        config: &BuildConfig,
        level: RepairLevel,
        memory: Option<u64>,
        in_parts: bool,
    ) -> Result<(TetMesh, RepairReport)> {
        let with_labels = !config.preserve.is_empty();
        let cells = if self.cell_to_point || with_labels { CellData::Values } else { CellData::Names };
        let wanted =
            FieldSelection { names: &config.fields, all: config.all_fields, labels: &config.preserve, cells };
        let needs_points = |name: &String| GeometryField::named(name).is_some();
        let alone = in_parts
            && cells == CellData::Names
            && config.min_dihedral.is_none()
            && !config.fields.iter().any(needs_points);
        input::expect_format(&self.inputs, self.format.as_deref());
        let source = input::Source { format: self.format.as_deref(), step: self.step, memory };
        let (mut mesh, repaired) = input::read_cells(&self.inputs, &wanted, level, source, alone)?;
        let is_label = |field: &&Field| config.preserve.contains(&field.name);
        let labels: Vec<Field> = mesh.cell_fields.iter().filter(is_label).cloned().collect();
        match self.cell_to_point {
            true => mesh.cells_to_points(),
            false => mesh.cell_fields.iter_mut().for_each(|field| field.values = Vec::new()),
        }
        mesh.cell_fields.extend(labels);
        mesh.add_geometry_fields(&config.fields);
        if config.construction.method().keeps_the_mesh() {
            input::expect_cells(&mesh, &self.inputs[0])?;
        }
        self.set_units(&mut mesh)?;
        Ok((mesh, repaired))
    }

    fn set_units(&self, mesh: &mut TetMesh) -> Result<()> {
        for (name, unit) in &self.units {
            let is_meant = |field: &&mut Field| {
                field.name == *name || field.vector.as_ref().is_some_and(|vector| vector.name == *name)
            };
            let mut found = 0;
            mesh.fields.iter_mut().filter(is_meant).for_each(|field| {
                field.unit.clone_from(unit);
                found += 1;
            });
            let is_other = |field: &Field| {
                field.name == *name || field.vector.as_ref().is_some_and(|vector| vector.name == *name)
            };
            if found == 0 && !mesh.input.other_fields.iter().any(is_other) {
                anyhow::bail!("--unit {name}={unit}: there is no field '{name}'");
            }
        }
        Ok(())
    }

    /// The pieces of the input, if it is a list of such that can be read one by one; `prepare` does what the options say to each.
    pub fn in_pieces<T>(
        &self,
        config: &BuildConfig,
        memory: Option<u64>,
        work: impl FnOnce(InPieces<'_>) -> Result<Option<T>>,
    ) -> Result<Option<T>> {
        let needs_points = |name: &String| GeometryField::named(name).is_some();
        let needs_whole = self.cell_to_point
            || matches!(self.repair.level(), RepairLevel::Weld { .. })
            || config.fields.iter().any(needs_points);
        let [path] = &self.inputs[..] else { return Ok(None) };
        if needs_whole || files::ending(path) != "pvtu" {
            return Ok(None);
        }
        let steps = tetralod_io::steps(path)?;
        let [step] = &steps[..] else { return Ok(None) };
        if self.step.is_some_and(|step| step != 0) {
            return Ok(None);
        }
        let wanted = FieldSelection {
            names: &config.fields,
            all: config.all_fields,
            labels: &config.preserve,
            cells: CellData::Names,
        };
        let memory = input::Source { memory, ..input::Source::default() }.limit();
        let options = ReadOptions { step: step.number, memory, ..wanted.options() };
        let Some(pieces) = Pieces::open(&step.path, &options)? else { return Ok(None) };
        let prepare = |mesh: &mut TetMesh| {
            files::note_inputs(&mesh.input.files.0);
            if step.time.is_some() {
                mesh.fields.iter_mut().for_each(|field| field.time = step.time);
            }
            self.set_units(mesh)
        };
        work(InPieces { pieces, prepare: &prepare })
    }

    /// Tells why pieces are read as a whole after all.
    pub fn tell(&self, why: &PartsError, verbosity: &Verbosity) {
        if !verbosity.quiet {
            output::note(&format!("{}: {why}; so it is", self.name()));
        }
    }
}

/// How many fields of a mesh are kept.
fn kept_fields(config: &BuildConfig, mesh: &TetMesh) -> u64 {
    let is_kept = |field: &&Field| config.fields.iter().any(|name| field.answers_to(name));
    let fields = match config.all_fields {
        true => mesh.fields.len(),
        false => mesh.fields.iter().filter(is_kept).count(),
    };
    fields.max(1) as u64
}

/// From so much memory on, the command says what it needs.
const MUCH_MEMORY: u64 = 1 << 30;

/// Says how much memory building takes where that is much, and chooses how to keep to what is allowed.
///
/// Of a mesh of so many points, tetrahedra and fields; if it comes in pieces, there are so many, and the largest one has so many
/// tetrahedra.
fn way(
    arguments: &Arguments,
    config: &BuildConfig,
    [points, tetrahedra, fields]: [u64; 3],
    pieces: Option<[u64; 2]>,
) -> Result<Way> {
    let Arguments { options, verbosity, .. } = arguments;
    let needed = memory_needed(config.construction, points, tetrahedra, fields);
    let what = format!("building {} tetrahedra takes about {}", count(tetrahedra), bytes(needed));
    let tell = |line: String| {
        if !verbosity.quiet {
            output::note(&format!("{}: {line}", options.name()));
        }
    };
    if let Some(parts) = arguments.parts {
        return Ok(if parts == 1 { Way::Whole } else { Way::Parts(parts) });
    }
    match arguments.memory {
        Some(most) if needed > most => {
            if let Some(parts) = parts::count_for(config, [points, tetrahedra, fields], pieces, most) {
                tell(format!("{what} of memory at once, so it is built in {parts} parts"));
                return Ok(Way::Parts(parts));
            }
            let in_parts = match parts::least_memory(config, [points, tetrahedra, fields], pieces) {
                Some(least) => format!("in parts about {}, ", bytes(least)),
                None => "and only kind half-edge is built in parts, ".to_owned(),
            };
            Err(anyhow!(
                "{what} of memory, {in_parts}more than --memory allows ({}): allow more, keep fewer fields, or build a coarser mesh",
                bytes(most)
            ))
            .with_context(|| options.name())
        }
        None if let Some(most) = machine::memory().filter(|most| needed > *most) => Err(anyhow!(
            "{what} of memory at most, more than there is ({}): with --memory it is built in parts, or tried all the same",
            bytes(most)
        ))
        .with_context(|| options.name()),
        _ => {
            if needed >= MUCH_MEMORY {
                tell(format!("{what} of memory at most"));
            }
            Ok(Way::Whole)
        }
    }
}

impl BuildOptions {
    /// How to build. Ends the program if the options contradict each other.
    pub fn config(&self) -> BuildConfig {
        let &Self { kind, method, criterion, purpose, tet_errors, .. } = self;
        let choice = ConstructionChoice { kind, method, criterion, purpose, tet_errors };
        let default = BuildConfig::of(choice.kind());
        let precision: Vec<&Precision> = self.field_bits.iter().chain(&self.field_tolerance).collect();
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
            fields: self.fields.clone(),
            all_fields: self.all_fields,
            position_bits: self.position_bits,
            position_tolerance: self.position_tolerance,
            field_precision: for_all.first().copied().unwrap_or(default.field_precision),
            precision_of: precision.iter().filter_map(of_one).collect(),
            lossless: self.lossless.iter().filter(|name| !name.is_empty()).cloned().collect(),
            all_lossless: self.lossless.iter().any(String::is_empty),
            displacement: self.displacement.unwrap_or(default.displacement),
            displacement_edges: self.displacement_edges.unwrap_or(default.displacement_edges),
            min_dihedral: self.restrictions.min_dihedral,
            feature_angle: self.restrictions.feature_angle,
            preserve: self.restrictions.preserve.clone(),
            preserve_within: self.restrictions.preserve_within.unwrap_or(default.preserve_within),
            keep_points: Vec::new(),
            block_bits: self.block_updates.unwrap_or(default.block_bits),
        }
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
    let result =
        with_progress(&arguments.verbosity, |progress| tetralod_build::build_owned(mesh, config, progress))?;
    result.map_err(failed).with_context(|| arguments.options.name())
}

/// Why building failed, with the option that helps.
pub fn failed(error: BuildError) -> anyhow::Error {
    match error.remedy().and_then(options_of) {
        Some(option) => anyhow!("{error} ({option})"),
        None => error.into(),
    }
}

/// Shows the progress of some work, on stderr and only on a terminal.
pub fn with_progress<T>(verbosity: &Verbosity, work: impl FnOnce(OnProgress<'_>) -> T) -> Result<T> {
    let bar = progress_bar(verbosity, "{pos}/{len}  ")?;
    let mut stage = "";
    let result = work(&mut |progress: BuildProgress| {
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
    Ok(result)
}

/// A bar with the time that is left, on stderr and only on a terminal; `counts` stands behind the percentage.
pub fn progress_bar(verbosity: &Verbosity, counts: &str) -> Result<ProgressBar> {
    let bar = if verbosity.quiet { ProgressBar::hidden() } else { ProgressBar::new(0) };
    let style =
        format!("{{msg:<12}} {{wide_bar}} {{percent:>3}} %  {counts}{{elapsed_precise}}  about {{eta}} left");
    bar.set_style(ProgressStyle::with_template(&style).context("the style of the progress bar")?);
    Ok(bar)
}

/// The options that do what a remedy says. `Remedy` may grow.
fn options_of(remedy: Remedy) -> Option<&'static str> {
    Some(match remedy {
        Remedy::Insert => "--method insert",
        Remedy::Decimate => "--method decimate",
        Remedy::Field => "--field",
        Remedy::CellsToPoints => "--cell-to-point; or --field distance, x, y, z or none for the shape alone",
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
        counts: *summary,
        interface_deviation: (config.preserve_within > 0.0).then_some(summary.interface_deviation),
        file_bytes,
        bytes_per_vertex: file_bytes as f64 / f64::from(summary.vertices.max(1)),
        seconds,
        repaired,
        repair: None,
        angles: None,
        notes: Vec::new(),
    }
}

/// The counts of a build for people.
pub fn rows_of(counts: &BuildSummary) -> [(&'static str, String); 3] {
    let &BuildSummary { vertices, tetrahedra, base_vertices, base_tetrahedra, updates, depth, .. } = counts;
    [
        ("reference mesh", output::mesh(vertices, tetrahedra)),
        ("base mesh", output::mesh(base_vertices, base_tetrahedra)),
        ("updates", format!("{}, at most {} deep", output::count(updates), output::count(depth))),
    ]
}

fn rows(output: &Path, report: &Report) -> Vec<(&'static str, String)> {
    let counts = &report.counts;
    let removed = f64::from(counts.tetrahedra.saturating_sub(counts.base_tetrahedra));
    let mut rows = vec![("file", output.display().to_string())];
    rows.extend(rows_of(counts));
    rows.extend([
        ("position bits", counts.position_bits.to_string()),
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
    ]);
    let moved = report
        .interface_deviation
        .map(|moved| ("interfaces moved", format!("{} at most", output::number(moved))));
    rows.extend(moved);
    rows.extend(report.angles.iter().flat_map(Angles::rows));
    rows
}

//! The options of building: what is built, and how.

use crate::parse::named;
use crate::refuse_usage;
use crate::repair::RepairOptions;
use crate::restrictions::RestrictionOptions;
use crate::{input, parse};
use anyhow::{Context, Result};
use std::collections::BTreeMap;
use std::path::PathBuf;
use tetralod::mesh::RepairLevel;
use tetralod::mt::MtKind;
use tetralod_build::{
    BuildConfig, BuildCriterion, BuildError, Construction, ConstructionChoice, FieldPrecision, Method,
    Purpose,
};

/// What is built, and how: the same for a whole and for parts.
#[derive(clap::Args)]
pub struct BuildOptions {
    /// Mesh or grid: .vtu, .vti, .vts, .vtr, the lists .pvtu, .pvti, .pvts and .pvtr, .vtk, .vtkhdf, Exodus .exo, .ex2 or .e, Gmsh .msh,
    /// Medit .mesh or .meshb, TetGen .node or .ele, Netgen .vol, .nrrd, .mha or .mhd, .zarr (a folder, or an
    /// http(s) or s3 address), or .raw with a .json beside it; - is the standard input. Points without cells go with --method insert. Several, a .pvd, and what a file has of them are time steps over
    /// one mesh.
    #[arg(required = true, value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    /// The format of the standard input, which is refused if its content is another one: vtu, vti, vts, vtr, vtk, vtkhdf,
    /// exodus, gmsh, medit, netgen, nrrd or metaimage [default: what its content says].
    #[arg(long, value_name = "FORMAT")]
    pub(super) format: Option<String>,
    /// Build one of the time steps alone; the first one is 0.
    #[arg(long, value_name = "N")]
    pub(super) step: Option<usize>,
    /// The kind of MT: half-edge (the best for regions), edge or vertex [default: what goes with the other options, else half-edge].
    #[arg(long, value_name = "KIND", value_parser = kind)]
    kind: Option<MtKind>,
    /// How it is built: collapse (edges, for kind edge), insert or decimate (vertices, for kind vertex)
    /// [default: collapse, decimate for kinds vertex and half-edge].
    #[arg(long, value_name = "METHOD", value_parser = |text: &str| named(text, &Method::ALL.map(|method| (method.name(), method))))]
    method: Option<Method>,
    /// By what criterion vertices go or come: delaunay, or half-edge with decimate alone [default: half-edge with
    /// decimate].
    #[arg(long, value_name = "CRITERION", value_parser = |text: &str| named(text, &BuildCriterion::ALL.map(|criterion| (criterion.name(), criterion))))]
    criterion: Option<BuildCriterion>,
    /// What it is for, with decimate: uniform, the fewest tetrahedra at one error everywhere; or regions, which then take
    /// less around them with them [default: uniform].
    #[arg(long = "for", value_name = "PURPOSE", value_parser = |text: &str| named(text, &Purpose::ALL.map(|purpose| (purpose.name(), purpose))))]
    purpose: Option<Purpose>,
    /// Keep for each tetrahedron how far its own error is below that of the update that removes it: requests take fewer
    /// tetrahedra, but every one is answered from the base mesh. With --method insert only.
    #[arg(long)]
    tet_errors: bool,
    /// A field to keep (repeatable, in this order), or a vector with all its components; if not given, the first array that does not
    /// number something or say where it is, such as material or coordinates: of a vector the magnitude, of a symmetric tensor von Mises' equivalent. Where the input has none of these names: distance (from the middle of the bounding box), x, y, z, or none, for the shape alone.
    #[arg(long = "field", value_name = "NAME")]
    fields: Vec<String>,
    /// Keep all fields but what follows from others: magnitudes of vectors, von Mises' equivalent and principal values of symmetric tensors.
    #[arg(long)]
    all_fields: bool,
    /// Turn fields at cells into fields at points: the mean of the cells around, weighted by volume, of labels the most frequent one. What that
    /// does to each field is said, and kept in the file.
    #[arg(long)]
    pub(super) cell_to_point: bool,
    /// With --preserve, average fields at cells over all cells around a point. If not given, files of kind half-edge keep a value for each
    /// region that meets there.
    #[arg(long, requires = "cell_to_point")]
    pub(super) mean_across_regions: bool,
    /// A field that is a label (repeatable): whole numbers with nothing between two of them, shown by the nearest point [default: integers of at
    /// most 256 different values whose name says that they number something, as material].
    #[arg(long = "label", value_name = "NAME")]
    labels: Vec<String>,
    /// A field that is no label, whatever its name says (repeatable).
    #[arg(long = "no-label", value_name = "NAME")]
    no_labels: Vec<String>,
    #[command(flatten)]
    pub repair: RepairOptions,
    /// The unit of a field or vector (repeatable).
    #[arg(long = "unit", value_name = "NAME=UNIT", value_parser = last_pair)]
    pub(super) units: Vec<(String, String)>,
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
    /// Tetrahedra of a range of cells, where the input is read by such: for tests.
    #[arg(long, value_name = "N", hide = true)]
    pub(super) range: Option<u64>,
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
    let is_size = |x| (0.0..f64::INFINITY).contains(&x);
    let size = parse::number(number, is_size, "a number, or a percentage as 1%, or NAME= and that")?;
    Ok(Precision { name, precision: unit(size) })
}

/// A part of the diagonal.
fn share(text: &str) -> Result<f64> {
    let percent = text.trim().strip_suffix('%').and_then(|number| number.trim().parse().ok());
    let percent = percent.filter(|x: &f64| *x >= 0.0 && x.is_finite());
    Ok(percent.context("it must be a percentage of the diagonal, as 20%")? / 100.0)
}

/// How many edges.
fn lengths(text: &str) -> Result<f64> {
    parse::number(text, |x| x >= 0.0, "a number of at least 0, or inf")
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

impl BuildOptions {
    /// The name of the input, for messages.
    pub fn name(&self) -> String {
        input::name(&self.inputs[0])
    }

    /// Which fields are labels, and which are not, as far as that is said.
    pub(super) fn labels(&self) -> Vec<(String, bool)> {
        let named =
            |names: &[String], is_label| names.iter().map(move |name| (name.clone(), is_label)).collect();
        let both: [Vec<(String, bool)>; 2] = [named(&self.labels, true), named(&self.no_labels, false)];
        if let Some((name, _)) = both[0].iter().find(|(name, _)| self.no_labels.contains(name)) {
            refuse_usage(&format!("'{name}' is a label or not: give --label or --no-label for it"));
        }
        both.concat()
    }

    /// What the file is to say of itself.
    pub fn metadata(&self, config: &BuildConfig) -> BTreeMap<String, String> {
        let built = config.construction.metadata().into_iter().chain(self.repair.level().metadata());
        built.chain(self.metadata.iter().cloned()).collect()
    }

    /// How to build. Ends the program if the options contradict each other.
    pub fn config(&self) -> BuildConfig {
        let &Self { kind, method, criterion, purpose, tet_errors, .. } = self;
        let choice = ConstructionChoice { kind, method, criterion, purpose, tet_errors };
        let default = BuildConfig::of(choice.kind());
        let precision: Vec<&Precision> = self.field_bits.iter().chain(&self.field_tolerance).collect();
        let for_all: Vec<FieldPrecision> =
            precision.iter().filter(|p| p.name.is_none()).map(|p| p.precision).collect();
        if for_all.len() > 1 {
            refuse_usage(
                "--field-bits and --field-tolerance without a name are for all fields: give one of them",
            );
        }
        let of_one = |p: &&Precision| p.name.clone().map(|name| (name, p.precision));
        BuildConfig {
            construction: construction(&choice).unwrap_or_else(|wrong| refuse_usage(&wrong)),
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

//! Building: from files, or from the bytes of one, to the bytes of an MT file.

use crate::errors::{self, Failure};
use crate::watch::Watch;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::PyBytes;
use serde::Serialize;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Instant;
use tetralod::Coded;
use tetralod::format::{EncodeOptions, encode};
use tetralod::mesh::{self, MeshError, MeshFindings, RepairLevel, RepairReport, TetMesh};
use tetralod::mt::{AveragedField, MtKind};
use tetralod_build::{
    BuildConfig, BuildCriterion, BuildError, BuildSummary, Construction, ConstructionChoice, FieldPrecision,
    Method, Purpose, build_with, mark_labels,
};
use tetralod_io::{
    CellData, FieldSelection, ReadError, ReadOptions, read_bytes_with, read_time_steps, read_with,
};

/// What is built from.
#[derive(FromPyObject)]
pub enum Input {
    /// Files, each a time step or a list of such.
    Files(Vec<PathBuf>),
    /// What to call it, and the bytes of a file.
    Memory(String, PyBackedBytes),
}

/// The options, as Python has checked and named them. Those that are names are checked here.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct BuildOptions {
    step: Option<usize>,
    kind: Option<String>,
    method: Option<String>,
    criterion: Option<String>,
    purpose: Option<String>,
    tet_errors: bool,
    fields: Vec<String>,
    all_fields: bool,
    cell_to_point: bool,
    mean_across_regions: bool,
    labels: Vec<(String, bool)>,
    repair: Option<String>,
    weld_distance: Option<f64>,
    units: Vec<(String, String)>,
    metadata: Vec<(String, String)>,
    position_bits: Option<u32>,
    position_tolerance: Option<f64>,
    /// Of all fields, or of one by its name: bits, units, or a fraction of the range.
    precision: Vec<(Option<String>, String, f64)>,
    lossless: Vec<String>,
    all_lossless: bool,
    displacement: Option<f64>,
    displacement_edges: Option<f64>,
    min_dihedral: Option<f64>,
    feature_angle: Option<f64>,
    preserve: Vec<String>,
    preserve_within: Option<f64>,
    keep_points: Vec<[f64; 3]>,
    block_updates: Option<u32>,
}

/// What was done: the words of `tetralod build --json`.
#[derive(Serialize)]
struct Report {
    kind: &'static str,
    method: &'static str,
    criterion: Option<&'static str>,
    #[serde(flatten)]
    counts: BuildSummary,
    interface_deviation: f64,
    file_bytes: usize,
    bytes_per_vertex: f64,
    seconds: f64,
    repaired: String,
    repair: Option<Repair>,
    averaged: Vec<AveragedField>,
    /// The files that were read, at their places without links; none of what is in memory.
    inputs: Vec<String>,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct Repair {
    level: &'static str,
    weld_distance: f64,
    #[serde(flatten)]
    done: RepairReport,
    kept: String,
    #[serde(flatten)]
    found: MeshFindings,
}

/// Builds an MT: the bytes of its file, and what was done, as JSON.
#[pyfunction]
pub fn build(
    py: Python<'_>,
    input: Input,
    options: BuildOptions,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Py<PyBytes>, String)> {
    let mut watch = Watch::new(progress);
    let (bytes, report) = py.detach(|| built(&input, options, &mut watch))?;
    Ok((PyBytes::new(py, &bytes).unbind(), report))
}

fn built(input: &Input, options: BuildOptions, watch: &mut Watch) -> PyResult<(Vec<u8>, String)> {
    let start = Instant::now();
    let (config, level) = (options.config()?, options.level()?);
    let (name, mesh) = input.read(&options, &config, watch)?;
    let notes = mesh.notes.clone();
    let mut inputs: Vec<PathBuf> =
        mesh.input.files.0.iter().filter_map(|file| std::fs::canonicalize(file).ok()).collect();
    inputs.sort_unstable();
    inputs.dedup();
    watch.begin("repair")?;
    let bad_mesh = |error: MeshError| Failure::new("bad-mesh", format!("{name}: {error}"));
    let (mut mesh, repaired, repair) = if mesh.tets.is_empty() {
        expect_points(&mesh, &config).map_err(|error| error.of(&name))?;
        (mesh, String::new(), None)
    } else {
        let (mesh, done) = mesh::repair_at(mesh, level).map_err(bad_mesh)?;
        let found = mesh::findings(&mesh, level.weld_distance()).map_err(bad_mesh)?;
        let (level, weld_distance) = (level.name(), level.weld_distance());
        (mesh, done.to_string(), Some(Repair { level, weld_distance, done, kept: found.to_string(), found }))
    };
    mark_labels(&mut mesh, &options.labels, &config).map_err(|error| errors::build(&name, &error))?;
    let to_points = config.cells_to_points(options.cell_to_point, options.mean_across_regions);
    mesh.settle_cells(to_points, &config.preserve);
    mesh.add_geometry_fields(&config.fields);
    let unknown = |(name, _): &(String, String)| {
        Failure::new("bad-option", format!("option `units`: there is no field '{name}'"))
    };
    mesh.set_units(&options.units).map_err(unknown)?;
    let built = build_with(mesh, &config, &mut |step| {
        let goes_on = watch.goes_on(step.stage, step.done, step.total);
        if goes_on { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    watch.check()?;
    let built = built.map_err(|error| errors::build(&name, &error))?;
    watch.begin("encode")?;
    let own = config.construction.metadata().into_iter().chain(level.metadata());
    let metadata = own.chain(options.metadata).collect();
    let averaged = tetralod::mt::MultiTessellation::info(&built.mt).averaged_fields();
    let bytes = encode(&built.mt, &EncodeOptions::complete(built.exact, metadata)).map_err(Failure::from)?;
    let report = Report {
        kind: config.construction.kind().name(),
        method: config.construction.method().name(),
        criterion: config.construction.criterion().map(BuildCriterion::name),
        counts: built.summary,
        interface_deviation: built.summary.interface_deviation,
        file_bytes: bytes.len(),
        bytes_per_vertex: bytes.len() as f64 / f64::from(built.summary.vertices.max(1)),
        seconds: start.elapsed().as_secs_f64(),
        repaired,
        repair,
        averaged,
        inputs: inputs.iter().map(|path| path.to_string_lossy().into_owned()).collect(),
        notes,
    };
    let report =
        serde_json::to_string(&report).map_err(|error| Failure::new("internal", error.to_string()))?;
    Ok((bytes, report))
}

impl Input {
    /// What to call it, and the mesh as it is in there.
    fn read(
        &self,
        options: &BuildOptions,
        config: &BuildConfig,
        watch: &mut Watch,
    ) -> PyResult<(String, TetMesh)> {
        let with_cells = options.cell_to_point || !config.preserve.is_empty();
        let wanted = FieldSelection {
            names: &config.fields,
            all: config.all_fields,
            labels: &config.preserve,
            cells: if with_cells { CellData::Values } else { CellData::Names },
        };
        match self {
            Self::Files(paths) => {
                let mut steps = Vec::new();
                for path in paths {
                    steps.extend(tetralod_io::steps(path).map_err(Failure::from)?);
                }
                if let Some(step) = options.step {
                    if step >= steps.len() {
                        let problem = format!(
                            "option `step`: there are {} time steps, and the first one is 0",
                            steps.len()
                        );
                        return Err(Failure::new("bad-option", problem).into());
                    }
                    steps = vec![steps.swap_remove(step)];
                }
                let named: Vec<_> =
                    steps.iter().map(|step| (step.path.display().to_string(), step.time)).collect();
                let name = named.first().map(|(name, _)| name.clone()).unwrap_or_default();
                let mesh = read_steps(&named, &wanted, watch, &|number, read| {
                    read_with(&steps[number].path, &ReadOptions { step: steps[number].number, ..read })
                })?;
                Ok((name, mesh))
            }
            Self::Memory(name, bytes) => {
                let named = [(name.clone(), None)];
                let mesh =
                    read_steps(&named, &wanted, watch, &|_, read| read_bytes_with(name, bytes, &read))?;
                Ok((name.clone(), mesh))
            }
        }
    }
}

fn read_steps(
    named: &[(String, Option<f64>)],
    wanted: &FieldSelection<'_>,
    watch: &mut Watch,
    read: &dyn Fn(usize, ReadOptions) -> Result<TetMesh, ReadError>,
) -> PyResult<TetMesh> {
    let total = named.len() as u64;
    let mesh = read_time_steps(named, wanted, &mut |number, options| {
        watch.goes_on("parse", number as u64, total);
        read(number, options.clone())
    });
    watch.check()?;
    Ok(mesh.map_err(|error| errors::time_steps(&error))?)
}

/// Points without cells go with insertion alone.
fn expect_points(mesh: &TetMesh, config: &BuildConfig) -> Result<(), Failure> {
    if !config.construction.method().keeps_the_mesh() {
        return Ok(());
    }
    if mesh.positions.is_empty() {
        return Err(Failure::new("bad-mesh", MeshError::Empty.to_string()));
    }
    let what = "there are points but no tetrahedra; kind=\"vertex\" with method=\"insert\" makes an MT of points alone";
    Err(Failure::new("bad-mesh", what))
}

/// What has this name.
fn named<T: Copy>(option: &str, text: Option<&String>, all: &[(&str, T)]) -> Result<Option<T>, Failure> {
    let Some(text) = text else { return Ok(None) };
    let found = all.iter().find(|(name, _)| name == text).map(|&(_, value)| value);
    let names: Vec<String> = all.iter().map(|(name, _)| format!("{name:?}")).collect();
    let refused = || format!("option `{option}`: must be one of {}; given: {text:?}", names.join(", "));
    found.map(Some).ok_or_else(|| Failure::new("bad-option", refused()))
}

impl BuildOptions {
    /// How the mesh is mended.
    fn level(&self) -> Result<RepairLevel, Failure> {
        let levels = RepairLevel::ALL.map(|level| (level.name(), level));
        let level = named("repair", self.repair.as_ref(), &levels)?.unwrap_or_default();
        match (level, self.weld_distance) {
            (level, None) => Ok(level),
            (RepairLevel::Weld { .. }, Some(distance)) => Ok(RepairLevel::Weld { distance }),
            _ => Err(Failure::new("bad-option", "option `weld_distance`: goes with repair=\"weld\"")),
        }
    }

    fn construction(&self) -> Result<(MtKind, Construction), Failure> {
        let choice = ConstructionChoice {
            kind: named("kind", self.kind.as_ref(), &MtKind::ALL.map(|kind| (kind.name(), kind)))?,
            method: named("method", self.method.as_ref(), &Method::ALL.map(|by| (by.name(), by)))?,
            criterion: named(
                "criterion",
                self.criterion.as_ref(),
                &BuildCriterion::ALL.map(|by| (by.name(), by)),
            )?,
            purpose: named("purpose", self.purpose.as_ref(), &Purpose::ALL.map(|for_| (for_.name(), for_)))?,
            tet_errors: self.tet_errors,
        };
        let refused = |error: BuildError| Failure::new(error.code(), error.to_string());
        Ok((choice.kind(), choice.construction().map_err(refused)?))
    }

    /// How to build.
    fn config(&self) -> Result<BuildConfig, Failure> {
        let (kind, construction) = self.construction()?;
        let default = BuildConfig::of(kind);
        let precision = |(_, unit, number): &(Option<String>, String, f64)| match unit.as_str() {
            "bits" => FieldPrecision::Bits(*number as u32),
            "units" => FieldPrecision::Units(*number),
            _ => FieldPrecision::Fraction(*number),
        };
        let is_reserved = |key: &str| {
            key.is_empty() || key == RepairLevel::METADATA_KEY || Construction::METADATA_KEYS.contains(&key)
        };
        if let Some((key, _)) = self.metadata.iter().find(|(key, _)| is_reserved(key)) {
            return Err(Failure::new(
                "bad-option",
                format!("option `metadata`: the key {key:?} is empty or reserved"),
            ));
        }
        let of_all = self.precision.iter().find(|(name, ..)| name.is_none()).map(precision);
        let of_one = self.precision.iter().filter_map(|one| Some((one.0.clone()?, precision(one))));
        Ok(BuildConfig {
            construction,
            fields: self.fields.clone(),
            all_fields: self.all_fields,
            position_bits: self.position_bits,
            position_tolerance: self.position_tolerance,
            field_precision: of_all.unwrap_or(default.field_precision),
            precision_of: of_one.collect(),
            lossless: self.lossless.clone(),
            all_lossless: self.all_lossless,
            displacement: self.displacement.unwrap_or(default.displacement),
            displacement_edges: self.displacement_edges.unwrap_or(default.displacement_edges),
            min_dihedral: self.min_dihedral,
            feature_angle: self.feature_angle,
            preserve: self.preserve.clone(),
            preserve_within: self.preserve_within.unwrap_or(default.preserve_within),
            keep_points: self.keep_points.clone(),
            block_bits: self.block_updates.map_or(default.block_bits, u32::ilog2),
        })
    }
}

//! The wasm module `build` of the npm package: the class that builds MT files in a page. Files of a mesh go in, the bytes of an MT file
//! come out. All of it happens in one call on one thread, so JavaScript puts it into a worker of its own and ends that to stop the work.

mod memory;
mod options;

use crate::memory::{Forecast, LARGEST_MEMORY};
use crate::options::{BuildOptions, build_options};
use js_sys::{Function, Object, Reflect, Uint8Array};
use serde::Serialize;
use std::cell::RefCell;
use std::collections::TryReserveError;
use std::ops::ControlFlow;
use tetralod::Coded;
use tetralod::format::{EncodeOptions, encode};
use tetralod::geom::Bounds;
use tetralod::mesh::{
    self, COMPONENTS, Difference, Extremes, Field, GeometryField, MeshError, MeshFindings, RepairLevel,
    RepairReport, TetMesh,
};
use tetralod::mt::{AveragedField, MultiTessellation};
use tetralod_build::{self as builder, BuildConfig, BuildError, BuildProgress, BuildSummary, Remedy};
use tetralod_io::{
    CellData, FieldSelection, FilesInMemory, MemoryLimit, ReadOptions, StepInMemory, Survey, read_time_steps,
};
use tetralod_web_options::error::WebError;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsCast, JsValue};

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = r#"import type { CoreBuildOptions, CoreBuildReport, InputInfo } from "./build.js";"#;

#[wasm_bindgen]
extern "C" {
    /// What is in the files, as a plain object.
    #[wasm_bindgen(typescript_type = "InputInfo")]
    pub type JsInputInfo;
    /// The MT file and what was done.
    #[wasm_bindgen(typescript_type = "{ bytes: Uint8Array<ArrayBuffer>, report: CoreBuildReport }")]
    pub type JsBuilt;
    /// Options as JavaScript gives them: anything at all.
    #[wasm_bindgen(typescript_type = "CoreBuildOptions | undefined")]
    pub type JsBuildOptions;
}

thread_local! {
    /// Hears of panics, which end as traps without a message.
    static ON_PANIC: RefCell<Option<Function>> = RefCell::default();
}

/// The files of a mesh, and the MT that is built of them.
#[wasm_bindgen]
pub struct MeshBuilder {
    files: FilesInMemory,
    /// Bytes of memory that may be used.
    memory: u64,
}

#[wasm_bindgen]
impl MeshBuilder {
    /// Without files, and with so many bytes of memory at most; all that a wasm module can have if not given. `on_panic` hears the
    /// message of a panic before it becomes a trap.
    #[wasm_bindgen(constructor)]
    pub fn new(on_panic: Function, memory: Option<f64>) -> Self {
        ON_PANIC.set(Some(on_panic));
        std::panic::set_hook(Box::new(|info| {
            ON_PANIC.with_borrow(|hook| {
                let message = JsValue::from_str(&info.to_string());
                // Nothing can be done about an error of the hook.
                hook.iter().for_each(|hook| _ = hook.call1(&JsValue::UNDEFINED, &message));
            });
        }));
        let memory = memory.map_or(LARGEST_MEMORY, |bytes| (bytes.max(0.0) as u64).min(LARGEST_MEMORY));
        Self { files: FilesInMemory::default(), memory }
    }

    /// Begins a file of so many bytes, which `append` brings. Each further file that no other one names is a time step.
    #[wasm_bindgen(js_name = addFile)]
    pub fn add_file(&mut self, name: &str, size: f64) -> Result<(), WebError> {
        let whole = self.files.held_bytes().saturating_add(size.max(0.0) as u64);
        if whole > self.memory {
            return Err(self.too_large(name, whole));
        }
        self.files.begin(name.to_owned());
        // The size fits: it is at most that of the memory, which is less than 2^32.
        self.reserve(|bytes| bytes.try_reserve_exact(size.max(0.0) as usize), whole)
    }

    /// Appends bytes to the file that was begun last.
    pub fn append(&mut self, bytes: &[u8]) -> Result<(), WebError> {
        let whole = self.files.held_bytes().saturating_add(bytes.len() as u64);
        self.reserve(|file| file.try_reserve(bytes.len()), whole)?;
        self.files.last_mut().into_iter().for_each(|(_, file)| file.extend_from_slice(bytes));
        Ok(())
    }

    /// What is in the files, and whether it can be built with these options. The points are read for their bounds, if there is
    /// enough memory.
    pub fn inspect(&self, options: JsBuildOptions) -> Result<JsInputInfo, WebError> {
        let options = build_options(&options)?;
        let steps = self.steps()?;
        let (survey, bounds) = self.survey(&steps)?;
        let forecast = self.forecast(&survey, &steps, &options);
        let bounds = match (&survey.grid, bounds, steps.first()) {
            (Some(grid), ..) => Some(Bounds::of(&[grid.point([0; 3]), grid.point(grid.dims.map(|d| d - 1))])),
            (None, None, Some(first)) if forecast.reading <= self.memory => {
                let options = ReadOptions { fields: Some(Vec::new()), ..ReadOptions::default() };
                let points = self.files.read(first, &options)?.positions;
                Some(Bounds::of(&points)).filter(|_| !points.is_empty())
            }
            (None, bounds, _) => bounds,
        };
        Ok(info(&survey, bounds, forecast.peak(), self.memory))
    }

    /// Builds the MT file. `progress` gets the stage of the work, how much of it is done, the whole, and the tetrahedra that are left
    /// where they change; if it returns `true`, the work stops. The files are gone then.
    pub fn build(&mut self, options: JsBuildOptions, progress: &Function) -> Result<JsBuilt, WebError> {
        let options = build_options(&options)?;
        let steps = self.steps()?;
        let (survey, _) = self.survey(&steps)?;
        Self::check_fields(&survey, &options)?;
        let forecast = self.forecast(&survey, &steps, &options);
        if forecast.peak() > self.memory {
            return Err(no_memory(&survey, forecast.peak(), self.memory));
        }
        let stages = Stages { progress, stopped: false };
        self.build_of(&steps, options, stages)
    }
}

impl MeshBuilder {
    /// Makes room in the file that was begun last, where all files then have `whole` bytes.
    fn reserve(
        &mut self,
        make_room: impl FnOnce(&mut Vec<u8>) -> Result<(), TryReserveError>,
        whole: u64,
    ) -> Result<(), WebError> {
        let Some((name, bytes)) = self.files.last_mut() else { return Err(no_file()) };
        if make_room(bytes).is_ok() {
            return Ok(());
        }
        let name = name.to_owned();
        Err(self.too_large(&name, whole))
    }

    fn steps(&self) -> Result<Vec<StepInMemory>, WebError> {
        let steps = self.files.steps()?;
        if steps.is_empty() { Err(no_file()) } else { Ok(steps) }
    }

    /// What the first step contains, and between what its points lie where they had to be read for that.
    fn survey(&self, steps: &[StepInMemory]) -> Result<(Survey, Option<Bounds>), WebError> {
        let first = steps.first().ok_or_else(no_file)?;
        let rest = self.memory.saturating_sub(self.files.held_bytes());
        Ok(self.files.survey(first, &MemoryLimit::of(rest))?)
    }

    fn too_large(&self, name: &str, bytes: u64) -> WebError {
        let [bytes, memory] = [bytes, self.memory].map(megabytes);
        let remedy = "use the command `tetralod build`";
        WebError::new(
            "memory",
            format!("{name}: the files have {bytes} MB, but there are {memory} MB of memory; {remedy}"),
        )
    }

    fn forecast(&self, survey: &Survey, steps: &[StepInMemory], options: &BuildOptions) -> Forecast {
        Forecast::of(survey, self.files.held_bytes(), steps.len() as u64, options)
    }

    /// Refuses fields that are not there before anything is read.
    fn check_fields(survey: &Survey, options: &BuildOptions) -> Result<(), WebError> {
        let BuildOptions { config, cells, .. } = options;
        let has = |fields: &[Field], name: &str| fields.iter().any(|field| field.answers_to(name));
        for name in &config.fields {
            let is_there = has(&survey.fields, name) || *cells && has(&survey.cell_fields, name);
            if is_there || GeometryField::named(name).is_some() && !has(&survey.cell_fields, name) {
                continue;
            }
            if has(&survey.cell_fields, name) {
                return Err(refused(&BuildError::CellField { name: name.clone() }));
            }
            let all = survey.fields.iter().chain(survey.cell_fields.iter().filter(|_| *cells));
            let known = all.map(|field| field.name.clone()).collect();
            return Err(refused(&BuildError::UnknownField { name: name.clone(), known }));
        }
        let all = || survey.fields.iter().chain(&survey.cell_fields);
        for name in &config.preserve {
            if name != COMPONENTS && !all().any(|field| field.name == *name) {
                let known = all().map(|field| field.name.clone()).collect();
                return Err(refused(&BuildError::UnknownLabel { name: name.clone(), known }));
            }
        }
        Ok(())
    }

    fn build_of(
        &mut self,
        steps: &[StepInMemory],
        options: BuildOptions,
        mut stages: Stages<'_>,
    ) -> Result<JsBuilt, WebError> {
        let BuildOptions { config, cells, to_points, labels, repair: level, units, metadata } = options;
        let name = steps.first().map(|step| step.name.clone()).unwrap_or_default();
        let left_out = self.files.left_out();
        let mesh = self.read(steps, &config, cells, &mut stages)?;
        let mut notes = mesh.notes.clone();
        if !left_out.is_empty() {
            notes.push(format!("left out of the folder, for it is no mesh: {}", left_out.join(", ")));
        }
        stages.begin("repair")?;
        let (mut mesh, repaired) = if mesh.tets.is_empty() {
            expect_points(&mesh, &config, &name)?;
            (mesh, None)
        } else {
            let bad_mesh = |error| bad_mesh(&name, &error);
            let (mesh, done) = mesh::repair_at(mesh, level).map_err(bad_mesh)?;
            let found = mesh::findings(&mesh, level.weld_distance()).map_err(bad_mesh)?;
            (mesh, Some((done, RepairObject::of(level, &done, &found))))
        };
        builder::mark_labels(&mut mesh, &labels, &config).map_err(|error| refused(&error))?;
        mesh.settle_cells(to_points, &config.preserve);
        mesh.add_geometry_fields(&config.fields);
        let unknown = |(name, _): &(String, String)| {
            WebError::bad_option("units", &format!("there is no field '{name}'"))
        };
        mesh.set_units(&units).map_err(unknown)?;
        let built = builder::build_with(mesh, &config, &mut |step| stages.step(&step));
        let built = built.map_err(|error| in_input(&name, &error))?;
        stages.begin("encode")?;
        let built_by = config.construction.metadata().into_iter().chain(level.metadata());
        let metadata = built_by.chain(metadata).collect();
        let bytes = encode(&built.mt, &EncodeOptions::complete(built.exact, metadata))?;
        let (repaired, repair) =
            repaired.map_or_else(Default::default, |(done, repair)| (done.to_string(), Some(repair)));
        let said = Said { repaired, repair, notes, averaged: built.mt.info().averaged_fields() };
        Ok(result(&bytes, &config, &built.summary, said))
    }

    /// The mesh as the files have it. Each file is dropped when no later step needs it.
    fn read(
        &mut self,
        steps: &[StepInMemory],
        config: &BuildConfig,
        cells: bool,
        stages: &mut Stages<'_>,
    ) -> Result<TetMesh, WebError> {
        let mut files = std::mem::take(&mut self.files);
        let named: Vec<_> = steps.iter().map(|step| (step.name.clone(), step.time)).collect();
        let total = steps.len() as u64;
        let cells = if cells || !config.preserve.is_empty() { CellData::Values } else { CellData::Names };
        let labels = &config.preserve;
        let wanted = FieldSelection { names: &config.fields, all: config.all_fields, labels, cells };
        let memory = MemoryLimit::of(self.memory);
        let mut read = |number: usize, options: &ReadOptions| {
            let options = &ReadOptions { memory: memory.clone(), ..options.clone() };
            stages.count("parse", number as u64, total);
            let read = files.read(&steps[number], options);
            files.keep(&steps[number + 1..]);
            read
        };
        let mesh = read_time_steps(&named, &wanted, &mut read)?;
        if stages.stopped { Err(BuildError::Stopped.into()) } else { Ok(mesh) }
    }
}

/// Tells JavaScript how far the work is.
struct Stages<'a> {
    progress: &'a Function,
    stopped: bool,
}

impl Stages<'_> {
    fn tell(&mut self, stage: &str, done: u64, total: u64, tetrahedra: Option<u32>) {
        let numbers = js_sys::Array::of4(
            &stage.into(),
            &(done as f64).into(),
            &(total as f64).into(),
            &tetrahedra.map_or(JsValue::UNDEFINED, Into::into),
        );
        // A function that throws stops the work, too.
        let goes_on = self.progress.apply(&JsValue::UNDEFINED, &numbers).is_ok_and(|stop| stop.is_falsy());
        self.stopped |= !goes_on;
    }

    fn count(&mut self, stage: &str, done: u64, total: u64) {
        self.tell(stage, done, total, None);
    }

    fn begin(&mut self, stage: &str) -> Result<(), WebError> {
        self.count(stage, 0, 1);
        if self.stopped { Err(BuildError::Stopped.into()) } else { Ok(()) }
    }

    fn step(&mut self, step: &BuildProgress) -> ControlFlow<()> {
        self.tell(step.stage, step.done, step.total, step.tetrahedra);
        if self.stopped { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// Points without cells go with insertion alone.
fn expect_points(mesh: &TetMesh, config: &BuildConfig, name: &str) -> Result<(), WebError> {
    if !config.construction.method().keeps_the_mesh() {
        return Ok(());
    }
    if mesh.positions.is_empty() {
        return Err(bad_mesh(name, &MeshError::Empty));
    }
    let what = "there are points but no tetrahedra; method \"insert\" with kind \"vertex\" makes an MT of points alone";
    Err(WebError::new("bad-mesh", format!("{name}: {what}")))
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct InfoObject<'a> {
    format: &'static str,
    points: f64,
    tetrahedra: f64,
    dims: Option<[u32; 3]>,
    bounds: Option<[f64; 6]>,
    fields: Vec<FieldObject<'a>>,
    memory: MemoryObject,
}

#[derive(Serialize)]
struct FieldObject<'a> {
    name: &'a str,
    at: &'static str,
    unit: &'a str,
    vector: Option<VectorObject<'a>>,
}

#[derive(Serialize)]
struct VectorObject<'a> {
    name: &'a str,
    component: Option<u8>,
}

#[derive(Serialize)]
struct MemoryObject {
    needed: f64,
    available: f64,
    fits: bool,
}

fn info(survey: &Survey, bounds: Option<Bounds>, needed: u64, available: u64) -> JsInputInfo {
    let at_points = survey.fields.iter().map(|field| field_object("points", field));
    let at_cells = survey.cell_fields.iter().map(|field| field_object("cells", field));
    object(&InfoObject {
        format: survey.format,
        points: survey.points as f64,
        tetrahedra: survey.cells as f64,
        dims: survey.grid.map(|grid| grid.dims),
        bounds: bounds.map(|Bounds { min: [x0, y0, z0], max: [x1, y1, z1] }| [x0, y0, z0, x1, y1, z1]),
        fields: at_points.chain(at_cells).collect(),
        memory: MemoryObject {
            needed: needed as f64,
            available: available as f64,
            fits: needed <= available,
        },
    })
    .unchecked_into()
}

fn field_object<'a>(at: &'static str, field: &'a Field) -> FieldObject<'a> {
    let vector = field.vector.as_ref();
    let vector = vector.map(|part| VectorObject { name: &part.name, component: part.component });
    FieldObject { name: &field.name, at, unit: &field.unit, vector }
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct ReportObject<'a> {
    kind: &'static str,
    method: &'static str,
    criterion: Option<&'static str>,
    vertices: u32,
    tetrahedra: f64,
    base_vertices: u32,
    base_tetrahedra: u32,
    updates: u32,
    depth: u32,
    position_bits: u32,
    repaired: &'a str,
    repair: Option<RepairObject>,
    notes: &'a [String],
    averaged: Vec<AveragedObject<'a>>,
}

/// What averaging has done to a field, in the words of JavaScript.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct AveragedObject<'a> {
    name: &'a str,
    #[serde(skip_serializing_if = "str::is_empty")]
    unit: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    time: Option<f64>,
    is_label: bool,
    input: &'a Extremes,
    points: &'a Extremes,
    difference: &'a Difference,
}

impl<'a> From<&'a AveragedField> for AveragedObject<'a> {
    fn from(field: &'a AveragedField) -> Self {
        let AveragedField { name, unit, time, is_label, input, points, difference } = field;
        let (time, is_label) = (*time, *is_label);
        Self { name, unit, time, is_label, input, points, difference }
    }
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct RepairObject {
    level: &'static str,
    weld_distance: f64,
    merged_points: usize,
    welded_points: usize,
    differing_values: usize,
    collapsed_tetrahedra: usize,
    duplicate_tetrahedra: usize,
    turned_tetrahedra: usize,
    flat_tetrahedra: usize,
    unused_points: usize,
    kept: String,
    components: usize,
    non_manifold_edges: usize,
    non_manifold_vertices: usize,
    open_seam_faces: usize,
    weldable_faces: usize,
}

impl RepairObject {
    fn of(level: RepairLevel, done: &RepairReport, found: &MeshFindings) -> Self {
        Self {
            level: level.name(),
            weld_distance: level.weld_distance(),
            merged_points: done.merged_points,
            welded_points: done.welded_points,
            differing_values: done.differing_values,
            collapsed_tetrahedra: done.collapsed_tets,
            duplicate_tetrahedra: done.duplicate_tets,
            turned_tetrahedra: done.turned_tets,
            flat_tetrahedra: done.flat_tets,
            unused_points: done.unused_points,
            kept: found.to_string(),
            components: found.components,
            non_manifold_edges: found.non_manifold_edges,
            non_manifold_vertices: found.non_manifold_vertices,
            open_seam_faces: found.open_seam_faces,
            weldable_faces: found.weldable_faces,
        }
    }
}

/// What is said of how the input was taken.
struct Said {
    repaired: String,
    repair: Option<RepairObject>,
    notes: Vec<String>,
    averaged: Vec<AveragedField>,
}

fn result(
    bytes: &[u8],
    config: &BuildConfig,
    summary: &BuildSummary,
    Said { repaired, repair, notes, averaged }: Said,
) -> JsBuilt {
    let construction = config.construction;
    let report = object(&ReportObject {
        kind: construction.kind().name(),
        method: construction.method().name(),
        criterion: construction.criterion().map(builder::BuildCriterion::name),
        vertices: summary.vertices,
        tetrahedra: summary.tetrahedra as f64,
        base_vertices: summary.base_vertices,
        base_tetrahedra: summary.base_tetrahedra,
        updates: summary.updates,
        depth: summary.depth,
        position_bits: summary.position_bits,
        repaired: &repaired,
        repair,
        notes: &notes,
        averaged: averaged.iter().map(AveragedObject::from).collect(),
    });
    let built = Object::new();
    for (name, value) in [("bytes", Uint8Array::from(bytes).into()), ("report", report)] {
        // Setting a property on a fresh ordinary object cannot fail.
        let _ = Reflect::set(&built, &name.into(), &value);
    }
    built.unchecked_into()
}

fn object(described: &impl Serialize) -> JsValue {
    serde_wasm_bindgen::to_value(described).unwrap_or_default()
}

fn no_file() -> WebError {
    WebError::new("bad-source", "no file is given".to_owned())
}

fn no_memory(survey: &Survey, needed: u64, memory: u64) -> WebError {
    let [needed, memory] = [needed, memory].map(megabytes);
    let remedy = "choose fewer fields, or use the command `tetralod build`";
    WebError::new(
        "memory",
        format!(
            "building {} tetrahedra needs about {needed} MB of memory, but there are {memory} MB; {remedy}",
            survey.cells
        ),
    )
}

fn megabytes(bytes: u64) -> u64 {
    bytes.div_ceil(1_000_000)
}

fn bad_mesh(name: &str, error: &MeshError) -> WebError {
    WebError::new("bad-mesh", format!("{name}: {error}"))
}

/// An error of the builder with the name of the file, where it is about what that contains.
fn in_input(name: &str, error: &BuildError) -> WebError {
    let WebError { code, message } = refused(error);
    WebError::new(code, if code == "bad-mesh" { format!("{name}: {message}") } else { message })
}

/// An error of the builder with the option of the page that helps.
fn refused(error: &BuildError) -> WebError {
    let option = error.remedy().map(|remedy| format!(" (option {})", options_of(remedy)));
    WebError::new(error.code(), format!("{error}{}", option.unwrap_or_default()))
}

/// The options of the page that do what a remedy says.
fn options_of(remedy: Remedy) -> &'static str {
    match remedy {
        Remedy::Insert | Remedy::Decimate => "`method`",
        Remedy::Field => "`fields`",
        Remedy::CellsToPoints => "`cellToPoint`",
        Remedy::FieldTolerance => "`fieldTolerance` or `lossless`",
        Remedy::PositionTolerance => "`positionTolerance`",
        Remedy::PositionBits => "`positionBits`",
    }
}

//! What JavaScript gets: plain objects and typed arrays that own their memory.

use crate::bench::BenchReport;
use crate::mt::FieldInfo;
use crate::mt::MtInfo;
use crate::refine::RefineStats;
use crate::session::Progress;
use crate::view::IsoSurface;
use crate::view::MeshView;
use js_sys::Float32Array;
use js_sys::Object;
use js_sys::Reflect;
use js_sys::Uint32Array;
use serde::Serialize;
use wasm_bindgen::JsCast;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = r#"
/** How much of a file has been decoded. */
export interface Progress {
  /** Whether the base mesh is there, so that meshes can be asked for. */
  ready: boolean;
  /** Whether the whole file is there. */
  complete: boolean;
  /** Bytes taken in. */
  bytes: number;
  /** Bytes of the whole file, as soon as that is known. */
  total: number | undefined;
  /** Updates decoded; `info.updates` is how many there will be. */
  updates: number;
}

/** A scalar field of the volume. */
export interface FieldInfo {
  name: string;
  /** Smallest and largest value over the reference mesh. */
  min: number;
  max: number;
  /** Bits that a value takes on its lattice. */
  bits: number;
}

/** What is known of a volume as soon as it is open. */
export interface MtInfo {
  /** The kind of Multi-Tessellation: what its updates are. */
  kind: "edge" | "vertex" | "explicit";
  fields: FieldInfo[];
  /** A box that holds every mesh of the volume, and may be larger: `[x0, y0, z0, x1, y1, z1]` in model units. */
  bounds: number[];
  /** Size of the reference mesh, the finest one. */
  vertices: number;
  tetrahedra: number;
  /** Updates between the base mesh and the reference mesh. */
  updates: number;
}

/** What a refinement did and how good the mesh is now. */
export interface CoreStats {
  /** Size of the current mesh. */
  vertices: number;
  tetrahedra: number;
  /** Updates that are applied in the current mesh. */
  applied: number;
  /** Updates applied and undone by this call. */
  refined: number;
  coarsened: number;
  /** Guaranteed largest error where it counts, in field units, and relative to the field's range. */
  errorBound: number;
  relativeErrorBound: number;
  /** False where `maxTets`, or data that has not arrived yet, kept the mesh from what was asked for. */
  satisfied: boolean;
}

/** A conforming tetrahedral mesh with one value per vertex. */
export interface Mesh {
  /** Three coordinates a vertex. */
  positions: Float32Array;
  /** One value a vertex, in field units. */
  field: Float32Array;
  /** Four vertices a tetrahedron, positive: (b - a) x (c - a) . (d - a) > 0. */
  tets: Uint32Array;
  /** Four tetrahedra a tetrahedron: the i-th lies across from its i-th vertex; 0xffffffff at the boundary. */
  neighbors: Uint32Array;
}

/** Triangles of an isosurface. */
export interface IsoSurface {
  /** Three coordinates a vertex. */
  positions: Float32Array;
  /** Three components a vertex, of unit length. */
  normals: Float32Array;
  /** Three vertices a triangle. */
  indices: Uint32Array;
}
"#;

#[wasm_bindgen]
extern "C" {
    /// The outcome of a benchmark as `tetralod bench --json` gives it.
    #[wasm_bindgen(typescript_type = "object")]
    pub type JsBench;
    /// Decoding progress as a plain object.
    #[wasm_bindgen(typescript_type = "Progress")]
    pub type JsProgress;
    /// What is known of the MT, or `undefined`.
    #[wasm_bindgen(typescript_type = "MtInfo | undefined")]
    pub type JsInfo;
    /// The outcome of a refinement as a plain object.
    #[wasm_bindgen(typescript_type = "CoreStats")]
    pub type JsStats;
    /// A mesh as typed arrays.
    #[wasm_bindgen(typescript_type = "Mesh")]
    pub type JsMesh;
    /// A surface as typed arrays.
    #[wasm_bindgen(typescript_type = "IsoSurface")]
    pub type JsIsoSurface;
}

#[derive(Serialize)]
struct ProgressObject {
    ready: bool,
    complete: bool,
    bytes: f64,
    total: Option<f64>,
    updates: u32,
}

#[derive(Serialize)]
struct FieldObject<'a> {
    name: &'a str,
    min: f64,
    max: f64,
    bits: u32,
}

#[derive(Serialize)]
struct InfoObject<'a> {
    kind: &'static str,
    fields: Vec<FieldObject<'a>>,
    bounds: [f64; 6],
    vertices: u32,
    tetrahedra: u32,
    updates: u32,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct StatsObject {
    vertices: u32,
    tetrahedra: u32,
    applied: f64,
    refined: f64,
    coarsened: f64,
    error_bound: f64,
    relative_error_bound: f64,
    satisfied: bool,
}

/// `progress` for JavaScript.
pub fn progress(progress: &Progress) -> JsProgress {
    let Progress { ready, complete, bytes, total, updates } = *progress;
    let total = total.map(|total| total as f64);
    plain(&ProgressObject { ready, complete, bytes: bytes as f64, total, updates })
}

/// `info` for JavaScript.
pub fn info(info: &MtInfo) -> JsInfo {
    let kind = info.kind.name();
    let MtInfo { vertices, tetrahedra, updates, .. } = *info;
    let fields = info.fields.iter().map(field).collect();
    plain(&InfoObject { kind, fields, bounds: bounds(info), vertices, tetrahedra, updates })
}

/// The box of the position lattice: it holds every mesh of the MT.
fn bounds(info: &MtInfo) -> [f64; 6] {
    let [x0, y0, z0] = info.lattice.origin;
    let [x1, y1, z1] = info.lattice.point([1 << info.lattice.bits; 3]);
    [x0, y0, z0, x1, y1, z1]
}

fn field(field: &FieldInfo) -> FieldObject<'_> {
    FieldObject { name: &field.name, min: field.min, max: field.max, bits: field.bits }
}

/// `stats` for JavaScript; `field` is the one that the errors speak of.
pub fn stats(stats: &RefineStats, field: &FieldInfo) -> JsStats {
    let RefineStats { vertices, tetrahedra, applied, refined, coarsened, error_bound, satisfied, .. } =
        *stats;
    plain(&StatsObject {
        vertices,
        tetrahedra,
        applied: f64::from(applied),
        refined: refined as f64,
        coarsened: coarsened as f64,
        error_bound: error_bound * field.range(),
        relative_error_bound: error_bound,
        satisfied,
    })
}

/// A copy of `mesh` outside wasm memory.
pub fn mesh(mesh: &MeshView<'_>) -> JsMesh {
    arrays([
        ("positions", floats(mesh.positions.as_flattened())),
        ("field", floats(mesh.field)),
        ("tets", integers(mesh.tets.as_flattened())),
        ("neighbors", integers(mesh.neighbors.as_flattened())),
    ])
}

/// A copy of `surface` outside wasm memory.
pub fn iso_surface(surface: &IsoSurface) -> JsIsoSurface {
    arrays([
        ("positions", floats(surface.positions.as_flattened())),
        ("normals", floats(surface.normals.as_flattened())),
        ("indices", integers(surface.indices.as_flattened())),
    ])
}

fn floats(values: &[f32]) -> JsValue {
    Float32Array::from(values).into()
}

fn integers(values: &[u32]) -> JsValue {
    Uint32Array::from(values).into()
}

fn arrays<T: JsCast, const N: usize>(members: [(&str, JsValue); N]) -> T {
    let object = Object::new();
    for (name, array) in members {
        // Setting a property on a fresh ordinary object cannot fail.
        let _ = Reflect::set(&object, &name.into(), &array);
    }
    object.unchecked_into()
}

#[derive(Serialize)]
struct Rate {
    #[serde(skip_serializing_if = "Option::is_none")]
    updates_per_second: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    tets_per_second: Option<f64>,
}

#[derive(Serialize)]
struct BenchObject {
    updates: u32,
    tetrahedra: u32,
    runs: u32,
    decode: Rate,
    refine: Rate,
    coarsen: Rate,
    isosurface: Rate,
    coherent: CoherentObject,
}

#[derive(Serialize)]
struct CoherentObject {
    #[serde(rename = "box")]
    roi: WalkObject,
    iso: WalkObject,
    view: WalkObject,
}

#[derive(Serialize)]
struct WalkObject {
    median_ms: f64,
    p95_ms: f64,
    cold_ms: f64,
}

fn walk(walk: &crate::bench::Coherent) -> WalkObject {
    WalkObject { median_ms: walk.median_ms, p95_ms: walk.p95_ms, cold_ms: walk.cold_ms }
}

/// `report` with the names of `tetralod bench --json`.
pub fn bench(report: &BenchReport) -> JsBench {
    let updates = |rate| Rate { updates_per_second: Some(rate), tets_per_second: None };
    plain(&BenchObject {
        updates: report.updates,
        tetrahedra: report.tetrahedra,
        runs: report.runs,
        decode: updates(report.decode_updates),
        refine: Rate { tets_per_second: Some(report.refine_tets), ..updates(report.refine_updates) },
        coarsen: updates(report.coarsen_updates),
        isosurface: Rate { updates_per_second: None, tets_per_second: Some(report.isosurface_tets) },
        coherent: CoherentObject {
            roi: walk(&report.coherent.roi),
            iso: walk(&report.coherent.iso),
            view: walk(&report.coherent.view),
        },
    })
}

/// Numbers, texts and lists of them always convert; `undefined` would stand for a mistake here.
fn plain<T: JsCast>(value: &impl Serialize) -> T {
    serde_wasm_bindgen::to_value(value).unwrap_or(JsValue::UNDEFINED).unchecked_into()
}

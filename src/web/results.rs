//! What JavaScript gets: plain objects and typed arrays that own their memory.

use super::options::Asked;
use crate::bench::BenchReport;
use crate::bench::Coherent;
use crate::mt::MeshChanges;
use crate::mt::MtInfo;
use crate::refine::RefineStats;
use crate::session::Progress;
use crate::view::IsoSurface;
use crate::view::MeshView;
use js_sys::Array;
use js_sys::Float32Array;
use js_sys::Object;
use js_sys::Reflect;
use js_sys::Uint32Array;
use std::ops::Range;
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
  /** Of a file that is fetched in parts: how its blocks stand. */
  blocks?: BlockProgress;
}

/** A scalar field of the volume. */
export interface FieldInfo {
  name: string;
  /** Smallest and largest value over the reference mesh. */
  min: number;
  max: number;
  /** Bits that a value takes on its lattice. */
  bits: number;
  /** The unit of the values; empty if it is not known. */
  unit: string;
  /** The time that the values are of. Time steps of one field are fields of one name. */
  time: number | undefined;
  /** Which component of which vector or tensor the field is, from 0, if it is one; without a number its length. */
  vector: { name: string; component: number | undefined } | undefined;
  /** The error that is left in the reference mesh, in field units: what storing it rounds off. No bound is smaller. */
  floor: number;
}

/** How the blocks of a file stand of which only those come that are needed. */
export interface BlockProgress {
  /** Blocks of the file. */
  all: number;
  /** Blocks that are here. */
  here: number;
  /** Blocks that the request needs, as far as the file's index tells. */
  needed: number;
  /** Those of them that are not fetched because there is no room for them. */
  leftOut: number;
  /** Bytes of memory that the blocks take. */
  bytes: number;
}

/** What is known of a volume as soon as it is open. */
export interface MtInfo {
  /** The kind of Multi-Tessellation: what its updates are. */
  kind: "half-edge" | "edge" | "vertex" | "explicit";
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
  /** Updates that were applied only because others depend on them, and tetrahedra and updates that were looked at. */
  forced: number;
  judged: number;
  /**
   * Guaranteed largest error where it counts, in field units, and relative to the field's range: of the needs that ask
   * for an error of the field, the largest.
   */
  errorBound: number;
  relativeErrorBound: number;
  /** The same at the vertices of the input inside the mesh, in field units: `errorBound`, or what rounding leaves. */
  fieldBound: number;
  /** How far the boundary of the mesh is from that of the input at most, in model units. */
  boundaryBound: number;
  /**
   * The error that is guaranteed for each need: in field units, in pixels for views, of colour and opacity for transfer
   * functions. In the order of the request, `outside` of a view behind it. Empty until `done`.
   */
  bounds: number[];
  /** How often an error exceeds what was asked for, at most; not above 1 if the request is satisfied. */
  excess: number;
  /** False where a budget, or data that has not arrived yet, kept the mesh from what was asked for. */
  satisfied: boolean;
  /** Whether the mesh is not yet what was asked for because data is on its way. */
  missing: boolean;
  /** False while there is more to do: only in the steps of `refineSteps`, and the bounds are not known then. */
  done: boolean;
}

/**
 * Where a mesh differs from the one that was handed out before: ranges `[start, end, start, end, …]` of vertices and of
 * tetrahedra, ascending. What lies beyond the ends of the arrays is gone. Meshes are numbered as they are handed out,
 * whole or as deltas; number 0 is the one without tetrahedra.
 */
export interface MeshChanges {
  /** The number of the mesh that was handed out before. */
  from: number;
  /** The number of this one. */
  to: number;
  vertices: Uint32Array;
  tets: Uint32Array;
}

/** Only what has changed in a mesh. `applyChanges` makes the mesh of it. */
export interface MeshDelta {
  /** Size of the mesh. */
  vertexCount: number;
  tetCount: number;
  changes: MeshChanges;
  /** The arrays of {@link Mesh}, of which only the ranges are there, one behind the other. */
  positions: Float32Array;
  field: Float32Array;
  tets: Uint32Array;
  neighbors: Uint32Array;
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
  /** Where this mesh differs from the one that was handed out before. */
  changes: MeshChanges;
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
    /// What has changed in a mesh, as typed arrays.
    #[wasm_bindgen(typescript_type = "MeshDelta")]
    pub type JsDelta;
    /// A surface as typed arrays.
    #[wasm_bindgen(typescript_type = "IsoSurface")]
    pub type JsIsoSurface;
}

/// `progress` for JavaScript.
pub fn progress(progress: &Progress) -> JsProgress {
    let Progress { ready, complete, bytes, total, updates } = *progress;
    object(&[
        ("ready", ready.into()),
        ("complete", complete.into()),
        ("bytes", (bytes as f64).into()),
        ("total", total.map(|total| total as f64).into()),
        ("updates", updates.into()),
    ])
}

/// `info` for JavaScript.
pub fn info(info: &MtInfo) -> JsInfo {
    let fields: Array = (0..info.fields.len()).map(|index| field(info, index)).collect();
    object(&[
        ("kind", info.kind.name().into()),
        ("fields", fields.into()),
        ("bounds", list(&bounds(info))),
        ("vertices", info.vertices.into()),
        ("tetrahedra", info.tetrahedra.into()),
        ("updates", info.updates.into()),
    ])
}

/// The box of the position lattice: it holds every mesh of the MT.
fn bounds(info: &MtInfo) -> [f64; 6] {
    let [x0, y0, z0] = info.lattice.origin;
    let [x1, y1, z1] = info.lattice.point([1 << info.lattice.bits; 3]);
    [x0, y0, z0, x1, y1, z1]
}

fn field(info: &MtInfo, index: usize) -> Object {
    let field = &info.fields[index];
    let vector = field.vector.as_ref().map(|part| -> JsValue {
        let vector: Object =
            object(&[("name", part.name.as_str().into()), ("component", part.component.into())]);
        vector.into()
    });
    object(&[
        ("name", field.name.as_str().into()),
        ("min", field.min.into()),
        ("max", field.max.into()),
        ("bits", field.bits.into()),
        ("unit", field.unit.as_str().into()),
        ("time", field.time.into()),
        ("vector", vector.into()),
        ("floor", (info.floor(index) * field.range()).into()),
    ])
}

/// `stats` for JavaScript, in the units of what was asked for.
pub fn stats(stats: &RefineStats, info: &MtInfo, asked: &Asked) -> JsStats {
    let field = &info.fields[asked.field];
    let bounds: Vec<f64> = stats.bounds.iter().zip(&asked.units).map(|(bound, unit)| bound * unit).collect();
    object(&[
        ("vertices", stats.vertices.into()),
        ("tetrahedra", stats.tetrahedra.into()),
        ("applied", stats.applied.into()),
        ("refined", (stats.refined as f64).into()),
        ("coarsened", (stats.coarsened as f64).into()),
        ("forced", (stats.forced as f64).into()),
        ("judged", (stats.judged as f64).into()),
        ("errorBound", (stats.error_bound * field.range()).into()),
        ("relativeErrorBound", stats.error_bound.into()),
        ("fieldBound", info.field_bound(asked.field, stats.error_bound).into()),
        ("boundaryBound", info.boundary_bound(stats.error_bound).into()),
        ("bounds", list(&bounds)),
        ("excess", stats.excess.into()),
        ("satisfied", stats.satisfied.into()),
        ("missing", stats.missing.into()),
        ("done", stats.done.into()),
    ])
}

/// What has changed in a mesh since one was handed out before, and the number of this one.
pub struct Changes {
    pub ranges: MeshChanges,
    pub to: u32,
}

/// A copy of `mesh` outside wasm memory.
pub fn mesh(mesh: &MeshView<'_>, changes: &Changes) -> JsMesh {
    object(&[
        ("positions", floats(mesh.positions.as_flattened())),
        ("field", floats(mesh.field)),
        ("tets", integers(mesh.tets.as_flattened())),
        ("neighbors", integers(mesh.neighbors.as_flattened())),
        ("changes", ranges(changes)),
    ])
}

/// A copy of those parts of `mesh` that have changed.
pub fn delta(mesh: &MeshView<'_>, changes: &Changes) -> JsDelta {
    let MeshChanges { vertices, tets } = &changes.ranges;
    object(&[
        ("vertexCount", mesh.positions.len().into()),
        ("tetCount", mesh.tets.len().into()),
        ("changes", ranges(changes)),
        ("positions", floats(&parts(mesh.positions.as_flattened(), vertices, 3))),
        ("field", floats(&parts(mesh.field, vertices, 1))),
        ("tets", integers(&parts(mesh.tets.as_flattened(), tets, 4))),
        ("neighbors", integers(&parts(mesh.neighbors.as_flattened(), tets, 4))),
    ])
}

fn ranges(changes: &Changes) -> JsValue {
    let flat = |ranges: &[Range<u32>]| {
        integers(&ranges.iter().flat_map(|range| [range.start, range.end]).collect::<Vec<_>>())
    };
    let MeshChanges { vertices, tets } = &changes.ranges;
    let all: Object = object(&[
        ("from", (changes.to - 1).into()),
        ("to", changes.to.into()),
        ("vertices", flat(vertices)),
        ("tets", flat(tets)),
    ]);
    all.into()
}

/// The ranges of items of `size` numbers, one behind the other.
fn parts<T: Copy>(numbers: &[T], ranges: &[Range<u32>], size: usize) -> Vec<T> {
    let mut parts = Vec::with_capacity(size * ranges.iter().map(Range::len).sum::<usize>());
    for range in ranges {
        parts.extend_from_slice(&numbers[size * range.start as usize..size * range.end as usize]);
    }
    parts
}

/// A copy of `surface` outside wasm memory.
pub fn iso_surface(surface: &IsoSurface) -> JsIsoSurface {
    object(&[
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

fn list(values: &[f64]) -> JsValue {
    values.iter().map(|value| JsValue::from(*value)).collect::<Array>().into()
}

/// A plain object with these members.
pub fn object<T: JsCast>(members: &[(&str, JsValue)]) -> T {
    let object = Object::new();
    for (name, value) in members {
        // Setting a property on a fresh ordinary object cannot fail.
        let _ = Reflect::set(&object, &(*name).into(), value);
    }
    object.unchecked_into()
}

/// `report` with the names of `tetralod bench --json`.
pub fn bench(report: &BenchReport) -> JsBench {
    let rates = |updates: Option<f64>, tets: Option<f64>| -> JsValue {
        let rate = |name, rate: Option<f64>| rate.map(|rate| (name, JsValue::from(rate)));
        let given = [rate("updates_per_second", updates), rate("tets_per_second", tets)];
        let rates: Object = object(&given.into_iter().flatten().collect::<Vec<_>>());
        rates.into()
    };
    let walks = &report.coherent;
    let coherent: Object =
        object(&[("box", walk(&walks.roi)), ("iso", walk(&walks.iso)), ("view", walk(&walks.view))]);
    object(&[
        ("updates", report.updates.into()),
        ("tetrahedra", report.tetrahedra.into()),
        ("runs", report.runs.into()),
        ("decode", rates(Some(report.decode_updates), None)),
        ("refine", rates(Some(report.refine_updates), Some(report.refine_tets))),
        ("coarsen", rates(Some(report.coarsen_updates), None)),
        ("isosurface", rates(None, Some(report.isosurface_tets))),
        ("coherent", coherent.into()),
    ])
}

fn walk(walk: &Coherent) -> JsValue {
    let Coherent { median_ms, p95_ms, cold_ms, .. } = *walk;
    let walk: Object =
        object(&[("median_ms", median_ms.into()), ("p95_ms", p95_ms.into()), ("cold_ms", cold_ms.into())]);
    walk.into()
}

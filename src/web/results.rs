//! What JavaScript gets: plain objects, and typed arrays that own their memory.

use super::options::Asked;
use crate::mt::{FieldInfo, MtInfo};
use crate::refine::RefineStats;
use crate::session::{BlockProgress, Progress, Session};
use crate::view::{IsoSurface, MeshView};
use js_sys::{Array, Float32Array, Float64Array, Object, Reflect, Uint32Array};
use serde::Serialize;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsCast, JsValue};

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = include_str!("results.d.ts");

#[wasm_bindgen]
extern "C" {
    /// Decoding progress as a plain object.
    #[wasm_bindgen(typescript_type = "Progress")]
    pub type JsProgress;
    /// How the blocks stand.
    #[wasm_bindgen(typescript_type = "BlockProgress")]
    pub type JsBlocks;
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

#[derive(Serialize)]
struct ProgressObject {
    ready: bool,
    complete: bool,
    bytes: f64,
    total: Option<f64>,
    updates: u32,
}

/// `progress` for JavaScript.
pub fn progress(progress: &Progress) -> JsProgress {
    let Progress { ready, complete, bytes, total, updates } = *progress;
    let (bytes, total) = (bytes as f64, total.map(|total| total as f64));
    value(&ProgressObject { ready, complete, bytes, total, updates })
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct BlocksObject {
    all: u32,
    here: u32,
    needed: u32,
    left_out: u32,
    bytes: f64,
}

/// How the blocks stand, for JavaScript.
pub fn blocks(progress: &BlockProgress) -> JsBlocks {
    let BlockProgress { blocks: all, here, needed, left_out, bytes } = *progress;
    value(&BlocksObject { all, here, needed, left_out, bytes: bytes as f64 })
}

#[derive(Serialize)]
struct InfoObject<'a> {
    kind: &'static str,
    fields: Vec<FieldObject<'a>>,
    /// The box of the position lattice: it holds every mesh of the MT.
    bounds: [f64; 6],
    vertices: u32,
    tetrahedra: u32,
    updates: u32,
}

#[derive(Serialize)]
struct FieldObject<'a> {
    name: &'a str,
    min: f64,
    max: f64,
    bits: u32,
    unit: &'a str,
    time: Option<f64>,
    vector: Option<VectorObject<'a>>,
    floor: f64,
}

#[derive(Serialize)]
struct VectorObject<'a> {
    name: &'a str,
    component: Option<u8>,
}

/// What is known of the MT of a session, for JavaScript.
pub fn info(session: &Session) -> Option<JsInfo> {
    let info = session.info()?;
    let described = describe(info);
    let fields = Reflect::get(described.as_ref(), &"fields".into()).unwrap_or_default();
    for (place, field) in Array::from(&fields).iter().enumerate() {
        let histogram = session.decoder().histogram(place);
        set(&field, "histogram", &histogram.map_or(JsValue::NULL, |shares| doubles(&shares)));
        let curve = session.bytes_by_error(place);
        let list = || Float64Array::new_with_length(curve.len() as u32);
        let (errors, bytes) = (list(), list());
        for (at, point) in (0..).zip(&curve) {
            errors.set_index(at, point.error_in_units(&info.fields[place]));
            bytes.set_index(at, point.bytes as f64);
        }
        let curve: JsValue = object(&[("errors", errors.into()), ("bytes", bytes.into())]);
        set(&field, "curve", &curve);
    }
    Some(described)
}

fn describe(info: &MtInfo) -> JsInfo {
    let [x0, y0, z0] = info.lattice.origin;
    let [x1, y1, z1] = info.lattice.point([1 << info.lattice.bits; 3]);
    value(&InfoObject {
        kind: info.kind.name(),
        fields: (0..info.fields.len()).map(|index| field(info, index)).collect(),
        bounds: [x0, y0, z0, x1, y1, z1],
        vertices: info.vertices,
        tetrahedra: info.tetrahedra,
        updates: info.updates,
    })
}

fn field(info: &MtInfo, index: usize) -> FieldObject<'_> {
    let FieldInfo { name, min, max, bits, unit, time, vector, .. } = &info.fields[index];
    let vector = vector.as_ref().map(|part| VectorObject { name: &part.name, component: part.component });
    let floor = info.floor(index) * info.fields[index].range();
    FieldObject { name, min: *min, max: *max, bits: *bits, unit, time: *time, vector, floor }
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct StatsObject {
    vertices: u32,
    tetrahedra: u32,
    applied: u32,
    refined: f64,
    coarsened: f64,
    forced: f64,
    judged: f64,
    error_bound: f64,
    relative_error_bound: f64,
    field_bound: f64,
    boundary_bound: f64,
    bounds: Vec<f64>,
    excess: f64,
    satisfied: bool,
    missing: bool,
    done: bool,
}

/// `stats` for JavaScript, in the units of what was asked for.
pub fn stats(stats: &RefineStats, info: &MtInfo, asked: &Asked) -> JsStats {
    value(&StatsObject {
        vertices: stats.vertices,
        tetrahedra: stats.tetrahedra,
        applied: stats.applied,
        refined: stats.refined as f64,
        coarsened: stats.coarsened as f64,
        forced: stats.forced as f64,
        judged: stats.judged as f64,
        error_bound: stats.error_bound * info.fields[asked.field].range(),
        relative_error_bound: stats.error_bound,
        field_bound: info.field_bound(asked.field, stats.error_bound),
        boundary_bound: info.boundary_bound(stats.error_bound),
        bounds: stats.bounds.iter().zip(&asked.units).map(|(bound, unit)| bound * unit).collect(),
        excess: stats.excess,
        satisfied: stats.satisfied,
        missing: stats.missing,
        done: stats.done,
    })
}

/// A value that serde describes. Numbers are `f64` where they may not fit 32 bits: all else would be refused or a `BigInt`.
pub fn value<T: JsCast>(described: &impl Serialize) -> T {
    serde_wasm_bindgen::to_value(described).unwrap_or_default().unchecked_into()
}

/// Setting a property on a fresh ordinary object cannot fail.
pub fn set(object: &JsValue, name: &str, value: &JsValue) {
    let _ = Reflect::set(object, &name.into(), value);
}

/// The arrays of a mesh; of a set of them, bit `i` is that of the `i`-th.
const ARRAYS: [&str; 4] = ["positions", "field", "tets", "neighbors"];

/// A copy of the `wanted` arrays of `mesh` outside wasm memory.
pub fn mesh_arrays(mesh: &MeshView<'_>, wanted: u32) -> JsMesh {
    let arrays: JsMesh = object(&[]);
    put_arrays(arrays.as_ref(), wanted, |at| match at {
        0 => floats(mesh.positions.as_flattened()),
        1 => floats(mesh.field),
        2 => integers(mesh.tets.as_flattened()),
        _ => integers(mesh.neighbors.as_flattened()),
    });
    arrays
}

/// Puts the `wanted` ones of the arrays of a mesh into `object`.
pub fn put_arrays(object: &JsValue, wanted: u32, array: impl Fn(usize) -> JsValue) {
    for (at, name) in ARRAYS.iter().enumerate().filter(|(at, _)| wanted >> at & 1 == 1) {
        set(object, name, &array(at));
    }
}

/// A copy of `surface` outside wasm memory.
pub fn iso_surface(surface: &IsoSurface) -> JsIsoSurface {
    object(&[
        ("positions", floats(surface.positions.as_flattened())),
        ("normals", floats(surface.normals.as_flattened())),
        ("indices", integers(surface.indices.as_flattened())),
    ])
}

pub fn floats(values: &[f32]) -> JsValue {
    Float32Array::from(values).into()
}

pub fn doubles(values: &[f64]) -> JsValue {
    Float64Array::from(values).into()
}

pub fn integers(values: &[u32]) -> JsValue {
    Uint32Array::from(values).into()
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

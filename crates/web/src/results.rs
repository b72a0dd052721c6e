//! What JavaScript gets of a session: plain objects, and typed arrays that own their memory.

use crate::arrays::{doubles, integers, list, object, objects, record, set};
use crate::options::Asked;
use crate::stored::Stored;
use tetralod::geom::Bounds;
use tetralod::mesh::{Averaged, Extreme, Extremes, NONE};
use tetralod::mt::{FieldInfo, MtInfo, Regions};
use tetralod::refine::RefineStats;
use tetralod::session::{BlockProgress, Progress, Session};
use tetralod::view::{MeshView, region_color};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = r#"import type { BlockProgress, CoreStats, Mesh, MeshChanges, MeshDelta, MtInfo, Progress } from "./results.js";"#;

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
    #[wasm_bindgen(typescript_type = "Mesh & { changes: MeshChanges }")]
    pub type JsMesh;
    /// What has changed in a mesh, as typed arrays.
    #[wasm_bindgen(typescript_type = "MeshDelta")]
    pub type JsDelta;
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

/// How the blocks stand, for JavaScript.
pub fn blocks(progress: &BlockProgress) -> JsBlocks {
    let BlockProgress { blocks, here, needed, left_out, absent, bytes, missed, .. } = *progress;
    let [all, here, needed, left_out, absent, missed] =
        [blocks, here, needed, left_out, absent, missed].map(f64::from);
    let names = ["all", "here", "needed", "leftOut", "absent", "bytes", "missed"];
    record(&names, &[all, here, needed, left_out, absent, bytes as f64, missed])
}

/// What is known of the MT of a session, for JavaScript.
pub fn info(session: &Session) -> Option<JsInfo> {
    let info = session.info()?;
    let Bounds { min: [x0, y0, z0], max: [x1, y1, z1] } = session.bounds()?;
    let fields = (0..info.fields.len()).map(|index| field(session, info, index));
    Some(object(&[
        ("kind", info.kind.name().into()),
        ("fields", objects(fields)),
        ("bounds", list(&[x0, y0, z0, x1, y1, z1])),
        ("origin", list(&info.single_points().origin)),
        ("vertices", info.vertices.into()),
        ("tetrahedra", (info.tetrahedra as f64).into()),
        ("updates", info.updates.into()),
        ("exactValues", session.decoder().exact_status().name().into()),
        ("regions", session.regions().map_or(JsValue::UNDEFINED, |all| regions(all, info))),
        ("surfaceFirst", session.surface_first(info.first_field()).into()),
        ("firstField", info.first_field().into()),
    ]))
}

fn regions(regions: &Regions, info: &MtInfo) -> JsValue {
    let names = regions.arrays.iter().map(|name| name.as_str().into());
    let all = regions.all.iter().map(|region| {
        let labels: Vec<f64> = region.labels.iter().map(|&label| label as f64).collect();
        let corners = region.bounds.map(|corner| info.lattice.point(corner));
        let [r, g, b] = region_color(region.color);
        object(&[
            ("name", region.name.as_str().into()),
            ("labels", list(&labels)),
            ("tetrahedra", (region.tetrahedra as f64).into()),
            ("volume", region.volume.into()),
            ("bounds", list(corners.as_flattened())),
            ("color", format!("#{r:02x}{g:02x}{b:02x}").into()),
        ])
    });
    object(&[("arrays", objects(names)), ("deviation", regions.deviation.into()), ("all", objects(all))])
}

fn field(session: &Session, info: &MtInfo, index: usize) -> JsValue {
    let FieldInfo { name, min, max, bits, unit, time, vector, is_label, extremes: ends, averaged, .. } =
        &info.fields[index];
    let vector = vector.as_ref().map(|part| {
        object(&[("name", part.name.as_str().into()), ("component", part.component.map(f64::from).into())])
    });
    let histogram = session.decoder().histogram(index).map_or(JsValue::NULL, |shares| doubles(&shares));
    let curve = session.bytes_by_error(index);
    let errors: Vec<f64> = curve.iter().map(|point| point.error_in_units(&info.fields[index])).collect();
    let bytes: Vec<f64> = curve.iter().map(|point| point.bytes as f64).collect();
    let single = info.fields[index].single_values();
    object(&[
        ("name", name.as_str().into()),
        ("min", (*min).into()),
        ("max", (*max).into()),
        ("bits", (*bits).into()),
        ("offset", single.offset.into()),
        ("scale", single.unit.into()),
        ("unit", unit.as_str().into()),
        ("time", (*time).into()),
        ("vector", vector.unwrap_or(JsValue::UNDEFINED)),
        ("isLabel", (*is_label).into()),
        ("floor", (info.floor(index) * info.fields[index].range()).into()),
        ("histogram", histogram),
        ("extremes", ends.as_ref().map_or(JsValue::UNDEFINED, extremes)),
        ("averaged", averaged.as_ref().map_or(JsValue::UNDEFINED, of_cells)),
        ("isovalue", session.first_isovalue(index).into()),
        ("curve", object(&[("errors", doubles(&errors)), ("bytes", doubles(&bytes))])),
    ])
}

fn extremes(extremes: &Extremes) -> JsValue {
    let [min, max] = extremes.both().map(|Extreme { value, place, cell, part }| {
        object(&[
            ("value", (*value).into()),
            ("place", list(place)),
            ("cell", (*cell).into()),
            ("part", part.as_deref().into()),
        ])
    });
    object(&[("min", min), ("max", max)])
}

/// What averaging has done to a field at cells.
fn of_cells(Averaged { input, difference }: &Averaged) -> JsValue {
    let difference = record(&["rms", "largest"], &[difference.rms, difference.largest]);
    object(&[("input", extremes(input)), ("difference", difference)])
}

/// The numbers among the members of the object for [`RefineStats`].
const STATS: [&str; 12] = [
    "vertices",
    "tetrahedra",
    "applied",
    "refined",
    "coarsened",
    "forced",
    "judged",
    "errorBound",
    "relativeErrorBound",
    "fieldBound",
    "boundaryBound",
    "excess",
];

/// `stats` for JavaScript, in the units of what was asked for.
pub fn stats(stats: &RefineStats, info: &MtInfo, asked: &Asked) -> JsStats {
    let numbers = [
        f64::from(stats.vertices),
        f64::from(stats.tetrahedra),
        f64::from(stats.applied),
        stats.refined as f64,
        stats.coarsened as f64,
        stats.forced as f64,
        stats.judged as f64,
        stats.error_bound * info.fields[asked.field].range(),
        stats.error_bound,
        info.field_bound(asked.field, stats.error_bound),
        info.boundary_bound(stats.error_bound),
        stats.excess,
    ];
    let js: JsStats = record(&STATS, &numbers);
    let bounds: Vec<f64> = stats.bounds.iter().zip(&asked.units).map(|(bound, unit)| bound * unit).collect();
    set(js.as_ref(), "bounds", &list(&bounds));
    for (name, answer) in [("satisfied", stats.satisfied), ("missing", stats.missing), ("done", stats.done)] {
        set(js.as_ref(), name, &answer.into());
    }
    js
}

/// The arrays of a mesh; of a set of them, bit `i` is that of the `i`-th.
const ARRAYS: [&str; 4] = ["positions", "field", "tets", "neighbors"];

/// A copy of the `wanted` arrays of `mesh` outside wasm memory.
pub fn mesh_arrays(mesh: &MeshView<'_>, stored: &Stored, wanted: u32) -> JsMesh {
    let shown = shown_tets(mesh);
    let mesh = shown.as_ref().map_or(*mesh, |[tets, neighbors]| MeshView { tets, neighbors, ..*mesh });
    let arrays: JsMesh = object(&[]);
    stored.put(arrays.as_ref());
    put_arrays(arrays.as_ref(), wanted, |at| match at {
        0 => stored.positions(mesh.positions.iter().copied()),
        1 => stored.values(mesh.field.iter().copied()),
        2 => integers(mesh.tets.as_flattened()),
        _ => integers(mesh.neighbors.as_flattened()),
    });
    arrays
}

/// Tetrahedra and neighbours without those of regions that are not shown; none if all are.
fn shown_tets(mesh: &MeshView<'_>) -> Option<[Vec<[u32; 4]>; 2]> {
    let is_shown = |t: u32| mesh.tets[t as usize][0] != NONE;
    let all = 0..mesh.tets.len() as u32;
    if all.clone().all(is_shown) {
        return None;
    }
    let mut numbers = vec![NONE; mesh.tets.len()];
    (0..).zip(all.clone().filter(|&t| is_shown(t))).for_each(|(number, t)| numbers[t as usize] = number);
    let shown = || all.clone().filter(|&t| is_shown(t)).map(|t| t as usize);
    let number = |n: u32| numbers.get(n as usize).copied().unwrap_or(NONE);
    let neighbors = shown().map(|t| mesh.neighbors[t].map(number)).collect();
    Some([shown().map(|t| mesh.tets[t]).collect(), neighbors])
}

/// Puts the `wanted` ones of the arrays of a mesh into `object`.
pub fn put_arrays(object: &JsValue, wanted: u32, array: impl Fn(usize) -> JsValue) {
    for (at, name) in ARRAYS.iter().enumerate().filter(|(at, _)| wanted >> at & 1 == 1) {
        set(object, name, &array(at));
    }
}

//! A wasm module with the benchmark of the command, for browsers; it is not in the npm package. `cargo xtask bench --browser` sets both side by side.

use serde::Serialize;
use tetralod_bench::{self as bench, BenchReport, Coherent};
use tetralod_web::file::now;
use tetralod_web_options::error::WebError;
use wasm_bindgen::JsCast;
use wasm_bindgen::prelude::wasm_bindgen;

#[wasm_bindgen]
extern "C" {
    /// The outcome of a benchmark as `tetralod bench --json` gives it.
    #[wasm_bindgen(typescript_type = "object")]
    pub type JsBench;
}

/// Times the MT file `bytes` for about `seconds`.
#[wasm_bindgen(js_name = bench)]
pub fn run(bytes: &[u8], seconds: f64) -> Result<JsBench, WebError> {
    let report = bench::run(bytes, &mut || now() / 1000.0, seconds)?;
    Ok(described(&report))
}

/// `report` with the names of `tetralod bench --json`.
fn described(report: &BenchReport) -> JsBench {
    let updates = |rate| Rates { updates_per_second: Some(rate), tets_per_second: None };
    let tets = |rate| Rates { updates_per_second: None, tets_per_second: Some(rate) };
    let walks = &report.coherent;
    let described = BenchObject {
        updates: report.updates,
        tetrahedra: report.tetrahedra,
        runs: report.runs,
        decode: updates(report.decode_updates),
        refine: Rates { tets_per_second: Some(report.refine_tets), ..updates(report.refine_updates) },
        coarsen: updates(report.coarsen_updates),
        isosurface: tets(report.isosurface_tets),
        coherent: Walks { r#box: walk(&walks.roi), iso: walk(&walks.iso), view: walk(&walks.view) },
    };
    serde_wasm_bindgen::to_value(&described).unwrap_or_default().unchecked_into()
}

#[derive(Serialize)]
struct BenchObject {
    updates: u32,
    tetrahedra: u32,
    runs: u32,
    decode: Rates,
    refine: Rates,
    coarsen: Rates,
    isosurface: Rates,
    coherent: Walks,
}

#[derive(Serialize)]
struct Rates {
    #[serde(skip_serializing_if = "Option::is_none")]
    updates_per_second: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    tets_per_second: Option<f64>,
}

#[derive(Serialize)]
struct Walks {
    r#box: Walk,
    iso: Walk,
    view: Walk,
}

#[derive(Serialize)]
struct Walk {
    median_ms: f64,
    p95_ms: f64,
    cold_ms: f64,
}

fn walk(walk: &Coherent) -> Walk {
    let Coherent { median_ms, p95_ms, cold_ms, .. } = *walk;
    Walk { median_ms, p95_ms, cold_ms }
}

//! The benchmark of the command line, for the browser: `cargo xtask bench --browser` sets both side by side.

use super::error::WebError;
use super::file::now;
use super::results;
use super::results::JsBench;
use crate::bench;
use wasm_bindgen::prelude::wasm_bindgen;

/// Times the MT file `bytes` for about `seconds`.
#[wasm_bindgen(js_name = bench)]
pub fn run(bytes: &[u8], seconds: f64) -> Result<JsBench, WebError> {
    let report = bench::run(bytes, &mut || now() / 1000.0, seconds)?;
    Ok(results::bench(&report))
}

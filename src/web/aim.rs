//! What both sessions do with options: aim at a mesh, and go there in steps.

use super::callback;
use super::error::WebError;
use super::options;
use super::options::Asked;
use crate::refine::RefineStats;
use crate::refine::View;
use crate::session::Session;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

/// Updates between two looks at the clock: one takes about a microsecond, and so does the clock.
const UPDATES_A_LOOK: f64 = 16.0;

#[wasm_bindgen]
extern "C" {
    /// Milliseconds, finer than `Date` gives them.
    #[wasm_bindgen(js_namespace = performance, js_name = now)]
    pub fn now() -> f64;
}

/// Has `session` aim at what `options` ask for; `camera` is the one of the viewer, if there is one.
pub fn aim(session: &mut Session, options: &JsValue, camera: Option<&View>) -> Result<Asked, WebError> {
    let info = session.info().ok_or_else(WebError::not_ready)?;
    let asked = options::asked(options, info, camera)?;
    session.aim_with(&asked.request, &asked.custom)?;
    session.set_field(asked.field)?;
    Ok(asked)
}

/// Goes on towards what was asked for, for about so many milliseconds or so many updates; each that is
/// made takes those with it that it depends on.
pub fn step(session: &mut Session, milliseconds: f64, updates: f64) -> Result<RefineStats, WebError> {
    let end = if milliseconds == f64::INFINITY { milliseconds } else { now() + milliseconds };
    let mut looked = 0.0;
    let stepped = session.step(&mut |outcome| {
        let done = (outcome.refined + outcome.coarsened) as f64;
        if done - looked >= UPDATES_A_LOOK {
            looked = done;
            if callback::failed() || end.is_finite() && now() >= end {
                return false;
            }
        }
        done < updates
    });
    callback::check()?;
    Ok(stepped?)
}

//! The class that the package's worker holds: one MT being decoded, and its current mesh.

use super::aim;
use super::error::WebError;
use super::options;
use super::options::Asked;
use super::options::RefineOptions;
use super::parts;
use super::results;
use super::results::Changes;
use super::results::JsBlocks;
use super::results::JsDelta;
use super::results::JsInfo;
use super::results::JsIsoSurface;
use super::results::JsMesh;
use super::results::JsProgress;
use super::results::JsStats;
use crate::mt::MtInfo;
use crate::session::Session;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

/// A decoder, its MT and the current mesh.
#[wasm_bindgen]
#[derive(Default)]
pub struct CoreSession {
    session: Session,
    asked: Asked,
    /// Whether the file comes in parts.
    in_parts: bool,
    /// How many meshes have been handed out.
    handed: u32,
}

#[wasm_bindgen]
impl CoreSession {
    /// An empty session for the fields of these names, or for all if none is named. With `room` the file comes in parts:
    /// `wanted` tells which, `take` takes them, and those that are not needed go when they take more bytes than that.
    #[wasm_bindgen(constructor)]
    pub fn new(fields: Vec<String>, room: Option<f64>) -> Self {
        Self { session: parts::session(fields, room), in_parts: room.is_some(), ..Self::default() }
    }

    /// Start, end and priority of each range of bytes that is wanted of a file that comes in parts.
    pub fn wanted(&self) -> Vec<f64> {
        parts::wanted(&self.session)
    }

    /// Takes one of these ranges, or less of it at the end of the file.
    pub fn take(&mut self, start: f64, bytes: &[u8]) -> Result<JsProgress, WebError> {
        let progress = self.session.take(start as u64, bytes)?;
        Ok(results::progress(&progress))
    }

    /// How the blocks stand.
    pub fn blocks(&self) -> JsBlocks {
        results::blocks(&self.session.block_progress())
    }

    /// Takes the next bytes of the file, however they were cut.
    pub fn feed(&mut self, bytes: &[u8]) -> Result<JsProgress, WebError> {
        let progress = self.session.feed(bytes)?;
        Ok(results::progress(&progress))
    }

    /// The file has ended: refuses one that was cut short.
    pub fn finish(&mut self) -> Result<JsProgress, WebError> {
        self.session.finish()?;
        Ok(results::progress(&self.session.progress()))
    }

    /// What is known of the MT; `undefined` until the base mesh is there.
    pub fn info(&self) -> Option<JsInfo> {
        self.session.info().map(results::info)
    }

    /// Changes the current mesh to what `options` asks for, as far as the data has arrived.
    pub fn refine(&mut self, options: &RefineOptions) -> Result<JsStats, WebError> {
        self.aim(options)?;
        self.step(f64::INFINITY, f64::INFINITY)
    }

    /// Tells which mesh is wanted from now on, for `step` to make it.
    pub fn aim(&mut self, options: &RefineOptions) -> Result<(), WebError> {
        self.asked = aim::aim(&mut self.session, options, None)?;
        Ok(())
    }

    /// Goes on towards that mesh for about so many milliseconds or so many updates, whichever comes first.
    pub fn step(&mut self, milliseconds: f64, updates: f64) -> Result<JsStats, WebError> {
        let mut stats = aim::step(&mut self.session, milliseconds, updates)?;
        stats.missing &= parts::is_coming(&self.session, self.in_parts);
        Ok(results::stats(&stats, self.known()?, &self.asked))
    }

    /// The field that `mesh` carries and `isosurface` follows, by name or number.
    #[wasm_bindgen(js_name = setField)]
    pub fn set_field(&mut self, field: &JsValue) -> Result<(), WebError> {
        let index = options::field_index(self.known()?, field)?;
        Ok(self.session.set_field(index)?)
    }

    /// The current mesh, and what has changed in it since `mesh` or `delta` was last called.
    pub fn mesh(&mut self) -> Result<JsMesh, WebError> {
        let changes = self.changes()?;
        Ok(results::mesh(&self.session.view(), &changes))
    }

    /// Of the current mesh only what has changed since `mesh` or `delta` was last called.
    pub fn delta(&mut self) -> Result<JsDelta, WebError> {
        let changes = self.changes()?;
        Ok(results::delta(&self.session.view(), &changes))
    }

    /// The isosurface of the current mesh at `value`, in field units.
    pub fn isosurface(&mut self, value: f64) -> Result<JsIsoSurface, WebError> {
        Ok(results::iso_surface(self.session.isosurface(value)?))
    }

    /// A hash of the current mesh, the same wherever the same request was made.
    pub fn hash(&self) -> String {
        format!("{:016x}", self.session.hash())
    }

    pub(super) fn session_mut(&mut self) -> &mut Session {
        &mut self.session
    }

    /// What has changed since a mesh was last handed out; another one is handed out with it.
    fn changes(&mut self) -> Result<Changes, WebError> {
        self.known()?;
        self.handed += 1;
        Ok(Changes { ranges: self.session.take_changes(), to: self.handed })
    }

    pub(super) fn known(&self) -> Result<&MtInfo, WebError> {
        self.session.info().ok_or_else(WebError::not_ready)
    }
}

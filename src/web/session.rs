//! The class that the package's worker holds: one MT being decoded, and its current mesh.

use super::error::WebError;
use super::options;
use super::options::RefineOptions;
use super::results;
use super::results::JsInfo;
use super::results::JsIsoSurface;
use super::results::JsMesh;
use super::results::JsProgress;
use super::results::JsStats;
use crate::mt::MtInfo;
use crate::session::Session;
use wasm_bindgen::prelude::wasm_bindgen;

/// A decoder, its MT and the current mesh.
#[wasm_bindgen]
#[derive(Default)]
pub struct CoreSession {
    session: Session,
}

#[wasm_bindgen]
impl CoreSession {
    /// An empty session.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        Self::default()
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
        let (request, field) = options::request(options, self.known()?)?;
        self.session.set_field(field)?;
        let stats = self.session.refine(&request)?;
        Ok(results::stats(&stats, &self.known()?.fields[field]))
    }

    /// The field that `mesh` carries and `isosurface` follows.
    #[wasm_bindgen(js_name = setField)]
    pub fn set_field(&mut self, name: &str) -> Result<(), WebError> {
        let index = options::field_index(self.known()?, name)?;
        Ok(self.session.set_field(index)?)
    }

    /// The current mesh.
    pub fn mesh(&mut self) -> Result<JsMesh, WebError> {
        self.known()?;
        Ok(results::mesh(&self.session.view()))
    }

    /// The isosurface of the current mesh at `value`, in field units.
    pub fn isosurface(&mut self, value: f64) -> Result<JsIsoSurface, WebError> {
        Ok(results::iso_surface(self.session.isosurface(value)?))
    }

    /// A hash of the current mesh, the same wherever the same request was made.
    pub fn hash(&self) -> String {
        format!("{:016x}", self.session.hash())
    }

    fn known(&self) -> Result<&MtInfo, WebError> {
        self.session.info().ok_or_else(WebError::not_ready)
    }
}

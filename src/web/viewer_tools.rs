//! What can be got out of the viewer's mesh besides itself.

use super::error::WebError;
use super::options::field_index;
use super::tools::{self, JsIsoSurface, JsProfile, JsSlice, JsStats, JsStreamlines, JsSurface, Way};
use super::viewer::Viewer;
use crate::view::NormalKind;
use wasm_bindgen::prelude::wasm_bindgen;

#[wasm_bindgen]
impl Viewer {
    /// The isosurfaces of the current mesh at some values, as one; with normals of the field's gradient or of the triangles.
    pub fn isosurfaces(&mut self, values: &[f64], smooth: bool) -> Result<JsIsoSurface, WebError> {
        let session = self.file.session_mut();
        session.set_normal_kind(if smooth { NormalKind::Smooth } else { NormalKind::Gradient });
        let stored = self.file.stored()?;
        Ok(tools::iso_surface(self.file.session_mut().isosurfaces(values)?, &stored))
    }

    /// The section of the current mesh with the plane `normal · p = offset`.
    pub fn slice(&mut self, normal: &[f64], offset: f64) -> Result<JsSlice, WebError> {
        let plane = tools::plane(normal, offset)?;
        let stored = self.file.stored()?;
        Ok(tools::section(self.file.session_mut().slice(&plane)?, &stored))
    }

    /// The boundary of the current mesh.
    pub fn surface(&mut self) -> Result<JsSurface, WebError> {
        let stored = self.file.stored()?;
        Ok(tools::boundary(&self.file.session_mut().view(), &stored))
    }

    /// The field at some points, three coordinates each; NaN outside of the mesh.
    pub fn probe(&mut self, points: &[f64]) -> Result<Vec<f64>, WebError> {
        self.file.info()?;
        tools::probe(self.file.session_mut().view(), points)
    }

    /// The field along a line.
    pub fn line(&mut self, from: &[f64], to: &[f64]) -> Result<JsProfile, WebError> {
        self.file.info()?;
        tools::line(self.file.session_mut().view(), from, to)
    }

    /// The streamlines from some seeds, three coordinates each, through the vector field of three fields.
    pub fn streamlines(
        &mut self,
        names: Vec<String>,
        seeds: &[f64],
        backward: bool,
        max_length: f64,
        max_steps: f64,
    ) -> Result<JsStreamlines, WebError> {
        let info = self.file.info()?;
        let fields = names
            .iter()
            .map(|name| field_index(info, &name.as_str().into()))
            .collect::<Result<Vec<_>, _>>()?;
        let fields: [usize; 3] = fields
            .try_into()
            .map_err(|_| WebError::bad_option("fields", "a vector field is the names of three fields"))?;
        let session = self.file.session_mut();
        let vectors = fields.map(|field| session.values(field));
        let vectors = vectors.each_ref().map(|v| &v[..]);
        tools::streamlines(session.view(), vectors, seeds, &Way { backward, max_length, max_steps })
    }

    /// Sums over the current mesh, a histogram by volume of so many bins from `low` to `high`, and the values below which these
    /// fractions of the volume lie; NaN is the end of the field's range.
    pub fn stats(&mut self, bins: u32, low: f64, high: f64, fractions: &[f64]) -> Result<JsStats, WebError> {
        let field = self.file.session_mut().field();
        let info = &self.file.info()?.fields[field];
        let low = if low.is_nan() { info.min } else { low };
        let high = if high.is_nan() { info.min + info.range() } else { high };
        tools::stats(&self.file.session_mut().view(), bins, [low, high], fractions)
    }

    /// A hash of the current mesh, the same wherever the same request was made.
    pub fn hash(&self) -> String {
        self.file.hash()
    }
}

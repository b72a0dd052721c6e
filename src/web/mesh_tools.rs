//! The class of the module that works on meshes: a copy of the mesh of a [`CoreSession`](super::CoreSession) in another module,
//! and what can be got out of it.
//!
//! Pages that only want the mesh itself do not download this. The copy is written by the package's JavaScript from one wasm
//! memory into the other, and only where the mesh has changed.

use super::error::WebError;
use super::places::places;
use super::stored::Stored;
use super::tools::{
    self, JsIsoSurface, JsProfile, JsSlice, JsStats, JsStreamlines, JsSurface, Way, put_fields,
};
use crate::mt::MeshChanges;
use crate::session::MeshFollower;
use crate::view::{IsoSurface, MeshView, NormalKind, Plane, Slice};
use js_sys::Float64Array;
use std::ops::Range;
use wasm_bindgen::prelude::wasm_bindgen;

/// A copy of a mesh, and the surfaces that follow its changes.
#[wasm_bindgen]
#[derive(Default)]
pub struct MeshTools {
    mesh: MeshCopy,
    surface: IsoSurface,
    slice: Slice,
    /// The plane of the slice.
    plane: Option<Plane>,
    /// What has changed since the surface and the slice were last asked for.
    surface_behind: MeshFollower,
    slice_behind: MeshFollower,
    /// How what is handed out is stored.
    stored: Stored,
}

/// The arrays of a [`MeshView`].
#[derive(Default)]
struct MeshCopy {
    positions: Vec<[f64; 3]>,
    field: Vec<f64>,
    tets: Vec<[u32; 4]>,
    neighbors: Vec<[u32; 4]>,
}

impl MeshCopy {
    fn view(&self) -> MeshView<'_> {
        let Self { positions, field, tets, neighbors } = self;
        MeshView { positions, field, tets, neighbors }
    }
}

#[wasm_bindgen]
impl MeshTools {
    /// Tools of an empty mesh.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        Self::default()
    }

    /// How arrays of single precision are stored: what [`CoreSession::stored`](super::CoreSession::stored) said.
    #[wasm_bindgen(js_name = setStored)]
    pub fn set_stored(&mut self, numbers: &[f64]) {
        self.stored = Stored::from_numbers(numbers);
    }

    /// Makes room for a mesh of so many points and tetrahedra, of which these ranges are written next: start and end of each. Says
    /// where the arrays are, as [`CoreSession::sources`](super::CoreSession::sources) does.
    pub fn change(
        &mut self,
        points: usize,
        tets: usize,
        changed_points: &[u32],
        changed_tets: &[u32],
    ) -> Vec<usize> {
        let changes = MeshChanges { vertices: ranges(changed_points), tets: ranges(changed_tets) };
        self.surface_behind.add(&changes, false);
        self.slice_behind.add(&changes, false);
        let MeshCopy { positions, field, tets: all, neighbors } = &mut self.mesh;
        positions.resize(points, [0.0; 3]);
        field.resize(points, 0.0);
        all.resize(tets, [0; 4]);
        neighbors.resize(tets, [0; 4]);
        places(&self.mesh.view())
    }

    /// The isosurfaces of the mesh at some values, as one; with normals of the field's gradient or of the triangles, and with the
    /// values of other fields, given at the points.
    pub fn isosurfaces(
        &mut self,
        values: &[f64],
        smooth: bool,
        fields: Vec<Float64Array>,
    ) -> Result<JsIsoSurface, WebError> {
        if !values.iter().all(|value| value.is_finite()) {
            return Err(WebError::new("bad-option", "the isovalue must be a finite number".to_owned()));
        }
        self.surface.set_normal_kind(if smooth { NormalKind::Smooth } else { NormalKind::Gradient });
        let mesh = self.mesh.view();
        let MeshChanges { vertices, tets } = self.surface_behind.take(mesh.positions.len(), mesh.tets.len());
        self.surface.update(&mesh, values, &vertices, &tets);
        let js = tools::iso_surface(&self.surface, &self.stored);
        put_fields(js.as_ref(), fields.iter().map(|field| self.surface.interpolate(&mesh, &field.to_vec())));
        Ok(js)
    }

    /// The section of the mesh with the plane `normal · p = offset`, with the values of other fields.
    pub fn slice(
        &mut self,
        normal: &[f64],
        offset: f64,
        fields: Vec<Float64Array>,
    ) -> Result<JsSlice, WebError> {
        let plane = tools::plane(normal, offset)?;
        let mesh = self.mesh.view();
        let MeshChanges { vertices, tets } = self.slice_behind.take(mesh.positions.len(), mesh.tets.len());
        if self.plane.replace(plane) == Some(plane) {
            self.slice.update(&mesh, &vertices, &tets);
        } else {
            self.slice.extract(&mesh, &plane);
        }
        let js = tools::section(&self.slice, &self.stored);
        put_fields(js.as_ref(), fields.iter().map(|field| self.slice.interpolate(&mesh, &field.to_vec())));
        Ok(js)
    }

    /// The boundary of the mesh, with the values of other fields.
    pub fn surface(&self, fields: Vec<Float64Array>) -> JsSurface {
        tools::boundary(&self.mesh.view(), fields.iter().map(Float64Array::to_vec), &self.stored)
    }

    /// The field at some points, three coordinates each; NaN outside of the mesh.
    pub fn probe(&self, points: &[f64]) -> Result<Vec<f64>, WebError> {
        tools::probe(self.mesh.view(), points)
    }

    /// The field along a line.
    pub fn line(&self, from: &[f64], to: &[f64]) -> Result<JsProfile, WebError> {
        tools::line(self.mesh.view(), from, to)
    }

    /// The streamlines from some seeds, three coordinates each, through the vector field whose components at the points are
    /// `x`, `y` and `z`.
    #[expect(clippy::too_many_arguments, reason = "wasm-bindgen passes no structures of slices")]
    pub fn streamlines(
        &self,
        x: &[f64],
        y: &[f64],
        z: &[f64],
        seeds: &[f64],
        backward: bool,
        max_length: f64,
        max_steps: f64,
    ) -> Result<JsStreamlines, WebError> {
        tools::streamlines(self.mesh.view(), [x, y, z], seeds, &Way { backward, max_length, max_steps })
    }

    /// Sums over the mesh, a histogram by volume of so many bins from `low` to `high`, and the values below which these
    /// fractions of the volume lie.
    pub fn stats(&self, bins: u32, low: f64, high: f64, fractions: &[f64]) -> Result<JsStats, WebError> {
        tools::stats(&self.mesh.view(), bins, [low, high], fractions)
    }
}

fn ranges(pairs: &[u32]) -> Vec<Range<u32>> {
    pairs.as_chunks::<2>().0.iter().map(|&[start, end]| start..end).collect()
}
